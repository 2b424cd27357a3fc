//! The synthetic rig and `plant-model` were written apart; on every effect they must tell the same story.

use plant_model::{Effect, Effects, Simulator};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rayon::prelude::*;
use rig_files::RigFile;
use synthesis::{Case, Cause, Chain, Family, Law, Which, strength};

/// Accepted root mean square differences: a tenth of a position sensor's noise, a twentieth of a
/// pressure sensor's. What remains is the synthetic integrator's own step (40 us, second order), which shows
/// where the piston hits an end stop.
const POSITION_M: f64 = 5e-6;
const PRESSURE_PA: f64 = 30.0;

/// Root mean square differences in position (m) and pressure (Pa) when `plant-model` replays the commands of a recording.
fn differences(rig_file: &RigFile, causes: Vec<Cause>, family: Family, seed: u64) -> (f64, f64) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let experiment = family.draw(&rig_file.rig, 5.0, &mut rng);
    let case = Case {
        truth: rig_file.rig,
        law: Law::for_rig(&rig_file.rig, 0.8),
        chain: Chain::ideal(),
        rig_file: rig_file.clone(),
        causes,
        experiment,
        seed,
    };
    let (log, ideal) = case.record();
    let effects = Cause::effects(&case.causes);
    let mut simulator = Simulator::<f64>::new(&case.truth, &effects).expect("a valid rig");
    let [p_a, p_b] = synthesis::Physics::new(&case.truth, &case.causes).rest_pressures_pa();
    let start = simulator.plant().state_at_rest(case.experiment.start_m, p_a, p_b);
    simulator.set_state(start);
    let (mut sum_y, mut sum_p) = (0.0_f64, 0.0_f64);
    let u = log.u_v.as_ref().expect("the command is recorded");
    for row in 0..log.len() {
        let shown = simulator.measure();
        sum_y += (shown.y_m - ideal[row].y_m).powi(2);
        sum_p += 0.5 * (shown.p_a_pa - ideal[row].p_a_pa).powi(2);
        sum_p += 0.5 * (shown.p_b_pa - ideal[row].p_b_pa).powi(2);
        if row + 1 < log.len() {
            simulator.advance(u[row], log.t_s[row + 1] - log.t_s[row]);
        }
    }
    let rows = log.len() as f64;
    ((sum_y / rows).sqrt(), (sum_p / rows).sqrt())
}

#[test]
fn every_effect_moves_the_synthetic_rig_as_it_moves_the_model() {
    // A part of them has each effect on each rig once, in one of the two kinds of experiment by turns.
    let mut runs = Vec::new();
    for (name, rig_file) in [("a", RigFile::paper_a()), ("b", RigFile::paper_b()), ("c", RigFile::paper_c())] {
        for (turn, family) in [Family::Everyday, Family::Identification].into_iter().enumerate() {
            runs.push((name, rig_file.clone(), family, None));
            let effects = Effect::ALL.into_iter().skip(test_stages::of(0, turn)).step_by(test_stages::of(1, 2));
            runs.extend(effects.map(|effect| (name, rig_file.clone(), family, Some(effect))));
        }
    }
    let beyond: Vec<String> = runs
        .par_iter()
        .filter_map(|(name, rig_file, family, effect)| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
            let draw = |effect| strength::draw(Which::Catalogue(effect), &rig_file.rig, 1.0, &mut rng);
            let causes: Vec<Cause> = effect.map(draw).into_iter().collect();
            let (y, p) = differences(rig_file, causes, *family, 3);
            let near = y < POSITION_M && p < PRESSURE_PA;
            (!near).then(|| format!("{name} {} {effect:?}: {y:.3e} m, {p:.2} Pa", family.id()))
        })
        .collect();
    assert!(beyond.is_empty(), "differences beyond {POSITION_M} m or {PRESSURE_PA} Pa:\n{beyond:#?}");
}

/// Cushions, a spring, and what lies in series with them; a spool with inertia; a valve with smooth curve, rounded corners and edges
/// that do not open together.
#[test]
fn cylinders_as_bought_move_the_same_way_in_both() {
    let mut cushioned = RigFile::paper_c();
    let c = &mut cushioned.rig.cushions;
    (c.cushion_a_length_m, c.cushion_a_conductance_m3_per_s_pa) = (0.05, 3.0e-9);
    (c.cushion_b_length_m, c.cushion_b_conductance_m3_per_s_pa) = (0.04, 5.0e-9);
    let h = &mut cushioned.rig.hoses;
    (h.a_length_m, h.a_diameter_m, h.b_length_m, h.b_diameter_m) = (1.0, 4.0e-3, 1.0, 4.0e-3);
    let mut single_acting = RigFile::paper_c();
    (single_acting.rig.cylinder.spring_preload_n, single_acting.rig.cylinder.spring_n_per_m) = (150.0, 1500.0);
    let [mut underdamped, mut overdamped] = [RigFile::paper_c(), RigFile::paper_c()];
    (underdamped.rig.valve.spool_inertia, overdamped.rig.valve.spool_inertia) = (0.6, 0.1);
    let in_series =
        [None, Some(Effect::LineRestriction), Some(Effect::ChokedFlow), Some(Effect::LeakCrossPiston)].as_slice();
    let lagging = [Some(Effect::ValveLag)].as_slice();
    let sheet = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../rigs/festo-dsnu-25-100.toml");
    let mut machined = RigFile::read(&sheet).expect("a shipped rig file");
    machined.effects = Effects::none();
    let mut underlapped = RigFile::paper_c();
    let v = &mut machined.rig.valve;
    (v.corner_rounding_v, v.exhaust_overlap_v, v.opening_smoothness) = (0.08, 0.03, 0.7);
    (underlapped.rig.valve.corner_rounding_v, underlapped.rig.valve.exhaust_overlap_v) = (0.3, -0.2);
    let by_valve = [None, Some(Effect::ValveDeadZone), Some(Effect::ValveLag), Some(Effect::OpeningCurve)].as_slice();
    for (name, rig_file, effects) in [
        ("cushioned", cushioned, in_series),
        ("single-acting", single_acting, in_series),
        ("underdamped", underdamped, lagging),
        ("overdamped", overdamped, lagging),
        ("machined", machined, by_valve),
        ("underlapped", underlapped, by_valve),
    ] {
        for family in [Family::Everyday, Family::Identification] {
            for effect in effects.iter().copied() {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
                let draw = |effect| strength::draw(Which::Catalogue(effect), &rig_file.rig, 1.0, &mut rng);
                let (y, p) = differences(&rig_file, effect.map(draw).into_iter().collect(), family, 4);
                assert!(y < POSITION_M && p < PRESSURE_PA, "{name} {} {effect:?}: {y:e} m, {p} Pa", family.id());
            }
        }
    }
}
