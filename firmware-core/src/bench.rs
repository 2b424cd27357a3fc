//! Bench mode: the simulated plant in place of sensors and valve, so that the whole firmware runs on a bare board.
//!
//! This is the one place where floating point runs in the control tick, and only while bench mode is on. One tick is one
//! L-stable step of the plant model in f32.

use board_link::Parameter;
use plant_model::{Effects, Plant, Simulator, Stepper};

use crate::settings::Settings;

/// Longest step of the plant, s: at 1 kHz a tick is one step.
const LONGEST_STEP_S: f32 = 1.0e-3;

/// The plant behind simulated converters.
#[derive(Clone, Debug)]
pub struct BenchPlant {
    simulator: Simulator<f32, 1>,
    tick_s: f32,
    position: Line,
    pressure: Line,
    volts_per_code: f32,
    volts_at_zero: f32,
}

/// A linear converter: code = (x − low) · codes per unit.
#[derive(Clone, Copy, Debug)]
struct Line {
    low: f32,
    codes_per_unit: f32,
}

impl Line {
    fn new(low: f32, high: f32) -> Self {
        Self { low, codes_per_unit: 65_535.0 / (high - low) }
    }

    /// The code, rounded and limited (a float-to-integer cast saturates).
    fn code(self, value: f32) -> u16 {
        ((value - self.low) * self.codes_per_unit + 0.5) as u16
    }
}

impl BenchPlant {
    /// The plant at rest at mid-stroke. `None` if the settings describe no physical rig.
    #[must_use]
    pub fn new(settings: &Settings) -> Option<Self> {
        let rig = settings.rig();
        let plant = Plant::new(&rig, &Effects::none()).ok()?;
        let pressure = rig.equilibrium_pressure_pa();
        let state = plant.state_at_rest(0.0, pressure, pressure);
        let tick_s = 1.0 / settings.tick_hz() as f32;
        let steps = if tick_s > LONGEST_STEP_S { 2 } else { 1 };
        let (low_v, high_v) = (settings.get(Parameter::ValveLow), settings.get(Parameter::ValveHigh));
        Some(Self {
            simulator: Simulator::from_state(plant, state, Stepper::equal_steps(steps)),
            tick_s,
            position: Line::new(settings.get(Parameter::PositionLow), settings.get(Parameter::PositionHigh)),
            pressure: Line::new(settings.get(Parameter::PressureLow), settings.get(Parameter::PressureHigh)),
            volts_per_code: (high_v - low_v) / 4095.0,
            volts_at_zero: low_v,
        })
    }

    /// Lets a tick pass with the valve at `dac_code`, and returns what the converters then read.
    #[inline(never)]
    pub fn advance(&mut self, dac_code: u16) -> [u16; 4] {
        let volts = self.volts_at_zero + self.volts_per_code * f32::from(dac_code);
        self.simulator.advance(volts, self.tick_s);
        let seen = self.simulator.measure();
        [
            self.position.code(seen.y_m),
            self.pressure.code(seen.p_a_pa),
            self.pressure.code(seen.p_b_pa),
            self.pressure.code(seen.p_sup_pa),
        ]
    }
}
