//! The cylinder and its sensors at the board's pins: the plant moves on to the very instant of each conversion.

use crate::sensors::{CodeNoise, SensorChannel, channels, quantities};
use plant_model::{Inputs, ParameterError, Plant, Simulator, Stepper, Tolerance};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rig_files::{Converter, RigFile};
use std::cell::Cell;
use std::rc::Rc;
use stm32_emulator::analog::{Analog, share_of};
use stm32_emulator::peripherals::adc::Conversion;
use stm32_emulator::time::{Time, to_seconds};

/// Input channels of ADC1 of position, p_a, p_b, p_sup (docs/wiring.md).
pub const CHANNELS: [u8; 4] = [1, 2, 7, 6];

/// The largest sum of sixteen 12-bit conversions.
const LARGEST_SUM: u32 = 16 * 4095;

/// The sum of sixteen conversions that the firmware stretches to `code` (`firmware_core::code_of_sum`). Fifteen of the 65 536
/// codes have none of their own: there the neighbour's is taken.
#[must_use]
pub fn sum_of_code(code: u16) -> u32 {
    (u32::from(code) * LARGEST_SUM + 32_767) / 65_535
}

/// What one tick sampled.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sampled {
    /// When the first channel was held.
    pub at: Time,
    /// Sums of position, p_a, p_b, p_sup.
    pub sums: [u16; 4],
    /// Position, velocity, pressures, bristle deflection then.
    pub plant: plant_model::State<f64>,
}

/// What is done to the cylinder from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Force on the piston, positive towards chamber B, N.
    pub force_n: f64,
    /// Supply pressure, Pa absolute.
    pub supply_pa: f64,
    /// The sensors are plugged in; an open input reads zero.
    pub plugged: bool,
}

/// Plant, sensors and valve.
pub struct Cylinder {
    simulator: Simulator<f64>,
    sensors: [SensorChannel; 4],
    noisy: bool,
    random: Xoshiro256PlusPlus,
    valve: Converter,
    surroundings: Rc<Cell<Surroundings>>,
    code: Option<u16>,
    simulated_to: Time,
    sum: u32,
    sampled: Sampled,
}

impl Cylinder {
    /// At rest at mid-stroke, each chamber at its equilibrium pressure.
    ///
    /// # Errors
    /// The plant refuses a number of the rig.
    pub fn new(rig: &RigFile, noise: &CodeNoise, seed: u64) -> Result<Self, ParameterError> {
        let plant = Plant::new(&rig.rig, &rig.effects)?;
        let [p_a, p_b] = rig.rig.equilibrium_pressures_pa();
        let begin = plant.state_at_rest(0.0, p_a, p_b);
        let surroundings = Surroundings { force_n: 0.0, supply_pa: rig.rig.supply.pressure_pa, plugged: true };
        Ok(Self {
            simulator: Simulator::from_state(plant, begin, Stepper::adaptive(&Tolerance::standard())),
            sensors: channels(&rig.io, noise),
            noisy: *noise != CodeNoise::NONE,
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            valve: rig.io.valve(),
            surroundings: Rc::new(Cell::new(surroundings)),
            code: None,
            simulated_to: 0,
            sum: 0,
            sampled: Sampled { plant: begin, ..Sampled::default() },
        })
    }

    /// What the tick under way, or the last one, sampled.
    #[must_use]
    pub fn sampled(&self) -> &Sampled {
        &self.sampled
    }

    /// What hand and shop do to it; kept elsewhere, too, it can be changed while the board is being talked to.
    #[must_use]
    pub fn surroundings(&self) -> Rc<Cell<Surroundings>> {
        Rc::clone(&self.surroundings)
    }

    /// The true position now, m.
    #[must_use]
    pub fn position_m(&self) -> f64 {
        self.simulator.state().y_m
    }

    /// The valve's voltage now, V; the output stage holds it at mid while the pin is high impedance.
    #[must_use]
    pub fn valve_v(&self) -> f64 {
        self.code.map_or(0.0, |code| self.valve.quantity(u32::from(code)))
    }

    fn advance(&mut self, to: Time) {
        let Surroundings { force_n, supply_pa, .. } = self.surroundings.get();
        let inputs = Inputs { u_v: self.valve_v(), external_force_n: force_n, supply_pa };
        let seconds = to_seconds(to.saturating_sub(self.simulated_to));
        if seconds > 0.0 {
            self.simulator.advance_with(&inputs, seconds);
            self.simulated_to = to;
        }
    }
}

impl Analog for Cylinder {
    fn convert(&mut self, conversion: &Conversion) -> u16 {
        if conversion.sample == 0 {
            self.advance(conversion.at);
            let rank = usize::from(conversion.rank) % self.sampled.sums.len();
            if rank == 0 {
                self.sampled.at = conversion.at;
                self.sampled.plant = *self.simulator.state();
            }
            let noise = if self.noisy { StandardNormal.sample(&mut self.random) } else { 0.0 };
            // A channel that nothing is wired to reads zero.
            let wired =
                CHANNELS.iter().position(|channel| *channel == conversion.channel && self.surroundings.get().plugged);
            let truth = quantities(&self.simulator.measure());
            self.sum = wired.map_or(0, |index| sum_of_code(self.sensors[index].code(truth[index], noise)));
            self.sampled.sums[rank] = self.sum as u16;
        }
        share_of(self.sum, conversion)
    }

    fn output(&mut self, at: Time, code: Option<u16>) {
        self.advance(at);
        self.code = code;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware_core::code_of_sum;

    #[test]
    fn sums_become_their_codes_again_but_for_the_fifteen_that_no_sum_gives() {
        let missed = (0..=u16::MAX).filter(|code| code_of_sum(sum_of_code(*code) as u16) != *code).count();
        assert_eq!(missed, 15);
        assert_eq!([sum_of_code(0), sum_of_code(u16::MAX)], [0, LARGEST_SUM]);
    }
}
