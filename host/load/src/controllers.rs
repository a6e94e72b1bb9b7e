//! The numbers that robot controllers ask for.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::Serialize;

use crate::result::{LoadIdentification, principal};

/// The load as the controllers of three makers take it; the flange frame of the description must be the controller's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ControllerNumbers {
    /// Universal Robots: `set_target_payload(m, cog, inertia)` with the centre of gravity in m in the tool flange and
    /// Ixx Iyy Izz Ixy Ixz Iyz about it in kg·m² (URScript manual).
    pub universal_robots: String,
    /// KUKA: `LOAD_DATA` with M in kg, CM in mm and degrees (axes of the principal moments, ZYX), J in kg·m².
    pub kuka: String,
    /// Franka: mass in kg, centre of mass in m and inertia about it in kg·m², column by column (`setLoad` of libfranka).
    pub franka: String,
}

impl ControllerNumbers {
    /// Returns, by maker, the name, the units and frame of the numbers, and the numbers.
    pub fn labelled(&self) -> [(&'static str, &'static str, &str); 3] {
        [
            (
                "Universal Robots",
                "kg, m, kg·m²; the six inertias are Ixx Iyy Izz Ixy Ixz Iyz about the centre of mass; the flange frame is `tool0` of its URDF",
                &self.universal_robots,
            ),
            (
                "KUKA",
                "kg, mm, degrees; J in kg·m² about the centre of mass, in the axes A B C",
                &self.kuka,
            ),
            (
                "Franka",
                "kg, m; inertia in kg·m² about the centre of mass, column by column",
                &self.franka,
            ),
        ]
    }
}

/// Returns the numbers of the identified body for controllers; `None` if the data do not show the mass or the centre of
/// mass, because a controller would move by a value that nothing supports. An inertia that the data do not show is zero,
/// which these controllers take as "a point": no number is invented.
pub fn controller_numbers(load: &LoadIdentification) -> Option<ControllerNumbers> {
    if !load.mass_shown() || load.centre_shown().contains(&false) {
        return None;
    }
    let list = |values: &[f64]| {
        values
            .iter()
            .map(|v| number(*v))
            .collect::<Vec<_>>()
            .join(", ")
    };
    // Beside an assumed inertia the body has another centre of mass than the data show.
    let body = load.body.about_centre().filter(|_| load.inertia_shown);
    let (mass, centre, inertia) = match body {
        Some((centre, inertia)) => (load.body.mass, centre, inertia),
        None => (
            load.mass.value,
            Vector3::from(load.centre.map(|c| c.value)),
            Matrix3::zeros(),
        ),
    };
    let (moments, turn) = match load.inertia_shown {
        true => {
            let (moments, axes) = principal(&inertia);
            let axes = Matrix3::from_columns(&axes.map(Vector3::from));
            (moments, Rotation3::from_matrix_unchecked(axes))
        }
        false => ([0.0; 3], Rotation3::identity()),
    };
    // A about z, B about y, C about x.
    let (c, b, a) = turn.euler_angles();
    Some(ControllerNumbers {
        universal_robots: format!(
            "set_target_payload({}, [{}], [{}])",
            number(mass),
            list(centre.as_slice()),
            list(&[
                inertia.m11,
                inertia.m22,
                inertia.m33,
                inertia.m12,
                inertia.m13,
                inertia.m23
            ])
        ),
        kuka: format!(
            "{{M {}, CM {{X {}, Y {}, Z {}, A {}, B {}, C {}}}, J {{X {}, Y {}, Z {}}}}}",
            number(mass),
            number(1e3 * centre.x),
            number(1e3 * centre.y),
            number(1e3 * centre.z),
            number(a.to_degrees()),
            number(b.to_degrees()),
            number(c.to_degrees()),
            number(moments[0]),
            number(moments[1]),
            number(moments[2])
        ),
        franka: format!(
            "mass {}, F_x_Cload [{}], load_inertia [{}]",
            number(mass),
            list(centre.as_slice()),
            list(inertia.as_slice())
        ),
    })
}

/// Returns what the data show of the numbers that a controller asks for, marked incomplete; `None` if they show the mass and
/// the centre of mass, or no mass.
pub fn incomplete_numbers(load: &LoadIdentification) -> Option<String> {
    let centre = load.centre_shown();
    if !load.mass_shown() || !centre.contains(&false) {
        return None;
    }
    let of = |wanted: bool| -> Vec<String> {
        let axes = ["x", "y", "z"].iter().zip(&load.centre).zip(centre);
        let own = axes.filter(|(_, shown)| *shown == wanted);
        own.map(|((axis, value), _)| match wanted {
            true => format!(", centre of mass {axis} {} m", number(value.value)),
            false => (*axis).to_owned(),
        })
        .collect()
    };
    Some(format!(
        "incomplete for a controller: mass {} kg{} in the flange frame; the data do not show {} of the centre of mass, so set it by a drawing",
        number(load.mass.value),
        of(true).concat(),
        of(false).join(" and ")
    ))
}

/// Returns six significant digits as a controller reads them: ASCII, without an exponent.
fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let scale = 10f64.powf(5.0 - value.abs().log10().floor());
    format!("{}", (value * scale).round() / scale)
}
