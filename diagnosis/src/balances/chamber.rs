//! The mass balance of one chamber: its pressure predicted from command, position and supply (3.2 to 3.7).

use super::judged::judged;
use crate::constants;
use crate::data::record::{ChamberSignals, Record};
use crate::data::split::{Stretch, interrupted};
use plant_model::{ChamberFlow, Plant, Side};

/// The parameters that the effect of the motion on a chamber's air depends on.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Geometry {
    volume_0_m3: f64,
    /// Signed: the volume grows with it times the position.
    area_m2: f64,
    smallest_m3: f64,
    position_delay_s: f64,
    /// The true position at three readings of the sensor: alike for sensors that are alike.
    sensor_m: [f64; 3],
    exponent: f64,
    energy_j_per_kg: f64,
}

impl Geometry {
    pub(crate) fn of(plant: &Plant<f64>, side: Side) -> Self {
        let c = plant.coefficients();
        let (volume_0_m3, grows) = if side == Side::A { (c.volume_a0_m3, 1.0) } else { (c.volume_b0_m3, -1.0) };
        Self {
            volume_0_m3,
            area_m2: grows * plant.area_m2(side),
            smallest_m3: plant.minimum_volume_m3(side),
            position_delay_s: plant.position_delay_s(),
            sensor_m: [-0.5, 0.1, 0.5].map(|part| plant.true_position_m(part * c.half_stroke_m)),
            exponent: c.exponent,
            energy_j_per_kg: plant.energy_j_per_kg(),
        }
    }
}

/// The polytropic compression of a chamber's air from each sample of some stretches to the next, as factors that do not
/// depend on the pressure. The entry of a stretch's last sample is not used.
pub(crate) struct Compression {
    /// Growth of the pressure over the first half of the piston's way, as a factor; air is exchanged between the
    /// halves.
    first_half: Vec<f64>,
    /// The same over the second half.
    second_half: Vec<f64>,
    /// Pressure per mass flow at the volume between, Pa s/kg.
    pa_s_per_kg: Vec<f64>,
    /// Position between, m.
    y_m: Vec<f64>,
}

/// The compression over one interval.
struct Stroke {
    first_half: f64,
    second_half: f64,
    pa_s_per_kg: f64,
    y_m: f64,
}

impl Stroke {
    /// Volume of the chamber between, m3, for an interval of `dt_s`.
    fn volume_m3(&self, plant: &Plant<f64>, dt_s: f64) -> f64 {
        plant.energy_j_per_kg() * dt_s / self.pa_s_per_kg
    }
}

impl Compression {
    #[inline(always)]
    fn stroke(&self, place: usize) -> Stroke {
        Stroke {
            first_half: self.first_half[place],
            second_half: self.second_half[place],
            pa_s_per_kg: self.pa_s_per_kg[place],
            y_m: self.y_m[place],
        }
    }
}

/// The compression within some stretches, in order.
pub(crate) fn compression(record: &Record, plant: &Plant<f64>, g: &Geometry, stretches: &[Stretch]) -> Compression {
    let at = |k: usize| {
        let y = plant.true_position_m(position(record, k, g.position_delay_s));
        (y, (g.volume_0_m3 + g.area_m2 * y).max(g.smallest_m3))
    };
    let count = stretches.iter().map(|stretch| stretch.range().len()).sum();
    let mut out = Compression {
        first_half: Vec::with_capacity(count),
        second_half: Vec::with_capacity(count),
        pa_s_per_kg: Vec::with_capacity(count),
        y_m: Vec::with_capacity(count),
    };
    for stretch in stretches {
        let (mut y, mut v) = at(stretch.start);
        for k in stretch.range() {
            let (y_next, next) = at((k + 1).min(stretch.end - 1));
            let middle = 0.5 * (v + next);
            out.first_half.push(polytropic(v / middle, g.exponent));
            out.second_half.push(polytropic(middle / next, g.exponent));
            out.pa_s_per_kg.push(g.energy_j_per_kg / middle * record.interval_s(k));
            out.y_m.push(0.5 * (y + y_next));
            (y, v) = (y_next, next);
        }
    }
    out
}

/// The inputs of the chamber's balance, one value per sample of the log; the compression has its own order.
pub(crate) struct Drive<'a> {
    /// What the piston's motion does in the stretches at hand.
    pub(crate) compression: &'a Compression,
    /// Signed opening of the valve, rad.
    pub(crate) openings: &'a [f64],
    /// Supply pressure at the valve, Pa.
    pub(crate) supply_pa: &'a [f64],
    /// Mass flow into the chamber in addition to the model's, kg/s; empty for none.
    pub(crate) added_kg_per_s: &'a [f64],
}

/// Prediction errors of the chamber's pressure in units of its noise and of what is not known of the command. Second, the
/// sum of the logarithms of the part that this makes of a unit: what a likelihood must count beside the errors.
pub(crate) fn innovations(
    record: &Record,
    plant: &Plant<f64>,
    stretches: &[Stretch],
    side: Side,
    drive: &Drive<'_>,
) -> (Vec<f64>, f64) {
    let ChamberSignals { p_pa: measured, smooth, weight_per_pa: weights, noise_pa, doubt_pa, .. } =
        record.chamber(side);
    let sigma = noise_pa.max(constants::numerical_error_pa());
    let lag = plant.added().pressure_lag;
    let has_warmth = plant.added().wall_heat.law.is_some();

    let mut out = Vec::with_capacity(drive.compression.first_half.len());
    let (mut next_stroke, mut log_widths) = (0, 0.0);
    // The air keeps its temperature over the samples between two stretches: up to where it is known, and how warm it is.
    let (mut known, mut warmth) = (0, 0.0);
    for stretch in stretches {
        let mut p = plant.true_pressure_pa(side, smooth.value[stretch.start], smooth.slope[stretch.start]);
        let mut sensed = plant.pressure_behind_lag_pa(side, smooth.value[stretch.start]);
        if has_warmth {
            let signals = [drive.openings, drive.supply_pa];
            let between = warmths(record, plant, side, signals, (known, warmth), stretch.start + 1);
            warmth = between.last().copied().unwrap_or(0.0);
            known = stretch.end - 1;
        }
        let mut settled = (record.t_s[stretch.start] + constants::settling_s()).max(record.valve_known_s);
        // Variance of the prediction by what is not known of the command, alike for all hypotheses.
        let mut doubt = 0.0;
        for k in stretch.range() {
            let stroke = next_stroke;
            next_stroke += 1;
            let dt = record.interval_s(k);
            if record.is_row(k) {
                if weights[k] * sigma < constants::chamber_clear() {
                    settled = settled.max(record.t_s[k] + constants::settling_s());
                }
                let error = measured[k] - plant.shown_pressure_pa(side, sensed);
                let trusted = if doubt > 0.0 { 1.0 / (1.0 + doubt * weights[k] * weights[k]) } else { 1.0 };
                if record.t_s[k] >= settled && weights[k] > 0.0 {
                    out.push(judged(error * weights[k] * trusted.sqrt()));
                    log_widths -= 0.5 * trusted.ln();
                } else {
                    out.push(f64::NAN);
                }
                // After settling, the pressure is known as well as an average over the time since then. So the gain
                // falls with one over that time, as a Kalman filter's would, down to the stationary gain.
                let since = record.t_s[k] - settled;
                let memory = if since < 0.0 {
                    constants::chamber_settling_memory_s()
                } else {
                    (constants::chamber_settling_memory_s() + since).min(constants::chamber_memory_s())
                };
                let to_next = record.to_next_row_s(k);
                let (stationary, kalman) = (to_next / (memory + to_next), 1.0 - trusted);
                let gain = stationary.max(kalman);
                doubt *= if stationary > kalman { (1.0 - gain).powi(2) } else { 1.0 - gain };
                doubt += doubt_pa.get(k).map_or(0.0, |grows| grows * grows);
                let drawn = error * gain;
                p += drawn;
                sensed += drawn;
            }
            if k + 1 == stretch.end {
                break;
            }
            let before = p;
            (p, warmth) = exchanged(record, plant, side, (drive, k), &drive.compression.stroke(stroke), (p, warmth));
            // The lag sees a pressure that changes linearly over the interval.
            sensed = if lag.time_constant_s > 1.0e-6 {
                lag.over(sensed, before, p, dt, (-dt / lag.time_constant_s).exp())
            } else {
                p
            };
        }
    }
    (out, log_widths)
}

/// Pressure in Pa and warmth of a chamber's air after the interval behind sample `k`: half of the piston's way, the exchange of
/// air (and heat), the other half.
#[inline(always)]
fn exchanged(
    record: &Record,
    plant: &Plant<f64>,
    side: Side,
    (drive, k): (&Drive<'_>, usize),
    stroke: &Stroke,
    (mut p, mut warmth): (f64, f64),
) -> (f64, f64) {
    let is_a = side == Side::A;
    let beyond = if is_a { Side::B } else { Side::A };
    let law = plant.added().wall_heat.law.as_ref();
    if let Some(law) = law {
        warmth = law.compressed(warmth, stroke.first_half);
    }
    p *= stroke.first_half;
    let opening = drive.openings[k];
    let fills = (opening >= 0.0) == is_a;
    let flow = plant.valve_inflow(side, stroke.y_m, fills, opening.abs(), p, drive.supply_pa[k]);
    let mut flow = ChamberFlow { mass_flow: flow.mass_flow, by_chamber: flow.by_chamber, by_other: 0.0 };
    let other = record.chamber(side).other;
    let p_beyond = other.value.get(k).map(|value| plant.true_pressure_pa(beyond, *value, other.slope[k]));
    plant.add_flows(side, p, p_beyond, &mut flow);
    flow.mass_flow += drive.added_kg_per_s.get(k).copied().unwrap_or(0.0);
    let factor = stroke.pa_s_per_kg;
    if let Some(law) = law {
        let dt_s = record.interval_s(k);
        let chamber = (plant.area_m2(side), stroke.volume_m3(plant, dt_s));
        (p, warmth) = law.filled((p, warmth), &flow, factor, chamber, dt_s);
        warmth = law.compressed(warmth, stroke.second_half);
    } else {
        p += factor * flow.mass_flow / (1.0 - 0.5 * factor * flow.by_chamber);
    }
    ((p * stroke.second_half).max(1.0e3), warmth)
}

/// Warmth of a chamber's air at each sample from one where it is known up to an end, its pressure as measured.
pub(crate) fn warmths(
    record: &Record,
    plant: &Plant<f64>,
    side: Side,
    [openings, supply_pa]: [&[f64]; 2],
    (start, mut warmth): (usize, f64),
    end: usize,
) -> Vec<f64> {
    let geometry = Geometry::of(plant, side);
    let stretch = Stretch { start, end, held_back: false };
    let compression = compression(record, plant, &geometry, &[stretch]);
    let drive = Drive { compression: &compression, openings, supply_pa, added_kg_per_s: &[] };
    let smooth = record.chamber(side).smooth;
    let mut out = Vec::with_capacity(stretch.range().len());
    let p = |k: usize| plant.true_pressure_pa(side, smooth.value[k], smooth.slope[k]);
    for (place, k) in stretch.range().enumerate() {
        out.push(warmth);
        let stroke = compression.stroke(place);
        warmth = match &plant.added().wall_heat.law {
            Some(law) if interrupted(&record.t_s, k + 1, record.quality.interval_s) => {
                let dt_s = record.interval_s(k);
                let chamber = (plant.area_m2(side), stroke.volume_m3(plant, dt_s));
                law.meanwhile([p(k), p(k + 1)], warmth, chamber, dt_s)
            }
            _ => exchanged(record, plant, side, (&drive, k), &stroke, (p(k), warmth)).1,
        };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::{supply, valve};
    use crate::data::prepare::prepare;
    use plant_model::{Effect, Effects, Simulator};
    use rig_files::{Log, RigFile};

    /// Root mean square error of the warmth of chamber A in a simulated log, relative to its size, with 60 rows missing every
    /// two seconds or none.
    fn error_of_warmth(coefficient: f64, interrupted: bool) -> f64 {
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
        let plant = Plant::new(&file.rig, &effects).unwrap();
        let openings = valve::openings(&record, &plant);
        let supply_pa = supply::pressures(&record, &plant, &openings, 0.0).at_valve;
        let found = warmths(&record, &plant, Side::A, [&openings, &supply_pa], (0, 0.0), record.len());
        let size: f64 = truth.iter().map(|x| x * x).sum();
        let error: f64 = found.iter().zip(&truth).map(|(x, y)| (x - y).powi(2)).sum();
        (error / size).sqrt()
    }

    #[test]
    fn the_airs_temperature_follows_from_measured_pressures() {
        for coefficient in [0.0, 30.0, 300.0] {
            let error = error_of_warmth(coefficient, false);
            assert!(error < 0.02, "{coefficient} W/(m2 K): {error}");
        }
    }

    #[test]
    fn an_interruption_hardly_disturbs_the_airs_temperature() {
        for coefficient in [0.0, 30.0, 300.0] {
            let error = error_of_warmth(coefficient, true);
            assert!(error < 0.1, "{coefficient} W/(m2 K): {error}");
        }
    }
}
