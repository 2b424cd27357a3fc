//! Lock-step exchange of codes between a plant on the desktop and the control loop elsewhere (QEMU, through two pipes).
//!
//! The guest says [`READY`]. The host sends the length of a [`SetupMessage`] (two bytes, little-endian), then the message; the
//! guest answers [`ACCEPTED`] or [`REFUSED`]. Then each tick of the host ([`encode_tick`]) has one answer ([`encode_answer`]), until the
//! host sends a message that starts with [`END`], which the guest answers with [`Counts`].

use control::{AdcCode, ControllerState, ExternalFaults, Inputs, Mode, OperatorCommand, Parameters, Position};
use monitor::MonitorParameters;
use plant_model::{Effect, Effects, Plant, RIG_NUMBERS, Rig};
use serde::{Deserialize, Serialize};

use crate::bench::BenchPlant;
use crate::control_loop::{ControlLoop, MonitorSetup, Order, Setup};
use crate::record::{STOPPING, mode_from_number};

/// First byte of the guest.
pub const READY: u8 = 0xA5;
/// The setup is in force.
pub const ACCEPTED: u8 = 1;
/// The setup's numbers are out of range.
pub const REFUSED: u8 = 0;
/// First byte of a tick.
pub const TICK: u8 = 1;
/// First byte of the end.
pub const END: u8 = 2;
/// First byte of a watchdog reset; not answered.
pub const WATCHDOG_RESET: u8 = 3;
/// Bytes of a tick.
pub const TICK_BYTES: usize = 16;
/// Bytes of an answer.
pub const ANSWER_BYTES: usize = 4;
/// Bytes of [`Counts`].
pub const COUNTS_BYTES: usize = 28;
/// Longest setup.
pub const SETUP_BYTES: usize = 1024;

/// Everything a guest has to know before the first tick.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SetupMessage {
    /// The control law's.
    pub parameters: Parameters,
    /// The monitor's, if there is one.
    pub monitor: Option<MonitorParameters>,
    /// The rig the monitor knows.
    pub rig: heapless::Vec<f32, RIG_NUMBERS>,
    /// Its effects: index in the catalogue, values.
    pub effects: heapless::Vec<(u8, [f32; 3]), { Effect::ALL.len() }>,
    /// Ticks between a code and its effect.
    pub output_delay_ticks: u8,
    /// Already armed, or booting.
    pub armed: bool,
    /// One telemetry record every so many ticks; 0: none.
    pub every: u32,
    /// Bench mode: the guest's own plant in place of the codes of the ticks; for a loop that boots, as one that runs refuses it.
    pub bench: bool,
}

/// Effects as a list of numbers.
#[must_use]
pub fn effect_numbers(effects: &Effects<f32>) -> heapless::Vec<(u8, [f32; 3]), { Effect::ALL.len() }> {
    effects
        .iter()
        .map(|(effect, values)| {
            let mut numbers = [0.0; 3];
            for (number, value) in numbers.iter_mut().zip(values) {
                *number = *value;
            }
            (effect as u8, numbers)
        })
        .collect()
}

impl SetupMessage {
    /// The loop that the guest runs. `None` if a number is out of range.
    #[must_use]
    pub fn into_loop(self) -> Option<ControlLoop> {
        let rig = Rig::from_numbers(&self.rig.into_array().ok()?);
        let monitor = match self.monitor {
            None => None,
            Some(parameters) => {
                let mut effects = Effects::none();
                for (index, values) in &self.effects {
                    effects.set(Effect::ALL.get(usize::from(*index)).copied()?, values);
                }
                let plant = Plant::new(&rig, &effects).ok()?;
                Some(MonitorSetup { plant, parameters, trips: true, output_delay_ticks: self.output_delay_ticks })
            }
        };
        let setup = Setup::new(&self.parameters, monitor, self.every).ok()?;
        let state = if self.armed { ControllerState::armed() } else { ControllerState::boot(None) };
        let mut control_loop = ControlLoop::in_state(setup, state);
        if self.bench {
            control_loop.order(&Order::BenchOn(BenchPlant::of_rig(&rig, &self.parameters)?));
        }
        Some(control_loop)
    }
}

/// Reads a setup; `None` if it is none.
#[must_use]
pub fn decode_setup(bytes: &[u8]) -> Option<SetupMessage> {
    postcard::from_bytes(bytes).ok()
}

/// Writes a setup, length first; `None` if it is too long.
#[must_use]
pub fn encode_setup(setup: &SetupMessage) -> Option<heapless::Vec<u8, { SETUP_BYTES + 2 }>> {
    let mut bytes = heapless::Vec::new();
    bytes.resize(SETUP_BYTES + 2, 0).ok()?;
    let length = postcard::to_slice(setup, bytes.get_mut(2..)?).ok()?.len();
    bytes.get_mut(..2)?.copy_from_slice(&u16::try_from(length).ok()?.to_le_bytes());
    bytes.truncate(length + 2);
    Some(bytes)
}

const COMMANDS: [Option<OperatorCommand>; 4] =
    [None, Some(OperatorCommand::Arm), Some(OperatorCommand::Disarm), Some(OperatorCommand::ResetFault)];

/// Writes the inputs of one tick, but for what contradicts: that the loop's own monitor says.
#[must_use]
pub fn encode_tick(inputs: &Inputs) -> [u8; TICK_BYTES] {
    let bit = |flag: bool, place: u32| u8::from(flag) << place;
    let faults = &inputs.faults;
    let flags = bit(inputs.supply.is_some(), 0)
        | bit(inputs.host_heard, 1)
        | bit(faults.late_tick, 2)
        | bit(faults.overrun, 3)
        | bit(faults.model_disagreement, 4)
        | bit(faults.valve_output, 5);
    let command = COMMANDS.iter().position(|command| *command == inputs.command).unwrap_or(0) as u8;
    let [r0, r1, r2, r3] = inputs.reference.to_bits().to_le_bytes();
    let code = |code: AdcCode| code.0.to_le_bytes();
    let ([y0, y1], [a0, a1], [b0, b1]) = (code(inputs.position), code(inputs.pressure_a), code(inputs.pressure_b));
    let [s0, s1] = code(inputs.supply.unwrap_or_default());
    [TICK, flags, command, faults.missed_ticks, r0, r1, r2, r3, y0, y1, a0, a1, b0, b1, s0, s1]
}

/// Reads the inputs of one tick; `None` if it is the end.
#[must_use]
pub fn decode_tick(message: &[u8; TICK_BYTES]) -> Option<Inputs> {
    let [kind, flags, command, missed_ticks, r0, r1, r2, r3, y0, y1, a0, a1, b0, b1, s0, s1] = *message;
    if kind != TICK {
        return None;
    }
    let bit = |place: u32| flags >> place & 1 == 1;
    let code = |low, high| AdcCode(u16::from_le_bytes([low, high]));
    Some(Inputs {
        reference: Position::from_bits(i32::from_le_bytes([r0, r1, r2, r3])),
        position: code(y0, y1),
        pressure_a: code(a0, a1),
        pressure_b: code(b0, b1),
        supply: bit(0).then(|| code(s0, s1)),
        command: COMMANDS.get(usize::from(command)).copied().flatten(),
        host_heard: bit(1),
        faults: ExternalFaults {
            missed_ticks,
            late_tick: bit(2),
            overrun: bit(3),
            model_disagreement: bit(4),
            valve_output: bit(5),
            contradicts: None,
        },
    })
}

/// What comes back of one tick: code and mode as a record has them.
#[must_use]
pub fn encode_answer(dac: u16, mode: u16) -> [u8; ANSWER_BYTES] {
    let ([d0, d1], [m0, m1]) = (dac.to_le_bytes(), mode.to_le_bytes());
    [d0, d1, m0, m1]
}

/// Code and mode of one tick, and whether a controlled stop is under way; `None` if the mode is none. How long a self-test still takes
/// is not told.
#[must_use]
pub fn decode_answer(answer: [u8; ANSWER_BYTES]) -> Option<(u16, Mode, bool)> {
    let [d0, d1, m0, m1] = answer;
    let number = u16::from_le_bytes([m0, m1]);
    Some((u16::from_le_bytes([d0, d1]), mode_from_number(number)?, number & STOPPING != 0))
}

/// Instructions per tick, measured by the guest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Ticks counted.
    pub ticks: u32,
    /// Fewest, sum, most of [`ControlLoop::tick`], the plant of bench mode included.
    pub tick: [u32; 3],
    /// Fewest, sum, most of tick and monitor together.
    pub all: [u32; 3],
}

impl Counts {
    /// Takes one tick into account.
    pub fn add(&mut self, tick: u32, all: u32) {
        for ([least, sum, most], count) in [(&mut self.tick, tick), (&mut self.all, all)] {
            *least = if self.ticks == 0 { count } else { count.min(*least) };
            *sum = sum.saturating_add(count);
            *most = count.max(*most);
        }
        self.ticks = self.ticks.saturating_add(1);
    }

    /// As bytes.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; COUNTS_BYTES] {
        let ([t0, t1, t2], [a0, a1, a2]) = (self.tick, self.all);
        let words = [self.ticks, t0, t1, t2, a0, a1, a2];
        let mut bytes = [0; COUNTS_BYTES];
        for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    /// From bytes.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; COUNTS_BYTES]) -> Self {
        let mut words = [0; 7];
        for (word, place) in words.iter_mut().zip(bytes.chunks_exact(4)) {
            *word = place.iter().rev().fold(0, |sum, byte| sum << 8 | u32::from(*byte));
        }
        let [ticks, t0, t1, t2, a0, a1, a2] = words;
        Self { ticks, tick: [t0, t1, t2], all: [a0, a1, a2] }
    }
}
