//! The valve's openings where its spool is: dead zone, then `atan(2 w)` or a table.

use super::valve::{Places, Travel, places};
use crate::data::record::Record;
use plant_model::dead_zone::DeadZone;
use plant_model::valve_flow::Opening;
use plant_model::{OpeningCurve, OpeningPiece, Plant, Side};
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

/// Signed openings of the paths of both chambers in rad by sample, positive where A is filled and B exhausted, averaged over the
/// interval after each; NaN where they are not known. Or changes of them.
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

    /// Means over the intervals of what the paths of A and B have in each part of them; those of B are their own if the paths are
    /// apart.
    fn averaged(places: &Places, record: &Record, apart: bool, mut in_part: impl FnMut(usize) -> [f64; 2]) -> Self {
        let rows = places.ends.len();
        let (mut a, mut b) = (Vec::with_capacity(rows), Vec::with_capacity(if apart { rows } else { 0 }));
        let mut begin = 0;
        for (k, end) in places.ends.iter().enumerate() {
            let mut sum = [0.0; 2];
            for part in begin..*end {
                let (duration, here) = (places.parts[part].1, in_part(part));
                sum = [sum[0] + here[0] * duration, sum[1] + here[1] * duration];
            }
            let from = record.t_s[k];
            let interval_s = (from + record.interval_s(k) - from).max(1.0e-9);
            let mean = |sum: f64| if begin == *end { f64::NAN } else { sum / interval_s };
            a.push(mean(sum[0]));
            if apart {
                b.push(mean(sum[1]));
            }
            begin = *end;
        }
        let a = Arc::new(a);
        let b = if apart { Arc::new(b) } else { Arc::clone(&a) };
        Self { a, b }
    }
}

/// The openings over all of a log.
pub(crate) fn openings(record: &Record, plant: &Plant<f64>) -> Openings {
    openings_at(&places(record, plant, None), record, plant)
}

/// The openings where the spool is.
pub(super) fn openings_at(places: &Places, record: &Record, plant: &Plant<f64>) -> Openings {
    let characteristic = Characteristic::of(plant);
    let (mut near, mut last) = (0, (f64::NAN, [0.0; 2]));
    Openings::averaged(places, record, plant.exhaust_zone().is_some(), |part| {
        let place = places.parts[part].0;
        if place != last.0 {
            last = (place, signed(&characteristic.opening(place, &mut near).0));
        }
        last.1
    })
}

/// Changes from some openings to others.
pub(super) fn changes([from, to]: [&Openings; 2]) -> Openings {
    let change = |side: Side| to.of(side).iter().zip(from.of(side)).map(|(to, from)| to - from).collect();
    let a = Arc::new(change(Side::A));
    let apart = [from, to].iter().any(|openings| !Arc::ptr_eq(&openings.a, &openings.b));
    let b = if apart { Arc::new(change(Side::B)) } else { Arc::clone(&a) };
    Openings { a, b }
}

/// Openings of the paths of A and of B in rad at a place of the spool in V; positive where A is filled and B exhausted.
pub(super) fn signed_openings(plant: &Plant<f64>, spool_v: f64) -> [f64; 2] {
    signed(&plant.opening(spool_v))
}

fn signed(opening: &Opening<f64>) -> [f64; 2] {
    let [a, b] = [opening.fills_a, !opening.fills_a].map(|filling| opening.through(filling));
    if opening.fills_a { [a, b] } else { [-a, -b] }
}

/// The curve of a plant's opening, a table in pieces.
struct Characteristic<'a> {
    plant: &'a Plant<f64>,
    /// Beyond the end of flow of negative and of positive commands.
    pieces: [Vec<OpeningPiece<f64>>; 2],
}

/// A place on the curve.
#[derive(Clone, Copy)]
struct On {
    /// The effective command, V.
    w: f64,
    /// Where in the pieces of its side; 0 without a table.
    piece: usize,
}

impl<'a> Characteristic<'a> {
    fn of(plant: &'a Plant<f64>) -> Self {
        let pieces = match plant.opening_curve() {
            Some(OpeningCurve::Points(points)) => [false, true].map(|positive| points.pieces(positive).collect()),
            _ => [Vec::new(), Vec::new()],
        };
        Self { plant, pieces }
    }

    /// The opening with the spool at a place in V, beginning on a piece nearby: spools move slowly. And where on the curve the
    /// path is that fills a chamber, and the one that exhausts if it is elsewhere.
    fn opening(&self, spool_v: f64, near: &mut usize) -> (Opening<f64>, [Option<On>; 2]) {
        let mut paths = [None; 2];
        let mut next = paths.iter_mut();
        let opening = self.plant.opening_by(spool_v, |w| {
            let on = self.on(w, *near);
            *near = on.piece;
            next.by_ref().take(1).for_each(|path| *path = Some(on));
            self.magnitude(on)
        });
        (opening, paths)
    }

    fn side(&self, w: f64) -> &[OpeningPiece<f64>] {
        &self.pieces[usize::from(w >= 0.0)]
    }

    /// Where an effective command in V is, most likely on a piece nearby.
    fn on(&self, w: f64, near: usize) -> On {
        let (side, distance) = (self.side(w), w.abs());
        let is_there = side.get(near).is_some_and(|piece| piece.from <= distance && distance < piece.to);
        let search = || side.partition_point(|piece| piece.to <= distance).min(side.len().saturating_sub(1));
        On { w, piece: if is_there { near } else { search() } }
    }

    /// The magnitude in rad.
    fn magnitude(&self, on: On) -> f64 {
        match self.side(on.w).get(on.piece) {
            Some(piece) => piece.at(on.w.abs().min(piece.to)).0,
            None => self.plant.magnitude(on.w),
        }
    }

    /// Which pieces another curve has otherwise, if the same commands lead to the same pieces.
    fn other_pieces(&self, other: &Self) -> Option<[Vec<bool>; 2]> {
        let joined_alike = |[one, other]: [&OpeningPiece<f64>; 2]| one.from == other.from && one.to == other.to;
        let of_side = |side: usize| {
            let (own, others) = (&self.pieces[side], &other.pieces[side]);
            let pairs = || own.iter().zip(others).map(|(one, other)| [one, other]);
            let alike = own.len() == others.len() && !own.is_empty() && pairs().all(joined_alike);
            alike.then(|| pairs().map(|[one, other]| one != other).collect())
        };
        let [own, others] = [self, other].map(|one| (one.plant.dead_zone(), one.plant.exhaust_zone()));
        if own != others {
            return None;
        }
        Some([of_side(0)?, of_side(1)?])
    }
}

/// Where on its curve a plant's opening is while the spool is at its places.
pub(super) struct Along<'a> {
    characteristic: Characteristic<'a>,
    places: Arc<Places>,
    /// For each part: the opening, and where its paths are.
    parts: Vec<(Opening<f64>, [Option<On>; 2])>,
}

impl<'a> Along<'a> {
    pub(super) fn of(plant: &'a Plant<f64>, places: Arc<Places>) -> Self {
        let characteristic = Characteristic::of(plant);
        let mut near = 0;
        let parts = places.parts.iter().map(|(place, _)| characteristic.opening(*place, &mut near)).collect();
        Self { characteristic, places, parts }
    }

    /// The changes to the openings of a plant with other values in a table, its spool at the same places; `None` if it differs
    /// otherwise. A point of a table moves few pieces of the curve: all else is passed over.
    pub(super) fn changes_to(&self, other: &Plant<f64>, record: &Record) -> Option<Openings> {
        let (own, others) = (&self.characteristic, Characteristic::of(other));
        let pieces = own.other_pieces(&others).filter(|_| Travel::of(own.plant) == Travel::of(other))?;
        let change = |on: On| {
            let differs = pieces[usize::from(on.w >= 0.0)][on.piece];
            if differs { others.magnitude(on) - own.magnitude(on) } else { 0.0 }
        };
        let apart = other.exhaust_zone().is_some();
        Some(Openings::averaged(&self.places, record, apart, |part| {
            let (opening, [filling, exhausting]) = self.parts[part];
            let filling = filling.map_or(0.0, change);
            let magnitudes = (filling, exhausting.map_or(filling, change));
            signed(&Opening { magnitude: magnitudes.0, exhaust: magnitudes.1, ..opening })
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::prepare::prepare;
    use crate::data::split::Stretch;
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
