//! A request that was sent twice is carried out once.

use super::message::{Acknowledge, Refusal};

/// Answers that the rig remembers. The host has one request under way at a time, so that one would do on a
/// line that keeps the order; the others are for keep-alives sent in between.
const REMEMBERED: usize = 8;

/// What the rig answered to the last requests, by number.
///
/// The host repeats a request with the same number until it is acknowledged. The rig looks here first:
/// a number that stands here is only answered again, not carried out again. `Hello` begins a new count:
/// clear the ledger then.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ledger {
    entries: [Option<(u16, Result<(), Refusal>)>; REMEMBERED],
    next: usize,
}

impl Ledger {
    /// Nothing answered yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The answer given before to request `id`, to be sent again; `None` where it is new.
    pub fn answered(&self, id: u16) -> Option<Acknowledge> {
        self.entries.iter().flatten().find_map(|entry| {
            (entry.0 == id).then_some(Acknowledge {
                id,
                result: entry.1,
            })
        })
    }

    /// Notes the answer to request `id` and gives it as it is to be sent.
    pub fn answer(&mut self, id: u16, result: Result<(), Refusal>) -> Acknowledge {
        if let Some(entry) = self.entries.get_mut(self.next % REMEMBERED) {
            *entry = Some((id, result));
        }
        self.next = (self.next + 1) % REMEMBERED;
        Acknowledge { id, result }
    }

    /// Forgets everything, at `Hello`.
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
