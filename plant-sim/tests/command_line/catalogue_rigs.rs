//! The positioning law on the rigs of catalogue parts (`rigs/`): unequal areas, weight, hoses, valves of ISO 6358 with a curve,
//! seals whose static friction is a third above the Coulomb friction.

use crate::root;
use plant_sim::closed_loop::{ClosedLoop, LoopSettings};
use plant_sim::servo::bench::{Bench, Driver, Move, step};
use plant_sim::servo::{Servo, Tuning};
use rayon::prelude::*;
use rig_files::RigFile;
use rig_files::tuning::{Pneumatics, lag_s};

const RIGS: [&str; 4] = ["festo-dgc-25-500", "festo-dsbc-32-200", "festo-dsnu-25-100", "smc-cp96-50-300-lifting"];

fn rig(name: &str) -> RigFile {
    let path = root().join("rigs").join(name).with_extension("toml");
    RigFile::read(&path).expect("a rig file")
}

fn bench(file: &RigFile, driver: Driver, seed: u64) -> Bench {
    let tuning = Tuning::of(&file.rig, lag_s(file), 1e-3);
    let bench = Bench::new(&file.rig, &file.effects, Servo::new(&file.rig, tuning), 1.0, seed).expect("a valid rig");
    bench.with_tick(driver)
}

/// How far the piston slips when it breaks away and nothing brakes it: the force that exceeds the Coulomb friction swings
/// against the air's stiffness.
fn slip_m(file: &RigFile) -> f64 {
    let (air, rig) = (Pneumatics::of(&file.rig), &file.rig);
    let stiffness =
        |n: usize| rig.gas.heat_capacity_ratio * air.areas_m2[n] * air.areas_m2[n] * air.rest_pa[n] / air.volumes_m3[n];
    2.0 * (rig.friction.static_n - rig.friction.coulomb_n) / (stiffness(0) + stiffness(1))
}

#[test]
fn on_the_catalogue_rigs_every_move_settles_and_passes_its_target_by_less_than_the_seal_lets_it_slip() {
    for name in RIGS {
        let file = rig(name);
        let (stroke, slip) = (file.rig.cylinder.stroke_m, slip_m(&file));
        let mut mean = 0.0;
        for target in [0.001, -0.001, 0.1 * stroke, -0.1 * stroke, 0.4 * stroke, -0.4 * stroke] {
            let run = |seed| step(&mut bench(&file, Driver::Tick, seed), target, 2500);
            let seen: Vec<Move> = (0..8_u64).into_par_iter().map(run).collect();
            let worst = |of: &dyn Fn(&Move) -> f64| seen.iter().map(of).fold(0.0, f64::max);
            let average = seen.iter().map(|seen| seen.settled_s).sum::<f64>() / seen.len() as f64;
            println!(
                "{name} {:6.1} mm: settled to 0.1 mm in {average:.3} s, worst {:.3} s, overshoot {:.2} mm of {:.2}",
                target * 1e3,
                worst(&|seen| seen.settled_s),
                worst(&|seen| seen.overshoot_m * 1e3),
                slip * 1e3,
            );
            assert!(worst(&|seen| seen.settled_s) < 2.5, "{name}, {target} m: {seen:?}");
            // A law that did nothing about it would pass by that much from just short of the target.
            assert!(worst(&|seen| seen.overshoot_m) < slip, "{name}, {target} m: {seen:?}");
            mean += average / 6.0;
        }
        // The fastest move there is takes a tenth of a second; the rest are slips until one ends on the target.
        assert!(mean < 1.2, "{name}: {mean} s");
    }
}

#[test]
fn the_law_knows_weight_and_atmosphere_on_the_rod_by_its_pressures_at_rest() {
    // At the same pressures the rod's side pushes less: what the law knows of the load at rest is that difference.
    let file = rig("smc-cp96-50-300-lifting");
    let parameters = rig_files::controller::parameters(&file);
    let b = |value: Option<f32>| f64::from(value.expect("unequal sides"));
    let force = f64::from(parameters.servo_area_m2_per_kg) * f64::from(parameters.servo_rest_pa)
        - b(parameters.servo_area_b_m2_per_kg) * b(parameters.servo_rest_b_pa);
    let cylinder = &file.rig.cylinder;
    let rod = (cylinder.area_a_m2 - cylinder.area_b_m2) * file.rig.supply.atmosphere_pa / file.rig.load.mass_kg;
    assert!((force - (9.80665 + rod)).abs() < 1e-3, "{force} m/s2 against weight and atmosphere on the rod, {rod}");
}

#[test]
fn on_the_catalogue_rigs_the_boards_monitor_watches_ten_moves_and_trips_on_none() {
    // Spools of first order, and of second with a damping ratio of 0.79 and 0.71: the monitor follows one of first.
    for (name, inertia) in RIGS.into_iter().flat_map(|name| [0.0, 0.4, 0.5].map(|inertia| (name, inertia))) {
        let mut file = rig(name);
        file.rig.valve.spool_inertia = inertia;
        let parameters = rig_files::controller::parameters(&file);
        for seed in 1..4 {
            let settings = LoopSettings { seed, ..LoopSettings::default() };
            let mut closed = ClosedLoop::new(&file, &parameters, &settings).expect("a physical model");
            for part in [0.1, -0.1, 0.4, -0.4, 0.0, 0.3, 0.2, -0.3, 0.005, 0.0] {
                let target = part * file.rig.cylinder.stroke_m;
                for _ in 0..1000 {
                    let tick = closed.tick(target);
                    assert!(
                        !tick.disagreement,
                        "{name}, inertia {inertia}, seed {seed}, at {} s towards {target} m",
                        tick.t_s
                    );
                }
            }
        }
    }
}
