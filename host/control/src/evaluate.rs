//! Laws on a robot: run, measured, and run again with wrong parameters.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::adaptation::Excitation;
use super::closed_loop::{Trace, closed_loop};
use super::contact_task::ContactTask;
use super::controller::{Controller, limits, regressor};
use super::error::ControlError;
use super::force_sensing;
use super::law_model::LawModel;
use super::measures::{self, PLOTTED};
use super::motor_limits;
use super::position_limits::PositionLimits;
use super::result::{Adaptation, Adapted, Contact, Robustness, Tracking};
use super::settings::{LawKind, Settings};
use super::task_path;
use super::warnings;
use rig_model::robot::Robot;
use rig_model::simulate::Model;
use rig_numerics::statistics::median_of_finite;
use rig_shared::trajectory::Reference;

/// The true robot, and what is asked of it.
pub struct Bench<'a> {
    /// Description of the true robot.
    pub robot: &'a Robot,
    /// Its model.
    pub truth: &'a Model,
    /// Desired motion, one series a joint.
    pub reference: &'a [Vec<Reference<f64>>],
    /// Tool point in the frame of the last joint, m.
    pub tool: [f64; 3],
    /// Settings of the loop.
    pub settings: Settings,
    /// Share of wrong parameters, and number of draws; `None` for none.
    pub wrong: Option<(f64, usize)>,
}

/// A motion with its measures.
pub struct Run<M> {
    /// The motion.
    pub trace: Trace,
    /// The measures.
    pub measures: M,
    /// What the law leaves out, one sentence each.
    pub notes: Vec<String>,
}

/// A motion with what its law says.
struct Moved {
    trace: Trace,
    notes: Vec<String>,
    bandwidth: f64,
    slower: Option<String>,
}

impl Bench<'_> {
    /// Runs a law with a model.
    fn run(
        &self,
        law: LawKind,
        model: &LawModel,
        task: Option<&ContactTask>,
    ) -> Result<Moved, ControlError> {
        PositionLimits::of(self.robot).check(self.reference, self.settings.period())?;
        let mut controller = Controller::design(law, model, self.reference, task, &self.settings)?;
        let truth = (self.robot, self.truth);
        let trace = closed_loop(truth, &mut controller, self.reference, task, &self.settings)?;
        Ok(Moved {
            trace,
            notes: controller.notes().to_vec(),
            bandwidth: controller.bandwidth(),
            slower: controller.slower().map(str::to_owned),
        })
    }

    /// Runs and measures a law that tracks a motion. `name` is that of the model.
    ///
    /// # Errors
    /// [`ControlError`], with time and joint if the loop is unstable.
    pub fn track(
        &self,
        law: LawKind,
        model: &LawModel,
        name: &str,
    ) -> Result<Run<Tracking>, ControlError> {
        let Moved {
            trace,
            notes,
            bandwidth,
            slower,
        } = self.run(law, model, None)?;
        let [tool_rms, tool_largest] =
            measures::tool(&self.truth.chain, self.tool, &trace, self.reference)?;
        let measure = |trace: &Trace| {
            measures::tool(&self.truth.chain, self.tool, trace, self.reference).map(|[rms, _]| rms)
        };
        let ticks = measures::ticks(trace.q[0].len());
        let pick = |list: &[f64]| -> Vec<f64> { ticks.clone().map(|k| list[k]).collect() };
        let errors = (0..trace.q.len()).map(|j| pick(&measures::errors(&trace, self.reference, j)));
        let adaptation = match law {
            LawKind::Adaptive => Some(self.adaptation(model, &trace)?),
            _ => None,
        };
        let mut warnings: Vec<String> = slower.into_iter().collect();
        warnings.extend(warnings::of_motion(self.robot, &trace, false));
        warnings.extend(motor_limits::exceeded(self.robot, &trace)?);
        warnings.extend(adaptation.as_ref().and_then(warnings::of_adaptation));
        let robustness = self.robustness(law, model, None, measure)?;
        warnings.extend(robustness.as_ref().and_then(warnings::of_failures));
        let measures = Tracking {
            law,
            model: name.to_owned(),
            bandwidth,
            joints: measures::joints(self.robot, &trace, self.reference),
            tool_rms,
            tool_largest,
            robustness,
            adaptation,
            warnings,
            motion: String::new(),
            time: ticks.clone().map(|k| k as f64 * trace.period).collect(),
            errors: errors.collect(),
            torques: trace.torque.iter().map(|list| pick(list)).collect(),
        };
        Ok(Run {
            trace,
            measures,
            notes,
        })
    }

    /// Runs and measures a law that presses on a surface.
    ///
    /// # Errors
    /// [`ControlError`]; [`ControlError::Unreachable`] if the tool does not touch the surface.
    pub fn press(
        &self,
        law: LawKind,
        model: &LawModel,
        name: &str,
        task: &ContactTask,
    ) -> Result<Run<Contact>, ControlError> {
        task_path::check(self.robot, task)?;
        let sensor = force_sensing::check(self.robot, &self.truth.chain, task)?;
        let Moved {
            trace, mut notes, ..
        } = self.run(law, model, Some(task))?;
        notes.extend(sensor);
        let found = measures::force(law, task, &trace)?;
        let measure = |trace: &Trace| measures::force(law, task, trace).map(|own| own.overshoot);
        let mut warnings = warnings::of_motion(self.robot, &trace, true);
        warnings.extend(motor_limits::exceeded(self.robot, &trace)?);
        warnings.extend(warnings::of_force(law, &found, task, &self.settings));
        let touching = trace.force.iter().filter(|force| **force > 0.0).count();
        warnings.extend(force_sensing::beyond_range(
            self.robot,
            trace.beyond_range,
            touching,
        ));
        let robustness = self.robustness(law, model, Some(task), measure)?;
        let draws = robustness.as_ref();
        warnings.extend(draws.and_then(|draws| warnings::of_wrong_models(law, draws, task)));
        warnings.extend(draws.and_then(warnings::of_failures));
        let ticks = measures::ticks(trace.force.len());
        let pick = |list: &[f64]| -> Vec<f64> {
            ticks.clone().filter_map(|k| list.get(k)).copied().collect()
        };
        let measures = Contact {
            law,
            model: name.to_owned(),
            force: task.force,
            touched: found.touched,
            impact_speed: found.impact_speed,
            rise: found.rise,
            overshoot: found.overshoot,
            overshoot_before_slide: found.overshoot_before_slide,
            settling: found.settling,
            steady_error: found.steady_error,
            slide_force: found.slide_force,
            slide_peak: found.slide_peak,
            slide_error: found.slide_error,
            bounces: found.bounces,
            robustness,
            warnings,
            motion: String::new(),
            time: ticks.clone().map(|k| k as f64 * trace.period).collect(),
            forces: pick(&trace.force),
            positions: [pick(&trace.tool[0]), pick(&trace.tool[1])],
        };
        Ok(Run {
            trace,
            measures,
            notes,
        })
    }

    /// Runs a law with random wrong parameters, several motions at a time. Draw k has the same parameters for every law.
    fn robustness(
        &self,
        law: LawKind,
        model: &LawModel,
        task: Option<&ContactTask>,
        measure: impl Fn(&Trace) -> Result<f64, ControlError> + Sync,
    ) -> Result<Option<Robustness>, ControlError> {
        let Some((share, draws)) = self.wrong else {
            return Ok(None);
        };
        let models = (0..draws).map(|k| {
            let mut own = model.clone();
            own.disturb(share, seed_of_draw(self.settings.seed, k as u64));
            own
        });
        let models: Vec<LawModel> = models.collect();
        let next = AtomicUsize::new(0);
        let found = Mutex::new((0..draws).map(|_| None).collect::<Vec<_>>());
        let workers = std::thread::available_parallelism().map_or(1, |count| count.get());
        std::thread::scope(|scope| {
            for _ in 0..workers.min(draws) {
                scope.spawn(|| {
                    while let Some((k, model)) = {
                        let k = next.fetch_add(1, Ordering::Relaxed);
                        models.get(k).map(|model| (k, model))
                    } {
                        let value = self
                            .run(law, model, task)
                            .and_then(|moved| measure(&moved.trace));
                        if let Ok(mut list) = found.lock() {
                            list[k] = Some(value);
                        }
                    }
                });
            }
        });
        let (mut values, mut failures) = (Vec::new(), Vec::new());
        for value in found.into_inner().unwrap_or_default().into_iter().flatten() {
            match value {
                Ok(value) => values.push(value),
                Err(error) => failures.push(error),
            }
        }
        Ok(Some(Robustness {
            share,
            draws,
            failed: draws - values.len(),
            reason: failures.first().map(ToString::to_string),
            worst: values.iter().copied().fold(f64::NAN, f64::max),
            median: median_of_finite(values).unwrap_or(f64::NAN),
        }))
    }

    /// Compares the parameters of the adaptive law with those of the true robot, where the motion excites them.
    fn adaptation(&self, model: &LawModel, trace: &Trace) -> Result<Adaptation, ControlError> {
        let controller = Controller::design(
            LawKind::Adaptive,
            model,
            self.reference,
            None,
            &self.settings,
        )?;
        let truth = LawModel::of(self.robot)?;
        let Some(parameters) = controller.parameters() else {
            return Err(ControlError::Unreachable(
                "The adaptive law has no parameters.".to_owned(),
            ));
        };
        let scale: Vec<f64> = (limits(model, self.reference).iter().enumerate())
            .map(|(j, [torque, _])| match torque.is_finite() {
                true => *torque,
                false => trace.torque[j].iter().map(|t| t.abs()).fold(1e-9, f64::max),
            })
            .collect();
        let stride = self.reference[0].len().div_ceil(PLOTTED).max(1);
        let regressor = regressor(model, &self.settings);
        let excitation = Excitation::of(parameters, &regressor, self.reference, &scale, stride)?;
        let true_values = parameters.values(&truth);
        let course: Vec<[f64; 2]> = (trace.theta.iter())
            .map(|(_, theta)| excitation.error(theta, &true_values, &parameters.size))
            .collect();
        let (first, last) = (&trace.theta[0].1, &trace.theta[trace.theta.len() - 1].1);
        let ends = |k: usize| [course[0][k], course[course.len() - 1][k]];
        Ok(Adaptation {
            count: true_values.len(),
            excited: excitation.directions,
            error: ends(0),
            torque_error: ends(1),
            parameters: (0..true_values.len())
                .map(|k| Adapted {
                    expression: parameters.base.expression(k),
                    unit: parameters.base.unit(k),
                    truth: true_values[k],
                    start: first[k],
                    end: last[k],
                    excited: excitation.share(k),
                })
                .collect(),
            time: trace.theta.iter().map(|(t, _)| *t).collect(),
            course: [0, 1].map(|k| course.iter().map(|own| own[k]).collect()),
        })
    }
}

/// Returns the seed of draw `k`, below 2³². No two seeds have a draw in common.
fn seed_of_draw(seed: u64, k: u64) -> u64 {
    (seed.wrapping_sub(1) << 32).wrapping_add(k + 1)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::seed_of_draw;

    #[test]
    fn seeds_share_no_draw() {
        let draws = (0..5).flat_map(|seed| (0..100).map(move |k| seed_of_draw(seed, k)));
        assert_eq!(draws.collect::<BTreeSet<u64>>().len(), 500);
    }
}
