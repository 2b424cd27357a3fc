//! From the logged command to the place of the valve's spool as the chambers feel it: delay, play, spool lag.

use super::spool::{self, Spool};
use crate::constants;
use crate::data::record::Record;
use crate::data::split::Stretch;
use plant_model::effects::ValveLagTerms as Terms;
use plant_model::{Plant, Side};

/// The parameters that the spool's way, as a chamber feels it, depends on. The points of an opening table and a dead zone change nothing
/// of it.
#[derive(PartialEq)]
pub(super) struct Travel {
    max_voltage_v: f64,
    line_delay_s: f64,
    play_half_width_v: f64,
    lag: Terms<f64>,
}

impl Travel {
    pub(super) fn of(plant: &Plant<f64>, side: Side) -> Self {
        Self {
            max_voltage_v: plant.coefficients().max_voltage_v,
            line_delay_s: plant.line_delays_s()[side as usize],
            play_half_width_v: plant.added().valve_hysteresis.half_width_v,
            lag: plant.added().valve_lag,
        }
    }
}

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

/// Where the spool is in the course of a log.
pub(super) struct Way {
    /// The mean place over each part of an interval, V, and the part's duration, s.
    pub(super) parts: Vec<(f64, f64)>,
    /// For each sample: how many parts end before the next one.
    pub(super) ends: Vec<usize>,
}

impl Way {
    /// For each sample the parts of the interval behind it; none where nobody wants them.
    pub(super) fn by_sample(&self) -> impl Iterator<Item = &[(f64, f64)]> {
        let mut begin = 0;
        self.ends.iter().map(move |end| {
            let parts = &self.parts[begin..*end];
            begin = *end;
            parts
        })
    }
}

/// The way of the spool as a chamber feels it, in some stretches if there are any.
pub(super) fn way(record: &Record, plant: &Plant<f64>, side: Side, stretches: Option<&[Stretch]>) -> Way {
    let delay_s = plant.line_delays_s()[side as usize];
    let mut wanted = vec![stretches.is_none(); record.len()];
    stretches.into_iter().flatten().for_each(|stretch| wanted[stretch.range()].fill(true));
    let c = plant.coefficients();
    let (t, (t_u, u)) = (&record.t_s, record.commands());
    let mut out = Way { parts: Vec::with_capacity(u.len()), ends: Vec::with_capacity(t.len()) };
    let Some(&first) = u.first() else { return out };
    let clamp = |u: f64| u.clamp(-c.max_voltage_v, c.max_voltage_v);
    // The valve is assumed at mid when the log begins; until `Record::valve_known_s` the air does not count.
    let (hysteresis, lag) = (plant.added().valve_hysteresis, plant.added().valve_lag);
    let mut played = hysteresis.play(0.0, first);
    let mut source = 0;
    let mut spool = Spool::of(lag);
    let followed = followed(t, &wanted, spool::memory_s(&lag));
    for k in 0..t.len() {
        let (from, to) = (t[k], t[k] + record.interval_s(k));
        if !followed[k] {
            while source + 1 < u.len() && t_u[source + 1] + delay_s <= to - 1.0e-9 {
                source += 1;
                played = hysteresis.play(played, u[source]);
            }
            spool.iter_mut().for_each(|spool| spool.rest_at(clamp(played)));
            out.ends.push(out.parts.len());
            continue;
        }
        let mut at = from;
        loop {
            while source + 1 < u.len() && t_u[source + 1] + delay_s <= at + 1.0e-9 {
                source += 1;
            }
            let until = if source + 1 < u.len() { (t_u[source + 1] + delay_s).min(to) } else { to };
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
