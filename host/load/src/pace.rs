//! How the rows of a recording follow each other: one after the other in time, or pose by pose.

use rig_model::robot::{Joint, Robot};

use crate::rows::FEWEST_ROWS;

/// Largest movement of a joint within a pose, rad or m: above the noise of encoders, below the distance of poses.
pub(crate) const AT_REST: f64 = 5e-3;
/// Time between rows beyond which they are no recording of a motion, s. Joints of arms reach a few rad/s and turn within a
/// second; a motion that is sampled more seldom has no acceleration that could be computed.
const LONGEST_STEP: f64 = 0.15;
/// Fastest joint of a robot that rests, rad/s or m/s: what such a motion does to the readings is below one per cent of the
/// weight.
const SLOWEST: f64 = 0.025;
/// Multiple of the described speed of a joint beyond which it does not move from one row to the next: the rows of two poses
/// stand beside each other.
const TOO_FAST: f64 = 1.5;
/// Speed of a joint without a described one, rad/s or m/s: above that of arms.
const FASTEST: f64 = 10.0;

/// How the rows of a recording follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pace {
    /// Rows stand for poses: they are far apart in time, or the robot cannot come from one to the next.
    Listed,
    /// Rows follow each other in time, whether the robot moves or stands.
    Continuous,
}

/// Rows that follow each other without a long step between them.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    first: Vec<f64>,
    /// Time of its first and last row, s.
    since: f64,
    until: f64,
    /// Furthest of its positions from the first.
    spread: f64,
}

impl Run {
    /// Begins with a row.
    pub(crate) fn of(t: f64, q: Vec<f64>) -> Self {
        Self {
            first: q,
            since: t,
            until: t,
            spread: 0.0,
        }
    }

    /// Returns the positions of the first row.
    pub(crate) fn first(&self) -> &[f64] {
        &self.first
    }

    /// Returns the furthest that a joint is from its position in the first row.
    pub(crate) fn distance(&self, q: &[f64]) -> f64 {
        (self.first.iter().zip(q)).fold(0.0, |most, (a, b)| most.max((a - b).abs()))
    }

    /// Takes a row.
    pub(crate) fn push(&mut self, t: f64, q: &[f64]) {
        self.until = t;
        self.spread = self.spread.max(self.distance(q));
    }

    /// Returns true if its rows show that the robot rests. One row alone shows nothing.
    pub(crate) fn rests(&self) -> bool {
        self.until > self.since && self.spread <= SLOWEST * (self.until - self.since)
    }
}

/// Sums over the steps from row to row.
pub(crate) struct Steps {
    /// Highest speed of each joint, rad/s or m/s.
    speeds: Vec<f64>,
    rows: usize,
    /// Time and positions of the last row.
    last: Option<(f64, Vec<f64>)>,
    /// Change of the positions in the last step.
    change: Vec<f64>,
    /// Steps that are longer than [`LONGEST_STEP`].
    long: usize,
    /// Steps in which a joint moves further than [`AT_REST`], and those of them that no joint can make.
    moves: usize,
    leaps: usize,
    /// Squares of the changes, and of the changes of the changes.
    squares: [f64; 2],
    /// Rows since the last long step.
    run: Option<Run>,
    /// Runs of rows before it, and those of them in which the robot rests.
    runs: [usize; 2],
}

impl Steps {
    /// Begins for a robot.
    pub(crate) fn of(robot: &Robot) -> Self {
        let speed = |joint: &Joint| match &joint.limits {
            Some(limits) if limits.velocity > 0.0 && limits.velocity.is_finite() => limits.velocity,
            _ => FASTEST,
        };
        Self {
            speeds: robot.joints.iter().map(speed).collect(),
            rows: 0,
            last: None,
            change: Vec::new(),
            long: 0,
            moves: 0,
            leaps: 0,
            squares: [0.0; 2],
            run: None,
            runs: [0; 2],
        }
    }

    /// Takes a row into the run of rows.
    fn follow(&mut self, t: f64, q: &[f64]) {
        let goes_on = |run: &&mut Run| t - run.until <= LONGEST_STEP;
        if let Some(run) = self.run.as_mut().filter(goes_on) {
            run.push(t, q);
            return;
        }
        if let Some(before) = self.run.replace(Run::of(t, q.to_vec())) {
            self.runs[0] += 1;
            self.runs[1] += usize::from(before.rests());
        }
    }

    /// Returns true if rows were recorded only where the robot rests.
    fn rests_in_all_runs(&self) -> bool {
        let [runs, at_rest] = self.runs;
        runs > 0 && runs == at_rest && self.run.as_ref().is_some_and(Run::rests)
    }

    /// Takes a row.
    pub(crate) fn push(&mut self, t: f64, q: Vec<f64>) {
        self.rows += 1;
        self.follow(t, &q);
        if let Some((before, from)) = self.last.take() {
            let step = t - before;
            let change: Vec<f64> = q.iter().zip(&from).map(|(a, b)| a - b).collect();
            self.long += usize::from(step > LONGEST_STEP);
            self.moves += usize::from(change.iter().any(|by| by.abs() > AT_REST));
            let is_leap = (change.iter().zip(&self.speeds))
                .any(|(by, speed)| by.abs() > AT_REST + TOO_FAST * speed * step);
            self.leaps += usize::from(is_leap);
            self.squares[0] += change.iter().map(|by| by * by).sum::<f64>();
            self.squares[1] += (change.iter().zip(&self.change))
                .map(|(now, last)| (now - last).powi(2))
                .sum::<f64>();
            self.change = change;
        }
        self.last = Some((t, q));
    }

    /// Decides from the time steps and speeds of the rows how they follow each other.
    pub(crate) fn pace(&self) -> Pace {
        let is_seldom = 2 * self.long + 1 > self.rows;
        // Where many rows are far apart in time, those of a slow motion lie on a smooth path.
        let is_smooth = self.rows >= FEWEST_ROWS && self.squares[1] < self.squares[0];
        let is_led = self.leaps > 0 && 2 * self.leaps >= self.moves;
        match is_seldom && !is_smooth || is_led || self.rests_in_all_runs() {
            true => Pace::Listed,
            false => Pace::Continuous,
        }
    }
}
