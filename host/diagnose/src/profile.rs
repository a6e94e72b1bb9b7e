//! A candidate at the shapes that explain most, and whether that is enough to take it.

mod shapes;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use rig_shared::effects::{Kind, Parameter, SHAPES, Scale};

use self::shapes::{coordinate, is_distance, searched, spacing, value_at, vanished};
pub(super) use self::shapes::{falls_throughout, goes_straight, grid, grid_on, is_straight};
use super::DiagnoseError;
use super::columns::{Candidate, Source};
use super::fit::{Evidence, Fit, dot_self};
use super::lead::slack;
use super::rows::{Column, combined};
use super::search::{Search, is_gear};
use super::simplex::{MOST_ANSWERS, Simplex};
use super::transmission::ABREAST;

/// Share of the torque that a twist changes by mass and load of the link, below which it is no twist: true gears of the emulated rig come
/// out from 0.7 to 1.1, and a wide play of a third stands in for a base that is not level …
const LEAST_OF_A_TWIST: f64 = 0.5;
/// … a soft spring, whose swing the motor's motion alone does not tell for long, has come out at 0.49.
const LEAST_OF_A_SPRINGS_TWIST: f64 = 0.4;
/// Family-wise probability of a name although nothing is there.
pub(super) const SIGNIFICANT: f64 = 0.01;
/// Least share of the RMS that an effect must take away on folds it was not fitted to.
pub(super) const LEAST_GAIN: f64 = 0.02;
/// … and that many standard deviations of it.
const LEAST_SIGMAS: f64 = 2.0;
/// … beside its double, which takes nearly all of it away: what no model without it would leave, for neither has another form …
const LEAST_GAIN_BESIDE_ITS_DOUBLE: f64 = 0.0075;
/// … and in standard deviations of so little.
const LEAST_SIGMAS_BESIDE_ITS_DOUBLE: f64 = 3.0;
/// What takes away this share of the RMS is no chance, whatever it is called: a link that is driven by the noise of a motion with
/// rests took a fifth where nothing was missing.
const MUCH: f64 = 0.3;
/// … of an elastic gear, whose link may ring in a few blocks alone, this. Play bends to a single touch.
const MUCH_OF_A_SPRING: f64 = 0.5;
/// … then it need only be so many standard deviations of its gain: what shows where the torque is highest alone shows in few blocks.
const LEAST_SIGMAS_OF_MUCH: f64 = 1.0;
/// Deviations of a fair coin by which it takes something off more blocks than not, where a few loud blocks hide what it varies by.
const SIGNS: f64 = 3.0;
/// Least gain of a gear's law, whose three or four shapes bend to much that is not a gear.
const LEAST_GAIN_OF_GEARS: f64 = 0.1;
/// … of a play whose link follows the recorded torque by far better, this …
const LEAST_GAIN_OF_HEARD: f64 = 0.05;
/// … which is tried where its gain is so many standard deviations.
const CLEAR_SIGMAS: f64 = 4.0;
/// A candidate that explains less than this share of the squares at every point of its grid cannot reach the least gain.
const HOPELESS: f64 = 0.5 * LEAST_GAIN;
/// … and a gear, from whose starting points the ridge is further away.
const HOPELESS_GEAR: f64 = 0.02;
/// Share of critical damping beyond which a gear is no spring: shafts and gears of steel have some hundredths, and what hardly
/// swings is a lag of friction, with which a spring and all friction on the link are easily confused.
const MOST_DAMPED: f64 = 0.5;
/// Starting points that are followed up, side by side.
const FOLLOWED: usize = ABREAST;
/// First step of a simplex, in a shape's coordinate, and its answers: from a grid …
const FAR: (f64, usize) = (0.4, MOST_ANSWERS);
/// … and from shapes that were the best beside a model that was nearly this one.
const NEAR: (f64, usize) = (0.2, 50);
/// Golden-section steps of the refinement.
const REFINEMENTS: usize = 14;

/// Share explained, shapes, columns.
type Best = (f64, [f64; SHAPES], Arc<Vec<Column>>);

/// A candidate at its best shapes.
#[derive(Clone, Debug)]
pub(super) struct Profile {
    /// Which.
    pub(super) candidate: Candidate,
    /// Its shapes.
    pub(super) shapes: [f64; SHAPES],
    /// Its columns.
    pub(super) columns: Arc<Vec<Column>>,
    /// What they do.
    pub(super) evidence: Evidence,
    /// A shape that has run to the least of what is searched, where a law is its limit of none; the swing of a link on a gear
    /// that hardly lets it; the stiffness of a spring that is a constant; a gain that has left what physics allows.
    pub(super) vanished: Option<&'static str>,
    /// Whether it is a play whose link follows the recorded torque by far better.
    pub(super) heard: bool,
    /// Whether its double is in the model: what is nearly the same function of the motion, and of one form alone.
    pub(super) doubled: bool,
    /// Of a gear whose link is followed from the recorded torque. Its columns are then a known torque, whose gains are 1.
    pub(super) followed: Option<Followed>,
    /// Of a gear, the shapes by the other of two ways, where it was seen both by the motor's motion alone and with its link
    /// followed.
    pub(super) otherwise: Option<[f64; SHAPES]>,
}

/// How a link is followed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Followed {
    /// RMS on the rows of what counts as noise of the torque, N·m.
    pub(super) noise: f64,
}

impl Profile {
    /// Why it is not taken at a p-value corrected for `tried` trials; none where it passes.
    pub(super) fn refused(&self, tried: usize) -> Option<String> {
        let e = &self.evidence;
        let p = self.corrected(tried);
        if let Some(shape) = self.vanished {
            Some(format!(
                "its {shape} goes to the least that can be told from none"
            ))
        } else if p > SIGNIFICANT {
            Some(format!("p = {p:.2}, corrected for {tried} trials"))
        } else if e.joint_gain < self.least_gain() {
            Some(format!(
                "takes away {:.1} % of the residual, less than {:.0} %",
                100.0 * e.joint_gain,
                100.0 * self.least_gain()
            ))
        } else if self.in_too_few_blocks() {
            Some(format!(
                "its gain is only {:.1} of its standard deviations",
                e.gain_sigmas
            ))
        } else {
            None
        }
    }

    /// Whether it takes away so much that something is there, be it this or another.
    pub(super) fn takes_much(&self, tried: usize) -> bool {
        let e = &self.evidence;
        self.corrected(tried) <= SIGNIFICANT
            && e.joint_gain >= MUCH
            && e.gain_sigmas >= LEAST_SIGMAS
    }

    /// Whether its gain is too little beside what it varies by from block to block. A gear's shapes bend to much; what is no gear
    /// may also show by how many blocks it takes something off.
    pub(super) fn in_too_few_blocks(&self) -> bool {
        let e = &self.evidence;
        let gear = is_gear(self.candidate.kind);
        let much = match self.candidate.kind {
            Kind::JointElasticity => e.joint_gain >= MUCH_OF_A_SPRING,
            _ => !gear && e.joint_gain >= MUCH,
        };
        let least = if much {
            LEAST_SIGMAS_OF_MUCH
        } else if self.doubled && e.joint_gain < LEAST_GAIN {
            LEAST_SIGMAS_BESIDE_ITS_DOUBLE
        } else {
            LEAST_SIGMAS
        };
        e.gain_sigmas < least && (gear || e.sign_sigmas() < SIGNS)
    }

    /// Whether it is a play that only takes away too little, as the motor's motion alone drives its link.
    pub(super) fn is_nearly_a_play(&self, tried: usize) -> bool {
        let e = &self.evidence;
        self.candidate.kind == Kind::Backlash
            && self.vanished.is_none()
            && self.corrected(tried) <= SIGNIFICANT
            && (LEAST_GAIN_OF_HEARD..LEAST_GAIN_OF_GEARS).contains(&e.joint_gain)
            && e.gain_sigmas >= CLEAR_SIGMAS
    }

    pub(super) fn least_gain(&self) -> f64 {
        if self.heard {
            LEAST_GAIN_OF_HEARD
        } else if self.doubled {
            LEAST_GAIN_BESIDE_ITS_DOUBLE
        } else if is_gear(self.candidate.kind) {
            LEAST_GAIN_OF_GEARS
        } else {
            LEAST_GAIN
        }
    }

    /// p-value corrected for `tried` trials.
    pub(super) fn corrected(&self, tried: usize) -> f64 {
        self.evidence.corrected(tried)
    }
}

/// Share of critical damping at which a link of that inertia swings on an elastic gear while the motor stands.
fn damping_ratio(shapes: &[f64; SHAPES], mass: f64) -> f64 {
    let [stiffness, damping, ..] = *shapes;
    0.5 * damping / (stiffness * mass).sqrt()
}

/// Whether a spring pulls back, beside what it pulls everywhere alike: preload alone is a constant, which has names of its own.
pub(super) fn stiff(fit: &Fit, columns: &[Column]) -> bool {
    let (Some(stiffness), Some(preload)) = (about_its_middle(fit, columns), columns.get(1..))
    else {
        return false;
    };
    let mut beside = fit.clone();
    for column in preload {
        beside.push(column);
    }
    let evidence = (beside.distinct(std::slice::from_ref(&stiffness)))
        .and_then(|own| beside.evidence(&own, &[[0.0, f64::INFINITY]]));
    evidence.is_some_and(|e| e.corrected(1) < SIGNIFICANT && e.gain_sigmas >= LEAST_SIGMAS)
}

/// What a spring pulls back from the middle of the motion: by that it is told from others, wherever its coordinate is zero.
pub(super) fn about_its_middle(fit: &Fit, columns: &[Column]) -> Option<Column> {
    let (stiffness, preload) = columns.split_first()?;
    let mut rest = stiffness.clone();
    for column in preload {
        let [along, own] = [&rest, column].map(|c| fit.product(c, column));
        let own = own.max(f64::MIN_POSITIVE);
        rest = combined(column.len(), [(&rest, 1.0), (column, -along / own)]);
    }
    Some(rest)
}

impl Search<'_> {
    /// Share of the residual that a candidate's columns explain.
    fn explained(&self, fit: &Fit, c: usize, columns: &[Column]) -> Option<f64> {
        let bounds = self.bounds(&self.library[c]);
        let (share, _) = fit.explained(&fit.beside(columns)?, &bounds)?;
        Some(share)
    }

    /// A candidate at its best shapes; none where it is no column of its own, its signs are impossible, or the motion spans none
    /// of its waves. What it starts from it keeps.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn profile(
        &self,
        fit: &Fit,
        c: usize,
        start: Option<[f64; SHAPES]>,
    ) -> Result<Option<Profile>, DiagnoseError> {
        self.profile_but(fit, c, start, &[])
    }

    /// The same of a wave of none of the orders that are taken `but` for it.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn profile_but(
        &self,
        fit: &Fit,
        c: usize,
        start: Option<[f64; SHAPES]>,
        but: &[Candidate],
    ) -> Result<Option<Profile>, DiagnoseError> {
        let kind = self.library[c].kind;
        let fixed = self.fixed(&self.library[c]);
        let start = fixed.or(start);
        let points = self.grid_within(&self.library[c])?;
        let mut best: Option<Best> = None;
        let gear = is_gear(kind);
        let mut followed: Vec<Best> = Vec::new();
        if let Some(shapes) = start {
            let columns = Arc::new(self.source.columns(&self.library[c], &shapes)?);
            if let Some(share) = self.explained(fit, c, &columns) {
                best = Some((share, shapes, columns));
            }
        } else if points.iter().any(|s| self.shows(&self.library[c], s)) {
            for (shapes, columns) in points.iter().zip(self.cached(c, &points)?) {
                if !self.shows(&self.library[c], shapes)
                    || but.contains(&self.library[c].shaped(shapes))
                {
                    continue;
                }
                let Some(share) = self.explained(fit, c, &columns) else {
                    continue;
                };
                if gear {
                    followed.push((share, *shapes, columns.clone()));
                    followed.sort_by(|a, b| b.0.total_cmp(&a.0));
                    followed.truncate(FOLLOWED);
                }
                if best.as_ref().is_none_or(|b| share > b.0) {
                    best = Some((share, *shapes, columns));
                }
            }
        }
        let Some(mut best) = best else {
            return Ok(None);
        };
        let about = kind.about();
        // One joint's share of the squares of all.
        let hopeless = if gear { HOPELESS_GEAR } else { HOPELESS };
        if best.0 * (self.source.nominal.joints() as f64) < hopeless {
            return Ok(None);
        }
        if gear && fixed.is_none() {
            if followed.is_empty() {
                followed.push(best.clone());
            }
            let far = if start.is_some() { NEAR } else { FAR };
            self.descend(fit, c, &followed, far, &mut best)?;
        }
        if kind == Kind::PreslidingLugre && fixed.is_none() {
            self.without_fall(fit, c, &mut best)?;
        }
        // The simplex has moved all shapes at once; one shape does not wait for another to move.
        let rounds = match about.shapes {
            _ if gear => 0,
            [] | [_] => 1,
            _ => 2,
        };
        for _ in 0..rounds {
            for (place, shape) in about.shapes.iter().enumerate() {
                if shape.scale != Scale::Whole {
                    self.refine(fit, c, place, &mut best)?;
                }
            }
        }
        let Some(projected) = fit.distinct(&best.2) else {
            return Ok(None);
        };
        let Some(evidence) = fit.evidence(&projected, &self.bounds(&self.library[c])) else {
            return Ok(None);
        };
        let joint = self.library[c].joint;
        let mut vanished = vanished(kind, &best.1, self.least_told(kind, joint));
        if kind == Kind::JointElasticity && fixed.is_none() {
            let mass = self.source.mass(joint, 0)?;
            vanished = vanished
                .or_else(|| (damping_ratio(&best.1, mass) > MOST_DAMPED).then_some("swing"));
        }
        let least_share = if kind == Kind::JointElasticity {
            LEAST_OF_A_SPRINGS_TWIST
        } else {
            LEAST_OF_A_TWIST
        };
        let share = evidence.gains.first();
        if gear && share.is_some_and(|share| *share < least_share) {
            vanished = vanished.or(Some("torque"));
        }
        if kind == Kind::Spring && !stiff(fit, &best.2) {
            vanished = Some("stiffness");
        }
        Ok(Some(Profile {
            candidate: self.library[c].shaped(&best.1),
            shapes: best.1,
            columns: best.2,
            evidence,
            vanished,
            heard: self.heard.contains(&self.library[c]),
            doubled: false,
            followed: None,
            otherwise: None,
        }))
    }

    /// Bristles as stiff whose friction does not fall with the speed, where they take more away: from those whose friction does they
    /// are reached by no shape alone.
    fn without_fall(&self, fit: &Fit, c: usize, best: &mut Best) -> Result<(), DiagnoseError> {
        let [stroke, breakaway, velocity, ..] = best.1;
        let mut shapes = best.1;
        shapes[..3].copy_from_slice(&[stroke * (1.0 + breakaway), 0.0, velocity]);
        let columns = Arc::new(self.source.columns(&self.library[c], &shapes)?);
        if let Some(share) = self.explained(fit, c, &columns) {
            let mut plain = (share, shapes, columns);
            self.refine(fit, c, 0, &mut plain)?;
            if plain.0 > best.0 {
                *best = plain;
            }
        }
        Ok(())
    }

    /// Simplices from each of the starts, side by side, over the coordinates of all shapes at once: stiffness, damping and
    /// play pull on each other. They begin so far from it, and end after so many answers.
    fn descend(
        &self,
        fit: &Fit,
        c: usize,
        starts: &[Best],
        (far, answers): (f64, usize),
        best: &mut Best,
    ) -> Result<(), DiagnoseError> {
        let scales = self.library[c].kind.about().shapes;
        let [least, most] = self.ends(&self.library[c])?;
        let mut simplices: Vec<Simplex> = (starts.iter())
            .map(|(_, shapes, _)| {
                // Where a bound lets it move.
                let inside = |place: usize| shapes[place].max(2.0 * least[place]).min(most[place]);
                let at: Vec<f64> = (scales.iter().zip(0..))
                    .map(|(shape, place)| coordinate(shape, inside(place)))
                    .collect();
                // Away from a bound.
                let away = |shape: &Parameter, x: f64| {
                    if shape.scale == Scale::Linear && x > 0.5 {
                        -far
                    } else {
                        far
                    }
                };
                let steps: Vec<f64> = (scales.iter().zip(&at)).map(|(s, x)| away(s, *x)).collect();
                Simplex::new(&at, &steps).of_most(answers)
            })
            .collect();
        loop {
            let asked: Vec<(usize, [f64; SHAPES])> = (simplices.iter().enumerate())
                .filter_map(|(k, simplex)| {
                    let x = simplex.asks()?;
                    let mut shapes = [0.0; SHAPES];
                    for (place, (shape, x)) in scales.iter().zip(x).enumerate() {
                        shapes[place] = value_at(shape, x).max(least[place]).min(most[place]);
                    }
                    Some((k, shapes))
                })
                .collect();
            if asked.is_empty() {
                return Ok(());
            }
            let shapes: Vec<[f64; SHAPES]> = asked.iter().map(|(_, shapes)| *shapes).collect();
            let columns = self
                .source
                .columns_of(self.threads, &self.library[c], &shapes)?;
            for ((k, shapes), columns) in asked.into_iter().zip(columns) {
                let share = self.explained(fit, c, &columns).unwrap_or(0.0);
                simplices[k].told(-share);
                if share > best.0 {
                    *best = (share, shapes, Arc::new(columns));
                }
            }
        }
    }

    /// Shapes from a start on, and their columns, that leave least of the residual where their torque is known: beside the other
    /// columns, without gains.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn fitted_as_known(
        &self,
        source: &Source,
        fit: &Fit,
        candidate: &Candidate,
        start: &[f64; SHAPES],
    ) -> Result<([f64; SHAPES], Vec<Column>), DiagnoseError> {
        let scales = candidate.kind.about().shapes;
        let [least, most] = self.ends(candidate)?;
        let at: Vec<f64> = (scales.iter().zip(start))
            .map(|(shape, value)| coordinate(shape, *value))
            .collect();
        let steps: Vec<f64> = (scales.iter())
            .map(|shape| match shape.scale {
                Scale::Logarithmic if is_distance(shape) => 0.03,
                Scale::Logarithmic => 0.2,
                Scale::Linear | Scale::Whole => 0.05,
            })
            .collect();
        let mut simplex = Simplex::new(&at, &steps);
        let mut best: Option<(f64, [f64; SHAPES], Vec<Column>)> = None;
        while let Some(x) = simplex.asks() {
            let mut shapes = [0.0; SHAPES];
            for (place, (shape, x)) in scales.iter().zip(x).enumerate() {
                shapes[place] = value_at(shape, x).max(least[place]).min(most[place]);
            }
            let columns = source.columns_by(self.threads, candidate, &shapes)?;
            let mut left = fit.clone();
            for column in &columns {
                left.subtract(column);
            }
            let squares = dot_self(left.left());
            simplex.told(squares);
            if best.as_ref().is_none_or(|b| squares < b.0) {
                best = Some((squares, shapes, columns));
            }
        }
        best.map(|(_, shapes, columns)| (shapes, columns))
            .ok_or_else(|| DiagnoseError::Model("its gear has no shape to begin with.".into()))
    }

    /// Golden section over one shape about the best point.
    fn refine(
        &self,
        fit: &Fit,
        c: usize,
        place: usize,
        best: &mut Best,
    ) -> Result<(), DiagnoseError> {
        let scales = self.library[c].kind.about().shapes;
        let shape = &scales[place];
        let [step, fine] = spacing(shape, scales.len());
        let middle = coordinate(shape, best.1[place]);
        let told = self.least_told(self.library[c].kind, self.library[c].joint);
        let reached = [
            self.source.running(),
            self.source.fastest(self.library[c].joint),
        ];
        let [least, most] = searched(shape, told, reached).map(|bound| coordinate(shape, bound));
        // What is stated may lie beyond what these recordings tell.
        let mut high = (middle + step).min(most);
        let mut low = (middle - step).max(least).min(high);
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let at = |x: f64, best: &mut Best| -> Result<f64, DiagnoseError> {
            let mut shapes = best.1;
            shapes[place] = value_at(shape, x);
            let columns = Arc::new(self.source.columns(&self.library[c], &shapes)?);
            let Some(share) = self.explained(fit, c, &columns) else {
                return Ok(f64::NEG_INFINITY);
            };
            if share > best.0 {
                *best = (share, shapes, columns);
            }
            Ok(share)
        };
        let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
        let (mut fa, mut fb) = (at(a, best)?, at(b, best)?);
        for _ in 0..REFINEMENTS {
            if fa > fb {
                (high, b, fb) = (b, a, fa);
                a = high - golden * (high - low);
                fa = at(a, best)?;
            } else {
                (low, a, fa) = (a, b, fb);
                b = low + golden * (high - low);
                fb = at(b, best)?;
            }
            if high - low < fine {
                break;
            }
        }
        Ok(())
    }

    /// What physics allows the gains to be; a delay within the instants of sampling is none.
    fn bounds(&self, candidate: &Candidate) -> Vec<[f64; 2]> {
        if candidate.kind == Kind::MeasurementDelay {
            return vec![[slack(self.source.runs), f64::INFINITY]];
        }
        let gains = self.source.gains(candidate);
        gains.iter().map(|g| g.bounds).collect()
    }
}
