//! The frequency response of one joint and the stiffness that it shows.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use rig_model::robot::{JointKind, Robot};
use rig_output::format_significant;
use rig_shared::multibody::{column, gravity_vector, inertia_matrix};
use rig_shared::transmission::DriveKind;
use serde::Serialize;

use super::bands::{Band, BandBins, bands};
use super::coupling::coupling;
use super::fit::{Fitted, Known, frictionless, unexplained};
use super::periodic::Periodic;
use super::search::{Gap, fit_all};
use super::spectra::{Spectra, spectra, usable};
use super::two_mass::{C, Gravity};
use crate::drives::{Drives, are_links_described, listed_pose, loaded};
use crate::error::ComplianceError;
use crate::signals::Signals;
use crate::value::Value;

/// Fewest bands with significant coherence. The model has seven parameters, and a band has two equations.
const FEWEST: usize = 12;
/// Relative distance from the antiresonance on either side within which the response must be coherent. By judgement: an
/// antiresonance of usual damping (a few per cent) is narrower, so that the response shows it and its flanks.
const FLANK: f64 = 0.3;
/// Share of the bands there whose coherence must be significant: in the antiresonance itself the velocity is small.
const COHERENT: f64 = 0.5;
/// Velocity that a model may leave unexplained in the mean over the periods of a multisine, over the velocity, RMS. Simulated springs
/// left 0.02 to 0.06, among them one that stiffens with its twist; gaps of 1 and 2 mrad with a twist of that size, which made the
/// stiffness 36 and 63 % too small, left 1.1 and 0.3.
const DISTORTED: f64 = 0.15;
/// The same over the noise of that mean, from which on it is not noise.
const CLEAR_OF_NOISE: f64 = 3.0;
/// Misfit of a rigid joint over that of two masses from which on an antiresonance is evident. On the emulated rig it was
/// above 10 000 where the band held the antiresonance, and 2 where it ended far below.
const EVIDENT: f64 = 10.0;
/// Relative standard deviation of the stiffness beyond which the inertia of the description is used instead.
const UNCERTAIN: f64 = 0.1;
/// Relative difference of an inertia from the described one that is told, beyond three standard deviations.
const DIFFERS: f64 = 0.15;
/// Velocity of another joint over that of the joint, RMS, from which the other one is no longer held. On the simulated EDDA with
/// 600 N·m/rad at the elbow, a shoulder with 0.021 to 0.025 of the elbow's velocity made it 824 to 989 without its torque.
const HELD: f64 = 0.01;
/// Share of rows at the highest torque that shows saturation.
const SATURATED: f64 = 0.01;
/// Share of rows at the highest torque beyond which the response is not computed.
const UNUSABLE: f64 = 0.1;
/// Missing share of the links' inertia from which on the spring counts as softer than it is, beyond three standard deviations. By
/// judgement: descriptions are hardly better. On the emulated rig, with a described inertia without error, chirps gave the inertia
/// within 0.3 %; a gap that took 10 % of the stiffness took 1.4 % of this inertia.
const SOFTER: f64 = 0.01;
/// Multiple of the noise that the model leaves which is told.
const MISFIT: f64 = 4.0;
/// Largest number of points in the figure of the signals.
const SHOWN: usize = 4000;

/// What the frequency response of one joint shows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrequencyResponse {
    /// Name of the joint.
    pub joint: String,
    /// Index of the joint, from 0.
    pub index: usize,
    /// Names of the recordings.
    pub recordings: Vec<String>,
    /// Rows.
    pub rows: usize,
    /// Length, s.
    pub seconds: f64,
    /// Rows per second.
    pub rate: f64,
    /// True if the recordings were transformed as a whole, from rest to rest; else in Hann windows.
    pub whole: bool,
    /// What whole periods of the reference show, if it is periodic: then their mean was transformed.
    pub periodic: Option<Periodic>,
    /// True if the reference is the instrument; else the torque itself.
    pub by_reference: bool,
    /// Mean pose.
    pub pose: Vec<f64>,
    /// Frequency response, by band.
    pub bands: Vec<Band>,
    /// Magnitude and phase of the fitted model at the bands.
    pub model: Vec<[f64; 2]>,
    /// Magnitude and phase of the measured response without the estimated Coulomb friction, at the bands.
    pub frictionless: Vec<[f64; 2]>,
    /// c.
    pub stiffness: Value,
    /// d.
    pub damping: Value,
    /// Antiresonance, Hz.
    pub antiresonance: Value,
    /// Resonance, Hz.
    pub resonance: Value,
    /// Inertia of the link, kg·m² (kg).
    pub link_inertia: Value,
    /// True if the inertia of the link is that of the description, and was not estimated.
    pub link_inertia_known: bool,
    /// Inertia of the motor, joint side.
    pub motor_inertia: Value,
    /// Coulomb friction of the motor, joint side.
    pub coulomb: Value,
    /// Coulomb friction of the link.
    pub link_coulomb: Value,
    /// Delay of the position after the torque, s.
    pub delay: Value,
    /// True if the torque counts as held from row to row, which explains the recording better than one of each instant.
    pub held: bool,
    /// Backlash, rad (m), if it follows from the response.
    pub backlash: Option<f64>,
    /// True if backlash makes the stiffness a lower bound.
    pub is_lower_bound: bool,
    /// Sum of squares per degree of freedom.
    pub misfit: f64,
    /// Inertia of the links at the pose by the description.
    pub described_link_inertia: Option<f64>,
    /// Inertia of the drive by the description.
    pub described_motor_inertia: Option<f64>,
    /// Stiffness by the antiresonance and the described inertia of the links.
    pub stiffness_by_description: Option<Value>,
    /// Time, torque and velocity of the longest stretch.
    #[serde(skip)]
    pub shown: [Vec<f64>; 3],
    /// What to know about the result.
    pub warnings: Vec<String>,
}

/// What the description says of a joint at a pose.
struct Described {
    /// Unit of an inertia of the joint.
    unit: &'static str,
    link: Option<f64>,
    motor: Option<f64>,
    gravity: Gravity,
}

/// Computes the frequency response of joint `k` and fits the two-mass model.
///
/// # Errors
/// [`ComplianceError`]: recordings that do not show the antiresonance, or a drive that is coupled to other joints.
pub(crate) fn respond(
    robot: &Robot,
    drives: &Drives,
    stretches: &[Signals],
    k: usize,
    by_reference: Option<bool>,
) -> Result<FrequencyResponse, ComplianceError> {
    let name = &robot.joints[k].name;
    // The inertia of the links would change with the joint's position if further axes followed it.
    let is_followed = robot.followers.iter().any(|own| own.follows == *name);
    if drives.kind(k) != DriveKind::Simple || is_followed {
        return Err(ComplianceError::Recording(format!(
            "The drive of joint \"{name}\" is coupled to other joints, moves further axes or turns a screw, so its two masses are not those of one joint; identify its stiffness by static loading (--static)."
        )));
    }
    let mut warnings = Vec::new();
    check_motion(robot, stretches, k, &mut warnings)?;
    let mut spectra = spectra(stretches, k, name, by_reference)?;
    let coupled = (usable(stretches).into_iter())
        .map(|stretch| coupling(robot, stretch, k))
        .collect::<Result<Option<Vec<_>>, _>>()?;
    warnings.extend(yielding(robot, stretches, k, coupled.is_some())?);
    if let Some(torques) = coupled {
        spectra.couple(torques);
    }
    if by_reference.is_none() && !spectra.by_reference {
        warnings.push(format!(
            "No reference of joint \"{name}\" was recorded (column ref{}): the torque itself is the instrument. With feedback on the torque the response is biased by noise and disturbances.",
            k + 1
        ));
    }
    let range = excited(&bands(&spectra), name)?;
    let described = described(robot, &spectra.pose, k)?;
    let mut known = Known {
        gravity: described.gravity,
        link_inertia: None,
        motor_inertia: None,
        rate: spectra.rate,
        hold: 0.0,
    };
    let unclear = || {
        ComplianceError::Recording(format!(
            "No model of two masses with positive inertias fits the response of joint \"{name}\" between {} and {} Hz. Either it shows no antiresonance there (record a chirp over a wider band, with more amplitude), or torque and velocity do not belong to one joint, or have opposite signs.",
            format_significant(range[0], 3),
            format_significant(range[1], 3)
        ))
    };
    let inertias = described.link.zip(described.motor).map(<[f64; 2]>::from);
    let (mut found, mut gap) = fit_all(&mut spectra, &known, inertias).ok_or_else(unclear)?;
    if let (Some(link), true) = (
        described.link,
        found.variance([1.0, 0.0, 0.0]).sqrt() > UNCERTAIN,
    ) {
        known.link_inertia = Some(link);
        (found, gap) = fit_all(&mut spectra, &known, inertias).ok_or_else(unclear)?;
        warnings.push(format!(
            "The response alone shows neither inertia of joint \"{name}\" well: the inertia of the links is that of the description, {} {unit} at this pose. Its error is not in the standard deviation. A band beyond the resonance would show it.",
            format_significant(link, 4),
            unit = described.unit
        ));
    }
    within(&found, &bands(&spectra), name, &described)?;
    explained(&found, &spectra, name)?;
    if gap == Gap::Found {
        known.link_inertia = described.link;
    }
    Ok(result(
        robot, stretches, k, spectra, &found, gap, &described, known, warnings,
    ))
}

/// Checks that the joint is the one that moves, and that its torque is not cut.
fn check_motion(
    robot: &Robot,
    stretches: &[Signals],
    k: usize,
    warnings: &mut Vec<String>,
) -> Result<(), ComplianceError> {
    for stretch in stretches {
        let movement = |j: usize| -> f64 {
            let q = &stretch.joints[j].q;
            q.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum()
        };
        let own = movement(k);
        let other = (0..stretch.joints.len())
            .filter(|j| *j != k && robot.joints[*j].kind == robot.joints[k].kind)
            .max_by(|a, b| movement(*a).total_cmp(&movement(*b)));
        if let Some(other) = other.filter(|j| movement(*j) > own) {
            return Err(ComplianceError::Recording(format!(
                "{}: joint \"{}\" moves more than joint \"{}\"; give --joint {}, or record a motion of one joint.",
                stretch.label,
                robot.joints[other].name,
                robot.joints[k].name,
                robot.joints[other].name
            )));
        }
        if own == 0.0 {
            return Err(ComplianceError::Recording(format!(
                "{}: joint \"{}\" does not move, so the recording shows nothing of its stiffness; record a motion of this joint (`rig excite --kind chirp`), and check the column q{}.",
                stretch.label,
                robot.joints[k].name,
                k + 1
            )));
        }
        let tau = &stretch.joints[k].tau;
        let most = tau.iter().fold(0.0, |m: f64, t| m.max(t.abs()));
        let at = tau.iter().filter(|t| t.abs() >= 0.999 * most).count();
        if most > 0.0 && at as f64 > SATURATED * tau.len() as f64 {
            let told = format!(
                "{}: {} % of the torques of joint \"{}\" are at the largest one, {}. The drive saturates, and a response under saturation depends on the amplitude: record with a smaller amplitude.",
                stretch.label,
                format_significant(100.0 * at as f64 / tau.len() as f64, 2),
                robot.joints[k].name,
                format_significant(most, 3)
            );
            if at as f64 > UNUSABLE * tau.len() as f64 {
                return Err(ComplianceError::Recording(told));
            }
            warnings.push(told);
        }
    }
    Ok(())
}

/// Says which other joint moves along most. `coupled`: its torque on the links follows from the description.
///
/// # Errors
/// [`ComplianceError::Recording`]: it moves, and the description lacks an inertia.
fn yielding(
    robot: &Robot,
    stretches: &[Signals],
    k: usize,
    coupled: bool,
) -> Result<Option<String>, ComplianceError> {
    let movement = |s: &Signals, j: usize| -> f64 {
        let q = &s.joints[j].q;
        q.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum()
    };
    let share = |s: &Signals, j: usize| (movement(s, j) / movement(s, k)).sqrt();
    let others = (0..robot.joints.len())
        .filter(|j| *j != k && robot.joints[*j].kind == robot.joints[k].kind);
    let all = others.flat_map(|j| stretches.iter().map(move |s| (s, j)));
    let most = all.max_by(|a, b| share(a.0, a.1).total_cmp(&share(b.0, b.1)));
    let Some((stretch, j)) = most.filter(|(s, j)| share(s, *j) > HELD) else {
        return Ok(None);
    };
    let (other, own) = (&robot.joints[j].name, &robot.joints[k].name);
    let moves = format!(
        "{}: joint \"{other}\" moves with {:.1} % of the velocity of joint \"{own}\" (RMS).",
        stretch.label,
        100.0 * share(stretch, j)
    );
    match coupled {
        true => Ok(Some(format!(
            "{moves} The torque that this puts on the links of joint \"{own}\" is computed from the recorded positions and the described inertias, and is taken into account; their error reaches the stiffness. Clamp joint \"{other}\", or raise the gains of its position loop, and the stiffness does not depend on them."
        ))),
        false => Err(ComplianceError::Recording(format!(
            "{moves} Its torque on the links of joint \"{own}\" makes the stiffness wrong by tens of per cent, and the description lacks the inertia of a link ([joint.inertial]) that would tell this torque. Describe it, or clamp joint \"{other}\" (brake, higher gains of its position loop) and record again, or use static loading (--static)."
        ))),
    }
}

/// Returns the range of the bands with significant coherence, Hz.
fn excited(bands: &[BandBins<'_>], name: &str) -> Result<[f64; 2], ComplianceError> {
    let used: Vec<&Band> = bands.iter().map(|b| &b.band).filter(|b| b.used).collect();
    match used.len() >= FEWEST {
        true => Ok(coherent_range(bands)),
        false => {
            let best = bands.iter().map(|b| b.band.coherence).fold(0.0, f64::max);
            Err(ComplianceError::Recording(format!(
                "Torque and velocity of joint \"{name}\" are coherent in {} of {} bands, {FEWEST} are needed (largest coherence {best:.2}): the motion excites too little, or the noise is too large. Record a chirp (`rig excite --kind chirp --joint {name} --band 1,50`), with more amplitude or repeated.",
                used.len(),
                bands.len()
            )))
        }
    }
}

/// Returns the longest range of neighbouring bands with significant coherence, Hz. Single bands far from it are coherent
/// by chance, or at the resonance, where noise alone moves the joint.
fn coherent_range(bands: &[BandBins<'_>]) -> [f64; 2] {
    let runs = bands.chunk_by(|a, b| a.band.used == b.band.used);
    let longest = (runs.filter(|run| run[0].band.used)).max_by_key(|run| run.len());
    longest.map_or([f64::NAN; 2], |run| {
        [run[0].band.frequency, run[run.len() - 1].band.frequency]
    })
}

/// Returns true if the response is coherent on both flanks of a frequency, Hz.
fn is_measured(bands: &[BandBins<'_>], at: f64) -> bool {
    let [low, high] = [at / (1.0 + FLANK), at * (1.0 + FLANK)];
    [[low, at], [at, high]].iter().all(|[from, to]| {
        let flank = (bands.iter().map(|b| &b.band))
            .filter(|band| band.frequency >= *from && band.frequency <= *to);
        let (all, used) = flank.fold((0, 0), |(all, used), band| {
            (all + 1, used + usize::from(band.used))
        });
        used > 0 && used as f64 >= COHERENT * all as f64
    })
}

/// Checks that the response shows the antiresonance and its flanks.
fn within(
    found: &Fitted,
    bands: &[BandBins<'_>],
    name: &str,
    described: &Described,
) -> Result<(), ComplianceError> {
    let at = found.model.antiresonance() / TAU;
    let evident = found.rigid_misfit > EVIDENT * found.misfit.max(1.0);
    if evident && is_measured(bands, at) {
        return Ok(());
    }
    let [low, high] = coherent_range(bands);
    let bound = described.link.map_or(String::new(), |link| {
        format!(
            " With the described inertia of the links and no backlash a stiffness of less than {} would show.",
            format_significant(link * (TAU * high).powi(2), 2)
        )
    });
    Err(ComplianceError::Recording(format!(
        "The response of joint \"{name}\" shows no antiresonance between {} and {} Hz, where torque and velocity are coherent; a chirp over a wider band may show it, or one with more amplitude if friction or backlash hides it.{bound}",
        format_significant(low, 3),
        format_significant(high, 3)
    )))
}

/// Checks that the model explains what the periods of a multisine have in common. Their mean is nearly free of noise, so what is
/// left is distortion. A gap that is large against the twist distorts all frequencies at once, and the response that is left is
/// that of a softer spring; the motion of a link through the gap is not predictable over a period.
fn explained(found: &Fitted, spectra: &Spectra, name: &str) -> Result<(), ComplianceError> {
    let Some(periodic) = spectra.periodic(&found.model) else {
        return Ok(());
    };
    let left = unexplained(&bands(spectra), &found.model);
    if left < DISTORTED || left < CLEAR_OF_NOISE * periodic.noise {
        return Ok(());
    }
    Err(ComplianceError::Recording(format!(
        "Two masses with friction and backlash leave {} % of the velocity of joint \"{name}\" unexplained that repeats in every period of the multisine, so it is not noise ({} %). Backlash that is not small against the twist does this, and the stiffness would come out far too small. Record a chirp, which shows both (`rig excite --kind chirp --joint {name}`), or use static loading (--static).",
        format_significant(100.0 * left, 2),
        format_significant(100.0 * periodic.noise, 2)
    )))
}

/// Evaluates the description at a pose.
fn described(robot: &Robot, pose: &[f64], k: usize) -> Result<Described, ComplianceError> {
    let wrong = |error: &dyn std::fmt::Display| ComplianceError::Model(error.to_string());
    let n = robot.joints.len();
    let chain = robot.chain().map_err(|e| wrong(&e))?;
    let mut rows = loaded(robot)?;
    let motor = rows[k][column::DRIVE_INERTIA];
    for row in &mut rows {
        row[column::DRIVE_INERTIA] = 0.0;
    }
    let mut inertia = vec![0.0; n * n];
    inertia_matrix(&chain, &rows, pose, &mut inertia).map_err(|e| wrong(&e))?;
    let gravity = |step: f64| -> Result<f64, ComplianceError> {
        let (mut q, mut torque) = (pose.to_vec(), vec![0.0; n]);
        q[k] += step;
        gravity_vector(&chain, &rows, &q, &mut torque).map_err(|e| wrong(&e))?;
        Ok(torque[k])
    };
    let complete = are_links_described(robot, k);
    let link = inertia[k * n + k];
    Ok(Described {
        unit: match robot.joints[k].kind {
            JointKind::Revolute => "kg·m²",
            JointKind::Prismatic => "kg",
        },
        link: (complete && link > 0.0).then_some(link),
        motor: (motor > 0.0).then_some(motor),
        gravity: match robot.joints[k].kind {
            JointKind::Revolute => Gravity {
                held: gravity(0.0)?,
                slope: 0.5 * (gravity(FRAC_PI_2)? - gravity(-FRAC_PI_2)?),
                curvature: 0.5 * (gravity(PI)? - gravity(0.0)?),
            },
            JointKind::Prismatic => Gravity {
                held: gravity(0.0)?,
                ..Gravity::default()
            },
        },
    })
}

/// The two masses with their uncertainty.
struct Masses {
    antiresonance: Value,
    resonance: Value,
    link: Value,
    motor: Value,
    /// Stiffness by the antiresonance and the described inertia of the links.
    by_description: Option<Value>,
}

impl Masses {
    fn of(found: &Fitted, described: &Described) -> Self {
        let model = &found.model;
        // ωa² = (c + kg)/Jl; the share of c in it.
        let share = model.stiffness / (model.stiffness + model.gravity);
        let antiresonance = found.scaled(model.antiresonance() / TAU, [0.5 * share, -0.5, 0.0]);
        // ωr² = c/Jm + c/Jl.
        let links = model.link_inertia / (model.link_inertia + model.motor_inertia);
        let by_description = described.link.map(|link| {
            let squared = (TAU * antiresonance.value).powi(2);
            Value::new(
                link * squared - model.gravity,
                2.0 * link * squared * antiresonance.relative(),
            )
        });
        Self {
            antiresonance,
            resonance: found.scaled(
                model.resonance() / TAU,
                [0.5, -0.5 * (1.0 - links), -0.5 * links],
            ),
            link: found.scaled(model.link_inertia, [0.0, 1.0, 0.0]),
            motor: found.scaled(model.motor_inertia, [0.0, 0.0, 1.0]),
            by_description,
        }
    }
}

/// Says what the response shows of a gap.
fn told_gap(name: &str, unit: &str, found: &Fitted, twist: f64, gap: Gap) -> Option<String> {
    match gap {
        Gap::None => None,
        Gap::Found => Some(format!(
            "The response of joint \"{name}\" shows backlash of about {} {unit}, which is taken into account; simulated gaps were found to 25 % by chirps and to 35 % by multisines. A spring that grows stiffer with its twist looks alike, and its stiffness is then not the one given. Both inertias are those of the description; their errors are not in the standard deviations. Static loading (--static) shows stiffness and backlash apart.",
            format_significant(found.model.gap, 2)
        )),
        Gap::Bound => Some(format!(
            "The response of joint \"{name}\" shows backlash that is large against the twist, or a spring that grows stiffer with its twist, which looks alike; the twist is {} {unit} by the RMS torque and the stiffness found. With backlash the stiffness found is only a lower bound, and may be a third of the true one. With a stiffening spring it is a mean over the twist. Measure it by static loading (--static), or with much more torque.",
            format_significant(twist, 2)
        )),
    }
}

/// Says what contradicts the description or the model.
fn doubts(
    name: &str,
    found: &Fitted,
    gap: Gap,
    masses: &Masses,
    described: &Described,
) -> Vec<String> {
    if gap == Gap::None
        && let Some(softer) = softer(name, found, masses, described)
    {
        return vec![softer];
    }
    let mut doubts = Vec::new();
    let motor = "motor (gear_ratio² times rotor_inertia)";
    for (what, own, other) in [
        (motor, masses.motor, described.motor),
        ("links at this pose", masses.link, described.link),
    ] {
        // A gap that is not fitted divides the inertias otherwise.
        let Some(other) = other.filter(|_| gap != Gap::Bound) else {
            continue;
        };
        let off = (own.value - other).abs();
        if off > DIFFERS * other && off > 3.0 * own.std && own.std > 0.0 {
            doubts.push(format!(
                "Joint \"{name}\": the response shows an inertia of the {what} of {} ± {} {unit}, the description has {}. The scale of the torque, the ratio or the description is wrong; the stiffness has the error of the torque's scale.",
                format_significant(own.value, 3),
                format_significant(own.std, 2),
                format_significant(other, 3),
                unit = described.unit
            ));
        }
    }
    if found.model.is_undamped() {
        doubts.push(format!(
            "By the fit joint \"{name}\" has no damping, and no joint is like that: the model does not describe this recording. The stiffness and the inertias may be wrong by several standard deviations (1 to 4 % with friction of motor and link together in simulations). Record with a larger amplitude, or measure the stiffness by static loading (--static)."
        ));
    }
    if found.misfit > MISFIT {
        doubts.push(format!(
            "The response of joint \"{name}\" differs from that of two masses by {} times the noise (RMS). The standard deviations take this for noise and may be too small. Further resonances, backlash, or friction that stops the motor near the antiresonance do this; look at the figure, and try a larger amplitude.",
            format_significant(found.misfit.sqrt(), 2)
        ));
    }
    doubts
}

/// Returns a sentence if the spring looks softer than it is: the response shows the described inertia of motor and links
/// together, but too little of it behind the spring. Backlash does this: where the torque changes its sign the spring gives way
/// without force, the more the smaller the twist (describing function, Gelb & Vander Velde 1968), so that its stiffness falls
/// away from the resonance. A wrong scale of the torque changes both inertias alike.
fn softer(name: &str, found: &Fitted, masses: &Masses, described: &Described) -> Option<String> {
    let (motor, link) = (described.motor?, described.link?);
    let missing = 1.0 - masses.link.value / link;
    let excess = masses.motor.value / motor - 1.0;
    let whole = (masses.motor.value + masses.link.value) / (motor + link) - 1.0;
    let evident = missing > SOFTER && link - masses.link.value > 3.0 * masses.link.std;
    if !(evident && excess > 0.0 && whole.abs() < missing) {
        return None;
    }
    // The stiffness that the gap leaves at the antiresonance, with the described inertia: at most that of the spring.
    let least = masses.by_description?.value;
    let percent = |share: f64| format_significant(100.0 * share, 2);
    Some(format!(
        "The stiffness of joint \"{name}\" is too small by {} % or more: with the described inertia of the links the antiresonance needs {} at least. The response shows the described inertia of motor and links together within {} %, so the scale of the torque is right, but {} % of the links' inertia is missing behind the spring. Backlash does this, or friction that stops the motor: the spring seems softer where the twist is small. So does a description with too much inertia of the links and too little of the motor. Record with a larger amplitude, or load the joint so that its torque keeps one sign; static loading (--static) measures the gap.",
        percent(1.0 - found.model.stiffness / least),
        format_significant(least, 3),
        percent(whole.abs()),
        percent(missing)
    ))
}

/// Composes the result.
fn result(
    robot: &Robot,
    stretches: &[Signals],
    k: usize,
    spectra: Spectra,
    found: &Fitted,
    gap: Gap,
    described: &Described,
    known: Known,
    mut warnings: Vec<String>,
) -> FrequencyResponse {
    let name = robot.joints[k].name.clone();
    let model = &found.model;
    let masses = Masses::of(found, described);
    let unit = robot.joints[k].kind.units().0;
    let twist = spectra.torque() / model.stiffness;
    warnings.extend(told_gap(&name, unit, found, twist, gap));
    warnings.extend(doubts(&name, found, gap, &masses, described));
    let spread = |p: usize| found.covariance[(p, p)].max(0.0).sqrt();
    let bins = bands(&spectra);
    let polar = |response: C| [response.norm(), response.arg()];
    let frictionless = (bins.iter())
        .map(|band| polar(frictionless(band, model)))
        .collect();
    let bands: Vec<Band> = bins.into_iter().map(|b| b.band).collect();
    let mut recordings: Vec<String> = stretches.iter().map(|s| s.label.clone()).collect();
    recordings.dedup();
    let every = spectra.shown[0].len().div_ceil(SHOWN).max(1);
    FrequencyResponse {
        joint: name,
        index: k,
        recordings,
        rows: spectra.rows,
        seconds: spectra.seconds,
        rate: spectra.rate,
        whole: spectra.whole,
        periodic: spectra.periodic(model),
        by_reference: spectra.by_reference,
        model: (bands.iter())
            .map(|band| polar(model.recorded(TAU * band.frequency)))
            .collect(),
        frictionless,
        bands,
        stiffness: found.scaled(model.stiffness, [1.0, 0.0, 0.0]),
        damping: Value::new(model.damping, model.damping * spread(3)),
        antiresonance: masses.antiresonance,
        resonance: masses.resonance,
        link_inertia: masses.link,
        link_inertia_known: known.link_inertia.is_some(),
        motor_inertia: masses.motor,
        coulomb: Value::new(model.coulomb, spread(5)),
        link_coulomb: Value::new(model.link_coulomb, spread(7)),
        delay: Value::new(model.delay, spread(6) / spectra.rate),
        held: model.hold > 0.0,
        backlash: (gap == Gap::Found).then_some(model.gap),
        is_lower_bound: gap == Gap::Bound,
        misfit: found.misfit,
        described_link_inertia: described.link,
        described_motor_inertia: described.motor,
        stiffness_by_description: masses.by_description,
        shown: (spectra.shown).map(|list| list.into_iter().step_by(every).collect()),
        pose: spectra.pose,
        warnings,
    }
}

/// Returns the pose of a response as text.
pub fn response_pose(response: &FrequencyResponse) -> String {
    listed_pose(&response.pose)
}
