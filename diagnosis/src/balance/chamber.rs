//! The mass balance of one chamber: its pressure predicted from command, position and supply (3.2 to 3.7).

use crate::noise::NUMERICAL_ERROR_PA;
use crate::record::{Record, Stretch};
use plant_model::{MINIMUM_VOLUME_RATIO, Plant};

/// Which chamber.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    A,
    B,
}

/// Time constant with which the prediction is drawn towards the measurement, s: long enough for leaks to build up,
/// short enough to forget a chamber's past within a few strokes.
pub(crate) const MEMORY_S: f64 = 1.0;
/// The first part of every stretch, s, during which the prediction settles and is not counted: where the spool stood
/// and what was under way to it is unknown there.
const SETTLING_S: f64 = 0.1;
/// Near the end of its stroke a chamber is so small that the position's noise changes the predicted pressure more than the
/// sensor's noise does: where the latter is less than this part of both, the prediction follows the measurement.
const CLEAR: f64 = 0.5;
/// Time constant while settling, s.
const SETTLING_MEMORY_S: f64 = 0.02;

/// What the motion's effect on a chamber's air depends on beside the log.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Geometry {
    volume_0_m3: f64,
    /// Signed: the volume grows with it times the position.
    area_m2: f64,
    smallest_m3: f64,
    position_delay_s: f64,
    position_scale: f64,
    exponent: f64,
    energy_j_per_kg: f64,
}

impl Geometry {
    pub(crate) fn of(plant: &Plant<f64>, side: Side) -> Self {
        let c = plant.coefficients();
        let (volume_0_m3, area_m2) =
            if side == Side::A { (c.volume_a0_m3, c.area_a_m2) } else { (c.volume_b0_m3, -c.area_b_m2) };
        Self {
            volume_0_m3,
            area_m2,
            smallest_m3: MINIMUM_VOLUME_RATIO * c.area_b_m2 * 2.0 * c.half_stroke_m,
            position_delay_s: c.added.position_delay.delay_s,
            position_scale: c.added.position_scale.scale,
            exponent: c.exponent,
            energy_j_per_kg: plant.energy_j_per_kg(),
        }
    }
}

/// What happens to a chamber's air from each sample of some stretches to the next, as far as it does not depend on the
/// pressure. The last of a stretch leads nowhere.
pub(crate) struct Strokes {
    /// Growth of the pressure over the first half of the piston's way, as a factor; air is exchanged between the halves.
    first_half: Vec<f64>,
    /// The same over the second half.
    second_half: Vec<f64>,
    /// Pressure per mass flow at the volume between, Pa s/kg.
    pa_s_per_kg: Vec<f64>,
}

/// The strokes within some stretches, in order.
pub(crate) fn strokes(record: &Record, g: &Geometry, stretches: &[Stretch]) -> Strokes {
    let volume = |k: usize| {
        let y = position(record, k, g.position_delay_s) / g.position_scale;
        (g.volume_0_m3 + g.area_m2 * y).max(g.smallest_m3)
    };
    let count = stretches.iter().map(|stretch| stretch.range().len()).sum();
    let mut out = Strokes {
        first_half: Vec::with_capacity(count),
        second_half: Vec::with_capacity(count),
        pa_s_per_kg: Vec::with_capacity(count),
    };
    for stretch in stretches {
        let mut v = volume(stretch.start);
        for k in stretch.range() {
            let next = volume((k + 1).min(stretch.end - 1));
            let middle = 0.5 * (v + next);
            out.first_half.push(polytropic(v / middle, g.exponent));
            out.second_half.push(polytropic(middle / next, g.exponent));
            out.pa_s_per_kg.push(g.energy_j_per_kg / middle * record.interval_s(k));
            v = next;
        }
    }
    out
}

/// What drives the chamber's pressure, by sample of the log but for the strokes.
pub(crate) struct Drive<'a> {
    /// What the piston's motion does in the stretches at hand.
    pub(crate) strokes: &'a Strokes,
    /// Signed opening of the valve, rad.
    pub(crate) openings: &'a [f64],
    /// Supply pressure at the valve, Pa.
    pub(crate) supply_pa: &'a [f64],
    /// Mass flow into the chamber beside the model's, kg/s; empty for none.
    pub(crate) added_kg_per_s: &'a [f64],
}

/// Prediction errors of the chamber's pressure in units of its noise.
pub(crate) fn innovations(
    record: &Record,
    plant: &Plant<f64>,
    stretches: &[Stretch],
    side: Side,
    drive: &Drive<'_>,
) -> Vec<f64> {
    let c = plant.coefficients();
    let is_a = side == Side::A;
    let (measured, smooth, other) = if is_a {
        (&record.p_a_pa, &record.p_a_smooth, &record.p_b_smooth)
    } else {
        (&record.p_b_pa, &record.p_b_smooth, &record.p_a_smooth)
    };
    let (offset, other_offset) = if is_a {
        (c.added.pressure_a_offset.offset_pa, c.added.pressure_b_offset.offset_pa)
    } else {
        (c.added.pressure_b_offset.offset_pa, c.added.pressure_a_offset.offset_pa)
    };
    let weights = if is_a { &record.weight_a_per_pa } else { &record.weight_b_per_pa };
    let leak = if is_a { c.added.leak_chamber_a.conductance } else { c.added.leak_chamber_b.conductance };
    let quality = if is_a { &record.quality.pressure_a } else { &record.quality.pressure_b };
    let sigma = quality.standard_deviation.max(NUMERICAL_ERROR_PA);
    let lag = c.added.pressure_lag.time_constant_s;

    let mut out = Vec::with_capacity(drive.strokes.first_half.len());
    for stretch in stretches {
        let mut p = smooth.value[stretch.start] - offset + lag * smooth.slope[stretch.start];
        let mut sensed = smooth.value[stretch.start] - offset;
        let mut settled = (record.t_s[stretch.start] + SETTLING_S).max(record.valve_known_s);
        for k in stretch.range() {
            if weights[k] * sigma < CLEAR {
                settled = settled.max(record.t_s[k] + SETTLING_S);
            }
            let error = measured[k] - (sensed + offset);
            let stroke = out.len();
            out.push(if record.t_s[k] >= settled { error * weights[k] } else { f64::NAN });
            if k + 1 == stretch.end {
                break;
            }
            let dt = record.interval_s(k);
            // Once settled, the start is known as well as an average over what was seen since: the gain falls like one
            // over time, as a Kalman filter's would, down to that of the long memory.
            let since = record.t_s[k] - settled;
            let memory = if since < 0.0 { SETTLING_MEMORY_S } else { (SETTLING_MEMORY_S + since).min(MEMORY_S) };
            let drawn = error * (dt / (memory + dt));
            p += drawn;
            sensed += drawn;
            let before = p;
            p *= drive.strokes.first_half[stroke];
            let opening = drive.openings[k];
            let fills = (opening >= 0.0) == is_a;
            let flow = plant.orifices().inflow(fills, opening.abs(), p, drive.supply_pa[k], c.atmosphere_pa);
            let mut mass_flow = flow.mass_flow - leak * (p - c.atmosphere_pa);
            let mut by_p = flow.by_chamber - leak;
            if c.added.leak_cross_piston.conductance != 0.0 && !other.value.is_empty() {
                let beyond = other.value[k] + lag * other.slope[k] - other_offset;
                mass_flow -= c.added.leak_cross_piston.conductance * (p - beyond);
                by_p -= c.added.leak_cross_piston.conductance;
            }
            mass_flow += drive.added_kg_per_s.get(k).copied().unwrap_or(0.0);
            let factor = drive.strokes.pa_s_per_kg[stroke];
            p += factor * mass_flow / (1.0 - 0.5 * factor * by_p);
            p = (p * drive.strokes.second_half[stroke]).max(1.0e3);
            if lag > 1.0e-6 {
                // The lag sees a pressure that changes linearly over the interval.
                let rate = (p - before) / dt;
                let rest = (-dt / lag).exp();
                sensed = p - lag * rate + (sensed - before + lag * rate) * rest;
            } else {
                sensed = p;
            }
        }
    }
    out
}

/// `x^n` for `x` close to one.
fn polytropic(x: f64, n: f64) -> f64 {
    let e = x - 1.0;
    1.0 + n * e * (1.0 + 0.5 * (n - 1.0) * e * (1.0 + (n - 2.0) / 3.0 * e))
}

/// The smoothed measured position at the time `delay` after sample `k`: what was true at sample `k` if the signal is
/// late by `delay`.
fn position(record: &Record, k: usize, delay_s: f64) -> f64 {
    let y = &record.y_smooth.value;
    if delay_s > 0.0 { record.moment(k, delay_s, 0..y.len()).of(y) } else { y[k] }
}
