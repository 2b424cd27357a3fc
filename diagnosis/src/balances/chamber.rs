//! The mass balance of one chamber: its pressure predicted from command, position and supply (3.2 to 3.7).

use super::compression::{Geometry, Place, Stroke};
use super::correction::Correction;
use super::decay::Decay;
use super::in_turns::{Prediction, halves, in_turns};
use super::initial_warmth::{self, InitialWarmth};
use super::judged::judged;
use crate::constants;
use crate::data::record::Record;
use crate::data::split::{Stretch, missing_between, samples};
use plant_model::{ChamberFlow, FirstOrderLag, Plant, Side, WallHeatLaw, Walls};
use std::sync::Arc;

/// The inputs of a chamber's balance over some stretches.
pub(crate) struct Drive<'a> {
    pub(crate) side: Side,
    /// What the piston's motion does there.
    pub(crate) compression: Arc<Vec<Stroke>>,
    /// How predictions are judged and corrected there.
    pub(crate) correction: Arc<Correction>,
    pub(crate) air: Air<'a>,
}

/// What lets air in and out of a chamber, one value per sample of the log.
#[derive(Clone, Copy)]
pub(crate) struct Air<'a> {
    /// Signed opening of the valve, rad.
    pub(crate) openings: &'a [f64],
    /// Supply pressure at the valve, Pa.
    pub(crate) supply_pa: &'a [f64],
    /// Mass flow into the chamber in addition to the model's, kg/s; empty for none.
    pub(crate) added_kg_per_s: &'a [f64],
}

/// Prediction errors of the pressures of the chambers that have a drive, in units of their noise and of what is not known of the
/// command: one for each row of the stretches.
///
/// Two predictions run [in turns](super::in_turns): those of both chambers, or of one chamber over the first and the second half of
/// the stretches.
pub(crate) fn innovations(
    record: &Record,
    plant: &Plant<f64>,
    stretches: &[Stretch],
    drives: [Option<&Drive<'_>>; 2],
) -> [Vec<f64>; 2] {
    // The air's temperature goes on from each stretch to the next.
    if plant.added().wall_heat.law.is_some() {
        let likeliest = |drive: &Drive<'_>| {
            let (mut errors, initial) = begun_cold(record, plant, stretches, drive);
            initial.take_out_of(&mut errors);
            errors
        };
        return drives.map(|drive| drive.map_or_else(Vec::new, likeliest));
    }
    let alone = |drive: &Drive<'_>| {
        in_turns(halves(stretches).map(|part| Pressure::new(record, plant, drive, part, 0.0))).concat()
    };
    match drives {
        [Some(a), Some(b)] => in_turns([a, b].map(|drive| Pressure::new(record, plant, drive, (stretches, 0), 0.0))),
        one => one.map(|drive| drive.map_or_else(Vec::new, alone)),
    }
}

/// Prediction errors of a chamber whose air has a temperature of its own, as cold as the supply where the log begins, and what other
/// [initial values](InitialWarmth) make of them.
pub(super) fn begun_cold(
    record: &Record,
    plant: &Plant<f64>,
    stretches: &[Stretch],
    drive: &Drive<'_>,
) -> (Vec<f64>, InitialWarmth) {
    let begun = |warmer: f64| Pressure::new(record, plant, drive, (stretches, 0), warmer);
    let [errors, of_warmer] = in_turns([0.0, initial_warmth::STEP].map(begun));
    let initial = InitialWarmth::of(record, stretches, [&errors, &of_warmer]);
    (errors, initial)
}

/// The prediction of a chamber's pressure over some stretches, one sample after the other.
pub(super) struct Pressure<'a> {
    pub(super) exchange: Exchange<'a>,
    pub(super) compression: &'a [Stroke],
    pub(super) correction: &'a Correction,
    /// Pressure as logged, Pa.
    measured: &'a [f64],
    pub(super) pressure_lag: FirstOrderLag<f64>,
    pub(super) decay: Option<Decay>,
    /// What is left behind the stretch at hand.
    stretches: &'a [Stretch],
    /// The sample at hand, and the end of its stretch.
    pub(super) k: usize,
    pub(super) end: usize,
    /// The sample's place in the compression and the correction.
    pub(super) place: usize,
    /// Pressure, and what its sensor has made of it so far, Pa.
    pub(super) p: f64,
    sensed: f64,
    pub(super) warmth: f64,
    /// By how much warmer the air is where the log begins and behind missing rows.
    warmer: f64,
    errors: Vec<f64>,
}

impl<'a> Pressure<'a> {
    /// Before the first sample of some stretches; second, its place in the drive's compression and correction.
    pub(super) fn new(
        record: &'a Record,
        plant: &'a Plant<f64>,
        drive: &'a Drive<'a>,
        (stretches, place): (&'a [Stretch], usize),
        warmer: f64,
    ) -> Self {
        let mut out = Self {
            exchange: Exchange::new(record, plant, drive.side, drive.air),
            compression: &drive.compression,
            correction: &drive.correction,
            measured: record.chamber(drive.side).p_pa,
            pressure_lag: plant.added().pressure_lag,
            decay: Decay::of(plant.added().pressure_lag.time_constant_s),
            stretches,
            k: 0,
            end: 0,
            place,
            p: 0.0,
            sensed: 0.0,
            warmth: warmer,
            warmer,
            errors: Vec::with_capacity(samples(stretches)),
        };
        out.next_stretch(0);
        out
    }

    /// Goes on to the next stretch. The air keeps its temperature, as known at a sample, over those between.
    fn next_stretch(&mut self, known: usize) {
        let Some((stretch, rest)) = self.stretches.split_first() else {
            (self.k, self.end) = (0, 0);
            return;
        };
        let Exchange { record, plant, side, air, law, .. } = self.exchange;
        let smooth = record.chamber(side).smooth;
        self.p = plant.true_pressure_pa(side, smooth.value[stretch.start], smooth.slope[stretch.start]);
        self.sensed = plant.pressure_behind_lag_pa(side, smooth.value[stretch.start]);
        if law.is_some() {
            let until = (stretch.start, warmth_stride(record.step_s));
            let between = warmths(record, plant, side, air, (known, self.warmth), until);
            self.warmth = between.last().copied().unwrap_or(0.0);
            if missing_between(&record.t_s, (known, stretch.start), record.quality.interval_s) {
                self.warmth += self.warmer;
            }
        }
        (self.k, self.end, self.stretches) = (stretch.start, stretch.end, rest);
    }
}

impl Prediction for Pressure<'_> {
    #[inline(always)]
    fn goes_on(&self) -> bool {
        self.k < self.end
    }

    #[inline(always)]
    fn step(&mut self) {
        self.judge();
        self.advance();
    }

    fn errors(self) -> Vec<f64> {
        self.errors
    }
}

impl Pressure<'_> {
    /// Judges the sample at hand and corrects the prediction.
    #[inline(always)]
    pub(super) fn judge(&mut self) {
        let Exchange { record, plant, side, .. } = self.exchange;
        let (k, place) = (self.k, self.place);
        if record.is_row(k) {
            let error = self.measured[k] - plant.shown_pressure_pa(side, self.sensed);
            let weight_per_pa = self.correction.weight_per_pa[place];
            self.errors.push(if weight_per_pa.is_nan() { f64::NAN } else { judged(error * weight_per_pa) });
            let drawn = error * self.correction.gain[place];
            self.p += drawn;
            self.sensed += drawn;
        }
    }

    /// Predicts the next sample.
    #[inline(always)]
    pub(super) fn advance(&mut self) {
        let (k, place) = (self.k, self.place);
        self.k += 1;
        self.place += 1;
        if self.k == self.end {
            self.next_stretch(k);
            return;
        }
        let (before, dt_s) = (self.p, self.exchange.record.interval_s(k));
        (self.p, self.warmth) = self.exchange.over(k, dt_s, &self.compression[place], (before, self.warmth));
        // The lag sees a pressure that changes linearly over the interval.
        let lag = self.pressure_lag;
        self.sensed = match &mut self.decay {
            Some(decay) => lag.over(self.sensed, [before, self.p], dt_s, decay.after(dt_s)),
            None => self.p,
        };
    }
}

/// The exchange of air and heat of one chamber from sample to sample.
pub(super) struct Exchange<'a> {
    pub(super) record: &'a Record,
    pub(super) plant: &'a Plant<f64>,
    pub(super) side: Side,
    pub(super) air: Air<'a>,
    pub(super) law: Option<&'a WallHeatLaw<f64>>,
    walls: Walls<f64>,
}

impl<'a> Exchange<'a> {
    #[inline(always)]
    fn new(record: &'a Record, plant: &'a Plant<f64>, side: Side, air: Air<'a>) -> Self {
        let law = plant.added().wall_heat.law.as_ref();
        Self { record, plant, side, air, law, walls: Walls::of(plant.area_m2(side)) }
    }

    /// Pressure in Pa and warmth of the air after `dt_s` with the valve as at sample `k`: half of the piston's way, the exchange,
    /// the other half.
    #[inline(always)]
    fn over(&self, k: usize, dt_s: f64, stroke: &Stroke, air_there: (f64, f64)) -> (f64, f64) {
        self.with_opening(self.air.openings[k], k, dt_s, stroke, air_there)
    }

    /// [`Exchange::over`] with a signed opening in rad in place of that at sample `k`.
    #[inline(always)]
    pub(super) fn with_opening(
        &self,
        opening: f64,
        k: usize,
        dt_s: f64,
        stroke: &Stroke,
        (mut p, mut warmth): (f64, f64),
    ) -> (f64, f64) {
        let Self { record, plant, side, air, .. } = *self;
        let is_a = side == Side::A;
        let beyond = if is_a { Side::B } else { Side::A };
        if let Some(law) = self.law {
            warmth = law.compressed(warmth, stroke.first_half);
        }
        p *= stroke.first_half;
        let fills = (opening >= 0.0) == is_a;
        let flow = plant.valve_inflow(side, stroke.y_m, fills, opening.abs(), p, air.supply_pa[k]);
        let mut flow = ChamberFlow { mass_flow: flow.mass_flow, by_chamber: flow.by_chamber, by_other: 0.0 };
        let other = record.chamber(side).other;
        let p_beyond = other.value.get(k).map(|value| plant.true_pressure_pa(beyond, *value, other.slope[k]));
        plant.add_flows(side, p, p_beyond, &mut flow);
        flow.mass_flow += air.added_kg_per_s.get(k).copied().unwrap_or(0.0);
        let factor = stroke.pa_s_per_kg;
        if let Some(law) = self.law {
            (p, warmth) = law.filled((p, warmth), &flow, factor, self.surface_per_m(stroke, dt_s), dt_s);
            warmth = law.compressed(warmth, stroke.second_half);
        } else {
            p += factor * flow.mass_flow / (1.0 - 0.5 * factor * flow.by_chamber);
        }
        ((p * stroke.second_half).max(1.0e3), warmth)
    }

    /// The pressure at a sample as measured, Pa.
    fn measured_pa(&self, k: usize) -> f64 {
        let smooth = self.record.chamber(self.side).smooth;
        self.plant.true_pressure_pa(self.side, smooth.value[k], smooth.slope[k])
    }

    /// Surface of the walls over the volume between two samples `dt_s` apart, 1/m.
    fn surface_per_m(&self, stroke: &Stroke, dt_s: f64) -> f64 {
        self.walls.surface_per_m(stroke.pa_s_per_kg / (self.plant.energy_j_per_kg() * dt_s))
    }
}

/// Warmth of a chamber's air at every so many samples (`stride`) from one where it is known up to an end and there, its pressure
/// as measured.
pub(crate) fn warmths(
    record: &Record,
    plant: &Plant<f64>,
    side: Side,
    air: Air<'_>,
    (start, warmth): (usize, f64),
    (end, stride): (usize, usize),
) -> Vec<f64> {
    let mut meanwhile = Meanwhile::new(record, plant, side, air, start);
    let mut out = vec![warmth];
    while meanwhile.k < end {
        let middle = meanwhile.towards((meanwhile.k + stride).min(end));
        let warmth = meanwhile.warmth(out[out.len() - 1], air.openings[middle]);
        out.push(warmth);
    }
    out
}

/// The warmth of a chamber's air with its pressure as measured, in steps of some samples.
pub(super) struct Meanwhile<'a> {
    exchange: Exchange<'a>,
    geometry: Geometry,
    /// The sample where the step at hand ends, and the piston's place there.
    pub(super) k: usize,
    here: Place,
    /// What happens on the step at hand: the sample in its middle, its duration in s, the stroke, the pressures before and after in
    /// Pa, and whether rows are missing there.
    middle: usize,
    dt_s: f64,
    stroke: Stroke,
    p_pa: [f64; 2],
    is_unknown: bool,
}

impl<'a> Meanwhile<'a> {
    /// Before the first step from a sample.
    pub(super) fn new(record: &'a Record, plant: &'a Plant<f64>, side: Side, air: Air<'a>, start: usize) -> Self {
        let geometry = Geometry::of(plant, side);
        let exchange = Exchange::new(record, plant, side, Air { added_kg_per_s: &[], ..air });
        let here = geometry.place(record, plant, start);
        let p = exchange.measured_pa(start);
        let stroke = geometry.stroke(here, here, 0.0);
        Self { exchange, geometry, k: start, here, middle: start, dt_s: 0.0, stroke, p_pa: [p; 2], is_unknown: false }
    }

    /// Begins the step to a sample; returns the one in the middle, whose opening counts.
    pub(super) fn towards(&mut self, next: usize) -> usize {
        let (record, k) = (self.exchange.record, self.k);
        let place = self.geometry.place(record, self.exchange.plant, next);
        self.dt_s = record.t_s[next] - record.t_s[k];
        self.stroke = self.geometry.stroke(self.here, place, self.dt_s);
        self.p_pa = [self.p_pa[1], self.exchange.measured_pa(next)];
        self.is_unknown = missing_between(&record.t_s, (k, next), record.quality.interval_s);
        self.middle = (k + next) / 2;
        (self.k, self.here) = (next, place);
        self.middle
    }

    /// The warmth after the step at hand, from that before.
    pub(super) fn warmth(&self, before: f64, opening: f64) -> f64 {
        let Self { exchange, stroke, dt_s, .. } = self;
        match exchange.law {
            Some(law) if self.is_unknown => {
                law.meanwhile(self.p_pa, before, exchange.surface_per_m(stroke, *dt_s), *dt_s)
            }
            _ => exchange.with_opening(opening, self.middle, *dt_s, stroke, (self.p_pa[0], before)).1,
        }
    }
}

/// Steps of about [`constants::warmth_step_s`], in samples.
pub(super) fn warmth_stride(step_s: f64) -> usize {
    ((constants::warmth_step_s() / step_s.max(1.0e-6)).round() as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::{opening, supply};
    use crate::data::prepare::prepare;
    use plant_model::{Effect, Effects, Simulator};
    use rig_files::{Log, RigFile};

    /// Root mean square error of the warmth of chamber A in a simulated log, relative to its size, followed in steps of so many
    /// rows, with 60 rows missing every two seconds or none.
    fn error_of_warmth(coefficient: f64, stride: usize, interrupted: bool) -> f64 {
        let file = RigFile::paper_b();
        let effects = Effects::none().with(Effect::WallHeat, &[coefficient]);
        let mut rig: Simulator<f64> = Simulator::new(&file.rig, &effects).unwrap();
        let mut log = Log { u_v: Some(vec![]), p_a_pa: Some(vec![]), p_b_pa: Some(vec![]), ..Log::default() };
        let mut truth = Vec::new();
        for k in 0..12_000_u32 {
            let t_s = 1.0e-3 * f64::from(k);
            let u_v = 0.4 * (2.0 * t_s).sin() + 0.8 * (11.0 * t_s).sin();
            if !interrupted || k % 2000 < 1940 {
                let m = rig.measure();
                log.t_s.push(t_s);
                log.y_m.push(m.y_m);
                for (column, value) in [(&mut log.u_v, u_v), (&mut log.p_a_pa, m.p_a_pa), (&mut log.p_b_pa, m.p_b_pa)] {
                    column.get_or_insert_default().push(value);
                }
                truth.push(rig.state().warmth_a);
            }
            rig.advance(u_v, 1.0e-3);
        }
        let record = prepare(&log, &file);
        assert_eq!(record.len(), truth.len());
        let truth: Vec<f64> =
            (0..record.len() + stride - 1).step_by(stride).map(|k| truth[k.min(truth.len() - 1)]).collect();
        let plant = Plant::new(&file.rig, &effects).unwrap();
        let openings = opening::openings(&record, &plant);
        let supply_pa = supply::pressures(&record, &plant, &openings, 0.0).at_valve;
        let air = Air { openings: openings.of(Side::A), supply_pa: &supply_pa, added_kg_per_s: &[] };
        let found = warmths(&record, &plant, Side::A, air, (0, 0.0), (record.len() - 1, stride));
        let size: f64 = truth.iter().map(|x| x * x).sum();
        let error: f64 = found.iter().zip(&truth).map(|(x, y)| (x - y).powi(2)).sum();
        (error / size).sqrt()
    }

    #[test]
    fn the_airs_temperature_follows_from_measured_pressures() {
        for (coefficient, stride, most) in
            [0.0, 30.0, 300.0].into_iter().flat_map(|c| [(c, 1, 0.02), (c, warmth_stride(0.001), 0.04)])
        {
            let error = error_of_warmth(coefficient, stride, false);
            assert!(error < most, "{coefficient} W/(m2 K), every {stride}: {error}");
        }
    }

    #[test]
    fn an_interruption_hardly_disturbs_the_airs_temperature() {
        for coefficient in [0.0, 30.0, 300.0] {
            let error = error_of_warmth(coefficient, 1, true);
            assert!(error < 0.1, "{coefficient} W/(m2 K): {error}");
        }
    }
}
