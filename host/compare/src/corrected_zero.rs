//! A second comparison, with the zero of a joint corrected.
//!
//! The model of a set whose zero is 0.3 rad off leaves residuals, and the errors of its parameters are wide. A change of
//! friction beside it is then not seen, or no single cause explains both. So the positions are corrected, the parameters
//! identified again, and the sets compared once more. The zeros stay free there: the parameters of all sets but one may
//! change along the direction in which a zero changes them.
//!
//! Leaves out: zeros of two joints, and three causes.

use nalgebra::DMatrix;
use rig_data::Block;
use rig_data::prepare::Changed;
use rig_identify::{IdentifyError, Options};
use rig_output::format_value;

use crate::basis::Basis;
use crate::causes::{ODDS, causes, changes};
use crate::common::{Common, without_changes};
use crate::error::CompareError;
use crate::grade::written;
use crate::identified_set::IdentifiedSet;
use crate::joint_test::joint_test;
use crate::result::{Causes, Corrected, Hypothesis, JointTest};
use crate::set::RecordingSet;
use crate::zero_shift::{Fitted, Zeros};

/// Most corrections, and the last one over its standard deviation at which they end. A large shift needs several: the
/// errors of a set, which weigh the fit of its shift, become narrow only when it is corrected.
const ROUNDS: (usize, f64) = (4, 0.5);
/// Most steps to the shifts before the first correction.
const STEPS: usize = 6;
/// Shift over its standard deviation from which a zero is corrected. 5: by chance practically never, over all joints.
const SURE: f64 = 5.0;

/// Shifts of a joint's zero, and what may differ beside them.
struct Start {
    joint: usize,
    shifts: Vec<f64>,
    beside: DMatrix<f64>,
}

/// Compares the sets with a corrected zero, if a zero is the cause, or if no single cause explains the difference and a zero
/// with another cause does.
///
/// # Errors
/// Recordings that cannot be read.
pub(crate) fn corrected(
    zeros: &Zeros<'_>,
    found: &Causes,
    names: &[String],
    options: &Options,
) -> Result<Option<Corrected>, CompareError> {
    let reference = zeros.alike();
    let zeros = &Zeros {
        reference: Some(reference),
        ..*zeros
    };
    let Some(start) = start(zeros, found)? else {
        return Ok(None);
    };
    let mut shifts = start.shifts;
    for round in 1..=ROUNDS.0 {
        let to_zero: Vec<_> = shifts.iter().map(|by| back(start.joint, *by)).collect();
        let changed: Vec<Vec<Changed<'_>>> = (zeros.given.iter().zip(&to_zero))
            .map(|(set, change)| changed(set, change))
            .collect();
        let given: Vec<RecordingSet<'_>> = (zeros.given.iter().zip(&changed))
            .map(|(set, own)| RecordingSet {
                name: set.name.clone(),
                recordings: own.iter().map(|r| r as _).collect(),
            })
            .collect();
        // The first comparison stands where the corrected positions cannot be identified.
        let Ok(sets) = identified(zeros, &given, &shifts, options) else {
            return Ok(None);
        };
        let basis = Basis::of(zeros.base, &sets);
        let common = Common::of(&sets, &basis)?;
        // Else the directions of the start are those of other parameters.
        if common.parameters != zeros.common.parameters {
            return Ok(None);
        }
        let again = Zeros {
            given: &given,
            sets: &sets,
            basis: &basis,
            common: &common,
            reference: Some(reference),
            ..*zeros
        };
        let Some(left) = again
            .fitted(start.joint, &again.as_recorded(), 1, &start.beside)
            .map_err(unread)?
        else {
            return Ok(None);
        };
        let far = |s: usize| left.shifts[s].abs() > ROUNDS.1 * left.variances[s].sqrt();
        if round < ROUNDS.0 && (0..sets.len()).any(|s| shifts[s] != 0.0 && far(s)) {
            for (shift, more) in shifts.iter_mut().zip(&left.shifts) {
                if *shift != 0.0 {
                    *shift += more;
                }
            }
            continue;
        }
        let by_errors = |s: usize| shifts[s].abs() > SURE * left.variances[s].sqrt();
        if !(0..sets.len()).any(by_errors) {
            return Ok(None);
        }
        // A zero after which nothing explains what is left is none.
        let found = compared(&again, start.joint, &shifts, &left, names);
        return Ok(found.filter(|own| !own.joint_test.differs || own.named.is_some()));
    }
    Ok(None)
}

/// Returns the sentence of the answer: what the corrected zero is, and what differs beside it.
fn sentence(
    zeros: &Zeros<'_>,
    (joint, shifts): (usize, &[[f64; 2]]),
    (test, names): (&JointTest, &[String]),
    second: Option<&Causes>,
) -> String {
    let described = &zeros.robot.joints[joint];
    let unit = described.kind.units().0;
    let sizes: Vec<String> = (shifts.iter().zip(names))
        .filter(|([shift, _], _)| *shift != 0.0)
        .map(|([shift, std], name)| format!("{name} {} {unit}", format_value(*shift, *std)))
        .collect();
    let which = match names.len() {
        2 => "; two sets do not tell which of them is off",
        _ => "",
    };
    let corrected = format!(
        "With the zero of joint \"{}\" corrected ({}{which}) and the parameters identified again, the sets",
        described.name,
        sizes.join(", ")
    );
    let chi2 = format!(
        "χ² {:.1} with {} degrees of freedom, p {}",
        test.chi2,
        test.degrees_of_freedom,
        written(test.p)
    );
    match second {
        None => format!("{corrected} do not differ: {chi2}."),
        Some(second) => format!("{corrected} still differ: {chi2}. {}", second.sentence),
    }
}

/// Compares the corrected sets. `left`: the rest of the shifts, with the directions of the zero.
fn compared(
    zeros: &Zeros<'_>,
    joint: usize,
    shifts: &[f64],
    left: &Fitted,
    names: &[String],
) -> Option<Corrected> {
    let reference = zeros.reference();
    let own = zeros.common;
    // The first set fixes what is common, so its zero must be known.
    let mut order: Vec<usize> = (0..shifts.len()).collect();
    order.swap(0, reference);
    let free = |s: usize| match s == reference {
        true => own.weights[s].clone(),
        false => {
            let d = DMatrix::from_column_slice(own.parameters.len(), 1, left.along[s].as_slice());
            without_changes(&own.weights[s], &d).0
        }
    };
    let common = Common {
        parameters: own.parameters.clone(),
        values: order.iter().map(|&s| own.values[s].clone()).collect(),
        weights: order.iter().map(|&s| free(s)).collect(),
        spent: shifts.len() - 1,
    };
    let joint_test = joint_test(&common)?;
    let basis = zeros.basis;
    let ordered: Vec<String> = order.iter().map(|&s| names[s].clone()).collect();
    let second = match joint_test.differs {
        false => None,
        true => Some(causes(
            &common,
            &ordered,
            &basis.combination,
            &basis.columns,
            zeros.robot,
            Vec::new(),
        )?),
    };
    let shifts: Vec<[f64; 2]> = (shifts.iter().zip(&left.variances))
        .map(|(shift, variance)| [*shift, if *shift == 0.0 { 0.0 } else { variance.sqrt() }])
        .collect();
    Some(Corrected {
        joint,
        sentence: sentence(
            zeros,
            (joint, &shifts),
            (&joint_test, names),
            second.as_ref(),
        ),
        shifts,
        joint_test,
        named: second.as_ref().and_then(|own| own.named.clone()),
        hypotheses: second.map_or_else(Vec::new, |own| own.hypotheses),
    })
}

/// Identifies the corrected recordings; a set that was not corrected stays as it is.
///
/// # Errors
/// Sets that cannot be identified.
fn identified(
    zeros: &Zeros<'_>,
    given: &[RecordingSet<'_>],
    shifts: &[f64],
    options: &Options,
) -> Result<Vec<IdentifiedSet>, CompareError> {
    (given.iter().zip(zeros.sets).zip(shifts))
        .map(|((set, own), shift)| match *shift == 0.0 {
            true => Ok(own.clone()),
            false => IdentifiedSet::of(zeros.robot, zeros.base, set, options),
        })
        .collect()
}

/// Returns the change of positions of a joint that were `by` too large.
fn back(joint: usize, by: f64) -> impl Fn(&mut Block) {
    move |block: &mut Block| {
        if let Some(joint) = block.joints.get_mut(joint) {
            joint.q.iter_mut().for_each(|q| *q -= by);
        }
    }
}

/// Returns the changed recordings of a set.
fn changed<'a>(set: &RecordingSet<'a>, change: &'a dyn Fn(&mut Block)) -> Vec<Changed<'a>> {
    (set.recordings.iter())
        .map(|inner| Changed {
            inner: *inner,
            change,
        })
        .collect()
}

fn unread(why: IdentifyError) -> CompareError {
    CompareError::Read(why.to_string())
}

/// Returns the shifts that are no chance; the others are zero, and stay free in the second comparison.
fn sure(own: &Fitted) -> Vec<f64> {
    let of = |s: usize| match own.shifts[s].abs() > SURE * own.variances[s].sqrt() {
        true => own.shifts[s],
        false => 0.0,
    };
    (0..own.shifts.len()).map(of).collect()
}

/// Fits the zero of a joint beside what else may differ.
fn begun(
    zeros: &Zeros<'_>,
    joint: usize,
    beside: DMatrix<f64>,
) -> Result<Option<Start>, CompareError> {
    let own = zeros.fitted(joint, &zeros.as_recorded(), STEPS, &beside);
    let shifts = own.map_err(unread)?.map(|own| sure(&own));
    let any = shifts.filter(|own| own.iter().any(|shift| *shift != 0.0));
    Ok(any.map(|shifts| Start {
        joint,
        shifts,
        beside,
    }))
}

/// Returns the joint whose zero to correct, with the first shifts; `None` if there is none.
fn start(zeros: &Zeros<'_>, found: &Causes) -> Result<Option<Start>, CompareError> {
    let likely = |h: &&Hypothesis| h.explains && h.odds_against < ODDS;
    if let Some(joint) = (found.hypotheses.first().filter(likely)).and_then(|best| best.joint) {
        let none = DMatrix::zeros(zeros.common.parameters.len(), 0);
        return begun(zeros, joint, none);
    }
    let single = |h: &Hypothesis| h.explains && h.name != "anything";
    if found.hypotheses.iter().any(single) {
        return Ok(None);
    }
    let (basis, common) = (zeros.basis, zeros.common);
    let recorded = zeros.as_recorded();
    let mut best: Option<(f64, usize, DMatrix<f64>)> = None;
    for (.., beside) in changes(common, &basis.combination, &basis.columns, zeros.robot) {
        for joint in 0..zeros.robot.joints.len() {
            let Some(own) = zeros.fitted(joint, &recorded, 1, &beside).map_err(unread)? else {
                continue;
            };
            let free = beside.ncols().min(common.parameters.len()) * (recorded.len() - 1);
            let score = own.chi2 + 2.0 * free as f64;
            if sure(&own).iter().any(|shift| *shift != 0.0)
                && best.as_ref().is_none_or(|(least, ..)| score < *least)
            {
                best = Some((score, joint, beside.clone()));
            }
        }
    }
    match best {
        Some((_, joint, beside)) => begun(zeros, joint, beside),
        None => Ok(None),
    }
}
