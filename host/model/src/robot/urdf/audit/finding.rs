//! What an audit finds.

use crate::robot::error::Place;

/// One doubtful value of a URDF file.
#[derive(Clone, Debug, PartialEq)]
pub struct AuditFinding {
    /// The check that found it, such as `mass`.
    pub check: &'static str,
    /// The link or the joint.
    pub name: String,
    /// Where it stands in the file.
    pub place: Place,
    /// One sentence, without the place.
    pub sentence: String,
}

/// What was looked at, and how much of it.
#[derive(Clone, Debug, PartialEq)]
pub struct AuditCheck {
    /// Name of the check.
    pub check: &'static str,
    /// Its object in words, such as "masses of links".
    pub of: &'static str,
    /// Number of objects.
    pub count: usize,
}

/// Result of an audit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Audit {
    /// Checks that were made.
    pub checks: Vec<AuditCheck>,
    /// What could not be checked, one sentence each.
    pub unchecked: Vec<String>,
    /// Findings in the order of the file.
    pub findings: Vec<AuditFinding>,
}

impl Audit {
    /// Adds a check of `count` objects.
    pub(super) fn checked(&mut self, check: &'static str, of: &'static str, count: usize) {
        self.checks.push(AuditCheck { check, of, count });
    }

    /// Adds a finding.
    pub(super) fn find(&mut self, check: &'static str, name: &str, place: Place, sentence: String) {
        self.findings.push(AuditFinding {
            check,
            name: name.to_owned(),
            place,
            sentence,
        });
    }
}
