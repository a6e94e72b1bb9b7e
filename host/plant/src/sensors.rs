//! Sensors: from the rig's true state to raw codes.
//!
//! Not modelled: converter nonlinearity, drift of offsets, missed counts (see the injected faults), sampling jitter.

use core::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;
use rig_shared::units::{AdcCode, EncoderCount};

use super::config::{Channel, Encoder, LinkEncoder};

/// Returns an independent random stream for one purpose, so that disabling one noise does not change the others. The
/// odd multiplier spreads the streams over the seeds (Steele, Lea & Flood 2014, γ of SplitMix64).
pub fn stream(seed: u64, purpose: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed ^ (purpose + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// State of an analogue channel.
#[derive(Clone, Debug)]
pub(crate) struct Converter {
    channel: Channel,
    zero: f64,
    codes_per_unit: f64,
    follow: f64,
    filtered: Option<f64>,
    rng: Pcg64Mcg,
}

impl Converter {
    /// Creates a channel whose code is nominally `zero` at 0 and grows by one per `per_code`.
    pub(crate) fn new(
        channel: Channel,
        zero: f64,
        per_code: f64,
        tick: f64,
        rng: Pcg64Mcg,
    ) -> Self {
        Self {
            channel,
            zero,
            codes_per_unit: 1.0 / per_code,
            follow: channel.lag.map_or(1.0, |lag| 1.0 - (-tick / lag).exp()),
            filtered: None,
            rng,
        }
    }

    /// Converts the true `quantity` once.
    pub(crate) fn convert(&mut self, quantity: f64) -> AdcCode {
        let last = self.filtered.unwrap_or(quantity);
        let filtered = last + self.follow * (quantity - last);
        self.filtered = Some(filtered);
        let noise = self.channel.noise.map_or(0.0, |std| {
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            std * normal
        });
        let sensed = filtered * (1.0 + self.channel.gain_error) + self.channel.offset + noise;
        // A converter stops at its limits; the cast saturates there too and maps NaN to 0.
        let code = (sensed * self.codes_per_unit + self.zero + 0.5).floor();
        AdcCode(code.clamp(0.0, f64::from(AdcCode::FULL_SCALE)) as u16)
    }
}

impl Encoder {
    /// Returns the counts since the zero at the true motor angle `angle` (0 at joint angle 0), not wrapped.
    pub(crate) fn count(&self, angle: f64, ratio: f64) -> i64 {
        self.reading(angle, ratio).floor() as i64
    }

    /// Returns the reading of an encoder without steps at motor angle `angle` (rad), in fractional counts.
    pub fn reading(&self, angle: f64, ratio: f64) -> f64 {
        let shaft = angle - self.zero * ratio;
        let read = shaft
            + self
                .eccentricity
                .map_or(0.0, |e| e.error(shaft) - e.error(0.0));
        let even = read / TAU * self.counts_per_turn;
        self.unequal_lines.map_or(even, |lines| lines.reading(even))
    }
}

/// State of the link encoder.
#[derive(Clone, Debug)]
pub(crate) struct LinkReader {
    encoder: LinkEncoder,
    rng: Pcg64Mcg,
}

impl LinkReader {
    pub(crate) fn new(encoder: LinkEncoder, rng: Pcg64Mcg) -> Self {
        Self { encoder, rng }
    }

    /// Returns the reading at a true joint angle, rad: the middle of its count, not wrapped.
    pub(crate) fn read(&mut self, angle: f64) -> f64 {
        let own = angle - self.encoder.zero;
        let error = self.encoder.eccentricity.map_or(0.0, |e| e.error(own));
        let noise = self.encoder.noise.map_or(0.0, |std| {
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            std * normal
        });
        let count = TAU / self.encoder.counts_per_turn;
        (((own + error + noise) / count).floor() + 0.5) * count
    }
}

/// Time of the encoder's last edge, as captured by a timer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeClock {
    reading: f64,
    /// Ticks from the last edge to the last sampling instant.
    age: f64,
}

impl EdgeClock {
    /// Starts at a reading.
    pub(crate) fn new(reading: f64) -> Self {
        Self { reading, age: 0.0 }
    }

    /// Advances one tick to this reading and returns the ticks since the last edge. The reading is assumed linear
    /// within a tick; at 60 rad/s² of the template's joint the error is 0.5 % of a count.
    pub(crate) fn tick(&mut self, reading: f64) -> f64 {
        let before = core::mem::replace(&mut self.reading, reading);
        self.age += 1.0;
        if reading.floor() != before.floor() {
            let edge = if reading > before {
                reading.floor()
            } else {
                reading.floor() + 1.0
            };
            self.age = (reading - edge) / (reading - before);
        }
        self.age
    }
}

/// Returns the counter register: the low sixteen bits.
pub(crate) fn register(count: i64) -> EncoderCount {
    EncoderCount(count.rem_euclid(1 << 16) as u16)
}
