//! Columns of gears: torque that twist and backlash add to a joint.

use std::sync::{Arc, PoisonError};

use rig_shared::effects::SHAPES;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::{Source, add};
use crate::columns::kinds::is_gear;
use crate::columns::transmission::observer::Seen;
use crate::columns::transmission::{Driven, Load};
use crate::recordings::noise_floor;
use crate::rows::motion::{links_of, motion_of};
use crate::rows::nominal_torque::predict;
use crate::rows::regression::Rows;
use crate::search::fitted_candidate::FittedCandidate;

impl Source<'_> {
    /// Adds observer inputs from the recorded torque, for the profiles with an observer. `gains` are those of the
    /// columns, one effect after the other.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn following(
        mut self,
        rows: &Rows,
        chosen: &[FittedCandidate],
        gains: &[f64],
    ) -> Result<Self, DiagnoseError> {
        let asked: Vec<(usize, f64)> = (chosen.iter())
            .filter_map(|p| Some((p.candidate.joint, p.followed?.noise)))
            .collect();
        if asked.is_empty() {
            return Ok(self);
        }
        for r in 0..self.runs.len() {
            let run = &self.runs[r];
            let mut known = predict(self.nominal, self.robot, &self.values, run)?.torque;
            add(
                &mut known,
                &self.sum(r, chosen, gains, &|kind| !is_gear(kind))?,
            );
            for &(joint, noise) in &asked {
                let torque = &run.joints[joint].tau;
                let left = torque.iter().zip(&known[joint]).map(|(t, k)| t - k);
                let seen = Seen {
                    torque: left.collect(),
                    sure: rows.torque_valid(r, joint, run.len()),
                    noise: noise_floor::of_a_sample(noise, rows.period * run.rate),
                    unrest: noise,
                    smoothed: false,
                };
                self.seen.insert((r, joint), seen);
            }
        }
        Ok(self)
    }

    /// Makes the observer start each segment at its most likely state, also by the readings of that segment.
    pub(crate) fn smoothed(mut self) -> Self {
        self.seen.values_mut().for_each(|seen| seen.smoothed = true);
        self
    }

    /// Returns the torque that a gear adds to its joint, one signal per set of shapes. Zero if it fails.
    pub(crate) fn twisted(
        &self,
        candidate: &Candidate,
        shapes: &[[f64; SHAPES]],
        r: usize,
    ) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        let run = &self.runs[r];
        // The link encoder measures the gear's motion.
        if let Some(excess) = self.measured(candidate.joint, r)? {
            return Ok(vec![excess; shapes.len()]);
        }
        let driven = self.driven(candidate.joint, r)?;
        let load = Load {
            period: 1.0 / run.rate,
            speed: &run.joints[candidate.joint].qd,
            load: &self.predicted[r].load[candidate.joint],
            friction: self.friction(candidate.joint),
        };
        let excess = match self.seen.get(&(r, candidate.joint)) {
            Some(seen) => (shapes.iter())
                .map(|shapes| driven.followed(candidate.kind, shapes, &load, seen))
                .collect(),
            None => driven.excess(candidate.kind, shapes, &load),
        };
        Ok((excess.into_iter())
            .map(|excess| excess.unwrap_or_else(|| vec![0.0; run.len()]))
            .collect())
    }

    /// Returns the torque that the measured link motion adds to a joint over a run, compared with rigid gears. None
    /// without a link encoder on that joint.
    fn measured(&self, joint: usize, r: usize) -> Result<Option<Vec<f64>>, DiagnoseError> {
        let run = &self.runs[r];
        let own = &run.joints[joint];
        let Some([_, _, acceleration]) = &own.link else {
            return Ok(None);
        };
        let inertial = |[q, v, a]: [Vec<Vec<f64>>; 3]| {
            self.nominal.inertial(&self.values, joint, [&q, &v, &a])
        };
        let (rigid, measured) = (inertial(motion_of(run))?, inertial(links_of(run))?);
        let drive = self.drive_inertia(joint);
        let moved = acceleration
            .iter()
            .zip(&own.qdd)
            .map(|(l, m)| drive * (l - m));
        Ok(Some(
            (measured.iter().zip(&rigid).zip(moved))
                .map(|((with, without), drive)| with - without - drive)
                .collect(),
        ))
    }

    /// Returns the gear torque of a joint over a run for the measured link motion.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn load_of_link(&self, joint: usize, r: usize) -> Result<Vec<f64>, DiagnoseError> {
        let mut load = self.predicted[r].load[joint].clone();
        for (to, more) in load
            .iter_mut()
            .zip(self.measured(joint, r)?.iter().flatten())
        {
            *to += more;
        }
        Ok(load)
    }

    /// Returns the mean inertia behind a joint's gear over a run.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn mass(&self, joint: usize, r: usize) -> Result<f64, DiagnoseError> {
        Ok(self.driven(joint, r)?.mean_mass())
    }

    fn driven(&self, joint: usize, r: usize) -> Result<Arc<Driven>, DiagnoseError> {
        let mut known = self.driven.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(driven) = known.get(&(r, joint)) {
            return Ok(driven.clone());
        }
        let driven = Arc::new(Driven::of(
            self.nominal,
            &self.values,
            joint,
            self.drive_inertia(joint),
            &self.runs[r],
        )?);
        known.insert((r, joint), driven.clone());
        Ok(driven)
    }
}
