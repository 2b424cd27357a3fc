//! The valve's openings where its spool is: dead zone, then `atan(2 w)` or a table.

use super::valve::{Places, Travel, places};
use crate::data::record::Record;
use plant_model::dead_zone::DeadZone;
use plant_model::valve_flow::Opening;
use plant_model::{OpeningCurve, OpeningPiece, OpeningPoints, Plant, Side};
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

/// By how much the monotone cubic through the points of a table differs from straight lines, with the signs of the openings; `None`
/// without a table.
pub(super) fn bends(record: &Record, plant: &Plant<f64>) -> Option<Openings> {
    let Some(OpeningCurve::Points(points)) = plant.opening_curve() else { return None };
    let [straight, cubic] =
        [0.0, 1.0].map(|smoothness| Characteristic::through(plant, &points.with_smoothness(smoothness)));
    let (mut near, places) = (0, places(record, plant, None));
    Some(Openings::averaged(&places, record, plant.exhaust_zone().is_some(), |part| {
        let bend = |w: f64| {
            let on = straight.on(w, near);
            near = on.piece;
            (cubic.magnitude(on) - straight.magnitude(on)).abs()
        };
        signed(&plant.opening_by(places.parts[part].0, bend))
    }))
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
        match plant.opening_curve() {
            Some(OpeningCurve::Points(points)) => Self::through(plant, points),
            _ => Self { plant, pieces: [Vec::new(), Vec::new()] },
        }
    }

    /// Of a plant's valve with other points, or another curve through its own.
    fn through(plant: &'a Plant<f64>, points: &OpeningPoints<f64>) -> Self {
        Self { plant, pieces: [false, true].map(|positive| points.pieces(positive).collect()) }
    }

    /// The opening with the spool at a place in V, beginning on a piece nearby: spools move slowly. And where on the curve the
    /// path is that fills a chamber, and the one that exhausts if it is elsewhere.
    fn opening(&self, spool_v: f64, near: &mut usize) -> (Opening<f64>, (On, Option<On>)) {
        let mut paths = (None, None);
        let opening = self.plant.opening_by(spool_v, |w| {
            let on = self.on(w, *near);
            *near = on.piece;
            if paths.0.is_none() {
                paths.0 = Some(on)
            } else {
                paths.1 = Some(on)
            }
            self.magnitude(on)
        });
        (opening, (paths.0.unwrap_or(On { w: opening.w, piece: *near }), paths.1))
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
        Some([of_side(0)?, of_side(1)?])
    }

    /// The opening in rad, negative for negative commands.
    fn signed(&self, on: On) -> f64 {
        if on.w >= 0.0 { self.magnitude(on) } else { -self.magnitude(on) }
    }
}

/// Where on its curve a plant's opening is while the spool is at its places.
pub(super) struct Along<'a> {
    characteristic: Characteristic<'a>,
    places: Arc<Places>,
    /// For each part: where the path is that fills a chamber, and the one that exhausts if it is elsewhere.
    parts: Vec<(On, Option<On>)>,
}

impl<'a> Along<'a> {
    pub(super) fn of(plant: &'a Plant<f64>, places: Arc<Places>) -> Self {
        let characteristic = Characteristic::of(plant);
        let mut near = 0;
        let parts = places.parts.iter().map(|(place, _)| characteristic.opening(*place, &mut near).1).collect();
        Self { characteristic, places, parts }
    }

    /// The changes to the openings of a plant with another dead zone, or other openings in its table, its spool at the same places;
    /// `None` if it differs otherwise. Both move the opening in a few places of the spool: all others are passed over.
    pub(super) fn changes_to(&self, other: &Plant<f64>, record: &Record) -> Option<Openings> {
        let (own, others) = (&self.characteristic, Characteristic::of(other));
        let exhaust = [own.plant.exhaust_zone(), other.exhaust_zone()];
        let alike = exhaust[0].is_some() == exhaust[1].is_some() && Travel::of(own.plant) == Travel::of(other);
        let pieces = own.other_pieces(&others).filter(|_| alike)?;
        let differs = |zones: [DeadZone<f64>; 2]| (zones[0] != zones[1]).then_some(zones[1]);
        let filling_zone = differs([*own.plant.dead_zone(), *other.dead_zone()]);
        let exhausting_zone = exhaust[0].zip(exhaust[1]).and_then(|(own, other)| differs([own, other]));
        // The command in the other zone, and the change.
        let change = |on: On, zone: Option<&DeadZone<f64>>, place: f64| {
            let w = zone.map_or(on.w, |zone| zone.output_v(place));
            if w != on.w {
                (w, others.signed(others.on(w, on.piece)) - own.signed(on))
            } else if pieces[usize::from(w >= 0.0)][on.piece] {
                (w, others.signed(on) - own.signed(on))
            } else {
                (w, 0.0)
            }
        };
        Some(Openings::averaged(&self.places, record, exhaust[0].is_some(), |part| {
            let (place, (filling, exhausting)) = (self.places.parts[part].0, self.parts[part]);
            let fill = change(filling, filling_zone.as_ref(), place);
            let Some(exhausting) = exhausting else { return [fill.1; 2] };
            let exhaust = change(exhausting, exhausting_zone.as_ref(), place);
            // A path that is closed does not say which way the others are open.
            let fills_a = [filling.w, exhausting.w, fill.0, exhaust.0].into_iter().all(|w| w >= 0.0);
            if fills_a { [fill.1, exhaust.1] } else { [exhaust.1, fill.1] }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::prepare::prepare;
    use crate::data::split::Stretch;
    use plant_model::{Effect, Effects, OpeningTable};
    use rig_files::{Log, RigFile};
    use std::path::Path as FilePath;

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

    #[test]
    fn changes_of_a_table_or_a_dead_zone_are_differences_of_openings() {
        let sheet = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("../rigs/festo-dsbc-32-200.toml");
        let mut file = RigFile::read(&sheet).unwrap();
        (file.rig.valve.corner_rounding_v, file.rig.valve.opening_smoothness) = (0.05, 0.7);
        // With an overlap: where a curve passes through zero corners change nothing.
        let points = [[-5.0, -1.0], [-2.0, -0.5], [-0.4, 0.0], [0.5, 0.0], [1.0, 0.1], [3.0, 0.8], [4.5, 1.0]];
        file.rig.opening = OpeningTable::new(&points).unwrap();
        (file.rig.valve.dead_zone_left_v, file.rig.valve.dead_zone_right_v) = (-0.4, 0.5);
        let t_s: Vec<f64> = (0..3000).map(|k| 1.0e-3 * f64::from(k)).collect();
        let u_v = t_s.iter().map(|t| 1.7 * (1.5 * t).sin() + 2.9 * (31.0 * t).sin()).collect();
        let log = Log { y_m: vec![0.0; t_s.len()], u_v: Some(u_v), t_s, ..Log::default() };
        let record = prepare(&log, &file);
        type Change = (&'static str, fn(&mut plant_model::Rig<f64>));
        let changes: [Change; 5] = [
            ("a point", |rig| rig.opening.set_opening(1, -0.52)),
            ("the first point of a side", |rig| rig.opening.set_opening(4, 0.11)),
            ("corners", |rig| rig.valve.corner_rounding_v *= 1.2),
            ("the cubic's part", |rig| rig.valve.opening_smoothness += 0.1),
            ("edges", |rig| rig.valve.exhaust_overlap_v += 0.003),
        ];
        for overlap_v in [0.0, 0.01] {
            file.rig.valve.exhaust_overlap_v = overlap_v;
            let plant = Plant::new(&file.rig, &Effects::none()).unwrap();
            let at = Arc::new(places(&record, &plant, None));
            let (as_is, along) = (openings_at(&at, &record, &plant), Along::of(&plant, Arc::clone(&at)));
            for (what, change) in changes {
                let mut rig = file.rig;
                change(&mut rig);
                let other = Plant::new(&rig, &Effects::none()).unwrap();
                let Some(found) = along.changes_to(&other, &record) else {
                    assert!(what == "edges" && overlap_v == 0.0, "{what}, edges {overlap_v} V apart: not found");
                    continue;
                };
                let exact = super::changes([&as_is, &openings_at(&at, &record, &other)]);
                for side in [Side::A, Side::B] {
                    let pairs = || found.of(side).iter().zip(exact.of(side));
                    assert!(
                        pairs().all(|(found, exact)| (found - exact).abs() < 1.0e-12),
                        "{what}, {overlap_v}, {side:?}"
                    );
                    let moved = pairs().filter(|(_, exact)| exact.abs() > 1.0e-6).count();
                    assert!(moved > 0, "{what} changes nothing");
                }
            }
        }
    }
}
