//! Lock-free queues between the tick and the tasks (heapless), with a hint for the compiler.

use core::sync::atomic::AtomicBool;

use heapless::spsc::{Consumer, Producer};
use rig_firmware::event::Event;
use rig_firmware::tick_session::EventSink;

/// A request with the number of urgent requests that were received before it.
#[derive(Clone)]
pub(crate) struct Numbered<T> {
    pub(crate) request: T,
    pub(crate) urgent_before: u32,
}

/// True if the queue of urgent requests may hold one. The tick looks at it in place of the queue, which takes longer.
pub(crate) static URGENT_WAITS: AtomicBool = AtomicBool::new(false);

/// Bound on the length of every queue here.
const CAPACITY_BOUND: usize = 1024;

/// The input end.
pub(crate) struct QueueSender<T: 'static>(pub(crate) Producer<'static, T>);

/// The output end.
pub(crate) struct QueueReceiver<T: 'static>(pub(crate) Consumer<'static, T>);

impl<T> QueueSender<T> {
    /// Adds an element; returns false if the queue is full.
    #[inline(always)]
    pub(crate) fn push(&mut self, element: T) -> bool {
        self.assume_bounded_capacity();
        self.0.enqueue(element).is_ok()
    }

    /// Returns the number of elements.
    #[inline(always)]
    fn len(&self) -> usize {
        self.assume_bounded_capacity();
        self.0.len()
    }

    /// Tells the compiler that the length is not 0. It would otherwise guard the division by the length with a panic.
    #[inline(always)]
    fn assume_bounded_capacity(&self) {
        // The length of every queue here is a constant above 0.
        #[allow(unsafe_code)]
        unsafe {
            core::hint::assert_unchecked(self.0.capacity() < CAPACITY_BOUND);
        }
    }
}

impl<T> QueueReceiver<T> {
    /// Returns the oldest element in place: elements are large, and copying takes time of the tick.
    #[inline(always)]
    pub(crate) fn oldest(&self) -> Option<&T> {
        self.assume_bounded_capacity();
        self.0.peek()
    }

    /// Removes the oldest element.
    #[inline(always)]
    pub(crate) fn release(&mut self) {
        self.assume_bounded_capacity();
        drop(self.0.dequeue());
    }

    #[inline(always)]
    fn assume_bounded_capacity(&self) {
        // As above.
        #[allow(unsafe_code)]
        unsafe {
            core::hint::assert_unchecked(self.0.capacity() < CAPACITY_BOUND);
        }
    }
}

impl EventSink for QueueSender<Event> {
    #[inline(always)]
    fn push(&mut self, event: Event) -> bool {
        Self::push(self, event)
    }

    /// Returns true if more than half is free. The other half is reserved for everything except snapshots and answers.
    #[inline(always)]
    fn has_room(&self) -> bool {
        self.len() < self.0.capacity() / 2
    }
}
