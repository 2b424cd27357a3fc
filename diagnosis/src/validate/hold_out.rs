//! Prediction errors on the part of the log held back: the whole model, restarted from the measured state.

use crate::balances::{chamber, opening, piston, supply};
use crate::constants;
use crate::data::prepare;
use crate::data::record::Record;
use crate::data::smoothing::Smoothed;
use crate::data::split::Stretch;
use crate::estimate::problem::{Fit, Problem};
use crate::outcome::{Gain, HoldOut, Overlay, PerChannel};
use core::cell::OnceCell;
use plant_model::{Inputs, Plant, Side, Simulator, State, Stepper, Tolerance};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::ops::Range;

/// Prediction horizon, s.
pub(crate) const HORIZON_S: f64 = 0.2;
/// Further prediction horizons of the report, s.
pub(crate) const OTHER_HORIZONS_S: [f64; 2] = [0.05, 1.0];

/// The predictions of a fit's model on the part of a log held back.
pub(crate) struct Predictions<'a> {
    record: &'a Record,
    model: Model,
    /// Those over [`HORIZON_S`], made when first asked for.
    nearest: OnceCell<Vec<Window>>,
    /// The rig file as it stands, made when first asked for.
    stated: OnceCell<Option<Model>>,
}

/// The predictions of a window.
struct Window {
    start: usize,
    run_in: usize,
    /// What the model predicts, sample by sample from `start` on.
    predicted: Vec<[f64; 3]>,
    /// For each of the window's rows and each draw of noise: what the sensors of a perfect model show, and what it predicts.
    perfect: Vec<(usize, [[f64; 3]; 2])>,
}

/// The model of a fit, or of the rig file as it stands where there is none. `None` if the log does not hold what a full
/// prediction needs.
fn model(problem: &Problem<'_>, fit: Option<&Fit>) -> Option<Model> {
    let has = problem.record.available;
    if !(has.command && has.pressure_a && has.pressure_b) {
        return None;
    }
    let (plant, supply_sensor_pa) = match fit.map(|fit| (&fit.hypothesis, &fit.hypothesis.values)) {
        None => (Plant::new(&problem.rig.rig, &problem.rig.effects).ok()?, 0.0),
        Some((hypothesis, values)) => (hypothesis.plant(problem.rig, values)?, hypothesis.supply_sensor_pa(values)),
    };
    Some(Model::new(problem.record, plant, supply_sensor_pa))
}

/// Errors of a fit's model on the part held back; `None` if the log does not hold what a full prediction needs, or no
/// prediction of this length fits into that part.
pub(crate) fn errors(problem: &Problem<'_>, fit: &Fit, horizon_s: f64) -> Option<PerChannel> {
    let (record, model) = (problem.record, model(problem, Some(fit))?);
    let predicted = all_windows(record, horizon_s)
        .into_par_iter()
        .map(|[_, run_in, start, end]| (start..end, restarted(record, &model, run_in, start..end)));
    let mut errors = Errors::default();
    for (range, predicted) in predicted.collect::<Vec<_>>() {
        for &at in record.rows_in(range.clone()) {
            errors.add(&measured(record, at), &predicted[at - range.start]);
        }
    }
    (errors.count > 0.0).then(|| errors.rmse())
}

impl<'a> Predictions<'a> {
    /// Of a fit; `None` if the log does not hold what a full prediction needs.
    pub(crate) fn of(problem: &Problem<'a>, fit: &Fit) -> Option<Self> {
        let model = model(problem, Some(fit))?;
        Some(Self { record: problem.record, model, nearest: OnceCell::new(), stated: OnceCell::new() })
    }

    /// Errors beside those of a baseline, another fit or the rig file as it stands, and of a perfect model; `None` if no prediction of
    /// this length fits into what is held back. Up to [`HORIZON_S`] they are the first part of longer ones.
    pub(crate) fn gain(
        &self,
        problem: &Problem<'_>,
        baseline: Option<&Fit>,
        horizon_s: f64,
    ) -> Option<(Gain, Overlay)> {
        let (record, most) = (self.record, rows_within(self.record, horizon_s));
        if most < 2 {
            return None;
        }
        let other = baseline.and_then(|fit| model(problem, Some(fit)));
        let baseline = match baseline {
            Some(_) => other.as_ref()?,
            None => self.stated.get_or_init(|| model(problem, None)).as_ref()?,
        };
        let windows = if horizon_s > HORIZON_S {
            &self.over(horizon_s)
        } else {
            self.nearest.get_or_init(|| self.over(HORIZON_S))
        };
        let beside = |window: &Window| {
            let Window { start, run_in, .. } = *window;
            let rows = record.rows_in(start..start + window.predicted.len());
            let end = rows.iter().take(most).next_back().map_or(start, |last| last + 1);
            (start..end, restarted(record, baseline, run_in, start..end))
        };
        let beside: Vec<_> = windows.par_iter().map(beside).collect();
        let mut nominal = Errors::default();
        let mut by_window = Vec::new();
        let mut overlay = Overlay::default();
        for (window, (range, baseline)) in windows.iter().zip(beside) {
            let mut here = [Errors::default(), Errors::default()];
            let perfect = window.perfect.iter().filter(|(row, _)| range.contains(row));
            perfect.for_each(|(_, [shown, own])| here[1].add(shown, own));
            for &at in record.rows_in(range.clone()) {
                let (k, measured) = (at - range.start, measured(record, at));
                nominal.add(&measured, &baseline[k]);
                here[0].add(&measured, &window.predicted[k]);
                overlay.t_s.push(record.t_s[at]);
                for channel in 0..3 {
                    overlay.measured[channel].push(measured[channel]);
                    overlay.baseline[channel].push(baseline[k][channel]);
                    overlay.extended[channel].push(window.predicted[k][channel]);
                }
            }
            by_window.push(here);
        }
        if nominal.count == 0.0 {
            return None;
        }
        // What a chamber without air shows is no prediction.
        let vented_b = record.available.vented_b;
        let told = |rmse: PerChannel| if vented_b { PerChannel { p_b_pa: None, ..rmse } } else { rmse };
        let [extended, perfect] = joined(&by_window);
        let [baseline_rmse, extended_rmse, noise_floor] = [nominal, extended, perfect].map(|e| told(e.rmse()));
        let [extended, perfect] = without_the_worst(&by_window).map(told);
        let ratios = extended.over(&perfect).map(|ratio| if ratio.is_nan() { f64::INFINITY } else { ratio });
        let worst_ratio = ratios.fold(0.0, f64::max);
        let holdout = HoldOut { baseline_rmse, extended_rmse, noise_floor };
        Some((Gain { holdout, horizon_s, worst_ratio }, overlay))
    }

    /// The predictions over a horizon.
    fn over(&self, horizon_s: f64) -> Vec<Window> {
        let (record, model) = (self.record, &self.model);
        // A fixed seed: the floor of a log is always the same. Drawn in order, predicted side by side.
        let mut noise = Xoshiro256PlusPlus::seed_from_u64(1);
        let drawn = |window: [usize; 4]| {
            let count = constants::noise_floor_draws() * deviates_within(record, window[0]..window[3]);
            (window, StandardNormal.sample_iter(&mut noise).take(count).collect())
        };
        let drawn: Vec<([usize; 4], Vec<f64>)> = all_windows(record, horizon_s).into_iter().map(drawn).collect();
        drawn.into_par_iter().map(|(window, deviates)| Window::of(record, model, window, &deviates)).collect()
    }
}

impl Window {
    /// `deviates`: as many standard normal ones as all draws need.
    fn of(record: &Record, model: &Model, [from, run_in, start, end]: [usize; 4], deviates: &[f64]) -> Self {
        let [later, earlier] = [run_in, from].map(|until| Behind::of(record, &model.plant, until));
        let predicted = predict(record, model, &later, run_in, start, end);
        let alike = model.part(from..end);
        // The noise floor: the model plays the rig. Its predictions of itself still err by the sensors' noise, and by what noise and
        // smoothing leave unknown about the initial state. Where the piston sticks, chance decides much of that.
        let mut perfect = Vec::new();
        for deviates in deviates.chunks(deviates_within(record, from..end).max(1)) {
            let shown = as_if(record, model, &earlier, from..end, deviates);
            let own = predict(&shown, &alike, &later, run_in - from, start - from, end - from);
            let rows = record.rows_in(start..end).iter();
            perfect.extend(rows.map(|row| (*row, [measured(&shown, row - from), own[row - start]])));
        }
        Self { start, run_in, predicted, perfect }
    }
}

/// How many rows a horizon takes.
fn rows_within(record: &Record, horizon_s: f64) -> usize {
    (horizon_s / record.quality.interval_s.max(1.0e-6)) as usize
}

/// What the sensors of position and pressures show.
fn measured(record: &Record, at: usize) -> [f64; 3] {
    [record.y_m[at], record.p_a_pa[at], record.p_b_pa[at]]
}

/// The windows of all that is held back.
fn all_windows(record: &Record, horizon_s: f64) -> Vec<[usize; 4]> {
    let held = record.stretches.iter().filter(|s| s.held_back);
    held.flat_map(|stretch| windows(record, stretch, horizon_s)).collect()
}

/// Where the rows of predictions within a stretch are from, where they run in, begin and end, all of them in rows and none
/// touching an end stop. Smoothing at the run-in's first row reaches back to the first of them, and not as far ahead as the
/// prediction.
fn windows(record: &Record, stretch: &Stretch, horizon_s: f64) -> Vec<[usize; 4]> {
    let interval = record.quality.interval_s.max(1.0e-6);
    let reach = record.velocity_reach().samples(interval).max(2 * record.pressure_reach().samples(interval));
    let run_in = ((constants::run_in_s() / interval) as usize).max(reach + 1);
    let length = rows_within(record, horizon_s);
    // Most of the work is to run in: shorter predictions begin no more often.
    let apart = length.max(rows_within(record, HORIZON_S));
    let rows = record.rows_in(stretch.range());
    let mut out = Vec::new();
    let mut start = reach + run_in;
    while start + length <= rows.len() && length > 1 {
        let (from, end) = (rows[start - run_in - reach], rows[start + length - 1] + 1);
        if !record.at_end[from..end].iter().any(|at_end| *at_end) {
            out.push([from, rows[start - run_in], rows[start], end]);
        }
        start += apart;
    }
    out
}

/// A model with the supply pressure it sees over a recording: as measured, else as the model says.
struct Model {
    plant: Plant<f64>,
    supply_pa: Vec<f64>,
    /// The pressure before any droop, with its drift, where the supply droops.
    source_pa: Vec<f64>,
    /// Warmth of both chambers' air; empty where it is as warm as the supply.
    warmths: [Vec<f64>; 2],
}

impl Model {
    /// The same for a part of the recording.
    fn part(&self, range: core::ops::Range<usize>) -> Self {
        let of = |all: &Vec<f64>| all.get(range.clone()).unwrap_or_default().to_vec();
        let [supply_pa, source_pa] = [&self.supply_pa, &self.source_pa].map(of);
        Self { plant: self.plant, supply_pa, source_pa, warmths: self.warmths.each_ref().map(of) }
    }

    fn new(record: &Record, plant: Plant<f64>, supply_sensor_pa: f64) -> Self {
        let openings = opening::openings(record, &plant);
        let supply = supply::pressures(record, &plant, &openings, supply_sensor_pa);
        let source_pa = if plant.added().supply_droop.droop_pa_s_per_kg > 0.0 && record.available.supply {
            let drift = supply::drifting(record, &plant, (&supply.predicted, supply_sensor_pa)).1;
            drift.off_pa.iter().map(|drift_pa| plant.coefficients().supply_pa + drift_pa).collect()
        } else {
            Vec::new()
        };
        let supply_pa = supply.at_valve;
        let warmths = if plant.added().wall_heat.law.is_some() {
            let of = |side| {
                let air = chamber::Air { openings: openings.of(side), supply_pa: &supply_pa, added_kg_per_s: &[] };
                chamber::warmths(record, &plant, side, air, (0, 0.0), (record.len() - 1, 1))
            };
            [of(Side::A), if plant.area_m2(Side::B) > 0.0 { of(Side::B) } else { Vec::new() }]
        } else {
            Default::default()
        };
        Self { plant, supply_pa, source_pa, warmths }
    }
}

/// A simulator behind the commands of a recording up to a sample: the state of a valve with hysteresis depends on all of them.
struct Behind(Simulator<f64, 256>);

impl Behind {
    fn of(record: &Record, plant: &Plant<f64>, until: usize) -> Self {
        let c = plant.coefficients();
        let state = plant.state_at_rest(0.0, c.supply_pa, c.supply_pa);
        let mut simulator = Simulator::from_state(*plant, state, Stepper::adaptive(&Tolerance::standard()));
        // A play remembers all of them, a delay those that are under way.
        let t_s = &record.t_s;
        let [a_s, b_s] = plant.line_delays_s();
        let sent_before = |t: &f64| t + a_s.max(b_s) < t_s[until];
        let under_way = t_s[..until].partition_point(sent_before).saturating_sub(1);
        let first = if plant.added().valve_hysteresis.half_width_v > 0.0 { 0 } else { under_way };
        for k in first..until {
            simulator.recall(record.u_v[k], record.interval_s(k));
        }
        Self(simulator)
    }

    /// The same in a state.
    fn begin(&self, state: State<f64>) -> Simulator<f64, 256> {
        let mut simulator = self.0.clone();
        simulator.set_state(state);
        simulator
    }
}

/// How many deviates [`as_if`] takes.
fn deviates_within(record: &Record, range: Range<usize>) -> usize {
    let of_row = |k: &usize| 3 + usize::from(record.command_doubt_v.get(*k).is_some());
    record.rows_in(range).iter().map(of_row).sum()
}

/// The recording that the sensors would have made, noise included, if the model were the rig.
fn as_if(record: &Record, model: &Model, behind: &Behind, range: Range<usize>, deviates: &[f64]) -> Record {
    let mut deviates = deviates.iter();
    let mut deviate = || deviates.next().copied().unwrap_or(0.0);
    let mut simulator = behind.begin(measured_state(record, model, range.start));
    let q = &record.quality;
    let mut signals = [(); 3].map(|()| Vec::with_capacity(range.len()));
    let mut unknown_v = 0.0;
    for k in range.clone() {
        let m = simulator.measure();
        let sigmas = [&q.position, &q.pressure_a, &q.pressure_b].map(|channel| channel.standard_deviation);
        if record.is_row(k) {
            for ((signal, value), sigma) in signals.iter_mut().zip([m.y_m, m.p_a_pa, m.p_b_pa]).zip(sigmas) {
                signal.push(value + deviate() * sigma);
            }
        }
        // What the true command was between rows, nobody knows.
        if let Some(doubt_v) = record.command_doubt_v.get(k).filter(|_| record.is_row(k)) {
            unknown_v = deviate() * doubt_v;
        }
        let inputs = inputs(record, model, k);
        simulator.advance_with(&Inputs { u_v: inputs.u_v + unknown_v, ..inputs }, record.interval_s(k));
    }
    prepare::replaced(record, range, signals, &model.plant)
}

/// The state at a sample, as far as the sensors determine it; smoothed over samples on both sides of it.
fn measured_state(record: &Record, model: &Model, k: usize) -> State<f64> {
    let plant = &model.plant;
    // A delayed signal shows a value later than it was true.
    let then = record.moment(k, plant.position_delay_s(), 0..record.len());
    let [y, v] = then.of_each(|k| record.motion_ahead(k, &plant.added().position_lag));
    let v = plant.true_position_m(v) - plant.true_position_m(0.0);
    let sensed = |side, smooth: &Smoothed| plant.pressure_behind_lag_pa(side, smooth.value[k]);
    let truly = |side, smooth: &Smoothed| plant.true_pressure_pa(side, smooth.value[k], smooth.slope[k]);
    let (sensed_a, sensed_b) = (sensed(Side::A, &record.p_a_smooth), sensed(Side::B, &record.p_b_smooth));
    let (p_a, p_b) = (truly(Side::A, &record.p_a_smooth), truly(Side::B, &record.p_b_smooth));
    let mut state = plant.state_at_rest(plant.true_position_m(y), p_a, p_b);
    state.y_sensed_m = plant.true_position_m(then.of(&record.motion.value));
    state.p_a_sensed_pa = sensed_a;
    state.p_b_sensed_pa = sensed_b;
    state.p_sup_pa = model.supply_pa[k];
    [state.warmth_a, state.warmth_b] = [0, 1].map(|side| model.warmths[side].get(k).copied().unwrap_or(0.0));
    with_motion(record, plant, state, v)
}

fn inputs(record: &Record, model: &Model, k: usize) -> Inputs<f64> {
    let c = model.plant.coefficients();
    Inputs {
        u_v: record.u_v[k],
        external_force_n: record.f_ext_n.get(k).copied().unwrap_or(0.0),
        supply_pa: if model.plant.added().supply_droop.droop_pa_s_per_kg > 0.0 {
            model.source_pa.get(k).copied().unwrap_or(c.supply_pa)
        } else {
            model.supply_pa[k]
        },
    }
}

/// [`predict`] over some samples of a recording, behind its own commands.
fn restarted(record: &Record, model: &Model, run_in: usize, samples: Range<usize>) -> Vec<[f64; 3]> {
    predict(record, model, &Behind::of(record, &model.plant, run_in), run_in, samples.start, samples.end)
}

/// Predicts position and pressures, sample by sample from `start` on. The state there is the model's own, run in from `run_in`,
/// corrected by what the rows before `start` show: no row from there on is used.
fn predict(record: &Record, model: &Model, behind: &Behind, run_in: usize, start: usize, end: usize) -> Vec<[f64; 3]> {
    let mut simulator = behind.begin(measured_state(record, model, run_in));
    let (mut behind_y, mut behind_pa) = (Line::default(), [Line::default(); 2]);
    let before = record.rows_in(run_in..start);
    let first = |rows: usize| before.len().checked_sub(rows).map_or(run_in, |place| before[place]);
    let [first_y, first_pa] = restart_rows(record).map(first);
    for k in run_in..start {
        if k >= first_y.min(first_pa) && record.is_row(k) {
            let m = simulator.measure();
            let before_s = record.t_s[k] - record.t_s[start];
            if k >= first_y {
                behind_y.add(before_s, record.y_m[k] - m.y_m);
            }
            if k >= first_pa {
                let errors = [record.p_a_pa[k] - m.p_a_pa, record.p_b_pa[k] - m.p_b_pa];
                behind_pa.iter_mut().zip(errors).for_each(|(line, error)| line.add(before_s, error));
            }
        }
        simulator.advance_with(&inputs(record, model, k), record.interval_s(k));
    }
    let delay_s = model.plant.position_delay_s();
    let (behind_m, drift_m_per_s) = behind_y.at_zero();
    let [behind_a, behind_b] = behind_pa.map(|line| line.mean());
    // What a late position signal still has to tell is extrapolated.
    let now = [behind_m + drift_m_per_s * delay_s, behind_a, behind_b];
    simulator.set_state(corrected(record, model, simulator.state(), (now, drift_m_per_s)));
    let mut out = Vec::with_capacity(end - start);
    for k in start..end {
        let m = simulator.measure();
        let since_s = record.t_s[k] - record.t_s[start];
        // A late position signal first shows what was there before the restart.
        let late = delay_s > 0.0 && since_s < delay_s;
        let y_m = if late { m.y_m + behind_m + drift_m_per_s * since_s } else { m.y_m };
        out.push([y_m, m.p_a_pa, m.p_b_pa]);
        simulator.advance_with(&inputs(record, model, k), record.interval_s(k));
    }
    out
}

/// How many rows before a restart tell by how much the model that ran up to it is behind in position and in pressures.
fn restart_rows(record: &Record) -> [usize; 2] {
    let rows = |seconds: f64| (seconds / record.quality.interval_s.max(1.0e-6)).round() as usize;
    [
        rows(constants::restart_s()).max(constants::least_restart_rows()),
        rows(constants::restart_pressure_s()).max(constants::least_reach()),
    ]
}

/// The state of a model that ran in, moved by what it is behind of the sensors: position and pressures as shown, and how fast
/// the position drifts.
fn corrected(
    record: &Record,
    model: &Model,
    state: &State<f64>,
    ([y_m, p_a_pa, p_b_pa], drift_m_per_s): ([f64; 3], f64),
) -> State<f64> {
    let plant = &model.plant;
    let truly = |shown_m: f64| plant.true_position_m(shown_m) - plant.true_position_m(0.0);
    let pressure =
        |side, shown_pa: f64| plant.pressure_behind_lag_pa(side, shown_pa) - plant.pressure_behind_lag_pa(side, 0.0);
    let (by_a, by_b) = (pressure(Side::A, p_a_pa), pressure(Side::B, p_b_pa));
    let mut out = *state;
    out.y_m += truly(y_m);
    out.y_sensed_m += truly(y_m);
    let v = state.v_m_per_s + truly(drift_m_per_s);
    (out.p_a_pa, out.p_b_pa) = (state.p_a_pa + by_a, state.p_b_pa + by_b);
    (out.p_a_sensed_pa, out.p_b_sensed_pa) = (state.p_a_sensed_pa + by_a, state.p_b_sensed_pa + by_b);
    with_motion(record, plant, out, v)
}

/// A state with a velocity known as well as the sensor tells it.
fn with_motion(record: &Record, plant: &Plant<f64>, mut state: State<f64>, v_m_per_s: f64) -> State<f64> {
    let held_n = || plant.net_force_n(state.y_m, 0.0, state.p_a_pa, state.p_b_pa);
    let at_rest = piston::truly_at_rest_m_per_s(record, plant);
    (state.v_m_per_s, state.z_m) = piston::restarted(at_rest, plant, &State { v_m_per_s, ..state }, held_n);
    state
}

/// A straight line through errors, by least squares.
#[derive(Clone, Copy, Default)]
struct Line {
    count: f64,
    t: f64,
    tt: f64,
    e: f64,
    te: f64,
}

impl Line {
    fn add(&mut self, t_s: f64, error: f64) {
        self.count += 1.0;
        self.t += t_s;
        self.tt += t_s * t_s;
        self.e += error;
        self.te += t_s * error;
    }

    /// The mean of what was added.
    fn mean(&self) -> f64 {
        self.e / self.count.max(1.0)
    }

    /// Its value at time zero and its slope.
    fn at_zero(&self) -> (f64, f64) {
        let spread = self.count * self.tt - self.t * self.t;
        if spread <= 0.0 {
            return (self.mean(), 0.0);
        }
        let slope = (self.count * self.te - self.t * self.e) / spread;
        ((self.e - slope * self.t) / self.count, slope)
    }
}

#[derive(Clone, Copy, Default)]
struct Errors {
    squares: [f64; 3],
    count: f64,
}

impl Errors {
    fn add(&mut self, measured: &[f64; 3], predicted: &[f64; 3]) {
        for channel in 0..3 {
            self.squares[channel] += (measured[channel] - predicted[channel]).powi(2);
        }
        self.count += 1.0;
    }

    fn join(&mut self, other: &Self) {
        self.squares.iter_mut().zip(other.squares).for_each(|(sum, square)| *sum += square);
        self.count += other.count;
    }

    /// Mean square in one channel.
    fn mean_square(&self, channel: usize) -> f64 {
        self.squares[channel] / self.count.max(1.0)
    }

    fn rmse(&self) -> PerChannel {
        let [y, a, b] = [0, 1, 2].map(|channel| Some(self.mean_square(channel).sqrt()));
        PerChannel { y_m: y, p_a_pa: a, p_b_pa: b }
    }
}

/// Errors of predictions and of perfect ones in several windows together.
fn joined<'a>(windows: impl IntoIterator<Item = &'a [Errors; 2]>) -> [Errors; 2] {
    let mut sums = [Errors::default(), Errors::default()];
    for window in windows {
        sums.iter_mut().zip(window).for_each(|(sum, errors)| sum.join(errors));
    }
    sums
}

/// Root mean squares of predictions and of perfect ones, without those windows, one in [`constants::chance_predictions`], in which the prediction errs most beyond
/// the perfect one: in each channel for itself.
fn without_the_worst(windows: &[[Errors; 2]]) -> [PerChannel; 2] {
    let kept = windows.len() - windows.len() / constants::chance_predictions();
    let of = |channel: usize| {
        let beyond = |[own, perfect]: &[Errors; 2]| {
            let beyond = own.mean_square(channel) - perfect.mean_square(channel);
            // What predicts nothing is never left out.
            if beyond.is_nan() { f64::NEG_INFINITY } else { beyond }
        };
        let mut sorted: Vec<&[Errors; 2]> = windows.iter().collect();
        sorted.sort_by(|one, other| beyond(one).total_cmp(&beyond(other)));
        joined(sorted.into_iter().take(kept)).map(|sum| sum.mean_square(channel).sqrt())
    };
    let [y, a, b] = [0, 1, 2].map(of);
    [0, 1].map(|k| PerChannel { y_m: Some(y[k]), p_a_pa: Some(a[k]), p_b_pa: Some(b[k]) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Windows with a mean square of one for predictions and perfect ones alike.
    fn alike(count: usize) -> Vec<[Errors; 2]> {
        vec![[Errors { squares: [1.0; 3], count: 1.0 }; 2]; count]
    }

    #[test]
    fn one_window_of_twenty_may_be_chance_two_are_not_and_no_prediction_is_none() {
        let position = |windows: &[[Errors; 2]]| without_the_worst(windows).map(|rmse| rmse.y_m.expect("measured"));
        let mut windows = alike(20);
        windows[7][0].squares[0] = 100.0;
        assert_eq!(position(&windows), [1.0, 1.0]);
        // The other channels leave out a window of their own.
        windows[3][0].squares[1] = 50.0;
        assert_eq!(without_the_worst(&windows)[0], PerChannel { y_m: Some(1.0), p_a_pa: Some(1.0), p_b_pa: Some(1.0) });
        windows[3][0].squares[0] = 50.0;
        assert!(position(&windows)[0] > 1.8);
        windows[3][0].squares[0] = f64::NAN;
        assert!(position(&windows)[0].is_nan());
        let mut few = alike(19);
        few[0][0].squares[0] = 100.0;
        assert!(position(&few)[0] > 2.0);
    }
}
