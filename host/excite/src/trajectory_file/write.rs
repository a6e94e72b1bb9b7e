//! Writer of a trajectory's TOML text.

use std::fmt::Write as _;

use rig_shared::trajectory::{Sweep, Trajectory};

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

fn write_motion(out: &mut String, trajectory: &Trajectory<f64>, unit: &str) {
    let all = |times: &[u32]| list(&times.iter().map(|t| seconds(*t)).collect::<Vec<_>>());
    let mut put = |key: &str, value: String, comment: &str| line(out, key, &value, comment);
    let each = |what: &str| format!("{unit}, {what}");
    match trajectory {
        Trajectory::Hold(duration) => {
            put("kind", quoted("hold"), "stands still");
            put("duration", number(seconds(*duration)), "s");
        }
        Trajectory::Fourier(m) => {
            put(
                "kind",
                quoted("fourier"),
                "E(t) * sum of a_k sin(k w t) + b_k cos(k w t)",
            );
            put(
                "period",
                number(seconds(m.period_us)),
                "s, of the fundamental: w = 2 pi / period",
            );
            put(
                "periods",
                m.periods.to_string(),
                "whole periods at full amplitude",
            );
            put(
                "ramp",
                number(seconds(m.ramp_us)),
                "s, rise and fall of the envelope E before and after them",
            );
            put(
                "sine",
                list(&m.sine),
                &each("a_k from the fundamental upwards"),
            );
            put("cosine", list(&m.cosine), &each("b_k"));
        }
        Trajectory::Chirp(m) => {
            let sweep = match m.sweep {
                Sweep::Linear => "linear",
                Sweep::Logarithmic => "logarithmic",
            };
            put("kind", quoted("chirp"), "swept sine");
            put("start_hz", number(m.start_hz), "Hz");
            put("end_hz", number(m.end_hz), "Hz");
            put("sweep", quoted(sweep), "linear or logarithmic in time");
            put(
                "duration",
                number(seconds(m.duration_us)),
                "s of one pass, with both ramps",
            );
            put(
                "ramp",
                number(seconds(m.ramp_us)),
                "s, rise and fall of the amplitude",
            );
            put("amplitude", number(m.amplitude), &each("largest amplitude"));
            put(
                "velocity",
                number(m.velocity),
                &format!("{unit}/s, bounds the amplitude at higher frequencies"),
            );
            put(
                "acceleration",
                number(m.acceleration),
                &format!("{unit}/s^2, likewise"),
            );
            if m.again > 0.0 {
                put("again", number(m.again), "of all that, a second pass");
            }
        }
        Trajectory::Staircase(m) => {
            put(
                "kind",
                quoted("staircase"),
                "moves to each level, back to the start at the end",
            );
            put("levels", list(&m.levels), &each("from the start"));
            put("move", number(seconds(m.move_us)), "s, length of a move");
            put(
                "dwell",
                number(seconds(m.dwell_us)),
                "s, rest after each move",
            );
        }
        Trajectory::SlowReversals(m) => {
            put(
                "kind",
                quoted("reversals"),
                "slow triangles with rounded turns",
            );
            put(
                "speed",
                number(m.speed),
                &format!("{unit}/s between the turns"),
            );
            put(
                "half_turn",
                number(seconds(m.half_turn_us)),
                "s, half the length of a turn",
            );
            put(
                "quarter",
                all(&m.quarter_us),
                "s from the centre to where the turn begins, one per amplitude",
            );
            put("cycles", m.cycles.to_string(), "triangles per amplitude");
        }
        Trajectory::FrictionSweep(m) => {
            put(
                "kind",
                quoted("sweep"),
                "forth and back at each of several constant speeds",
            );
            put(
                "half_span",
                number(m.half_span),
                &each("half the distance between the ends"),
            );
            put(
                "cruise",
                all(&m.cruise_us),
                "s at constant speed, one per speed",
            );
            put(
                "ramp",
                number(seconds(m.ramp_us)),
                "s to reach the speed, and to stop",
            );
            put(
                "dwell",
                number(seconds(m.dwell_us)),
                "s at rest after each pass",
            );
            put(
                "lead",
                number(seconds(m.lead_us)),
                "s from the start to the first end, and back",
            );
        }
    }
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
