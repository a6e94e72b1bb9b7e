//! Writer of a trajectory's TOML text.

use std::fmt::Write as _;

use rig_shared::trajectory::{
    Chirp, Fourier, FrictionSweep, SlowReversals, Staircase, Sweep, Trajectory,
};

use super::content::TrajectoryFile;
use rig_model::robot::{JointKind, Robot};

fn number(value: f64) -> String {
    format!("{value:?}")
}

fn list(values: &[f64]) -> String {
    let items: Vec<String> = values.iter().map(|v| number(*v)).collect();
    format!("[{}]", items.join(", "))
}

fn seconds(micros: u32) -> f64 {
    f64::from(micros) / 1e6
}

fn line(out: &mut String, key: &str, value: &str, comment: &str) {
    let assignment = format!("{key} = {value}");
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{assignment:<40} # {comment}");
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Lines of the text, with the unit of the joint.
struct Lines<'a> {
    out: &'a mut String,
    unit: &'a str,
}

impl Lines<'_> {
    /// Writes one line.
    fn put(&mut self, key: &str, value: String, comment: &str) {
        line(self.out, key, &value, comment);
    }

    /// Returns the comment of an amount in the joint's unit.
    fn amount(&self, what: &str) -> String {
        format!("{}, {what}", self.unit)
    }
}

/// Returns the text of times in seconds.
fn times(micros: &[u32]) -> String {
    list(&micros.iter().map(|t| seconds(*t)).collect::<Vec<_>>())
}

/// Writes the parameters of one joint's motion.
fn write_motion(out: &mut String, trajectory: &Trajectory<f64>, unit: &str) {
    let mut line = Lines { out, unit };
    match trajectory {
        Trajectory::Hold(duration) => {
            line.put("kind", quoted("hold"), "stands still");
            line.put("duration", number(seconds(*duration)), "s");
        }
        Trajectory::Fourier(m) => write_fourier(&mut line, m),
        Trajectory::Chirp(m) => write_chirp(&mut line, m),
        Trajectory::Staircase(m) => write_staircase(&mut line, m),
        Trajectory::SlowReversals(m) => write_reversals(&mut line, m),
        Trajectory::FrictionSweep(m) => write_sweep(&mut line, m),
    }
}

/// Writes the parameters of a Fourier series.
fn write_fourier(line: &mut Lines<'_>, m: &Fourier<f64>) {
    line.put(
        "kind",
        quoted("fourier"),
        "E(t) * sum of a_k sin(k w t) + b_k cos(k w t)",
    );
    line.put(
        "period",
        number(seconds(m.period_us)),
        "s, of the fundamental: w = 2 pi / period",
    );
    line.put(
        "periods",
        m.periods.to_string(),
        "whole periods at full amplitude",
    );
    line.put(
        "ramp",
        number(seconds(m.ramp_us)),
        "s, rise and fall of the envelope E before and after them",
    );
    line.put(
        "sine",
        list(&m.sine),
        &line.amount("a_k from the fundamental upwards"),
    );
    line.put("cosine", list(&m.cosine), &line.amount("b_k"));
}

/// Writes the parameters of a chirp.
fn write_chirp(line: &mut Lines<'_>, m: &Chirp<f64>) {
    let sweep = match m.sweep {
        Sweep::Linear => "linear",
        Sweep::Logarithmic => "logarithmic",
    };
    line.put("kind", quoted("chirp"), "swept sine");
    line.put("start_hz", number(m.start_hz), "Hz");
    line.put("end_hz", number(m.end_hz), "Hz");
    line.put("sweep", quoted(sweep), "linear or logarithmic in time");
    line.put(
        "duration",
        number(seconds(m.duration_us)),
        "s of one pass, with both ramps",
    );
    line.put(
        "ramp",
        number(seconds(m.ramp_us)),
        "s, rise and fall of the amplitude",
    );
    line.put(
        "amplitude",
        number(m.amplitude),
        &line.amount("largest amplitude"),
    );
    line.put(
        "velocity",
        number(m.velocity),
        &format!(
            "{}/s, bounds the amplitude at higher frequencies",
            line.unit
        ),
    );
    line.put(
        "acceleration",
        number(m.acceleration),
        &format!("{}/s^2, likewise", line.unit),
    );
    if m.again > 0.0 {
        line.put("again", number(m.again), "of all that, a second pass");
    }
}

/// Writes the parameters of a staircase.
fn write_staircase(line: &mut Lines<'_>, m: &Staircase<f64>) {
    line.put(
        "kind",
        quoted("staircase"),
        "moves to each level, back to the start at the end",
    );
    line.put("levels", list(&m.levels), &line.amount("from the start"));
    line.put("move", number(seconds(m.move_us)), "s, length of a move");
    line.put(
        "dwell",
        number(seconds(m.dwell_us)),
        "s, rest after each move",
    );
}

/// Writes the parameters of slow reversals.
fn write_reversals(line: &mut Lines<'_>, m: &SlowReversals<f64>) {
    line.put(
        "kind",
        quoted("reversals"),
        "slow triangles with rounded turns",
    );
    line.put(
        "speed",
        number(m.speed),
        &format!("{}/s between the turns", line.unit),
    );
    line.put(
        "half_turn",
        number(seconds(m.half_turn_us)),
        "s, half the length of a turn",
    );
    line.put(
        "quarter",
        times(&m.quarter_us),
        "s from the centre to where the turn begins, one per amplitude",
    );
    line.put("cycles", m.cycles.to_string(), "triangles per amplitude");
}

/// Writes the parameters of a friction sweep.
fn write_sweep(line: &mut Lines<'_>, m: &FrictionSweep<f64>) {
    line.put(
        "kind",
        quoted("sweep"),
        "forth and back at each of several constant speeds",
    );
    line.put(
        "half_span",
        number(m.half_span),
        &line.amount("half the distance between the ends"),
    );
    line.put(
        "cruise",
        times(&m.cruise_us),
        "s at constant speed, one per speed",
    );
    line.put(
        "ramp",
        number(seconds(m.ramp_us)),
        "s to reach the speed, and to stop",
    );
    line.put(
        "dwell",
        number(seconds(m.dwell_us)),
        "s at rest after each pass",
    );
    line.put(
        "lead",
        number(seconds(m.lead_us)),
        "s from the start to the first end, and back",
    );
}

impl TrajectoryFile {
    /// Writes TOML with units in comments; [`TrajectoryFile::from_toml`] reads back an equal file.
    pub fn to_toml(&self, robot: &Robot) -> String {
        let mut out = String::new();
        line(
            &mut out,
            "robot",
            &quoted(&self.robot),
            "for which it was made",
        );
        if let Some(off) = self.drive_off {
            line(
                &mut out,
                "drive_off",
                &number(off),
                "s after the start the drive is switched off, and the joint coasts",
            );
        }
        if let Some(d) = &self.design {
            out.push_str("\n[design]\n");
            line(
                &mut out,
                "criterion",
                &quoted(d.criterion.name()),
                "what was optimised",
            );
            line(&mut out, "value", &number(d.value), "of that criterion");
            line(
                &mut out,
                "condition_number",
                &number(d.condition_number),
                "of the regressor as it was judged",
            );
            line(
                &mut out,
                "seed",
                &d.seed.to_string(),
                "of the optimiser's starts",
            );
        }
        for (k, joint) in self.joints.iter().enumerate() {
            let unit = match robot.joints.get(k).map(|j| j.kind) {
                Some(JointKind::Prismatic) => "m",
                _ => "rad",
            };
            out.push_str("\n[[joint]]\n");
            line(
                &mut out,
                "name",
                &quoted(&joint.name),
                "as in the robot description",
            );
            line(
                &mut out,
                "start",
                &number(joint.start),
                &format!("{unit}, where it stands before and after; the motion is relative to it"),
            );
            out.push_str("\n[joint.trajectory]\n");
            write_motion(&mut out, &joint.trajectory, unit);
        }
        out
    }
}
