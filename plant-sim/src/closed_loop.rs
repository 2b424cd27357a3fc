//! The closed loop: sensors, converters, the firmware's own loop with its model monitor, DAC, valve and cylinder, one tick
//! at a time.
//!
//! ```text
//!  y_ref ─► ControlLoop::tick ─► DAC code ─► valve ─► cylinder ─► sensors ─┐
//!               ▲                                                          │ + noise
//!               └──── ADC codes ◄── oversampling converter ◄───────────────┘
//! ```
//!
//! Nothing is allocated per tick.

use crate::monitoring::{self, MonitorAction};
use crate::sensors::{ConversionNoise, SensorChannel, channels, quantities};
use board_link::LearnedValues;
use control::{ControllerState, ExternalFaults, Mode, Parameters, Position};
use firmware_core::{ControlLoop, SetupError};
use plant_model::{ParameterError, Rig, Simulator, State as PlantState};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rig_files::{Converter, RigFile};
use std::fmt;

/// How the loop is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopSettings {
    /// Sensor noise of one raw conversion.
    pub noise: ConversionNoise,
    /// Raw conversions summed per code; 16 in the firmware.
    pub oversampling: u32,
    /// Bits of one raw conversion; 12 on the STM32G4.
    pub raw_bits: u32,
    /// Ticks from sampling to the DAC's output: one in the firmware, whose DAC is latched by the sampling timer.
    pub output_delay_ticks: u8,
    /// Seed of the noise.
    pub seed: u64,
    /// What the model monitor's verdict does.
    pub monitor: MonitorAction,
}

impl Default for LoopSettings {
    fn default() -> Self {
        Self {
            noise: ConversionNoise::default(),
            oversampling: 16,
            raw_bits: 12,
            output_delay_ticks: 1,
            seed: 1,
            monitor: MonitorAction::default(),
        }
    }
}

/// The longest [`LoopSettings::output_delay_ticks`].
pub const MOST_OUTPUT_DELAY_TICKS: u8 = 8;

/// Why a loop cannot be set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoopError {
    /// The plant refuses a parameter or an effect.
    Plant(ParameterError),
    /// The controller refuses a parameter.
    Controller(SetupError),
    /// More output delay than [`MOST_OUTPUT_DELAY_TICKS`].
    Delay(u8),
}

impl fmt::Display for LoopError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plant(error) => write!(f, "the plant refuses it: {error}"),
            Self::Controller(error) => write!(f, "the controller refuses it: {error}"),
            Self::Delay(ticks) => write!(f, "an output delay of {ticks} ticks is more than {MOST_OUTPUT_DELAY_TICKS}"),
        }
    }
}

impl std::error::Error for LoopError {}

impl From<ParameterError> for LoopError {
    fn from(error: ParameterError) -> Self {
        Self::Plant(error)
    }
}

impl From<SetupError> for LoopError {
    fn from(error: SetupError) -> Self {
        Self::Controller(error)
    }
}

/// What one tick saw and did, inside and outside of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopRecord {
    /// Time of sampling, s.
    pub t_s: f64,
    /// The codes the controller received: position, A, B, supply.
    pub adc: [u16; 4],
    /// The code it answered with.
    pub dac: u16,
    /// Its mode after the tick.
    pub mode: Mode,
    /// Whether its model monitor finds that the readings contradict each other.
    pub disagreement: bool,
    /// The valve command acting from this tick to the next, V.
    pub u_v: f64,
    /// The true state at the time of sampling.
    pub plant: PlantState<f64>,
}

/// Voltages on their way to the DAC's output.
#[derive(Clone, Copy, Debug)]
struct OutputDelay {
    ticks: usize,
    oldest: usize,
    pending_v: [f64; MOST_OUTPUT_DELAY_TICKS as usize],
}

impl OutputDelay {
    /// Takes this tick's voltage and returns the one of so many ticks ago.
    #[inline]
    fn pass(&mut self, voltage_v: f64) -> f64 {
        if self.ticks == 0 {
            return voltage_v;
        }
        let slot = &mut self.pending_v[self.oldest];
        self.oldest = if self.oldest + 1 < self.ticks { self.oldest + 1 } else { 0 };
        std::mem::replace(slot, voltage_v)
    }
}

/// The plant under the firmware's control, ready to be ticked.
#[derive(Clone, Debug)]
pub struct ClosedLoop {
    simulator: Simulator<f64>,
    controller: ControlLoop,
    sensors: [SensorChannel; 4],
    noisy: bool,
    valve: Converter,
    tick_s: f64,
    tick_hz: u32,
    ticks: u64,
    rng: Xoshiro256PlusPlus,
    delay: OutputDelay,
}

impl ClosedLoop {
    /// A rig at rest at mid-stroke, both chambers at p*, the controller armed. Its model monitor knows the rig's nominal
    /// values and none of its effects, as the board does.
    ///
    /// # Errors
    /// Plant or controller refuse a parameter.
    pub fn new(rig: &RigFile, parameters: &Parameters, settings: &LoopSettings) -> Result<Self, LoopError> {
        Self::with_model(rig, &rig.rig, parameters, settings)
    }

    /// The same with a monitor that knows `model`, from which the rig may differ.
    ///
    /// # Errors
    /// As [`ClosedLoop::new`].
    pub fn with_model(
        rig: &RigFile,
        model: &Rig<f64>,
        parameters: &Parameters,
        settings: &LoopSettings,
    ) -> Result<Self, LoopError> {
        if settings.output_delay_ticks > MOST_OUTPUT_DELAY_TICKS {
            return Err(LoopError::Delay(settings.output_delay_ticks));
        }
        let simulator = Simulator::new(&rig.rig, &rig.effects)?;
        let setup = monitoring::setup(parameters, model, settings.monitor, settings.output_delay_ticks)?;
        let controller = ControlLoop::in_state(setup, ControllerState::armed());
        let io = &rig.io;
        let valve = io.valve();
        let safe_v = valve.quantity(u32::from(controller.safe_code()));
        let noise = settings.noise.of_code(io, settings.oversampling, settings.raw_bits);
        Ok(Self {
            simulator,
            controller,
            sensors: channels(io, &noise),
            noisy: settings.noise != ConversionNoise::NONE,
            valve,
            tick_s: io.tick_s(),
            tick_hz: parameters.tick_hz,
            ticks: 0,
            rng: Xoshiro256PlusPlus::seed_from_u64(settings.seed),
            delay: OutputDelay {
                ticks: usize::from(settings.output_delay_ticks),
                oldest: 0,
                pending_v: [safe_v; MOST_OUTPUT_DELAY_TICKS as usize],
            },
        })
    }

    /// Samples, runs the controller, and advances the plant to the next tick with the setpoint `y_ref` in m.
    #[inline]
    pub fn tick(&mut self, y_ref_m: f64) -> LoopRecord {
        let adc = self.sample();
        self.controller.hold(reference(y_ref_m));
        // No host speaks here: a controller that waits for one says so.
        let answer = self.controller.tick(adc, ExternalFaults::default(), false);
        let disagreement = self.controller.conclude();
        self.finish(adc, answer.valve, self.controller.mode(), disagreement)
    }

    /// Samples and advances the plant with a DAC code that another controller computes from the codes. The mode in the
    /// record is then that of the loop's own controller, which sees nothing.
    #[inline]
    pub fn tick_with(&mut self, controller: impl FnOnce([u16; 4]) -> u16) -> LoopRecord {
        let adc = self.sample();
        let dac = controller(adc);
        self.finish(adc, dac, self.controller.mode(), false)
    }

    #[inline]
    fn sample(&mut self) -> [u16; 4] {
        let truth = quantities(&self.simulator.measure());
        let mut noise = [0.0; 4];
        if self.noisy {
            noise = std::array::from_fn(|_| StandardNormal.sample(&mut self.rng));
        }
        std::array::from_fn(|n| self.sensors[n].code(truth[n], noise[n]))
    }

    #[inline]
    fn finish(&mut self, adc: [u16; 4], dac: u16, mode: Mode, disagreement: bool) -> LoopRecord {
        let plant = *self.simulator.state();
        let u_v = self.delay.pass(self.valve.quantity(u32::from(dac)));
        let inputs = self.simulator.plant().inputs(u_v);
        self.simulator.advance_with(&inputs, self.tick_s);
        let t_s = self.ticks as f64 * self.tick_s;
        self.ticks += 1;
        LoopRecord { t_s, adc, dac, mode, disagreement, u_v, plant }
    }

    /// What the positioning law has learned; `None` under the paper's law.
    #[must_use]
    pub fn learned(&self) -> Option<LearnedValues> {
        self.controller.learned_values(self.tick_hz)
    }

    /// The true position now, m.
    #[must_use]
    pub fn position_m(&self) -> f64 {
        self.simulator.state().y_m
    }

    /// The simulated rig.
    #[must_use]
    pub fn simulator(&self) -> &Simulator<f64> {
        &self.simulator
    }

    /// Duration of a tick, s.
    #[must_use]
    pub fn tick_s(&self) -> f64 {
        self.tick_s
    }
}

/// A setpoint in m as the controller takes it: saturated; NaN becomes zero.
#[inline]
#[must_use]
pub fn reference(y_ref_m: f64) -> Position {
    // Position::from_num would panic outside ±8 m; far inside its resolution this is the same number.
    Position::from_bits((y_ref_m * f64::from(1_u32 << Position::FRAC_NBITS)).round_ties_even() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::parameters;
    use control::Reason;

    fn run(settings: &LoopSettings, ticks: usize) -> Vec<LoopRecord> {
        let rig = RigFile::paper_a();
        let mut positioner = ClosedLoop::new(&rig, &parameters(&rig), settings).expect("valid");
        (0..ticks).map(|_| positioner.tick(0.045)).collect()
    }

    #[test]
    fn the_same_seed_gives_the_same_codes_and_another_seed_others() {
        let settings = LoopSettings::default();
        let first = run(&settings, 500);
        assert_eq!(first, run(&settings, 500));
        let other = run(&LoopSettings { seed: 2, ..settings }, 500);
        assert_ne!(first[499].adc, other[499].adc);
    }

    #[test]
    fn without_noise_the_codes_are_those_of_the_interface_formula() {
        let settings = LoopSettings { noise: ConversionNoise::NONE, ..LoopSettings::default() };
        for tick in run(&settings, 300) {
            let expected = ((tick.plant.y_m + 0.5) * 65535.0).round();
            assert_eq!(f64::from(tick.adc[0]), expected);
            assert_eq!(f64::from(tick.adc[1]), (tick.plant.p_a_pa / 1.0e6 * 65535.0).round());
        }
    }

    #[test]
    fn noise_has_the_deviation_that_oversampling_leaves() {
        let settings = LoopSettings::default();
        let ticks = run(&settings, 4000);
        let raw_lsb = 1.0 / 4095.0;
        let expected = ((5.0e-5_f64.powi(2) + raw_lsb * raw_lsb / 12.0) / 16.0).sqrt() * 65535.0;
        let errors: Vec<f64> =
            ticks.iter().map(|tick| f64::from(tick.adc[0]) - (tick.plant.y_m + 0.5) * 65535.0).collect();
        let deviation = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let with_rounding = (expected * expected + 1.0 / 12.0).sqrt();
        assert!((deviation / with_rounding - 1.0).abs() < 0.05, "{deviation} against {with_rounding}");
    }

    #[test]
    fn the_output_is_late_by_exactly_the_stated_ticks() {
        for delay in [0, 1, 3] {
            let settings = LoopSettings { output_delay_ticks: delay, ..LoopSettings::default() };
            let ticks = run(&settings, 50);
            let valve = RigFile::paper_a().io.valve();
            let delay = usize::from(delay);
            for (tick, earlier) in ticks[delay..].iter().zip(&ticks) {
                assert_eq!(tick.u_v, valve.quantity(u32::from(earlier.dac)));
            }
            assert!(ticks[..delay].iter().all(|tick| tick.u_v.abs() < 2e-3), "the valve starts at mid");
        }
    }

    #[test]
    fn a_plant_unlike_its_model_trips_the_monitor_or_is_only_told_or_goes_unwatched() {
        let rig = RigFile::paper_a();
        let mut model = rig.rig;
        model.valve.fill_coefficient_kg_per_s_pa *= 0.4;
        for (monitor, trips, tells) in
            [(MonitorAction::Trip, true, true), (MonitorAction::Warn, false, true), (MonitorAction::Off, false, false)]
        {
            let settings = LoopSettings { monitor, ..LoopSettings::default() };
            let mut positioner =
                ClosedLoop::with_model(&rig, &model, &parameters(&rig), &settings).expect("a physical model");
            let ticks: Vec<LoopRecord> = (0..1000).map(|_| positioner.tick(0.2)).collect();
            assert_eq!(ticks.iter().any(|tick| tick.disagreement), tells, "{monitor:?}");
            let end = if trips { Mode::Safe(Reason::ModelDisagreement) } else { Mode::Run };
            assert_eq!(ticks[999].mode, end, "{monitor:?}");
        }
    }

    #[test]
    fn a_setpoint_beyond_the_format_saturates() {
        assert_eq!(reference(1e9), Position::MAX);
        assert_eq!(reference(-1e9), Position::MIN);
        assert_eq!(reference(f64::NAN), Position::ZERO);
        assert_eq!(reference(0.25), Position::from_num(0.25));
    }
}
