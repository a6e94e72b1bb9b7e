//! Memory of answered requests: a repeated request is carried out only once.

use super::message::{Acknowledge, Refusal};

/// Number of stored answers. The host has one request under way at a time, so one would suffice on a line that keeps
/// the order. The others are for keep-alives sent in between.
const STORED_ANSWERS: usize = 8;

/// The rig's answers to the last requests, by number.
///
/// The host repeats a request with the same number until it is acknowledged. For a stored number the rig only repeats
/// the answer. `Hello` begins a new count: clear the log then.
#[derive(Clone, Copy, Debug, Default)]
pub struct AnswerLog {
    entries: [Option<(u16, Result<(), Refusal>)>; STORED_ANSWERS],
    next: usize,
}

impl AnswerLog {
    /// Returns a log without answers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the stored answer to request `id`; `None` if the request is new.
    pub fn stored_answer(&self, id: u16) -> Option<Acknowledge> {
        self.entries.iter().flatten().find_map(|entry| {
            (entry.0 == id).then_some(Acknowledge {
                id,
                result: entry.1,
            })
        })
    }

    /// Stores the answer to request `id` and returns the acknowledgement to send.
    pub fn record(&mut self, id: u16, result: Result<(), Refusal>) -> Acknowledge {
        if let Some(entry) = self.entries.get_mut(self.next % STORED_ANSWERS) {
            *entry = Some((id, result));
        }
        self.next = (self.next + 1) % STORED_ANSWERS;
        Acknowledge { id, result }
    }

    /// Clears the log, at `Hello`.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn answers_again_what_was_answered_and_forgets_at_hello() {
        let mut answer_log = AnswerLog::new();
        assert_eq!(answer_log.stored_answer(0), None);
        let first = answer_log.record(0, Err(Refusal::WrongMode));
        assert_eq!(answer_log.stored_answer(0), Some(first));
        for id in 1..=STORED_ANSWERS as u16 {
            answer_log.record(id, Ok(()));
        }
        assert_eq!(
            answer_log.stored_answer(0),
            None,
            "the oldest answer makes room"
        );
        assert_eq!(
            answer_log.stored_answer(STORED_ANSWERS as u16),
            Some(Acknowledge {
                id: STORED_ANSWERS as u16,
                result: Ok(())
            })
        );
        answer_log.clear();
        assert_eq!(answer_log.stored_answer(STORED_ANSWERS as u16), None);
    }
}
