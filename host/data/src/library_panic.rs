//! Calls into libraries that may panic on damaged files.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// True while this thread is in [`caught`].
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
}

type Hook = Box<dyn Fn(&PanicHookInfo<'_>) + Send + Sync>;

/// Returns what `work` returns; `None` if it panics, which then prints nothing.
///
/// What prints a panic is one hook of the whole process. It is wrapped once, at the first call, and stays: on the thread of a
/// call it is silent as long as the call lasts, and elsewhere nothing changes.
pub(super) fn caught<R>(work: impl FnOnce() -> R) -> Option<R> {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| set_hook(silent_in_calls(take_hook())));
    let outer = IS_CAUGHT.replace(true);
    // A panic leaves only what `work` changes, which the callers drop.
    let result = catch_unwind(AssertUnwindSafe(work));
    IS_CAUGHT.set(outer);
    result.ok()
}

/// Returns a hook that does nothing during a call of [`caught`], and else what `before` does.
fn silent_in_calls(before: Hook) -> Hook {
    Box::new(move |panic| {
        if !IS_CAUGHT.get() {
            before(panic);
        }
    })
}

#[cfg(test)]
#[allow(clippy::panic)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn a_panic_in_a_call_is_no_result_and_prints_nothing() {
        assert_eq!(caught(|| 7), Some(7));
        let (count, own) = (Arc::new(AtomicUsize::new(0)), std::thread::current().id());
        let counted = Arc::clone(&count);
        let before = take_hook();
        // Other tests may panic meanwhile.
        set_hook(silent_in_calls(Box::new(move |_| {
            let is_own = std::thread::current().id() == own;
            counted.fetch_add(usize::from(is_own), Ordering::Relaxed);
        })));
        let in_call = caught(|| -> u8 { panic!("damaged") });
        let in_inner = caught(|| caught(|| -> u8 { panic!("damaged") }));
        let silent = count.load(Ordering::Relaxed);
        let outside = catch_unwind(|| panic!("a defect"));
        let loud = count.load(Ordering::Relaxed);
        set_hook(before);
        assert_eq!((in_call, in_inner, silent), (None, Some(None), 0));
        assert!(outside.is_err() && loud == 1);
    }
}
