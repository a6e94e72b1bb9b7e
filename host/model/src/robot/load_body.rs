//! A load as a rigid body: centre of mass, inertia about it, and whether a body can have such values.

use nalgebra::{Matrix3, Vector3};

use super::bodies::{Shown, implausibility};
use super::joint::Inertial;
use super::load::Load;
use super::urdf::SpatialInertia;

/// Largest inertia about the centre of mass of a point mass, as a share of its inertia about the flange: rounding of
/// the difference between both.
const POINT: f64 = 1e-9;

/// A rigid body by its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CentredBody {
    /// kg
    pub mass: f64,
    /// Centre of mass, m.
    pub centre: Vector3<f64>,
    /// Inertia about the centre of mass, kg·m².
    pub inertia: Matrix3<f64>,
}

impl Load {
    fn spatial(&self) -> SpatialInertia {
        SpatialInertia::of(&Inertial {
            mass: self.mass,
            first_moment: self.first_moment,
            inertia: self.inertia,
        })
    }

    /// Returns the load by its centre of mass, in its own frame; `None` for a first moment without a mass.
    pub fn centred(&self) -> Option<CentredBody> {
        let (centre, inertia) = self.spatial().about_centre()?;
        Some(CentredBody {
            mass: self.mass,
            centre,
            inertia,
        })
    }

    /// Returns why no rigid body has these values, as the rest of a sentence about the load; `None` if one can have
    /// them. A point mass and a load of nothing are possible.
    pub fn implausibility(&self) -> Option<String> {
        let nothing = self.parameters().iter().all(|value| *value == 0.0);
        let is_point = self.mass > 0.0
            && self
                .centred()
                .is_some_and(|body| body.inertia.amax() <= POINT * self.spatial().inertia.amax());
        if nothing || is_point {
            return None;
        }
        implausibility(&self.spatial(), &Shown::All)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn only_values_that_no_body_has_are_implausible() {
        let point = Load::of([2.0, 0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.18, 0.0, 0.18]);
        assert_eq!(point.implausibility(), None);
        assert_eq!(Load::of([0.0; 10]).implausibility(), None);
        let disc = Load::of([2.0, 0.0, 0.0, 0.2, 0.03, 0.0, 0.0, 0.03, 0.0, 0.02]);
        assert_eq!(disc.implausibility(), None);
        // Less inertia about the flange than mass and centre demand, 2·0.1².
        let hollow = Load::of([2.0, 0.0, 0.0, 0.2, 0.01, 0.0, 0.0, 0.01, 0.0, 0.02]);
        assert!(hollow.implausibility().unwrap().contains("below zero"));
        let weightless = Load::of([0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(weightless.implausibility().unwrap().contains("mass 0"));
        assert_eq!(weightless.centred(), None);
    }
}
