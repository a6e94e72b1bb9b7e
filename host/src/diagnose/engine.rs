//! The workflow from recordings to a verdict.

use std::collections::BTreeMap;
use std::sync::Mutex;

use rig_shared::effects::{Channel, Effect, GAINS, Kind, SHAPES};

use super::anchor::Anchor;
use super::change::change;
use super::columns::{Candidate, Predicted, Source, predict};
use super::fault::faulty;
use super::finish::{Drawn, Found, finish};
use super::fit::Fit;
use super::floor;
use super::locate::{coordinates, locate};
use super::outcome::{Absorbed, Diagnosis, Remainder, Step, Tried, Value, Verdict, Waterfall};
use super::rows::{Column, Nominal, Rows};
use super::runs::{Run, runs_of};
use super::sanity::faults;
use super::search::{Profile, SIGNIFICANT, Search, with};
use super::solve::{Solution, solve};
use super::{DiagnoseError, Options, testable};
use crate::prepare::{Choice, PrepareOptions, Recording, Survey, Treatment};
use crate::robot::Robot;

/// Recordings under one treatment.
struct Loaded {
    runs: Vec<Run>,
    rows: Rows,
}

/// Everything that stays the same during a diagnosis.
struct Bench<'a> {
    robot: &'a Robot,
    nominal: Nominal,
    anchor: Anchor,
    treatment: Treatment,
}

impl<'a> Bench<'a> {
    fn load(&self, recordings: &[&dyn Recording]) -> Result<Loaded, DiagnoseError> {
        let position = self
            .treatment
            .position_filter()
            .ok_or_else(|| DiagnoseError::Model("its position filter cannot be built.".into()))?;
        let mut runs = Vec::new();
        for (k, recording) in recordings.iter().enumerate() {
            runs.extend(runs_of(
                *recording,
                k,
                self.treatment.sample_rate,
                &position,
            )?);
        }
        let rows = Rows::of(&runs, &self.nominal, &self.treatment)?;
        Ok(Loaded { runs, rows })
    }

    fn predicted(&self, values: &[f64], runs: &[Run]) -> Result<Vec<Predicted>, DiagnoseError> {
        (runs.iter())
            .map(|run| predict(&self.nominal, self.robot, values, run))
            .collect()
    }

    fn source<'s>(
        &'s self,
        loaded: &'s Loaded,
        values: &[f64],
    ) -> Result<Source<'s>, DiagnoseError> {
        Ok(Source {
            robot: self.robot,
            runs: &loaded.runs,
            nominal: &self.nominal,
            thinning: &loaded.rows.thinning,
            predicted: self.predicted(values, &loaded.runs)?,
            values: values.to_vec(),
            driven: Mutex::default(),
        })
    }

    /// Torque less what the held parameters contribute.
    fn anchored(&self, rows: &mut Rows) {
        let fixed = super::anchor::combined(rows, &self.anchor.fixed());
        for (torque, column) in rows.torque.iter_mut().zip(fixed) {
            for (t, c) in torque.iter_mut().zip(column.unwrap_or_default()) {
                *t -= c;
            }
        }
    }
}

/// Seconds at the kept rate that a hidden effect's waves need: the low-pass before thinning passes at least this, Hz.
const LEAST_BAND: f64 = 30.0;

/// Decides how recordings are treated: as for an identification, but with a band that shows more than the motion's own.
pub(super) fn treatment_of(
    recordings: &[&dyn Recording],
    robot: &Robot,
) -> Result<Treatment, DiagnoseError> {
    let n = robot.joints.len();
    let surveys = (recordings.iter())
        .map(|r| Survey::take(*r, n))
        .collect::<Result<Vec<_>, _>>()?;
    let limits: Vec<Option<f64>> = (robot.joints.iter())
        .map(|j| j.limits.as_ref().and_then(|l| l.torque))
        .collect();
    let first = Treatment::decide(&surveys, &PrepareOptions::default(), &limits)?;
    let band = (10.0 * first.motion_frequency)
        .max(LEAST_BAND)
        .min(first.cutoff);
    let step = ((0.4 * first.sample_rate / band).floor() as usize).max(1);
    let options = PrepareOptions {
        decimation: Choice::Fixed(step.min(first.decimation.max(1))),
        ..PrepareOptions::default()
    };
    Ok(Treatment::decide(&surveys, &options, &limits)?)
}

/// Every effect on every joint that the torque can show.
fn library(robot: &Robot, runs: &[Run], without: &[Kind]) -> Vec<Candidate> {
    let n = robot.joints.len();
    let mut list = Vec::new();
    for &kind in Kind::ALL {
        if without.contains(&kind)
            || kind.about().channel == Channel::Voltage
            || kind == Kind::Payload
        {
            continue;
        }
        for joint in 0..n {
            let at = |other| Candidate { kind, joint, other };
            let warm = runs.iter().all(|r| r.joints[joint].temperature.is_some());
            match kind {
                Kind::InertiaCoupling => {
                    list.extend((0..n).filter(|k| *k != joint).map(|k| at(Some(k))))
                }
                Kind::ViscousWarmupTemperature if !warm => {}
                // One tilt for the whole base.
                Kind::GravityTilt if joint > 0 => {}
                _ => list.push(at(None)),
            }
        }
    }
    list
}

/// Free nominal columns taken in.
fn base_fit<'r>(rows: &'r Rows, free: &[Column], scale: Vec<f64>, memory: f64) -> Fit<'r> {
    let mut fit = Fit::new(rows, scale, memory);
    for column in free {
        fit.push(column);
    }
    fit
}

/// Finds what the model lacks. The second result is the description with the effects and the parameters identified
/// anew.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose(
    robot: &Robot,
    training: &[&dyn Recording],
    holdout: &[&dyn Recording],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Result<(Diagnosis, Robot), DiagnoseError> {
    if training.is_empty() {
        return Err(DiagnoseError::NoRecording);
    }
    let n = robot.joints.len();
    let nominal = Nominal::of(robot)?;
    let anchor = Anchor::of(robot, &nominal);
    let bench = Bench {
        robot,
        anchor,
        nominal,
        treatment: treatment_of(training, robot)?,
    };
    let mut loaded = bench.load(training)?;
    let wrong = faults(robot, &loaded.runs)?;
    if !wrong.is_empty() {
        return Ok((faulty(robot, wrong), robot.clone()));
    }
    progress(0.1);
    bench.anchored(&mut loaded.rows);
    let rows = &loaded.rows;
    let free = bench.anchor.columns(rows);
    // Weights from a first fit without any.
    let first = base_fit(rows, &free, vec![1.0; n], 0.1);
    let scale: Vec<f64> = (0..n)
        .map(|j| 1.0 / first.rms(j).max(f64::MIN_POSITIVE))
        .collect();
    let residuals: Vec<Vec<f64>> = (0..n).map(|j| first.residual(j)).collect();
    let memory = floor::memory(rows, &residuals);
    let base = base_fit(rows, &free, scale.clone(), memory);
    let plain = Fit::new(rows, scale, memory);
    let before = solve(&plain, &free.iter().collect::<Vec<_>>(), &[]).ok_or_else(|| {
        DiagnoseError::Model(
            "its nominal parameters are not excited by this motion; record a livelier one.".into(),
        )
    })?;
    let values = bench.anchor.values(&before.values);
    let mut search = Search::new(
        bench.source(&loaded, &values)?,
        library(robot, &loaded.runs, &options.without),
        crate::prepare::threads(options.threads),
    );
    let mut tried = Vec::new();
    let trials = search.trials();
    let mut sweeps = 0;
    let renew = |chosen: &[Profile]| {
        let columns: Vec<&Column> = free
            .iter()
            .chain(chosen.iter().flat_map(|p| p.columns.iter()))
            .collect();
        let coefficients = solve(&plain, &columns, &[]).map_or(before.values.clone(), |s| s.values);
        bench.source(&loaded, &bench.anchor.values(&coefficients[..free.len()]))
    };
    let mut chosen = search.run(&base, &renew, &mut |step, profiles, _| {
        sweeps += 1;
        progress(0.1 + 0.7 * (1.0 - 0.6_f64.powi(sweeps)));
        for (k, p) in profiles.iter().enumerate() {
            let refused = p.refused(trials);
            tried.push(Tried {
                effect: label(p.candidate.kind),
                joint: robot.joints[p.candidate.joint].name.clone(),
                step,
                gain: p.evidence.gain,
                gain_sigmas: p.evidence.gain_sigmas,
                p_value: p.corrected(trials),
                refused: match refused {
                    Some(why) => why,
                    None if k == 0 => String::new(),
                    None => "another takes away more".into(),
                },
            });
        }
    })?;
    progress(0.85);
    let pairs = floor::repeats(&loaded.runs);
    let judged = |chosen: &[Profile]| {
        let fit = with(&base, chosen, None);
        let floors: Vec<f64> = (0..n)
            .map(|j| {
                floor::from_repeats(rows, &pairs, &fit.residual(j), j).unwrap_or_else(|| fit.rms(j))
            })
            .collect();
        let left = remainder(
            &search,
            &bench,
            &loaded,
            &fit,
            &floors,
            !pairs.is_empty(),
            options.seed,
        );
        (floors, left)
    };
    let (mut floors, mut left) = judged(&chosen);
    if left.is_some() {
        // Beside something unknown, a name that closes less than half of what was there is a guess at it.
        let closes: Vec<bool> = (0..chosen.len())
            .map(|k| {
                let j = chosen[k].candidate.joint;
                let at = |count: usize| with(&base, &chosen[..count], None).rms(j);
                closed([at(k), at(k + 1)], floors[j]) >= HALF
            })
            .collect();
        let mut closes = closes.into_iter();
        chosen.retain(|_| closes.next().unwrap_or(true));
        (floors, left) = judged(&chosen);
    }
    let places = (0..n)
        .flat_map(|j| {
            let list = coordinates(rows, &loaded.runs, &search.source.predicted, robot, j);
            locate(
                rows,
                &list,
                &base.residual(j),
                base.block_of_rows(),
                j,
                &robot.joints[j].name,
                floors[j],
                options.seed,
            )
        })
        .collect();

    // From model to model, each refitted jointly on the training data.
    let sealed = if holdout.is_empty() {
        None
    } else {
        let mut sealed = bench.load(holdout)?;
        let wrong = faults(robot, &sealed.runs)?;
        if !wrong.is_empty() {
            return Ok((faulty(robot, wrong), robot.clone()));
        }
        bench.anchored(&mut sealed.rows);
        Some(sealed)
    };
    let after = joint_solution(&search, &plain, &free, &chosen)?;
    let mut train_rms = vec![Vec::new(); n];
    let mut holdout_rms = vec![Vec::new(); n];
    for count in 0..=chosen.len() {
        let part = &chosen[..count];
        let partial = with(&base, part, None);
        for (j, list) in train_rms.iter_mut().enumerate() {
            list.push(partial.rms(j));
        }
        if let Some(sealed) = &sealed {
            let columns: Vec<&Column> = free
                .iter()
                .chain(part.iter().flat_map(|p| p.columns.iter()))
                .collect();
            let Some(solution) = solve(&plain, &columns, &[]) else {
                continue;
            };
            let found = unseen(&bench, sealed, &solution.values, free.len(), part)?;
            for (list, rms) in holdout_rms.iter_mut().zip(found) {
                list.push(rms);
            }
        }
    }
    progress(0.95);
    let mut steps = Vec::new();
    for (k, profile) in chosen.iter().enumerate() {
        let j = profile.candidate.joint;
        let pair = |list: &[f64]| [list[k], list[k + 1]];
        let train = pair(&train_rms[j]);
        let unseen = (holdout_rms[j].len() > k + 1).then(|| pair(&holdout_rms[j]));
        let about = profile.candidate.kind.about();
        steps.push(Step {
            effect: about.name.to_owned(),
            law: about.law.map(str::to_owned),
            joint: robot.joints[j].name.clone(),
            set: Vec::new(),
            parameters: parameters(&search, profile, &after, &chosen, free.len(), k),
            p_value: profile.corrected(trials),
            runner_up: None,
            runner_up_gap_closed: None,
            train_rms: train,
            holdout_rms: unseen,
            motion_rms: None,
            gap_closed: closed(unseen.unwrap_or(train), floors[j]),
            why: String::new(),
        });
    }
    for (k, step) in steps.iter_mut().enumerate() {
        let rivals = search.alternatives(&base, &chosen, k)?;
        rank(step, &chosen[k], &rivals, &loaded.runs);
    }
    let known: Vec<Column> = {
        let mut at = free.len();
        let mut list = Vec::new();
        for profile in &chosen {
            for column in profile.columns.iter() {
                list.push(scaled(column, after.values[at]));
                at += 1;
            }
        }
        list
    };
    let change = change(
        robot,
        &bench.nominal,
        &bench.anchor,
        rows,
        &plain,
        &free,
        &known,
        &after,
    );
    // What the description as it stands leaves, with the effects.
    let prior = bench.anchor.prior_coefficients();
    let mut frozen = plain.clone();
    for (column, factor) in free.iter().zip(&prior) {
        frozen.subtract(column, *factor);
    }
    let frozen_train: Vec<f64> = (0..n).map(|j| frozen.rms(j)).collect();
    let frozen_holdout = match &sealed {
        Some(sealed) => Some(unseen(&bench, sealed, &prior, free.len(), &[])?),
        None => None,
    };
    let last = |lists: &[Vec<f64>], j: usize| lists[j].last().copied();
    if let Some(change) = change.as_ref().filter(|c| c.effect.is_some()) {
        let j = n - 1;
        let about = Kind::Payload.about();
        let now = [train_rms[j][0], last(&train_rms, j).unwrap_or(0.0)];
        let train = [frozen_train[j].max(now[0]), now[1]];
        let unseen = match (&frozen_holdout, last(&holdout_rms, j)) {
            (Some(frozen), Some(now)) => Some([frozen[j], now]),
            _ => None,
        };
        steps.push(Step {
            effect: about.name.to_owned(),
            law: None,
            joint: robot.joints[j].name.clone(),
            set: vec![about.name.to_owned()],
            parameters: change.parameters.clone(),
            p_value: change.evidence.p_value,
            runner_up: None,
            runner_up_gap_closed: None,
            train_rms: train,
            holdout_rms: unseen,
            motion_rms: None,
            gap_closed: closed(unseen.unwrap_or(train), floors[j]),
            why: change.words.clone(),
        });
    }
    let gap_closed = (!steps.is_empty()).then(|| {
        let of = |lists: &[Vec<f64>], frozen: &[f64]| {
            let sums = (0..n).fold([0.0, 0.0], |s, j| {
                let first = if change.is_some() {
                    frozen[j].max(lists[j][0])
                } else {
                    lists[j][0]
                };
                let end = lists[j][lists[j].len() - 1];
                let f = floors[j];
                [s[0] + (first - f) / f, s[1] + (first - end) / f]
            });
            sums[1] / sums[0]
        };
        match &frozen_holdout {
            Some(frozen) if holdout_rms.iter().all(|l| !l.is_empty()) => of(&holdout_rms, frozen),
            _ => of(&train_rms, &frozen_train),
        }
    });
    let verdict = if left.is_some() {
        Verdict::Remainder
    } else if steps.iter().any(|s| s.effect != Kind::Payload.about().name) {
        Verdict::Explained
    } else if change.is_some() {
        Verdict::ParameterChange
    } else {
        Verdict::NothingMissing
    };
    let waterfall = (0..n)
        .map(|j| Waterfall {
            joint: robot.joints[j].name.clone(),
            unit: "N*m".into(),
            models: ["frozen description", "refitted"]
                .into_iter()
                .map(str::to_owned)
                .chain(chosen.iter().map(|p| label(p.candidate.kind)))
                .collect(),
            train: std::iter::once(frozen_train[j])
                .chain(train_rms[j].iter().copied())
                .collect(),
            holdout: (frozen_holdout.iter().map(|f| f[j]))
                .chain(holdout_rms[j].iter().copied())
                .collect(),
            floor: floors[j],
        })
        .collect();
    let absorbed = absorbed(&bench, &before, &after);
    let mut diagnosis = Diagnosis {
        schema: "rig-diagnosis/1".into(),
        robot: robot.name.clone(),
        verdict,
        words: Vec::new(),
        noise_floor_rms: floors,
        noise_floor_how: if pairs.is_empty() {
            "what the last model leaves".into()
        } else {
            "difference of repeated recordings over √2".into()
        },
        places,
        steps,
        gap_closed,
        absorbed,
        not_testable: Vec::new(),
        detectable: Vec::new(),
        next_experiment: None,
        remainder: left,
        data_faults: Vec::new(),
        waterfall,
        tried,
        maps: Vec::new(),
        curves: Vec::new(),
    };
    let model = {
        let drawn = sealed.as_ref().unwrap_or(&loaded);
        let left = |values: &[f64], part| remaining(&bench, drawn, values, free.len(), part);
        let drawn = Drawn {
            runs: &drawn.runs,
            rows: &drawn.rows,
            left: [left(&before.values, &[])?, left(&after.values, &chosen)?],
        };
        let found = Found {
            robot,
            nominal: &bench.nominal,
            anchor: &bench.anchor,
            search: &search,
            rows,
            base: &base,
            after: &after,
            chosen: &chosen,
            floors: &diagnosis.noise_floor_rms.clone(),
            seed: options.seed,
            drawn,
        };
        let model = finish(&found, &mut diagnosis)?;
        diagnosis.words.extend(change.map(|c| c.words));
        model
    };
    progress(1.0);
    Ok((diagnosis, model))
}

/// Share of its gap that a step must close to stand beside a remainder.
const HALF: f64 = 0.5;
/// What is left counts as more than noise beyond this ratio to a floor known from repeated recordings: the filters'
/// treatment of a true structure leaves up to a tenth more.
const BEYOND_FLOOR: f64 = 1.25;
/// … and, without a repeat, where a coordinate explains this share of its squares.
const SHARE_LEFT: f64 = 0.1;
/// Alternatives with this share of a step's gain are as good where their blocks do not differ by more.
const AS_GOOD: f64 = 0.9;
/// Standard deviations of a paired difference between blocks.
const NO_DIFFERENCE: f64 = 2.5;

/// Fills the set and the runner-up of a step.
fn rank(step: &mut Step, own: &Profile, rivals: &[Profile], runs: &[Run]) {
    let mut names = vec![step.effect.clone()];
    let mut exact = |kind: Kind| {
        for confusion in testable::confounded(kind, own.candidate.joint, runs) {
            if !names.iter().any(|n| n == confusion.with) {
                names.push(confusion.with.to_owned());
            }
        }
    };
    exact(own.candidate.kind);
    for rival in rivals {
        let name = rival.candidate.kind.about().name;
        if names.iter().any(|n| n == name) {
            continue;
        }
        let equal = rival.candidate.joint == own.candidate.joint
            && rival.evidence.gain >= AS_GOOD * own.evidence.gain
            && own.evidence.ahead_of(&rival.evidence) < NO_DIFFERENCE;
        if equal {
            names.push(name.to_owned());
        } else if step.runner_up.is_none() {
            step.runner_up = Some(name.to_owned());
            step.runner_up_gap_closed =
                Some(step.gap_closed * (rival.evidence.gain / own.evidence.gain).clamp(0.0, 1.0));
        }
    }
    step.set = names;
}

/// What is left beyond the floor and goes with the motion.
fn remainder(
    search: &Search,
    bench: &Bench,
    loaded: &Loaded,
    fit: &Fit,
    floors: &[f64],
    repeated: bool,
    seed: u64,
) -> Option<Remainder> {
    (0..floors.len())
        .filter_map(|j| {
            let rows = &loaded.rows;
            let rms = fit.rms(j);
            let list = coordinates(rows, &loaded.runs, &search.source.predicted, bench.robot, j);
            let name = &bench.robot.joints[j].name;
            let floor = if repeated { floors[j] } else { 0.0 };
            let residual = fit.residual(j);
            let places = locate(rows, &list, &residual, fit.block_of_rows(), j, name, floor, seed);
            let shown = places
                .iter()
                .find(|p| p.p_value < SIGNIFICANT)
                .filter(|p| repeated || p.share > SHARE_LEFT);
            // Without a repeat the floor is what no coordinate of the motion explains.
            let ratio = if repeated {
                rms / floors[j]
            } else {
                shown.map_or(1.0, |p| 1.0 / (1.0 - p.share).max(0.01).sqrt())
            };
            let shown_text = shown.map_or_else(
                || "It goes with no single coordinate of the motion.".to_owned(),
                |p| p.text.clone(),
            );
            let left = if repeated { ratio > BEYOND_FLOOR } else { shown.is_some() };
            left.then(|| Remainder {
                joint: name.clone(),
                rms: (rms * rms - (rms / ratio).powi(2)).max(0.0).sqrt(),
                ratio,
                text: format!(
                    "{:.0} % more than the noise floor is left in joint {name} and no effect of the library explains it. {}",
                    100.0 * (ratio - 1.0),
                    shown_text
                ),
                places,
            })
        })
        .max_by(|a, b| a.ratio.total_cmp(&b.ratio))
}

/// A column times a factor.
fn scaled(column: &Column, factor: f64) -> Column {
    (column.iter())
        .map(|values| {
            values
                .as_ref()
                .map(|v| v.iter().map(|x| factor * x).collect())
        })
        .collect()
}

/// Name with its law.
pub(super) fn label(kind: Kind) -> String {
    let about = kind.about();
    match about.law {
        Some(law) => format!("{} ({law})", about.name),
        None => about.name.to_owned(),
    }
}

pub(super) fn closed([before, after]: [f64; 2], floor: f64) -> f64 {
    if before > floor {
        (before - after) / (before - floor)
    } else {
        0.0
    }
}

/// Nominal parameters, gains and shapes together.
fn joint_solution(
    search: &Search,
    plain: &Fit,
    free: &[Column],
    chosen: &[Profile],
) -> Result<Solution, DiagnoseError> {
    let columns: Vec<&Column> = free
        .iter()
        .chain(chosen.iter().flat_map(|p| p.columns.iter()))
        .collect();
    let singular =
        || DiagnoseError::Model("its parameters with the effects are not all excited.".into());
    let solution = solve(plain, &columns, &[]).ok_or_else(singular)?;
    let mut slopes = Vec::new();
    let mut at = free.len();
    for profile in chosen {
        let gains = &solution.values[at..at + profile.columns.len()];
        at += profile.columns.len();
        for (place, shape) in profile.candidate.kind.about().shapes.iter().enumerate() {
            if shape.scale == rig_shared::effects::Scale::Linear {
                continue;
            }
            // 1 % is far above rounding and within any law's own width.
            let step = 0.01 * profile.shapes[place];
            let mut sides = Vec::new();
            for sign in [1.0, -1.0] {
                let mut shapes = profile.shapes;
                shapes[place] += sign * step;
                sides.push(search.source.columns(&profile.candidate, &shapes)?);
            }
            slopes.push(difference(&sides[0], &sides[1], gains, 2.0 * step));
        }
    }
    Ok(solve(plain, &columns, &slopes).unwrap_or(solution))
}

/// Σ gains·(a − b)/step.
fn difference(a: &[Column], b: &[Column], gains: &[f64], step: f64) -> Column {
    let joints = a.first().map_or(0, Vec::len);
    let mut sum: Column = vec![None; joints];
    for ((a, b), gain) in a.iter().zip(b).zip(gains) {
        for ((to, a), b) in sum.iter_mut().zip(a).zip(b) {
            let (Some(a), Some(b)) = (a, b) else { continue };
            let to = to.get_or_insert_with(|| vec![0.0; a.len()]);
            for ((t, a), b) in to.iter_mut().zip(a).zip(b) {
                *t += gain * (a - b) / step;
            }
        }
    }
    sum
}

/// Parameters of the `k`-th effect with their standard deviations.
fn parameters(
    search: &Search,
    profile: &Profile,
    solution: &Solution,
    chosen: &[Profile],
    free: usize,
    k: usize,
) -> BTreeMap<String, Value> {
    let mut map = BTreeMap::new();
    let at = free + chosen[..k].iter().map(|p| p.columns.len()).sum::<usize>();
    for (g, gain) in search
        .source
        .gains(profile.candidate.kind)
        .iter()
        .enumerate()
    {
        map.insert(
            gain.name.to_owned(),
            Value {
                value: solution.values[at + g],
                std: solution.std(at + g),
                unit: gain.unit.to_owned(),
            },
        );
    }
    let searched = |p: &Profile| {
        p.candidate
            .kind
            .about()
            .shapes
            .iter()
            .filter(|s| s.scale == rig_shared::effects::Scale::Logarithmic)
            .count()
    };
    let mut slope = solution.values.len() + chosen[..k].iter().map(searched).sum::<usize>();
    for (place, shape) in profile.candidate.kind.about().shapes.iter().enumerate() {
        let whole = shape.scale == rig_shared::effects::Scale::Linear;
        let std = if whole || slope >= solution.covariance.nrows() {
            0.0
        } else {
            slope += 1;
            solution.std(slope - 1)
        };
        map.insert(
            shape.name.to_owned(),
            Value {
                value: profile.shapes[place],
                std,
                unit: shape.unit.to_owned(),
            },
        );
    }
    map
}

/// What a model leaves of recordings' torque, joint by joint.
fn remaining(
    bench: &Bench,
    sealed: &Loaded,
    coefficients: &[f64],
    free: usize,
    chosen: &[Profile],
) -> Result<Vec<Vec<f64>>, DiagnoseError> {
    let values = bench.anchor.values(&coefficients[..free]);
    let source = bench.source(sealed, &values)?;
    let rows = &sealed.rows;
    let mut residual = rows.torque.clone();
    let mut take = |column: &Column, factor: f64| {
        for (list, column) in residual.iter_mut().zip(column) {
            for (r, c) in list.iter_mut().zip(column.iter().flatten()) {
                *r -= factor * c;
            }
        }
    };
    for (column, factor) in bench.anchor.columns(rows).iter().zip(coefficients) {
        take(column, *factor);
    }
    let mut at = free;
    for profile in chosen {
        for column in source.columns(&profile.candidate, &profile.shapes)? {
            take(&column, coefficients[at]);
            at += 1;
        }
    }
    Ok(residual)
}

/// RMS per joint on recordings that nothing was fitted to.
fn unseen(
    bench: &Bench,
    sealed: &Loaded,
    coefficients: &[f64],
    free: usize,
    chosen: &[Profile],
) -> Result<Vec<f64>, DiagnoseError> {
    let residual = remaining(bench, sealed, coefficients, free, chosen)?;
    Ok((residual.iter().zip(&sealed.rows.keep))
        .map(|(r, keep)| {
            let squares: f64 = r
                .iter()
                .zip(keep)
                .filter(|(_, k)| **k)
                .map(|(r, _)| r * r)
                .sum();
            (squares / keep.iter().filter(|k| **k).count().max(1) as f64).sqrt()
        })
        .collect())
}

/// What moved among the nominal parameters.
fn absorbed(bench: &Bench, before: &Solution, after: &Solution) -> Vec<Absorbed> {
    let base = &bench.nominal.base;
    let mut list: Vec<Absorbed> = (bench.anchor.free.iter().enumerate())
        .filter_map(|(k, direction)| {
            let [(b, _)] = direction.as_slice() else {
                return None;
            };
            let std = after.std(k);
            Some(Absorbed {
                parameter: base.expression(*b),
                unit: base.unit(*b).to_owned(),
                before: before.values[k],
                after: after.values[k],
                sigmas: (after.values[k] - before.values[k]).abs() / std.max(f64::MIN_POSITIVE),
            })
        })
        .collect();
    list.sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
    list
}

/// An effect as a description and the firmware take it.
pub(super) fn effect_of(kind: Kind, gains: &[f64], shapes: &[f64; SHAPES]) -> Effect<f64> {
    let mut all = [0.0; GAINS];
    for (to, from) in all.iter_mut().zip(gains) {
        *to = *from;
    }
    Effect {
        kind,
        gains: all,
        shapes: *shapes,
    }
}
