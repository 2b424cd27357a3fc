//! The log made ready: usable samples, uninterrupted stretches, the part held back, noise levels, smoothed signals.

use crate::balance::motion;
use crate::balance::motion::velocity_error;
use crate::noise::{self, ChannelNoise, NUMERICAL_ERROR_PA};
use crate::smooth::{Smoothed, parabola, slopes};
use core::ops::Range;
use plant_model::{MINIMUM_VOLUME_RATIO, Rig};
use rig_files::{Log, RigFile};
use serde::Serialize;

/// Samples on either side when smoothing position for chamber volumes.
const VOLUME_REACH: usize = 7;
/// Samples on either side when smoothing position for velocity.
const VELOCITY_REACH: usize = 15;
/// Samples on either side when smoothing pressures for forces, in each of two passes.
const PRESSURE_REACH: usize = 9;
/// A step of time this many times the usual one interrupts the log.
const INTERRUPTION: f64 = 2.5;
/// The command has gone through a play of any likely half-width once it has changed by twice this, V.
const LARGEST_PLAY_V: f64 = 0.2;
/// What happened before the log is forgotten after this long, s, but for a play; all counts as known after this part of
/// the log.
const FORGOTTEN_S: f64 = 0.5;
const LONGEST_UNKNOWN: f64 = 0.1;
/// The log is cut into about this many chunks; every `HELD_BACK_EVERY`-th is held back.
const CHUNKS: usize = 16;
const HELD_BACK_EVERY: usize = 4;
/// Smoothed position errors are alike over about this many samples, which a fit bundles into one.
const SAMPLES_ALIKE: f64 = 4.0;
/// After leaving an end stop the force balance needs this long to settle, s.
const END_LASTING_S: f64 = 0.1;
/// Stretches shorter than this say nothing, s.
pub(crate) const SHORTEST_STRETCH_S: f64 = 0.3;

/// A chamber smaller than this many tolerances of its volume at mid stroke may as well be closed: what its pressure does is
/// anyone's guess.
const UNKNOWN_VOLUME: f64 = 3.0;
/// A piston that rests against this many times its static friction leans on an end stop, if its position reads no farther
/// than this part of half the stroke from there.
const LEANING: f64 = 3.0;
const NEAR_END: f64 = 0.15;
/// Fewer samples against a stop tell nothing of where it is.
const LEAST_LEANING: usize = 50;

/// A reading that repeats the log's lowest or highest value often enough in a row is at the sensor's limit, if noise would
/// else have moved it.
struct Railed {
    /// Samples in a row.
    in_a_row: usize,
    /// Least noise, in smallest steps.
    moved_by: f64,
}
/// Noise below this part of a signal's range is none: such a signal repeats itself wherever it rests.
const LEAST_NOISE: f64 = 1.0e-5;
const RAILED_POSITION: Railed = Railed { in_a_row: 20, moved_by: 0.6 };
/// Pressures peak for a moment only.
const RAILED_PRESSURE: Railed = Railed { in_a_row: 8, moved_by: 1.5 };

/// Consecutive samples without interruption, all for fitting or all held back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stretch {
    pub(crate) start: usize,
    pub(crate) end: usize,
    pub(crate) held_back: bool,
}

impl Stretch {
    pub(crate) fn range(&self) -> Range<usize> {
        self.start..self.end
    }
}

/// A moment between two samples.
#[derive(Clone, Copy)]
pub(crate) struct Moment {
    low: usize,
    high: usize,
    /// Part of the way from one to the other.
    part: f64,
}

impl Moment {
    /// A signal then, linear between the samples.
    pub(crate) fn of(&self, signal: &[f64]) -> f64 {
        signal[self.low] + (signal[self.high] - signal[self.low]) * self.part
    }
}

/// What was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Available {
    /// The valve command.
    pub command: bool,
    /// Pressure of chamber A.
    pub pressure_a: bool,
    /// Pressure of chamber B.
    pub pressure_b: bool,
    /// Supply pressure.
    pub supply: bool,
    /// External force.
    pub force: bool,
}

/// Sampling and noise, as found in the log.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Quality {
    /// Number of usable samples.
    pub samples: usize,
    /// Rows left out because a measured column was blank.
    pub blank_rows: usize,
    /// Interruptions (missing rows), not bridged.
    pub interruptions: usize,
    /// Usual sampling interval, s.
    pub interval_s: f64,
    /// Standard deviation of the sampling interval relative to the usual one.
    pub jitter: f64,
    /// Position noise, m.
    pub position: ChannelNoise,
    /// Pressure noise of A, Pa.
    pub pressure_a: ChannelNoise,
    /// Pressure noise of B, Pa.
    pub pressure_b: ChannelNoise,
    /// Supply pressure noise, Pa.
    pub supply: ChannelNoise,
}

/// The prepared log. All arrays have one entry per usable sample; channels not measured are empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct Record {
    pub(crate) t_s: Vec<f64>,
    pub(crate) u_v: Vec<f64>,
    pub(crate) y_m: Vec<f64>,
    pub(crate) p_a_pa: Vec<f64>,
    pub(crate) p_b_pa: Vec<f64>,
    pub(crate) f_ext_n: Vec<f64>,
    /// Position for volumes.
    pub(crate) y_smooth: Smoothed,
    /// Position for velocity: more smoothing.
    pub(crate) motion: Smoothed,
    pub(crate) p_a_smooth: Smoothed,
    pub(crate) p_b_smooth: Smoothed,
    /// Where the lower and the upper end stop read, m, if the piston leans on them.
    pub(crate) end_stops_m: [Option<f64>; 2],
    /// Whether the piston may touch an end stop, or a sensor its limit: there the force balance is open.
    pub(crate) at_end: Vec<bool>,
    /// Time from which on the valve and the air supply are where the log alone has taken them, s.
    pub(crate) valve_known_s: f64,
    /// Bandwidth of the position observer, rad/s.
    pub(crate) observer_rad_per_s: f64,
    /// One over the standard deviation of what a perfect prediction of p_a would miss, 1/Pa.
    pub(crate) weight_a_per_pa: Vec<f64>,
    /// The same for p_b.
    pub(crate) weight_b_per_pa: Vec<f64>,
    pub(crate) p_sup_pa: Vec<f64>,
    pub(crate) p_sup_smooth: Smoothed,
    pub(crate) stretches: Vec<Stretch>,
    pub(crate) available: Available,
    pub(crate) quality: Quality,
}

impl Record {
    pub(crate) fn new(log: &Log, rig: &RigFile) -> Self {
        let columns = [&log.u_v, &log.p_a_pa, &log.p_b_pa, &log.p_sup_pa, &log.f_ext_n];
        let usable: Vec<usize> = (0..log.t_s.len())
            .filter(|&k| {
                log.y_m[k].is_finite() && columns.iter().all(|c| c.as_ref().is_none_or(|values| values[k].is_finite()))
            })
            .collect();
        let pick = |values: &[f64]| -> Vec<f64> { usable.iter().map(|&k| values[k]).collect() };
        let pick_optional = |values: &Option<Vec<f64>>| values.as_ref().map(|v| pick(v)).unwrap_or_default();
        let mut record = Self {
            t_s: pick(&log.t_s),
            y_m: pick(&log.y_m),
            u_v: pick_optional(&log.u_v),
            p_a_pa: pick_optional(&log.p_a_pa),
            p_b_pa: pick_optional(&log.p_b_pa),
            p_sup_pa: pick_optional(&log.p_sup_pa),
            f_ext_n: pick_optional(&log.f_ext_n),
            available: Available {
                command: log.u_v.is_some(),
                pressure_a: log.p_a_pa.is_some(),
                pressure_b: log.p_b_pa.is_some(),
                supply: log.p_sup_pa.is_some(),
                force: log.f_ext_n.is_some(),
            },
            ..Self::default()
        };
        record.quality.samples = record.t_s.len();
        record.quality.blank_rows = log.t_s.len() - usable.len();
        record.divide();
        record.estimate_noise();
        record.smooth();
        record.valve_known_s = record.find_valve_known();
        record.observer_rad_per_s = motion::bandwidth(&record.quality, rig);
        record.end_stops_m = record.find_end_stops(&rig.rig);
        record.weigh(rig);
        record.mark_ends(rig);
        record
    }

    /// A part of the recording with another position and other chamber pressures in the place of the measured ones.
    pub(crate) fn replaced(&self, range: Range<usize>, [y_m, p_a_pa, p_b_pa]: [Vec<f64>; 3]) -> Self {
        let part = |signal: &[f64]| if signal.is_empty() { Vec::new() } else { signal[range.clone()].to_vec() };
        let mut out = Self {
            t_s: part(&self.t_s),
            u_v: part(&self.u_v),
            f_ext_n: part(&self.f_ext_n),
            p_sup_pa: part(&self.p_sup_pa),
            y_m,
            p_a_pa,
            p_b_pa,
            stretches: vec![Stretch { start: 0, end: range.len(), held_back: true }],
            available: self.available,
            quality: self.quality.clone(),
            observer_rad_per_s: self.observer_rad_per_s,
            ..Self::default()
        };
        out.smooth();
        out
    }

    /// Number of usable samples.
    pub(crate) fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Time to the next sample, s; the usual interval behind the last one.
    pub(crate) fn interval_s(&self, k: usize) -> f64 {
        if k + 1 < self.len() { self.t_s[k + 1] - self.t_s[k] } else { self.quality.interval_s }
    }

    /// Whether samples are missing before sample `k`.
    pub(crate) fn interrupted(&self, k: usize) -> bool {
        k > 0 && k < self.len() && self.t_s[k] - self.t_s[k - 1] > INTERRUPTION * self.quality.interval_s
    }

    /// Where the time `by_s` after (before, if negative) sample `k` lies within some samples.
    pub(crate) fn moment(&self, k: usize, by_s: f64, within: Range<usize>) -> Moment {
        let t_s = self.t_s[k] + by_s;
        let guess = k as f64 + by_s / self.quality.interval_s.max(1.0e-9);
        let last = within.end.saturating_sub(1).max(within.start);
        // Sampling is nearly even: the place is a few samples from the guess at most, unless the log is interrupted.
        let mut low = (guess.max(0.0) as usize).clamp(within.start, last);
        while low < last && self.t_s[low + 1] <= t_s {
            low += 1;
        }
        while low > within.start && self.t_s[low] > t_s {
            low -= 1;
        }
        let high = (low + 1).min(last);
        let step = self.t_s[high] - self.t_s[low];
        Moment { low, high, part: if step > 0.0 { ((t_s - self.t_s[low]) / step).clamp(0.0, 1.0) } else { 0.0 } }
    }

    fn divide(&mut self) {
        let mut intervals: Vec<f64> = self.t_s.windows(2).map(|w| w[1] - w[0]).collect();
        if intervals.is_empty() {
            return;
        }
        let middle = intervals.len() / 2;
        let usual = *intervals.select_nth_unstable_by(middle, f64::total_cmp).1;
        self.quality.interval_s = usual;
        let regular: Vec<f64> = intervals.into_iter().filter(|dt| *dt < INTERRUPTION * usual).collect();
        if !regular.is_empty() {
            let square = regular.iter().map(|dt| (dt / usual - 1.0).powi(2)).sum::<f64>() / regular.len() as f64;
            self.quality.jitter = square.sqrt();
        }

        let chunk = self.len().div_ceil(CHUNKS).max(1);
        let shortest = (SHORTEST_STRETCH_S / usual).ceil() as usize;
        let mut start = 0;
        for k in 1..=self.len() {
            let interrupted = self.interrupted(k);
            self.quality.interruptions += usize::from(interrupted);
            let boundary = k == self.len() || k % chunk == 0;
            // Chunks of the same use stay together; so do a chunk and a remainder too short to stand alone.
            let held_back = |k: usize| (k / chunk) % HELD_BACK_EVERY == HELD_BACK_EVERY - 1;
            let changes = boundary && (k == self.len() || held_back(k) != held_back(k - 1));
            if interrupted || changes {
                if k - start >= shortest.max(8) {
                    self.stretches.push(Stretch { start, end: k, held_back: held_back(k - 1) });
                }
                start = k;
            }
        }
    }

    fn estimate_noise(&mut self) {
        let noise = |signal: &[f64]| {
            if signal.is_empty() {
                return ChannelNoise::default();
            }
            noise::estimate(self.stretches.iter().map(|s| &signal[s.range()]))
        };
        let (position, pressure_a) = (noise(&self.y_m), noise(&self.p_a_pa));
        let (pressure_b, supply) = (noise(&self.p_b_pa), noise(&self.p_sup_pa));
        let quality = &mut self.quality;
        (quality.position, quality.pressure_a, quality.pressure_b, quality.supply) =
            (position, pressure_a, pressure_b, supply);
    }

    fn smooth(&mut self) {
        // Smoothing never reaches across an interruption or into the part held back.
        let pieces = self.pieces();
        let smooth = |signal: &[f64], reach: usize| {
            let mut out = Smoothed::default();
            if !signal.is_empty() {
                for piece in &pieces {
                    parabola(&self.t_s[piece.clone()], &signal[piece.clone()], reach, &mut out);
                }
            }
            out
        };
        let (y_smooth, motion) = (smooth(&self.y_m, VOLUME_REACH), smooth(&self.y_m, VELOCITY_REACH));
        // The slope is that of the smoothed pressure itself: p + tau p' then undoes a lag without a bias of its own.
        let twice = |signal: &[f64]| {
            let value = smooth(&smooth(signal, PRESSURE_REACH).value, PRESSURE_REACH).value;
            let slope = pieces.iter().flat_map(|piece| slopes(&self.t_s, &value, piece.clone())).collect();
            Smoothed { value, slope }
        };
        let both = [&self.p_a_pa, &self.p_b_pa].map(|p| if p.is_empty() { Smoothed::default() } else { twice(p) });
        let [p_a, p_b] = both;
        let p_sup = smooth(&self.p_sup_pa, VOLUME_REACH);
        (self.y_smooth, self.motion, self.p_a_smooth, self.p_b_smooth, self.p_sup_smooth) =
            (y_smooth, motion, p_a, p_b, p_sup);
    }

    /// Marks samples at the end stops or at the limits of the sensors, and what follows shortly after.
    fn mark_ends(&mut self, rig: &RigFile) {
        self.at_end = vec![false; self.len()];
        for (signal, noise) in [(&self.p_a_pa, self.quality.pressure_a), (&self.p_b_pa, self.quality.pressure_b)] {
            for railed in railed(signal, noise, &RAILED_PRESSURE) {
                self.at_end[around(&railed, 2 * PRESSURE_REACH, self.t_s.len())].fill(true);
            }
        }
        let half = 0.5 * rig.rig.cylinder.stroke_m;
        let [low, high] = rig.io.position_range_m;
        let margin = 5.0 * self.quality.position.standard_deviation;
        // A sensor of another scale reads the ends of the stroke elsewhere.
        let [lower, upper] = self.end_stops_m;
        let (low, high) = (low.max(lower.unwrap_or(-half)) + margin, high.min(upper.unwrap_or(half)) - margin);
        let lasting = (END_LASTING_S / self.quality.interval_s.max(1.0e-6)).ceil() as usize;
        let at_end: Vec<usize> = (0..self.len()).filter(|&k| self.y_m[k] <= low || self.y_m[k] >= high).collect();
        // A log of positions that never come near the middle has another zero than the rig file; then no end is known.
        if at_end.len() * 2 > self.len() {
            return;
        }
        for k in at_end {
            let until = (k + lasting).min(self.at_end.len());
            self.at_end[k.saturating_sub(lasting / 4)..until].fill(true);
        }
    }

    /// A log may begin in the middle of things: where in its play the valve's spool stands shows once the command has gone
    /// through it, and how far the supply has drooped before is forgotten in a while.
    fn find_valve_known(&self) -> f64 {
        let (Some(&first), Some(&last)) = (self.t_s.first(), self.t_s.last()) else { return 0.0 };
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        let through = self.u_v.iter().position(|u| {
            (low, high) = (low.min(*u), high.max(*u));
            high - low > 2.0 * LARGEST_PLAY_V
        });
        let through_s = through.map_or(0.0, |k| self.t_s[k] - first);
        first + through_s.max(FORGOTTEN_S).min(LONGEST_UNKNOWN * (last - first))
    }

    /// Where the end stops read: a piston at rest against a force that would move it anywhere else.
    fn find_end_stops(&self, rig: &Rig<f64>) -> [Option<f64>; 2] {
        let half = 0.5 * rig.cylinder.stroke_m;
        let enough_n = LEANING * rig.friction.static_n.max(rig.friction.coulomb_n);
        let at_rest = 5.0 * velocity_error(self);
        if !(self.available.pressure_a && self.available.pressure_b) {
            return [None; 2];
        }
        [-1.0, 1.0].map(|side| {
            let leans = |k: &usize| {
                let force = (self.p_a_smooth.value[*k] - self.p_b_smooth.value[*k]) * rig.cylinder.area_m2;
                (side * self.y_m[*k] / half - 1.0).abs() < NEAR_END
                    && side * force > enough_n
                    && self.motion.slope[*k].abs() < at_rest
            };
            let mut readings: Vec<f64> = (0..self.len()).filter(leans).map(|k| self.y_m[k]).collect();
            let middle = readings.len() / 2;
            (readings.len() >= LEAST_LEANING).then(|| *readings.select_nth_unstable_by(middle, f64::total_cmp).1)
        })
    }

    /// Position noise changes the computed volumes: near the end of a stroke that is more than the pressure noise.
    fn weigh(&mut self, file: &RigFile) {
        let rig = &file.rig;
        let c = &rig.cylinder;
        let smallest = MINIMUM_VOLUME_RATIO * c.area_m2 * c.stroke_m;
        // Variance of a parabola's value at its middle; what is left is alike over a bundle of samples.
        let left = 2.25 / (2 * VOLUME_REACH + 1) as f64 * SAMPLES_ALIKE;
        let position = self.quality.position.standard_deviation * left.sqrt();
        let half = 0.5 * c.stroke_m;
        let [lower, upper] = self.end_stops_m.map(|stop| stop.map_or(1.0, |reading| half / reading.abs()));
        let tolerance = |key: &str| file.tolerance.own(key).unwrap_or(file.tolerance.default);
        let weights = |pressures: &[f64], noise: f64, volume_0: f64, area: f64, key: &str| -> Vec<f64> {
            let unknown = UNKNOWN_VOLUME * tolerance(key) * volume_0;
            let volume = |y: f64| (volume_0 + area * y * if y < 0.0 { lower } else { upper }).max(smallest);
            let by_volume = |y: f64, p: f64| rig.gas.heat_capacity_ratio * p * c.area_m2 / volume(y) * position;
            let pairs = self.y_smooth.value.iter().zip(pressures);
            let weight = |y: f64, p: f64| 1.0 / noise.max(NUMERICAL_ERROR_PA).hypot(by_volume(y, p));
            pairs.map(|(y, p)| if volume(*y) < unknown { 0.0 } else { weight(*y, *p) }).collect()
        };
        let quality = &self.quality;
        let (a, b) = (quality.pressure_a.standard_deviation, quality.pressure_b.standard_deviation);
        let mut weight_a = weights(&self.p_a_smooth.value, a, c.volume_a0_m3, c.area_m2, "cylinder.volume_a0_m3");
        let mut weight_b = weights(&self.p_b_smooth.value, b, c.volume_b0_m3, -c.area_m2, "cylinder.volume_b0_m3");
        // Where the piston is at the position sensor's limit, how large the chambers are is unknown.
        for railed in railed(&self.y_m, quality.position, &RAILED_POSITION) {
            for weight in [&mut weight_a, &mut weight_b] {
                blank(weight, &railed);
            }
        }
        for (weight, signal, noise) in
            [(&mut weight_a, &self.p_a_pa, quality.pressure_a), (&mut weight_b, &self.p_b_pa, quality.pressure_b)]
        {
            for railed in railed(signal, noise, &RAILED_PRESSURE) {
                blank(weight, &railed);
            }
        }
        (self.weight_a_per_pa, self.weight_b_per_pa) = (weight_a, weight_b);
    }

    /// All samples, cut where a stretch starts or ends.
    fn pieces(&self) -> Vec<Range<usize>> {
        let mut cuts: Vec<usize> = self.stretches.iter().flat_map(|s| [s.start, s.end]).collect();
        cuts.extend([0, self.len()]);
        cuts.sort_unstable();
        cuts.dedup();
        cuts.windows(2).map(|w| w[0]..w[1]).collect()
    }
}

/// Samples at which a signal is at its sensor's limit: what it would have been is unknown there.
fn railed(signal: &[f64], noise: ChannelNoise, at_limit: &Railed) -> Vec<Range<usize>> {
    if noise.standard_deviation < at_limit.moved_by * noise.resolution {
        return Vec::new();
    }
    let (low, high) = signal.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
    if low >= high || noise.standard_deviation < LEAST_NOISE * (high - low) {
        return Vec::new();
    }
    let mut start = 0;
    let runs = signal.chunk_by(|a, b| a == b).map(|run| {
        start += run.len();
        (start - run.len()..start, run[0])
    });
    runs.filter(|(run, x)| run.len() >= at_limit.in_a_row && (*x == low || *x == high)).map(|(run, _)| run).collect()
}

/// Takes the weight from some samples, and from those to which smoothing spreads what is unknown there.
fn blank(weight: &mut [f64], railed: &Range<usize>) {
    let unknown = around(railed, VOLUME_REACH, weight.len());
    if let Some(part) = weight.get_mut(unknown) {
        part.fill(0.0);
    }
}

/// Some samples and those near them.
fn around(samples: &Range<usize>, reach: usize, len: usize) -> Range<usize> {
    samples.start.saturating_sub(reach)..(samples.end + reach).min(len)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A log of 20 s with both pressures, its position given by time; `jitter` is relative to 1 ms.
    fn log(jitter: f64, y_m: impl Fn(f64) -> f64, p_pa: impl Fn(f64) -> [f64; 2]) -> Log {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
        };
        let mut out = Log { u_v: Some(vec![]), p_a_pa: Some(vec![]), p_b_pa: Some(vec![]), ..Log::default() };
        let mut t_s = 0.0;
        while t_s < 20.0 {
            out.t_s.push(t_s);
            // The sensor reads no farther than half a metre.
            out.y_m.push((y_m(t_s) + 1.7e-4 * uniform()).clamp(-0.5, 0.5));
            let [a, b] = p_pa(t_s);
            let columns = [(&mut out.u_v, 0.0), (&mut out.p_a_pa, a), (&mut out.p_b_pa, b)];
            for (column, value) in columns {
                if let Some(column) = column {
                    column.push(value + 1000.0 * uniform());
                }
            }
            t_s += 1.0e-3 * (1.0 + 2.0 * jitter * uniform());
        }
        out
    }

    #[test]
    fn a_moment_is_found_by_time_however_uneven_the_sampling() {
        let record = Record::new(&log(0.6, |t| 0.3 * t.sin(), |_| [3.0e5; 2]), &RigFile::paper_a());
        let all = 0..record.len();
        for by_s in [0.0173, -0.0173, 0.0] {
            for k in (50..record.len() - 50).step_by(37) {
                let found = record.moment(k, by_s, all.clone()).of(&record.t_s);
                assert!((found - record.t_s[k] - by_s).abs() < 1.0e-9, "{k} {by_s} {found}");
            }
        }
        // Nothing is known before the first and behind the last sample.
        assert_eq!(record.moment(3, -1.0, all.clone()).of(&record.t_s), record.t_s[0]);
        assert_eq!(record.moment(record.len() - 3, 1.0, all).of(&record.t_s), record.t_s[record.len() - 1]);
    }

    #[test]
    fn chambers_are_not_judged_while_the_position_sensor_is_at_its_limit() {
        let truly = |t: f64| 0.6 * t.sin();
        let record = Record::new(&log(0.0, truly, |_| [3.0e5; 2]), &RigFile::paper_a());
        for k in 20..record.len() - 20 {
            let y = truly(record.t_s[k]).abs();
            if y > 0.505 {
                assert_eq!((record.weight_a_per_pa[k], record.weight_b_per_pa[k]), (0.0, 0.0), "{}", record.t_s[k]);
            } else if y < 0.45 {
                assert!(record.weight_a_per_pa[k] > 0.0 && record.weight_b_per_pa[k] > 0.0, "{}", record.t_s[k]);
            }
        }
    }

    #[test]
    fn nothing_is_judged_while_a_pressure_sensor_is_at_its_limit() {
        // The pressure of A peaks above what its sensor reads for a moment at a time.
        let truly = |t: f64| 5.0e5 + 5.05e5 * (2.0 * t).sin().powi(31);
        let mut log = log(0.0, |t| 0.3 * t.sin(), |t| [truly(t), 3.0e5]);
        log.p_a_pa.iter_mut().flatten().for_each(|p| *p = p.min(1.0e6));
        let record = Record::new(&log, &RigFile::paper_a());
        let mut seen = 0;
        for k in 20..record.len() - 20 {
            if truly(record.t_s[k]) > 1.0e6 + 600.0 {
                assert!(record.at_end[k] && record.weight_a_per_pa[k] == 0.0, "{}", record.t_s[k]);
                seen += 1;
            }
            assert!(record.weight_b_per_pa[k] > 0.0);
        }
        assert!(seen > 100, "{seen}");
        assert!(record.at_end.iter().filter(|at_end| **at_end).count() < record.len() / 10);
    }

    #[test]
    fn an_end_stop_is_where_the_piston_leans_not_where_it_is_told_to_stop() {
        // A sensor 4 % short reads the end of the stroke at 0.48 m; the other end is only approached, by a held piston.
        let y = |t: f64| if t < 6.0 { 0.48 } else { -0.48 };
        let p = |t: f64| if t < 6.0 { [6.0e5, 1.5e5] } else { [3.0e5, 3.1e5] };
        let record = Record::new(&log(0.0, y, p), &RigFile::paper_a());
        let [lower, upper] = record.end_stops_m;
        assert!(upper.is_some_and(|upper| (upper - 0.48).abs() < 1.0e-3), "{upper:?}");
        assert_eq!(lower, None);
        let at = |t_s: f64| record.at_end[record.t_s.partition_point(|t| *t < t_s)];
        assert!(at(3.0) && !at(15.0));
    }
}
