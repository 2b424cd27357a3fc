//! Derivatives of a chamber's predictions by the valve's opening, along a prediction: the variational equations of the observer.
//!
//! A table of the opening has dozens of points, each of them a parameter. They all act through one signal, the opening. So how a
//! prediction answers to the opening is found once, sample by sample; what a parameter makes of the opening then leads through
//! sums and products to what it makes of the errors. A difference quotient costs a whole prediction for each parameter.

use super::chamber::{Drive, Meanwhile, Pressure, begun_cold, warmth_stride};
use super::initial_warmth::InitialWarmth;
use crate::data::record::Record;
use crate::data::split::{Stretch, samples};
use plant_model::Plant;

/// One step of a linearised prediction, from a sample to the next.
struct Step {
    /// The sample whose opening counts.
    k: usize,
    /// Whether it is a row of the log, which has an error.
    is_row: bool,
    /// The error in standard deviations by the pressure behind the sensor's lag, 1/Pa; NaN where it is not judged.
    error_by_sensed: f64,
    /// What the correction adds to pressure and to the pressure behind the lag, per change of the latter.
    drawn: f64,
    /// The next pressure in Pa by pressure, warmth and opening after the correction.
    pressure_by: [f64; 3],
    /// The next warmth, by the same.
    warmth_by: [f64; 3],
    /// The next pressure behind the lag by the one before, by the pressure before and by that after.
    sensed_by: [f64; 3],
}

/// A chamber's prediction, linearised.
pub(crate) struct Linearised {
    steps: Vec<Step>,
    /// Of air with a temperature of its own.
    initial: Option<InitialWarmth>,
}

/// Step of the difference quotients of a single sample, as a part of the pressure; of warmth and opening, which are of the order
/// of one, as it is. The flow is smooth, so that rounding and curvature both stay below 1e-6.
const SMALL: f64 = 1.0e-6;

/// So many parameters at once: one alone waits for each of its sums.
pub(crate) const SIDE_BY_SIDE: usize = 4;

impl Linearised {
    /// Along a prediction over some stretches.
    pub(crate) fn of(record: &Record, plant: &Plant<f64>, stretches: &[Stretch], drive: &Drive<'_>) -> Self {
        let mut steps = Vec::with_capacity(samples(stretches));
        let mut prediction = Pressure::new(record, plant, drive, (stretches, 0), 0.0);
        let remembers = prediction.exchange.law.is_some();
        // Where the warmth was known last.
        let mut known = (0, 0.0);
        for stretch in stretches {
            if remembers {
                between(record, plant, drive, (known, stretch.start), &mut steps);
            }
            for _ in stretch.range() {
                known = (prediction.k, prediction.warmth);
                steps.push(step(record, plant, &mut prediction));
            }
        }
        Self { steps, initial: remembers.then(|| begun_cold(record, plant, stretches, drive).1) }
    }

    /// What changes of the opening in rad, sample by sample of the log, make of the errors of the rows; NaN where these are not
    /// judged.
    pub(crate) fn errors_by(&self, openings: [&[f64]; SIDE_BY_SIDE]) -> [Vec<f64>; SIDE_BY_SIDE] {
        let mut out = [(); SIDE_BY_SIDE].map(|()| Vec::with_capacity(self.steps.len()));
        let [mut p, mut sensed, mut warmth] = [[0.0; SIDE_BY_SIDE]; 3];
        for step in &self.steps {
            for lane in 0..SIDE_BY_SIDE {
                if step.is_row {
                    out[lane].push(step.error_by_sensed * sensed[lane]);
                }
                let drawn = step.drawn * sensed[lane];
                let (before, opening) = (p[lane] + drawn, openings[lane][step.k]);
                let sum = |by: &[f64; 3]| by[0] * before + by[1] * warmth[lane] + by[2] * opening;
                let after = sum(&step.pressure_by);
                warmth[lane] = sum(&step.warmth_by);
                let [by_sensed, by_before, by_after] = step.sensed_by;
                sensed[lane] = by_sensed * (sensed[lane] + drawn) + by_before * before + by_after * after;
                p[lane] = after;
            }
        }
        if let Some(initial) = &self.initial {
            out.iter_mut().for_each(|errors| initial.take_out_of(errors));
        }
        out
    }
}

/// An opening a little wider, and by how much.
fn wider(opening: f64) -> (f64, f64) {
    let by = if opening < 0.0 { -SMALL } else { SMALL };
    (opening + by, by)
}

/// The step from the sample at hand.
fn step(record: &Record, plant: &Plant<f64>, prediction: &mut Pressure<'_>) -> Step {
    let (k, place, is_last) = (prediction.k, prediction.place, prediction.k + 1 == prediction.end);
    let is_row = record.is_row(k);
    prediction.judge();
    let (p, warmth) = (prediction.p, prediction.warmth);
    prediction.advance();
    let shown = |p: f64| plant.shown_pressure_pa(prediction.exchange.side, p);
    let sensor = shown(1.0) - shown(0.0);
    let mut step = Step {
        k,
        is_row,
        error_by_sensed: -sensor * prediction.correction.weight_per_pa[place],
        drawn: if is_row { -sensor * prediction.correction.gain[place] } else { 0.0 },
        // The next stretch begins with the pressure that was measured.
        pressure_by: [0.0; 3],
        warmth_by: [0.0, 1.0, 0.0],
        sensed_by: [0.0; 3],
    };
    if is_last {
        return step;
    }
    let exchange = &prediction.exchange;
    let (opening, dt_s, there) = (exchange.air.openings[k], record.interval_s(k), (prediction.p, prediction.warmth));
    let stroke = &prediction.compression[place];
    let by = |(opening, p, warmth): (f64, f64, f64), step: f64| {
        let moved = exchange.with_opening(opening, k, dt_s, stroke, (p, warmth));
        [(moved.0 - there.0) / step, (moved.1 - there.1) / step]
    };
    let by_pressure = by((opening, p * (1.0 + SMALL), warmth), p * SMALL);
    let by_warmth = exchange.law.map_or([0.0; 2], |_| by((opening, p, warmth + SMALL), SMALL));
    let (wide, wider) = wider(opening);
    let by_opening = by((wide, p, warmth), wider);
    step.pressure_by = [by_pressure[0], by_warmth[0], by_opening[0]];
    step.warmth_by = [by_pressure[1], by_warmth[1], by_opening[1]];
    step.sensed_by = match &mut prediction.decay {
        Some(decay) => {
            let rest = decay.after(dt_s);
            let lag = |sensed, before, after| prediction.pressure_lag.over(sensed, [before, after], dt_s, rest);
            [lag(1.0, 0.0, 0.0), lag(0.0, 1.0, 0.0), lag(0.0, 0.0, 1.0)]
        }
        None => [0.0, 0.0, 1.0],
    };
    step
}

/// The steps of the air's warmth from where it was known to the next stretch.
fn between(
    record: &Record,
    plant: &Plant<f64>,
    drive: &Drive<'_>,
    ((start, mut warmth), end): ((usize, f64), usize),
    steps: &mut Vec<Step>,
) {
    let mut meanwhile = Meanwhile::new(record, plant, drive.side, drive.air, start);
    let stride = warmth_stride(record.step_s);
    while meanwhile.k < end {
        let k = meanwhile.towards((meanwhile.k + stride).min(end));
        let opening = drive.air.openings[k];
        let after = meanwhile.warmth(warmth, opening);
        let (wide, wider) = wider(opening);
        let by_warmth = (meanwhile.warmth(warmth + SMALL, opening) - after) / SMALL;
        let by_opening = (meanwhile.warmth(warmth, wide) - after) / wider;
        steps.push(Step {
            k,
            is_row: false,
            error_by_sensed: 0.0,
            drawn: 0.0,
            pressure_by: [0.0; 3],
            warmth_by: [0.0, by_warmth, by_opening],
            sensed_by: [0.0; 3],
        });
        warmth = after;
    }
}

#[cfg(test)]
mod tests {
    use crate::balances::added::Added;
    use crate::balances::observers::{by_openings, innovations};
    use crate::balances::shared::Signals;
    use crate::balances::simulated::simulated;
    use crate::data::channel::Channel;
    use crate::data::prepare::prepare;
    use crate::data::split::Stretch;
    use plant_model::{Effect, Effects, Plant};
    use rig_files::RigFile;
    use std::path::Path;

    #[test]
    fn what_openings_make_of_errors_is_what_difference_quotients_say() {
        let sheet = Path::new(env!("CARGO_MANIFEST_DIR")).join("../rigs/festo-dsbc-32-200.toml");
        for (file, walls, lag_s) in [(RigFile::read(&sheet).unwrap(), 40.0, 0.003), (RigFile::paper_b(), 0.0, 0.0)] {
            let effects = |dead_zone_v: f64, spool_s: f64| {
                Effects::none()
                    .with(Effect::ValveDeadZone, &[dead_zone_v, 0.02])
                    .with(Effect::ValveLag, &[spool_s])
                    .with(Effect::WallHeat, &[walls])
                    .with(Effect::PressureLag, &[lag_s])
            };
            let log =
                simulated(&file, &effects(0.01, 0.002), 6000, |t_s| 0.6 * (2.0 * t_s).sin() + 1.2 * (11.0 * t_s).sin());
            let record = prepare(&log, &file);
            // Those between are not judged: there the warmth goes on alone.
            let stretches: Vec<Stretch> = record.stretches.iter().copied().step_by(2).collect();
            assert!(stretches.len() > 1);
            let (signals, added) = (Signals::default(), Added::default());
            let wanted = Channel::PressureA.bit() | Channel::PressureB.bit();
            let plant = |dead_zone_v: f64, spool_s: f64| Plant::new(&file.rig, &effects(dead_zone_v, spool_s)).unwrap();
            let (base, moved) = (plant(0.015, 0.0021), [plant(0.015 + 1.0e-7, 0.0021), plant(0.015, 0.0021 + 1.0e-7)]);
            let errors = |plant: &Plant<f64>| {
                innovations(&record, &signals, plant, &added, &stretches, wanted, Default::default()).channels
            };
            let (before, linearised) =
                (errors(&base), by_openings(&record, &signals, (&base, &moved), &added, &stretches, wanted));
            for (moved, linearised) in moved.iter().zip(linearised) {
                assert!(base.differs_in_opening_only(moved));
                for ((after, before), found) in errors(moved).iter().zip(&before).zip(&linearised.channels).take(2) {
                    let expected = after.iter().zip(before).map(|(after, before)| after - before);
                    let judged = expected.zip(found).filter(|(expected, _)| !expected.is_nan());
                    let (missed, size) = judged.fold((0.0, 0.0), |(missed, size), (expected, found)| {
                        (missed + (found - expected).powi(2), size + expected * expected)
                    });
                    let part: f64 = (missed / size).sqrt();
                    // What the likeliest initial warmth makes of errors is taken as it is before the change.
                    assert!(size > 0.0 && part < 6.0e-3, "{}: {part}", file.name);
                }
            }
        }
    }
}
