//! Diagnosis from a position and one chamber's pressure: the balance of forces while that chamber is vented.
//!
//! With the other chamber's pressure unknown, a driven stroke says little: any missing force may be back pressure.
//! While the measured chamber is at atmosphere and the other one is not driven, only weight, friction and damping act:
//! `M y'' = -F_0 - F_c sign(v) - c v`. Coasting on and falling back have opposite friction and the same constant force,
//! so the two together separate them. One direction alone does not. Whether the other chamber is driven was not
//! measured, so a force is named only if it is the weight of the moving mass.

use crate::constants;
use crate::data::record::Record;
use crate::outcome::{Cause, Diagnosis, Estimate, Evidence, LogSummary, Standing, Supported};
use plant_model::{Effect, GRAVITY_M_PER_S2};
use rig_files::{RigFile, Verdict};

/// The measured chamber counts as vented below this part of its highest gauge pressure; what is left of it is accounted
/// for.
const VENTED: f64 = 0.1;
/// Part of the travelled range at either end that is left out: end stops and cushions push there.
const ENDS: f64 = 0.02;
/// Fewer coasting samples say nothing.
const LEAST_SAMPLES: usize = 10;
/// Relative difference of friction between the directions that is allowed for: it adds to the standard error of the
/// constant force, which is the mean of both directions.
const UNNOTICED_ASYMMETRY: f64 = 0.1;

/// A force with its standard error, N.
#[derive(Clone, Copy)]
struct Force {
    /// Value, N.
    value_n: f64,
    /// Standard error from one stroke to the next, N.
    std_error_n: f64,
}

/// The forces that one pressure and a position determine.
struct OnePressure {
    /// Force while coasting away, extrapolated to standstill: constant force plus friction, N along -y.
    coasting: Option<Force>,
    /// Force while returning, at the speed it returns with: constant force less friction and damping, N along -y.
    returning: Option<Force>,
    /// The constant force opposing +y, N; needs both.
    constant_force: Option<Force>,
    /// The weight of the rig file's mass, N, for comparison.
    weight_n: f64,
}

/// One vented phase: force per mass against velocity.
struct Phase {
    v: Vec<f64>,
    force_n: Vec<f64>,
}

/// Judges a log with exactly one chamber pressure and a position; `None` if there is no such pressure or no vented
/// phase.
fn one_pressure(rig: &RigFile, record: &Record) -> Option<OnePressure> {
    let cylinder = &rig.rig.cylinder;
    let (pressure, sign, area) = match (record.available.pressure_a, record.available.pressure_b) {
        (true, false) => (&record.p_a_pa, 1.0, cylinder.area_a_m2),
        (false, true) => (&record.p_b_pa, -1.0, cylinder.area_b_m2),
        _ => return None,
    };
    let atmosphere = rig.rig.supply.atmosphere_pa;
    let mass = rig.rig.load.mass_kg;
    // The sensor's lowest reading is closer to the true atmospheric pressure than the rig file's value.
    let zero = pressure.iter().copied().fold(f64::INFINITY, f64::min).max(0.9 * atmosphere).min(1.1 * atmosphere);
    let highest = pressure.iter().copied().fold(0.0, f64::max) - zero;
    let usual = record.quality.interval_s;
    let reach = (constants::velocity_reach() / usual.max(1e-6)).round() as usize;
    if record.len() < 10 * reach + 1 || reach < 3 || highest <= 0.0 {
        return None;
    }
    let (low, high) = record.y_m.iter().fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(*y), b.max(*y)));
    let margin = ENDS * (high - low);
    // Standard error of the slope of a straight line through 2 reach + 1 samples.
    let m = reach as f64;
    let noise = record.quality.position.standard_deviation;
    let rest = constants::rest_sigmas() * noise * (3.0 / (m * (m + 1.0) * (2.0 * m + 1.0))).sqrt() / usual;

    let mut phases: [Vec<Phase>; 2] = [Vec::new(), Vec::new()];
    let mut current: Option<(usize, Phase)> = None;
    for k in reach..record.len() - reach {
        let moved = motion(record, k, reach);
        let inside = record.y_m[k] > low + margin && record.y_m[k] < high - margin;
        let whole = record.t_s[k + reach] - record.t_s[k - reach] < 3.0 * (2 * reach) as f64 * usual;
        let around = &pressure[k - reach..=k + reach];
        let gauge_pa = mean(around) - zero;
        let vented = gauge_pa < VENTED * highest;
        let (v, a) = (sign * moved.0, sign * moved.1);
        let direction = usize::from(v < 0.0);
        let usable = inside && whole && vented && v.abs() > rest;
        if let Some((was, phase)) = current.take_if(|(was, _)| !usable || *was != direction)
            && phase.v.len() >= LEAST_SAMPLES
        {
            phases[was].push(phase);
        }
        if usable {
            let (_, phase) = current.get_or_insert((direction, Phase { v: Vec::new(), force_n: Vec::new() }));
            phase.v.push(v);
            // The residual pressure of the vented chamber still pushes.
            phase.force_n.push(area * gauge_pa - mass * a);
        }
    }
    if let Some((was, phase)) = current
        && phase.v.len() >= LEAST_SAMPLES
    {
        phases[was].push(phase);
    }
    if phases[0].is_empty() && phases[1].is_empty() {
        return None;
    }
    let coasting = combine(phases[0].iter().filter_map(at_standstill));
    let returning = combine(phases[1].iter().map(|phase| mean(&phase.force_n)));
    // Away: F_0 + F_c. Back: F_0 - F_c - c |v|. Their mean is F_0 less half the damping, which only lowers it.
    let slowing = mean(&phases[0].iter().map(|phase| mean(&phase.force_n)).collect::<Vec<_>>());
    let constant_force = coasting.zip(returning).map(|(up, down)| {
        let scatter = 0.5 * up.std_error_n.hypot(down.std_error_n);
        // Two errors that no number of strokes averages out: of the way to standstill, and of friction taken to be
        // even.
        let extrapolation = 0.5 * (slowing - up.value_n);
        let uneven = UNNOTICED_ASYMMETRY * 0.5 * (up.value_n - down.value_n);
        Force {
            value_n: sign * 0.5 * (up.value_n + down.value_n),
            std_error_n: scatter.hypot(extrapolation).hypot(uneven),
        }
    });
    Some(OnePressure { coasting, returning, constant_force, weight_n: GRAVITY_M_PER_S2 * mass })
}

/// Velocity and acceleration of a parabola around a sample.
fn motion(record: &Record, k: usize, reach: usize) -> (f64, f64) {
    let mut s = [0.0f64; 5];
    let mut b = [0.0f64; 3];
    let scale = record.t_s[k + reach] - record.t_s[k];
    for i in k - reach..=k + reach {
        let x = (record.t_s[i] - record.t_s[k]) / scale;
        let d = record.y_m[i] - record.y_m[k];
        let mut power = 1.0;
        for (n, sum) in s.iter_mut().enumerate() {
            *sum += power;
            if let Some(b) = b.get_mut(n) {
                *b += power * d;
            }
            power *= x;
        }
    }
    let matrix = nalgebra::Matrix3::new(s[0], s[1], s[2], s[1], s[2], s[3], s[2], s[3], s[4]);
    let Some(inverse) = matrix.try_inverse() else { return (f64::NAN, f64::NAN) };
    let c = inverse * nalgebra::Vector3::from(b);
    (c[1] / scale, 2.0 * c[2] / (scale * scale))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// A straight line of force over speed, taken to standstill.
fn at_standstill(phase: &Phase) -> Option<f64> {
    let (v0, f0) = (mean(&phase.v), mean(&phase.force_n));
    let (mut vf, mut vv) = (0.0, 0.0);
    for (v, f) in phase.v.iter().zip(&phase.force_n) {
        vf += (v - v0) * (f - f0);
        vv += (v - v0).powi(2);
    }
    // Without a spread of speeds there is nothing to extrapolate along.
    (vv > (0.1 * v0).powi(2) * phase.v.len() as f64).then(|| f0 - vf / vv * v0)
}

fn combine(values: impl Iterator<Item = f64>) -> Option<Force> {
    let values: Vec<f64> = values.collect();
    let n = values.len() as f64;
    if values.is_empty() {
        return None;
    }
    let value_n = mean(&values);
    let square = values.iter().map(|x| (x - value_n).powi(2)).sum::<f64>();
    let std_error_n = if n > 1.0 { (square / (n - 1.0) / n).sqrt() } else { f64::INFINITY };
    Some(Force { value_n, std_error_n })
}

/// The constant force must exceed its standard error by this factor to be named.
const NAMED_SIGMAS: f64 = 4.0;
/// And must be the weight of the rig file's mass within this many.
const WEIGHT_SIGMAS: f64 = 2.0;

/// [`one_pressure`] in the form of a diagnosis, for a log on which [`crate::diagnose()`] finds nothing to judge.
pub(crate) fn diagnose_one_pressure(rig: &RigFile, record: &Record) -> Option<Diagnosis> {
    let seen = one_pressure(rig, record)?;
    let nominal = rig.effects.get(Effect::ConstantForce).map_or(0.0, |values| values[0]);
    let mut extended_rig = rig.clone();
    let mut causes = Vec::new();
    // A small mean of two large opposite forces is as well their difference in friction, and a force that is not the
    // weight may be the pressure of the other chamber.
    let gap = seen.constant_force.filter(|force| {
        let off = (force.value_n - nominal).abs();
        let weighs = (force.value_n.abs() - seen.weight_n).abs() < WEIGHT_SIGMAS * force.std_error_n;
        off > NAMED_SIGMAS * force.std_error_n && off > 0.5 * half_spread(&seen) && weighs
    });
    if let Some(force) = gap {
        extended_rig.effects.set(Effect::ConstantForce, &[force.value_n]);
        extended_rig.name = format!("{}, extended", rig.name);
        causes.push(Cause {
            id: Effect::ConstantForce.id().to_string(),
            parameters: vec![Estimate { name: "force_n".into(), value: force.value_n, std_error: force.std_error_n }],
            ties: Effect::ConstantForce.structural_ties().map(|e| e.id().to_string()).collect(),
            evidence: format!(
                "With the measured chamber vented, the piston is slowed by {:.1} N while it coasts on and by {:.1} N while \
                 it returns: friction turns with the motion, the mean of {:.1} N does not (the rig file's mass weighs \
                 {:.1} N).",
                seen.coasting.map_or(f64::NAN, |f| f.value_n),
                seen.returning.map_or(f64::NAN, |f| f.value_n),
                force.value_n,
                seen.weight_n
            ),
            share: 1.0,
        });
    }
    let supported = |cause: &Cause| Supported {
        id: cause.id.clone(),
        standing: Standing::Tied,
        parameters: cause.parameters.clone(),
        gain: None,
    };
    let extension = causes.iter().map(supported).collect();
    let judged = [Effect::ConstantForce];
    let not_identifiable = Effect::ALL
        .into_iter()
        .filter(|effect| !judged.contains(effect))
        .map(|effect| effect.id().to_string())
        .collect();
    let diagnosis = Diagnosis {
        // Driven strokes stay open: what is missing there may be the pressure that was not measured.
        verdict: if causes.is_empty() { Verdict::NoGap } else { Verdict::PartlyExplained },
        causes,
        extension,
        calibration: Vec::new(),
        gain: None,
        horizons: Vec::new(),
        not_identifiable,
        next_experiment: Some(
            "Record the valve command and the pressure of the other chamber: without them neither flow nor driven strokes \
             can be judged. To tell a constant force from friction that differs by direction, turn the cylinder round."
                .to_string(),
        ),
        leads: Vec::new(),
        description: None,
        balances: Vec::new(),
        log: LogSummary { available: record.available, quality: record.quality.clone(), held_back_s: 0.0 },
        hypotheses: Vec::new(),
        extended_rig,
        evidence: Evidence::default(),
    };
    Some(diagnosis)
}

/// Half the distance between coasting and returning: friction.
fn half_spread(seen: &OnePressure) -> f64 {
    seen.coasting.zip(seen.returning).map_or(f64::INFINITY, |(a, b)| 0.5 * (a.value_n - b.value_n).abs())
}
