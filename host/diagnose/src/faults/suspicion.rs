//! Suspected faults.

use crate::faults::finding::Fault;
use crate::faults::undo::Undo;

/// A suspected fault.
#[derive(Clone, Debug)]
pub(crate) struct Suspicion {
    pub(crate) fault: Fault,
    /// How it is undone; `None` if columns alone show it, without a model.
    pub(crate) undo: Option<Undo>,
    /// True if it is only compared with the others: it is told if it is certain, never as open.
    pub(crate) is_rival: bool,
}

impl Suspicion {
    pub(crate) fn new(fault: Fault, undo: Undo) -> Self {
        Self {
            fault,
            undo: Some(undo),
            is_rival: false,
        }
    }

    /// A fault that columns alone show.
    pub(crate) fn of_columns(fault: Fault) -> Self {
        Self {
            fault,
            undo: None,
            is_rival: false,
        }
    }

    /// Returns true if both are undone alike.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let both = self.undo.as_ref().zip(other.undo.as_ref());
        both.is_some_and(|(own, other)| own.is_like(other))
    }
}
