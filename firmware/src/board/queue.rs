//! Lock-free queues between the tick and the tasks (heapless), with a hint for the compiler.

use heapless::spsc::{Consumer, Producer};
use rig_firmware::clerk::Notes;
use rig_firmware::note::Note;

/// Bound on the length of every queue here.
const LONGEST: usize = 1024;

/// The input end.
pub(crate) struct Inlet<T: 'static>(pub(crate) Producer<'static, T>);

/// The output end.
pub(crate) struct Outlet<T: 'static>(pub(crate) Consumer<'static, T>);

impl<T> Inlet<T> {
    /// Adds an element; returns false if the queue is full.
    #[inline(always)]
    pub(crate) fn put(&mut self, thing: T) -> bool {
        self.has_places();
        self.0.enqueue(thing).is_ok()
    }

    /// Returns the number of elements.
    #[inline(always)]
    fn len(&self) -> usize {
        self.has_places();
        self.0.len()
    }

    /// Tells the compiler that the length is not 0. It would otherwise guard the division by the length with a panic.
    #[inline(always)]
    fn has_places(&self) {
        // The length of every queue here is a constant above 0.
        #[allow(unsafe_code)]
        unsafe {
            core::hint::assert_unchecked(self.0.capacity() < LONGEST);
        }
    }
}

impl<T> Outlet<T> {
    /// Returns the oldest element in place: elements are large, and copying takes time of the tick.
    #[inline(always)]
    pub(crate) fn oldest(&self) -> Option<&T> {
        self.has_places();
        self.0.peek()
    }

    /// Removes the oldest element.
    #[inline(always)]
    pub(crate) fn release(&mut self) {
        self.has_places();
        drop(self.0.dequeue());
    }

    #[inline(always)]
    fn has_places(&self) {
        // As above.
        #[allow(unsafe_code)]
        unsafe {
            core::hint::assert_unchecked(self.0.capacity() < LONGEST);
        }
    }
}

impl Notes for Inlet<Note> {
    #[inline(always)]
    fn put(&mut self, note: Note) -> bool {
        Self::put(self, note)
    }

    /// Returns true if more than half is free. The other half is reserved for everything except snapshots and answers.
    #[inline(always)]
    fn roomy(&self) -> bool {
        self.len() < self.0.capacity() / 2
    }
}
