//! The valve's openings where its spool is: dead zone, then `atan(2 w)` or a table.

use super::valve::{Places, Travel, Way, places};
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

    /// Means over the intervals of what the paths of A and B have at the spool's places; those of B are their own if the paths are
    /// apart, or if B feels the spool at another time.
    fn averaged(places: &Places, record: &Record, apart: bool, mut at: impl FnMut(f64) -> [f64; 2]) -> Self {
        let [a, b] = Self::along(&places.a, record, apart, &mut at);
        match &places.b {
            Some(way) => Self { a, b: Self::along(way, record, true, &mut at)[1].clone() },
            None => Self { a, b },
        }
    }

    /// The same for both sides, with the spool on one way.
    fn along(way: &Way, record: &Record, apart: bool, at: &mut impl FnMut(f64) -> [f64; 2]) -> [Arc<Vec<f64>>; 2] {
        let rows = way.ends.len();
        let (mut a, mut b) = (Vec::with_capacity(rows), Vec::with_capacity(if apart { rows } else { 0 }));
        for (k, parts) in way.by_sample().enumerate() {
            let mut sum = [0.0; 2];
            for (place, duration_s) in parts {
                let here = at(*place);
                sum = [sum[0] + here[0] * duration_s, sum[1] + here[1] * duration_s];
            }
            let interval_s = Self::interval_s(record, k);
            let mean = |sum: f64| if parts.is_empty() { f64::NAN } else { sum / interval_s };
            a.push(mean(sum[0]));
            if apart {
                b.push(mean(sum[1]));
            }
        }
        let a = Arc::new(a);
        let b = if apart { Arc::new(b) } else { Arc::clone(&a) };
        [a, b]
    }

    /// The interval after a sample as the parts of it add up, s.
    fn interval_s(record: &Record, k: usize) -> f64 {
        let from = record.t_s[k];
        (from + record.interval_s(k) - from).max(1.0e-9)
    }
}

/// The openings over all of a log.
pub(crate) fn openings(record: &Record, plant: &Plant<f64>) -> Openings {
    openings_at(&places(record, plant, None), record, plant)
}

/// The openings where the spool is.
pub(super) fn openings_at(places: &Places, record: &Record, plant: &Plant<f64>) -> Openings {
    let characteristic = Characteristic::of(plant);
    let (mut near, mut last) = ([0; 2], (f64::NAN, [0.0; 2]));
    Openings::averaged(places, record, characteristic.exhaust_zone.is_some(), |place| {
        if place != last.0 {
            last = (
                place,
                characteristic.signed(characteristic.paths(place, &mut near), |on| characteristic.magnitude(on)),
            );
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
    let (mut near, places) = ([0; 2], places(record, plant, None));
    let bend = |on: On| (cubic.magnitude(on) - straight.magnitude(on)).abs();
    Some(Openings::averaged(&places, record, straight.exhaust_zone.is_some(), |place| {
        straight.signed(straight.paths(place, &mut near), bend)
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
    let [a, b] = [opening.through(opening.fills_a), opening.through(!opening.fills_a)];
    if opening.fills_a { [a, b] } else { [-a, -b] }
}

/// The curve of a plant's opening, a table in pieces.
struct Characteristic<'a> {
    plant: &'a Plant<f64>,
    dead_zone: DeadZone<f64>,
    /// Of the paths to atmosphere, if it is another.
    exhaust_zone: Option<DeadZone<f64>>,
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

/// The effective command of a dead zone in V: [`DeadZone::output_v`]. Most places of the spool are beyond the rounding of its corners;
/// the shorter way there takes a twentieth off a diagnosis with a table.
#[inline]
fn effective_v(zone: &DeadZone<f64>, spool_v: f64) -> f64 {
    let [right, left] = [spool_v - zone.right_v, spool_v - zone.left_v];
    if right >= zone.rounding_v {
        zone.slope_right * right
    } else if left <= -zone.rounding_v {
        zone.slope_left * left
    } else {
        zone.output_v(spool_v)
    }
}

impl<'a> Characteristic<'a> {
    fn of(plant: &'a Plant<f64>) -> Self {
        match plant.opening_curve() {
            Some(OpeningCurve::Points(points)) => Self::through(plant, points),
            _ => Self::with(plant, [Vec::new(), Vec::new()]),
        }
    }

    /// Of a plant's valve with other points, or another curve through its own.
    fn through(plant: &'a Plant<f64>, points: &OpeningPoints<f64>) -> Self {
        Self::with(plant, [false, true].map(|positive| points.pieces(positive).collect()))
    }

    fn with(plant: &'a Plant<f64>, pieces: [Vec<OpeningPiece<f64>>; 2]) -> Self {
        Self { plant, dead_zone: *plant.dead_zone(), exhaust_zone: plant.exhaust_zone(), pieces }
    }

    /// Where on the curve the path is that fills a chamber, and the one that exhausts if it is elsewhere, with the spool at a place in V;
    /// most likely on pieces nearby, as spools move slowly.
    fn paths(&self, spool_v: f64, near: &mut [usize; 2]) -> (On, Option<On>) {
        let on = |zone: &DeadZone<f64>, near: &mut usize| {
            let on = self.on(effective_v(zone, spool_v), *near);
            *near = on.piece;
            on
        };
        let [filling, exhausting] = near;
        (on(&self.dead_zone, filling), self.exhaust_zone.as_ref().map(|zone| on(zone, exhausting)))
    }

    /// Openings of the paths of A and of B in rad, of such magnitudes; positive where A is filled and B exhausted.
    fn signed(&self, (filling, exhausting): (On, Option<On>), magnitude: impl Fn(On) -> f64) -> [f64; 2] {
        let at = |on: On| Opening::open(on.w, magnitude(on));
        let opening = at(filling);
        signed(&exhausting.map_or(opening, |exhausting| opening.with_exhaust(&at(exhausting))))
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

    /// Whether both are tables, and the same commands lead to the same pieces of them.
    fn joined_like(&self, other: &Self) -> bool {
        let joined_alike =
            |(one, other): (&OpeningPiece<f64>, &OpeningPiece<f64>)| one.from == other.from && one.to == other.to;
        self.pieces.iter().zip(&other.pieces).all(|(own, others)| {
            own.len() == others.len() && !own.is_empty() && own.iter().zip(others).all(joined_alike)
        })
    }
}

/// Where on a table of openings the paths are while the spool is at its places.
pub(super) struct Along<'a> {
    characteristic: Characteristic<'a>,
    /// No changes: zero, or NaN where openings are not known.
    none: Vec<f64>,
    /// Of the paths of A, and of B if they are apart.
    moments: Vec<Moments>,
}

/// Samples with their spool on a piece, and the means over the interval of the powers 0 to 3 of the distance from where the piece
/// begins, V, with the signs of the openings.
type OnPiece = Vec<(usize, [f64; 4])>;

/// By pieces of the curve, those of negative and of positive commands. Openings are sums of the powers' means.
struct Moments([Vec<OnPiece>; 2]);

impl Moments {
    fn add(&mut self, characteristic: &Characteristic<'_>, on: On, (sample, share): (usize, f64)) {
        let Some(piece) = characteristic.side(on.w).get(on.piece) else { return };
        let there = &mut self.0[usize::from(on.w >= 0.0)][on.piece];
        if there.last().is_none_or(|(last, _)| *last != sample) {
            there.push((sample, [0.0; 4]));
        }
        let x = on.w.abs().min(piece.to) - piece.from;
        let mut power = if on.w >= 0.0 { share } else { -share };
        for moment in there.last_mut().iter_mut().flat_map(|(_, moments)| moments) {
            *moment += power;
            power *= x;
        }
    }

    /// Adds what other pieces make of openings, sample by sample.
    fn add_changes([own, others]: [&Characteristic<'_>; 2], moments: &Self, to: &mut [f64]) {
        for side in [0, 1] {
            for ((of_piece, own), other) in moments.0[side].iter().zip(&own.pieces[side]).zip(&others.pieces[side]) {
                if own == other {
                    continue;
                }
                let by: [f64; 4] = core::array::from_fn(|power| other.coefficients[power] - own.coefficients[power]);
                for (sample, moments) in of_piece {
                    to[*sample] += moments.iter().zip(by).map(|(moment, by)| moment * by).sum::<f64>();
                }
            }
        }
    }
}

impl<'a> Along<'a> {
    /// `None` without a table.
    pub(super) fn of(plant: &'a Plant<f64>, places: &Places, record: &Record) -> Option<Self> {
        let characteristic = Characteristic::of(plant);
        if characteristic.pieces.iter().all(Vec::is_empty) {
            return None;
        }
        let empty = || Moments(characteristic.pieces.each_ref().map(|pieces| vec![Vec::new(); pieces.len()]));
        let [mut of_a, mut of_b] = [(); 2].map(|()| empty());
        let add = |way: &Way, mut to: [Option<&mut Moments>; 2]| {
            let mut near = [0; 2];
            for (k, parts) in way.by_sample().enumerate() {
                let interval_s = Openings::interval_s(record, k);
                for (place, duration_s) in parts {
                    let (filling, exhausting) = characteristic.paths(*place, &mut near);
                    let exhausting = exhausting.unwrap_or(filling);
                    // A path that is closed does not say which way the others are open.
                    let fills_a = filling.w >= 0.0 && exhausting.w >= 0.0;
                    let of_a_and_b = if fills_a { [filling, exhausting] } else { [exhausting, filling] };
                    for (moments, on) in to.iter_mut().zip(of_a_and_b) {
                        if let Some(moments) = moments {
                            moments.add(&characteristic, on, (k, duration_s / interval_s));
                        }
                    }
                }
            }
        };
        let has_own_edges = characteristic.exhaust_zone.is_some();
        match &places.b {
            Some(b) => {
                add(&places.a, [Some(&mut of_a), None]);
                add(b, [None, Some(&mut of_b)]);
            }
            None => add(&places.a, [Some(&mut of_a), has_own_edges.then_some(&mut of_b)]),
        }
        let of_row = |parts: &[(f64, f64)]| if parts.is_empty() { f64::NAN } else { 0.0 };
        let none = places.a.by_sample().map(of_row).collect();
        let moments = if has_own_edges || places.b.is_some() { vec![of_a, of_b] } else { vec![of_a] };
        Some(Self { characteristic, none, moments })
    }

    /// The changes to the openings of a plant with other openings in its table, its spool at the same places; `None` if it differs
    /// otherwise.
    pub(super) fn changes_to(&self, other: &Plant<f64>) -> Option<Openings> {
        let (own, others) = (&self.characteristic, Characteristic::of(other));
        let but_curve = |plant: &Plant<f64>| Path { curve: None, ..Path::of(plant) };
        (but_curve(own.plant) == but_curve(other) && own.joined_like(&others)).then(|| self.changes_by_pieces(&others))
    }

    /// The changes by other pieces with the spool and the dead zone as they are.
    fn changes_by_pieces(&self, others: &Characteristic<'_>) -> Openings {
        let mut of_paths = self.moments.iter().map(|moments| {
            let mut changes = self.none.clone();
            Moments::add_changes([&self.characteristic, others], moments, &mut changes);
            Arc::new(changes)
        });
        let a = of_paths.next().unwrap_or_default();
        let b = of_paths.next().unwrap_or_else(|| Arc::clone(&a));
        Openings { a, b }
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
    fn the_chamber_behind_the_longer_hose_has_the_same_openings_later() {
        let mut file = RigFile::paper_b();
        let gas = file.rig.gas;
        let sound = (gas.heat_capacity_ratio * gas.gas_constant_j_per_kg_k * gas.temperature_k).sqrt();
        let hoses = &mut file.rig.hoses;
        (hoses.a_length_m, hoses.a_diameter_m, hoses.b_length_m, hoses.b_diameter_m) =
            (1.0e-3 * sound, 4.0e-3, 4.0e-3 * sound, 4.0e-3);
        let t_s: Vec<f64> = (0..600).map(|k| 1.0e-3 * f64::from(k)).collect();
        let u_v = t_s.iter().map(|t| 1.7 * (1.5 * t).sin() + 2.9 * (31.0 * t).sin()).collect();
        let record = prepare(&Log { y_m: vec![0.0; t_s.len()], u_v: Some(u_v), t_s, ..Log::default() }, &file);
        for lag_s in [0.0, 0.003] {
            let plant = Plant::new(&file.rig, &Effects::none().with(Effect::ValveLag, &[lag_s])).unwrap();
            let found = openings(&record, &plant);
            // The valve is known some time after the log begins.
            for k in 100..600 {
                let (late, early) = (found.of(Side::B)[k], found.of(Side::A)[k - 3]);
                assert!((late - early).abs() < 1.0e-3, "lag {lag_s}, row {k}: {late} {early}");
            }
        }
    }

    #[test]
    fn changes_of_a_table_are_differences_of_openings() {
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
        let changes: [Change; 3] = [
            ("a point", |rig| rig.opening.set_opening(1, -0.52)),
            ("the first point of a side", |rig| rig.opening.set_opening(4, 0.11)),
            ("the cubic's part", |rig| rig.valve.opening_smoothness += 0.1),
        ];
        for overlap_v in [0.0, 0.01] {
            file.rig.valve.exhaust_overlap_v = overlap_v;
            let plant = Plant::new(&file.rig, &Effects::none()).unwrap();
            let at = places(&record, &plant, None);
            let (as_is, along) = (openings_at(&at, &record, &plant), Along::of(&plant, &at, &record).expect("a table"));
            // A path followed piece by piece is where the plant's opening is, to the last bit.
            let (characteristic, mut near) = (Characteristic::of(&plant), [0; 2]);
            for spool_v in (-600..600).map(|k| 0.01 * f64::from(k)) {
                let paths = characteristic.paths(spool_v, &mut near);
                let opening = characteristic.signed(paths, |on| characteristic.magnitude(on));
                assert_eq!(opening, signed_openings(&plant, spool_v), "{spool_v} V");
            }
            for (what, change) in changes {
                let mut rig = file.rig;
                change(&mut rig);
                let other = Plant::new(&rig, &Effects::none()).unwrap();
                let found = along.changes_to(&other).expect(what);
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
            let mut other = file.rig;
            other.valve.corner_rounding_v *= 1.2;
            assert!(along.changes_to(&Plant::new(&other, &Effects::none()).unwrap()).is_none());
        }
    }
}
