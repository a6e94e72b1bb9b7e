//! What the benchmark asks: scenarios in groups.

use rig_shared::effects::Kind;
use serde::Serialize;

use super::answer::{exact_class, one_holds_both};
use crate::BenchError;
use rig_scenario::{Effect, Excitation, Hidden, Intrusion, Made, Noise, Scenario, Size, Truth};

/// Why a scenario is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// Nothing is hidden.
    Nothing,
    /// One effect.
    Single,
    /// Two effects or more.
    Combination,
    /// One effect that is not in the library.
    LeftOut,
    /// Nothing is hidden, and the description is wrong by a fifth in every parameter but the torque constant.
    WrongDescription,
    /// The residual is noise of the right spectrum.
    PhaseRandomised,
    /// One effect, a tenth of the least that rigs have.
    Faint,
    /// One effect, and a motion of one slow sine.
    PoorExcitation,
    /// Nothing is hidden; a torque from outside comes in one of two runs.
    OneRunOnly,
    /// Nothing is hidden; the emulated rig is integrated five times as finely.
    FineStep,
}

impl Group {
    /// Groups where any name is an invention.
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

/// One question.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Why it is asked.
    pub group: Group,
    /// Of which level of noise.
    pub level: &'static str,
    /// What is recorded.
    pub scenario: Scenario,
    /// What the library lacks.
    pub without: Vec<Kind>,
    /// Whether an experiment that is proposed for an open set of names is recorded and all is asked again.
    pub follow: bool,
}

impl Case {
    /// Records it.
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

/// What to ask.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Effects that are hidden, by name.
    pub effects: Vec<String>,
    /// Seeds of each.
    pub seeds: u64,
    /// The first of them.
    pub first_seed: u64,
    /// Runs with nothing hidden at each level; the false-alarm rate needs more than an effect does.
    pub nothing: u64,
    /// Levels of noise by name.
    pub levels: Vec<(&'static str, Noise)>,
    /// Sizes of the combinations.
    pub combinations: Vec<usize>,
    /// Combinations of each size.
    pub combined: u64,
    /// Whether each effect is also hidden with its name left out of the library.
    pub leave_out: bool,
    /// Whether the negative controls are run.
    pub controls: bool,
    /// Whether experiments that are proposed for an open set of names are recorded, for a second answer.
    pub follow: bool,
    /// Length of training and hold-out, s.
    pub seconds: [f64; 2],
    /// Whether the rig has a second encoder, on the link.
    pub second_encoder: bool,
}

impl Plan {
    /// The questions, in an order that does not depend on how they are worked off.
    ///
    /// # Errors
    /// [`BenchError::Scenario`] naming an effect that does not exist.
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

    /// Different effects that do not describe the same function, nor one that another of them holds already, turning through the list
    /// with the seed; none where the list is too short.
    fn combination(&self, count: usize, seed: u64) -> Result<Option<Scenario>, BenchError> {
        let n = self.effects.len();
        let mut chosen: Vec<&String> = Vec::new();
        // Strides that change with every turn through the list, so that pairs differ.
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
