//! Dependence of the residual on each coordinate of the motion: the tests.
//!
//! Per coordinate, the cumulated residual (a marked empirical process: Stute 1997, Ann. Statist. 25) is compared with
//! its wild block bootstrap (random signs per block: Cameron, Gelbach & Miller 2008). The p-values are corrected for
//! the number of coordinates under any dependence (Benjamini & Yekutieli 2001).

pub(crate) mod dependence;
mod frequency;
pub(crate) mod process;
pub(crate) mod refitted;

use rand::{RngExt, SeedableRng};

use crate::acceptance::coordinates::Coordinate;
use crate::acceptance::residual_dependence::dependence::{Dependence, Form, Parity};
use crate::acceptance::residual_dependence::frequency::frequency;
use crate::acceptance::residual_dependence::process::{BINS, Process, narrowest};
use crate::acceptance::residual_dependence::refitted::Refitted;
use crate::levels::SIGNIFICANT;
use crate::rows::regression::Rows;
use rig_numerics::statistics::{bins, sum_of_squares};

/// Bootstrap draws …
const DRAWS: usize = 999;
/// … and those of a coordinate that no draw reaches, if the correction for the number of coordinates needs more. One
/// alone among fifteen must reach 0.0002.
const MOST_DRAWS: usize = 19_999;
/// p-value from which on a dependence counts as chance.
const BY_CHANCE: f64 = 0.05;

/// Additional knowledge about a residual.
pub(crate) struct Known<'a> {
    /// Components that a previous refit removed.
    pub(crate) refitted: Refitted,
    /// Runs that repeat each other.
    pub(crate) pairs: &'a [(usize, usize)],
}

/// Returns the coordinates on which a joint's residual depends, the largest share of the excess over `floor` first.
/// Empty if no dependence is beyond chance. `block` is the block of each row. With `known`, each draw of the bootstrap
/// is refitted like the residual.
pub(crate) fn locate(
    rows: &Rows,
    coordinates: &[Coordinate],
    residual: &[f64],
    known: Option<&Known>,
    block: &[usize],
    joint: usize,
    joint_name: &str,
    floor: f64,
    seed: u64,
) -> Vec<Dependence> {
    let none = Refitted::none();
    let refitted = known.map_or(&none, |known| &known.refitted);
    let residual = &refitted.rest(residual);
    let blocks = block.iter().max().map_or(0, |b| b + 1);
    let of = Residual {
        values: residual,
        keep: &rows.keep[joint],
        block,
        blocks,
        excess: excess(residual, rows.used(joint), floor),
        joint_name,
    };
    let (mut places, mut processes): (Vec<Dependence>, Vec<Process>) = (coordinates.iter())
        .map(|coordinate| of.along(coordinate, refitted))
        .unzip();
    let pairs = known.map_or(&[][..], |known| known.pairs);
    let repeated = frequency(rows, residual, pairs, joint_name);
    let by_frequency = repeated.is_some();
    if let Some((place, process)) = repeated {
        places.push(place);
        processes.push(process);
    }
    let along = refitted.along(residual, block, blocks);
    for (place, p) in places
        .iter_mut()
        .zip(probabilities(&processes, &along, seed))
    {
        place.p_value = p;
    }
    // A frequency describes the whole repeated residual, so it comes last.
    let last = by_frequency.then(|| places.pop()).flatten();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places.extend(last);
    places.retain(|place| place.p_value < BY_CHANCE);
    places
}

/// Returns the squares of a residual beyond the noise floor, over the `used` rows.
fn excess(residual: &[f64], used: usize, floor: f64) -> f64 {
    let squares = sum_of_squares(residual);
    (squares - used.max(1) as f64 * floor * floor).max(0.0)
}

/// The residual of a joint.
struct Residual<'r> {
    /// One value per row.
    values: &'r [f64],
    /// True for used rows.
    keep: &'r [bool],
    /// Block of each row.
    block: &'r [usize],
    /// Number of blocks.
    blocks: usize,
    /// Squares beyond the noise floor.
    excess: f64,
    joint_name: &'r str,
}

impl Residual<'_> {
    /// Returns where along a coordinate the residual lies, without a p-value, and its sums.
    fn along(&self, coordinate: &Coordinate, refitted: &Refitted) -> (Dependence, Process) {
        let (place, edges) = bins(&coordinate.values, self.keep, BINS);
        let mut count = [0.0; BINS];
        let mut sums = vec![[0.0; BINS]; self.blocks];
        for ((b, r), blk) in place.iter().zip(self.values).zip(self.block) {
            if let Some(b) = b {
                count[*b] += 1.0;
                sums[*blk][*b] += r;
            }
        }
        let total: [f64; BINS] = std::array::from_fn(|b| sums.iter().map(|s| s[b]).sum());
        // Squares explained by the bin means, minus the noise part from the spread of the blocks.
        let explained: [f64; BINS] = std::array::from_fn(|b| {
            let noise: f64 = sums.iter().map(|s| s[b] * s[b]).sum();
            if count[b] > 0.0 {
                ((total[b] * total[b] - noise) / count[b]).max(0.0)
            } else {
                0.0
            }
        });
        let all: f64 = explained.iter().sum();
        let share = if self.excess > 0.0 {
            (all / self.excess).min(1.0)
        } else {
            0.0
        };
        let (low, high) = narrowest(&explained, all);
        let mean: [f64; BINS] = std::array::from_fn(|b| {
            if count[b] > 0.0 {
                total[b] / count[b]
            } else {
                0.0
            }
        });
        let found = Dependence {
            joint: self.joint_name.to_owned(),
            coordinate: coordinate.name.clone(),
            interval: [edges[low], edges[high + 1]],
            unit: coordinate.unit.to_owned(),
            share,
            p_value: 1.0,
            form: Form::Along {
                whole_range: low == 0 && high == BINS - 1,
                parity: parity(coordinate, &mean, &count),
            },
        };
        let taken = refitted.in_bins(&place);
        (found, Process { sums, taken })
    }
}

/// Returns the p-value of each process, corrected for their number. If the correction makes significance impossible
/// with `DRAWS`, processes that no draw reaches get more draws.
fn probabilities(processes: &[Process], along: &[Vec<f64>], seed: u64) -> Vec<f64> {
    let mut list: Vec<f64> = (processes.iter())
        .map(|process| process_p(process, along, DRAWS, seed))
        .collect();
    if corrected(&list).iter().all(|p| *p >= SIGNIFICANT) {
        for (p, process) in list.iter_mut().zip(processes) {
            if *p <= 1.0 / (DRAWS + 1) as f64 {
                *p = process_p(process, along, MOST_DRAWS, seed);
            }
        }
    }
    corrected(&list)
}

/// Corrects p-values for their number under any dependence (Benjamini & Yekutieli 2001).
fn corrected(list: &[f64]) -> Vec<f64> {
    let m = list.len();
    let harmonic: f64 = (1..=m).map(|k| 1.0 / k as f64).sum();
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|a, b| list[*a].total_cmp(&list[*b]));
    let mut result = vec![1.0; m];
    let mut least = 1.0_f64;
    for (rank, &k) in order.iter().enumerate().rev() {
        least = least.min(list[k] * harmonic * m as f64 / (rank + 1) as f64);
        result[k] = least;
    }
    result
}

/// Returns the p-value of the largest excursion of the cumulated residual, by the wild block bootstrap. `along` is the
/// residual along each direction of the refit, block by block.
fn process_p(process: &Process, along: &[Vec<f64>], draws: usize, seed: u64) -> f64 {
    let excursion = |sign: &mut dyn FnMut() -> f64| {
        let mut total = [0.0; BINS];
        let mut fitted = vec![0.0; process.taken.len()];
        for (k, s) in process.sums.iter().enumerate() {
            let w = sign();
            for (t, x) in total.iter_mut().zip(s) {
                *t += w * x;
            }
            // Without a refit, nothing is removed.
            let own = along.get(k).map_or(&[][..], Vec::as_slice);
            for (f, x) in fitted.iter_mut().zip(own) {
                *f += w * x;
            }
        }
        for (f, taken) in fitted.iter().zip(&process.taken) {
            for (t, x) in total.iter_mut().zip(taken) {
                *t -= f * x;
            }
        }
        let (mut sum, mut most) = (0.0, 0.0_f64);
        for t in total {
            sum += t;
            most = most.max(f64::abs(sum));
        }
        most
    };
    let found = excursion(&mut || 1.0);
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let beyond = (0..draws)
        .filter(|_| excursion(&mut || if rng.random::<bool>() { 1.0 } else { -1.0 }) >= found)
        .count();
    (beyond + 1) as f64 / (draws + 1) as f64
}

/// Returns the symmetry of bin means about zero, if the coordinate has both signs.
fn parity(coordinate: &Coordinate, mean: &[f64; BINS], count: &[f64; BINS]) -> Option<Parity> {
    let signed =
        coordinate.values.iter().any(|v| *v < 0.0) && coordinate.values.iter().any(|v| *v > 0.0);
    if !signed {
        return None;
    }
    // Bins of equal count are symmetric if the motion is.
    let (mut odd, mut even) = (0.0, 0.0);
    for b in 0..BINS / 2 {
        let (x, y) = (mean[b], mean[BINS - 1 - b]);
        let weight = count[b].min(count[BINS - 1 - b]);
        odd += weight * (y - x) * (y - x);
        even += weight * (y + x) * (y + x);
    }
    if odd > 4.0 * even {
        Some(Parity::Odd)
    } else if even > 4.0 * odd {
        Some(Parity::Even)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fourteen coordinates without dependence, and one with a dependence in every block.
    fn processes(found: f64) -> Vec<Process> {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        let mut noise = || rng.random::<f64>() - 0.5;
        (0..15)
            .map(|c| {
                let one = |_| -> [f64; BINS] {
                    let place = |b: usize| if b < BINS / 2 { found } else { -found };
                    std::array::from_fn(|b| noise() + if c == 3 { place(b) } else { 0.0 })
                };
                Process {
                    sums: (0..60).map(one).collect(),
                    taken: Vec::new(),
                }
            })
            .collect()
    }

    fn no_refit() -> Vec<Vec<f64>> {
        vec![Vec::new(); 60]
    }

    /// A residual refitted with x and a constant contains a cubic in x of a tenth of its noise. A refitted bootstrap
    /// detects it, and has no more false alarms than its level without it.
    #[test]
    fn chance_is_refitted_where_the_residual_was() {
        const ROWS: usize = 4000;
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(11);
        let x: Vec<f64> = (0..ROWS).map(|k| (0.013 * k as f64).sin()).collect();
        let columns = [x.clone(), vec![1.0; ROWS]];
        let rows = Rows::of_columns(columns.map(|c| vec![Some(c)]).to_vec(), ROWS);
        let known = Known {
            refitted: Refitted::of(&rows, None, 0),
            pairs: &[],
        };
        let block: Vec<usize> = (0..ROWS).map(|k| k / 40).collect();
        let coordinate = Coordinate {
            name: "x".into(),
            unit: "",
            values: x.clone(),
        };
        let mut found = |size: f64, seed: u64, as_it_was: bool| {
            let residual: Vec<f64> = (x.iter())
                .map(|x| size * x.powi(3) + 2.0 * (rng.random::<f64>() - 0.5))
                .collect();
            let residual = known.refitted.rest(&residual);
            let chance = as_it_was.then_some(&known);
            let coordinates = std::slice::from_ref(&coordinate);
            let list = locate(
                &rows,
                coordinates,
                &residual,
                chance,
                &block,
                0,
                "",
                0.0,
                seed,
            );
            usize::from(!list.is_empty())
        };
        let mut of = |size, as_it_was| (0..40).map(|k| found(size, k, as_it_was)).sum::<usize>();
        let counts = [of(0.5, true), of(0.5, false), of(0.0, true)];
        println!("{counts:?} of 40");
        assert!(
            counts[0] > 30 && counts[1] < 10 && counts[2] < 7,
            "{counts:?}"
        );
    }

    #[test]
    fn a_gap_along_one_coordinate_alone_reaches_the_level() {
        let list = probabilities(&processes(0.2), &no_refit(), 1);
        assert!(list[3] < SIGNIFICANT, "{list:?}");
        assert!(
            list.iter().enumerate().all(|(c, p)| c == 3 || *p > 0.05),
            "{list:?}"
        );
        let none = probabilities(&processes(0.0), &no_refit(), 1);
        assert!(none.iter().all(|p| *p > SIGNIFICANT), "{none:?}");
    }

    #[test]
    fn the_correction_is_that_of_benjamini_and_yekutieli() {
        // 1 + 1/2 + 1/3 + 1/4 = 25/12; each times 4 over its rank, at most the next one.
        let got = corrected(&[0.04, 0.001, 0.03, 0.5]);
        let wanted = [1.0 / 9.0, 1.0 / 120.0, 1.0 / 9.0, 1.0];
        assert!(
            got.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12),
            "{got:?}"
        );
    }
}
