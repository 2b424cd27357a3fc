//! What happens between distant rows of a log.
//!
//! A command that moved there is known no better than its jumps: they came at some time between two rows. What that makes of the
//! chamber pressures is a variance of their predictions. And each step of the command bends the pressures, which no smooth curve
//! through the rows shows.

use super::opening;
use crate::constants;
use crate::data::grid::splined;
use crate::data::record::Record;
use crate::data::smoothing::Smoothed;
use crate::statistics::median;
use plant_model::{Plant, Side};

/// How many rows to each side say how much a command jitters. One jump is three changes, far less than half of them.
const JITTERING: usize = 8;
/// How often the median change a change is jitter at most: of normal jitter 95 of 100 are.
const MOST_JITTER: f64 = 3.0;
/// How far the outermost of all commands is beyond the outermost of those logged, of the usual jump. Of normal commands, 30 of them logged:
/// 0.2 for twice as many, 0.35 for five times, 0.45 for ten times (root mean squares).
const BEYOND: f64 = 0.3;

/// How far the command's unknown jumps between rows make the mean place of the spool, and the pressures behind it, uncertain.
///
/// A jump comes once, at a time that is equally likely anywhere between two rows. `share` is the part of jitter that counts: less than
/// one, as what several commands differ by averages out. Behind play a spool follows no jitter, but rests where the outermost command
/// has left it, which may be none of those logged: that error is the same for as long as it rests.
pub(crate) fn doubts(record: &mut Record, plant: &Plant<f64>, share: f64) {
    let n = record.len();
    // The commands as logged; those of the grid are means.
    let u = &record.u_rows_v;
    let unknown = |signal: &[f64]| unknown(&jumps(signal), share);
    let volts = unknown(u);
    let spool_v = behind_play(u, plant);
    let signed = |spool_v: f64| opening::signed_openings(plant, spool_v);
    let (a, b): (Vec<f64>, Vec<f64>) = spool_v.iter().map(|v| <(f64, f64)>::from(signed(*v))).unzip();
    let openings = [a, b];
    let radians = openings.each_ref().map(|openings| unknown(openings));
    let rests = rests(record, plant, &spool_v);
    // Of the mean, as the jump's time is equally likely anywhere between two rows.
    let spread = 1.0 / 12.0_f64.sqrt();
    record.command_doubt_v = vec![0.0; n];
    record.doubt_a_pa = vec![0.0; n];
    record.doubt_b_pa = vec![0.0; n];
    record.doubt_drawn_kg_per_s = vec![0.0; n];
    let lag_s = plant.added().valve_lag.time_constant_s;
    let mut behind = [0.0_f64; 2];
    for (row, k) in record.rows.clone().into_iter().enumerate() {
        record.command_doubt_v[k] = spread * volts[row];
        let dt_s = record.to_next_row_s(k);
        // A lagging spool takes up a part of an unknown jump at once, and what is left of it in the intervals behind: its errors there
        // have one sign, so that their variances add up to the jump's, as without a lag.
        let rest = if lag_s > 0.0 { (-dt_s / lag_s).exp() } else { 0.0 };
        for side in [Side::A, Side::B] {
            let place = side as usize;
            behind[place] = ((1.0 - rest) * radians[place][row].powi(2) + rest * behind[place].powi(2)).sqrt();
            let here = openings[place][row];
            let (furthest, since_s) = rests[row].as_ref().map_or((here, 0.0), |rest| {
                let [one, other] = [-rest.beyond_v, rest.beyond_v].map(|by_v| signed(spool_v[row] + by_v)[place]);
                (if (one - here).abs() > (other - here).abs() { one } else { other }, rest.since_s)
            });
            let unit = if here + furthest >= 0.0 { 1.0 } else { -1.0 };
            let Some(rate) = pa_per_s(record, plant, (side, k), unit) else { continue };
            let (jumping, resting) = (spread * behind[place], furthest - here);
            // A sum of equal errors grows with their number, and its variance by more in each row.
            let doubt = rate.abs() * (jumping * dt_s).hypot(resting * (dt_s * (dt_s + 2.0 * since_s)).sqrt());
            let doubts = if side == Side::A { &mut record.doubt_a_pa } else { &mut record.doubt_b_pa };
            doubts[k] = doubt;
            let fills = (unit >= 0.0) == (side == Side::A);
            if let Some(flow) = kg_per_s(record, plant, (side, k), unit).filter(|_| fills) {
                record.doubt_drawn_kg_per_s[k] = flow * jumping.hypot(resting);
            }
        }
    }
}

/// Where the logged commands leave a spool behind its play, V: the command itself where there is none.
fn behind_play(u: &[f64], plant: &Plant<f64>) -> Vec<f64> {
    let hysteresis = plant.added().valve_hysteresis;
    let follow = |spool: &mut f64, u: &f64| {
        *spool = hysteresis.play(*spool, *u);
        Some(*spool)
    };
    u.iter().scan(0.0, follow).collect()
}

/// A spool that rests behind its play from one row to the next.
struct Rest {
    /// How far a command between rows may have left it from where it is by those logged: standard deviation, V.
    beyond_v: f64,
    /// How long it has rested there, s; at most as long as a chamber's prediction remembers.
    since_s: f64,
}

/// Where a spool rests behind its play: for each row, until the next. Without play a command that is the same in two rows was so between.
fn rests(record: &Record, plant: &Plant<f64>, spool_v: &[f64]) -> Vec<Option<Rest>> {
    let has_play = plant.added().valve_hysteresis.half_width_v > 0.0;
    let jumps = jumps(&record.u_rows_v);
    let mut beyond_v = 0.0;
    // Since when it rests; `None` while it moves.
    let mut from_s: Option<f64> = None;
    let of = |(row, k): (usize, &usize)| {
        if !has_play || spool_v.get(row + 1) != Some(&spool_v[row]) {
            from_s = None;
            return None;
        }
        let from_s = *from_s.get_or_insert_with(|| {
            beyond_v = BEYOND * usual(&jumps, row);
            record.t_s[*k]
        });
        Some(Rest { beyond_v, since_s: (record.t_s[*k] - from_s).min(constants::chamber_memory_s()) })
    };
    record.rows.iter().enumerate().map(of).collect()
}

/// How far the curve of a valve's opening between the points of a table makes the pressures uncertain, in addition to what does so
/// already. The same error lasts while the spool is between two points, and adds up meanwhile. `share` is the part of
/// [`constants::between_points`] that counts.
pub(crate) fn doubt_the_curve(record: &mut Record, plant: &Plant<f64>, share: f64) {
    let Some(bends) = opening::bends(record, plant).filter(|_| record.available.command) else { return };
    record.curve_doubt = share;
    for side in [Side::A, Side::B] {
        let doubt = |k: usize| {
            let bend = bends.of(side)[k];
            let rate = pa_per_s(record, plant, (side, k), if bend >= 0.0 { 1.0 } else { -1.0 }).unwrap_or(0.0);
            let interval_s = record.interval_s(k);
            let by_curve = share * constants::between_points() * rate * bend.abs();
            let by_command = record.chamber(side).doubt_pa.get(k).copied().unwrap_or(0.0);
            by_command.hypot(by_curve * (interval_s * interval_s.max(constants::from_point_to_point_s())).sqrt())
        };
        let doubts = (0..record.len()).map(doubt).collect();
        *(if side == Side::A { &mut record.doubt_a_pa } else { &mut record.doubt_b_pa }) = doubts;
    }
}

/// Chamber pressures between rows and entries, with what flows through the valve by the plant.
pub(crate) fn follow_the_flow(record: &mut Record, plant: &Plant<f64>) {
    if !record.available.command {
        return;
    }
    let openings = opening::openings(record, plant);
    interpolate(record, plant, &openings);
    [record.bend_a_pa, record.bend_b_pa] = [Side::A, Side::B].map(|side| bends(record, (plant, &openings), side));
}

/// How much more the mean of a chamber's pressure is, from each entry to the next, than that of a straight line between them, Pa: a
/// twelfth of the interval times what its slope falls by (the trapezoidal rule's error, Euler and Maclaurin).
///
/// A step of the command bends the pressure at an entry, not behind it. A slope there is that behind the step where pressures were
/// interpolated, and else a central difference, which sees half of the step.
fn bends(record: &Record, (plant, openings): (&Plant<f64>, &opening::Openings), side: Side) -> Vec<f64> {
    if record.is_vented(side) {
        return Vec::new();
    }
    let slopes = &record.chamber(side).smooth.slope;
    let opening = openings.of(side);
    let kink = |k: usize| {
        let by = |opening: f64| pa_per_s(record, plant, (side, k), opening);
        k.checked_sub(1).and_then(|before| Some(by(opening[k])? - by(opening[before])?)).unwrap_or(0.0)
    };
    let kinks: Vec<f64> = (0..slopes.len()).map(kink).collect();
    let seen = if record.is_interpolated() { 1.0 } else { 0.5 };
    let of = |k: usize| {
        let next = slopes.get(k + 1).map(|slope| slope - seen * kinks[k + 1]);
        next.map_or(0.0, |next| record.interval_s(k) / 12.0 * (slopes[k] + (1.0 - seen) * kinks[k] - next))
    };
    (0..slopes.len()).map(of).collect()
}

/// Interpolates the chamber pressures anew: what flows through the valve is taken out, the rest has no bends and is a spline, and the
/// flow comes back.
fn interpolate(record: &mut Record, plant: &Plant<f64>, openings: &opening::Openings) {
    if !record.is_interpolated() {
        return;
    }
    // `None` where pressure, position or command is not in the log: then it stays a plain spline, or nothing.
    let through = |side: Side| -> Option<Smoothed> {
        if record.is_vented(side) {
            return None;
        }
        let pressure = &record.chamber(side).smooth.value;
        let rate = |k: usize| pa_per_s(record, plant, (side, k), *openings.of(side).get(k)?);
        let rates: Vec<f64> = (0..record.len()).map(rate).collect::<Option<_>>()?;
        let intervals = (0..record.len()).map(|k| record.interval_s(k));
        let by_flow: Vec<f64> = rates
            .iter()
            .zip(intervals)
            .scan(0.0, |sum, (rate, interval_s)| Some(std::mem::replace(sum, *sum + rate * interval_s)))
            .collect();
        let rest = record.rows.iter().map(|k| pressure[*k] - by_flow[*k]).collect();
        let mut out = splined(record, rest);
        out.value.iter_mut().zip(&by_flow).for_each(|(value, flow)| *value += flow);
        out.slope.iter_mut().zip(&rates).for_each(|(slope, rate)| *slope += rate);
        Some(out)
    };
    let [a, b] = [Side::A, Side::B].map(through);
    for (out, bent) in [(&mut record.p_a_smooth, a), (&mut record.p_b_smooth, b)] {
        if let Some(bent) = bent {
            *out = bent;
        }
    }
}

/// How fast flow through the valve changes a chamber's pressure at an entry, Pa/s; `None` if its pressure or the position is not known.
/// The opening is signed, in rad.
fn pa_per_s(record: &Record, plant: &Plant<f64>, (side, k): (Side, usize), opening: f64) -> Option<f64> {
    let (volume_a, volume_b) = plant.volumes_m3(*record.y_smooth.value.get(k)?);
    let volume = if side == Side::A { volume_a } else { volume_b };
    Some(plant.energy_j_per_kg() / volume * kg_per_s(record, plant, (side, k), opening)?)
}

/// The mass flow through the valve into a chamber at an entry with a signed opening, kg/s, from pressures as measured.
fn kg_per_s(record: &Record, plant: &Plant<f64>, (side, k): (Side, usize), opening: f64) -> Option<f64> {
    let c = plant.coefficients();
    let p = *record.chamber(side).smooth.value.get(k)?;
    let supply = record.p_sup_smooth.value.get(k).copied().unwrap_or(c.supply_pa);
    let fills = (opening >= 0.0) == (side == Side::A);
    Some(plant.orifices(side).inflow(fills, opening.abs(), p, supply, c.atmosphere_pa).mass_flow)
}

/// How much of the change from each value to the next is not the change before or after it: a ramp has none, a jump all.
fn jumps(signal: &[f64]) -> Vec<f64> {
    let change = |k: usize| signal.get(k + 1).map_or(0.0, |next| next - signal[k]);
    let jump = |k: usize| {
        let here = change(k);
        let before = if k > 0 { change(k - 1) } else { here };
        let after = if k + 2 < signal.len() { change(k + 1) } else { here };
        (here - before).abs().max((here - after).abs())
    };
    (0..signal.len()).map(jump).collect()
}

/// How much of each change is unknown: all of what stands out from the jitter nearby, and of jitter a share.
fn unknown(jumps: &[f64], share: f64) -> Vec<f64> {
    let of = |k: usize| {
        let jitter = jumps[k].min(MOST_JITTER * usual(jumps, k));
        jumps[k] - (1.0 - share) * jitter
    };
    (0..jumps.len()).map(of).collect()
}

/// The median of what a signal does near one of its rows.
fn usual(changes: &[f64], row: usize) -> f64 {
    let near = row.saturating_sub(JITTERING)..(row + JITTERING + 1).min(changes.len());
    median(&mut changes[near].to_vec()).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::simulated::{every_other, simulated};
    use crate::data::grid::{Between, refined};
    use crate::data::prepare::prepare;
    use plant_model::{Effect, Effects};
    use rand::SeedableRng;
    use rand::distr::{Distribution, StandardUniform};
    use rand::rngs::Xoshiro256PlusPlus;
    use rig_files::RigFile;

    #[test]
    fn a_ramp_has_no_jumps_and_a_step_is_one() {
        assert_eq!(jumps(&[0.0, 1.0, 2.0, 3.0])[..3], [0.0, 0.0, 0.0]);
        assert_eq!(jumps(&[0.0, 0.0, 0.0, 2.0, 2.0, 2.0])[1..5], [2.0, 2.0, 2.0, 0.0]);
    }

    #[test]
    fn of_jitter_a_share_is_unknown_and_of_what_stands_out_all() {
        let mut changes = [0.1; 40];
        changes[20] = 2.0;
        let of = unknown(&changes, 0.25);
        assert!((of[5] - 0.025).abs() < 1.0e-12 && (of[20] - (2.0 - 0.75 * 0.3)).abs() < 1.0e-12, "{of:?}");
        // A command that rests, and steps once.
        let mut rests = [0.0; 40];
        rests[19..22].fill(2.0);
        assert_eq!(unknown(&rests, 0.25), rests);
    }

    #[test]
    fn a_lagging_spool_spreads_what_a_jump_leaves_unknown_over_the_rows_behind_and_takes_nothing_of_it() {
        let file = RigFile::paper_c();
        let step = |t_s: f64| if t_s < 1.0 { 0.0 } else { 2.0 };
        let log = every_other(&simulated(&file, &file.effects, 2001, step));
        // Pressures held where they are at the step, so that a flow counts the same later.
        let rest = |column: &Option<Vec<f64>>| column.as_ref().map(|p_pa| vec![p_pa[400]; p_pa.len()]);
        let log = rig_files::Log {
            y_m: vec![log.y_m[400]; log.y_m.len()],
            p_a_pa: rest(&log.p_a_pa),
            p_b_pa: rest(&log.p_b_pa),
            ..log
        };
        let [at_once, lagging] = [0.0, 0.009].map(|lag_s| {
            let plant =
                Plant::new(&file.rig, &plant_model::Effects::none().with(plant_model::Effect::ValveLag, &[lag_s]));
            let mut record = refined(prepare(&log, &file), Between::Held);
            doubts(&mut record, &plant.expect("a sound rig"), 1.0);
            record.doubt_a_pa
        });
        let most = |doubts: &[f64]| doubts.iter().fold(0.0_f64, |most, doubt| most.max(*doubt));
        let all = |doubts: &[f64]| doubts.iter().map(|doubt| doubt * doubt).sum::<f64>();
        assert!(most(&lagging) < 0.75 * most(&at_once), "{} {}", most(&lagging), most(&at_once));
        assert!((all(&lagging) / all(&at_once) - 1.0).abs() < 0.01, "{} {}", all(&lagging), all(&at_once));
    }

    #[test]
    fn a_spool_rests_behind_its_play_as_far_from_where_logged_commands_leave_it_as_is_doubted() {
        let file = RigFile::paper_c();
        let hidden = Effects::none().with(Effect::ValveHysteresis, &[0.02]);
        let plant = Plant::new(&file.rig, &hidden).expect("a sound rig");
        // Jitter that is nearly normal.
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut draw = || -> f64 { StandardUniform.sample(&mut draws) };
        let mut sum_of_four = || draw() + draw() + draw() + draw() - 2.0;
        let jitter: Vec<f64> = (0..40_001).map(|_| 5.0e-3 * sum_of_four()).collect();
        let command = |t_s: f64| 0.3 * (8.0 * t_s).sin() + jitter[(t_s * 1.0e3).round() as usize];
        let fine = simulated(&file, &file.effects, 40_001, command);
        let record = refined(prepare(&every_other(&fine), &file), Between::Held);
        let commands = fine.u_v.as_ref().expect("simulated");
        let (truth, told) = (behind_play(commands, &plant), behind_play(&record.u_rows_v, &plant));
        let (mut error, mut doubt, mut count) = (0.0, 0.0, 0);
        for (row, rest) in rests(&record, &plant, &told).iter().enumerate() {
            let Some(rest) = rest else { continue };
            error += (told[row] - truth[2 * row]).powi(2);
            doubt += rest.beyond_v.powi(2);
            count += 1;
        }
        assert!(count > 4_000, "{count}");
        let ratio = (doubt / error).sqrt();
        assert!((0.7..2.0).contains(&ratio), "{ratio}");
        // A step that is over leaves nothing to doubt.
        let step: Vec<f64> = (0..record.rows.len()).map(|row| if row < 20 { 0.0 } else { 1.0 }).collect();
        let stepped = behind_play(&step, &plant);
        let record = Record { u_rows_v: step, ..record };
        assert!(rests(&record, &plant, &stepped).iter().flatten().all(|rest| rest.beyond_v == 0.0));
        // Nor does a command that is the same in two rows, where there is no play.
        let held = record.u_rows_v.iter().enumerate().map(|(row, _)| if row % 4 < 2 { 0.0 } else { 0.1 }).collect();
        let (record, none) =
            (Record { u_rows_v: held, ..record }, Plant::new(&file.rig, &file.effects).expect("a sound rig"));
        assert!(rests(&record, &none, &behind_play(&record.u_rows_v, &none)).iter().all(Option::is_none));
    }

    #[test]
    fn the_mean_of_a_pressure_between_rows_is_known_with_its_bends() {
        let file = RigFile::paper_c();
        // A command for two milliseconds each, and a row of the log when it changes.
        let staircase = |t_s: f64| (60.0 * (0.5 * t_s * 1.0e3 + 1.0e-6).floor() * 2.0e-3).sin();
        let fine = simulated(&file, &file.effects, 4001, staircase);
        let plant = Plant::new(&file.rig, &file.effects).expect("a sound rig");
        let mut record = refined(prepare(&every_other(&fine), &file), Between::Held);
        follow_the_flow(&mut record, &plant);
        for (side, p_pa) in [(Side::A, &fine.p_a_pa), (Side::B, &fine.p_b_pa)] {
            let p_pa = p_pa.as_ref().expect("simulated");
            // Simpson's rule with the pressure between the rows.
            let bend_pa = |row: usize| (2.0 * p_pa[2 * row + 1] - p_pa[2 * row] - p_pa[2 * row + 2]) / 3.0;
            let within = 50..1950;
            let rms_pa = |of: &dyn Fn(usize) -> f64| {
                (within.clone().map(|row| of(row).powi(2)).sum::<f64>() / within.len() as f64).sqrt()
            };
            let (missed, bent) = (rms_pa(&|row| bend_pa(row) - record.bend_pa(side, row)), rms_pa(&bend_pa));
            assert!(missed < 0.3 * bent, "{missed} {bent}");
        }
    }
}
