//! Bench mode: the simulated plant in place of sensors and valve, so that the whole firmware runs on a bare board.
//!
//! This is the one place where floating point runs in the control tick, and only while bench mode is on. One tick is one
//! L-stable step of the plant model in f32; the slowest tick (1 kHz) is short enough for it.

use control::Parameters;
use plant_model::{Plant, Rig, State, Stepper};

/// The plant behind simulated converters.
#[derive(Clone, Debug)]
pub struct BenchPlant {
    plant: Plant<f32>,
    state: State<f32>,
    tick_s: f32,
    /// Position, p_a, p_b, p_sup.
    channels: [Line; 4],
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
    fn new([low, high]: [f64; 2]) -> Self {
        Self { low: low as f32, codes_per_unit: 65_535.0 / (high as f32 - low as f32) }
    }

    /// The code, rounded and limited (a float-to-integer cast saturates).
    fn code(self, value: f32) -> u16 {
        ((value - self.low) * self.codes_per_unit + 0.5) as u16
    }
}

impl BenchPlant {
    /// The plant at rest at mid-stroke, behind the converters of the control law. `None` if the numbers describe no physical
    /// rig.
    #[must_use]
    pub fn of_rig(rig: &Rig<f32>, parameters: &Parameters) -> Option<Self> {
        let plant = Plant::without_effects(rig).ok()?;
        let [p_a, p_b] = rig.equilibrium_pressures_pa();
        let state = plant.state_at_rest(0.0, p_a, p_b);
        let tick_s = 1.0 / parameters.tick_hz as f32;
        let [low_v, high_v] = parameters.valve_range_v;
        Some(Self {
            plant,
            state,
            tick_s,
            channels: parameters.calibrated_ranges().map(Line::new),
            volts_per_code: (high_v - low_v) / 4095.0,
            volts_at_zero: low_v,
        })
    }

    /// Lets a tick pass with the valve at `dac_code`, and returns what the converters then read.
    #[inline(never)]
    pub fn advance(&mut self, dac_code: u16) -> [u16; 4] {
        let volts = self.volts_at_zero + self.volts_per_code * f32::from(dac_code);
        let inputs = self.plant.inputs(volts);
        Stepper::single_step(&self.plant, &mut self.state, &inputs, self.tick_s);
        let [position, a, b, supply] = self.channels;
        [
            position.code(self.state.y_m),
            a.code(self.state.p_a_pa),
            b.code(self.state.p_b_pa),
            supply.code(self.state.p_sup_pa),
        ]
    }
}
