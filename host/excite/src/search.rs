//! Multi-start search: many starts, of which the promising ones are fully refined.

use std::sync::mpsc;

use nalgebra::DVector;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rig_shared::multibody::Chain;

use super::certificate::Reached;
use super::criterion::{Smoothing, Values};
use super::drives::into_cranks;
use super::effort::{Effort, Meter};
use super::fit::{Blame, fit_within};
use super::frame::{Frame, values_of};
use super::interval::Interval;
use super::optimise::{Round, minimise};
use super::problem::Problem;
use super::schedule::JointMotion;
use super::{Criterion, ExciteError, Options};
use rig_model::batch::each_by;
use rig_model::robot::Robot;
use rig_model::simulate::SimulateError;

/// Number of random motions per start, of which the best is used: judging one costs a fiftieth of improving it.
const CANDIDATES: usize = 12;
/// Number of starts per fully refined one; at least [`LEAST_FINALISTS`] are refined.
const FINALIST_SHARE: usize = 6;
const LEAST_FINALISTS: usize = 3;
/// Samples per period of the fastest harmonic in the first improvement: enough to rank the starts.
const COARSE: usize = 16;
/// The same in the refinement; see `MARGIN` in `problem/penalty.rs`.
const FINE: usize = 48;
/// Samples per period of the fastest harmonic for the reported values.
const REPORT_SAMPLES: usize = 200;

const fn round(weight: f64, power: i32, steps: usize) -> Round {
    Round {
        weight,
        smoothing: Smoothing(power),
        steps,
    }
}

/// Rounds of the first improvement: far from the optimum a smooth mean of the singular values converges faster.
const FIRST: [Round; 3] = [round(1e1, 2, 60), round(1e2, 4, 60), round(1e2, 8, 60)];
/// Rounds of the refinement.
const LAST: [Round; 5] = [
    round(1e2, 8, 160),
    round(1e3, 16, 160),
    round(1e3, 32, 160),
    round(3e3, 64, 160),
    round(3e3, 128, 160),
];

/// Scale factor of a motion below which it is refined again from there.
const KEPT_SIZE: f64 = 0.9;
/// Largest number of such repetitions.
const AGAIN: usize = 2;

/// A motion that passed the proof.
pub(super) struct Candidate {
    pub motions: Vec<JointMotion>,
    pub reached: Reached,
    pub values: Values,
}

/// Runs `work` for 0 to `count` in parallel, with results in order. `work` gets a callback for each unit of work.
fn in_parallel<T: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize, &dyn Fn()) -> T + Sync,
    mut tick: impl FnMut(),
) -> Vec<T> {
    std::thread::scope(|scope| {
        let (send, receive) = mpsc::channel::<()>();
        let work = &work;
        let all = scope.spawn(move || {
            each_by(count, threads, |index| {
                // The receiver outlives the sender, so sending cannot fail.
                work(index, &|| {
                    let _ = send.send(());
                })
            })
        });
        for () in receive {
            tick();
        }
        all.join()
            .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// Returns a random motion within the limits of position, velocity and acceleration.
pub(super) fn random_motion(
    problem: &mut Problem<'_>,
    frame: &Frame,
    random: &mut rand_pcg::Pcg64,
) -> DVector<f64> {
    let mut x = DVector::zeros(problem.size());
    let block = 1 + 2 * frame.schedule.harmonics;
    for value in x.iter_mut() {
        *value = StandardNormal.sample(random);
    }
    for j in 0..frame.bounds.len() {
        // Within the middle half of the range.
        x[j * block] = random.random::<f64>() - 0.5;
    }
    let mut motions = problem.decode(&x);
    let mut base: Vec<f64> = motions.iter().map(|m| m.base).collect();
    into_cranks(&frame.combined, &mut base, 0.5);
    for (motion, at) in motions.iter_mut().zip(base) {
        motion.base = at;
    }
    let x = problem.encode(&motions);
    problem.shrunk(&x, 0.9)
}

/// Returns the best of a few random motions.
pub(super) fn random_start(
    problem: &mut Problem<'_>,
    frame: &Frame,
    seed: u64,
    index: usize,
) -> DVector<f64> {
    // One random stream per start: the same numbers on every thread.
    let mut random = rand_pcg::Pcg64::new(u128::from(seed), index as u128);
    let mut best: Option<(f64, DVector<f64>)> = None;
    for _ in 0..CANDIDATES {
        let x = random_motion(problem, frame, &mut random);
        let value = problem.judge(&x);
        if best.as_ref().is_none_or(|(least, _)| value < *least) {
            best = Some((value, x));
        }
    }
    best.map_or_else(|| DVector::zeros(problem.size()), |(_, x)| x)
}

/// Improves a start; returns it with its criterion after scaling into the limits of the joints.
fn improve(frame: &Frame, seed: u64, index: usize, done: &dyn Fn()) -> (f64, DVector<f64>) {
    let mut problem = Problem::new(frame, COARSE, FIRST[0].smoothing);
    let start = random_start(&mut problem, frame, seed, index);
    let x = minimise(&mut problem, start, &FIRST, done);
    let within = problem.shrunk(&x, 1.0);
    let promise = problem.judge(&within);
    (
        if promise.is_nan() {
            f64::INFINITY
        } else {
            promise
        },
        x,
    )
}

type Outcome = Result<Result<Candidate, Blame>, ExciteError>;

/// Scales the motion of `x` until the proof succeeds.
fn proven(
    frame: &Frame,
    enclosing: &Chain<Interval>,
    problem: &mut Problem<'_>,
    x: &DVector<f64>,
) -> Outcome {
    if x.iter().any(|v| !v.is_finite()) {
        return Ok(Err((0, "position")));
    }
    let (motions, reached) = match fit_within(frame, enclosing, problem.decode(x))? {
        Err(blame) => return Ok(Err(blame)),
        Ok(found) => found,
    };
    let samples = REPORT_SAMPLES * frame.schedule.harmonics;
    let values = values_of(frame, &motions, samples)?;
    Ok(Ok(Candidate {
        motions,
        reached,
        values,
    }))
}

fn refine(
    frame: &Frame,
    enclosing: &Chain<Interval>,
    criterion: Criterion,
    from: DVector<f64>,
    done: &dyn Fn(),
) -> Outcome {
    let mut problem = Problem::new(frame, FINE, LAST[0].smoothing);
    let x = minimise(&mut problem, from, &LAST, done);
    let mut best = proven(frame, enclosing, &mut problem, &x)?;
    // A motion that had to be scaled into a limit is no optimum: there is a better one nearby.
    for _ in 0..AGAIN {
        let Ok(candidate) = &best else { break };
        let scaled = problem.encode(&candidate.motions);
        if scaled.norm() > KEPT_SIZE * x.norm() {
            break;
        }
        let x = minimise(&mut problem, scaled, &LAST[2..], &|| ());
        match proven(frame, enclosing, &mut problem, &x)? {
            Ok(other) if criterion.cost(&other.values) < criterion.cost(&candidate.values) => {
                best = Ok(other);
            }
            _ => break,
        }
    }
    done();
    Ok(best)
}

/// Returns the best motion, the criterion of each refined start, and the work that this took.
pub(super) fn search(
    robot: &Robot,
    frame: &Frame,
    options: &Options,
    mut progress: impl FnMut(u64, u64),
) -> Result<(Candidate, Vec<f64>, Effort), ExciteError> {
    let enclosing = robot.chain::<Interval>().map_err(SimulateError::from)?;
    let starts = options.starts as usize;
    let finalists = (starts / FINALIST_SHARE).max(LEAST_FINALISTS).min(starts);
    let threads = options
        .threads
        .or_else(|| std::thread::available_parallelism().ok().map(Into::into))
        .unwrap_or(1)
        .max(1);
    // A fine sample costs as much as a coarse one.
    let fine = (FINE / COARSE) as u64;
    let total = (starts * FIRST.len()) as u64 + fine * (finalists * (LAST.len() + 1)) as u64;
    let mut done = 0;
    let meter = Meter::new();
    let mut improved: Vec<(f64, usize, DVector<f64>)> = in_parallel(
        threads,
        starts,
        |index, tick| meter.measure(|| improve(frame, options.seed, index, tick)),
        || {
            done += 1;
            progress(done, total);
        },
    )
    .into_iter()
    .enumerate()
    .map(|(index, (promise, x))| (promise, index, x))
    .collect();
    improved.sort_by(|(a, i, _), (b, j, _)| a.total_cmp(b).then(i.cmp(j)));
    improved.truncate(finalists);
    improved.sort_by_key(|(_, index, _)| *index);
    let outcomes = in_parallel(
        threads,
        finalists,
        |rank, tick| {
            let from = improved[rank].2.clone();
            meter.measure(|| refine(frame, &enclosing, options.criterion, from, tick))
        },
        || {
            done += fine;
            progress(done, total);
        },
    );
    let effort = meter.effort(threads.min(starts));
    let mut best: Option<Candidate> = None;
    let mut reached = Vec::new();
    let mut blame = (0, "position");
    for outcome in outcomes {
        match outcome? {
            Err(fault) => blame = fault,
            Ok(candidate) => {
                reached.push(options.criterion.of(&candidate.values));
                let cost = |c: &Candidate| options.criterion.cost(&c.values);
                if cost(&candidate).is_finite()
                    && best.as_ref().is_none_or(|b| cost(&candidate) < cost(b))
                {
                    best = Some(candidate);
                }
            }
        }
    }
    let best = best.ok_or_else(|| ExciteError::Infeasible {
        joint: robot.joints[blame.0].name.clone(),
        limit: blame.1,
    })?;
    Ok((best, reached, effort))
}
