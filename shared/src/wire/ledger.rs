//! Memory of answered requests: a repeated request is carried out only once.

use super::message::{Acknowledge, Refusal};

/// Number of stored answers. The host has one request under way at a time, so one would suffice on a line that keeps
/// the order. The others are for keep-alives sent in between.
const REMEMBERED: usize = 8;

/// The rig's answers to the last requests, by number.
///
/// The host repeats a request with the same number until it is acknowledged. For a stored number the rig only repeats
/// the answer. `Hello` begins a new count: clear the ledger then.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ledger {
    entries: [Option<(u16, Result<(), Refusal>)>; REMEMBERED],
    next: usize,
}

impl Ledger {
    /// Returns a ledger without answers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the stored answer to request `id`; `None` if the request is new.
    pub fn answered(&self, id: u16) -> Option<Acknowledge> {
        self.entries.iter().flatten().find_map(|entry| {
            (entry.0 == id).then_some(Acknowledge {
                id,
                result: entry.1,
            })
        })
    }

    /// Stores the answer to request `id` and returns the acknowledgement to send.
    pub fn answer(&mut self, id: u16, result: Result<(), Refusal>) -> Acknowledge {
        if let Some(entry) = self.entries.get_mut(self.next % REMEMBERED) {
            *entry = Some((id, result));
        }
        self.next = (self.next + 1) % REMEMBERED;
        Acknowledge { id, result }
    }

    /// Clears the ledger, at `Hello`.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn answers_again_what_was_answered_and_forgets_at_hello() {
        let mut ledger = Ledger::new();
        assert_eq!(ledger.answered(0), None);
        let first = ledger.answer(0, Err(Refusal::WrongMode));
        assert_eq!(ledger.answered(0), Some(first));
        for id in 1..=REMEMBERED as u16 {
            ledger.answer(id, Ok(()));
        }
        assert_eq!(ledger.answered(0), None, "the oldest answer makes room");
        assert_eq!(
            ledger.answered(REMEMBERED as u16),
            Some(Acknowledge {
                id: REMEMBERED as u16,
                result: Ok(())
            })
        );
        ledger.clear();
        assert_eq!(ledger.answered(REMEMBERED as u16), None);
    }
}
