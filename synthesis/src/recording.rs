//! Runs an experiment on a synthetic rig and records it.

use crate::chain::{Chain, Channel, stretches};
use crate::experiment::Experiment;
use crate::law::{Controller, Law};
use crate::physics::Physics;
use crate::reading::Reading;
use crate::specimen::Specimen;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rig_files::{Column, Converter, Log};

/// Commands are written by a converter of this resolution over the valve's range.
const DAC_BITS: u32 = 12;

/// More swings of the law's output per second than this, and the loop is not one that anybody would leave running.
const RESTLESS_SWINGS_PER_S: f64 = 2.0;
/// A swing goes from beyond this part of the valve's range on one side to beyond it on the other.
const SWING_SHARE: f64 = 0.25;

/// Records an experiment: the log, and what ideal sensors would have shown at the same times.
///
/// A hidden effect can make the loop oscillate. Whoever commissions a rig turns the gains
/// down then, and so does this: by halves, up to four times.
#[must_use]
pub fn record(physics: &Physics, experiment: &Experiment, law: &Law, chain: &Chain, seed: u64) -> (Log, Vec<Reading>) {
    let mut law = *law;
    for _ in 0..4 {
        let (log, ideal, swings) = record_once(physics, experiment, &law, chain, seed);
        if f64::from(swings) <= RESTLESS_SWINGS_PER_S * experiment.duration_s() {
            return (log, ideal);
        }
        law.position_gain *= 0.5;
        law.velocity_gain *= 0.5;
    }
    let (log, ideal, _) = record_once(physics, experiment, &law, chain, seed);
    (log, ideal)
}

/// One run; also counts swings of the law's output, see [`SWING_SHARE`].
fn record_once(
    physics: &Physics,
    experiment: &Experiment,
    law: &Law,
    chain: &Chain,
    seed: u64,
) -> (Log, Vec<Reading>, u32) {
    // One stream each, so that changing the noise does not move the gaps.
    let mut noise = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut timing = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x7469_6d69_6e67);
    let mut losses = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x6c6f_7373_6573);

    let [rest_a, rest_b] = physics.rest_pressures_pa();
    let mut specimen = Specimen::new(physics.clone(), experiment.start_m, rest_a, rest_b);
    let mut controller = Controller::new(*law);
    let mut player = experiment.play();
    let pressure = Channel::new(chain.pressure_noise_pa, chain.pressure);
    let position = Channel::new(chain.position_noise_m, chain.position);
    let dac = Converter::new([-law.max_v, law.max_v], DAC_BITS);

    let rows = (experiment.duration_s() / chain.period_s).round() as usize;
    let mut t_s = 0.0_f64;
    let mut times = Vec::with_capacity(rows);
    let mut columns: Vec<Vec<f64>> = (0..6).map(|_| Vec::with_capacity(rows)).collect();
    let mut ideal = Vec::with_capacity(rows);
    let mut last_reference = experiment.start_m;
    let (mut swings, mut side) = (0_u32, 0.0);
    for _ in 0..rows {
        let reading = specimen.read();
        let y = position.sample(reading.y_m, &mut noise);
        let p_a = pressure.sample(reading.p_a_pa, &mut noise);
        let p_b = pressure.sample(reading.p_b_pa, &mut noise);
        let p_sup = pressure.sample(reading.p_sup_pa, &mut noise);
        let demand = player.demand(t_s, y);
        let wanted = controller.command_v(t_s, y, &demand);
        // The mid code of a converter is not exactly zero; a closed valve is commanded as exactly zero.
        let u = if wanted == 0.0 { 0.0 } else { dac.quantity(dac.code(wanted)) };
        let by_law = if demand.y_ref_m.is_some() { u - demand.added_v } else { 0.0 };
        if by_law.abs() > SWING_SHARE * law.max_v && by_law.signum() != side {
            swings += u32::from(side != 0.0);
            side = by_law.signum();
        }
        last_reference = demand.y_ref_m.unwrap_or(last_reference);
        times.push(t_s);
        for (column, value) in columns.iter_mut().zip([u, y, p_a, p_b, p_sup, last_reference]) {
            column.push(value);
        }
        ideal.push(reading);

        let mut period = chain.period_s;
        if chain.jitter > 0.0 {
            let normal: f64 = StandardNormal.sample(&mut timing);
            period *= (1.0 + chain.jitter * normal).clamp(0.2, 3.0);
        }
        // Times as a logger writes them, to a tenth of a microsecond.
        let next = ((t_s + period) * 1e7).round() / 1e7;
        specimen.advance(u, next - t_s);
        t_s = next;
    }

    if let Some(part) = chain.clipped_above {
        clip(&mut columns[1], part);
    }
    let mut lost = stretches(rows, chain.period_s, chain.lost_rows_per_s, &mut losses);
    lost.iter_mut().enumerate().for_each(|(row, lost)| *lost |= row % chain.logged_every.max(1) != 0);
    lost[..times.partition_point(|t_s| *t_s < chain.begins_s)].fill(true);
    let keep = |values: &[f64]| -> Vec<f64> {
        values.iter().zip(&lost).filter(|(_, lost)| !**lost).map(|(value, _)| *value).collect()
    };
    let mut log = Log { t_s: keep(&times), ..Log::default() };
    let recorded = [Column::U, Column::Y, Column::PA, Column::PB, Column::PSup, Column::YRef];
    for (column, mut values) in recorded.into_iter().zip(columns) {
        let blank = stretches(rows, chain.period_s, chain.blanks_per_s, &mut losses);
        if !chain.records(column) {
            continue;
        }
        for (value, blank) in values.iter_mut().zip(blank) {
            if blank {
                *value = f64::NAN;
            }
        }
        log.set(column, Some(keep(&values)));
    }
    let ideal = ideal.into_iter().zip(&lost).filter(|(_, lost)| !**lost).map(|(reading, _)| reading).collect();
    (log, ideal, swings)
}

/// Keeps all values below the one that `part` of them do not exceed.
fn clip(values: &mut [f64], part: f64) {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let at = ((part * sorted.len() as f64) as usize).min(sorted.len().saturating_sub(1));
    if let Some(limit) = sorted.get(at) {
        values.iter_mut().for_each(|value| *value = value.min(*limit));
    }
}
