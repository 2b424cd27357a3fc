//! The valve's openings where its spool is: dead zone, then `atan(2 w)` or a table.

use super::valve::{Travel, Way, way};
use crate::data::record::Record;
use plant_model::dead_zone::DeadZone;
use plant_model::{OpeningCurve, OpeningPiece, OpeningPoints, Plant, Side};
use std::sync::Arc;

/// The parameters that the openings of a chamber's paths depend on.
#[derive(PartialEq)]
pub(super) struct Path {
    dead_zone: DeadZone<f64>,
    /// And whose path it is: without it those of both chambers are the same.
    exhaust_zone: Option<(DeadZone<f64>, Side)>,
    curve: Option<OpeningCurve<f64>>,
    travel: Travel,
}

impl Path {
    pub(super) fn of(plant: &Plant<f64>, side: Side) -> Self {
        Self {
            dead_zone: plant.coefficients().dead_zone,
            exhaust_zone: plant.exhaust_zone().map(|zone| (zone, side)),
            curve: plant.opening_curve().copied(),
            travel: Travel::of(plant, side),
        }
    }
}

/// Signed openings of the paths of both chambers in rad by sample, positive where A is filled and B exhausted, averaged over the
/// interval after each; NaN where they are not known. Or changes of them.
pub(crate) struct Openings([Arc<Vec<f64>>; 2]);

impl Openings {
    /// Of a chamber's paths.
    pub(crate) fn of(&self, side: Side) -> &[f64] {
        &self.0[side as usize]
    }

    /// Of a plant, as made for each chamber.
    pub(super) fn of_plant(plant: &Plant<f64>, made: impl Fn(Side) -> Arc<Vec<f64>>) -> Self {
        Self(of_both(plant, made))
    }
}

/// What is made of the paths of A and of B, for both at once where their openings are the same.
fn of_both<T>(plant: &Plant<f64>, made: impl Fn(Side) -> Arc<T>) -> [Arc<T>; 2] {
    let a = made(Side::A);
    let alike = Path::of(plant, Side::A) == Path::of(plant, Side::B);
    let b = if alike { Arc::clone(&a) } else { made(Side::B) };
    [a, b]
}

/// Means over the intervals behind samples of what is at the spool's places on its way.
fn averaged(way: &Way, record: &Record, mut at: impl FnMut(f64) -> f64) -> Vec<f64> {
    let mean = |(k, parts): (usize, &[(f64, f64)])| {
        let sum: f64 = parts.iter().map(|(place, duration_s)| at(*place) * duration_s).sum();
        if parts.is_empty() { f64::NAN } else { sum / interval_s(record, k) }
    };
    way.by_sample().enumerate().map(mean).collect()
}

/// The interval after a sample as the parts of it add up, s.
fn interval_s(record: &Record, k: usize) -> f64 {
    let from = record.t_s[k];
    (from + record.interval_s(k) - from).max(1.0e-9)
}

/// The openings over all of a log.
pub(crate) fn openings(record: &Record, plant: &Plant<f64>) -> Openings {
    Openings::of_plant(plant, |side| Arc::new(openings_along(&way(record, plant, side, None), record, (plant, side))))
}

/// The openings of a chamber's paths with the spool on its way.
pub(super) fn openings_along(way: &Way, record: &Record, (plant, side): (&Plant<f64>, Side)) -> Vec<f64> {
    let characteristic = Characteristic::of(plant);
    let (mut near, mut last) = (0, (f64::NAN, 0.0));
    averaged(way, record, |place| {
        if place != last.0 {
            let on = characteristic.path(side, place, &mut near);
            last = (place, on.signed(characteristic.magnitude(on)));
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
    let bends = |side: Side| {
        let mut near = 0;
        averaged(&way(record, plant, side, None), record, |place| {
            let on = straight.path(side, place, &mut near);
            on.signed((cubic.magnitude(on) - straight.magnitude(on)).abs())
        })
    };
    Some(Openings::of_plant(plant, |side| Arc::new(bends(side))))
}

/// Changes from some openings to others.
pub(super) fn changes([from, to]: [&Openings; 2]) -> Openings {
    let change = |side: Side| Arc::new(to.of(side).iter().zip(from.of(side)).map(|(to, from)| to - from).collect());
    let alike = [from, to].iter().all(|openings| Arc::ptr_eq(&openings.0[0], &openings.0[1]));
    let a: Arc<Vec<f64>> = change(Side::A);
    let b = if alike { Arc::clone(&a) } else { change(Side::B) };
    Openings([a, b])
}

/// Openings of the paths of A and of B in rad at a place of the spool in V; positive where A is filled and B exhausted.
pub(super) fn signed_openings(plant: &Plant<f64>, spool_v: f64) -> [f64; 2] {
    let opening = plant.opening(spool_v);
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

impl On {
    /// A magnitude with the sign of the opening here.
    fn signed(self, magnitude: f64) -> f64 {
        if self.w >= 0.0 { magnitude } else { -magnitude }
    }
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

    /// Where on the curve a chamber's open path is with the spool at a place in V; most likely on a piece nearby, as spools move slowly.
    #[inline]
    fn path(&self, side: Side, spool_v: f64, near: &mut usize) -> On {
        let filling_v = effective_v(&self.dead_zone, spool_v);
        let w = self.exhaust_zone.as_ref().map_or(filling_v, |zone| {
            let exhausting_v = effective_v(zone, spool_v);
            // A path that is closed does not say which way the others are open.
            let fills_a = filling_v >= 0.0 && exhausting_v >= 0.0;
            if fills_a == (side == Side::A) { filling_v } else { exhausting_v }
        });
        let on = self.on(w, *near);
        *near = on.piece;
        on
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

/// Where on a table of openings the paths are while the spool is on its way.
pub(super) struct Along<'a> {
    characteristic: Characteristic<'a>,
    /// Of the paths of A and of B.
    moments: [Arc<Moments>; 2],
}

/// Samples with their spool on a piece, and the means over the interval of the powers 0 to 3 of the distance from where the piece
/// begins, V, with the signs of the openings.
type OnPiece = Vec<(usize, [f64; 4])>;

/// Those of a chamber's paths. Openings are sums of the powers' means.
struct Moments {
    /// By pieces of the curve, those of negative and of positive commands.
    on: [Vec<OnPiece>; 2],
    /// No changes: zero, or NaN where openings are not known.
    none: Vec<f64>,
}

impl Moments {
    fn of(characteristic: &Characteristic<'_>, side: Side, way: &Way, record: &Record) -> Self {
        let of_row = |parts: &[(f64, f64)]| if parts.is_empty() { f64::NAN } else { 0.0 };
        let on = characteristic.pieces.each_ref().map(|pieces| vec![Vec::new(); pieces.len()]);
        let mut out = Self { on, none: way.by_sample().map(of_row).collect() };
        let mut near = 0;
        for (k, parts) in way.by_sample().enumerate() {
            let interval_s = interval_s(record, k);
            for (place, duration_s) in parts {
                out.add(characteristic, characteristic.path(side, *place, &mut near), (k, duration_s / interval_s));
            }
        }
        out
    }

    fn add(&mut self, characteristic: &Characteristic<'_>, on: On, (sample, share): (usize, f64)) {
        let Some(piece) = characteristic.side(on.w).get(on.piece) else { return };
        let there = &mut self.on[usize::from(on.w >= 0.0)][on.piece];
        if there.last().is_none_or(|(last, _)| *last != sample) {
            there.push((sample, [0.0; 4]));
        }
        let x = on.w.abs().min(piece.to) - piece.from;
        let mut power = on.signed(share);
        for moment in there.last_mut().iter_mut().flat_map(|(_, moments)| moments) {
            *moment += power;
            power *= x;
        }
    }

    /// What other pieces change of openings, sample by sample.
    fn changes(&self, [own, others]: [&Characteristic<'_>; 2]) -> Vec<f64> {
        let mut changes = self.none.clone();
        for side in [0, 1] {
            for ((of_piece, own), other) in self.on[side].iter().zip(&own.pieces[side]).zip(&others.pieces[side]) {
                if own == other {
                    continue;
                }
                let by: [f64; 4] = core::array::from_fn(|power| other.coefficients[power] - own.coefficients[power]);
                for (sample, moments) in of_piece {
                    changes[*sample] += moments.iter().zip(by).map(|(moment, by)| moment * by).sum::<f64>();
                }
            }
        }
        changes
    }
}

impl<'a> Along<'a> {
    /// `None` without a table. `way`: of the spool, as a chamber feels it.
    pub(super) fn of(plant: &'a Plant<f64>, way: impl Fn(Side) -> Arc<Way>, record: &Record) -> Option<Self> {
        let characteristic = Characteristic::of(plant);
        if characteristic.pieces.iter().all(Vec::is_empty) {
            return None;
        }
        let moments = of_both(plant, |side| Arc::new(Moments::of(&characteristic, side, &way(side), record)));
        Some(Self { characteristic, moments })
    }

    /// The changes to the openings of a plant with other openings in its table, its spool at the same places; `None` if it differs
    /// otherwise.
    pub(super) fn changes_to(&self, other: &Plant<f64>) -> Option<Openings> {
        let (own, others) = (&self.characteristic, Characteristic::of(other));
        let but_curve = |plant: &Plant<f64>, side: Side| Path { curve: None, ..Path::of(plant, side) };
        let as_they_are = [Side::A, Side::B].iter().all(|side| but_curve(own.plant, *side) == but_curve(other, *side));
        let change = |side: Side| Arc::new(self.moments[side as usize].changes([own, &others]));
        (as_they_are && own.joined_like(&others)).then(|| Openings(of_both(other, change)))
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
            let some = openings_along(&way(&record, &plant, Side::A, Some(&stretches)), &record, (&plant, Side::A));
            for (k, (one, other)) in all.of(Side::A).iter().zip(&some).enumerate() {
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
            let way = |side: Side| Arc::new(way(&record, &plant, side, None));
            let (as_is, along) = (openings(&record, &plant), Along::of(&plant, way, &record).expect("a table"));
            // A path followed piece by piece is where the plant's opening is, to the last bit.
            let (characteristic, mut near) = (Characteristic::of(&plant), [0; 2]);
            for spool_v in (-600..600).map(|k| 0.01 * f64::from(k)) {
                let opening = [Side::A, Side::B].map(|side| {
                    let on = characteristic.path(side, spool_v, &mut near[side as usize]);
                    on.signed(characteristic.magnitude(on))
                });
                assert_eq!(opening, signed_openings(&plant, spool_v), "{spool_v} V");
            }
            for (what, change) in changes {
                let mut rig = file.rig;
                change(&mut rig);
                let other = Plant::new(&rig, &Effects::none()).unwrap();
                let found = along.changes_to(&other).expect(what);
                let exact = super::changes([&as_is, &openings(&record, &other)]);
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
