//! From the logged command to the valve's opening: delay, play, spool lag, dead zone, `atan(2 w)`.

use super::spool::Spool;
use crate::constants;
use crate::data::record::Record;
use crate::data::split::Stretch;
use plant_model::dead_zone::DeadZone;
use plant_model::effects::ValveLagTerms as Terms;
use plant_model::{OpeningCurve, Plant, Side};
use std::sync::Arc;

/// The parameters that the openings depend on.
#[derive(PartialEq)]
pub(super) struct Path {
    dead_zone: DeadZone<f64>,
    exhaust_zone: Option<DeadZone<f64>>,
    curve: Option<OpeningCurve<f64>>,
    travel: Travel,
}

impl Path {
    pub(super) fn of(plant: &Plant<f64>) -> Self {
        let dead_zone = plant.coefficients().dead_zone;
        Self {
            dead_zone,
            exhaust_zone: plant.exhaust_zone(),
            curve: plant.opening_curve().copied(),
            travel: Travel::of(plant),
        }
    }
}

/// The parameters that the spool's places depend on.
#[derive(PartialEq)]
pub(super) struct Travel {
    max_voltage_v: f64,
    line_delay_s: f64,
    play_half_width_v: f64,
    lag: Terms<f64>,
}

impl Travel {
    pub(super) fn of(plant: &Plant<f64>) -> Self {
        Self {
            max_voltage_v: plant.coefficients().max_voltage_v,
            line_delay_s: plant.line_delay_s(),
            play_half_width_v: plant.added().valve_hysteresis.half_width_v,
            lag: plant.added().valve_lag,
        }
    }
}

/// Openings of the paths of A and of B at a place of the spool in V, rad; positive where A is filled and B exhausted.
pub(super) fn signed_openings(plant: &Plant<f64>, spool_v: f64) -> [f64; 2] {
    let opening = plant.opening(spool_v);
    let [a, b] = [opening.through(opening.fills_a), opening.through(!opening.fills_a)];
    if opening.fills_a { [a, b] } else { [-a, -b] }
}

/// Signed openings of the paths of both chambers in rad by sample, positive where A is filled and B exhausted, averaged over the
/// interval after each; NaN where they are not known.
pub(crate) struct Openings {
    a: Arc<Vec<f64>>,
    b: Arc<Vec<f64>>,
}

impl Openings {
    /// Of a chamber's paths.
    pub(crate) fn of(&self, side: Side) -> &[f64] {
        match side {
            Side::A => &self.a,
            Side::B => &self.b,
        }
    }
}

/// After so many times the slower of its time constants nothing is left of where a spool began that an `f64` could tell: `ln 2^53`.
const SPOOL_MEMORY: f64 = 37.0;

/// Samples that are wanted, and those up to a time before one of them.
fn followed(t_s: &[f64], wanted: &[bool], before_s: f64) -> Vec<bool> {
    let mut out = wanted.to_vec();
    let mut next_s = f64::INFINITY;
    for k in (0..out.len()).rev() {
        if wanted[k] {
            next_s = t_s[k];
        }
        out[k] = next_s - t_s[k] <= before_s;
    }
    out
}

/// The openings over all of a log.
pub(crate) fn openings(record: &Record, plant: &Plant<f64>) -> Openings {
    openings_at(&places(record, plant, None), record, plant)
}

/// Where the spool is. The points of an opening table and a dead zone change nothing of it.
pub(super) struct Places {
    /// The mean place over each part of an interval, V, and the part's duration, s.
    parts: Vec<(f64, f64)>,
    /// For each sample: how many parts end before the next one.
    ends: Vec<usize>,
}

/// The openings where the spool is.
pub(super) fn openings_at(places: &Places, record: &Record, plant: &Plant<f64>) -> Openings {
    let apart = plant.exhaust_zone().is_some();
    let rows = places.ends.len();
    let (mut a, mut b) = (Vec::with_capacity(rows), Vec::with_capacity(if apart { rows } else { 0 }));
    let mut last = (f64::NAN, [0.0; 2]);
    let mut begin = 0;
    for (k, end) in places.ends.iter().enumerate() {
        let parts = &places.parts[begin..*end];
        begin = *end;
        let mut sum = [0.0; 2];
        for (mean, duration) in parts {
            if *mean != last.0 {
                last = (*mean, signed_openings(plant, *mean));
            }
            sum = [sum[0] + last.1[0] * duration, sum[1] + last.1[1] * duration];
        }
        let from = record.t_s[k];
        let interval_s = (from + record.interval_s(k) - from).max(1.0e-9);
        let mean = |sum: f64| if parts.is_empty() { f64::NAN } else { sum / interval_s };
        a.push(mean(sum[0]));
        if apart {
            b.push(mean(sum[1]));
        }
    }
    let a = Arc::new(a);
    let b = if apart { Arc::new(b) } else { Arc::clone(&a) };
    Openings { a, b }
}

/// The places of the spool, in some stretches if there are any.
pub(super) fn places(record: &Record, plant: &Plant<f64>, stretches: Option<&[Stretch]>) -> Places {
    let mut wanted = vec![stretches.is_none(); record.len()];
    stretches.into_iter().flatten().for_each(|stretch| wanted[stretch.range()].fill(true));
    let c = plant.coefficients();
    let (t, u) = (&record.t_s, &record.u_v);
    let mut out = Places { parts: Vec::with_capacity(u.len()), ends: Vec::with_capacity(u.len()) };
    let Some(&first) = u.first() else { return out };
    let clamp = |u: f64| u.clamp(-c.max_voltage_v, c.max_voltage_v);
    // The valve is assumed at mid when the log begins; until `Record::valve_known_s` the air does not count.
    let (hysteresis, lag, delay_s) = (plant.added().valve_hysteresis, plant.added().valve_lag, plant.line_delay_s());
    let mut played = hysteresis.play(0.0, first);
    let mut source = 0;
    let mut spool = Spool::of(lag);
    // The slower eigenvalue's real part is 1/tau or more with little inertia, and 1/(2 m tau) with much.
    let slowest_s = lag.time_constant_s * (2.0 * lag.inertia).max(1.0);
    let followed = followed(t, &wanted, SPOOL_MEMORY * slowest_s);
    for k in 0..u.len() {
        let (from, to) = (t[k], t[k] + record.interval_s(k));
        if !followed[k] {
            while source + 1 < u.len() && t[source + 1] + delay_s <= to - 1.0e-9 {
                source += 1;
                played = hysteresis.play(played, u[source]);
            }
            spool.iter_mut().for_each(|spool| spool.rest_at(clamp(played)));
            out.ends.push(out.parts.len());
            continue;
        }
        let mut at = from;
        loop {
            while source + 1 < u.len() && t[source + 1] + delay_s <= at + 1.0e-9 {
                source += 1;
            }
            let until = if source + 1 < u.len() { (t[source + 1] + delay_s).min(to) } else { to };
            let duration = (until - at).max(0.0);
            played = hysteresis.play(played, u[source]);
            let target = clamp(played);
            // A spool that travels passes the bends of dead zone and curve on its way: the mean opening is not that at its mean
            // place. Where nobody wants it, one part leads to the same end.
            let far = |spool: &Spool| (target - spool.place_v()).abs() > constants::spool_travel() * c.max_voltage_v;
            let travels = spool.as_ref().is_some_and(far);
            let parts = if travels && wanted[k] { constants::spool_parts() } else { 1 };
            let part = duration / parts as f64;
            for _ in 0..parts {
                let mean = spool.as_mut().map_or(target, |spool| spool.follow(target, part));
                if wanted[k] {
                    out.parts.push((mean, part));
                }
            }
            at = until;
            if at >= to - 1.0e-9 {
                break;
            }
        }
        out.ends.push(out.parts.len());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::prepare::prepare;
    use plant_model::{Effect, Effects};
    use rig_files::{Log, RigFile};

    #[test]
    fn openings_of_some_stretches_are_those_of_the_whole_log_whatever_the_valve_remembers() {
        let file = RigFile::paper_b();
        let t_s: Vec<f64> = (0..3000).map(|k| 1.0e-3 * f64::from(k)).collect();
        let u_v = t_s.iter().map(|t| 0.3 + 0.7 * (1.5 * t).sin() + 0.4 * (31.0 * t).sin()).collect();
        let silent = Some(vec![2.0e5; t_s.len()]);
        let log = Log {
            y_m: vec![0.0; t_s.len()],
            p_a_pa: silent.clone(),
            p_b_pa: silent,
            u_v: Some(u_v),
            t_s,
            ..Log::default()
        };
        let record = prepare(&log, &file);
        let stretches =
            [(700, 900), (1500, 1502), (2800, 3000)].map(|(start, end)| Stretch { start, end, held_back: false });
        for (lag_s, play_v, delay_s) in [(0.0, 0.0, 0.0), (0.002, 0.0, 0.0), (0.0, 0.2, 0.0), (0.05, 0.05, 0.0026)] {
            let effects = Effects::none()
                .with(Effect::ValveLag, &[lag_s])
                .with(Effect::ValveHysteresis, &[play_v])
                .with(Effect::LineDelay, &[delay_s]);
            let plant = Plant::new(&file.rig, &effects).unwrap();
            let all = openings(&record, &plant);
            let some = openings_at(&places(&record, &plant, Some(&stretches)), &record, &plant);
            for (k, (one, other)) in all.a.iter().zip(&*some.a).enumerate() {
                let wanted = stretches.iter().any(|stretch| stretch.range().contains(&k));
                assert!(if wanted { (one - other).abs() < 1.0e-12 } else { other.is_nan() }, "{k}: {one} {other}");
            }
        }
    }
}
