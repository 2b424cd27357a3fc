//! Figures 10 and 11: friction in steady sliding, and stiction under a force that returns below the Coulomb level.

use super::{Claim, Figure};
use plant_model::friction::LuGre;
use plant_model::{Effects, Plant, Rig};
use report_html::{Marker, Plot, Series};

fn law() -> (Rig<f64>, Option<LuGre<f64>>) {
    let rig = Rig::<f64>::paper_a();
    let law = Plant::new(&rig, &Effects::none()).ok().map(|plant| *plant.friction());
    (rig, law)
}

pub(super) fn steady_state() -> Figure {
    let (rig, law) = law();
    let friction = rig.friction;
    let force = |v: f64| law.map_or(f64::NAN, |law| law.steady_force_n(v));
    let v: Vec<f64> = (-1000..=1000).map(|at| f64::from(at) * 1e-4).collect();
    let curve: Vec<f64> = v.iter().map(|v| if *v == 0.0 { f64::NAN } else { force(*v) }).collect();
    let breakaway = force(1e-6);
    let (at_least, least) = (1..=1000)
        .map(|at| f64::from(at) * 1e-4)
        .map(|v| (v, force(v)))
        .fold((0.0, f64::INFINITY), |best, point| if point.1 < best.1 { point } else { best });
    let odd = v.iter().all(|v| (force(*v) + force(-*v)).abs() < 1e-12);
    let slope = (force(0.1) - force(0.09)) / 0.01;
    Figure {
        number: 10,
        title: "Friction in steady sliding",
        setting: "Equation (3.15) with Table 1.",
        plots: vec![
            Plot::new("Fig. 10: friction in steady state (3.15)", "velocity, mm/s", "friction force, N")
                .with(Series::line("friction", v.iter().map(|v| v * 1e3).collect(), curve))
                .marker(Marker::Horizontal(friction.coulomb_n))
                .marker(Marker::Horizontal(-friction.coulomb_n)),
        ],
        claims: vec![
            Claim::new(
                "static friction at the start, then a fall (Stribeck), then viscous growth",
                (breakaway - friction.static_n).abs() < 1e-3
                    && least < friction.static_n
                    && (slope - friction.viscous_n_s_per_m).abs() < 0.01,
                format!(
                    "{breakaway:.3} N at standstill, least {least:.3} N at {:.1} mm/s, then {slope:.2} N s/m",
                    1e3 * at_least
                ),
            ),
            Claim::new("the same in both directions", odd, "F(−v) = −F(v) over ±0.1 m/s"),
        ],
    }
}

/// Mass on the friction law alone.
#[derive(Clone, Copy)]
struct Slider {
    x: f64,
    v: f64,
    z: f64,
}

const STEP_S: f64 = 1.0e-5;
const KEEP_EVERY: u32 = 100;

/// The force of Fig. 11(a): up to beyond static friction, back below Coulomb friction, an oscillation on top.
fn applied_force(t: f64, level_n: f64, amplitude_n: f64) -> f64 {
    let ramp = match t {
        t if t < 1.0 => 26.0 * t,
        t if t < 1.2 => 26.0 - (26.0 - level_n) * (t - 1.0) / 0.2,
        _ => level_n,
    };
    ramp + if t > 1.5 { amplitude_n * (2.0 * std::f64::consts::PI * 4.0 * (t - 1.5)).sin() } else { 0.0 }
}

/// Integrates with classic Runge-Kutta at 10 us, far below the 130 us where it would diverge at 1 m/s; the slider stays
/// below 0.1 m/s.
fn slide(mass_kg: f64, force: impl Fn(f64) -> f64, rates: impl Fn(f64, f64) -> (f64, f64)) -> Vec<Slider> {
    let derivative = |s: Slider, t: f64| {
        let (friction_n, bristle_rate) = rates(s.z, s.v);
        Slider { x: s.v, v: (force(t) - friction_n) / mass_kg, z: bristle_rate }
    };
    let plus = |s: Slider, h: f64, k: Slider| Slider { x: s.x + h * k.x, v: s.v + h * k.v, z: s.z + h * k.z };
    let mut s = Slider { x: 0.0, v: 0.0, z: 0.0 };
    let mut kept = Vec::new();
    for step in 0..500_000_u32 {
        if step % KEEP_EVERY == 0 {
            kept.push(s);
        }
        let t = f64::from(step) * STEP_S;
        let k1 = derivative(s, t);
        let k2 = derivative(plus(s, STEP_S / 2.0, k1), t + STEP_S / 2.0);
        let k3 = derivative(plus(s, STEP_S / 2.0, k2), t + STEP_S / 2.0);
        let k4 = derivative(plus(s, STEP_S, k3), t + STEP_S);
        for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
            s = plus(s, STEP_S * weight / 6.0, k);
        }
    }
    kept
}

/// What the text claims of stiction.
pub(super) const NO_CREEP: &str =
    "it renders stiction: an oscillating force below the Coulomb level does not make it creep";

pub(super) fn stiction() -> Figure {
    let (rig, law) = law();
    let friction = rig.friction;
    let low: fn(f64) -> f64 = |t| applied_force(t, 11.0, 4.0);
    let high: fn(f64) -> f64 = |t| applied_force(t, 16.0, 5.0);
    let elastoplastic = |force: fn(f64) -> f64| {
        law.map_or(Vec::new(), |law| {
            slide(rig.load.mass_kg, force, |z, v| {
                let response = law.respond(z, v, &law.level(v));
                (response.force_n, response.bristle_rate)
            })
        })
    };
    let (ours, above_breakaway) = (elastoplastic(low), elastoplastic(high));
    // LuGre as published in 1995, without the elasto-plastic switch: what (3.12) is there to mend.
    let lugre = law.map_or(Vec::new(), |law| {
        slide(rig.load.mass_kg, low, |z, v| {
            let rate = v - friction.stiffness_n_per_m / law.level(v).force_n * v.abs() * z;
            (friction.stiffness_n_per_m * z + friction.damping_n_s_per_m * rate + friction.viscous_n_s_per_m * v, rate)
        })
    });
    let t: Vec<f64> = (0..ours.len() as u32).map(|at| f64::from(at * KEEP_EVERY) * STEP_S).collect();
    let microns = |run: &[Slider], zero: f64| run.iter().map(|s| (s.x - zero) * 1e6).collect::<Vec<_>>();
    let at = |run: &[Slider], time: f64| {
        run.get((time / (STEP_S * f64::from(KEEP_EVERY))).round() as usize).map_or(f64::NAN, |s| s.x)
    };
    // Whole periods of the oscillation apart.
    let drift = |run: &[Slider]| (at(run, 4.75) - at(run, 2.25)) * 1e6;
    let (our_drift, lugre_drift, creep) = (drift(&ours), drift(&lugre), drift(&above_breakaway));
    let presliding = at(&ours, 0.85) * 1e6;
    let elastic = low(0.85) / friction.stiffness_n_per_m * 1e6;
    let slid_mm = (at(&ours, 1.5) - at(&ours, 0.85)) * 1e3;
    let held = t.iter().position(|t| *t >= 1.5).unwrap_or(0);
    let early = t.iter().position(|t| *t >= 0.94).unwrap_or(0);
    let after = |run: &[Slider]| microns(run.get(held..).unwrap_or_default(), at(run, 1.5));
    Figure {
        number: 11,
        title: "Presliding and stiction",
        setting: "Case (a)'s mass on its friction alone. The force rises to 26 N in 1 s, returns to 11 N, and oscillates by ±4 N from 1.5 s on: below the Coulomb force of 23.1 N. The paper gives the shape, not the numbers.",
        plots: vec![
            Plot::new("Fig. 11(a): applied force", "time, s", "force, N")
                .with(Series::line("applied force", t.clone(), t.iter().map(|t| low(*t)).collect()))
                .marker(Marker::Horizontal(friction.coulomb_n))
                .cursor_group("fig11"),
            Plot::new("Fig. 11(b): before breakaway", "time, s", "position, µm").with(Series::line(
                "",
                t[..early].to_vec(),
                microns(ours.get(..early).unwrap_or_default(), 0.0),
            )),
            Plot::new("Fig. 11(b): after the return, from 1.5 s", "time, s", "position since 1.5 s, µm")
                .with(Series::line("elasto-plastic (3.12)", t[held..].to_vec(), after(&ours)))
                .with(Series::line("LuGre without (3.12)", t[held..].to_vec(), after(&lugre)).dashed())
                .cursor_group("fig11"),
        ],
        claims: vec![
            Claim::new(
                "the model renders presliding displacement",
                presliding > elastic && presliding < 3.0 * elastic && slid_mm > 0.5,
                format!(
                    "{presliding:.1} µm at 22.1 N, of which {elastic:.1} µm elastic (22.1 N / sigma_0), then breakaway and \
                     {slid_mm:.1} mm of sliding"
                ),
            ),
            Claim::in_part(
                NO_CREEP,
                our_drift.abs() < 0.01 && lugre_drift.abs() > 10.0 * our_drift.abs(),
                format!(
                    "{our_drift:.4} µm of drift in ten periods at 11 ± 4 N, a force chosen here; LuGre without (3.12) creeps by \
                     {lugre_drift:.1} µm. It holds only below sigma_0 z_ba = {:.1} N, not up to the Coulomb force: at 16 ± 5 N \
                     the model creeps by {creep:.1} µm, too",
                    friction.stiffness_n_per_m * friction.breakaway_m
                ),
            ),
        ],
    }
}
