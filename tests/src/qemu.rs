//! The control loop on a Cortex-M4F under QEMU, as a [`Target`].
//!
//! The guest is `firmware-qemu`. Codes travel through two named pipes by semihosting, telemetry comes out of QEMU's standard
//! output as a raw defmt stream.

use crate::scenario::{Scenario, Start};
use crate::target::{Target, TargetError, TickOutput};
use control::{DacCode, Inputs};
use firmware_core::lockstep::{
    ACCEPTED, ANSWER_BYTES, COUNTS_BYTES, Counts, END, READY, SetupMessage, TICK_BYTES, WATCHDOG_RESET, decode_answer,
    effect_numbers, encode_setup, encode_tick,
};
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;

/// Builds the guest and returns its ELF file.
///
/// # Errors
/// What is missing on this computer: then tests are skipped with this sentence.
pub fn guest() -> Result<&'static Path, &'static str> {
    static GUEST: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    GUEST.get_or_init(build).as_deref().map_err(String::as_str)
}

fn build() -> Result<PathBuf, String> {
    let runs =
        |program: &str| Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    if !runs("qemu-system-arm") {
        return Err("qemu-system-arm is not installed (Debian: apt install qemu-system-arm)".into());
    }
    if !runs("mkfifo") {
        return Err("mkfifo is not installed".into());
    }
    test_stages::firmware::build_for_target("firmware-qemu")
}

/// A running guest.
pub struct QemuTarget {
    qemu: Child,
    to_guest: File,
    from_guest: Option<File>,
    folder: PathBuf,
    /// Instructions per tick, once [`QemuTarget::finish`] has been called.
    counts: Option<Counts>,
}

impl QemuTarget {
    /// Starts a guest for a scenario. `folder` must not exist; it is removed again. Telemetry, one record every `every` ticks,
    /// goes to the file `telemetry`, if given; it says when a code reaches the valve, which is a tick later, as on the board.
    /// With `bench` the guest simulates the rig itself, and ignores the ticks' codes; the scenario must boot, as a loop that runs refuses it.
    ///
    /// # Errors
    /// QEMU does not start, or the guest refuses the scenario's numbers.
    pub fn start(
        elf: &Path,
        scenario: &Scenario,
        folder: &Path,
        telemetry: Option<(&Path, u32)>,
        bench: bool,
    ) -> Result<Self, TargetError> {
        let fail = |what: &str, error: &dyn std::fmt::Display| TargetError(format!("{what}: {error}"));
        std::fs::create_dir_all(folder).map_err(|error| fail("cannot create the pipes' folder", &error))?;
        for name in ["ticks.in", "ticks.out"] {
            let made = Command::new("mkfifo").arg(folder.join(name)).status();
            if !made.is_ok_and(|status| status.success()) {
                return Err(TargetError(format!("mkfifo {name} failed")));
            }
        }
        let output = match telemetry {
            Some((path, _)) => {
                File::create(path).map_err(|error| fail("cannot create the telemetry file", &error))?.into()
            }
            None => Stdio::null(),
        };
        let qemu = Command::new("qemu-system-arm")
            .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "none"])
            .args(["-icount", "shift=6", "-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(elf.canonicalize().map_err(|error| fail("no guest", &error))?)
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(output)
            .spawn()
            .map_err(|error| fail("qemu-system-arm", &error))?;
        let mut target = Self {
            qemu,
            // Held open for reading, too: opening does not wait then, and writing to a dead guest is no signal.
            to_guest: OpenOptions::new()
                .read(true)
                .write(true)
                .open(folder.join("ticks.in"))
                .map_err(|error| fail("ticks.in", &error))?,
            from_guest: None,
            folder: folder.to_owned(),
            counts: None,
        };
        target.connect()?;
        let [ready] = target.receive()?;
        if ready != READY {
            return Err(TargetError(format!("the guest began with {ready:#04x}")));
        }
        let file = scenario.rig_file().map_err(|error| fail("rig", &error))?;
        let parameters = scenario.parameters(&scenario.name).map_err(|error| fail("parameters", &error))?;
        let setup = SetupMessage {
            parameters,
            monitor: scenario.monitor.enabled.then_some(scenario.monitor.parameters),
            rig: file.rig.convert().numbers().into_iter().collect(),
            effects: effect_numbers(&file.effects.convert()),
            output_delay_ticks: scenario.output_delay_ticks,
            armed: scenario.start == Start::Armed,
            every: telemetry.map_or(0, |(_, every)| every),
            bench,
        };
        let setup = encode_setup(&setup).ok_or_else(|| TargetError("the setup is too long".into()))?;
        target.send(&setup)?;
        let [verdict] = target.receive()?;
        if verdict != ACCEPTED {
            return Err(TargetError("the guest refuses the scenario's numbers".into()));
        }
        Ok(target)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), TargetError> {
        self.to_guest.write_all(bytes).map_err(|error| TargetError(format!("to the guest: {error}")))
    }

    /// Opens the pipe from the guest. Opening waits for the other side, which may die before it gets there: so it is done
    /// by another thread, while this one watches the guest.
    fn connect(&mut self) -> Result<(), TargetError> {
        let path = self.folder.join("ticks.out");
        let (sender, receiver) = std::sync::mpsc::channel();
        let opener = path.clone();
        std::thread::spawn(move || sender.send(File::open(opener)));
        loop {
            match receiver.recv_timeout(std::time::Duration::from_millis(50)) {
                Ok(file) => {
                    self.from_guest = Some(file.map_err(|error| TargetError(format!("ticks.out: {error}")))?);
                    return Ok(());
                }
                Err(_) => {
                    if let Ok(Some(status)) = self.qemu.try_wait() {
                        // Releases the opener.
                        let _ = OpenOptions::new().read(true).write(true).open(&path);
                        return Err(TargetError(format!("QEMU ended before the first exchange: {status}")));
                    }
                }
            }
        }
    }

    fn receive<const N: usize>(&mut self) -> Result<[u8; N], TargetError> {
        let mut bytes = [0; N];
        let pipe = self.from_guest.as_mut().ok_or_else(|| TargetError("the guest is not connected".into()))?;
        pipe.read_exact(&mut bytes).map_err(|error| TargetError(format!("from the guest: {error}")))?;
        Ok(bytes)
    }

    /// Ends the guest and returns its instruction counts.
    ///
    /// # Errors
    /// The guest did not end well.
    pub fn finish(mut self) -> Result<Counts, TargetError> {
        let mut end = [0; TICK_BYTES];
        end[0] = END;
        self.send(&end)?;
        let bytes: [u8; COUNTS_BYTES] = self.receive()?;
        let status = self.qemu.wait().map_err(|error| TargetError(format!("qemu: {error}")))?;
        if !status.success() {
            return Err(TargetError(format!("the guest ended with {status}")));
        }
        let counts = Counts::from_bytes(&bytes);
        self.counts = Some(counts);
        Ok(counts)
    }
}

impl Drop for QemuTarget {
    fn drop(&mut self) {
        if self.counts.is_none() {
            // Its own child, by its handle; it may have ended already.
            let _ = self.qemu.kill();
            let _ = self.qemu.wait();
        }
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

impl Target for QemuTarget {
    fn tick(&mut self, inputs: &Inputs) -> Result<TickOutput, TargetError> {
        self.send(&encode_tick(inputs))?;
        let answer: [u8; ANSWER_BYTES] = self.receive()?;
        let (dac, mode, stopping) =
            decode_answer(answer).ok_or_else(|| TargetError(format!("the guest answered {answer:?}")))?;
        Ok(TickOutput { dac: DacCode(dac), mode, stopping })
    }
    fn watchdog_reset(&mut self) -> Result<(), TargetError> {
        let mut message = [0; TICK_BYTES];
        message[0] = WATCHDOG_RESET;
        self.send(&message)
    }
}
