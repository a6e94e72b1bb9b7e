//! From recordings to a comparison.

use std::collections::BTreeSet;

use rig_identify::Base;
use rig_model::robot::{IdentifiedBand, Robot};

use crate::basis::Basis;
use crate::causes::causes;
use crate::common::Common;
use crate::content::refuse_same_rows;
use crate::corrected_zero::corrected;
use crate::error::CompareError;
use crate::grade::{Graded, grade};
use crate::identified_set::IdentifiedSet;
use crate::joint_test::{joint_test, without};
use crate::options::CompareOptions;
use crate::pool::{Pool, pool};
use crate::result::{
    Causes, Comparison, Heterogeneity, JointTest, Pooled, PooledParameter, SetSummary, SetValue,
};
use crate::set::RecordingSet;
use crate::significance::{FAMILY_LEVEL, TEST_LEVEL, holm};
use crate::single::{Single, Spread, spread};
use crate::torque::torque_matrix;
use crate::trades::trades;
use crate::warnings::{brief_warnings, contradicting, drifting, too_short, warnings};
use crate::zero_shift::Zeros;

/// Compares the parameters that several sets of recordings of one robot give. Memory does not grow with the recordings.
///
/// # Errors
/// [`CompareError`]: fewer than two sets, two of a name, recordings that share rows, a set that cannot be identified.
pub fn compare(
    robot: &Robot,
    sets: &[RecordingSet],
    options: &CompareOptions,
) -> Result<Comparison, CompareError> {
    if sets.len() < 2 {
        return Err(CompareError::TooFew(sets.len()));
    }
    if !(options.tolerance > 0.0 && options.tolerance <= 1.0) {
        return Err(CompareError::Tolerance(options.tolerance));
    }
    let mut names = BTreeSet::new();
    if let Some(twice) = sets.iter().find(|s| !names.insert(&s.name)) {
        return Err(CompareError::TwoOfAName(twice.name.clone()));
    }
    refuse_same_rows(sets.iter().flat_map(|s| s.recordings.iter().copied()))?;
    let base = Base::structural(
        robot,
        rig_identify::ModelKind::Differential,
        options.identify.seed,
    )
    .map_err(|e| CompareError::Model(e.to_string()))?;
    let identified = sets
        .iter()
        .map(|set| IdentifiedSet::of(robot, &base, set, &options.identify))
        .collect::<Result<Vec<_>, _>>()?;
    compared(robot, &base, sets, &identified, options)
}

/// Compares identified sets.
fn compared(
    robot: &Robot,
    base: &Base,
    given: &[RecordingSet],
    sets: &[IdentifiedSet],
    options: &CompareOptions,
) -> Result<Comparison, CompareError> {
    let basis = Basis::of(base, sets);
    let singles = singles(sets, &basis);
    let alone: Vec<Vec<Single>> = (singles.iter())
        .map(|list| list.iter().map(|(_, single)| *single).collect())
        .collect();
    let spreads: Vec<Option<Spread>> = (alone.iter())
        .map(|own| (own.len() > 1).then(|| spread(own)))
        .collect();
    let between: Vec<f64> = (spreads.iter())
        .map(|s| s.map_or(0.0, |s| s.between))
        .collect();
    let pooled = pool(sets, &basis, &alone, &between)?;
    let parameters = parameters(&basis, &singles, &spreads, &pooled);
    let common = Common::of(sets, &basis)?;
    let joint_test = joint_test(&common);
    let names: Vec<String> = sets.iter().map(|s| s.name.clone()).collect();
    let zeros = Zeros {
        robot,
        base,
        given,
        sets,
        basis: &basis,
        common: &common,
        reference: None,
    };
    let causes = match differing(joint_test.as_ref(), &parameters) {
        true => tested_causes(&zeros, &names, options)?,
        false => None,
    };
    let joints = robot.joints.iter().map(|j| j.name.clone());
    let torque = torque_matrix(sets, &basis, &pooled.values, joints.collect());
    let without = without(&common);
    let (grade, reasons) = grade(&Graded {
        names: &names,
        parameters: &parameters,
        joint: joint_test.as_ref(),
        without: &without,
        drifting: &drifting(sets, robot, options.tolerance),
        contradicting: &contradicting(sets),
        short: &too_short(sets),
        torque: &torque,
        causes: causes.as_ref(),
        tolerance: options.tolerance,
    });
    Ok(Comparison {
        schema: "rig-compare/1",
        robot: robot.name.clone(),
        model: options.identify.model,
        estimator: options.identify.estimator,
        tolerance: options.tolerance,
        family_level: FAMILY_LEVEL,
        test_level: TEST_LEVEL,
        grade,
        reasons,
        sets: summaries(given, sets, &basis),
        parameters,
        joint_test,
        without,
        trades: joint_test.map_or_else(Vec::new, |_| trades(sets, &basis, &common)),
        causes,
        torque,
        warnings: warnings(sets),
        brief_warnings: brief_warnings(sets),
        pooled: Pooled {
            combination: basis.combination,
            columns: basis.columns,
            values: pooled.values.as_slice().to_vec(),
            covariance: pooled.covariance,
            sizes: sizes(sets),
            bands: bands(sets),
        },
    })
}

/// Tests the causes of a difference.
///
/// # Errors
/// Recordings that cannot be read.
fn tested_causes(
    zeros: &Zeros<'_>,
    names: &[String],
    options: &CompareOptions,
) -> Result<Option<Causes>, CompareError> {
    let shifts = zeros
        .hypotheses()
        .map_err(|why| CompareError::Read(why.to_string()))?;
    let (combination, columns) = (&zeros.basis.combination, &zeros.basis.columns);
    let found = causes(
        zeros.common,
        names,
        combination,
        columns,
        zeros.robot,
        shifts,
    );
    let Some(mut found) = found else {
        return Ok(None);
    };
    let torques = contradicting(zeros.sets);
    if !torques.is_empty() && torques.len() < zeros.sets.len() {
        found.named = None;
        found.sentence = format!(
            "The torques of the joints of {} contradict each other (see the warnings): first correct them, or leave out the set; no other cause can be told beside it.",
            torques.join(" and of ")
        );
        return Ok(Some(found));
    }
    found.corrected = corrected(zeros, &found, names, &options.identify)?;
    let second = (found.corrected.as_ref()).and_then(|own| own.named.as_ref());
    if found.named.is_none() && second.is_some() {
        found.sentence = "No single one of the tested causes explains the difference; the zero of a joint and another cause do together.".into();
    }
    Ok(Some(found))
}

/// Returns true if the sets differ by any test: what agrees needs no cause.
fn differing(joint: Option<&JointTest>, parameters: &[PooledParameter]) -> bool {
    let differs = |p: &PooledParameter| p.test.is_some_and(|test| test.differs);
    joint.is_some_and(|test| test.differs || parameters.iter().any(differs))
}

/// Returns, by parameter, the sets that show it with their values.
fn singles(sets: &[IdentifiedSet], basis: &Basis) -> Vec<Vec<(usize, Single)>> {
    let own: Vec<_> = (sets.iter().zip(&basis.from_set))
        .map(|(set, from)| {
            (
                from * &set.values,
                from * &set.covariance * from.transpose(),
            )
        })
        .collect();
    (0..basis.len())
        .map(|k| {
            (0..sets.len())
                .filter(|&s| basis.shown[s][k])
                .map(|s| {
                    let (values, covariance) = &own[s];
                    let single = Single {
                        value: values[k],
                        variance: covariance[(k, k)].max(f64::MIN_POSITIVE),
                        freedom: sets[s].freedom(),
                    };
                    (s, single)
                })
                .collect()
        })
        .collect()
}

/// Puts the results of each parameter together.
fn parameters(
    basis: &Basis,
    singles: &[Vec<(usize, Single)>],
    spreads: &[Option<Spread>],
    pooled: &Pool,
) -> Vec<PooledParameter> {
    let tested: Vec<f64> = spreads.iter().flatten().map(|s| s.p).collect();
    let mut corrected = holm(&tested).into_iter();
    (0..basis.len())
        .map(|k| PooledParameter {
            expression: basis.names[k].clone(),
            unit: basis.units[k].clone(),
            value: pooled.values[k],
            std: pooled.std[k],
            half_interval: pooled.half[k],
            degrees_of_freedom: pooled.freedom[k],
            within: match (spreads[k], singles[k].first()) {
                (Some(spread), _) => spread.within.sqrt(),
                (None, Some((_, only))) => only.variance.sqrt(),
                (None, None) => f64::NAN,
            },
            between: spreads[k].map_or(0.0, |s| s.between.sqrt()),
            sets: (singles[k].iter())
                .map(|(set, single)| SetValue {
                    set: *set,
                    value: single.value,
                    std: single.variance.sqrt(),
                })
                .collect(),
            test: spreads[k].map(|s| {
                let p_holm = corrected.next().unwrap_or(1.0);
                Heterogeneity {
                    q: s.q,
                    degrees_of_freedom: singles[k].len() - 1,
                    p: s.p,
                    p_holm,
                    differs: p_holm < TEST_LEVEL,
                }
            }),
        })
        .collect()
}

fn summaries(given: &[RecordingSet], sets: &[IdentifiedSet], basis: &Basis) -> Vec<SetSummary> {
    (sets.iter().zip(given).zip(&basis.shown))
        .map(|((set, given), shown)| SetSummary {
            name: set.name.clone(),
            recordings: given.recordings.iter().map(|r| r.label()).collect(),
            rank: set.found.rank,
            degrees_of_freedom: set.freedom,
            shrinkage: set.shrinkage,
            repeats_after: set.repeating.as_ref().map(|own| own.period),
            rows: set.found.details.estimate.rows,
            relative_error: (set.found.joints.iter())
                .map(|j| j.train_relative_error)
                .collect(),
            not_shown: (0..basis.len())
                .filter(|&k| !shown[k])
                .map(|k| basis.names[k].clone())
                .collect(),
        })
        .collect()
}

/// Returns the band of each set.
fn bands(sets: &[IdentifiedSet]) -> Vec<IdentifiedBand> {
    let bands = sets.iter().map(|s| s.found.details.treatment.band());
    bands.collect()
}

/// Returns the largest RMS torque, speed and acceleration of each joint in a set.
fn sizes(sets: &[IdentifiedSet]) -> [Vec<f64>; 3] {
    let most = |of: fn(&IdentifiedSet) -> &Vec<f64>| {
        let joints = sets.first().map_or(0, |s| of(s).len());
        (0..joints)
            .map(|j| sets.iter().map(|s| of(s)[j]).fold(0.0, f64::max))
            .collect()
    };
    [
        most(|s| &s.rows.sizes.torque),
        most(|s| &s.rows.sizes.speed),
        most(|s| &s.rows.sizes.acceleration),
    ]
}
