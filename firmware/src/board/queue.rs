//! Queues between the tick and the tasks: heapless's, which take no lock, with one thing told to the compiler.

use heapless::spsc::{Consumer, Producer};
use rig_firmware::clerk::Notes;
use rig_firmware::note::Note;

/// Longer than any queue here.
const LONGEST: usize = 1024;

/// The end that things are put into.
pub(crate) struct Inlet<T: 'static>(pub(crate) Producer<'static, T>);

/// The end that they come out of.
pub(crate) struct Outlet<T: 'static>(pub(crate) Consumer<'static, T>);

impl<T> Inlet<T> {
    /// Puts something in; false where there is no room.
    #[inline(always)]
    pub(crate) fn put(&mut self, thing: T) -> bool {
        self.has_places();
        self.0.enqueue(thing).is_ok()
    }

    /// Things inside.
    #[inline(always)]
    fn len(&self) -> usize {
        self.has_places();
        self.0.len()
    }

    /// The ring's length is no constant to the compiler, which would guard the division by it with a panic.
    #[inline(always)]
    fn has_places(&self) {
        // Every queue here has a place: its length is a constant above 0 where it is made.
        #[allow(unsafe_code)]
        unsafe {
            core::hint::assert_unchecked(self.0.capacity() < LONGEST);
        }
    }
}

impl<T> Outlet<T> {
    /// The oldest, where it lies: things here are large, and copying takes a tick's time.
    #[inline(always)]
    pub(crate) fn oldest(&self) -> Option<&T> {
        self.has_places();
        self.0.peek()
    }

    /// Gives the oldest's place free.
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

    /// Half of the places are for everything but snapshots and answers.
    #[inline(always)]
    fn roomy(&self) -> bool {
        self.len() < self.0.capacity() / 2
    }
}
