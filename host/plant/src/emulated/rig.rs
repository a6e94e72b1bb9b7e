//! The emulated rig: the control application and the plant.

use rig_firmware::config::Config;
use rig_firmware::sample::Command;
use rig_firmware::session::Session;
use rig_firmware::state::State;
use rig_firmware::step::{Output, step};

use rig_shared::estimation::SettingsFault;

use super::nameplate::Nameplate;
use crate::{Plant, PlantConfig};
use rig_link::Device;

/// The control application, run tick by tick against the plant, with the real wire protocol.
pub struct EmulatedRig {
    config: Config,
    state: State,
    session: Session,
    plant: Plant,
    command: Command,
}

impl EmulatedRig {
    /// Creates a rig at power on. `nameplate` holds the firmware's values, `plant` the true ones.
    ///
    /// # Errors
    /// Invalid estimator settings of the nameplate.
    pub fn new(
        nameplate: &Nameplate,
        plant: PlantConfig,
        seed: u64,
    ) -> Result<Self, SettingsFault> {
        let (config, settings) = (nameplate.config, nameplate.settings);
        Ok(Self {
            config,
            state: State::new(&config, settings)?,
            session: Session::new(),
            plant: Plant::new(plant, seed),
            command: Command::default(),
        })
    }

    /// Returns the plant, for inspection.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Returns the plant, for faults or loads.
    pub fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// Returns the state of the control application.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Runs one control tick, without the wire.
    pub fn tick(&mut self) -> Output {
        let sample = self.plant.advance(self.command);
        let output = step(&self.config, &mut self.state, sample);
        self.command = output.command;
        output
    }

    /// Returns the number of control ticks in the time slice of one [`Device::exchange`].
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
        self.session
            .receive(&self.config, &mut self.state, from_host, &mut transmit);
        for _ in 0..self.ticks_per_slice() {
            let output = self.tick();
            self.session
                .publish(&self.config, &self.state, &output, &mut transmit);
        }
    }

    fn slice(&self) -> std::time::Duration {
        let ticks = f64::from(self.ticks_per_slice());
        std::time::Duration::from_secs_f64(ticks / f64::from(self.config.rates.control_hz))
    }
}
