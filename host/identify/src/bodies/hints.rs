//! Estimates from the data for values that the description does not state.

/// Share of the fastest joint's speed below which a joint hardly moves (rad/s and m/s compared directly).
const HARDLY: f64 = 1e-4;

/// Collects hints for the `columns` standard columns: base columns with fitted values, and the joints' motion.
pub(crate) fn hints(columns: usize, (base, full): (&[usize], &[f64]), sizes: Sizes) -> Hints {
    let mut values = vec![f64::NAN; columns];
    for (&c, &value) in base.iter().zip(full) {
        if value != 0.0 {
            values[c] = value;
        }
    }
    // A joint that hardly moves gives no scale; it is assumed to move like the others.
    let like_others = |list: Vec<f64>| -> Vec<f64> {
        let most = list.iter().copied().fold(0.0, f64::max);
        list.into_iter()
            .map(|own| if own < HARDLY * most { most } else { own })
            .collect()
    };
    Hints {
        torque: sizes.torque,
        acceleration: like_others(sizes.acceleration),
        values,
        speed: like_others(sizes.speed),
    }
}

/// Estimates from the data for columns that the description does not state.
pub(crate) struct Hints {
    /// Least-squares value of each standard column that is identified on its own, else NaN.
    pub values: Vec<f64>,
    /// RMS torque of each joint.
    pub torque: Vec<f64>,
    /// RMS speed of each joint.
    pub speed: Vec<f64>,
    /// RMS acceleration of each joint.
    pub acceleration: Vec<f64>,
}

/// RMS values of each joint, SI.
pub struct Sizes {
    /// Of the torque.
    pub torque: Vec<f64>,
    /// Of the speed.
    pub speed: Vec<f64>,
    /// Of the acceleration.
    pub acceleration: Vec<f64>,
}
