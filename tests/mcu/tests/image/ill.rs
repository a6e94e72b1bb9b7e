//! Boards with the errors of real parts: the intervals of the estimates hold the truth at the rate that they claim.
//!
//! Four boards, or as many as the environment variable RIG_ILL_BOARDS says.

use rig_data::prepare::InMemory;
use rig_identify::{Options, identify};
use rig_link::Row;
use rig_mcu::ill_board::IllBoard;
use rig_mcu::line_noise::LineNoise;
use rig_mcu::rig::power_on;
use rig_plant::PlantConfig;
use rig_shared::link::PARAMETER_NAMES;
use rig_shared::safety::{Limit, LimitSet, Limits};
use rig_shared::trajectory::{Fourier, Trajectory};
use rig_shared::wire::message::RequestBody;
use rig_tests::{
    Recording, base_parameters_of, calibrated, deviations, driven, excitation, in_parallel, robot,
};

use crate::{BoardSession, greeted, image, place, plant};

/// Boards without the environment variable.
const BOARDS: u64 = 4;
/// Chance with which a sound estimator fails a bound of this test.
const CHANCE: f64 = 1e-3;

fn boards() -> u64 {
    let given = std::env::var("RIG_ILL_BOARDS").ok();
    given.map_or(BOARDS, |given| given.parse().unwrap())
}

/// A board with errors, calibrated, told where its link hangs.
fn ill_bench(seed: u64) -> (BoardSession, PlantConfig) {
    let ill = IllBoard::drawn(seed);
    let mut rig = plant(seed);
    ill.apply(&mut rig);
    let mut emulated = power_on(image(), rig.clone(), seed).unwrap();
    emulated.with_board(|board| ill.apply_to_board(board));
    let mut line = greeted(emulated);
    line.port_mut().device_mut().noise = Some(LineNoise::new(ill.line_errors, seed));
    calibrated(&mut line);
    place(&mut line);
    // The template's ranges are too small for a link that hangs askew, and for a duty at which the current does not settle.
    let limits = rig_firmware::nameplate::one_link().1.limits;
    line.request(RequestBody::SetLimits(Limits {
        position_low: -4.2,
        position_high: 4.2,
        velocity: 7.5,
        ..limits
    }))
    .unwrap();
    (line, rig)
}

/// Highest RMS current of a motion, A: the motor's continuous rating is 1.6 A.
const CURRENT: f64 = 1.3;

/// An excitation at up to 6.2 rad/s, 1.8 rad and [`CURRENT`]: at the drawn supplies a part of it has a duty beyond the settled
/// one.
fn fast(seed: u64, periods: u16, plant: &PlantConfig) -> Trajectory<f32> {
    let motion = excitation(seed, 3, periods);
    let all = motion.extremes();
    let mut scale = (6.2 / all.velocity).min(1.8 / all.highest.max(-all.lowest));
    loop {
        let scaled = scaled(&motion, scale);
        if rms_current(&scaled, plant) < CURRENT {
            return scaled;
        }
        scale *= 0.97;
    }
}

fn scaled(motion: &Trajectory<f32>, scale: f32) -> Trajectory<f32> {
    let Trajectory::Fourier(shape) = motion else {
        panic!("not a Fourier series");
    };
    Trajectory::Fourier(Fourier {
        sine: shape.sine.iter().map(|x| x * scale).collect(),
        cosine: shape.cosine.iter().map(|x| x * scale).collect(),
        ..shape.clone()
    })
}

/// RMS current of a motion from the rest position by the rig's own parameters, A.
fn rms_current(motion: &Trajectory<f32>, plant: &PlantConfig) -> f64 {
    let of = plant.equivalent();
    let motion = motion.to_f64();
    let steps = (100.0 * motion.duration()) as u64;
    let squares = (0..steps).map(|step| {
        let now = motion.at_tick(step, 100);
        let (sin, cos) = (plant.initial_position + now.position).sin_cos();
        let torque = of.inertia * now.acceleration
            + of.gravity_cos * cos
            + of.gravity_sin * sin
            + of.viscous * now.velocity
            + of.coulomb * now.velocity.signum();
        (torque / plant.mechanism.ratio / plant.motor.torque_constant).powi(2)
    });
    (squares.sum::<f64>() / steps as f64).sqrt()
}

fn is_marked(row: &Row) -> bool {
    LimitSet(row.limits as u8).has(Limit::Unsettled)
}

/// The recording as a file has it, with or without its marks.
fn as_recording(recording: &Recording, torque_per_ampere: f64, with_marks: bool) -> InMemory {
    let of = |f: &dyn Fn(&Row) -> f64| recording.rows.iter().map(f).collect::<Vec<_>>();
    let mut made = recording.in_memory("ill board", torque_per_ampere);
    let extra = &mut made.blocks[0].extra;
    extra.push(("mode".to_owned(), of(&|row| row.mode)));
    if with_marks {
        extra.push(("limits".to_owned(), of(&|row| row.limits)));
    }
    made
}

/// What was found on one board.
struct Outcome {
    /// Share of rows with a mark.
    marked: f64,
    trusted: [bool; 6],
    /// On-line errors in standard deviations.
    on_line: [f64; 6],
    /// Off-line errors in half widths of the 95 % intervals: with the marks, and without them.
    off_line: [[f64; 6]; 2],
}

/// Errors of the off-line identification in half widths of its 95 % intervals.
fn off_line(runs: &[Recording], plant: &PlantConfig, with_marks: bool) -> [f64; 6] {
    let torque_per_ampere = plant.mechanism.ratio * plant.motor.torque_constant;
    let [first, second] = [0, 1].map(|k| as_recording(&runs[k], torque_per_ampere, with_marks));
    let found = identify(&robot(), &[&first, &second], &[], &Options::default()).unwrap();
    let truth = base_parameters_of(plant);
    assert_eq!(found.base_parameters.len(), truth.len());
    std::array::from_fn(|k| {
        let [low, high] = found.base_parameters[k].interval;
        (found.base_parameters[k].value - truth[k]) / (0.5 * (high - low))
    })
}

fn study(seed: u64) -> Outcome {
    let (mut line, plant) = ill_bench(seed);
    let runs = [0, 1].map(|run| {
        let run = driven(&mut line, vec![], fast(2 * seed + run, 6, &plant), 0.5);
        assert!(run.faults.is_empty(), "board {seed}: {:?}", run.faults);
        run
    });
    let rows = || runs.iter().flat_map(|run| &run.rows);
    let estimate = runs[1].estimate();
    Outcome {
        marked: rows().filter(|row| is_marked(row)).count() as f64 / rows().count() as f64,
        trusted: estimate.trusted,
        on_line: deviations(&estimate, &plant),
        off_line: [true, false].map(|with_marks| off_line(&runs, &plant, with_marks)),
    }
}

/// Returns the fewest intervals of `count` that hold the truth if each does with `share`, but for a chance of [`CHANCE`].
fn fewest_covered(count: usize, share: f64) -> usize {
    // Probability of exactly k misses, from k = 0 on.
    let mut exactly = share.powi(count as i32);
    let mut more = 1.0 - exactly;
    let mut misses = 0;
    while more > CHANCE && misses < count {
        exactly *= (count - misses) as f64 / (misses + 1) as f64 * (1.0 - share) / share;
        misses += 1;
        more -= exactly;
    }
    count - misses
}

/// What became of the intervals of one parameter.
struct Coverage {
    inside: usize,
    count: usize,
    /// Root mean square of the errors.
    rms: f64,
}

impl Coverage {
    /// Counts errors of at most `width`.
    fn of(errors: &[f64], width: f64) -> Self {
        let squares: f64 = errors.iter().map(|error| error * error).sum();
        Self {
            inside: errors.iter().filter(|error| error.abs() <= width).count(),
            count: errors.len(),
            rms: (squares / errors.len() as f64).sqrt(),
        }
    }

    /// Returns true if as many hold the truth as 95 % intervals must.
    fn is_fair(&self) -> bool {
        self.inside >= fewest_covered(self.count, 0.95)
    }
}

impl std::fmt::Display for Coverage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let cell = format!("{} of {} ({:.2})", self.inside, self.count, self.rms);
        write!(f, "{cell:>17}")
    }
}

/// Ill boards move fast: up to a fifth of their rows is marked. On line and off line the 95 % intervals hold the
/// truth. Off line they do not if the marks are ignored.
#[test]
fn the_intervals_of_ill_boards_hold_the_truth_as_often_as_they_claim() {
    let outcomes = in_parallel(boards(), study);
    let mut text = String::from(
        "95 % intervals with the truth (RMS error, on line in standard deviations, off line in half widths)\n\
         parameter           on line          off line     marks ignored\n",
    );
    let (mut fair, mut with_marks, mut without) = (true, 0, 0);
    for (k, name) in PARAMETER_NAMES.iter().enumerate() {
        // Base parameters begin with those of gravity.
        let base = [2, 0, 1, 3, 4, 5][k];
        let trusted = outcomes.iter().filter(|o| o.trusted[k]);
        let errors: Vec<f64> = trusted.map(|o| o.on_line[k]).collect();
        let on_line = Coverage::of(&errors, 1.96);
        let [marked, ignored] = [0, 1].map(|way| {
            let errors: Vec<f64> = outcomes.iter().map(|o| o.off_line[way][base]).collect();
            Coverage::of(&errors, 1.0)
        });
        text += &format!("{name:<9} {on_line} {marked} {ignored}\n");
        fair &= on_line.is_fair() && marked.is_fair();
        fair &= 10 * on_line.count >= 9 * outcomes.len();
        with_marks += marked.inside;
        without += ignored.inside;
    }
    let shares = outcomes.iter().map(|o| 100.0 * o.marked);
    let [least, most] = [
        shares.clone().fold(100.0, f64::min),
        shares.fold(0.0, f64::max),
    ];
    text += &format!(
        "{} boards, {least:.1} to {most:.1} % of the rows marked\n",
        outcomes.len()
    );
    println!("{text}");
    assert!(fair && without < with_marks, "\n{text}");
}
