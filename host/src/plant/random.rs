//! Rigs drawn at random around the default one, for studies of coverage.

use rand_distr::{Distribution, Uniform};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;

use super::config::PlantConfig;
use super::friction::Friction;

/// Largest relative departure from the default.
const SPREAD: f64 = 0.3;

struct Draw {
    rng: Pcg64Mcg,
    factor: Uniform<f64>,
}

impl Draw {
    fn vary(&mut self, value: &mut f64) {
        *value *= self.factor.sample(&mut self.rng);
    }

    fn vary_friction(&mut self, friction: &mut Friction) {
        self.vary(&mut friction.coulomb);
        self.vary(&mut friction.viscous);
        if let Some(weakening) = &mut friction.weakening {
            // The excess of breakaway varies, so that it stays one.
            let mut excess = weakening.breakaway_ratio - 1.0;
            self.vary(&mut excess);
            weakening.breakaway_ratio = 1.0 + excess;
            self.vary(&mut weakening.velocity);
        }
        self.vary(&mut friction.presliding.stroke);
    }
}

impl PlantConfig {
    /// The default rig with its motor, masses, friction and current sensor varied uniformly by up to
    /// ±30 %, the centre of mass up to 0.3 rad off the link's axis, and Coulomb friction up to ±10 %
    /// different with direction. Gear ratio, encoder, supply and codes stay.
    pub fn random(seed: u64) -> Self {
        let mut config = Self::default();
        // The bounds are constants in order, so the distribution always exists; the default stands else.
        let (Ok(factor), Ok(signed)) = (
            Uniform::new(1.0 - SPREAD, 1.0 + SPREAD),
            Uniform::new(-1.0, 1.0),
        ) else {
            return config;
        };
        let mut draw = Draw {
            rng: Pcg64Mcg::seed_from_u64(seed),
            factor,
        };
        let motor = &mut config.motor;
        for value in [
            &mut motor.resistance,
            &mut motor.inductance,
            &mut motor.torque_constant,
            &mut motor.rotor_inertia,
        ] {
            draw.vary(value);
        }
        draw.vary_friction(&mut motor.friction);
        motor.friction.asymmetry = 0.1 * signed.sample(&mut draw.rng);
        for body in &mut config.mechanism.bodies {
            for value in [&mut body.mass, &mut body.distance, &mut body.inertia] {
                draw.vary(value);
            }
            body.angle = 0.3 * signed.sample(&mut draw.rng);
        }
        draw.vary_friction(&mut config.mechanism.friction);
        config.mechanism.friction.asymmetry = 0.1 * signed.sample(&mut draw.rng);
        draw.vary(&mut config.sensors.current.offset);
        if let Some(noise) = &mut config.sensors.current.noise {
            draw.vary(noise);
        }
        // Hanging at rest is where the gravity torque vanishes and the potential is least.
        let equivalent = config.equivalent();
        config.initial_position = f64::atan2(-equivalent.gravity_cos, equivalent.gravity_sin);
        config.sensors.encoder.zero = config.initial_position;
        config
    }
}
