//! Friction and effects of a description as a C header: for controllers that are not written in Rust.
//!
//! The header is C99 without other files than `math.h`. It holds torques alone: no dynamics of the links, and no effects
//! on readings, voltages, or between motor and link.

mod laws;
#[cfg(test)]
mod tests;

use std::fmt::Write as _;

use rig_model::robot::{Placed, Robot, title_of, unit_of};
use rig_shared::effects::Kind;

/// A header and what it leaves out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CHeader {
    /// The file.
    pub text: String,
    /// The joints with the effects that are in it, one entry a joint: `link with stribeck`.
    pub holds: Vec<String>,
    /// Effects that are not in it, one sentence each.
    pub left_out: Vec<String>,
}

/// What stands before the laws.
const HEAD: &str = include_str!("head.h");

/// Returns the friction and the effects of a robot as C. `from`: where the values come from, for the first line.
pub fn c_header(robot: &Robot, from: &str) -> CHeader {
    let placed = robot.placed_effects();
    let mut kinds: Vec<Kind> = placed.iter().map(|own| own.effect.kind).collect();
    kinds.sort();
    kinds.dedup();
    let mut text = format!(
        "/* Friction and effects of {}, from {}. Written by rig {}. */\n{HEAD}",
        comment(&robot.name),
        comment(from),
        env!("CARGO_PKG_VERSION")
    );
    for kind in &kinds {
        if let Some(law) = laws::law(*kind) {
            text.push_str(&function(*kind, law));
        }
    }
    for k in 0..robot.joints.len() {
        text.push_str(&joint(robot, k, &placed));
    }
    text.push_str("#endif\n");
    let out = |own: &Placed| {
        let name = &robot.joints[own.joint].name;
        let kind = own.effect.kind;
        let why = match kind {
            Kind::GravityTilt | Kind::Payload => "belongs to the dynamics of the links",
            _ => "is no torque of the joint",
        };
        format!(
            "{} at joint {name} is not in the header: it {why}.",
            title_of(kind)
        )
    };
    let others = placed
        .iter()
        .filter(|own| laws::law(own.effect.kind).is_none());
    let holds = robot.joints.iter().enumerate().map(|(k, joint)| {
        let own = placed.iter().filter(|p| p.joint == k);
        let own = own.filter(|p| laws::law(p.effect.kind).is_some());
        let names: Vec<String> = own.map(|p| title_of(p.effect.kind)).collect();
        match names.is_empty() {
            true => joint.name.clone(),
            false => format!("{} with {}", joint.name, names.join(", ")),
        }
    });
    CHeader {
        text,
        holds: holds.collect(),
        left_out: others.map(out).collect(),
    }
}

/// Returns a law as a function.
fn function(kind: Kind, law: &str) -> String {
    let about = kind.about();
    let law = law.replace('\n', "\n    ");
    format!(
        "
/* {}: {} */
static inline rig_real rig_{}(const rig_real g[4], const rig_real s[4], rig_real m[4], const rig_instant *at)
{{
    rig_real h[4] = {{0, 0, 0, 0}};
    (void)s;
    (void)m;
    (void)at;
    {law}
    return g[0] * h[0] + g[1] * h[1] + g[2] * h[2] + g[3] * h[3];
}}
",
        title_of(kind),
        comment(about.equation),
        identifier(kind),
    )
}

/// Returns type and functions of joint `k`.
fn joint(robot: &Robot, k: usize, placed: &[Placed]) -> String {
    let own = &robot.joints[k];
    let friction = own.friction.clone().unwrap_or_default();
    let has_law = |p: &&Placed| p.joint == k && laws::law(p.effect.kind).is_some();
    let effects: Vec<&Placed> = placed.iter().filter(has_law).collect();
    let (_, effort) = own.kind.units();
    let number = k + 1;
    let count = effects.len().max(1);
    let mut text = format!(
        "
/* Joint {number}, {}. Torques in {effort}. */
typedef struct {{
    rig_real memory[{count}][4]; /* hidden states of the effects; zero at first */
}} rig_joint{number}_state;

/* Coulomb and viscous friction of the joint, against positive motion. */
static inline rig_real rig_joint{number}_friction(rig_real velocity, rig_real direction)
{{
    return (rig_real){:?} * direction + (rig_real){:?} * velocity;
}}

/* Friction, constant torque and effects: what the drive has to give beside the dynamics of the links. Sets at->friction. Call it
   once a period, because it advances the hidden states. */
static inline rig_real rig_joint{number}_torque(rig_joint{number}_state *state, rig_instant *at)
{{
    (void)state;
    at->friction = rig_joint{number}_friction(at->velocity, at->direction);
    rig_real sum = at->friction + (rig_real){:?};
",
        comment(&own.name),
        friction.coulomb,
        friction.viscous,
        friction.offset,
    );
    for (n, p) in effects.iter().enumerate() {
        let about = p.effect.kind.about();
        let list = |values: &[f64]| {
            let values: Vec<String> = values.iter().map(|v| format!("(rig_real){v:?}")).collect();
            values.join(", ")
        };
        let names = about.gains.iter().chain(about.shapes);
        let names: Vec<String> = names
            .map(|own| format!("{} in {}", own.name, unit_of(own, robot.joints[k].kind)))
            .collect();
        let _ = write!(
            text,
            "    {{
        /* {} */
        const rig_real g[4] = {{{}}};
        const rig_real s[4] = {{{}}};
        sum += rig_{}(g, s, state->memory[{n}], at);
    }}
",
            names.join(", "),
            list(&p.effect.gains),
            list(&p.effect.shapes),
            identifier(p.effect.kind),
        );
    }
    text.push_str("    return sum;\n}\n");
    text
}

/// Returns the name of a law in C: `presliding_maxwell`.
fn identifier(kind: Kind) -> String {
    let mut name = String::new();
    for c in title_of(kind).chars() {
        match c {
            c if c.is_ascii_alphanumeric() => name.push(c.to_ascii_lowercase()),
            _ if name.ends_with('_') => {}
            _ => name.push('_'),
        }
    }
    name.trim_end_matches('_').to_owned()
}

/// Returns a text that does not end the comment that it stands in.
fn comment(text: &str) -> String {
    text.replace("*/", "* /").replace(['\n', '\r', '\\'], " ")
}
