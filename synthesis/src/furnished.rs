//! A rig with everything that a bought one has and its data sheets leave out, and the rig file that an honest engineer writes
//! for it.

use crate::case::{Case, draw_edges, true_opening};
use crate::cause::Cause;
use crate::chain::Chain;
use crate::foreign::Foreign;
use crate::law::Law;
use crate::sequences::Family;
use plant_model::{Effect, OpeningTable, Rig};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rig_files::{Column, RigFile, rig_key};

/// Values that the data sheet states with a tolerance, and that a rig has within it.
const WITHIN_TOLERANCE: [&str; 12] = [
    "valve.fill_critical_ratio_a",
    "valve.fill_critical_ratio_b",
    "valve.exhaust_critical_ratio_a",
    "valve.exhaust_critical_ratio_b",
    "cylinder.volume_a0_m3",
    "cylinder.volume_b0_m3",
    "load.mass_kg",
    "friction.viscous_n_s_per_m",
    "hose_a.length_m",
    "hose_a.diameter_m",
    "hose_b.length_m",
    "hose_b.diameter_m",
];

/// Conductances of the four paths: each differs from the data sheet's by its own amount.
const PATHS: [&str; 4] = [
    "valve.fill_conductance_a_m3_per_s_pa",
    "valve.fill_conductance_b_m3_per_s_pa",
    "valve.exhaust_conductance_a_m3_per_s_pa",
    "valve.exhaust_conductance_b_m3_per_s_pa",
];

/// The file's tolerance of a value.
fn tolerance(file: &RigFile, path: &str) -> f64 {
    file.tolerance.own(path).unwrap_or(file.tolerance.default)
}

/// A rig whose data sheets are `sheet`: opening curve stretched, shifted and not as drawn, its corners round and its edges not together, paths unequal, seals that are loaded by pressure
/// and rub differently by direction, a slight incline, cushions, sensors of other gain and offset, a valve somewhat slower
/// and with more play than stated; recorded for `duration_s`, the supply too. What has a tolerance is off by it.
#[must_use]
pub fn furnished(sheet: &RigFile, duration_s: f64, seed: u64) -> Case {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let normal = |rng: &mut Xoshiro256PlusPlus| -> f64 {
        loop {
            let value: f64 = StandardNormal.sample(rng);
            if value.abs() < 2.0 {
                return value;
            }
        }
    };
    let mut truth: Rig<f64> = sheet.rig;
    for path in PATHS.iter().chain(&WITHIN_TOLERANCE) {
        let Some(key) = rig_key(path) else { continue };
        let off = tolerance(sheet, path) * normal(&mut rng);
        key.set(&mut truth, key.get(&sheet.rig) * (1.0 + 0.7 * off));
    }
    let rubs = 1.0 + 0.7 * tolerance(sheet, "friction.coulomb_n") * normal(&mut rng);
    truth.friction.coulomb_n *= rubs;
    truth.friction.static_n *= rubs;
    truth.friction.breakaway_m *= rubs.min(1.0);
    truth.supply.pressure_pa *= 1.0 + 0.01 * normal(&mut rng);
    truth.gas.temperature_k += 3.0 * normal(&mut rng);
    truth.supply.atmosphere_pa += 800.0 * normal(&mut rng);
    truth.load.inclination_deg += 2.0 * normal(&mut rng);
    // Each side of the spool opens a little faster or slower than the data sheet's, about a zero that is a little off.
    let (null_v, right, left) = (0.04 * normal(&mut rng), 1.0 + 0.05 * normal(&mut rng), 1.0 + 0.05 * normal(&mut rng));
    let points: Vec<[f64; 2]> = (sheet.rig.opening.points().iter())
        .map(|[u, opening]| [null_v + u * if *opening > 0.0 { right } else { left }, *opening])
        .collect();
    truth.opening = OpeningTable::new(&points).unwrap_or(sheet.rig.opening);
    // Where flow ends says the dead zone, for a table too.
    [truth.valve.dead_zone_left_v, truth.valve.dead_zone_right_v] = truth.opening.closed_v();

    let stated = |effect: Effect| sheet.effects.get(effect).and_then(|values| values.first().copied()).unwrap_or(0.0);
    let sign = |rng: &mut Xoshiro256PlusPlus| if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let gauge_pa = truth.supply.pressure_pa - truth.supply.atmosphere_pa;
    let one = |effect: Effect, value: f64| Cause::Catalogue(effect, [value, 0.0, 0.0]);
    let cushion_m = 0.5 * truth.cylinder.stroke_m * rng.random_range(0.1..0.2);
    let mut causes = vec![
        one(Effect::ValveLag, stated(Effect::ValveLag) * rng.random_range(1.0..1.6)),
        one(Effect::ValveHysteresis, stated(Effect::ValveHysteresis) * rng.random_range(0.5..1.5)),
        one(Effect::FrictionPressure, rng.random_range(0.1..0.4) * truth.friction.coulomb_n / gauge_pa),
        one(Effect::FrictionAsymmetry, sign(&mut rng) * rng.random_range(0.05..0.2)),
        one(Effect::PositionScale, 1.0 + 0.004 * normal(&mut rng)),
        one(Effect::PressureAOffset, 2500.0 * normal(&mut rng)),
        one(Effect::PressureBOffset, 2500.0 * normal(&mut rng)),
        one(Effect::PressureAGain, 1.0 + 0.007 * normal(&mut rng)),
        one(Effect::PressureBGain, 1.0 + 0.007 * normal(&mut rng)),
        Cause::Catalogue(Effect::Cushioning, [cushion_m, rng.random_range(2.3..5.7), rng.random_range(2.3..5.7)]),
        Cause::Foreign(Foreign::DwellStiction, [rng.random_range(0.1..0.3), rng.random_range(0.3..0.8)]),
    ];
    let mut chain = Chain::standard(sheet.io.position_range_m);
    chain.pressure.0 = sheet.io.pressure_range_pa;
    chain.columns.push(Column::PSup);
    let experiment = Family::Mixed.draw(&sheet.rig, duration_s, &mut rng);
    let law = Law::for_rig(&sheet.rig, rng.random_range(0.8..1.4));
    // The curve was read off a drawing, and a spool of higher order acts later than its time constant says.
    truth.opening = true_opening(&truth.opening, 0.7 * sheet.tolerance.default, &mut rng);
    causes.push(one(Effect::LineDelay, rng.random_range(0.1e-3..0.6e-3)));
    let seed = rng.random();
    truth.valve.spool_inertia = rng.random_range(0.1..0.5);
    draw_edges(&mut truth, &mut rng);
    Case { rig_file: sheet.clone(), truth, causes, experiment, law, chain, seed }
}

/// Whether an effect, or one of its ties, is on such a rig: hidden there, or by another name. A slight incline is a constant force,
/// a null offset a dead zone elsewhere.
#[must_use]
pub fn is_furnished_with(case: &Case, id: &str, ties: &[String]) -> bool {
    let by_another_name = [Effect::ConstantForce.id(), Effect::ValveDeadZone.id()];
    let hidden = |id: &str| by_another_name.contains(&id) || case.causes.iter().any(|cause| cause.id() == id);
    hidden(id) || ties.iter().any(|tie| hidden(tie))
}
