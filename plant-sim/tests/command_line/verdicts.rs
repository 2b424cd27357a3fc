//! What `tune` says of a rig, against its simulated closed loop: where it says that the rig cannot, it misses; with the number that
//! it names, it does.

use plant_model::{Effect, Effects, Rig};
use plant_sim::servo::bench::{Bench, Move, step};
use plant_sim::servo::margins::{Demand, shortfalls, with_flow};
use plant_sim::servo::{Servo, Tuning};

const SEEDS: u64 = 40;

fn moves(rig: &Rig<f64>, lag_s: f64, noise_m: f64, target: f64) -> Vec<Move> {
    let effects = Effects::none().with(Effect::ValveLag, &[lag_s]);
    let run = |seed| {
        let servo = Servo::new(rig, Tuning::of(rig, lag_s, 1e-3));
        let mut bench = Bench::new(rig, &effects, servo, noise_m / 20e-6, seed).expect("a valid rig");
        step(&mut bench, target, 3000)
    };
    (0..SEEDS).map(run).collect()
}

/// Mean time of a move until it stays within 0.1 mm, s.
fn settled_s(rig: &Rig<f64>, lag_s: f64, target: f64) -> f64 {
    moves(rig, lag_s, 20e-6, target).iter().map(|seen| seen.settled_s).sum::<f64>() / SEEDS as f64
}

/// The one verdict, which begins with these words, and the number after these.
fn verdict(rig: &Rig<f64>, lag_s: f64, demand: &Demand, begin: &str, before: &str) -> f64 {
    let said = shortfalls(rig, &Tuning::of(rig, lag_s, 1e-3), demand);
    assert!(said.len() == 1 && said[0].starts_with(begin), "{said:?}");
    let (_, rest) = said[0].rsplit_once(before).expect("the number that would do");
    rest.split(' ').next().expect("a word").parse().expect("a number")
}

fn demand(move_m: f64, within_s: f64) -> Demand {
    Demand { move_m, within_s, noise_m: 20e-6, rest_m: 45e-6 }
}

#[test]
fn a_valve_that_is_said_to_be_too_slow_misses_and_with_the_lag_that_is_named_it_does_it() {
    for (name, rig, lag_s, move_m, within_s) in [
        ("b", Rig::paper_b(), 8e-3, 0.045, 0.45),
        ("b", Rig::paper_b(), 30e-3, 0.01, 0.50),
        ("c", Rig::paper_c(), 4e-3, 0.045, 0.35),
        ("c", Rig::paper_c(), 8e-3, 0.01, 0.25),
        ("a", Rig::paper_a(), 30e-3, 0.045, 0.60),
    ] {
        let does_ms = verdict(&rig, lag_s, &demand(move_m, within_s), "valve too slow", "; a lag of ");
        let (misses, does) = (settled_s(&rig, lag_s, move_m), settled_s(&rig, does_ms * 1e-3, move_m));
        println!("{name}: {lag_s} s takes {misses:.3} s, {does_ms} ms {does:.3} s of {within_s} s");
        assert!(misses > within_s, "{name}: {misses} s");
        assert!(does <= within_s, "{name}: with {does_ms} ms {does} s");
    }
}

#[test]
fn a_valve_that_is_said_to_be_too_small_misses_and_with_the_flow_that_is_named_it_does_it() {
    for (name, rig, move_m, within_s) in
        [("a", Rig::paper_a(), 0.045, 0.22), ("b", Rig::paper_b(), 0.2, 0.7), ("a", Rig::paper_a(), 0.3, 0.45)]
    {
        let factor = verdict(&rig, 1.7e-3, &demand(move_m, within_s), "valve too small", "; ");
        let misses = settled_s(&rig, 1.7e-3, move_m);
        let does = settled_s(&with_flow(&rig, factor), 1.7e-3, move_m);
        println!("{name}: takes {misses:.3} s, with {factor} times the flow {does:.3} s of {within_s} s");
        // The time is right within a tenth.
        assert!(misses > within_s, "{name}: {misses} s");
        assert!(does <= 1.1 * within_s, "{name}: with {factor} times the flow {does} s");
    }
}

#[test]
fn a_sensor_that_is_said_to_be_too_noisy_lets_the_piston_rest_further_off_and_the_one_that_is_named_does_not() {
    for (name, rig) in [("a", Rig::paper_a()), ("b", Rig::paper_b()), ("c", Rig::paper_c())] {
        let noisy = Demand { noise_m: 100e-6, ..demand(0.045, 1.0) };
        let does_um = verdict(&rig, 1.7e-3, &noisy, "sensor too noisy", "; ");
        let rest =
            |noise_m: f64| moves(&rig, 1.7e-3, noise_m, 0.045).iter().map(|seen| seen.rest_error_m).fold(0.0, f64::max);
        let (misses, does) = (rest(noisy.noise_m), rest(does_um * 1e-6));
        println!("{name}: rests within {:.0} um, with {does_um} um of noise within {:.0} um", misses * 1e6, does * 1e6);
        assert!(misses > noisy.rest_m, "{name}: {misses} m");
        // The number is right within a tenth.
        assert!(does <= 1.1 * noisy.rest_m, "{name}: {does} m");
    }
}
