//! Numbers in the bytes of a file: integers and floats of 1 to 8 bytes.

/// Type of a number, with its length in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BinaryNumber {
    Unsigned(u8),
    Signed(u8),
    Float(u8),
}

impl BinaryNumber {
    /// Returns the length in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::Unsigned(n) | Self::Signed(n) | Self::Float(n) => usize::from(n),
        }
    }

    /// Reads one number of at most 8 bytes.
    pub(super) fn value(self, bytes: &[u8], is_big_endian: bool) -> f64 {
        let size = bytes.len();
        let mut raw = [0; 8];
        for (k, byte) in bytes.iter().enumerate() {
            raw[if is_big_endian { size - 1 - k } else { k }] = *byte;
        }
        let bits = u64::from_le_bytes(raw);
        match self {
            Self::Float(4) => f64::from(f32::from_bits(bits as u32)),
            Self::Float(_) => f64::from_bits(bits),
            Self::Unsigned(_) => bits as f64,
            Self::Signed(_) => {
                let spare = 64 - 8 * size as u32;
                ((bits << spare) as i64 >> spare) as f64
            }
        }
    }

    /// Reads all whole numbers of this type.
    pub(super) fn values(self, bytes: &[u8], is_big_endian: bool) -> Vec<f64> {
        let numbers = bytes.chunks_exact(self.size());
        numbers.map(|own| self.value(own, is_big_endian)).collect()
    }
}
