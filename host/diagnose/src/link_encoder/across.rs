//! Analysis of the link encoders, joint by joint.

use rig_shared::effects::Kind;

use crate::acceptance::residual_dependence::locate;
use crate::columns::effect_columns::Source;
use crate::columns::kinds::is_gear;
use crate::description::parameter_prior::ParameterPrior;
use crate::fit::least_squares::Fit;
use crate::fit::solution::Solution;
use crate::levels::SIGNIFICANT;
use crate::link_encoder::analysis::{Fitted, TransmissionAnalysis};
use crate::link_encoder::contact::contact;
use crate::link_encoder::equation::Equation;
use crate::link_encoder::law::{Found, Law, beside, laws};
use crate::link_encoder::result::Across;
use crate::recordings::context::PreparedData;
use crate::recordings::noise_floor;
use crate::result::places::place;
use crate::rows::regression::Column;
use crate::{DiagnoseError, Options};

/// Analyses the link encoders, joint by joint. `after` are the coefficients of the free nominal directions, with their
/// covariance.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn across(
    source: &Source,
    anchor: &ParameterPrior,
    after: &Solution,
    prepared: &PreparedData,
    held_out: Option<(&Source, &PreparedData)>,
    options: &Options,
) -> Result<Vec<Across>, DiagnoseError> {
    let mut list = Vec::new();
    for joint in 0..source.robot.joints.len() {
        let Some(training) =
            Equation::of(source, joint, prepared, &prepared.position_filter()?, None)?
        else {
            continue;
        };
        let held = match held_out {
            Some((of, held_out)) => {
                let filter = held_out.position_filter()?;
                Equation::of(of, joint, held_out, &filter, Some(&training.sides))?
            }
            None => None,
        };
        list.extend(
            TransmissionAnalysis {
                source,
                anchor,
                after,
                joint,
                training: &training,
                held: held.as_ref(),
                options,
            }
            .said(),
        );
    }
    Ok(list)
}

impl TransmissionAnalysis<'_, '_> {
    /// Returns the results of the joint; `None` if its coefficients cannot be solved for.
    fn said(&self) -> Option<Across> {
        let equation = self.training;
        let rows = &equation.rows;
        let name = &self.source.robot.joints[self.joint].name;
        let nominal: Vec<&Column> = rows.nominal.iter().collect();
        let first = Fit::new(rows, vec![1.0], 0.1).taking(nominal.iter().copied());
        let weight = 1.0 / first.rms(0).max(f64::MIN_POSITIVE);
        let memory = noise_floor::memory(rows, &[first.residual(0)]);
        let plain = Fit::new(rows, vec![weight], memory);
        let base = plain.clone().taking(nominal.iter().copied());
        let mut laws = laws(equation, &base, name, &self.options.without);
        let (mut touch, mut settled) = (None, false);
        let (last, floor, solved) = loop {
            let last = beside(equation, &base, &laws.found, None);
            let residual = last.residual(0);
            let floor = noise_floor::from_repeats(rows, &equation.pairs, &residual, None, 0)
                .map(|repeated| repeated.noise)
                .unwrap_or_else(|| equation.short_time(&residual));
            let memory = noise_floor::memory(rows, &[residual]);
            let solved = self.solved(&plain.clustered(memory, &equation.pairs), &base, &laws)?;
            if settled {
                break (last, floor, solved);
            }
            // Gear torque separates backlash from elasticity better than its sign does.
            settled = true;
            let is_gear = |f: &Found| matches!(f.law, Law::Twist | Law::Play(_));
            if laws.found.iter().any(is_gear) {
                let excluded = self.options.without.contains(&Kind::Backlash);
                touch = contact(equation, &solved.solution.values).filter(|_| !excluded);
                laws.play_is(equation, &base, touch.as_ref());
            }
        };
        let gear = self.gear(&solved, &base, &laws, touch.as_ref());
        let fitted = Fitted {
            base: &base,
            last: &last,
            laws: &laws,
            solved: &solved,
            floor,
        };
        let mut named = self.named(&fitted, gear.as_ref());
        // Effects between motor and link come first.
        named.sort_by_key(|n| !is_gear(n.kind));
        let coordinates = equation.coordinates();
        let places = locate(
            rows,
            &coordinates,
            &base.residual(0),
            None,
            base.block_of_rows(),
            0,
            name,
            floor,
            self.options.seed,
        );
        let reading = self.reading(&fitted, gear.as_ref());
        let detectable = self.detectable(&fitted);
        Some(Across {
            joint: self.joint,
            gear: gear.map(|g| (g.kind, g.shapes)),
            places: (places.into_iter())
                .filter(|p| p.p_value < SIGNIFICANT && !named.is_empty())
                .take(1)
                .map(|p| place(&p))
                .collect(),
            named,
            detectable,
            tried: laws.tried,
            reading,
        })
    }
}
