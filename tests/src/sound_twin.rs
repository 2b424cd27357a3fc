//! Could a sound rig have given these readings? The *sound twin* of a faulty run is a rig on which every sensor is right: its
//! piston is where the position sensor says, pushed there by a force from outside that is free in time, and its chambers obey
//! the plant's equations under the same command. What the model monitor has to allow of flow and null is free ([`Freedom`]),
//! and so are both pressures at the beginning.
//!
//! Fitted by least squares, the twin leaves residuals in both pressures. Where they are no more than the sensors' noise, nothing
//! in the readings tells the fault from the twin's load.

use crate::runner::{Sample, host_target, run_observed};
use crate::scenario::Scenario;
use crate::target::TargetError;
use control::Mode;
use nalgebra::{DMatrix, DVector};
use plant_model::valve_flow::Opening;
use plant_model::{Plant, Side};
use plant_sim::CodeNoise;
use rig_files::RigFile;
use std::collections::VecDeque;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};
use std::ops::Range;

/// Steps of the integration in a tick: the spool's lag is not much longer than one.
const STEPS: usize = 4;

/// What of the twin is free beside the force on the piston and the pressures at the beginning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// A factor for each of the valve's four paths, and its null: five constants.
    Constants,
    /// In place of each factor a function of opening and pressure, as for another opening curve or flow law; and for each chamber
    /// its volume at mid-stroke and the exponent of its compression, as for air that exchanges heat with the walls.
    Functions,
    /// Flow, compression and null different in every tick and in each chamber: more than any rig does, and all that the monitor
    /// allows.
    Anything,
}

/// The monitor's tolerance of flow and compression.
pub const FLOW: f64 = 0.2;
/// Its tolerance of the valve's null, V.
pub const NULL_V: f64 = 0.025;

/// What a volume at mid-stroke may be off by: the monitor has no tolerance of its own for it.
const VOLUME: f64 = 0.05;

/// Points of the functions along the opening, from closed to wide open, and along the pressure, from atmosphere to supply.
const OPENINGS: usize = 4;
const PRESSURES: usize = 3;

impl Freedom {
    /// Numbers for each path.
    fn points(self) -> usize {
        if self == Self::Functions { OPENINGS * PRESSURES } else { 1 }
    }

    /// Range and step of the numerical derivative of each fitted number: the paths (A filled, A exhausted, B filled, B exhausted),
    /// null, volumes of A and B and exponents of A and B as factors, pressures of A and B at the beginning.
    fn ranges(self) -> Vec<([f64; 2], f64)> {
        let mut all = vec![([1.0 - FLOW, 1.0 + FLOW], 1.0e-3); 4 * self.points()];
        all.push(([-NULL_V, NULL_V], 2.0e-4));
        for tolerance in [VOLUME, FLOW] {
            let free = if self == Self::Functions { tolerance } else { 0.0 };
            all.extend([([1.0 - free, 1.0 + free], 1.0e-3); 2]);
        }
        all.extend([([1.0, f64::INFINITY], 100.0); 2]);
        all
    }
}

/// Where the search begins: the valve's null bends the residuals, so one start may end in a side valley.
const NULLS_V: [f64; 3] = [0.0, -0.015, 0.015];

/// Lengths of the running means that are tested, ticks.
const LENGTHS: [usize; 7] = [3, 5, 10, 20, 50, 100, 200];

/// Standard deviations that a running mean may be off. Nine hours at 1 kHz have 3.2e7 ticks, each with seven lengths of four
/// sums. Beyond 6.1 on either side lies 1.1e-9 of a normal distribution: less than one false alarm, counted as if all these
/// were independent.
pub const LIMIT: f64 = 6.1;

/// The readings of a run, in SI, one of each per tick.
#[derive(Clone, Debug, Default)]
pub struct Log {
    position_m: Vec<f64>,
    pressure_pa: [Vec<f64>; 2],
    supply_pa: Vec<f64>,
    /// What the DAC was given in this tick, V.
    written_v: Vec<f64>,
    /// The tick in which the safe state was reached.
    pub tripped: Option<usize>,
}

impl Log {
    /// The log of a scenario, run on the firmware's own loop.
    ///
    /// # Errors
    /// Those of [`run_observed`].
    pub fn of(scenario: &Scenario) -> Result<Self, TargetError> {
        let rig = scenario.rig_file().map_err(|error| TargetError(error.to_string()))?;
        let mut log = Self::default();
        run_observed(scenario, &mut host_target(scenario)?, |sample| log.push(&rig, sample))?;
        Ok(log)
    }

    fn push(&mut self, rig: &RigFile, sample: &Sample) {
        let [y, a, b, supply] = sample.codes.map(u32::from);
        if self.tripped.is_none() && matches!(sample.mode, Mode::Safe(_)) {
            self.tripped = Some(self.position_m.len());
        }
        self.position_m.push(rig.io.position().quantity(y));
        self.pressure_pa[0].push(rig.io.pressure().quantity(a));
        self.pressure_pa[1].push(rig.io.pressure().quantity(b));
        self.supply_pa.push(rig.io.pressure().quantity(supply));
        self.written_v.push(rig.io.valve().quantity(u32::from(sample.dac)));
    }
}

/// A signal without its noise: at each sample the parabola through the widest window of neighbours that it fits within the
/// noise. Without noise the signal itself.
fn smooth(signal: &[f64], noise: f64) -> Vec<f64> {
    const HALF_WIDTHS: [usize; 6] = [20, 14, 9, 6, 4, 2];
    if noise <= 0.0 {
        return signal.to_vec();
    }
    let value = |n: usize| {
        for half in HALF_WIDTHS {
            let window = n.saturating_sub(half)..(n + half + 1).min(signal.len());
            let (at_n, squares) = parabola(signal, window.clone(), n);
            let free = window.len().saturating_sub(3) as f64;
            // Three standard deviations of a chi-squared sum.
            if free >= 1.0 && squares / (noise * noise) < free + 3.0 * (2.0 * free).sqrt() {
                return at_n;
            }
        }
        signal[n]
    };
    (0..signal.len()).map(value).collect()
}

/// The value at `n` of the parabola through a window, and the sum of squared residuals.
fn parabola(signal: &[f64], window: Range<usize>, n: usize) -> (f64, f64) {
    let x = |k: usize| k as f64 - n as f64;
    let mut normal = vec![vec![0.0; 3]; 3];
    let mut right = vec![0.0; 3];
    for k in window.clone() {
        let row = [1.0, x(k), x(k) * x(k)];
        for i in 0..3 {
            right[i] += row[i] * signal[k];
            for j in 0..3 {
                normal[i][j] += row[i] * row[j];
            }
        }
    }
    let Some(c) = solve(&normal, right) else { return (signal[n], f64::INFINITY) };
    let squares = window.map(|k| (signal[k] - c[0] - x(k) * (c[1] + x(k) * c[2])).powi(2)).sum();
    (c[0], squares)
}

/// The solution of a system of linear equations, given by rows; `None` if it is singular.
fn solve(matrix: &[Vec<f64>], right: Vec<f64>) -> Option<Vec<f64>> {
    let size = right.len();
    let matrix = DMatrix::from_fn(size, size, |row, column| matrix[row][column]);
    Some(matrix.lu().solve(&DVector::from_vec(right))?.as_slice().to_vec())
}

/// A chamber at one moment.
#[derive(Clone, Copy)]
struct Air {
    pressure_pa: f64,
    y_m: f64,
    grows_m_per_s: f64,
    exponent: f64,
    volume_m3: f64,
    supply_pa: f64,
}

/// Everything of the twin that does not depend on the fitted constants.
pub struct Twin {
    plant: Plant<f64>,
    freedom: Freedom,
    tick_s: f64,
    y_m: Vec<f64>,
    supply_pa: Vec<f64>,
    measured_pa: [Vec<f64>; 2],
    /// The same without noise.
    smoothed_pa: [Vec<f64>; 2],
    /// The spool in the middle of each step of each interval, V, its null not counted.
    spool_v: Vec<[f64; STEPS]>,
}

/// A fitted twin over a window.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The fitted numbers, in the order of [`Freedom`]'s ranges; none where anything is free.
    numbers: Vec<f64>,
    /// Measured minus predicted pressures of A and B, Pa, one per tick of the window.
    residual_pa: [Vec<f64>; 2],
    cost: f64,
}

impl Twin {
    /// The twin that the first `ticks` readings ask for. Readings of `quiet` sensors are taken as they are.
    ///
    /// # Errors
    /// The rig is refused by the plant.
    pub fn new(rig: &RigFile, freedom: Freedom, log: &Log, ticks: usize, quiet: bool) -> Result<Self, String> {
        let plant = Plant::new(&rig.rig, &rig.effects).map_err(|error| error.to_string())?;
        let tick_s = rig.io.tick_s();
        let step_s = tick_s / STEPS as f64;
        let lag_s = plant.added().valve_lag.time_constant_s;
        let hysteresis = plant.added().valve_hysteresis;
        let (mut spool, mut played) = (0.0, 0.0);
        let spool_v = (0..ticks)
            .map(|n| {
                // Latched a tick late; before the first code mid position.
                let written_v = n.checked_sub(1).map_or(0.0, |before| log.written_v[before]);
                played = hysteresis.play(played, written_v);
                let mut middle = [0.0; STEPS];
                for v in &mut middle {
                    *v = played + (spool - played) * (-0.5 * step_s / lag_s).exp();
                    spool = played + (spool - played) * (-step_s / lag_s).exp();
                }
                middle
            })
            .collect();
        let noise = if quiet { CodeNoise::NONE } else { CodeNoise::default() };
        let measured_pa = [0, 1].map(|side: usize| log.pressure_pa[side][..ticks].to_vec());
        Ok(Self {
            plant,
            freedom,
            tick_s,
            y_m: smooth(&log.position_m[..ticks], noise.position_m),
            supply_pa: smooth(&log.supply_pa[..ticks], noise.pressure_pa),
            smoothed_pa: [0, 1].map(|side: usize| smooth(&measured_pa[side], noise.pressure_pa)),
            measured_pa,
            spool_v,
        })
    }

    /// Rate of a chamber's pressure, Pa/s, with an opening and a factor on its flow.
    fn rate(&self, side: Side, opening: &Opening<f64>, factor: impl Fn(usize, f64, f64) -> f64, air: &Air) -> f64 {
        let filling = opening.fills_a == (side == Side::A);
        let path = 2 * usize::from(side == Side::B) + usize::from(!filling);
        let p = air.pressure_pa;
        let magnitude = opening.through(filling);
        let flow = self.plant.valve_inflow(side, air.y_m, filling, magnitude, p, air.supply_pa).mass_flow;
        let area = self.plant.area_m2(side);
        let by_flow = self.plant.energy_j_per_kg() * factor(path, magnitude, p) * flow;
        (by_flow - air.exponent * p * area * air.grows_m_per_s) / air.volume_m3
    }

    /// The factor on a path's flow at an opening and a pressure.
    fn factor(&self, numbers: &[f64], path: usize, opening: f64, p: f64) -> f64 {
        let points = self.freedom.points();
        let table = &numbers[path * points..(path + 1) * points];
        if points == 1 {
            return table[0];
        }
        let m = self.plant.coefficients();
        let place = |share: f64, count: usize| {
            let x = share.clamp(0.0, 1.0) * (count - 1) as f64;
            let low = (x as usize).min(count - 2);
            (low, x - low as f64)
        };
        let (i, u) = place(opening / FRAC_PI_2, OPENINGS);
        let (j, v) = place((p - m.atmosphere_pa) / (m.supply_pa - m.atmosphere_pa), PRESSURES);
        let at = |i: usize, j: usize| table[i * PRESSURES + j];
        (1.0 - u) * ((1.0 - v) * at(i, j) + v * at(i, j + 1)) + u * ((1.0 - v) * at(i + 1, j) + v * at(i + 1, j + 1))
    }

    /// A chamber's surroundings between two readings; its pressure is to be filled in.
    fn air(&self, side: Side, n: usize, part: f64, volume_factor: f64, exponent_factor: f64) -> Air {
        let between = |x: &[f64]| x[n] + (x[n + 1] - x[n]) * part;
        let (y_m, v) = (between(&self.y_m), (self.y_m[n + 1] - self.y_m[n]) / self.tick_s);
        let chamber = |(a, b): (f64, f64)| if side == Side::A { a } else { b };
        let (volume, middle) = (chamber(self.plant.volumes_m3(y_m)), chamber(self.plant.volumes_m3(0.0)));
        Air {
            pressure_pa: 0.0,
            y_m,
            grows_m_per_s: chamber((v, -v)),
            exponent: exponent_factor * self.plant.coefficients().exponent,
            volume_m3: volume + (volume_factor - 1.0) * middle,
            supply_pa: between(&self.supply_pa),
        }
    }

    /// The valve's opening in each step of a window.
    fn openings(&self, window: &Range<usize>, null_v: f64) -> Vec<Opening<f64>> {
        self.spool_v[window.clone()].iter().flatten().map(|spool_v| self.plant.opening(spool_v + null_v)).collect()
    }

    /// Measured minus predicted pressure of a chamber over a window, Pa.
    fn residual_pa(&self, window: &Range<usize>, side: Side, openings: &[Opening<f64>], numbers: &[f64]) -> Vec<f64> {
        let step_s = self.tick_s / STEPS as f64;
        let k = usize::from(side == Side::B);
        let of_chamber = &numbers[4 * self.freedom.points() + 1..];
        let (volume, exponent, mut p) = (of_chamber[k], of_chamber[2 + k], of_chamber[4 + k]);
        let factor = |path: usize, opening: f64, p: f64| self.factor(numbers, path, opening, p);
        let measured = &self.measured_pa[k];
        let mut out = vec![measured[window.start] - p];
        let mut openings = openings.iter();
        for n in window.start..window.end - 1 {
            for (step, opening) in openings.by_ref().take(STEPS).enumerate() {
                let mut air = self.air(side, n, (step as f64 + 0.5) / STEPS as f64, volume, exponent);
                air.pressure_pa = p;
                // The midpoint rule.
                air.pressure_pa = p + 0.5 * step_s * self.rate(side, opening, factor, &air);
                p += step_s * self.rate(side, opening, factor, &air);
            }
            out.push(measured[n + 1] - p);
        }
        out
    }

    fn evaluate(&self, window: &Range<usize>, numbers: Vec<f64>) -> Fit {
        let openings = self.openings(window, numbers[4 * self.freedom.points()]);
        let residual_pa = [Side::A, Side::B].map(|side| self.residual_pa(window, side, &openings, &numbers));
        let cost = residual_pa.iter().flatten().map(|r| r * r).sum();
        Fit { numbers, residual_pa, cost }
    }

    /// How the residuals of A and of B change with each number, per step of its numerical derivative; none where they do not.
    fn columns(&self, window: &Range<usize>, fit: &Fit, ranges: &[([f64; 2], f64)]) -> Vec<[Vec<f64>; 2]> {
        let null = 4 * self.freedom.points();
        let openings = self.openings(window, fit.numbers[null]);
        let column = |(k, (bounds, difference)): (usize, &([f64; 2], f64))| {
            let mut moved = fit.numbers.clone();
            // Away from the bound that is near.
            let sign = if moved[k] + difference > bounds[1] { -1.0 } else { 1.0 };
            moved[k] += sign * difference;
            let concerns = |side: usize| match k {
                k if k < null => k / (null / 2) == side,
                k if k == null => true,
                k => (k - null - 1) % 2 == side,
            };
            let others = (k == null).then(|| self.openings(window, moved[null]));
            [Side::A, Side::B].map(|side| {
                let of = usize::from(side == Side::B);
                if !concerns(of) || bounds[0] == bounds[1] {
                    return Vec::new();
                }
                let there = self.residual_pa(window, side, others.as_ref().unwrap_or(&openings), &moved);
                there.iter().zip(&fit.residual_pa[of]).map(|(r, r0)| sign * (r - r0)).collect()
            })
        };
        ranges.iter().enumerate().map(column).collect()
    }

    /// The best twin over a window.
    #[must_use]
    pub fn fit(&self, window: &Range<usize>) -> Fit {
        if self.freedom == Freedom::Anything {
            return self.nearest_course(window);
        }
        let first = [0, 1].map(|side: usize| {
            let few = &self.measured_pa[side][window.start..(window.start + 5).min(window.end)];
            few.iter().sum::<f64>() / few.len() as f64
        });
        let fits = NULLS_V.map(|null_v| {
            let mut start = vec![1.0; 4 * self.freedom.points()];
            start.extend([null_v, 1.0, 1.0, 1.0, 1.0, first[0], first[1]]);
            self.fit_from(window, start)
        });
        fits.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).expect("three fits")
    }

    /// Levenberg's and Marquardt's method within the bounds: a number that is pushed against its bound stays there for the step.
    fn fit_from(&self, window: &Range<usize>, start: Vec<f64>) -> Fit {
        let ranges = self.freedom.ranges();
        let mut best = self.evaluate(window, start);
        let mut damping = 1.0e-3;
        for _ in 0..100 {
            let columns = self.columns(window, &best, &ranges);
            let product = |a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]| {
                let of = |side: usize| a[side].iter().zip(&b[side]).map(|(x, y)| x * y).sum::<f64>();
                of(0) + of(1)
            };
            let slope: Vec<f64> = columns.iter().map(|column| -product(column, &best.residual_pa)).collect();
            let at_bound = |k: usize| {
                let bounds = ranges[k].0;
                bounds[0] == bounds[1] || (best.numbers[k] - bounds[usize::from(slope[k] > 0.0)]).abs() < 1.0e-12
            };
            let free: Vec<usize> = (0..ranges.len()).filter(|&k| !at_bound(k)).collect();
            let matrix: Vec<Vec<f64>> =
                free.iter().map(|&i| free.iter().map(|&j| product(&columns[i], &columns[j])).collect()).collect();
            let mut improved = false;
            while damping < 1.0e8 {
                let mut damped = matrix.clone();
                for (i, row) in damped.iter_mut().enumerate() {
                    // A path that the window never opens leaves its column empty.
                    row[i] += damping * row[i] + 1.0e-6;
                }
                let right = free.iter().map(|&k| slope[k]).collect();
                let Some(step) = solve(&damped, right) else { break };
                let mut next = best.numbers.clone();
                for (&k, by) in free.iter().zip(step) {
                    let (bounds, difference) = ranges[k];
                    next[k] = (next[k] + by * difference).clamp(bounds[0], bounds[1]);
                }
                let tried = self.evaluate(window, next);
                if tried.cost < best.cost {
                    improved = best.cost - tried.cost > 1.0e-6 * best.cost;
                    (best, damping) = (tried, damping * 0.2);
                    break;
                }
                damping *= 5.0;
            }
            if !improved {
                break;
            }
        }
        best
    }

    /// Of all courses of pressure that flow and null can make within their bounds, the one nearest to the readings: dynamic
    /// programming over its distance from the smoothed readings.
    fn nearest_course(&self, window: &Range<usize>) -> Fit {
        const GRID_PA: f64 = 50.0;
        const HALF: usize = 400;
        let residual_pa = [Side::A, Side::B].map(|side| {
            let k = usize::from(side == Side::B);
            let (smooth, measured) = (&self.smoothed_pa[k], &self.measured_pa[k]);
            let price =
                |n: usize, state: usize| (measured[n] - smooth[n] - (state as f64 - HALF as f64) * GRID_PA).powi(2);
            let mut cost: Vec<f64> = (0..=2 * HALF).map(|state| price(window.start, state)).collect();
            let mut came_from: Vec<Vec<u16>> = Vec::new();
            // What rounding to the grid left over, so that it does not add up.
            let mut carry = [0.0; 2];
            for n in window.start..window.end - 1 {
                let [low, high] = self.reach(side, n, smooth[n]);
                let turn = smooth[n + 1] - smooth[n];
                let steps = [low - turn, high - turn].map(|pa| pa / GRID_PA);
                let whole = [0, 1].map(|i: usize| {
                    let wanted = steps[i] + carry[i];
                    carry[i] = wanted - wanted.round();
                    wanted.round() as isize
                });
                let last = 2 * HALF as isize;
                let mut queue = VecDeque::new();
                let mut next = vec![0.0; cost.len()];
                let mut origin = vec![0_u16; cost.len()];
                let mut taken = 0;
                for state in 0..=last {
                    // From whence it can be reached: beyond the grid's ends counts as its ends.
                    let from = (state - whole[1]).clamp(0, last);
                    let to = (state - whole[0].min(whole[1])).clamp(0, last);
                    while taken <= to {
                        let c = cost[taken as usize];
                        while queue.back().is_some_and(|&at: &isize| cost[at as usize] >= c) {
                            queue.pop_back();
                        }
                        queue.push_back(taken);
                        taken += 1;
                    }
                    while queue.front().is_some_and(|&at| at < from) {
                        queue.pop_front();
                    }
                    let best = queue.front().copied().unwrap_or(to);
                    origin[state as usize] = best as u16;
                    next[state as usize] = cost[best as usize] + price(n + 1, state as usize);
                }
                cost = next;
                came_from.push(origin);
            }
            let mut state = (0..cost.len()).min_by(|&i, &j| cost[i].total_cmp(&cost[j])).expect("a state");
            let mut residual = Vec::new();
            for n in window.clone().rev() {
                residual.push(measured[n] - smooth[n] - (state as f64 - HALF as f64) * GRID_PA);
                if n > window.start {
                    state = usize::from(came_from[n - 1 - window.start][state]);
                }
            }
            residual.reverse();
            residual
        });
        let cost = residual_pa.iter().flatten().map(|r| r * r).sum();
        Fit { numbers: Vec::new(), residual_pa, cost }
    }

    /// Least and most that a chamber's pressure may change in the tick from `n` on, Pa.
    fn reach(&self, side: Side, n: usize, p: f64) -> [f64; 2] {
        const LOW: f64 = 1.0 - FLOW;
        const HIGH: f64 = 1.0 + FLOW;
        const ENDS: [(f64, f64); 4] = [(LOW, LOW), (LOW, HIGH), (HIGH, LOW), (HIGH, HIGH)];
        let mut out = [0.0; 2];
        for (step, spool_v) in self.spool_v[n].iter().enumerate() {
            let mut air = self.air(side, n, (step as f64 + 0.5) / STEPS as f64, 1.0, 1.0);
            air.pressure_pa = p;
            let mut range = [f64::INFINITY, f64::NEG_INFINITY];
            for null_v in [-NULL_V, 0.0, NULL_V] {
                let opening = self.plant.opening(spool_v + null_v);
                for (flow, compression) in ENDS {
                    let air = Air { exponent: air.exponent * compression, ..air };
                    let rate = self.rate(side, &opening, |_, _, _| flow, &air);
                    range = [range[0].min(rate), range[1].max(rate)];
                }
            }
            for (sum, rate) in out.iter_mut().zip(range) {
                *sum += rate * self.tick_s / STEPS as f64;
            }
        }
        out
    }

    /// The first of some ticks at which the readings from `start` up to it leave a running mean of residuals beyond [`LIMIT`], the
    /// twin being fitted to them anew each time.
    #[must_use]
    pub fn first_alarm(&self, start: usize, ticks: impl IntoIterator<Item = usize>) -> Option<usize> {
        let mut last: Option<Fit> = None;
        for n in ticks {
            let window = start..n + 1;
            let from_last = match last.take() {
                Some(fit) if self.freedom != Freedom::Anything => self.fit_from(&window, fit.numbers),
                _ => self.fit(&window),
            };
            last = Some(from_last.clone());
            // No alarm for a search that ended in a side valley.
            if from_last.largest_mean(1) > LIMIT && self.fit(&window).largest_mean(1) > LIMIT {
                return Some(n);
            }
        }
        None
    }

    /// The force from outside that moves the piston as it is read, in means over `length` ticks: the largest of a range, by
    /// magnitude, and the last, N. A piston slower than 10 mm/s may be held by as much as the Coulomb force either way.
    #[must_use]
    pub fn outer_force_n(&self, range: Range<usize>, length: usize) -> [f64; 2] {
        let m = self.plant.coefficients();
        let span_s = length as f64 * self.tick_s;
        let mut out = [0.0_f64, 0.0];
        for n in range.start..range.end - length {
            let (before, after) = (n - length, n + length);
            let acceleration = (self.y_m[after] - 2.0 * self.y_m[n] + self.y_m[before]) / (span_s * span_s);
            let v = (self.y_m[after] - self.y_m[before]) / (2.0 * span_s);
            // The second difference weighs the acceleration by a triangle; so the force.
            let mean = |side: usize| {
                let weight = |k: usize| (length as f64 - (k as f64 - n as f64).abs()) / (length * length) as f64;
                (before..=after).map(|k| weight(k) * self.smoothed_pa[side][k]).sum::<f64>()
            };
            let net = self.plant.net_force_n(self.y_m[n], v, mean(0), mean(1));
            let needed = m.mass_kg * acceleration - net;
            let outer = if v.abs() < 0.01 {
                needed.signum() * (needed.abs() - m.coulomb_n).max(0.0)
            } else {
                needed + v.signum() * m.coulomb_n + m.viscous * v
            };
            if outer.abs() > out[0].abs() {
                out[0] = outer;
            }
            out[1] = outer;
        }
        out
    }

    /// The piston's force at full supply pressure, N, and the Coulomb friction, N.
    #[must_use]
    pub fn forces_n(&self) -> [f64; 2] {
        let m = self.plant.coefficients();
        [m.area_a_m2 * (m.supply_pa - m.atmosphere_pa), m.coulomb_n]
    }
}

impl Fit {
    /// Root mean square of the last `ticks` residuals of both chambers in standard deviations of the noise.
    #[must_use]
    pub fn rms(&self, ticks: usize) -> f64 {
        let last = |r: &Vec<f64>| r[r.len().saturating_sub(ticks)..].to_vec();
        let all: Vec<f64> = self.residual_pa.iter().flat_map(last).collect();
        (all.iter().map(|r| r * r).sum::<f64>() / all.len() as f64).sqrt() / CodeNoise::default().pressure_pa
    }

    /// The largest running mean of A, of B, of their sum and of their difference that ends in the last `ticks`, in its
    /// standard deviations.
    #[must_use]
    pub fn largest_mean(&self, ticks: usize) -> f64 {
        let [a, b] = &self.residual_pa;
        let mut largest = 0.0_f64;
        let ends = (a.len() + 1).saturating_sub(ticks)..a.len() + 1;
        for length in LENGTHS {
            for end in ends.clone().filter(|&end| end >= length) {
                let sum = |r: &[f64]| r[end - length..end].iter().sum::<f64>();
                let scale = 1.0 / (CodeNoise::default().pressure_pa * (length as f64).sqrt());
                let (a, b) = (sum(a) * scale, sum(b) * scale);
                let both = [a, b, (a + b) * FRAC_1_SQRT_2, (a - b) * FRAC_1_SQRT_2];
                largest = both.into_iter().fold(largest, |most, x| most.max(x.abs()));
            }
        }
        largest
    }
}
