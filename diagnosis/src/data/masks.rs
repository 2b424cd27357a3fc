//! Samples that do not count in a balance: at end stops, at a sensor's limit, in a chamber too small, and at the
//! beginning of a log, where the state of the valve is not known yet.

use super::noise::ChannelNoise;
use super::record::Record;
use crate::constants;
use crate::statistics::median;
use core::ops::Range;
use plant_model::{MINIMUM_VOLUME_RATIO, Rig};
use rig_files::{Io, RigFile};

/// When a reading counts as clipped: it repeats the log's lowest or highest value so often in a row, although the noise
/// is large enough to change it.
struct Railed<'a> {
    /// Samples in a row.
    in_a_row: usize,
    /// Least standard deviation of the noise, in quantisation steps.
    moved_by: f64,
    /// The rig file's word on where a pressure sensor ends: one sample there is enough.
    stated: Option<&'a Io>,
}

impl<'a> Railed<'a> {
    /// Of a position whose samples usually come every `interval_s`.
    fn position(interval_s: f64) -> Self {
        let moved_by = constants::railed_position_noise();
        Self { in_a_row: Self::samples(constants::railed_position_run(), interval_s), moved_by, stated: None }
    }

    /// Pressures peak for a moment only.
    fn pressure(interval_s: f64, io: &'a Io) -> Self {
        let moved_by = constants::railed_pressure_noise();
        let in_a_row = Self::samples(constants::railed_pressure_run(), interval_s);
        Self { in_a_row, moved_by, stated: Some(io) }
    }

    fn samples(seconds: f64, interval_s: f64) -> usize {
        ((seconds / interval_s.max(1.0e-6)).round() as usize).max(constants::least_railed())
    }
}

/// Marks samples at the end stops or at the limits of the sensors, and what follows shortly after.
pub(crate) fn at_end(record: &Record, rig: &RigFile) -> Vec<bool> {
    let mut out = vec![false; record.len()];
    let interval_s = record.quality.interval_s;
    let reach = record.pressure_reach().samples(interval_s);
    for (signal, noise) in [(&record.p_a_pa, record.quality.pressure_a), (&record.p_b_pa, record.quality.pressure_b)] {
        for railed in railed(signal, noise, &Railed::pressure(interval_s, &rig.io)) {
            out[around(&railed, 2 * reach, record.t_s.len())].fill(true);
        }
    }
    let half = 0.5 * rig.rig.cylinder.stroke_m;
    let [low, high] = rig.io.position_range_m;
    let margin = 5.0 * record.quality.position.standard_deviation;
    // A sensor of another scale shows the end stops at other positions than the rig file.
    let [lower, upper] = record.end_stops_m;
    let (low, high) = (low.max(lower.unwrap_or(-half)) + margin, high.min(upper.unwrap_or(half)) - margin);
    let lasting = (constants::settling_s() / record.quality.interval_s.max(1.0e-6)).ceil() as usize;
    // A position at its sensor's limit, and what smoothing and the observer make of it.
    for railed in railed(&record.y_m, record.quality.position, &Railed::position(interval_s)) {
        out[railed.start.saturating_sub(lasting / 4)..(railed.end + lasting).min(record.len())].fill(true);
    }
    let ends: Vec<usize> = (0..record.len()).filter(|&k| record.y_m[k] <= low || record.y_m[k] >= high).collect();
    // If most samples seem to be at an end, the log has another zero than the rig file; then no end stop is known.
    if ends.len() * 2 > record.len() {
        return out;
    }
    for k in ends {
        let until = (k + lasting).min(out.len());
        out[k.saturating_sub(lasting / 4)..until].fill(true);
    }
    out
}

/// Time from which on the log determines the state of the valve, s. A log may begin while the rig is at work:
/// the spool's place within its hysteresis is known once the command has passed through it.
pub(crate) fn valve_known_s(record: &Record) -> f64 {
    let (Some(&first), Some(&last)) = (record.t_s.first(), record.t_s.last()) else { return 0.0 };
    let (mut low, mut high) = (f64::MAX, f64::MIN);
    let through = record.u_v.iter().position(|u| {
        (low, high) = (low.min(*u), high.max(*u));
        high - low > 2.0 * constants::largest_play_v()
    });
    let through_s = through.map_or(0.0, |k| record.t_s[k] - first);
    first + through_s.min(constants::longest_unknown_past() * (last - first))
}

/// Positions shown at the lower and upper end stop, m: where the piston rests against a force that friction cannot
/// hold. `None` where it never does.
pub(crate) fn end_stops_m(record: &Record, rig: &Rig<f64>) -> [Option<f64>; 2] {
    let half = 0.5 * rig.cylinder.stroke_m;
    let enough_n = constants::leaning() * rig.friction.static_n.max(rig.friction.coulomb_n);
    let at_rest = 5.0 * record.velocity_error_m_per_s();
    if !(record.available.pressure_a && record.available.pressure_b) {
        return [None; 2];
    }
    [-1.0, 1.0].map(|side| {
        let leans = |k: &usize| {
            let (p_a, p_b) = (record.p_a_smooth.value[*k], record.p_b_smooth.value[*k]);
            let force = (p_a - p_b) * rig.cylinder.area_b_m2
                + (rig.cylinder.area_a_m2 - rig.cylinder.area_b_m2) * (p_a - rig.supply.atmosphere_pa)
                - rig.cylinder.spring_force_n(record.y_m[*k]);
            (side * record.y_m[*k] / half - 1.0).abs() < constants::near_end()
                && side * force > enough_n
                && record.motion.slope[*k].abs() < at_rest
        };
        let mut readings: Vec<f64> = (0..record.len()).filter(leans).map(|k| record.y_m[k]).collect();
        median(&mut readings)
    })
}

/// Weight of each sample of both chamber pressures, 1/Pa: one over the standard deviation of a perfect model's error.
/// Position noise counts because it changes the computed volume; near the end of a stroke that is more than the
/// pressure noise.
pub(crate) fn weights_per_pa(record: &Record, file: &RigFile) -> [Vec<f64>; 2] {
    let rig = &file.rig;
    let c = &rig.cylinder;
    // Variance of a local parabola's value at its centre. The remaining error is correlated over neighbouring samples.
    let reach = record.volume_reach().samples(record.quality.interval_s);
    let window = (2 * reach + 1) as f64;
    let left = (2.25 / window).min(1.0) * (window / constants::window_alike()).max(1.0);
    let position = record.quality.position.standard_deviation * left.sqrt();
    let half = 0.5 * c.stroke_m;
    let [lower, upper] = record.end_stops_m.map(|stop| stop.map_or(1.0, |reading| half / reading.abs()));
    let weights = |pressures: &[f64], noise: f64, volume_0: f64, area: f64| -> Vec<f64> {
        let smallest = MINIMUM_VOLUME_RATIO * area.abs() * c.stroke_m;
        let volume = |y: f64| (volume_0 + area * y * if y < 0.0 { lower } else { upper }).max(smallest);
        let by_volume = |y: f64, p: f64| rig.gas.heat_capacity_ratio * p * area.abs() / volume(y) * position;
        let pairs = record.y_smooth.value.iter().zip(pressures);
        let weight = |y: f64, p: f64| 1.0 / noise.max(constants::numerical_error_pa()).hypot(by_volume(y, p));
        pairs.map(|(y, p)| weight(*y, *p)).collect()
    };
    let quality = &record.quality;
    let (a, b) = (quality.pressure_a.standard_deviation, quality.pressure_b.standard_deviation);
    let mut weight_a = weights(&record.p_a_smooth.value, a, c.volume_a0_m3, c.area_a_m2);
    let mut weight_b = weights(&record.p_b_smooth.value, b, c.volume_b0_m3, -c.area_b_m2);
    // Where the position is clipped, the volumes of the chambers are unknown.
    for railed in railed(&record.y_m, quality.position, &Railed::position(record.quality.interval_s)) {
        for weight in [&mut weight_a, &mut weight_b] {
            blank(weight, &railed, reach);
        }
    }
    for (weight, signal, noise) in
        [(&mut weight_a, &record.p_a_pa, quality.pressure_a), (&mut weight_b, &record.p_b_pa, quality.pressure_b)]
    {
        for railed in railed(signal, noise, &Railed::pressure(record.quality.interval_s, &file.io)) {
            blank(weight, &railed, reach);
        }
    }
    [weight_a, weight_b]
}

/// Whether each position is clipped at its sensor's limit.
pub(crate) fn clipped(record: &Record) -> Vec<bool> {
    let mut out = vec![false; record.len()];
    for railed in railed(&record.y_m, record.quality.position, &Railed::position(record.quality.interval_s)) {
        out[railed].fill(true);
    }
    out
}

/// Runs of samples at which a signal is clipped at its sensor's limit.
fn railed(signal: &[f64], noise: ChannelNoise, at_limit: &Railed<'_>) -> Vec<Range<usize>> {
    let (low, high) = signal.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
    // Repeats show a limit only where noise would change them.
    let noisy = noise.standard_deviation >= at_limit.moved_by * noise.resolution
        && noise.standard_deviation >= constants::least_noise() * (high - low);
    // A log that reads beyond the stated end is of another sensor.
    let ends = at_limit.stated.is_some_and(|io| io.is_pressure_end(high));
    if low >= high || !(noisy || ends) {
        return Vec::new();
    }
    let mut start = 0;
    let runs: Vec<(Range<usize>, f64)> = signal
        .chunk_by(|a, b| a == b)
        .map(|run| {
            start += run.len();
            (start - run.len()..start, run[0])
        })
        .collect();
    // Where the signal once stays at its lowest or highest value it has an end, and a moment there is clipped, too.
    let stays = |x: f64| noisy && runs.iter().any(|(run, at)| *at == x && run.len() >= at_limit.in_a_row);
    let (low_is_end, high_is_end) = (stays(low), ends || stays(high));
    let is_end = |x: f64| x == low && low_is_end || x == high && high_is_end;
    runs.into_iter().filter(|(_, x)| is_end(*x)).map(|(run, _)| run).collect()
}

/// Sets the weight of clipped samples to zero, and that of neighbours whose smoothed values depend on them.
fn blank(weight: &mut [f64], railed: &Range<usize>, reach: usize) {
    let unknown = around(railed, reach, weight.len());
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
    use crate::data::prepare::prepare;
    use rig_files::{Log, RigFile};

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
        let record = prepare(&log(0.6, |t| 0.3 * t.sin(), |_| [3.0e5; 2]), &RigFile::paper_a());
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
        let record = prepare(&log(0.0, truly, |_| [3.0e5; 2]), &RigFile::paper_a());
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
    fn a_moment_at_a_limit_that_the_sensor_stayed_at_elsewhere_is_clipped_too() {
        // Once far beyond the limit, later four times a second for 16 ms; and the same without the long stay.
        let moments = |t: f64| 0.5 + 4.0e-3 - 0.2 * (1.0 - (4.0 * core::f64::consts::TAU * t).cos());
        let truly = |t: f64| if t < 2.0 { 0.6 * (1.5 * t).sin() } else { moments(t) };
        let weights = |y: &dyn Fn(f64) -> f64| {
            let record = prepare(&log(0.0, y, |_| [3.0e5; 2]), &RigFile::paper_a());
            let beyond: Vec<usize> = (2500..record.len() - 100).filter(|k| truly(record.t_s[*k]) > 0.5005).collect();
            assert!(beyond.len() > 100, "{}", beyond.len());
            beyond.into_iter().map(|k| (record.at_end[k], record.weight_a_per_pa[k])).collect::<Vec<_>>()
        };
        assert!(weights(&truly).iter().all(|(at_end, weight)| *at_end && *weight == 0.0));
        let short = |t: f64| if t < 2.0 { 0.0 } else { truly(t) };
        assert!(weights(&short).iter().all(|(_, weight)| *weight > 0.0));
    }

    #[test]
    fn nothing_is_judged_while_a_pressure_sensor_is_at_its_limit() {
        // The pressure of A peaks above what its sensor reads for a moment at a time.
        let truly = |t: f64| 5.0e5 + 5.05e5 * (2.0 * t).sin().powi(31);
        let mut log = log(0.0, |t| 0.3 * t.sin(), |t| [truly(t), 3.0e5]);
        log.p_a_pa.iter_mut().flatten().for_each(|p| *p = p.min(1.0e6));
        let record = prepare(&log, &RigFile::paper_a());
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
    fn two_rows_at_the_stated_end_of_a_pressure_sensor_are_not_judged() {
        let rig = RigFile::paper_a();
        let end_pa = rig.io.pressure_range_pa[1];
        let touching = |reading_pa: f64| {
            let mut log = log(0.0, |t| 0.3 * t.sin(), |t| [5.0e5 + 1.0e5 * t.cos(), 3.0e5]);
            if let Some(p) = &mut log.p_a_pa {
                p[7000..7002].fill(reading_pa);
            }
            let record = prepare(&log, &rig);
            (
                record.at_end[7000] && record.at_end[7001],
                record.weight_a_per_pa[7000] == 0.0,
                record.weight_b_per_pa[7000] == 0.0,
            )
        };
        assert_eq!(touching(end_pa), (true, true, false));
        // Two rows alike below it show no limit, nor do those beyond: the sensor is another one.
        assert_eq!(touching(0.9 * end_pa), (false, false, false));
        assert_eq!(touching(1.1 * end_pa), (false, false, false));
    }

    #[test]
    fn an_end_stop_is_where_the_piston_leans_not_where_it_is_told_to_stop() {
        // A sensor 4 % short reads the end of the stroke at 0.48 m; the other end is only approached, by a held piston.
        let y = |t: f64| if t < 6.0 { 0.48 } else { -0.48 };
        let p = |t: f64| if t < 6.0 { [6.0e5, 1.5e5] } else { [3.0e5, 3.1e5] };
        let record = prepare(&log(0.0, y, p), &RigFile::paper_a());
        let [lower, upper] = record.end_stops_m;
        assert!(upper.is_some_and(|upper| (upper - 0.48).abs() < 1.0e-3), "{upper:?}");
        assert_eq!(lower, None);
        let at = |t_s: f64| record.at_end[record.t_s.partition_point(|t| *t < t_s)];
        assert!(at(3.0) && !at(15.0));
    }
}
