//! Fixed capacities of the kernels' buffers.

/// Calls a kernel with the smallest of a few fixed capacities that holds the chain. One joint must not pay for buffers
/// of sixteen, and one copy of the code for each length would not fit into the microcontroller.
macro_rules! with_capacity {
    ($n:expr, $kernel:ident($($argument:expr),* $(,)?)) => {
        match $n {
            0 | 1 => $kernel::<_, 1>($($argument),*),
            2..=8 => $kernel::<_, 8>($($argument),*),
            _ => $kernel::<_, { $crate::multibody::MAX_JOINTS }>($($argument),*),
        }
    };
}
pub(super) use with_capacity;
