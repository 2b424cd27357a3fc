//! Trials beyond a single move, for the tables and for `tests/positioning.rs`: other friction, loads, obstacles, streamed targets.

use plant_model::Rig;
use plant_sim::servo::bench::{Bench, Move, step};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use std::f64::consts::TAU;

/// The rig with so many times its friction.
pub(crate) fn with_friction(rig: &Rig<f64>, factor: f64) -> Rig<f64> {
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

/// Moves under a constant load that the law does not know and the pressures balance at first, two seconds each.
pub(crate) fn loaded_moves(bench: &mut Bench, targets_m: &[f64]) -> Vec<Move> {
    let ticks = (2.0 / bench.servo.tuning.tick_s) as u32;
    targets_m.iter().map(|target| step(bench, *target, ticks)).collect()
}

/// A load that is put on the resting piston and taken off again four seconds later: what becomes of the piston, from each change on.
pub(crate) fn pushed(bench: &mut Bench, load_n: f64) -> [Move; 2] {
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
pub(crate) struct Obstructed {
    /// Force of the chambers when it is taken away, over what the supply gives.
    pub(crate) force: f64,
    /// What follows.
    pub(crate) after: Move,
}

/// A move to `target` in m, with an obstacle half-way for `blocked_s` from when the piston meets it.
pub(crate) fn obstructed(bench: &mut Bench, target: f64, blocked_s: f64) -> Obstructed {
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
pub(crate) enum Wave {
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
    pub(crate) fn all(stroke: f64) -> Vec<Self> {
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
    pub(crate) fn amplitude(self) -> f64 {
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
pub(crate) fn stream(bench: &mut Bench, wave: Wave, seed: u64) -> (f64, f64) {
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
