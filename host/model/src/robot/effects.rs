//! The `[[effect]]` tables of a description, as data and as TOML.

use std::collections::HashSet;

use rig_shared::effects::{Effect, Kind, Parameter};
use serde::{Deserialize, Serialize};

use super::fault::{Fault, Step};
use super::joint::JointKind;
use super::link_size::LARGEST_LINK;

/// Names of effects beyond the standard model.
pub const EFFECT_NAMES: [&str; 22] = [
    "stribeck",
    "asymmetric_coulomb",
    "quadratic_drag",
    "load_friction",
    "position_friction",
    "presliding",
    "viscous_warmup",
    "cogging",
    "torque_ripple",
    "gear_eccentricity",
    "backlash",
    "joint_elasticity",
    "encoder_eccentricity",
    "current_offset",
    "torque_saturation",
    "measurement_delay",
    "gravity_tilt",
    "payload",
    "spring",
    "drive_deadzone",
    "inertia_coupling",
    "torque_offset",
];

/// An effect beyond the standard model, as a description states it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "toml::Table", into = "toml::Table")]
pub struct RobotEffect {
    /// The joint that it acts on; may be absent if the robot has only one.
    pub joint: Option<String>,
    /// The other joint, if the law depends on the motion of a second joint.
    pub other: Option<String>,
    /// Kind and parameters in the units of [`Kind::about`] (m for rad and N for N·m if the joint is prismatic).
    pub effect: Effect<f64>,
}

/// The fault of one table.
pub(super) struct Refusal {
    /// The key at fault; `None` for the whole table.
    pub key: Option<String>,
    pub what: String,
    pub found: String,
    pub advice: String,
}

impl Refusal {
    /// Returns the refusal as the fault of effect `index` of a description.
    pub(super) fn at(self, index: usize) -> Fault {
        let mut key_path = vec![Step::Key("effect"), Step::At(index)];
        key_path.extend(self.key.map(Step::Name));
        Fault {
            key_path,
            what: format!("{} of effect {}", self.what, index + 1),
            found: self.found,
            advice: self.advice,
        }
    }
}

/// Returns the unit of a parameter on a joint of that kind, ASCII.
pub fn unit_of(parameter: &Parameter, kind: JointKind) -> String {
    match kind {
        JointKind::Revolute => parameter.unit.to_owned(),
        JointKind::Prismatic => parameter
            .unit
            .replace("kg*m^2", "kg")
            .replace("(N*m)", "N")
            .replace("N*m", "N")
            .replace("rad", "m"),
    }
}

/// Returns the name of an effect with its law, as `name (law)`.
pub fn title_of(kind: Kind) -> String {
    let about = kind.about();
    match about.law {
        Some(law) => format!("{} ({law})", about.name),
        None => about.name.to_owned(),
    }
}

/// Returns true if the law depends on the motion of a second joint.
pub(super) fn has_other(kind: Kind) -> bool {
    kind == Kind::InertiaCoupling
}

fn parameters(kind: Kind) -> impl Iterator<Item = &'static Parameter> {
    kind.about().gains.iter().chain(kind.about().shapes)
}

/// Returns the laws of a name; empty if it has only one.
fn laws(name: &str) -> Vec<&'static str> {
    Kind::ALL
        .iter()
        .filter(|kind| kind.about().name == name)
        .filter_map(|kind| kind.about().law)
        .collect()
}

/// Returns a value that should have been a name, for a message.
fn name_found(value: Option<&toml::Value>) -> String {
    match value {
        None => "missing".into(),
        Some(toml::Value::String(text)) => format!("`{text}`"),
        Some(other) => other.to_string(),
    }
}

/// Largest magnitude of a parameter by its unit. It exceeds every real machine by orders of magnitude, so a larger
/// value has another unit or is a typing error. By judgement, except for the length of a link.
const LARGEST: [(&str, f64); 12] = [
    ("kg", 1.0e4),
    ("m", LARGEST_LINK),
    ("s", 1.0e6),
    ("V", 1.0e4),
    ("rad", 1.0),
    ("rad/s", 1.0e4),
    ("kg*m^2", 1.0e6),
    ("N*m", 1.0e6),
    ("N*m*s/rad", 1.0e6),
    ("N*m*s/(rad*K)", 1.0e6),
    ("N*m*s^2/rad^2", 1.0e6),
    ("N*m/rad", 1.0e9),
];
/// Largest order, per turn. By judgement.
const LARGEST_ORDER: f64 = 1.0e4;
/// Largest share, 1. By judgement.
const LARGEST_SHARE: f64 = 1.0;

/// Returns the range that a description may state: the physical bounds, narrowed to those of real machines.
pub fn plausible_range(parameter: &Parameter) -> [f64; 2] {
    let of_unit = LARGEST.iter().find(|(unit, _)| *unit == parameter.unit);
    let largest = match (of_unit, parameter.unit, parameter.name) {
        (Some((_, largest)), ..) => *largest,
        (None, "1", "order") => LARGEST_ORDER,
        // A finite physical bound is narrower.
        (None, "1", _) if parameter.bounds[1].is_infinite() => LARGEST_SHARE,
        _ => f64::INFINITY,
    };
    let [low, high] = parameter.bounds;
    [low.max(-largest), high.min(largest)]
}

/// Returns the end of a sentence on the allowed range of a parameter.
fn allowed(parameter: &Parameter) -> String {
    let number = |x: f64| {
        if x == f64::MIN_POSITIVE {
            "above 0".to_owned()
        } else {
            format!("at least {x}")
        }
    };
    let [low, high] = plausible_range(parameter);
    let range = match (low.is_finite(), high.is_finite()) {
        (false, false) => "a finite number".to_owned(),
        (true, false) => number(low),
        (false, true) => format!("at most {high}"),
        (true, true) => format!("{} and at most {high}", number(low)),
    };
    match parameter.unit {
        "1" => format!("it must be {range}"),
        unit => format!("it must be {range}, in {unit}"),
    }
}

fn refuse(key: &str, what: &str, found: String, advice: String) -> Refusal {
    Refusal {
        key: Some(key.to_owned()),
        what: what.to_owned(),
        found,
        advice,
    }
}

/// Returns a text of a table; `None` if the key is missing.
fn text_of(table: &toml::Table, key: &str) -> Result<Option<String>, Refusal> {
    match table.get(key) {
        None => Ok(None),
        Some(toml::Value::String(text)) => Ok(Some(text.clone())),
        Some(other) => Err(refuse(
            key,
            &format!("the {key}"),
            other.to_string(),
            "it must be a name in quotes".into(),
        )),
    }
}

/// Returns the kind that name and law of a table mean.
fn kind_of(table: &toml::Table) -> Result<Kind, Refusal> {
    let name = text_of(table, "kind")?;
    let law = text_of(table, "law")?;
    let Some(name) = name.filter(|name| EFFECT_NAMES.contains(&name.as_str())) else {
        return Err(refuse(
            "kind",
            "the kind",
            name_found(table.get("kind")),
            format!("it must be one of {}", EFFECT_NAMES.join(", ")),
        ));
    };
    let laws = laws(&name);
    let kind = Kind::from_name(&name, law.as_deref());
    kind.filter(|kind| kind.about().law.is_some() == law.is_some())
        .ok_or_else(|| {
            refuse(
                "law",
                "the law",
                law.map_or_else(|| "missing".to_owned(), |law| format!("`{law}`")),
                if laws.is_empty() {
                    format!("{name} has one law only; remove this key")
                } else {
                    let plain =
                        Kind::from_name(&name, None).is_some_and(|k| k.about().law.is_none());
                    let or = if plain {
                        ", or none where this key is missing"
                    } else {
                        ""
                    };
                    format!("{name} has the laws {}{or}", laws.join(", "))
                },
            )
        })
}

/// Refuses a key that effects of this kind do not have.
fn refuse_unknown(table: &toml::Table, kind: Kind) -> Result<(), Refusal> {
    let name = kind.about().name;
    let mut known: HashSet<&str> = HashSet::from(["kind", "joint"]);
    known.extend((!laws(name).is_empty()).then_some("law"));
    known.extend(has_other(kind).then_some("other"));
    known.extend(parameters(kind).map(|p| p.name));
    match table.keys().find(|key| !known.contains(key.as_str())) {
        None => Ok(()),
        Some(key) => {
            let names: Vec<&str> = parameters(kind).map(|p| p.name).collect();
            Err(refuse(
                key,
                "a key",
                format!("`{key}`"),
                format!("{name} has the parameters {}", names.join(", ")),
            ))
        }
    }
}

/// Returns the value of a parameter.
fn value_of(table: &toml::Table, kind: Kind, p: &Parameter) -> Result<f64, Refusal> {
    let number = match table.get(p.name) {
        None if kind.optional().contains(&p.name) => Some(0.0),
        Some(toml::Value::Float(x)) => Some(*x),
        Some(toml::Value::Integer(x)) => Some(*x as f64),
        _ => None,
    };
    let [low, high] = plausible_range(p);
    number.filter(|x| (low..=high).contains(x)).ok_or_else(|| {
        refuse(
            p.name,
            &format!("the {}", p.name),
            (table.get(p.name)).map_or_else(|| "missing".to_owned(), ToString::to_string),
            allowed(p),
        )
    })
}

impl RobotEffect {
    /// Reads a table. Checks its keys and values, but not its joints.
    pub(super) fn from_table(table: &toml::Table) -> Result<Self, Refusal> {
        let kind = kind_of(table)?;
        refuse_unknown(table, kind)?;
        let value = |p| value_of(table, kind, p);
        let gains: Vec<f64> = (kind.about().gains.iter().map(value)).collect::<Result<_, _>>()?;
        let shapes: Vec<f64> = (kind.about().shapes.iter().map(value)).collect::<Result<_, _>>()?;
        Ok(Self {
            joint: text_of(table, "joint")?,
            other: text_of(table, "other")?,
            effect: Effect::new(kind, &gains, &shapes),
        })
    }

    /// Returns the values by name, gains first.
    pub fn values(&self) -> impl Iterator<Item = (&'static Parameter, f64)> {
        let about = self.effect.kind.about();
        let gains = about.gains.iter().zip(self.effect.gains);
        gains.chain(about.shapes.iter().zip(self.effect.shapes))
    }

    /// Returns the title, as `name (law)`.
    pub fn title(&self) -> String {
        title_of(self.effect.kind)
    }
}

impl TryFrom<toml::Table> for RobotEffect {
    type Error = String;

    fn try_from(table: toml::Table) -> Result<Self, String> {
        Self::from_table(&table).map_err(|r| format!("{} is {}, but {}", r.what, r.found, r.advice))
    }
}

impl From<RobotEffect> for toml::Table {
    fn from(effect: RobotEffect) -> Self {
        let about = effect.effect.kind.about();
        let mut table = Self::new();
        let named = [
            ("kind", Some(about.name.to_owned())),
            ("law", about.law.map(str::to_owned)),
            ("joint", effect.joint.clone()),
            ("other", effect.other.clone()),
        ];
        for (key, value) in named {
            if let Some(value) = value {
                table.insert(key.into(), value.into());
            }
        }
        for (p, value) in effect.values() {
            table.insert(p.name.into(), value.into());
        }
        table
    }
}

#[cfg(test)]
#[path = "effects_test.rs"]
mod tests;
