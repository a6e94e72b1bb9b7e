//! Counts of used and excluded rows.

use rig_data::prepare::Masked;

/// Counts of excluded rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Used rows over all equations.
    pub used: u64,
    /// Per joint (or window), too slow.
    pub slow: Vec<u64>,
    /// Per joint (or window), saturated.
    pub saturated: Vec<u64>,
    /// Per joint (or window), with a current that had not settled.
    pub unsettled: Vec<u64>,
    /// Rows, before decimation, in segments too short for the filters.
    pub short: u64,
}

impl Tally {
    pub(crate) fn count(list: &mut Vec<u64>, k: usize) {
        if list.len() <= k {
            list.resize(k + 1, 0);
        }
        list[k] += 1;
    }

    /// Counts a row of joint `k` (or a window) that is saturated, not settled or slow, or else used. Returns true if it is
    /// used.
    pub(crate) fn decide(&mut self, k: usize, [saturated, unsettled, slow]: [bool; 3]) -> bool {
        let list = match () {
            () if saturated => &mut self.saturated,
            () if unsettled => &mut self.unsettled,
            () if slow => &mut self.slow,
            () => {
                self.used += 1;
                return true;
            }
        };
        Self::count(list, k);
        false
    }

    /// Adds another count.
    pub(crate) fn add(&mut self, part: &Self) {
        self.used += part.used;
        self.short += part.short;
        for (list, more) in [
            (&mut self.slow, &part.slow),
            (&mut self.saturated, &part.saturated),
            (&mut self.unsettled, &part.unsettled),
        ] {
            list.resize(list.len().max(more.len()), 0);
            for (a, b) in list.iter_mut().zip(more) {
                *a += b;
            }
        }
    }

    /// Returns the counts as entries for a report.
    pub fn masked(&self) -> Vec<Masked> {
        let entries = |list: &[u64], why: &str| {
            list.iter()
                .enumerate()
                .filter(|(_, rows)| **rows > 0)
                .map(|(k, rows)| Masked {
                    joint: k + 1,
                    rows: *rows,
                    why: why.to_owned(),
                })
                .collect::<Vec<_>>()
        };
        let mut all = entries(
            &self.slow,
            "speed of the joint, or of a motor coupled to it, below the threshold: friction there is not Coulomb and viscous, or its sign is not known",
        );
        all.extend(entries(&self.saturated, "torque at its limit"));
        all.extend(entries(
            &self.unsettled,
            "current read before its amplifier had settled after an edge of the bridge",
        ));
        if self.short > 0 {
            all.push(Masked {
                joint: 0,
                rows: self.short,
                why: "rows of stretches between gaps in time that are too short for the filters"
                    .into(),
            });
        }
        all
    }
}
