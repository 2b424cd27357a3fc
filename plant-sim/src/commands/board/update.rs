//! New firmware over the serial line.

use super::{failed, open};
use crate::commands::CliError;
use board_link::{Command, Parameter};
use plant_sim::commission::{observe, transfer};
use plant_sim::update::image::Image;
use plant_sim::update::rom::RomError;
use rig_files::InputError;
use std::path::Path;
use std::time::Duration;

/// How long the board takes from its answer to the bootloader, and from there to the new firmware.
const RESTART: Duration = Duration::from_millis(500);
/// What to do when the board is neither old nor new.
const AGAIN: &str = "the chip starts nothing until the update is complete, the valve stays at mid and the air off; if the board has not \
                     been switched off since, `update FILE --in-bootloader` goes on; else tie BOOT0 (CN7, pin 7) to 3.3 V, reset, and \
                     do the same, or `cargo flash-g4`";

/// New firmware for a board.
pub(super) struct Update {
    image: Image,
    in_bootloader: bool,
    new_parameters: bool,
}

impl Update {
    /// Of a file, checked as far as it can be without a board.
    pub(super) fn read(path: &Path, in_bootloader: bool, new_parameters: bool) -> Result<Self, CliError> {
        let name = path.display().to_string();
        let elf = std::fs::read(path).map_err(|error| InputError::unreadable(&name, &error))?;
        Ok(Self { image: Image::of_elf(&elf, &name)?, in_bootloader, new_parameters })
    }

    /// Writes it to the board at a port, and waits for the new firmware.
    pub(super) fn carry_out(&self, port: &str) -> Result<(), CliError> {
        let image = &self.image;
        let mut before = None;
        if !self.in_bootloader {
            let mut client = open(port)?;
            let version = observe::version(&mut client).map_err(failed)?;
            image.suits(&version, self.new_parameters).map_err(CliError::Usage)?;
            say!("{} with firmware {} gets firmware {}", version.board, version.firmware, image.firmware);
            before = Some(transfer::read(&mut client).map_err(failed)?);
            client.ask(Command::Bootloader).map_err(failed)?;
            std::thread::sleep(RESTART);
        }
        let line = serialport::new(port, 115_200)
            .parity(serialport::Parity::Even)
            .timeout(Duration::from_millis(50))
            .open()
            .map_err(|error| CliError::Failed(format!("{port}: {error}")))?;
        plant_sim::update::write(line, image, &mut |what| say!("{what}")).map_err(|error| {
            let untouched = matches!(error, RomError::Chip(_));
            CliError::Failed(if untouched { error.to_string() } else { format!("{error}; {AGAIN}") })
        })?;
        std::thread::sleep(RESTART);
        let mut client = open(port)?;
        let version = observe::version(&mut client).map_err(failed)?;
        say!("firmware {} runs", version.firmware);
        let Some(before) = before else { return Ok(()) };
        let after = transfer::read(&mut client).map_err(failed)?;
        let differ: Vec<&str> =
            Parameter::ALL.into_iter().filter(|p| before.get(*p) != after.get(*p)).map(Parameter::name).collect();
        if differ.is_empty() {
            say!("all parameters are as before");
        } else {
            say!(
                "note: these parameters are not as before (not saved then, or another default): {}",
                differ.join(", ")
            );
        }
        Ok(())
    }
}
