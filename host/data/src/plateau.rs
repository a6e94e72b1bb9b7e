//! A torque that is cut, with noise on the plateau: a current limit whose reading has noise, or a converter at the end of
//! its range with noise behind it.
//!
//! The torque piles up in a narrow band at its extreme. A smooth torque does so at its peaks, too, and a torque of friction
//! as long as the joint moves one way. The plateau of a cut is told from both by what all of these show together:
//!
//! * The band has more rows than the next band of the same width.
//! * Within a run of rows in the band, halves and thirds have the same mean within the noise of single rows: a peak is
//!   bent, and friction follows the velocity. The band is wider than the noise, so that it would hold such a bend.
//! * The velocity changes within the runs: it is no motion at constant velocity.
//! * The joint moves both ways in the band, or the torque is elsewhere for much of the time: it is no friction alone.
//!
//! A limit is the same both ways: if one side is cut and the other ends at the same torque, both are.
//!
//! Not detected: a plateau whose noise is so slow that neighbouring rows are alike, and a cut in a motion at constant
//! velocities.

/// Least ratio of the rows at the extreme torque to the rows at the next level. A parabola, the peak of a smooth torque,
/// stays in its top level up to 1/(√2 − 1) = 2.41 times as long as in the level below; a plateau of friction less.
pub const PILE_UP: f64 = 2.5;
/// The same where the band is noise besides. Of 337 torques of simulated sound recordings (three arms and one link) none
/// was taken for a cut one; of 220 sides of cut ones, with noise of 0.02 to 2 %, 177 were found by themselves.
const AT_NOISE: f64 = 1.5;
/// Share of a joint's RMS velocity above which it moves.
const MOVES: f64 = 0.1;
/// Fewest rows in motion that are judged.
const FEWEST: usize = 500;
/// Share of the rows that may be above the band, and below the range: outliers, tails of the noise.
const BEYOND: f64 = 1e-3;
/// Least share of the rows in the band: fewer bias little, and may be a single peak.
const LEAST: f64 = 0.01;
/// Ratio of the widths of two bands that are tried after each other.
const NARROWER: f64 = core::f64::consts::FRAC_1_SQRT_2;
/// Number of widths that are tried: from a quarter of the range to 10⁻⁶ of it.
const WIDTHS: i32 = 40;
/// Fewest rows of a run …
const RUN: usize = 12;
/// … of all runs …
const RUNS: usize = 200;
/// … and their least share of the rows in the band. The noise breaks the runs of a band that holds but a part of it.
const IN_RUNS: f64 = 0.5;
/// Largest mean square of the differences between parts of the runs, in those that white noise has. The ends of a plateau
/// add to 1; a limit of 4 took 4 of 337 sound torques for cut.
const AS_NOISE: f64 = 2.5;
/// Least variance of the rows' own noise, as a share of that of all rows in the runs.
const WHITE: f64 = 0.6;
/// Least width of the band, in standard deviations of the rows' own noise.
const WIDE: f64 = 6.0;
/// Least difference between the mean velocities of both halves of a run, as a share of the mean speed.
const CHANGES: f64 = 0.04;
/// Least share of the rows in the band with the rarer sense of the velocity, for a torque that is not of friction …
const BOTH_WAYS: f64 = 0.1;
/// … or least share of the rows in neither this band nor its opposite.
const ELSEWHERE: f64 = 0.35;
/// Largest distance of the other side's extreme from the level of a cut, in widths from its level to its edge.
const SAME_LIMIT: f64 = 1.5;

/// Rows of a stretch without a gap: torque and velocity of a joint, the latter in any unit.
pub type Stretch<'a> = [&'a [f64]; 2];

/// A band at an extreme of the torque in which it is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plateau {
    /// Median of the torque in the band.
    pub level: f64,
    /// End of the band towards smaller torques.
    pub edge: f64,
}

impl Plateau {
    fn mirrored(self) -> Self {
        Self {
            level: -self.level,
            edge: -self.edge,
        }
    }
}

/// Returns the bands in which a torque is cut: at its lowest and at its highest values.
pub fn plateaus(stretches: &[Stretch<'_>]) -> [Option<Plateau>; 2] {
    let Some(high) = Side::of(stretches, 1.0) else {
        return [None; 2];
    };
    let low = high.mirrored();
    match [low.cut(stretches, -1.0), high.cut(stretches, 1.0)] {
        [None, Some(own)] => [low.at(own).map(Plateau::mirrored), Some(own)],
        [Some(own), None] => [Some(own.mirrored()), high.at(own)],
        [down, up] => [down.map(Plateau::mirrored), up],
    }
}

/// The torques in motion, with the sign that makes those of one side the highest.
struct Side {
    /// In order.
    sorted: Vec<f64>,
    /// Speed above which the joint moves.
    moves: f64,
}

impl Side {
    /// Returns the torques times a sign; `None` if too few are in motion.
    fn of(stretches: &[Stretch<'_>], sign: f64) -> Option<Self> {
        let rows = || {
            stretches
                .iter()
                .flat_map(|[tau, speed]| tau.iter().zip(*speed))
        };
        let (sum, count) = rows().fold((0.0, 0.0), |(sum, count), (_, v)| {
            (sum + v * v, count + 1.0)
        });
        let moves = MOVES * f64::sqrt(sum / count);
        let mut sorted: Vec<f64> = rows()
            .filter(|(_, speed)| speed.abs() > moves)
            .map(|(tau, _)| sign * tau)
            .collect();
        sorted.sort_by(f64::total_cmp);
        let is_usable = sorted.len() >= FEWEST && sorted.iter().all(|v| v.is_finite());
        is_usable.then_some(Self { sorted, moves })
    }

    fn mirrored(&self) -> Self {
        Self {
            sorted: self.sorted.iter().rev().map(|v| -v).collect(),
            moves: self.moves,
        }
    }

    /// Returns the torque below all but this number of rows.
    fn below(&self, rows: usize) -> f64 {
        self.sorted[self.sorted.len() - 1 - rows.min(self.sorted.len() - 1)]
    }

    fn top(&self) -> f64 {
        self.below((BEYOND * self.sorted.len() as f64) as usize)
    }

    /// Returns the number of rows from a torque on.
    fn from(&self, torque: f64) -> usize {
        self.sorted.len() - self.sorted.partition_point(|own| *own < torque)
    }

    /// Returns the band at the highest torques in which they are cut.
    fn cut(&self, stretches: &[Stretch<'_>], sign: f64) -> Option<Plateau> {
        let count = self.sorted.len() as f64;
        let (top, bottom) = (self.top(), self.sorted[(BEYOND * count) as usize]);
        let middle = 0.5 * (top + bottom);
        let mut best: Option<(f64, Plateau)> = None;
        for step in 0..WIDTHS {
            let width = 0.5 * (top - middle) * NARROWER.powi(step);
            let edge = top - width;
            let inside = self.from(edge);
            if (inside as f64) < LEAST * count || width <= 0.0 {
                break;
            }
            let next = self.from(edge - width) - inside;
            let ratio = inside as f64 / next.max(1) as f64;
            if ratio <= AT_NOISE || best.is_some_and(|(most, _)| most >= ratio) {
                continue;
            }
            let plateau = Plateau {
                level: self.below(inside / 2),
                edge,
            };
            let opposite = self.from(2.0 * middle - edge);
            let elsewhere = opposite.saturating_sub(inside) as f64 / count;
            let runs = Runs::of(stretches, sign, plateau, self.moves);
            if runs.are_noise(width, inside) && runs.are_no_friction(elsewhere) {
                best = Some((ratio, plateau));
            }
        }
        best.map(|(_, plateau)| plateau)
    }

    /// Returns the band of the other side's limit if the torques of this side end there, too.
    fn at(&self, other: Plateau) -> Option<Plateau> {
        let away = (self.top() - other.level).abs();
        (away <= SAME_LIMIT * (other.level - other.edge)).then_some(other)
    }
}

/// The runs of rows in a band at the highest torque.
#[derive(Default)]
struct Runs {
    /// Number of rows, number of those with positive velocity.
    rows: usize,
    forward: usize,
    /// Sum of the torques and of their squares, about the level.
    sums: [f64; 2],
    /// Sum of the squared differences of rows that follow each other, and their number.
    differences: [f64; 2],
    /// Sum of the squared differences between halves, and between the middle and the outer thirds, each divided by what a
    /// row's noise of variance 1 gives; and their number.
    parts: [f64; 2],
    /// Sums over the runs, weighted by their rows: difference between the mean velocities of their halves, and mean speed.
    changes: f64,
    speeds: f64,
}

impl Runs {
    fn of(stretches: &[Stretch<'_>], sign: f64, plateau: Plateau, moves: f64) -> Self {
        let mut runs = Self::default();
        for [tau, speed] in stretches {
            let rows: Vec<[f64; 2]> = (tau.iter().zip(*speed))
                .map(|(tau, speed)| [sign * tau - plateau.level, *speed])
                .collect();
            let edge = plateau.edge - plateau.level;
            let inside = |[tau, speed]: &[f64; 2]| *tau >= edge && speed.abs() > moves;
            for run in rows.chunk_by(|a, b| inside(a) == inside(b)) {
                if run.first().is_some_and(inside) {
                    runs.push(within(run));
                }
            }
        }
        runs
    }

    fn push(&mut self, run: &[[f64; 2]]) {
        if run.len() < RUN {
            return;
        }
        let rows = run.len() as f64;
        let mean = |part: &[[f64; 2]], column: usize| {
            part.iter().map(|row| row[column]).sum::<f64>() / part.len() as f64
        };
        self.rows += run.len();
        for [tau, speed] in run {
            self.sums[0] += tau;
            self.sums[1] += tau * tau;
            self.speeds += speed.abs();
            self.forward += usize::from(*speed > 0.0);
        }
        for pair in run.windows(2) {
            self.differences[0] += (pair[1][0] - pair[0][0]).powi(2);
            self.differences[1] += 1.0;
        }
        let (first, second) = run.split_at(run.len() / 2);
        self.parts[0] += 0.25 * rows * (mean(second, 0) - mean(first, 0)).powi(2);
        self.changes += rows * (mean(second, 1) - mean(first, 1)).abs();
        let third = run.len() / 3;
        let middle = &run[third..run.len() - third];
        let (inner, outer) = (middle.len() as f64, 2.0 * third as f64);
        let sum = |part: &[[f64; 2]]| part.iter().map(|row| row[0]).sum::<f64>();
        let around = (sum(run) - sum(middle)) / outer;
        let of_noise = 1.0 / inner + 1.0 / outer;
        self.parts[0] += (mean(middle, 0) - around).powi(2) / of_noise;
        self.parts[1] += 2.0;
    }

    /// Returns true if most of the rows `inside` a band of this width are in runs, and these are noise about a level.
    fn are_noise(&self, width: f64, inside: usize) -> bool {
        if self.rows < RUNS || (self.rows as f64) < IN_RUNS * inside as f64 {
            return false;
        }
        let rows = self.rows as f64;
        let noise = 0.5 * self.differences[0] / self.differences[1];
        let variance = self.sums[1] / rows - (self.sums[0] / rows).powi(2);
        noise >= WHITE * variance
            && self.parts[0] <= AS_NOISE * noise * self.parts[1]
            && width > WIDE * noise.sqrt()
    }

    /// Returns true if the torque stays while the velocity changes, and is more than friction; `elsewhere` is the share of
    /// all rows in neither this band nor its opposite.
    fn are_no_friction(&self, elsewhere: f64) -> bool {
        let forward = self.forward as f64 / self.rows.max(1) as f64;
        self.changes > CHANGES * self.speeds
            && (forward.min(1.0 - forward) > BOTH_WAYS || elsewhere > ELSEWHERE)
    }
}

/// Returns the rows of a run without its ends, where a plateau rises and falls: up to the first row and from the last row
/// at or above the level, and half as many rows more.
fn within(run: &[[f64; 2]]) -> &[[f64; 2]] {
    let is_above = |[tau, _]: &[f64; 2]| *tau >= 0.0;
    let (Some(first), Some(last)) = (
        run.iter().position(is_above),
        run.iter().rposition(is_above),
    ) else {
        return &[];
    };
    let from = first + first / 2 + 1;
    let to = last - ((run.len() - 1 - last) / 2).min(last);
    run.get(from..to).unwrap_or_default()
}

/// Returns the velocity of a position in its unit per row: the difference between rows on either side, so that the noise
/// of a single row is no motion.
pub(crate) fn speed_per_row(q: &[f64]) -> Vec<f64> {
    /// Rows on either side.
    const BESIDE: usize = 8;
    (0..q.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(BESIDE), (k + BESIDE).min(q.len() - 1));
            (q[to] - q[from]) / (to - from).max(1) as f64
        })
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, Normal};

    use super::*;

    /// A joint: inertia, gravity, viscous and Coulomb friction.
    #[derive(Clone, Copy, Debug)]
    struct Joint([f64; 4]);

    /// A link that hangs, a light one beside friction, a heavy one, one without gravity.
    const JOINTS: [Joint; 4] = [
        Joint([0.17, 2.6, 0.35, 0.47]),
        Joint([0.05, 1.0, 0.3, 0.5]),
        Joint([4.0, 30.0, 6.0, 4.0]),
        Joint([0.4, 0.0, 0.2, 0.3]),
    ];

    /// Position, velocity and acceleration over time.
    type Motion = dyn Fn(f64) -> [f64; 3];

    fn waves(seed: f64) -> impl Fn(f64) -> [f64; 3] {
        move |t| {
            let mut all = [0.0; 3];
            for k in 1..=5 {
                let (size, w) = (0.5 / f64::from(k), 0.63 * f64::from(k));
                let phase = w * t + seed * f64::from(k * k);
                all[0] += size * phase.sin();
                all[1] += size * w * phase.cos();
                all[2] -= size * w * w * phase.sin();
            }
            all
        }
    }

    impl Joint {
        /// Torque and velocity at `rate` Hz over 20 s, and the noise's deviation over the peak of the torque.
        fn moved(&self, motion: &Motion, rate: f64) -> [Vec<f64>; 2] {
            let Self([inertia, gravity, viscous, coulomb]) = *self;
            (0..(20.0 * rate) as usize)
                .map(|k| {
                    let [q, v, a] = motion(k as f64 / rate);
                    let friction = viscous * v + coulomb * (v / 1e-3).tanh();
                    (inertia * a + gravity * q.cos() + friction, v)
                })
                .unzip()
                .into()
        }
    }

    fn noisy(tau: &[f64], deviation: f64, seed: u64) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let noise = Normal::new(0.0, deviation).unwrap();
        tau.iter().map(|tau| tau + noise.sample(&mut rng)).collect()
    }

    fn peak(tau: &[f64]) -> f64 {
        tau.iter().fold(0.0, |most: f64, v| most.max(v.abs()))
    }

    /// Of 96 cut torques; in the others the plateaus are short beside their noise.
    #[test]
    fn a_cut_torque_is_found_whatever_the_noise_of_its_plateau() {
        let mut missed = Vec::new();
        for (joint, seed) in JOINTS.iter().zip([3u16, 4, 5, 6]) {
            for rate in [200.0, 1000.0] {
                let [tau, speed] = joint.moved(&waves(f64::from(seed)), rate);
                for share in [0.5, 0.6, 0.75] {
                    let level = share * peak(&tau);
                    let cut: Vec<f64> = tau.iter().map(|v| v.clamp(-level, level)).collect();
                    for noise in [2e-4, 2e-3, 1e-2, 2e-2] {
                        let cut = noisy(&cut, noise * level, u64::from(seed));
                        let [low, high] = plateaus(&[[&cut, &speed]]);
                        for own in [low.map(Plateau::mirrored), high].into_iter().flatten() {
                            let off = own.level / level - 1.0;
                            assert!(off.abs() < 2.0 * noise + 1e-3, "{joint:?} {rate} {own:?}");
                            assert!(own.edge < level, "{joint:?} {rate} {own:?}");
                        }
                        if low.is_none() && high.is_none() {
                            missed.push(format!("{joint:?} {rate} {share} {noise}"));
                        }
                    }
                }
            }
        }
        assert!(missed.len() <= 20, "{} {missed:#?}", missed.len());
    }

    /// Noise of one converter step: two or three values.
    #[test]
    fn a_plateau_that_dithers_between_converter_steps_is_found() {
        for (joint, seed) in JOINTS.iter().zip([7u16, 8, 9, 10]) {
            let [tau, speed] = joint.moved(&waves(f64::from(seed)), 500.0);
            let (level, step) = (0.6 * peak(&tau), 1e-3 * peak(&tau));
            let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(u64::from(seed));
            let cut: Vec<f64> = (tau.iter())
                .map(|v| {
                    let read = v.clamp(-level, level) + step * rng.random::<f64>();
                    (read / step).round() * step
                })
                .collect();
            assert_ne!(plateaus(&[[&cut, &speed]]), [None; 2], "{joint:?}");
        }
    }

    #[test]
    fn peaks_friction_and_rests_are_not_cut() {
        let horizontal = |t: f64| {
            // The gravity of a link that turns back where it is horizontal: a flat top of fourth order.
            let (w, size) = (1.3, 0.6);
            let phase = w * t;
            [
                size * (1.0 - phase.cos()),
                size * w * phase.sin(),
                size * w * w * phase.cos(),
            ]
        };
        let one_sine = |t: f64| {
            let phase = 2.1 * t;
            [0.7 * phase.sin(), 1.47 * phase.cos(), -3.09 * phase.sin()]
        };
        // Constant velocities to and fro.
        let sweep = |t: f64| {
            let speed = [0.3, 0.8, 1.5][(t / 6.0) as usize % 3];
            let within = t.rem_euclid(2.0);
            let sense = if within < 1.0 { 1.0 } else { -1.0 };
            [speed * (1.0 - (within - 1.0).abs()), sense * speed, 0.0]
        };
        // Steps with dwells between them.
        let stairs = |t: f64| {
            let (step, within) = ((t / 2.0).floor(), t.rem_euclid(2.0).min(0.5));
            let up = if (step as i64) % 8 < 4 { 0.3 } else { -0.3 };
            let from = 0.3 * (4.0 - ((step as i64) % 8 - 4).abs() as f64);
            let phase = TAU * within / 0.5;
            [
                from + up * (phase - phase.sin()) / TAU,
                up * (1.0 - phase.cos()) / 0.5,
                up * TAU * phase.sin() / 0.25,
            ]
        };
        const TAU: f64 = core::f64::consts::TAU;
        let others = [
            Joint([0.02, 0.0, 0.01, 1.0]),
            Joint([0.002, 0.05, 0.02, 0.8]),
            Joint([0.3, 0.0, 0.0, 0.0]),
            Joint([0.01, 5.0, 0.0, 0.0]),
        ];
        let mut found = Vec::new();
        for joint in JOINTS.iter().chain(&others) {
            for rate in [100.0, 500.0, 1000.0] {
                for seed in 0..4u16 {
                    let several = waves(f64::from(seed));
                    let motions: [(&str, &Motion); 5] = [
                        ("waves", &several),
                        ("horizontal", &horizontal),
                        ("sine", &one_sine),
                        ("sweep", &sweep),
                        ("stairs", &stairs),
                    ];
                    for (name, motion) in motions {
                        let [tau, speed] = joint.moved(motion, rate);
                        for noise in [0.0, 2e-4, 2e-3, 1e-2, 2e-2, 0.1] {
                            let tau = noisy(&tau, noise * peak(&tau), u64::from(seed));
                            if plateaus(&[[&tau, &speed]]) != [None; 2] {
                                found.push(format!("{joint:?} {name} {rate} {noise}"));
                            }
                        }
                    }
                }
            }
        }
        // Of 2880, 12: most of a link that turns back where it is horizontal, the flattest of all peaks, and of friction alone.
        assert!(found.len() <= 14, "{} {found:#?}", found.len());
    }
}
