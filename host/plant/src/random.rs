//! Rigs drawn at random around the default one, for studies of coverage.

use rand_distr::{Distribution, StandardUniform, Uniform};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;

use super::config::{Hardware, PlantConfig};
use super::effect::disturbance::Disturbance;
use super::friction::Friction;

/// Largest relative deviation from the default.
const SPREAD: f64 = 0.3;
/// Torque disturbance of a bench, N·m rms at the joint: a hundredth of the gravity torque of a 1 kg arm. Cables, table
/// and air cause this much on a small geared rig.
const DISTURBANCE: f64 = 0.03;
/// Its correlation time, s: slower than the position loop, within the band of the identification.
const CORRELATION: f64 = 0.05;
/// Noise of one current sample, A rms: six codes of a 12-bit converter that spans ±16.5 A.
const CURRENT_NOISE: f64 = 0.05;

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
            // The excess of the breakaway torque varies, so that it stays positive.
            let mut excess = weakening.breakaway_ratio - 1.0;
            self.vary(&mut excess);
            weakening.breakaway_ratio = 1.0 + excess;
            self.vary(&mut weakening.velocity);
        }
        self.vary(&mut friction.presliding.stroke);
    }
}

impl PlantConfig {
    /// Returns the default rig with its motor, masses, friction and current sensor varied uniformly by up to ±30 %. The
    /// centre of mass is up to 0.3 rad off the link's axis, and Coulomb friction differs by up to ±10 % with direction.
    /// Gear ratio, encoder, supply and codes are unchanged.
    pub fn random(seed: u64) -> Self {
        Self::random_with(&Hardware::default(), seed)
    }

    /// Returns [`PlantConfig::random`] for another drive and encoder; motor values vary about the described ones.
    pub fn random_with(hardware: &Hardware, seed: u64) -> Self {
        let mut config = Self::with_hardware(hardware);
        // The bounds are ordered constants, so the distribution always exists; otherwise the default is returned.
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
        // At hanging rest the gravity torque is zero and the potential energy is minimal.
        let equivalent = config.equivalent();
        config.initial_position = f64::atan2(-equivalent.gravity_cos, equivalent.gravity_sin);
        config.sensors.encoder.zero = config.initial_position;
        config
    }

    /// Returns a rig of [`PlantConfig::random`] on a bench. It has a coloured torque disturbance of 0.03 N·m rms with a
    /// correlation time of 50 ms, and 0.05 A rms of noise in every current sample. Its counter starts anywhere in its
    /// range at power on.
    pub fn laboratory(seed: u64) -> Self {
        Self::laboratory_with(&Hardware::default(), seed)
    }

    /// Returns [`PlantConfig::laboratory`] with another drive and encoder.
    pub fn laboratory_with(hardware: &Hardware, seed: u64) -> Self {
        let mut config = Self::random_with(hardware, seed);
        config.mechanism.disturbance = Some(Disturbance {
            std: DISTURBANCE,
            correlation_time: CORRELATION,
        });
        config.sensors.current.noise = Some(CURRENT_NOISE);
        // A separate stream, so that the rig otherwise equals the one drawn by `random`.
        let mut rng = super::sensors::stream(seed, 4);
        let turns: f64 = StandardUniform.sample(&mut rng);
        let range = 65536.0 / config.sensors.encoder.counts_per_turn / config.mechanism.ratio;
        config.sensors.encoder.zero -= turns * range * core::f64::consts::TAU;
        config
    }
}
