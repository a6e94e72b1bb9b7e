//! Where points of the links must stay.

use serde::{Deserialize, Serialize};

use super::Robot;
use super::check::{Fault, Step};

/// A region in the base frame that a point of a link must not leave: a box, or one side of a plane, or both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name of the joint whose link carries the point.
    pub joint: String,
    /// The point in that joint's frame, m.
    #[serde(default)]
    pub point: [f64; 3],
    /// Lowest x, y and z of the box in the base frame, m; −∞ where free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<[f64; 3]>,
    /// Highest x, y and z of the box, m; ∞ where free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<[f64; 3]>,
    /// Normal of the plane, towards the allowed side; of any length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// How far along the normal the allowed side begins, from the base frame's origin, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beyond: Option<f64>,
}

/// The first fault of the regions of `robot`, if any.
pub(super) fn check_workspace(robot: &Robot) -> Result<(), Fault> {
    for (i, region) in robot.workspace.iter().enumerate() {
        let refused = |key: Option<&'static str>, what: &str, found: String, right: &str| {
            let mut way = vec![Step::Key("workspace"), Step::At(i)];
            way.extend(key.map(Step::Key));
            Err(Fault {
                way,
                what: format!("{what} of [[workspace]] {}", i + 1),
                found,
                right: right.into(),
            })
        };
        if robot.joint_index(&region.joint).is_none() {
            return refused(
                Some("joint"),
                "the joint",
                format!("`{}`", region.joint),
                "it must be the name of one of the joints",
            );
        }
        let finite = "it must be three finite numbers, in m";
        if region.point.iter().any(|v| !v.is_finite()) {
            return refused(Some("point"), "the point", list(&region.point), finite);
        }
        let lowest = region.min.unwrap_or([f64::NEG_INFINITY; 3]);
        let highest = region.max.unwrap_or([f64::INFINITY; 3]);
        for axis in 0..3 {
            // Also false for numbers that are none.
            if !(lowest[axis] < highest[axis]) {
                let key = if region.max.is_some() { "max" } else { "min" };
                return refused(
                    Some(key),
                    "the box",
                    format!("{} to {}", lowest[axis], highest[axis]),
                    "every `min` must be below its `max`",
                );
            }
        }
        match (region.normal, region.beyond) {
            (None, None) => {
                if region.min.is_none() && region.max.is_none() {
                    return refused(
                        None,
                        "the region",
                        "neither a box nor a plane".into(),
                        "it must have `min` or `max`, or `normal` and `beyond`",
                    );
                }
            }
            (Some(normal), Some(beyond)) => {
                let length = normal.iter().map(|v| v * v).sum::<f64>();
                if !length.is_normal() {
                    return refused(
                        Some("normal"),
                        "the normal",
                        list(&normal),
                        "it must be three finite numbers that are not all 0",
                    );
                }
                if !beyond.is_finite() {
                    return refused(
                        Some("beyond"),
                        "`beyond`",
                        beyond.to_string(),
                        "it must be a finite number, in m",
                    );
                }
            }
            (normal, _) => {
                let (there, missing) = if normal.is_some() {
                    ("normal", "beyond")
                } else {
                    ("beyond", "normal")
                };
                return refused(
                    Some(there),
                    "the plane",
                    format!("given by `{there}` alone"),
                    &format!("it also needs `{missing}`"),
                );
            }
        }
    }
    Ok(())
}

fn list(values: &[f64; 3]) -> String {
    let [x, y, z] = values;
    format!("[{x}, {y}, {z}]")
}
