//! A base that is not level.

/// Rotation of the base against gravity, about the base frame's x, then y axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    /// About x, rad.
    pub about_x: f64,
    /// About y (the joint axis except for its sign), rad.
    pub about_y: f64,
}

impl Tilt {
    /// Returns the gravity vector in the tilted base.
    pub fn apply(&self, gravity: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = gravity;
        let (s, c) = self.about_x.sin_cos();
        let (y, z) = (c * y + s * z, c * z - s * y);
        let (s, c) = self.about_y.sin_cos();
        [c * x - s * z, y, c * z + s * x]
    }
}
