//! Trials beyond a single move: rigs unlike their nominal values, sequences of random moves, streamed targets, a lost sensor.

use super::bench::{Bench, Lost, Move, step};
use super::{Servo, Tuning};
use plant_model::{Effect, Effects, Rig};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use std::f64::consts::TAU;

/// A rig unlike its nominal values: mass ±30 %, friction ±50 %, dead zone ±20 % on either side, supply ±15 %, lag 0.5 to 5 ms,
/// hysteresis to 20 mV, ISO 6358 flow in half of them, leaks in half of them.
#[must_use]
pub fn draw(nominal: &Rig<f64>, seed: u64) -> (Rig<f64>, Effects<f64>) {
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

/// The rig with so many times its friction.
#[must_use]
pub fn with_friction(rig: &Rig<f64>, factor: f64) -> Rig<f64> {
    let mut other = *rig;
    for value in [
        &mut other.friction.coulomb_n,
        &mut other.friction.static_n,
        &mut other.friction.viscous_n_s_per_m,
        &mut other.friction.breakaway_m,
    ] {
        *value *= factor;
    }
    other
}

/// What became of a sequence of moves.
#[derive(Clone, Debug, Default)]
pub struct Sequence {
    /// Time of each move until it stays within 0.1 mm; infinite where it does not within the time it was given, s.
    pub settled_s: Vec<f64>,
    /// Changes of the code in the last second of each move.
    pub changes: Vec<u32>,
}

/// `count` random moves of two seconds each: every other one to anywhere within `most` m of the middle, the others
/// from 0.1 to 10 mm, evenly in the logarithm.
#[must_use]
pub fn random_moves(bench: &mut Bench, count: u32, most: f64, seed: u64) -> Sequence {
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

/// Moves under a constant load that the law does not know and the pressures balance at first, two seconds each.
#[must_use]
pub fn loaded_moves(bench: &mut Bench, targets_m: &[f64]) -> Vec<Move> {
    let ticks = (2.0 / bench.servo.tuning.tick_s) as u32;
    targets_m.iter().map(|target| step(bench, *target, ticks)).collect()
}

/// A load that is put on the resting piston and taken off again four seconds later: what becomes of the piston, from each change on.
#[must_use]
pub fn pushed(bench: &mut Bench, load_n: f64) -> [Move; 2] {
    let ticks = |s: f64| (s / bench.servo.tuning.tick_s) as u32;
    let (settle, watch) = (ticks(1.0), ticks(4.0));
    step(bench, 0.0, settle);
    [load_n, 0.0].map(|load_n| {
        bench.load_n = load_n;
        step(bench, 0.0, watch)
    })
}

/// What became of a move into an obstacle half-way that is taken away later.
#[derive(Clone, Copy, Debug)]
pub struct Obstructed {
    /// Force of the chambers when it is taken away, over what the supply gives.
    pub force: f64,
    /// What follows.
    pub after: Move,
}

/// A move to `target` in m, with an obstacle half-way for `blocked_s` from when the piston meets it.
#[must_use]
pub fn obstructed(bench: &mut Bench, target: f64, blocked_s: f64) -> Obstructed {
    let ticks = |s: f64| (s / bench.servo.tuning.tick_s) as u32;
    let (blocked, watch) = (ticks(blocked_s), ticks(3.0));
    bench.obstacle(Some(target.abs() / 2.0));
    let mut met = 0;
    while met < blocked {
        let (y, _) = bench.tick(target);
        met += u32::from(met > 0 || y.abs() > 0.499 * target.abs());
    }
    let rig = &bench.servo.rig;
    let (state, most_pa) = (bench.state(), rig.supply.pressure_pa - rig.supply.atmosphere_pa);
    let force = target.signum() * (state.p_a_pa - state.p_b_pa) / most_pa;
    bench.obstacle(None);
    Obstructed { force, after: step(bench, target, watch) }
}

/// A streamed target.
#[derive(Clone, Copy, Debug)]
pub enum Wave {
    /// Amplitude in m and frequency in Hz.
    Sine(f64, f64),
    /// Amplitude in m; 0.1 to 20 Hz in 8 s, evenly in the logarithm.
    Chirp(f64),
    /// Amplitude in m and seconds between steps.
    Square(f64, f64),
    /// Amplitude in m; anywhere within it each tick.
    Noise(f64),
    /// Amplitude in m; either end, chosen anew each tick.
    Ends(f64),
}

impl Wave {
    /// The waves of the trial, as parts of the stroke.
    #[must_use]
    pub fn all(stroke: f64) -> Vec<Self> {
        let mut all = Vec::new();
        for part in [0.02, 0.1, 0.3] {
            let amplitude = part * stroke;
            all.extend([0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0].map(|hz| Self::Sine(amplitude, hz)));
            all.extend([0.02, 0.1, 0.3, 1.0].map(|s| Self::Square(amplitude, s)));
            all.extend([Self::Chirp(amplitude), Self::Noise(amplitude), Self::Ends(amplitude)]);
        }
        all
    }

    /// Its amplitude, m.
    #[must_use]
    pub fn amplitude(self) -> f64 {
        match self {
            Self::Sine(a, _) | Self::Chirp(a) | Self::Square(a, _) | Self::Noise(a) | Self::Ends(a) => a,
        }
    }

    fn at(self, t: f64, rng: &mut Xoshiro256PlusPlus) -> f64 {
        match self {
            Self::Sine(a, hz) => a * (TAU * hz * t).sin(),
            Self::Chirp(a) => {
                let rate = 200_f64.ln() / 8.0;
                a * (TAU * 0.1 * ((rate * t).exp() - 1.0) / rate).sin()
            }
            Self::Square(a, s) => {
                if ((t / s) as u64).is_multiple_of(2) {
                    a
                } else {
                    -a
                }
            }
            Self::Noise(a) => a * (2.0 * rng.random::<f64>() - 1.0),
            Self::Ends(a) => {
                if rng.random::<bool>() {
                    a
                } else {
                    -a
                }
            }
        }
    }
}

/// Streams a wave for eight seconds, then stands at zero for two. Returns the farthest position over the amplitude and the time
/// until the piston stands within 0.1 mm of zero.
#[must_use]
pub fn stream(bench: &mut Bench, wave: Wave, seed: u64) -> (f64, f64) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x57E);
    let tick_s = bench.servo.tuning.tick_s;
    let mut furthest = 0.0_f64;
    for tick in 0..(8.0 / tick_s) as u32 {
        let (y, _) = bench.tick(wave.at(f64::from(tick) * tick_s, &mut rng));
        furthest = furthest.max(y.abs());
    }
    let rest = step(bench, 0.0, (2.0 / tick_s) as u32);
    (furthest / wave.amplitude(), rest.settled_s)
}

/// A bench for a rig (`seed` of its noise) or for a draw of it, under a law that takes it for the nominal one.
///
/// # Panics
/// The rig is not valid.
#[must_use]
pub fn bench(
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
