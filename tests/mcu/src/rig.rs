//! The emulated board for a test or a host.

use std::time::Duration;

use rig_link::Device;
use rig_plant::PlantConfig;

use crate::board::Board;
use crate::chip::Chip;
use crate::emulation::Emulation;
use crate::image::Image;
use crate::line_noise::LineNoise;
use crate::unicorn::{EngineError, UnicornCpu};

/// A board run by unicorn.
pub type EmulatedBoard = Emulation<UnicornCpu<Chip>>;

/// Returns an image on a board with this rig, at power on. `seed` is for the rig's noise.
///
/// # Errors
/// The error of the engine.
pub fn power_on(image: Image, plant: PlantConfig, seed: u64) -> Result<EmulatedBoard, EngineError> {
    let cpu = UnicornCpu::new(Chip::new(Board::new(plant, seed)))?;
    Ok(Emulation::new(cpu, image))
}

/// The far end of a line with the board's time. A failed board sends nothing more. Its error is printed once on the
/// standard error stream, and kept in [`Emulation::failure`].
pub struct Line {
    /// The board.
    pub board: EmulatedBoard,
    /// Everything that the board sent, if kept.
    pub heard: Option<Vec<u8>>,
    /// Faults of the line to the board.
    pub noise: Option<LineNoise>,
}

impl Device for Line {
    fn exchange(&mut self, from_host: &[u8], to_host: &mut Vec<u8>) {
        let silent = self.board.failure().is_some();
        let noise = &mut self.noise;
        self.board.with_chip(|chip| match noise {
            Some(noise) => noise.send(chip, from_host),
            None => chip.send(from_host),
        });
        if let Err(failure) = self.board.run_for(self.slice().as_secs_f64())
            && !silent
        {
            eprintln!("The emulated board stopped: {failure}.");
        }
        let sent = self.board.with_chip(Chip::take_sent);
        if let Some(heard) = &mut self.heard {
            heard.extend(&sent);
        }
        to_host.extend(sent);
    }

    fn slice(&self) -> Duration {
        Duration::from_millis(1)
    }
}
