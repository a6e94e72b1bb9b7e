//! Cases of the benchmark: scenarios in groups.

use rig_shared::effects::Kind;
use serde::Serialize;

use super::answer::{exact_class, one_holds_both};
use super::error::BenchError;
use rig_scenario::{Effect, Excitation, Hidden, Intrusion, Made, Noise, Scenario, Size, Truth};

/// Purpose of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// No hidden effect.
    Nothing,
    /// One hidden effect.
    Single,
    /// Two or more hidden effects.
    Combination,
    /// One hidden effect that is not in the library.
    LeftOut,
    /// No hidden effect; all parameters of the description except the torque constant are wrong by a fifth.
    WrongDescription,
    /// Noise with the same spectrum replaces the residual.
    PhaseRandomised,
    /// One hidden effect, scaled to a tenth.
    Faint,
    /// One hidden effect; the motion is one slow sine.
    PoorExcitation,
    /// No hidden effect; a disturbance torque acts in one of two runs.
    OneRunOnly,
    /// No hidden effect; the integration step of the emulated rig is five times finer.
    FineStep,
}

impl Group {
    /// Returns true for groups in which any name is wrong.
    pub fn is_null(self) -> bool {
        matches!(
            self,
            Self::Nothing
                | Self::WrongDescription
                | Self::PhaseRandomised
                | Self::OneRunOnly
                | Self::FineStep
        )
    }
}

/// One case of the benchmark.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Group of the case.
    pub group: Group,
    /// Noise level.
    pub level: &'static str,
    /// Scenario that is recorded.
    pub scenario: Scenario,
    /// Effects removed from the library.
    pub without: Vec<Kind>,
    /// True if the experiment proposed for an open set of names is recorded and the method asked again.
    pub follow: bool,
}

impl Case {
    /// Makes the recordings.
    ///
    /// # Errors
    /// [`BenchError::Scenario`].
    pub fn make(&self) -> Result<(Made, Vec<Size>), BenchError> {
        let made = self.scenario.make()?;
        let sizes = self.scenario.sizes()?;
        let made = if self.group == Group::PhaseRandomised {
            Made {
                truth: Truth {
                    hidden: Vec::new(),
                    ..made.truth.clone()
                },
                ..made.phase_randomised(self.scenario.seed)?
            }
        } else {
            made
        };
        Ok((made, sizes))
    }
}

/// Settings of the benchmark.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Names of the hidden effects.
    pub effects: Vec<String>,
    /// Number of seeds for each effect.
    pub seeds: u64,
    /// First seed.
    pub first_seed: u64,
    /// Cases without hidden effects at each noise level. The false-alarm rate needs more cases than an effect.
    pub nothing: u64,
    /// Noise levels with their names.
    pub levels: Vec<(&'static str, Noise)>,
    /// Numbers of combined effects.
    pub combinations: Vec<usize>,
    /// Combinations for each number.
    pub combined: u64,
    /// True if each effect is also hidden with its name removed from the library.
    pub leave_out: bool,
    /// True if the negative controls are run.
    pub controls: bool,
    /// True if experiments proposed for an open set of names are recorded for a second answer.
    pub follow: bool,
    /// Length of training and hold-out, s.
    pub seconds: [f64; 2],
    /// True if the rig has a second encoder, on the link.
    pub second_encoder: bool,
}

impl Plan {
    /// Returns the cases, in an order that does not depend on the threads.
    ///
    /// # Errors
    /// [`BenchError::Option`] that names an unknown effect.
    pub fn cases(&self) -> Result<Vec<Case>, BenchError> {
        let mut cases = Vec::new();
        let seeds = self.first_seed..self.first_seed + self.seeds;
        for &(level, noise) in &self.levels {
            let case = |group, scenario: Scenario| Case {
                group,
                level,
                scenario: Scenario {
                    noise,
                    seconds: self.seconds,
                    second_encoder: self.second_encoder,
                    ..scenario
                },
                without: Vec::new(),
                follow: self.follow && group == Group::Single,
            };
            for seed in self.first_seed..self.first_seed + self.nothing {
                cases.push(case(Group::Nothing, Scenario::new(Vec::new(), seed)));
            }
            for name in &self.effects {
                for seed in seeds.clone() {
                    let one = Scenario::new(vec![hidden(name, 1.0, seed)?], seed);
                    cases.push(case(Group::Single, one.clone()));
                    if self.leave_out {
                        let class = exact_class(name);
                        let without = Kind::ALL.iter().copied();
                        cases.push(Case {
                            without: without.filter(|k| class.contains(k.about().name)).collect(),
                            ..case(Group::LeftOut, one)
                        });
                    }
                }
            }
            for &count in &self.combinations {
                for seed in self.first_seed..self.first_seed + self.combined {
                    let scenario = self.combination(count, seed)?;
                    cases.extend(scenario.map(|s| case(Group::Combination, s)));
                }
            }
            if self.controls {
                for seed in seeds.clone() {
                    for (group, scenario) in self.controls(seed)? {
                        cases.push(case(group, scenario));
                    }
                }
            }
        }
        Ok(cases)
    }

    /// Chooses different effects by the seed, none of which describes the same function as another or is contained in
    /// it. None if the list is too short.
    fn combination(&self, count: usize, seed: u64) -> Result<Option<Scenario>, BenchError> {
        let n = self.effects.len();
        let mut chosen: Vec<&String> = Vec::new();
        // The stride changes with each pass through the list, so that pairs differ.
        let (start, stride) = (seed as usize % n.max(1), 1 + seed as usize / n.max(1));
        for k in 0..n * 2 {
            let name = &self.effects[(start + k * stride + k / n.max(1)) % n];
            let known = |other: &&String| one_holds_both(name, other);
            if chosen.len() < count && !chosen.iter().any(known) {
                chosen.push(name);
            }
        }
        if chosen.len() < count {
            return Ok(None);
        }
        let hidden = chosen.iter().map(|name| hidden(name, 1.0, seed));
        Ok(Some(Scenario::new(hidden.collect::<Result<_, _>>()?, seed)))
    }

    fn controls(&self, seed: u64) -> Result<Vec<(Group, Scenario)>, BenchError> {
        let bare = || Scenario::new(Vec::new(), seed);
        let mut list = vec![
            (
                Group::WrongDescription,
                Scenario {
                    description_error: 0.2,
                    ..bare()
                },
            ),
            (
                Group::OneRunOnly,
                Scenario {
                    intrusion: Some(Intrusion {
                        torque: 0.5,
                        interval: [0.3, 0.5].map(|x| x * self.seconds[0]),
                    }),
                    ..bare()
                },
            ),
            (
                Group::FineStep,
                Scenario {
                    substeps: Some(10),
                    ..bare()
                },
            ),
        ];
        if self.effects.is_empty() {
            return Ok(list);
        }
        let name = &self.effects[seed as usize % self.effects.len()];
        let one =
            |strength| hidden(name, strength, seed).map(|effect| Scenario::new(vec![effect], seed));
        list.push((Group::PhaseRandomised, one(1.0)?));
        list.push((Group::Faint, one(0.1)?));
        list.push((
            Group::PoorExcitation,
            Scenario {
                excitation: Excitation::Poor,
                ..one(1.0)?
            },
        ));
        Ok(list)
    }
}

fn hidden(name: &str, strength: f64, seed: u64) -> Result<Hidden, BenchError> {
    let effect = Effect::draw(name, strength, seed).ok_or_else(|| {
        let known: Vec<&str> = Effect::names().collect();
        BenchError::Option(format!(
            "no rig hides \"{name}\"; choose from {}",
            known.join(", ")
        ))
    })?;
    Ok(Hidden { joint: 0, effect })
}
