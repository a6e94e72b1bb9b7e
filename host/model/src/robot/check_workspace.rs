//! Checks of the regions that points of the links must not leave.

use super::fault::{Fault, Step};
use super::serial_robot::Robot;
use super::workspace::Region;

/// Returns the first fault of the regions of `robot`, if any.
pub(super) fn check_workspace(robot: &Robot) -> Result<(), Fault> {
    for (i, region) in robot.workspace.iter().enumerate() {
        if robot.joint_index(&region.joint).is_none() {
            return Err(refused(
                i,
                Some("joint"),
                "the joint",
                format!("`{}`", region.joint),
                "it must be the name of one of the joints",
            ));
        }
        check_box(i, region)?;
        check_plane(i, region)?;
    }
    Ok(())
}

/// Returns the fault of region `i` (from 0) at one of its keys, or of the region itself.
fn refused(i: usize, key: Option<&'static str>, what: &str, found: String, advice: &str) -> Fault {
    let mut key_path = vec![Step::Key("workspace"), Step::At(i)];
    key_path.extend(key.map(Step::Key));
    Fault {
        key_path,
        what: format!("{what} of [[workspace]] {}", i + 1),
        found,
        advice: advice.into(),
    }
}

/// Checks the point and the box of region `i`.
fn check_box(i: usize, region: &Region) -> Result<(), Fault> {
    if region.point.iter().any(|v| !v.is_finite()) {
        return Err(refused(
            i,
            Some("point"),
            "the point",
            list(&region.point),
            "it must be three finite numbers, in m",
        ));
    }
    let lowest = region.min.unwrap_or([f64::NEG_INFINITY; 3]);
    let highest = region.max.unwrap_or([f64::INFINITY; 3]);
    for axis in 0..3 {
        // Also false for NaN.
        if !(lowest[axis] < highest[axis]) {
            let key = if region.max.is_some() { "max" } else { "min" };
            return Err(refused(
                i,
                Some(key),
                "the box",
                format!("{} to {}", lowest[axis], highest[axis]),
                "every `min` must be below its `max`",
            ));
        }
    }
    Ok(())
}

/// Checks the plane of region `i`, or that it has a box instead.
fn check_plane(i: usize, region: &Region) -> Result<(), Fault> {
    match (region.normal, region.beyond) {
        (None, None) if region.min.is_none() && region.max.is_none() => Err(refused(
            i,
            None,
            "the region",
            "neither a box nor a plane".into(),
            "it must have `min` or `max`, or `normal` and `beyond`",
        )),
        (None, None) => Ok(()),
        (Some(normal), Some(beyond)) => {
            let length = normal.iter().map(|v| v * v).sum::<f64>();
            if !length.is_normal() {
                return Err(refused(
                    i,
                    Some("normal"),
                    "the normal",
                    list(&normal),
                    "it must be three finite numbers that are not all 0",
                ));
            }
            if !beyond.is_finite() {
                return Err(refused(
                    i,
                    Some("beyond"),
                    "`beyond`",
                    beyond.to_string(),
                    "it must be a finite number, in m",
                ));
            }
            Ok(())
        }
        (normal, _) => {
            let (there, missing) = if normal.is_some() {
                ("normal", "beyond")
            } else {
                ("beyond", "normal")
            };
            Err(refused(
                i,
                Some(there),
                "the plane",
                format!("given by `{there}` alone"),
                &format!("it also needs `{missing}`"),
            ))
        }
    }
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
