//! The telemetry of a running board through its debug probe: RTT channel 0 as a stream of bytes.
//!
//! Built with the cargo feature `probe`; without it [`attach`] says how to get it.
//!
//! Attaching reads the memory of a running core and never halts it: the firmware's watchdog is not frozen by a debugger
//! and would end a halt of 20 ms in the safe state.

use std::fmt;
use std::io::Read;

/// Which board, behind which probe.
#[derive(Clone, Copy, Debug)]
pub struct Choice<'a> {
    /// The chip as probe-rs names it, e.g. `STM32G474RETx`.
    pub chip: &'a str,
    /// `VID:PID` or `VID:PID:SERIAL`; `None`: the only probe there is.
    pub selector: Option<&'a str>,
}

/// Why a probe cannot be used, with the remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProbeError(String);

impl fmt::Display for ProbeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for ProbeError {}

/// Attaches to the board that runs the firmware `elf`. A read returns `WouldBlock` when nothing has come for a few
/// milliseconds; it never returns zero bytes.
///
/// # Errors
/// This program was built without probes, no probe or several, no such chip, no board, or no telemetry in its memory.
#[cfg(not(feature = "probe"))]
pub fn attach(_choice: &Choice<'_>, _elf: &[u8]) -> Result<Box<dyn Read + Send>, ProbeError> {
    Err(ProbeError(
        "--probe: this plant-sim was built without debug probes; build it with \
         `cargo build --release -p plant-sim --features probe`, or pipe the stream in (docs/commissioning.md)"
            .into(),
    ))
}

/// Attaches to the board that runs the firmware `elf`. A read returns `WouldBlock` when nothing has come for a few
/// milliseconds; it never returns zero bytes.
///
/// # Errors
/// This program was built without probes, no probe or several, no such chip, no board, or no telemetry in its memory.
#[cfg(feature = "probe")]
pub fn attach(choice: &Choice<'_>, elf: &[u8]) -> Result<Box<dyn Read + Send>, ProbeError> {
    Ok(Box::new(attached::Stream::attach(choice, elf)?))
}

#[cfg(feature = "probe")]
mod attached {
    use super::{Choice, ProbeError};
    use probe_rs::probe::{DebugProbeSelector, Probe, list::Lister};
    use probe_rs::rtt::{Error as RttError, Rtt, ScanRegion, find_rtt_control_block_in_raw_file};
    use probe_rs::{Permissions, Session};
    use std::io::{self, Read};
    use std::mem::ManuallyDrop;
    use std::time::Duration;

    /// How long to leave the board alone when it had nothing to say. At 1 kHz undecimated its buffer lasts 50 ms.
    const PAUSE: Duration = Duration::from_millis(4);

    pub(super) struct Stream {
        /// Never dropped: on its way out probe-rs halts the core to clear breakpoints, and a running controller would meet
        /// its watchdog.
        session: ManuallyDrop<Session>,
        control_block: ScanRegion,
        /// `None` while the board restarts.
        rtt: Option<Rtt>,
    }

    impl Stream {
        pub(super) fn attach(choice: &Choice<'_>, elf: &[u8]) -> Result<Self, ProbeError> {
            let address = find_rtt_control_block_in_raw_file(elf).ok().flatten().ok_or_else(|| {
                ProbeError("--elf: holds no symbol _SEGGER_RTT; give the firmware that was flashed, unstripped".into())
            })?;
            let session = open(choice)?.attach(choice.chip, Permissions::default()).map_err(|error| {
                ProbeError(format!(
                    "cannot attach to a {}: {}; check --chip, the cable, and that no other program (cargo flash-g4, OpenOCD) \
                     holds the probe",
                    choice.chip,
                    with_causes(&error)
                ))
            })?;
            let control_block = ScanRegion::Exact(address);
            let mut stream = Self { session: ManuallyDrop::new(session), control_block, rtt: None };
            stream.find().map_err(|error| {
                ProbeError(format!(
                    "the board's memory holds no telemetry: {}; check that the firmware runs and that --elf is the very file \
                     that was flashed",
                    with_causes(&error)
                ))
            })?;
            Ok(stream)
        }

        fn find(&mut self) -> Result<(), RttError> {
            let mut core = self.session.core(0)?;
            self.rtt = Some(Rtt::attach_region(&mut core, &self.control_block)?);
            Ok(())
        }

        fn poll(&mut self, bytes: &mut [u8]) -> Result<usize, RttError> {
            let Some(rtt) = &mut self.rtt else {
                self.find()?;
                return Ok(0);
            };
            let mut core = self.session.core(0)?;
            rtt.up_channel(0).ok_or(RttError::MissingChannel(0))?.read(&mut core, bytes)
        }
    }

    impl Read for Stream {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            match self.poll(bytes) {
                Ok(0) => {
                    std::thread::sleep(PAUSE);
                    Err(io::ErrorKind::WouldBlock.into())
                }
                Ok(count) => Ok(count),
                Err(RttError::Probe(error)) => Err(io::Error::other(with_causes(&error))),
                // The board has restarted, or is about to: its buffers begin anew.
                Err(_) => {
                    self.rtt = None;
                    std::thread::sleep(PAUSE);
                    Err(io::ErrorKind::WouldBlock.into())
                }
            }
        }
    }

    fn open(choice: &Choice<'_>) -> Result<Probe, ProbeError> {
        let unusable = |what: String| {
            ProbeError(format!("{what}; plug the board in, and see probe.rs/docs for the access rights of USB probes"))
        };
        let lister = Lister::new();
        if let Some(text) = choice.selector {
            let selector: DebugProbeSelector = text
                .parse()
                .map_err(|error| ProbeError(format!("--probe {text}: {error}; write VID:PID or VID:PID:SERIAL")))?;
            return lister.open(selector).map_err(|error| unusable(format!("--probe {text}: {}", with_causes(&error))));
        }
        match lister.list_all().as_slice() {
            [] => Err(unusable("--probe: no debug probe found".into())),
            [only] => only.open().map_err(|error| unusable(format!("--probe: {}", with_causes(&error)))),
            several => {
                let names: Vec<String> = several.iter().map(ToString::to_string).collect();
                Err(ProbeError(format!("--probe: choose one of {} by --probe VID:PID:SERIAL", names.join(", "))))
            }
        }
    }

    /// An error with everything behind it, in one line.
    fn with_causes(error: &dyn std::error::Error) -> String {
        let mut text = error.to_string();
        let mut cause = error.source();
        while let Some(error) = cause {
            text += &format!(": {error}");
            cause = error.source();
        }
        text
    }
}
