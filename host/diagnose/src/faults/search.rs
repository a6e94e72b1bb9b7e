//! Search for the faults of one recording by models: suspicions, their trial, and the recording without what is found.

use crate::DiagnoseError;
use crate::faults::finding::Fault;
use crate::faults::judge::Judge;
use crate::faults::suspicion::Suspicion;
use crate::outcome::FaultKind;

impl Judge<'_> {
    /// Returns the faults in the torque that no other explanation fits better, round by round. A certain fault is undone
    /// and the search repeats without its consequences; later rounds have certain faults only.
    pub(crate) fn faults(&self) -> Result<Vec<Vec<Fault>>, DiagnoseError> {
        let n = self.robot.joints.len();
        let clipped: Vec<Fault> = (0..n).filter_map(|j| self.clipped(j)).collect();
        let (found, mut undo) = self.tried(self.suspicions()?)?;
        let lost = found
            .iter()
            .any(|fault| fault.finding.kind() == FaultKind::Magnitude && fault.is_certain());
        if !clipped.is_empty() && !lost {
            return Ok(vec![clipped]);
        }
        let mut rounds = vec![found];
        let mut rows = self.rows.clone();
        for _ in 0..n {
            // Undoing a fault of the description gives another robot.
            let Some(one) = undo.filter(|undo| !undo.is_of_robot()) else {
                break;
            };
            rows = one.applied(self.robot, &rows);
            let without = Judge::of_rows(self.robot, self.runs, self.units, rows.clone())?;
            let (mut more, next) = without.tried(without.suspicions()?)?;
            more.retain(Fault::is_certain);
            rounds.push(more);
            undo = next;
        }
        Ok(rounds)
    }

    /// Returns the faults that the torque suggests.
    fn suspicions(&self) -> Result<Vec<Suspicion>, DiagnoseError> {
        let n = self.robot.joints.len();
        // The last joint's torque needs the fewest described links.
        let described = self.stated(&self.rows, n.saturating_sub(1))?;
        let described = described.as_ref();
        let mut all: Vec<Suspicion> = (0..n)
            .filter_map(|j| self.magnitude(j, described))
            .collect();
        let (transformed, rivals): (Vec<_>, Vec<_>) = self
            .transformed()?
            .into_iter()
            .partition(|found| found.alone);
        let (turned, others): (Vec<_>, Vec<_>) = transformed
            .into_iter()
            .partition(|found| found.undo.is_of_sense());
        let (zeros, others): (Vec<_>, Vec<_>) = others
            .into_iter()
            .partition(|found| found.undo.is_of_zero());
        all.extend(others.iter().filter_map(|found| self.said(found)));
        // Factors that the torques show without a description.
        all.extend(self.positions()?);
        all.extend((0..n).filter_map(|j| self.shifted(j)));
        all.extend(self.thousandfold(described));
        all.extend(self.single_zero()?);
        for j in (0..n).filter(|j| self.stirs(*j)) {
            let before = all.len();
            all.extend(self.against_description(j, described)?);
            all.extend(self.sign(j, described)?);
            if all.len() == before {
                all.extend(self.alike(j, described)?);
            }
            all.extend(self.heavy_rotor(j)?);
        }
        // Senses and zeros come last: other explanations of a recording are likelier.
        let last = turned.iter().chain(&zeros);
        all.extend(last.filter_map(|found| self.said(found)));
        // What explains less is compared with what is suspected, but raises nothing alone.
        if all.iter().any(|own| own.undo.is_some()) {
            let said = rivals.iter().filter_map(|found| self.said(found));
            all.extend(said.map(|own| Suspicion {
                is_rival: true,
                ..own
            }));
        }
        // A suspicion with two reasons is tried once.
        let mut once: Vec<Suspicion> = Vec::new();
        for own in all {
            if once.iter().all(|other| !other.is_like(&own)) {
                once.push(own);
            }
        }
        Ok(once)
    }
}
