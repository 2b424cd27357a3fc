//! The board on the table, at a serial port.

use crate::bench::Bench;
use serialport::SerialPort;
use std::time::{Duration, Instant};

/// A board at a port.
pub struct OnTheTable {
    port: Box<dyn SerialPort>,
    begun: Instant,
    looped_back: bool,
}

/// The port to use, `POSITIONER_PORT`.
///
/// # Errors
/// None is named: then the checks are skipped with this sentence.
pub fn port_name() -> Result<String, String> {
    std::env::var("POSITIONER_PORT").map_err(|_| {
        "no board: name its port, e.g. POSITIONER_PORT=/dev/ttyACM0; POSITIONER_LOOP_BACK=1 says that A2 is wired to A0, A1, A4, A5"
            .to_owned()
    })
}

impl OnTheTable {
    /// Opens the port.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(name: &str) -> Result<Self, String> {
        let opened = serialport::new(name, 115_200).timeout(Duration::from_millis(50)).open();
        Ok(Self {
            port: opened.map_err(|error| format!("{name}: {error}"))?,
            begun: Instant::now(),
            looped_back: std::env::var_os("POSITIONER_LOOP_BACK").is_some_and(|value| value == "1"),
        })
    }
}

impl Bench for OnTheTable {
    type Port<'a> = &'a mut dyn SerialPort;

    fn port(&mut self) -> Self::Port<'_> {
        &mut *self.port
    }

    fn seconds(&mut self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    fn pause(&mut self, seconds: f64) {
        std::thread::sleep(Duration::from_secs_f64(seconds));
    }

    #[cfg(feature = "probe")]
    fn halt(&mut self, seconds: f64) -> Option<Result<(), String>> {
        Some(probe::halt(seconds).map_err(|error| error.to_string()))
    }

    #[cfg(not(feature = "probe"))]
    fn halt(&mut self, _: f64) -> Option<Result<(), String>> {
        None
    }

    fn looped_back(&self) -> bool {
        self.looped_back
    }
}

#[cfg(feature = "probe")]
mod probe {
    use probe_rs::{Permissions, probe::list::Lister};
    use std::time::Duration;

    /// Halts the core by the first probe found. The watchdog is not frozen by that: the firmware does not ask for it.
    pub(super) fn halt(seconds: f64) -> Result<(), Box<dyn std::error::Error>> {
        let probes = Lister::new().list_all();
        let first = probes.first().ok_or("no debug probe is plugged in")?;
        let mut session = first.open()?.attach("STM32G474RETx", Permissions::default())?;
        let mut core = session.core(0)?;
        core.halt(Duration::from_millis(100))?;
        std::thread::sleep(Duration::from_secs_f64(seconds));
        core.run()?;
        Ok(())
    }
}
