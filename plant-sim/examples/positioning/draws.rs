//! Rigs unlike their nominal values, and random moves on them.

use crate::trials::with_friction;
use plant_model::{Effect, Effects, Rig};
use plant_sim::servo::bench::{Bench, Lost, step};
use plant_sim::servo::{Servo, Tuning};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// A rig unlike its nominal values: mass ±30 %, friction ±50 %, dead zone ±20 % on either side, supply ±15 %, lag 0.5 to 5 ms,
/// hysteresis to 20 mV, ISO 6358 flow in half of them, leaks in half of them.
pub(crate) fn draw(nominal: &Rig<f64>, seed: u64) -> (Rig<f64>, Effects<f64>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0xD2A3);
    let mut within = |part: f64| 1.0 + part * (2.0 * rng.random::<f64>() - 1.0);
    let mut rig = *nominal;
    rig.load.mass_kg *= within(0.3);
    rig = with_friction(&rig, within(0.5));
    rig.valve.dead_zone_right_v *= within(0.2);
    rig.valve.dead_zone_left_v *= within(0.2);
    rig.supply.pressure_pa *= within(0.15);
    let mut effects = Effects::none()
        .with(Effect::ValveLag, &[0.5e-3 + 4.5e-3 * rng.random::<f64>()])
        .with(Effect::ValveHysteresis, &[20e-3 * rng.random::<f64>()]);
    if rng.random::<bool>() {
        effects.set(Effect::ChokedFlow, &[0.2 + 0.2 * rng.random::<f64>(), 0.3 + 0.4 * rng.random::<f64>()]);
    }
    if rng.random::<bool>() {
        for leak in [Effect::LeakChamberA, Effect::LeakChamberB, Effect::LeakCrossPiston] {
            effects.set(leak, &[2.0e-10 * rng.random::<f64>()]);
        }
    }
    (rig, effects)
}

/// A bench for a rig (`seed` of its noise) or for a draw of it, under a law that takes it for the nominal one.
pub(crate) fn bench(
    nominal: &Rig<f64>,
    actual: &Rig<f64>,
    tuning: Tuning,
    drawn: bool,
    noise: f64,
    seed: u64,
    lost: Lost,
) -> Bench {
    let study = Effects::none().with(Effect::ValveLag, &[tuning.valve_lag_s]);
    let (rig, effects) = if drawn { draw(actual, seed) } else { (*actual, study) };
    let mut bench = Bench::new(&rig, &effects, Servo::new(nominal, tuning), noise, seed).expect("a valid rig");
    bench.lost = lost;
    bench
}

/// What became of a sequence of moves.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sequence {
    /// Time of each move until it stays within 0.1 mm; infinite where it does not within the time it was given, s.
    pub(crate) settled_s: Vec<f64>,
    /// Changes of the code in the last second of each move.
    pub(crate) changes: Vec<u32>,
}

/// `count` random moves of two seconds each: every other one to anywhere within `most` m of the middle, the others
/// from 0.1 to 10 mm, evenly in the logarithm.
pub(crate) fn random_moves(bench: &mut Bench, count: u32, most: f64, seed: u64) -> Sequence {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x5E9);
    let ticks = (2.0 / bench.servo.tuning.tick_s) as u32;
    let mut target = 0.0_f64;
    let mut seen = Sequence::default();
    for n in 0..count {
        let part = 2.0 * rng.random::<f64>() - 1.0;
        target = if n % 2 == 0 {
            most * part
        } else {
            (target + part.signum() * 1e-4 * 100_f64.powf(part.abs())).clamp(-most, most)
        };
        let run = step(bench, target, ticks);
        seen.settled_s.push(run.settled_s);
        seen.changes.push(run.changes);
    }
    seen
}
