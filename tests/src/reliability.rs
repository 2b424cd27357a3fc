//! The reliability study: every fault on every rig in several situations, with and without protection; and hours of
//! normal running.
//!
//! A fault *threatens* a run when, without any protection, it drives the piston at least 10 mm further out of the span
//! between where it was and where it was sent than the same run does without fault.

use crate::fault::{Fault, Kind};
use crate::rig;
use crate::runner::{Outcome, host_target, run, run_observed};
use crate::scenario::{Deviation, Expect, MonitorChoice, ReferenceSegment, Scenario, ScheduledCommand, Start};
use crate::target::{Target, TargetError, TickOutput};
use control::{AdcCode, Channel, DacCode, Inputs, LawChoice, Mode, OperatorCommand, Parameters, twin};
use plant_sim::CodeNoise;
use plant_sim::servo::{Readings, Servo, Tuning};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use rig_files::Io;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The rigs of the study with the gain of the paper's law at which each moves briskly, V/m.
pub const RIGS: [(&str, f64); 3] = [("paper-a", 4.0), ("paper-b", 10.0), ("paper-c", 20.0)];

/// Uncommanded travel beyond which a fault threatens, m.
pub const THREAT_M: f64 = 0.010;

/// Within this time a threatening fault should be caught, s.
pub const GOAL_S: f64 = 0.020;

/// A controller that believes every code: a law and the inverse dead zone alone, in f64.
enum Unprotected {
    Paper(Box<Parameters>),
    Servo(Box<Servo>, Io),
}

impl Unprotected {
    fn of(scenario: &Scenario) -> Result<Self, TargetError> {
        let fail = |error: rig_files::InputError| TargetError(error.to_string());
        let parameters = scenario.parameters("reliability").map_err(fail)?;
        if parameters.law == LawChoice::Paper {
            return Ok(Self::Paper(Box::new(parameters)));
        }
        let file = scenario.rig_file().map_err(fail)?;
        let tuning = Tuning::of(&file.rig, rig_files::tuning::lag_s(&file), file.io.tick_s());
        Ok(Self::Servo(Box::new(Servo::new(&file.rig, tuning)), file.io))
    }
}

impl Target for Unprotected {
    fn tick(&mut self, inputs: &Inputs) -> Result<TickOutput, TargetError> {
        let dac = match self {
            Self::Paper(parameters) => {
                let code = twin::output(parameters, inputs.reference.to_num(), inputs.position.0).code;
                (code + 0.5) as u16
            }
            Self::Servo(servo, io) => {
                let pressure = |code: AdcCode| io.pressure().quantity(u32::from(code.0));
                let readings = Readings {
                    y: io.position().quantity(u32::from(inputs.position.0)),
                    p_a: Some(pressure(inputs.pressure_a)),
                    p_b: Some(pressure(inputs.pressure_b)),
                    p_sup: pressure(inputs.supply.unwrap_or_default()),
                };
                io.valve().code(servo.step(inputs.reference.to_num(), &readings)) as u16
            }
        };
        Ok(TickOutput { dac: DacCode(dac), mode: Mode::Run, stopping: false })
    }

    fn has_watchdog(&self) -> bool {
        false
    }

    fn watchdog_reset(&mut self) -> Result<(), TargetError> {
        Ok(())
    }
}

/// One row of the study: a fault with its strength.
#[derive(Clone, Debug)]
pub struct Row {
    /// What the table calls it.
    pub label: String,
    /// What goes wrong; the situation sets when.
    pub fault: Fault,
    quiet: bool,
    /// With a dump valve at the board's air output.
    dump: bool,
    /// Known in its own tick: the valve closes and the air drops, without a controlled stop.
    known: bool,
}

impl Row {
    /// Whether the sensors are without noise.
    #[must_use]
    pub fn quiet(&self) -> bool {
        self.quiet
    }

    /// Whether it is the other row, but known at once.
    #[must_use]
    pub fn bounds(&self, other: &Self) -> bool {
        self.known && (self.fault, self.quiet, self.dump) == (other.fault, other.quiet, other.dump)
    }

    /// A situation with the row's fault, and the same run without: silence of a host that need not speak.
    fn with_and_without_fault(&self, situation: &Situation) -> [Scenario; 2] {
        let [mut spoilt, healthy] = [self.fault, Fault::new(Kind::HostSilent, None, 0.0)]
            .map(|fault| scenario(situation, fault, self.quiet, self.dump));
        if self.known {
            spoilt.fault.push(Fault::new(Kind::ValveOutput, None, spoilt.fault[0].at_s));
        }
        [spoilt, healthy]
    }
}

/// Time constant of supply and hoses behind a dump valve, its own delay included, s.
const DUMP_S: f64 = 0.03;

/// What came of one row over all rigs, situations and seeds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Runs made.
    pub runs: usize,
    /// Runs in which the fault threatens.
    pub threatening: usize,
    /// Threatening runs caught within [`GOAL_S`].
    pub in_time: usize,
    /// Threatening runs neither caught nor harmless.
    pub missed: usize,
    /// Threatening runs, caught or bridged, in which the piston went less than [`THREAT_M`] further than without fault.
    pub harmless: usize,
    /// Longest time from fault to safe state in threatening runs, s.
    pub worst_time_s: f64,
    /// Furthest the piston went beyond the fault-free run, protected, in any run, m.
    pub worst_excursion_m: f64,
    /// The same without protection, m.
    pub worst_unprotected_m: f64,
    /// Soonest that the piston went [`THREAT_M`] beyond the fault-free run, protected, in any run, s after the fault.
    pub soonest_s: Option<f64>,
    /// Furthest the piston went outside the span of where it was and where it was sent, protected, in any run, m.
    pub furthest_m: f64,
    /// Furthest that the piston went beyond both the fault-free run and one whose valve closes when the fault would strike, m.
    pub beyond_closed_m: f64,
    /// Threatening runs that were not caught within [`GOAL_S`], as sentences.
    pub late: Vec<String>,
    /// How often each reason was given, in all runs.
    pub reasons: BTreeMap<&'static str, usize>,
}

/// Every row of the study.
#[must_use]
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    let sensor: [(Kind, &str); 8] = [
        (Kind::Off, "off (lowest code)"),
        (Kind::Shorted, "off (highest code)"),
        (Kind::Stuck, "stuck"),
        (Kind::Garbage, "garbage"),
        (Kind::Scale, "scale × 1.5"),
        (Kind::Slow, "slow (lag 100 ms)"),
        (Kind::Delayed, "delayed (50 ms)"),
        (Kind::Intermittent, "intermittent (every second sample lost)"),
    ];
    for channel in Channel::ALL {
        for (kind, text) in sensor {
            let fault = Fault::new(kind, Some(channel), 0.0);
            rows.push(Row {
                label: format!("{}: {text}", channel.as_str()),
                fault,
                quiet: false,
                dump: false,
                known: false,
            });
        }
        let fault = Fault { factor: 0.7, ..Fault::new(Kind::Scale, Some(channel), 0.0) };
        rows.push(Row {
            label: format!("{}: scale × 0.7", channel.as_str()),
            fault,
            quiet: false,
            dump: false,
            known: false,
        });
        let fault = Fault::new(Kind::Stuck, Some(channel), 0.0);
        rows.push(Row {
            label: format!("{}: stuck, sensors without noise", channel.as_str()),
            fault,
            quiet: true,
            dump: false,
            known: false,
        });
    }
    let plant = |kind: Kind, text: &str| Row {
        label: text.into(),
        fault: Fault::new(kind, None, 0.0),
        quiet: false,
        dump: false,
        known: false,
    };
    let supply = Fault { time_constant_s: 0.01, ..Fault::new(Kind::SupplyLoss, None, 0.0) };
    rows.push(Row { label: "supply lost (10 ms)".into(), fault: supply, quiet: false, dump: false, known: false });
    rows.push(plant(Kind::JammedValve, "valve jammed"));
    rows.push(Row { dump: true, ..plant(Kind::JammedValve, "valve jammed, dump valve at the air output") });
    rows.push(plant(Kind::DroppedTicks, "ticks stop for good (watchdog)"));
    let half = Fault { ticks: 1, every: 2, ..Fault::new(Kind::DroppedTicks, None, 0.0) };
    rows.push(Row { label: "every second tick dropped".into(), fault: half, quiet: false, dump: false, known: false });
    rows.push(plant(Kind::LateTicks, "every tick late"));
    rows.push(plant(Kind::Overrun, "every sample overrun"));
    rows
}

/// The jammed valve with the dump valve, known in its own tick: what no monitor betters.
#[must_use]
pub fn jam_known_at_once() -> Row {
    let label = "the same, known in its own tick".into();
    Row { label, fault: Fault::new(Kind::JammedValve, None, 0.0), quiet: false, dump: true, known: true }
}

/// When and where a fault strikes: rig, law, situation, seed.
#[derive(Clone, Copy, Debug)]
struct Situation {
    rig: &'static str,
    law: LawChoice,
    /// Which of [`PHASES`].
    phase: usize,
    seed: u64,
}

/// What the piston does when the fault strikes.
const PHASES: [&str; 3] = ["at rest", "moving outwards", "turning back"];

impl Situation {
    /// Rig, phase and seed.
    fn label(&self) -> String {
        format!("{}, {}, seed {}", self.rig, PHASES[self.phase], self.seed)
    }
}

fn situations(law: LawChoice, seed: u64, seeds: u64) -> Vec<Situation> {
    let mut all = Vec::new();
    for (rig, _) in RIGS {
        for phase in 0..3 {
            for n in 0..seeds {
                all.push(Situation { rig, law, phase, seed: seed.wrapping_mul(1000).wrapping_add(n) });
            }
        }
    }
    all
}

fn scenario(situation: &Situation, mut fault: Fault, quiet: bool, dump: bool) -> Scenario {
    let mut random = SmallRng::seed_from_u64(situation.seed ^ (situation.phase as u64) << 32);
    let stroke = if situation.rig == "paper-c" { 0.1746 } else { 1.0 };
    let target = stroke * random.random_range(0.15..0.35);
    let back = stroke * random.random_range(-0.3..-0.1);
    let step = |at_s: f64, position_m: f64| ReferenceSegment { at_s, position_m: Some(position_m), program: None };
    let (reference, at_s) = match situation.phase {
        0 => (vec![step(0.0, target)], 2.5 + random.random_range(0.0..0.5)),
        1 => (vec![step(1.0, target)], 1.0 + random.random_range(0.1..0.5)),
        _ => (vec![step(1.0, target), step(1.5, back)], 1.5 + random.random_range(0.02..0.5)),
    };
    // On the tick, so that times to the safe state are whole ticks.
    fault.at_s = (at_s * 1000.0_f64).round() / 1000.0;
    let effect = |name: &str, value: f64| BTreeMap::from([(name.to_owned(), value)]);
    let mut control = toml::Table::new();
    if situation.law == LawChoice::Paper {
        let gain = RIGS.iter().find(|(rig, _)| *rig == situation.rig).map_or(4.0, |(_, gain)| *gain);
        control.insert("gain_v_per_m".into(), toml::Value::Float(gain));
    }
    Scenario {
        name: "reliability".into(),
        rig: situation.rig.into(),
        duration_s: fault.at_s + 1.0,
        seed: situation.seed,
        start: Start::Armed,
        output_delay_ticks: 1,
        dead_zone_v: Some(0.42),
        effects: BTreeMap::from([
            ("valve-lag".to_owned(), effect("time_constant_s", 1.7e-3)),
            ("valve-hysteresis".to_owned(), effect("half_width_v", 0.01)),
        ]),
        deviation: Deviation::NONE,
        dump_valve_s: dump.then_some(DUMP_S),
        tick_hz: None,
        noise: if quiet { CodeNoise::NONE } else { CodeNoise::default() },
        initial_position_m: 0.0,
        control,
        monitor: MonitorChoice::default(),
        reference,
        command: Vec::new(),
        fault: vec![fault],
        expect: Expect::default(),
        folder: ".".into(),
    }
}

fn unprotected(scenario: &Scenario) -> Result<Outcome, TargetError> {
    run_observed(scenario, &mut Unprotected::of(scenario)?, |_| ())
}

/// The same run with the valve closed from a time on.
#[must_use]
pub fn closed_at(scenario: &Scenario, at_s: f64) -> Scenario {
    Scenario { command: vec![ScheduledCommand { at_s, command: OperatorCommand::Disarm }], ..scenario.clone() }
}

/// A run in which the fault itself moves the piston far.
#[derive(Clone, Debug)]
pub struct FarRun {
    /// Rig, situation and seed.
    pub label: String,
    /// The run, its fault included.
    pub spoilt: Scenario,
    /// The same run without fault.
    pub healthy: Scenario,
    /// Furthest out of the span by coasting or without fault, whichever is further, m.
    pub coasting_m: f64,
    /// How much further the piston went, m.
    pub beyond_m: f64,
}

/// The runs of a row under the positioning law in which the piston goes at least [`THREAT_M`] further than it coasts.
///
/// # Errors
/// As [`study`].
pub fn far_runs(row: &Row, seed: u64, seeds: u64) -> Result<Vec<FarRun>, TargetError> {
    let mut far = Vec::new();
    for situation in situations(LawChoice::Servo, seed, seeds) {
        let [spoilt, healthy] = row.with_and_without_fault(&situation);
        let healthy = Scenario { duration_s: spoilt.duration_s, ..healthy };
        let closed_m = run(&closed_at(&healthy, spoilt.fault[0].at_s))?.excursion_m;
        let coasting_m = closed_m.max(run(&healthy)?.excursion_m);
        let beyond_m = run(&spoilt)?.excursion_m - coasting_m;
        if beyond_m >= THREAT_M {
            far.push(FarRun { label: situation.label(), spoilt, healthy, coasting_m, beyond_m });
        }
    }
    Ok(far)
}

/// Runs one row over all situations under a law.
///
/// # Errors
/// A scenario that controller or plant refuse: a defect of the study.
pub fn study(row: &Row, law: LawChoice, seed: u64, seeds: u64) -> Result<Tally, TargetError> {
    let runs: Vec<_> = situations(law, seed, seeds)
        .par_iter()
        .map(|situation| {
            let [spoilt, healthy] = row.with_and_without_fault(situation);
            let where_and_when = format!("{}, struck at {:.3} s", situation.label(), spoilt.fault[0].at_s);
            let [bare, undisturbed] =
                [unprotected(&spoilt)?, unprotected(&healthy)?].map(|outcome| outcome.excursion_m);
            // What coasting alone comes to: no fault, but the valve is closed the moment it would strike.
            let closed = run(&closed_at(&healthy, spoilt.fault[0].at_s))?.excursion_m;
            Ok((run(&spoilt)?, [bare, undisturbed, closed], where_and_when))
        })
        .collect::<Result<_, TargetError>>()?;
    let mut result = Tally { runs: runs.len(), ..Tally::default() };
    for (protected, [unprotected_m, healthy_m, closed_m], where_and_when) in runs {
        result.beyond_closed_m = result.beyond_closed_m.max(protected.excursion_m - closed_m.max(healthy_m));
        let excess_m = (protected.excursion_m - healthy_m).max(0.0);
        result.worst_excursion_m = result.worst_excursion_m.max(excess_m);
        result.furthest_m = result.furthest_m.max(protected.excursion_m);
        let beyond_mm = (1.0e3 * (healthy_m + THREAT_M)).ceil() as usize;
        if let Some(&after_s) = protected.millimetres_s.get(beyond_mm - 1) {
            result.soonest_s = Some(result.soonest_s.map_or(after_s, |soonest_s| soonest_s.min(after_s)));
        }
        result.worst_unprotected_m = result.worst_unprotected_m.max(unprotected_m - healthy_m);
        if let Some((reason, _)) = protected.tripped {
            *result.reasons.entry(reason.as_str()).or_default() += 1;
        }
        if unprotected_m - healthy_m < THREAT_M {
            continue;
        }
        result.threatening += 1;
        result.harmless += usize::from(excess_m < THREAT_M);
        let end = match protected.tripped {
            Some((reason, after_s)) => {
                result.worst_time_s = result.worst_time_s.max(after_s);
                if after_s <= GOAL_S + 1e-9 {
                    result.in_time += 1;
                    continue;
                }
                format!("{reason} after {:.0} ms", 1e3 * after_s)
            }
            None => {
                result.missed += usize::from(excess_m >= THREAT_M);
                "not caught".into()
            }
        };
        result.late.push(format!("{where_and_when}: {end}, {:.1} mm", 1e3 * excess_m));
    }
    Ok(result)
}

/// One line of the table.
#[must_use]
pub fn table_line(row: &Row, r: &Tally) -> String {
    let reasons = if r.reasons.is_empty() {
        "none".to_owned()
    } else {
        r.reasons.iter().map(|(reason, n)| format!("{reason} {n}")).collect::<Vec<_>>().join(", ")
    };
    let mut line = String::new();
    let _ = write!(line, "| {} | {} / {} | {:.0} | ", row.label, r.threatening, r.runs, 1e3 * r.worst_unprotected_m);
    if r.threatening == 0 {
        let _ = write!(line, "– | – | – | – | ");
    } else {
        let (n, worst_ms) = (r.threatening, 1e3 * r.worst_time_s);
        let _ = write!(line, "{} / {n} | {worst_ms:.0} | {} / {n} | {} | ", r.in_time, r.harmless, r.missed);
    }
    let _ = write!(line, "{:.0} | {reasons} |", 1e3 * r.worst_excursion_m);
    line
}

/// One line of the comparison of both laws.
#[must_use]
pub fn comparison_line(row: &Row, paper: &Tally, servo: &Tally) -> String {
    let mut line = format!("| {} |", row.label);
    for tally in [paper, servo] {
        let soonest = tally.soonest_s.map_or("–".to_owned(), |after_s| format!("{:.0}", 1e3 * after_s));
        let _ = write!(line, " {soonest} | {:.0} | {:.0} |", 1e3 * tally.furthest_m, 1e3 * tally.beyond_closed_m);
    }
    line
}

/// The head of the comparison.
pub const COMPARISON_HEAD: &str = "| fault | paper's law: soonest, ms | furthest, mm | beyond coasting, mm | positioning law: soonest, ms | furthest, mm | beyond coasting, mm |
| --- | --- | --- | --- | --- | --- | --- |";

/// The table's head.
pub const TABLE_HEAD: &str = "| fault | threatens | unprotected, mm | caught in 20 ms | worst time, ms | kept within 10 mm | missed | protected, mm | safe state reached (runs) |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |";

/// A way of running without fault.
#[derive(Clone, Copy, Debug)]
pub struct Condition {
    /// What the table calls it: how the plant differs from the rig file.
    pub label: &'static str,
    /// The same in numbers.
    pub deviation: Deviation,
    /// Whether the sensors are without noise.
    pub quiet: bool,
}

/// The runs without fault. The deviations are those that a rig file may have: `docs/safety.md`.
pub const CONDITIONS: [Condition; 18] = {
    const fn differs(label: &'static str, deviation: Deviation) -> Condition {
        Condition { label, deviation, quiet: false }
    }
    const FILE: Deviation = Deviation::NONE;
    [
        differs("nothing", FILE),
        Condition { quiet: true, ..differs("nothing", FILE) },
        differs("fill × 1.1, exhaust × 0.9, volumes × 1.05", Deviation::A_TENTH),
        differs("flows × 0.8", Deviation { fill: 0.8, exhaust: 0.8, ..FILE }),
        differs("flows × 1.2", Deviation { fill: 1.2, exhaust: 1.2, ..FILE }),
        differs("fill × 1.2", Deviation { fill: 1.2, ..FILE }),
        differs("exhaust × 1.2", Deviation { exhaust: 1.2, ..FILE }),
        differs("fill × 1.2, exhaust × 0.8", Deviation { fill: 1.2, exhaust: 0.8, ..FILE }),
        differs("fill × 0.8, exhaust × 1.2", Deviation { fill: 0.8, exhaust: 1.2, ..FILE }),
        differs("volumes × 0.95", Deviation { volumes: [0.95; 2], ..FILE }),
        differs("volumes × 1.1", Deviation { volumes: [1.1; 2], ..FILE }),
        differs("volume of A × 0.95, of B × 1.05", Deviation { volumes: [0.95, 1.05], ..FILE }),
        // The default is a real valve's; the board's bench has none.
        differs("no lag", Deviation { lag: 0.0, ..FILE }),
        differs("lag × 1.5", Deviation { lag: 1.5, ..FILE }),
        differs("break-points 63 mV nearer", Deviation { dead_zone: 0.85, ..FILE }),
        differs("break-points 63 mV further", Deviation { dead_zone: 1.15, ..FILE }),
        differs("exponent 1.1", Deviation { exponent: 1.1 / 1.4, ..FILE }),
        differs("mass × 1.5, friction × 2", Deviation { mass: 1.5, friction: 2.0, ..FILE }),
    ]
};

/// Moves of one rig from mid-stroke, m, the last one at full speed.
#[must_use]
pub fn moves_m(rig_name: &str) -> [f64; 4] {
    let far_m = match rig_name {
        "paper-a" => -0.2,
        "paper-b" => 0.2,
        _ => 0.06,
    };
    [0.001, 0.010, 0.045, far_m]
}

/// One move of one rig from rest at mid-stroke, the plant differing from the rig file; otherwise as [`normal_running`].
///
/// # Errors
/// As [`study`].
pub fn one_move(
    rig_name: &'static str,
    law: LawChoice,
    condition: &Condition,
    to_m: f64,
    seed: u64,
) -> Result<(Outcome, f32), TargetError> {
    let mut scenario = sound(rig_name, law, condition, 1.5, seed);
    scenario.reference = vec![ReferenceSegment { at_s: 0.05, position_m: Some(to_m), program: None }];
    without_fault(&scenario)
}

fn sound(rig: &'static str, law: LawChoice, condition: &Condition, duration_s: f64, seed: u64) -> Scenario {
    let situation = Situation { rig, law, phase: 0, seed };
    let mut scenario = scenario(&situation, Fault::new(Kind::HostSilent, None, 0.0), condition.quiet, false);
    scenario.fault.clear();
    scenario.reference.clear();
    Scenario { duration_s, deviation: condition.deviation, ..scenario }
}

fn without_fault(scenario: &Scenario) -> Result<(Outcome, f32), TargetError> {
    let mut target = host_target(scenario)?;
    let outcome = run_observed(scenario, &mut target, |_| ())?;
    Ok((outcome, target.closest_to_disagreement()))
}

/// Normal running of one rig: random moves, ramps and sines over most of the stroke, on a real valve, under a condition.
///
/// Returns the outcome, whose `tripped` must be `None`, and how close the monitor came to a trip, 0 … 1.
///
/// # Errors
/// As [`study`].
pub fn normal_running(
    rig_name: &'static str,
    law: LawChoice,
    condition: &Condition,
    duration_s: f64,
    seed: u64,
) -> Result<(Outcome, f32), TargetError> {
    let mut scenario = sound(rig_name, law, condition, duration_s, seed);
    let half =
        rig::find(rig_name, &scenario.folder).map_err(|error| TargetError(error.to_string()))?.rig.cylinder.stroke_m
            / 2.0;
    let mut random = SmallRng::seed_from_u64(seed);
    let mut at_s = 0.0;
    while at_s < duration_s {
        use control::program::{ProgramParameters, Shape};
        let choice = random.random_range(0..10);
        let program = |shape: Shape, random: &mut SmallRng| {
            let amplitude = half * random.random_range(0.05..0.45);
            Some(ProgramParameters {
                shape,
                centre_m: (half * random.random_range(-0.4..0.4)) as f32,
                amplitude_m: amplitude as f32,
                period_s: random.random_range(0.5..8.0_f32),
            })
        };
        let (program, hold_s) = match choice {
            0 => (program(Shape::Sine, &mut random), 10.0),
            1 => (program(Shape::Ramp, &mut random), 10.0),
            2 => (program(Shape::Step, &mut random), 10.0),
            3 => (None, 20.0),
            _ => (None, random.random_range(0.2..4.0)),
        };
        let position_m = program.is_none().then(|| half * random.random_range(-0.9..0.9));
        scenario.reference.push(ReferenceSegment { at_s, position_m, program });
        at_s += hold_s;
    }
    without_fault(&scenario)
}
