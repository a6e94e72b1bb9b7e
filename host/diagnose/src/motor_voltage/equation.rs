//! The voltage equation of one motor as rows of a regression.

use crate::DiagnoseError;
use crate::acceptance::coordinates::Coordinate;
use crate::recordings::context::PreparedData;
use crate::rows::regression::{Column, Rows, combined};
use crate::rows::thinning::Thinning;
use rig_data::prepare::central_difference;
use rig_data::runs::{JointRun, Run};
use rig_model::robot::{Drive, Robot};

/// Index of the resistance among the nominal columns.
pub(crate) const CURRENT: usize = 0;
/// Index of the inductance.
pub(crate) const CHANGE: usize = 1;
/// Index of the back-EMF.
pub(crate) const SPEED: usize = 2;
/// Index of the different sampling instants.
pub(crate) const ACCELERATION: usize = 3;
/// Index of the current sensor's zero.
pub(crate) const CONSTANT: usize = 4;
/// Index of the back-EMF's loss by iron saturation, to first order in the squared current.
const SATURATION: usize = 5;
const COLUMNS: usize = 6;
/// Index of the current among the coordinates.
pub(crate) const ACROSS: usize = 0;

/// Currents below which a dead zone fades, A, because ripple crosses zero within the pulse: up to half an ampere,
/// depending on switching and inductance.
pub(crate) const FADES: [f64; 11] = [
    0.0, 0.01, 0.015, 0.022, 0.033, 0.05, 0.075, 0.11, 0.17, 0.25, 0.5,
];

/// Largest relative difference between clocks of one rate.
const SAME_RATE: f64 = 1e-3;
/// Largest share of drive-off time in a row after the low-pass: a volt less is a volt in the row.
const COASTS: f64 = 1e-3;

/// Rows of one joint's voltage with the columns of its winding.
pub(crate) struct Equation {
    /// The voltage takes the torque's place, V.
    pub(crate) rows: Rows,
    /// Voltage lost per volt of a dead zone, for each of [`FADES`].
    pub(crate) dead_zones: Vec<Column>,
    /// Torque per current at the joint, by the description, N·m/A or N/A.
    pub(crate) torque_per_ampere: f64,
    current: Vec<f64>,
    speed: Vec<f64>,
}

/// A recording of clamped joints with another sample rate, Hz, than the others.
#[derive(Debug, thiserror::Error)]
#[error("it is sampled at {own:.1} Hz and the others at {rate:.1} Hz; record it as them")]
struct OtherRate {
    own: f64,
    rate: f64,
}

impl Equation {
    /// Builds the rows of a joint from runs in motion and clamped ones. `None` without a complete voltage record, or if
    /// the torque does not represent a current.
    ///
    /// # Errors
    /// [`DiagnoseError::Clamped`] if the rates differ.
    pub(crate) fn of(
        robot: &Robot,
        joint: usize,
        prepared: &PreparedData,
        clamped: &[Run],
    ) -> Result<Option<Self>, DiagnoseError> {
        let own = robot.joints.get(joint);
        let Some(drive) = own.and_then(|j| j.drive.as_ref()) else {
            return Ok(None);
        };
        let torque_per_ampere = drive.gear_ratio * drive.torque_constant;
        let alone =
            (robot.joints.iter().filter_map(|j| j.drive.as_ref())).all(|d| d.couples.is_empty());
        let recorded = !prepared.runs.is_empty()
            && (prepared.runs.iter()).all(|run| run.joints[joint].voltage.is_some());
        if torque_per_ampere == 0.0 || !alone || !recorded {
            return Ok(None);
        }
        let mut collected = Collected::default();
        let rate = prepared.runs[0].rate;
        for run in prepared.runs.iter().chain(clamped) {
            if (run.rate / rate - 1.0).abs() > SAME_RATE {
                let own = run.rate;
                return Err(DiagnoseError::Clamped {
                    label: run.label.clone(),
                    what: OtherRate { own, rate }.to_string(),
                });
            }
            collected.push(&prepared.rows.thinning, run, &run.joints[joint], drive);
        }
        let one = |values: Vec<f64>| -> Column { vec![Some(values)] };
        Ok(Some(Self {
            rows: Rows {
                thinning: prepared.rows.thinning.clone(),
                count: collected.voltage.len(),
                starts: collected.starts,
                period: prepared.rows.period,
                torque: vec![collected.voltage],
                keep: vec![collected.keep],
                legible: Vec::new(),
                clear: Vec::new(),
                left_out: Vec::new(),
                nominal: collected.columns.map(one).into(),
            },
            dead_zones: collected.dead_zones.map(one).into(),
            torque_per_ampere,
            current: collected.current,
            speed: collected.speed,
        }))
    }

    /// Returns the change by more fading: the unknown fading increases other uncertainties. Empty at the grid's ends.
    pub(crate) fn fading(&self, k: usize) -> Vec<Column> {
        let around = k
            .checked_sub(1)
            .and_then(|before| Some((self.dead_zones.get(before)?, self.dead_zones.get(k + 1)?)));
        (around.into_iter())
            .map(|(before, after)| combined(1, [(before, -1.0), (after, 1.0)]))
            .collect()
    }

    /// Returns the coordinates that the voltage may depend on; the current is at [`ACROSS`].
    pub(crate) fn coordinates(&self) -> Vec<Coordinate> {
        let of = |name: &str, unit, values: &[f64]| Coordinate {
            name: name.to_owned(),
            unit,
            values: values.to_vec(),
        };
        vec![
            of("current of the motor", "A", &self.current),
            of("speed of the motor", "rad/s", &self.speed),
        ]
    }

    /// Returns the RMS residual, V, with coefficients of the nominal columns, then of a dead zone.
    pub(crate) fn rms(&self, values: &[f64], dead_zone: Option<usize>) -> f64 {
        let effect = dead_zone.and_then(|k| self.dead_zones.get(k));
        let columns: Vec<&Column> = self.rows.nominal.iter().chain(effect).collect();
        let keep = &self.rows.keep[0];
        let squares: f64 = (0..self.rows.count)
            .filter(|k| keep[*k])
            .map(|k| {
                let explained: f64 = (columns.iter().zip(values))
                    .map(|(column, value)| column[0].as_ref().map_or(0.0, |c| value * c[k]))
                    .sum();
                (self.rows.torque[0][k] - explained).powi(2)
            })
            .sum();
        (squares / self.rows.used(0).max(1) as f64).sqrt()
    }
}

/// Columns of the equation so far, in the order of the runs; see [`Equation`].
struct Collected {
    voltage: Vec<f64>,
    columns: [Vec<f64>; COLUMNS],
    dead_zones: [Vec<f64>; FADES.len()],
    /// True for rows with the drive on.
    keep: Vec<bool>,
    starts: Vec<usize>,
    current: Vec<f64>,
    speed: Vec<f64>,
}

impl Default for Collected {
    fn default() -> Self {
        Self {
            voltage: Vec::new(),
            columns: [const { Vec::new() }; COLUMNS],
            dead_zones: [const { Vec::new() }; FADES.len()],
            keep: Vec::new(),
            starts: vec![0],
            current: Vec::new(),
            speed: Vec::new(),
        }
    }
}

impl Collected {
    /// Appends the rows of a run of `joint`, if its voltage was recorded.
    fn push(&mut self, thinning: &Thinning, run: &Run, joint: &JointRun, drive: &Drive) {
        let Some(u) = &joint.voltage else { return };
        let torque_per_ampere = drive.gear_ratio * drive.torque_constant;
        let i: Vec<f64> = (joint.recorded().iter())
            .map(|t| t / torque_per_ampere)
            .collect();
        let scaled =
            |signal: &[f64]| -> Vec<f64> { signal.iter().map(|x| drive.gear_ratio * x).collect() };
        let omega = scaled(&joint.qd);
        let columns = &mut self.columns;
        thinning.push_raw(u, &[], &mut self.voltage);
        thinning.push_raw(&i, &[], &mut columns[CURRENT]);
        thinning.push_raw(
            &central_difference(&i, 1.0 / run.rate),
            &[],
            &mut columns[CHANGE],
        );
        thinning.push(&omega, &[], &mut columns[SPEED]);
        thinning.push(&scaled(&joint.qdd), &[], &mut columns[ACCELERATION]);
        thinning.push(&vec![1.0; i.len()], &[], &mut columns[CONSTANT]);
        // Sign of the current without its noise.
        let smooth = thinning.smooth(&i);
        let saturated: Vec<f64> = (smooth.iter().zip(&omega))
            .map(|(i, omega)| i * i * omega)
            .collect();
        thinning.push_raw(&saturated, &[], &mut columns[SATURATION]);
        for (dead, fade) in self.dead_zones.iter_mut().zip(FADES) {
            let lost: Vec<f64> = smooth.iter().map(|i| lost(*i, fade)).collect();
            thinning.push_raw(&lost, &[], dead);
        }
        let mut coasts = vec![0.0; i.len()];
        for own in &run.coasting {
            coasts[own.clone()].fill(1.0);
        }
        let mut share = Vec::new();
        thinning.push_raw(&coasts, &[], &mut share);
        self.keep.extend(share.iter().map(|s| s.abs() < COASTS));
        thinning.pick(&smooth, &mut self.current);
        thinning.pick(&omega, &mut self.speed);
        self.starts.push(self.speed.len());
    }
}

/// Returns the voltage that an inverter loses at a current, per volt of its dead zone.
fn lost(current: f64, fade: f64) -> f64 {
    if current == 0.0 {
        0.0
    } else if fade == 0.0 {
        current.signum()
    } else {
        (current / fade).tanh()
    }
}
