//! The positioning law of the firmware's tick against its f64 reference, on the same rig, in the set-up of the study.

use plant_model::{Effect, Effects, Rig};
use plant_sim::servo::bench::{Bench, Driver, sine, step};
use plant_sim::servo::{Servo, Tuning};

/// Cases, the time in which each must have settled after 45 mm, and the amplitude of its sine.
fn cases() -> [(&'static str, Rig<f64>, f64, f64); 3] {
    [("a", Rig::paper_a(), 0.28, 0.05), ("b", Rig::paper_b(), 0.33, 0.05), ("c", Rig::paper_c(), 0.26, 0.03)]
}

fn bench(mut rig: Rig<f64>, driver: Driver, seed: u64) -> Bench {
    (rig.valve.dead_zone_right_v, rig.valve.dead_zone_left_v) = (0.42, -0.42);
    let servo = Servo::new(&rig, Tuning::of(&rig, 1.7e-3, 1.0e-3));
    let effects = Effects::none().with(Effect::ValveLag, &[1.7e-3]);
    Bench::new(&rig, &effects, servo, 1.0, seed).expect("a valid rig").with_tick(driver)
}

#[test]
fn the_tick_answers_the_same_codes_with_the_reference_laws_command_within_a_few_codes_whoever_drives() {
    for driver in [Driver::Reference, Driver::Tick] {
        for (name, rig, settled_s, _) in cases() {
            let mut bench = bench(rig, driver, 7);
            let mut far: Vec<u32> = Vec::new();
            // Until the move is over: from then on hold and stick decide by thresholds, which a last bit can turn.
            for _ in 0..(settled_s * 700.0) as u32 {
                bench.tick(0.045);
                // While the valve crosses its dead zone, a last bit of the angle is some codes in which no air flows.
                let open = bench.codes.iter().all(|code| code.abs_diff(2047) > 180);
                far.extend(open.then(|| bench.codes[0].abs_diff(bench.codes[1])));
            }
            far.sort_unstable();
            let [median, most_of_them, most] = [far.len() / 2, far.len() * 9 / 10, far.len() - 1].map(|at| far[at]);
            println!("{name} {driver:?}: {} ticks, median {median}, 90 % {most_of_them}, most {most}", far.len());
            assert!(far.len() > 60, "the valve was hardly open: {}", far.len());
            // Near the valve's end a code is 0.06 mrad of the angle, and a micrometre a second of the reference some codes.
            assert!(median <= 1 && most_of_them <= 4 && most <= 150, "{name} {driver:?}: {far:?}");
        }
    }
}

#[test]
fn in_the_tick_a_move_of_45_mm_arrives_hardly_passes_its_target_and_then_rests_on_a_silent_valve() {
    for (name, rig, settled_s, _) in cases() {
        for seed in 0..5 {
            let seen = step(&mut bench(rig, Driver::Tick, seed), 0.045, 2500);
            assert!(seen.settled_s < settled_s, "{name}, seed {seed}: {seen:?}");
            assert!(seen.overshoot_m < 1.5e-4, "{name}, seed {seed}: {seen:?}");
            assert!(seen.rest_error_m < 4.5e-5, "{name}, seed {seed}: {seen:?}");
            assert!(seen.changes <= 2, "{name}, seed {seed}: {seen:?}");
        }
    }
}

#[test]
fn in_the_tick_a_streamed_sine_is_followed_within_1_2_percent_of_its_amplitude() {
    for (name, rig, _, amplitude) in cases() {
        let (peak, rms) = sine(&mut bench(rig, Driver::Tick, 1), amplitude, 0.5);
        assert!(peak < 0.012 * amplitude && rms < 0.002 * amplitude, "{name}: peak {peak} m, rms {rms} m");
    }
}
