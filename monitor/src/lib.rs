//! The model-disagreement monitor: do pressures, motion and valve command still belong to one cylinder?
//!
//! Each sensor alone can look healthy and still be wrong: frozen without ever having been noisy, late, of the wrong
//! scale, or honest while the valve is jammed or the supply is gone. What it cannot do is agree with the others. A
//! chamber's pressure balance (3.6, 3.7) ties all of them together:
//!
//! ```text
//! V_a p_a' = R n T q_a(u, p_a, p_sup) − n A p_a y'        and the same for B with the opposite sign of y'
//!            └ valve and supply ──────┘   └ motion ──┘
//! ```
//!
//! The monitor integrates this for both chambers from *measured* position, pressures and supply and from the command, and
//! compares with the measured pressure. The prediction is drawn towards the measurement with a time constant of 50 ms
//! ([`MonitorParameters::horizon_s`]), so that it looks back over about that time: the difference is what the last 50 ms
//! cannot explain. Four questions are asked:
//!
//! | question | file | finds |
//! | --- | --- | --- |
//! | does each chamber's pressure follow? | `chamber.rs` | wrong pressures, lost supply, a jammed valve |
//! | do both together speak of motion that the sensor does not show? | `motion.rs` | slow motion behind a frozen sensor, wrong scale |
//! | has the reading bent as no piston can, and is motion missing since? | `kink.rs` | a sensor that freezes, lags or changes scale under way |
//! | has the reading jumped, and gone on at the same speed? | `jump.rs` | a sensor that is suddenly late |
//!
//! Where the answer is no, `isolation.rs` asks whether it is the position, or one of the pressures, that contradicts the rest.
//!
//! **What is allowed.** A model is never exact. The threshold is a sum of: the pressure noise; the position noise,
//! as the pressure that much motion would make; a share ([`MonitorParameters::relative`]) of the predicted flow or compression,
//! whichever is larger, over the same horizon; and an uncertainty of the valve's opening (hysteresis, null). So the harder the rig works, the more
//! absolute error is accepted, and flows that are wrong by a fifth do not trip. Besides, the lag of the valve's spool may be anything from none
//! to twice what is known: the threshold grows by what a valve without lag would make of the residual. Three ticks beyond it in a row trip.
//!
//! **What it cannot find.** Motion of less than one or two millimetres, whoever hides it; a wrong scale within `relative` that
//! set in unseen; a slow drift of a pressure sensor, which is indistinguishable from a leak. `docs/reliability.md` has the figures.
//!
//! It belongs behind the DAC write, and its verdict takes effect in the next tick. `docs/firmware.md` has its cost.
#![no_std]
#![forbid(unsafe_code)]

mod chamber;
mod command_delay;
mod history;
mod isolation;
mod jump;
mod kink;
mod motion;
mod parameters;

pub use parameter_table::ParameterError as MonitorError;
pub use parameters::{Key, MonitorParameters};

use chamber::{Balance, Found, Interval, Watch};
use command_delay::CommandDelay;
use history::History;
use isolation::Isolation;
use kink::{Bent, KinkWatch};
use motion::MissingMotion;
use plant_model::{Effects, Plant, Real, Rig, Side};

/// What the sensors say this tick: the controller's last good readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// Piston position, m.
    pub position_m: f32,
    /// Pressure of chamber A, Pa absolute.
    pub pressure_a_pa: f32,
    /// Pressure of chamber B, Pa absolute.
    pub pressure_b_pa: f32,
    /// Supply pressure, Pa absolute; `None` without a sensor: then the nominal one is believed.
    pub supply_pa: Option<f32>,
}

/// What the monitor makes of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Verdict {
    /// The readings cannot all be true. Feed it to the controller's `faults.model_disagreement`.
    pub disagreement: bool,
    /// Of a disagreement: which sensor contradicts the rest, where that is known. Feed it to the controller's `faults.contradicts`.
    pub contradicts: Option<Contradicts>,
    /// Measured minus predicted pressure of A and of B, Pa; motion that the position sensor does not show, over a short
    /// and over a long time and since a bend, m; a gap in the reading's course, m.
    pub checks: [Check; 6],
}

/// A sensor that contradicts the rest: all others, valve and supply agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contradicts {
    /// The position.
    Position,
    /// The pressure of chamber A. The rest speaks of this one instead, Pa absolute.
    PressureA(f32),
    /// The same of chamber B.
    PressureB(f32),
}

/// A difference and how large it may be, in the same unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Check {
    /// The difference.
    pub residual: f32,
    /// What its magnitude may be.
    pub threshold: f32,
}

impl Check {
    /// Where nothing can be said.
    const NOTHING: Self = Self { residual: 0.0, threshold: 1.0 };

    /// Written so that a NaN counts as beyond.
    fn holds(&self) -> bool {
        self.residual.abs() <= self.threshold
    }
}

impl Verdict {
    /// The largest difference as a share of what it may be: how close it is to a disagreement.
    #[must_use]
    pub fn closeness(&self) -> f32 {
        let share = |check: &Check| if check.threshold > 0.0 { check.residual.abs() / check.threshold } else { 0.0 };
        self.checks.iter().map(share).fold(0.0, f32::max)
    }
}

/// The monitor of one rig.
#[derive(Clone, Debug)]
pub struct Monitor {
    plant: Plant<f32>,
    parameters: MonitorParameters,
    tick_s: f32,
    /// What remains of a difference after one tick, `1 − tick / horizon`.
    keep: f32,
    /// What remains of the spool's lag after one tick, `exp(−tick / tau)`.
    spool_keep: f32,
    delay: CommandDelay,
    spool_v: f32,
    smoothed_step_m: f32,
    last: Option<Readings>,
    a: Watch,
    b: Watch,
    missing: MissingMotion,
    kink: KinkWatch,
    history: History,
    isolation: Isolation,
    strikes: u8,
}

/// Time constant over which motion is smoothed for the allowance, in ticks.
const SMOOTHING_TICKS: f32 = 8.0;
/// Ticks beyond the threshold in a row that make a disagreement.
const STRIKES: u8 = 3;

impl Monitor {
    /// A monitor for a rig with its known effects, called once per tick of `tick_s` seconds.
    ///
    /// `command_delay_ticks` is how many whole ticks pass between writing a command and the valve receiving it, beyond the
    /// tick during which it is held: 0 when the DAC is written in the tick that computed it.
    ///
    /// # Errors
    /// A parameter of rig, effects or monitor that is out of range.
    pub fn new(
        rig: &Rig<f32>,
        effects: &Effects<f32>,
        parameters: &MonitorParameters,
        tick_s: f32,
        command_delay_ticks: u8,
    ) -> Result<Self, MonitorError> {
        Self::for_plant(Plant::new(rig, effects)?, parameters, tick_s, command_delay_ticks, 0.0)
    }

    /// A monitor for a plant made beforehand; otherwise as [`Monitor::new`].
    ///
    /// `spool_lag_s` is the time constant of the valve's spool where it is known from elsewhere than the plant's effects, s; 0 where
    /// it is not: then the valve is taken to follow at once. From none to twice the lag is allowed.
    ///
    /// # Errors
    /// A parameter of the monitor that is out of range.
    pub fn for_plant(
        plant: Plant<f32>,
        parameters: &MonitorParameters,
        tick_s: f32,
        command_delay_ticks: u8,
        spool_lag_s: f32,
    ) -> Result<Self, MonitorError> {
        parameters.validate(tick_s)?;
        let lag_s = match plant.added().valve_lag.time_constant_s {
            by_effect if by_effect > 0.0 => by_effect,
            _ => spool_lag_s,
        };
        let spool_keep = if lag_s > 0.0 { (-tick_s / lag_s).exp() } else { 0.0 };
        let kink = KinkWatch::new(&plant, tick_s);
        let delay = CommandDelay::new(f32::from(command_delay_ticks) + plant.mean_line_delay_s() / tick_s)?;
        Ok(Self {
            plant,
            parameters: *parameters,
            tick_s,
            keep: 1.0 - tick_s / parameters.horizon_s,
            spool_keep,
            delay,
            spool_v: 0.0,
            smoothed_step_m: 0.0,
            last: None,
            a: Watch::default(),
            b: Watch::default(),
            missing: MissingMotion::new(parameters, tick_s),
            kink,
            history: History::new(tick_s),
            isolation: Isolation::new(tick_s),
            strikes: 0,
        })
    }

    /// The plant as the monitor knows it: it never changes.
    #[inline]
    #[must_use]
    pub fn plant(&self) -> &Plant<f32> {
        &self.plant
    }

    /// Forgets the past: the next reading is the new beginning, with the valve held at `held_u_v`. For every tick in which
    /// the controller does not run, so that nothing from before counts against a run.
    pub fn restart(&mut self, held_u_v: f32) {
        self.delay.fill(held_u_v);
        (self.spool_v, self.smoothed_step_m, self.last) = (held_u_v, 0.0, None);
        (self.a, self.b, self.strikes) = (Watch::default(), Watch::default(), 0);
        self.missing.restart();
        self.kink.restart();
        self.history.restart();
        self.isolation.restart();
    }

    /// Takes the readings of this tick and the voltage written to the valve in the tick before.
    pub fn step(&mut self, readings: &Readings, previous_u_v: f32) -> Verdict {
        let m = self.plant.coefficients();
        let command = self.delay.pass(previous_u_v).limit(-m.max_voltage_v, m.max_voltage_v);
        let spool_before = self.spool_v;
        self.spool_v = command + (self.spool_v - command) * self.spool_keep;
        let Some(last) = self.last.replace(*readings) else {
            return Verdict::default();
        };

        let step_m = readings.position_m - last.position_m;
        self.smoothed_step_m += (step_m - self.smoothed_step_m) * (1.0 / SMOOTHING_TICKS);
        let interval = Interval {
            plant: &self.plant,
            parameters: &self.parameters,
            tick_s: self.tick_s,
            keep: self.keep,
            spool_v: if self.spool_keep > 0.0 { 0.5 * (spool_before + self.spool_v) } else { command },
            supply_pa: match (readings.supply_pa, last.supply_pa) {
                (Some(now), Some(before)) => 0.5 * (now + before),
                _ => m.supply_pa,
            },
        };
        let valve = interval.valve((self.spool_keep > 0.0).then_some(command));
        let y_m = 0.5 * (readings.position_m + last.position_m);
        let (volume_a, volume_b) = self.plant.volumes_m3(y_m);
        let (middle_a, middle_b) = self.plant.volumes_m3(0.0);
        let mean_a = 0.5 * (readings.pressure_a_pa + last.pressure_a_pa);
        let mean_b = 0.5 * (readings.pressure_b_pa + last.pressure_b_pa);
        let balance_a = Balance {
            pressure_pa: mean_a,
            inverse_volume_per_m3: 1.0 / volume_a,
            middle_volume_m3: middle_a,
            towards_b: 1.0,
            side: Side::A,
            distance_m: m.half_stroke_m + y_m,
            step_m,
            smoothed_step_m: self.smoothed_step_m,
            filling: valve.fills_a,
            leak_kg_per_s: self.plant.leaks(Side::A, mean_a, Some(mean_b)).mass_flow,
        };
        let balance_b = Balance {
            pressure_pa: mean_b,
            inverse_volume_per_m3: 1.0 / volume_b,
            middle_volume_m3: middle_b,
            towards_b: -1.0,
            side: Side::B,
            distance_m: m.half_stroke_m - y_m,
            step_m: -step_m,
            smoothed_step_m: -self.smoothed_step_m,
            filling: !valve.fills_a,
            leak_kg_per_s: self.plant.leaks(Side::B, mean_b, Some(mean_a)).mass_flow,
        };
        let found_a = self.a.advance(&interval, &valve, &balance_a, readings.pressure_a_pa - last.pressure_a_pa);
        // The air of a single-acting cylinder's other chamber is the room's.
        let found_b = if self.plant.is_single_acting() {
            let contribution = found_a.contribution.alone();
            Found { check: Check::default(), noise_pa: 0.0, stepped_pa: 0.0, steps_now: false, contribution }
        } else {
            self.b.advance(&interval, &valve, &balance_b, readings.pressure_b_pa - last.pressure_b_pa)
        };
        let [moved_a, moved_b] = [found_a.contribution, found_b.contribution];
        let [short, long] = self.missing.advance(&self.parameters, &moved_a, &moved_b);
        let bent = Bent {
            force_n: m.area_b_m2 * (mean_a - mean_b) + (m.area_a_m2 - m.area_b_m2) * (mean_a - m.atmosphere_pa)
                - m.mass_kg * m.gravity_m_per_s2
                - m.spring_preload_n
                - m.spring_n_per_m * (m.half_stroke_m + y_m),
            missing: self.missing.since_a_bend(),
            metres_per_pa: 0.5 * (moved_a.metres_per_pa + moved_b.metres_per_pa),
        };
        let forgotten = self.history.advance(readings.position_m);
        let kink = self.kink.advance(&self.plant, &self.parameters, &bent, (&self.history, forgotten));
        let jump = if forgotten.is_some() { jump::check(&self.history, &self.parameters) } else { Check::NOTHING };
        let checks = [found_a.check, found_b.check, short, long, kink, jump];

        self.strikes = if checks.iter().all(Check::holds) { 0 } else { self.strikes.saturating_add(1) };
        // A jump stands between two lines in one tick only, and sixteen readings have seen it.
        let jumped = !jump.holds();
        let disagreement = jumped || self.strikes >= STRIKES;
        let missing_m =
            [-found_a.check.residual * moved_a.metres_per_pa, found_b.check.residual * moved_b.metres_per_pa];
        let course = self.isolation.advance(step_m, missing_m, &kink);
        let contradicts = if !disagreement {
            None
        } else if jumped || course.contradicts {
            Some(Contradicts::Position)
        } else {
            let side = |found, balance: &Balance, single: bool| isolation::Side {
                found,
                by_opening: if single { [0.0; 2] } else { chamber::by_opening(&interval, balance) },
                in_the_dark: balance.filling && readings.supply_pa.is_none(),
            };
            let a = side(&found_a, &balance_a, false);
            let b = side(&found_b, &balance_b, self.plant.is_single_acting());
            if a.is_alone(&b, course) {
                Some(Contradicts::PressureA(readings.pressure_a_pa - self.before_drawn(found_a.check.residual)))
            } else if b.is_alone(&a, course) {
                Some(Contradicts::PressureB(readings.pressure_b_pa - self.before_drawn(found_b.check.residual)))
            } else {
                None
            }
        };
        Verdict { disagreement, contradicts, checks }
    }

    /// What a difference was before the prediction was drawn towards the measurement in the ticks that make a disagreement.
    fn before_drawn(&self, residual: f32) -> f32 {
        (0..STRIKES).fold(residual, |residual, _| residual / self.keep)
    }
}
