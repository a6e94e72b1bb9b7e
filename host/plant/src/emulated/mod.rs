//! The rig without hardware: the firmware's own control application closed around the emulated rig.

mod demand;
mod nameplate;
pub mod upload;

use rig_firmware::config::Config;
use rig_firmware::sample::Command;
use rig_firmware::speaker::Speaker;
use rig_firmware::state::State;
use rig_firmware::step::{Output, step};

use rig_shared::estimation::SettingsFault;

use crate::{Plant, PlantConfig};
use rig_link::Device;

pub use demand::{other_link, shortfalls};
pub use nameplate::{Nameplate, NameplateError, hardware_of, link_parameters};

/// The control application, run tick by tick against the plant, with the real wire protocol at its end.
pub struct EmulatedRig {
    config: Config,
    state: State,
    speaker: Speaker,
    plant: Plant,
    command: Command,
}

impl EmulatedRig {
    /// A rig at power on. `nameplate` is what the firmware was told, `plant` what is true.
    ///
    /// # Errors
    /// What is wrong with the nameplate's estimator settings.
    pub fn new(
        nameplate: &Nameplate,
        plant: PlantConfig,
        seed: u64,
    ) -> Result<Self, SettingsFault> {
        let (config, settings) = (nameplate.config, nameplate.settings);
        Ok(Self {
            config,
            state: State::new(&config, settings)?,
            speaker: Speaker::new(),
            plant: Plant::new(plant, seed),
            command: Command::default(),
        })
    }

    /// The plant, to look into.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The plant, to injure or to load.
    pub fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// The control application's state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// One control tick, without the wire.
    pub fn tick(&mut self) -> Output {
        let sample = self.plant.advance(self.command);
        let output = step(&self.config, &mut self.state, sample);
        self.command = output.command;
        output
    }

    /// Control ticks in the slice of time that one [`Device::exchange`] takes.
    fn ticks_per_slice(&self) -> u32 {
        (self.config.rates.control_hz / 1000).max(1)
    }
}

impl Device for EmulatedRig {
    fn exchange(&mut self, from_host: &[u8], to_host: &mut Vec<u8>) {
        let mut transmit = |frame: &[u8]| {
            to_host.extend_from_slice(frame);
            true
        };
        self.speaker
            .receive(&self.config, &mut self.state, from_host, &mut transmit);
        for _ in 0..self.ticks_per_slice() {
            let output = self.tick();
            self.speaker
                .publish(&self.config, &self.state, &output, &mut transmit);
        }
    }

    fn slice(&self) -> std::time::Duration {
        let ticks = f64::from(self.ticks_per_slice());
        std::time::Duration::from_secs_f64(ticks / f64::from(self.config.rates.control_hz))
    }
}
