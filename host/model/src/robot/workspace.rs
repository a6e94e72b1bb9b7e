//! Regions that points of the links must not leave.

use serde::{Deserialize, Serialize};

use super::Robot;
use super::array::{exact, exact_or_none};
use super::check::{Fault, Step};

/// A region in the base frame that a point of a link must not leave: a box, or one side of a plane, or both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name of the joint whose link carries the point.
    pub joint: String,
    /// The point in that joint's frame, m.
    #[serde(default, deserialize_with = "exact")]
    pub point: [f64; 3],
    /// Lowest x, y and z of the box in the base frame, m; −∞ where free.
    #[serde(
        default,
        deserialize_with = "exact_or_none",
        skip_serializing_if = "Option::is_none"
    )]
    pub min: Option<[f64; 3]>,
    /// Highest x, y and z of the box, m; ∞ where free.
    #[serde(
        default,
        deserialize_with = "exact_or_none",
        skip_serializing_if = "Option::is_none"
    )]
    pub max: Option<[f64; 3]>,
    /// Normal of the plane, towards the allowed side; of any length.
    #[serde(
        default,
        deserialize_with = "exact_or_none",
        skip_serializing_if = "Option::is_none"
    )]
    pub normal: Option<[f64; 3]>,
    /// Distance along the normal from the base frame's origin to the allowed side, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beyond: Option<f64>,
}

/// Returns the first fault of the regions of `robot`, if any.
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
            // Also false for NaN.
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use super::*;
    use crate::robot::ONE_LINK_TEMPLATE;

    fn read(region: &str) -> Result<Robot, String> {
        let text = format!("{ONE_LINK_TEMPLATE}\n[[workspace]]\n{region}\n");
        Robot::from_toml(&text, Path::new("r.toml")).map_err(|e| e.to_string())
    }

    #[test]
    fn regions_survive_the_file() {
        for region in [
            "joint = \"link\"\nmin = [-inf, -1.0, 0.0]",
            "joint = \"link\"\npoint = [0.3, 0.0, 0.1]\nmin = [-1.0, -1.0, 0.0]\nmax = [1.0, inf, 2.0]",
            "joint = \"link\"\nnormal = [0.0, 1.0, 1.0]\nbeyond = -0.4",
        ] {
            let robot = read(region).unwrap();
            assert_eq!(robot.workspace.len(), 1);
            let text = robot.to_toml().unwrap();
            assert_eq!(Robot::from_toml(&text, Path::new("r.toml")).unwrap(), robot);
        }
    }

    #[test]
    fn what_cannot_be_a_region_is_named_with_its_place() {
        let line = ONE_LINK_TEMPLATE.lines().count() + 3;
        for (region, said) in [
            ("joint = \"elbow\"\nmin = [0.0, 0.0, 0.0]", "`elbow`"),
            ("joint = \"link\"", "neither a box nor a plane"),
            (
                "joint = \"link\"\nmin = [0.0, 0.0, 1.0]\nmax = [1.0, 1.0, 1.0]",
                "1 to 1",
            ),
            ("joint = \"link\"\nmin = [0.0, nan, 1.0]", "NaN"),
            (
                "joint = \"link\"\nnormal = [0.0, 0.0, 1.0]",
                "also needs `beyond`",
            ),
            ("joint = \"link\"\nbeyond = 1.0", "also needs `normal`"),
            (
                "joint = \"link\"\nnormal = [0.0, 0.0, 0.0]\nbeyond = 1.0",
                "not all 0",
            ),
            (
                "joint = \"link\"\nnormal = [0.0, 0.0, 1.0]\nbeyond = inf",
                "finite",
            ),
            (
                "joint = \"link\"\npoint = [0.0, inf, 0.0]\nmin = [0.0, 0.0, 0.0]",
                "finite",
            ),
            ("joint = \"link\"\nmim = [0.0, 0.0, 0.0]", "mim"),
        ] {
            let message = read(region).unwrap_err();
            assert!(message.contains(said), "{message}");
            let number: usize = message.split(':').nth(1).unwrap().parse().unwrap();
            assert!((line - 1..line + 4).contains(&number), "{message}");
        }
    }
}
