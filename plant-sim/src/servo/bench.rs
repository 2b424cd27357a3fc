//! The law on a simulated rig in the set-up of the study: codes of 16 bits over the stroke, DAC of 12 bits over ±5 V, 1 kHz,
//! noise of 20 um and 400 Pa in a code, output one tick late.

use super::{Readings, Servo};
use crate::closed_loop::reference;
use crate::sensors::{CodeNoise, SensorChannel, channels, quantities};
use control::{ControllerState, ExternalFaults, LawChoice, Parameters};
use firmware_core::{ControlLoop, Setup};
use plant_model::{Effect, Effects, Inputs, ParameterError, Plant, Rig, Side, Simulator, State, Stepper, Tolerance};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rig_files::{Io, RigFile};

/// A simulated rig with the law closed around it.
pub struct Bench {
    simulator: Simulator<f64>,
    rig: Rig<f64>,
    effects: Effects<f64>,
    io: Io,
    sensors: [SensorChannel; 4],
    rng: Xoshiro256PlusPlus,
    /// The law with its memory.
    pub servo: Servo,
    /// Pressure sensors that are not read.
    pub lost: Lost,
    /// Force on the piston from outside, along +y, N.
    pub load_n: f64,
    /// The firmware's tick with the same inputs, if it runs beside the law in f64.
    pub control_loop: Option<ControlLoop>,
    /// Who drives the valve.
    pub driver: Driver,
    /// The codes that the law in f64 and the tick computed last.
    pub codes: [u32; 2],
    code: u32,
}

/// Whose code goes to the valve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Driver {
    /// The law in f64.
    #[default]
    Reference,
    /// The firmware's tick.
    Tick,
}

/// Pressure sensors that are not read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lost {
    /// None.
    #[default]
    None,
    /// That of chamber A.
    A,
    /// Both chambers'.
    Both,
}

impl Bench {
    /// A rig at rest at mid-stroke with `effects`, `noise` times the study's sensor noise; the law may know another rig.
    ///
    /// # Errors
    /// The plant refuses a parameter.
    pub fn new(
        rig: &Rig<f64>,
        effects: &Effects<f64>,
        servo: Servo,
        noise: f64,
        seed: u64,
    ) -> Result<Self, ParameterError> {
        let half = servo.rig.cylinder.stroke_m / 2.0;
        let io = Io { position_range_m: [-half, half], ..Io::default() };
        Ok(Self {
            simulator: Simulator::new(rig, effects)?,
            rig: *rig,
            effects: *effects,
            sensors: channels(&io, &CodeNoise { position_m: 20e-6 * noise, pressure_pa: 400.0 * noise }),
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            code: io.valve().code(0.0),
            lost: Lost::None,
            load_n: 0.0,
            control_loop: None,
            driver: Driver::Reference,
            codes: [0; 2],
            servo,
            io,
        })
    }

    /// The same with the firmware's tick beside the law in f64, tuned alike.
    ///
    /// # Panics
    /// The controller refuses a parameter.
    #[must_use]
    pub fn with_tick(mut self, driver: Driver) -> Self {
        let (tuning, rig) = (&self.servo.tuning, self.servo.rig);
        let lag = Effects::none().with(Effect::ValveLag, &[tuning.valve_lag_s]);
        let io = Io { tick_hz: (1.0 / tuning.tick_s).round() as u32, ..self.io };
        let file = RigFile { rig, io, effects: lag, ..RigFile::paper_a() };
        let parameters = Parameters {
            law: LawChoice::Servo,
            pressure_loss_trips: false,
            servo_speed_m_per_s: tuning.limits.speed as f32,
            servo_acceleration_m_per_s2: tuning.limits.acceleration as f32,
            servo_jerk_m_per_s3: tuning.limits.jerk as f32,
            servo_bandwidth_rad_per_s: tuning.law_w as f32,
            servo_observer_rad_per_s: tuning.observer_w as f32,
            servo_force_rate_per_s: tuning.force_rate as f32,
            servo_lead_s: tuning.lead_s as f32,
            servo_stick_slip: tuning.stick_slip,
            ..rig_files::controller::parameters(&file)
        };
        let setup = Setup::new(&parameters, None, 1).expect("valid parameters");
        self.control_loop = Some(ControlLoop::in_state(setup, ControllerState::armed()));
        self.driver = driver;
        self
    }

    /// The same with a valve that acts later than the law knows, and with pressure sensors that follow late, both in s.
    ///
    /// # Panics
    /// The plant refuses a time.
    #[must_use]
    pub fn late(mut self, valve_s: f64, pressures_s: f64) -> Self {
        for (effect, seconds) in [(Effect::LineDelay, valve_s), (Effect::PressureLag, pressures_s)] {
            if seconds > 0.0 {
                self.effects = self.effects.with(effect, &[seconds]);
            }
        }
        self.simulator = Simulator::new(&self.rig, &self.effects).expect("a time within its range");
        self
    }

    /// The same under a constant force in N along +y from outside, of which the law knows nothing and which the pressures balance.
    #[must_use]
    pub fn under(mut self, load_n: f64) -> Self {
        let (plant, state) = (*self.simulator.plant(), *self.simulator.state());
        let [a, b] = [Side::A, Side::B].map(|side| 0.5 * load_n / plant.area_m2(side));
        let balanced = plant.state_at_rest(state.y_m, state.p_a_pa - a, state.p_b_pa + b);
        self.simulator = Simulator::from_state(plant, balanced, Stepper::adaptive(&Tolerance::standard()));
        self.load_n = load_n;
        self
    }

    /// Puts an obstacle `at` so many m on either side of the middle in the piston's way, or takes it away.
    ///
    /// # Panics
    /// There is no room between the obstacles.
    pub fn obstacle(&mut self, at: Option<f64>) {
        let mut rig = self.rig;
        rig.cylinder.stroke_m = at.map_or(rig.cylinder.stroke_m, |at| 2.0 * at);
        let plant = Plant::new(&rig, &self.effects).expect("a valid rig");
        self.simulator =
            Simulator::from_state(plant, *self.simulator.state(), Stepper::adaptive(&Tolerance::standard()));
    }

    /// The true state of the rig.
    #[must_use]
    pub fn state(&self) -> &State<f64> {
        self.simulator.state()
    }

    /// The command that acts from the next tick on, V.
    #[must_use]
    pub fn command_v(&self) -> f64 {
        self.io.valve().quantity(self.code)
    }

    /// One tick; returns the true position at its begin and the code that is computed in it.
    pub fn tick(&mut self, target: f64) -> (f64, u32) {
        let truth = quantities(&self.simulator.measure());
        let mut codes: [u16; 4] =
            std::array::from_fn(|n| self.sensors[n].code(truth[n], StandardNormal.sample(&mut self.rng)));
        // A lost sensor reads the lowest code.
        match self.lost {
            Lost::None => {}
            Lost::A => codes[1] = 0,
            Lost::Both => (codes[1], codes[2]) = (0, 0),
        }
        let pressure = self.io.pressure();
        let readings = Readings {
            y: self.io.position().quantity(codes[0].into()),
            p_a: (self.lost == Lost::None).then(|| pressure.quantity(codes[1].into())),
            p_b: (self.lost != Lost::Both).then(|| pressure.quantity(codes[2].into())),
            p_sup: pressure.quantity(codes[3].into()),
        };
        let y = self.simulator.state().y_m;
        let mut next = self.io.valve().code(self.servo.step(target, &readings));
        self.codes[0] = next;
        if let Some(tick) = &mut self.control_loop {
            tick.hold(reference(target));
            self.codes[1] = u32::from(tick.tick(codes, ExternalFaults::default(), true).valve);
            tick.conclude();
            if self.driver == Driver::Tick {
                next = self.codes[1];
            }
        }
        let acting = self.io.valve().quantity(self.code);
        let inputs = Inputs { external_force_n: self.load_n, ..self.simulator.plant().inputs(acting) };
        self.simulator.advance_with(&inputs, self.servo.tuning.tick_s);
        self.code = next;
        (y, next)
    }
}

/// What became of a move.
#[derive(Clone, Copy, Debug, Default)]
pub struct Move {
    /// After this time the error stays within 0.1 mm; infinite where it does not, s.
    pub settled_s: f64,
    /// Beyond the target, m.
    pub overshoot_m: f64,
    /// Largest error in the last second, m.
    pub rest_error_m: f64,
    /// Peak to peak in the last second, m.
    pub rest_peak_m: f64,
    /// Changes of the code in the last second.
    pub changes: u32,
    /// Farthest from the start, m.
    pub furthest_m: f64,
}

/// Moves to `target` in m and watches for `ticks`.
pub fn step(bench: &mut Bench, target: f64, ticks: u32) -> Move {
    let start = bench.simulator.state().y_m;
    let side = (target - start).signum();
    let rest = ticks.saturating_sub((1.0 / bench.servo.tuning.tick_s) as u32);
    let mut seen = Move::default();
    let (mut low, mut high, mut last) = (f64::INFINITY, f64::NEG_INFINITY, None);
    for tick in 0..ticks {
        let (y, code) = bench.tick(target);
        if (y - target).abs() > 1e-4 {
            seen.settled_s = f64::from(tick + 1) * bench.servo.tuning.tick_s;
        }
        seen.overshoot_m = seen.overshoot_m.max(side * (y - target));
        seen.furthest_m = seen.furthest_m.max((y - start).abs());
        if tick >= rest {
            seen.rest_error_m = seen.rest_error_m.max((y - target).abs());
            (low, high) = (low.min(y), high.max(y));
            seen.changes += u32::from(last.is_some_and(|last| last != code));
            last = Some(code);
        }
    }
    seen.rest_peak_m = high - low;
    if (bench.simulator.state().y_m - target).abs() > 1e-4 {
        seen.settled_s = f64::INFINITY;
    }
    seen
}

/// How a streamed target is sent.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    /// Time between new values, s.
    pub every_s: f64,
    /// Size of a code, m; zero for none.
    pub code_m: f64,
    /// Standard deviation of its noise, m.
    pub noise_m: f64,
}

impl Sent {
    /// Anew each tick, without codes and noise.
    pub const EXACT: Self = Self { every_s: 0.0, code_m: 0.0, noise_m: 0.0 };
}

/// Peak and root mean square of the error to a sine, after its first period.
#[must_use]
pub fn sine(bench: &mut Bench, amplitude: f64, hz: f64, sent: &Sent) -> (f64, f64) {
    let (mut peak, mut sum) = (0.0_f64, 0.0);
    let tick_s = bench.servo.tuning.tick_s;
    let ticks = (3.0 / hz / tick_s) as u32;
    let first = ticks / 3;
    let every = ((sent.every_s / tick_s).round() as u32).max(1);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut value = 0.0;
    for tick in 0..ticks {
        let target = |tick: u32| amplitude * (2.0 * std::f64::consts::PI * hz * f64::from(tick) * tick_s).sin();
        if tick % every == 0 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            value = target(tick) + sent.noise_m * noise;
            if sent.code_m > 0.0 {
                value = (value / sent.code_m).round() * sent.code_m;
            }
        }
        let (y, _) = bench.tick(value);
        if tick >= first {
            let error = y - target(tick);
            peak = peak.max(error.abs());
            sum += error * error;
        }
    }
    (peak, (sum / f64::from(ticks - first)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::Tuning;
    use super::*;

    fn bench(mut rig: Rig<f64>, seed: u64) -> Bench {
        (rig.valve.dead_zone_right_v, rig.valve.dead_zone_left_v) = (0.42, -0.42);
        let servo = Servo::new(&rig, Tuning::of(&rig, 1.7e-3, 1.0e-3));
        let effects = Effects::none().with(Effect::ValveLag, &[1.7e-3]);
        Bench::new(&rig, &effects, servo, 1.0, seed).expect("a valid rig")
    }

    #[test]
    fn on_every_case_a_move_of_45_mm_arrives_hardly_passes_its_target_and_then_rests_on_a_silent_valve() {
        for (rig, within_s) in [(Rig::paper_a(), 0.30), (Rig::paper_b(), 0.35), (Rig::paper_c(), 0.28)] {
            for seed in 0..5 {
                let seen = step(&mut bench(rig, seed), 0.045, 2500);
                assert!(seen.settled_s < within_s, "seed {seed}: {seen:?}");
                assert!(seen.overshoot_m < 1.5e-4, "seed {seed}: {seen:?}");
                assert!(seen.rest_error_m < 4.5e-5, "seed {seed}: {seen:?}");
                assert!(seen.changes <= 2, "seed {seed}: {seen:?}");
            }
        }
    }

    #[test]
    fn a_streamed_sine_is_followed_within_0_4_percent_of_its_amplitude() {
        for (rig, amplitude) in [(Rig::paper_a(), 0.05), (Rig::paper_b(), 0.05), (Rig::paper_c(), 0.03)] {
            let (peak, rms) = sine(&mut bench(rig, 1), amplitude, 0.5, &Sent::EXACT);
            assert!(peak < 0.004 * amplitude && rms < 0.001 * amplitude, "peak {peak} m, rms {rms} m");
        }
    }

    #[test]
    fn targets_that_jump_each_tick_never_drive_the_piston_50_percent_beyond_them() {
        for rig in [Rig::paper_a(), Rig::paper_b(), Rig::paper_c()] {
            let mut bench = bench(rig, 1);
            let mut furthest = 0.0_f64;
            for tick in 0..4000_u32 {
                let (y, _) = bench.tick(if tick.wrapping_mul(2_654_435_761) >> 31 == 0 { 0.04 } else { -0.04 });
                furthest = furthest.max(y.abs());
            }
            assert!(furthest < 0.06, "{furthest} m");
            let seen = step(&mut bench, 0.0, 2000);
            assert!(seen.settled_s < 1.0, "{seen:?}");
        }
    }
}
