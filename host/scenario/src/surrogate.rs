//! Surrogate recordings: noise with the spectrum of the residual replaces the residual.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use super::dice::Dice;
use super::error::ScenarioError;
use super::made::Made;
use super::size::{Equation, Problem};
use rig_data::prepare::InMemory;

impl Made {
    /// Replaces the residual of the nominal model by noise with the same spectrum (Theiler et al. 1992, new phases for
    /// each recording). The new residual does not depend on the motion.
    ///
    /// # Errors
    /// The motion does not excite the nominal model.
    pub fn phase_randomised(mut self, seed: u64) -> Result<Self, ScenarioError> {
        randomise(&mut self.train, seed, 6)?;
        if let Some(repeat) = &mut self.repeat {
            randomise(repeat, seed, 7)?;
        }
        randomise(&mut self.holdout, seed, 8)?;
        if let Some(again) = &mut self.held_again {
            randomise(again, seed, 9)?;
        }
        self.truth.hidden.clear();
        Ok(self)
    }
}

fn randomise(recording: &mut InMemory, seed: u64, purpose: u64) -> Result<(), ScenarioError> {
    let mut dice = Dice::new(seed, purpose);
    for block in &mut recording.blocks {
        let model = Problem::of(block, Equation::Torque)?.explained(block)?;
        let Some(joint) = block.joints.first_mut() else {
            continue;
        };
        // The reading of the link encoder does not fit the new torque.
        joint.link = None;
        let mut left: Vec<f64> = joint.tau.iter().zip(&model).map(|(t, m)| t - m).collect();
        let length = left.len() as f64;
        let mut planner = RealFftPlanner::<f64>::new();
        let forward = planner.plan_fft_forward(left.len());
        let back = planner.plan_fft_inverse(left.len());
        let mut spectrum = forward.make_output_vec();
        let failed = |error: realfft::FftError| ScenarioError(format!("no spectrum: {error}"));
        forward.process(&mut left, &mut spectrum).map_err(failed)?;
        // The mean and the highest frequency are real and have no free phase.
        let last = spectrum.len().saturating_sub(1);
        for line in spectrum.iter_mut().take(last).skip(1) {
            *line = Complex::from_polar(line.norm(), dice.phase());
        }
        back.process(&mut spectrum, &mut left).map_err(failed)?;
        for ((tau, model), left) in joint.tau.iter_mut().zip(model).zip(left) {
            *tau = model + left / length;
        }
    }
    Ok(())
}
