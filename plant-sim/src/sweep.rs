//! Many positioning steps: parameter sweeps over a grid and Monte Carlo, reproducible from one seed on any number of threads.

use crate::closed_loop::{ClosedLoop, LoopError, LoopSettings};
use crate::metrics::{StepMetrics, StepObserver};
use control::{LawChoice, Parameters};
use plant_model::Effect;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use rig_files::{RigFile, RigKey, all_keys, closest, rig_key};
use std::sync::atomic::{AtomicBool, Ordering};

/// Something a sweep can vary.
#[derive(Clone, Copy, Debug)]
pub enum Key {
    /// A nominal value of the plant.
    Rig(&'static RigKey),
    /// A parameter of an effect, by its place.
    Effect(Effect, usize),
    /// The controller's proportional gain, V/m.
    Gain,
    /// The target position, m.
    Target,
}

impl Key {
    /// The key of a name: a key of the rig file (`load.mass_kg` or `mass_kg`), `effects.ID.PARAMETER`, `gain_v_per_m` or
    /// `target_m`.
    ///
    /// # Errors
    /// What is wrong with the name, and what was probably meant.
    pub fn parse(name: &str) -> Result<Self, String> {
        match name {
            "gain_v_per_m" => return Ok(Self::Gain),
            "target_m" => return Ok(Self::Target),
            _ => {}
        }
        if let Some(key) = rig_key(name) {
            return Ok(Self::Rig(key));
        }
        let keys =
            || Effect::ALL.into_iter().flat_map(|effect| effect.info().parameters.iter().map(move |p| (effect, p)));
        if let Some((effect, parameter)) = keys().find(|(_, parameter)| parameter.key == name) {
            let place = effect.info().parameters.iter().position(|other| other.name == parameter.name);
            return Ok(Self::Effect(effect, place.unwrap_or(0)));
        }
        let known = all_keys().flat_map(|key| [key.path, key.name]).chain(keys().map(|(_, p)| p.key));
        let near = closest(name, known.chain(["gain_v_per_m", "target_m"]));
        Err(match near {
            Some(near) => format!("`{name}` cannot be varied; did you mean `{near}`?"),
            None => format!(
                "`{name}` cannot be varied; use a key of the rig file, effects.ID.PARAMETER, gain_v_per_m or target_m"
            ),
        })
    }

    /// The full name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Rig(key) => key.path,
            Self::Effect(effect, place) => effect.info().parameters[*place].key,
            Self::Gain => "gain_v_per_m",
            Self::Target => "target_m",
        }
    }
}

/// One key over a range.
#[derive(Clone, Copy, Debug)]
pub struct Variation {
    /// What varies.
    pub key: Key,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// Grid points, ends included; ignored by Monte Carlo.
    pub count: usize,
}

/// What all runs have in common.
#[derive(Clone, Debug)]
pub struct Base {
    /// The nominal rig. The controller's model monitor knows its values when the plant varies.
    pub rig: RigFile,
    /// The controller's parameters; they stay nominal when the plant varies.
    pub parameters: Parameters,
    /// Noise, oversampling, delay; its seed is the sweep's.
    pub settings: LoopSettings,
    /// Target position, m.
    pub target_m: f64,
    /// Length of a run, s.
    pub duration_s: f64,
}

/// One run to be made.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Seed of its noise.
    pub seed: u64,
    /// The values of the varied keys, in their order.
    pub values: Vec<f64>,
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The step's figures.
    pub metrics: StepMetrics,
    /// The controller's state at the end, `run` or `safe:REASON`.
    pub state: String,
}

/// The seed of run `index` in a sweep seeded with `seed` (SplitMix64), whatever thread makes it.
#[must_use]
pub fn run_seed(seed: u64, index: usize) -> u64 {
    let mut z = seed.wrapping_add((index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Every combination of the variations' grid points.
#[must_use]
pub fn grid(variations: &[Variation], seed: u64) -> Vec<Job> {
    let total: usize = variations.iter().map(|variation| variation.count.max(1)).product();
    (0..total)
        .map(|index| {
            let mut rest = index;
            let mut values = vec![0.0; variations.len()];
            // The last variation runs fastest, as in nested loops.
            for (value, variation) in values.iter_mut().zip(variations).rev() {
                let count = variation.count.max(1);
                let part = if count > 1 { (rest % count) as f64 / (count - 1) as f64 } else { 0.0 };
                *value = variation.low + part * (variation.high - variation.low);
                rest /= count;
            }
            Job { seed: run_seed(seed, index), values }
        })
        .collect()
}

/// Random combinations: each variation uniform over its range.
#[must_use]
pub fn random(variations: &[Variation], samples: usize, seed: u64) -> Vec<Job> {
    (0..samples)
        .map(|index| {
            let run = run_seed(seed, index);
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(run ^ 0x5EED);
            let values = variations.iter().map(|v| v.low + rng.random::<f64>() * (v.high - v.low)).collect();
            Job { seed: run, values }
        })
        .collect()
}

/// Random rigs as uncertain as the rig file says: each key normal with its relative tolerance, cut at three deviations, on
/// top of the variations. Returns the keys in their order with the jobs; combinations that plant or controller refuse are drawn
/// anew, a hundred times at most.
#[must_use]
pub fn within_tolerance(base: &Base, variations: &[Variation], samples: usize, seed: u64) -> (Vec<Key>, Vec<Job>) {
    let uncertain: Vec<&'static RigKey> = base
        .rig
        .rig
        .stated_keys()
        .filter(|key| base.rig.tolerance.of(key.path) > 0.0 && key.get(&base.rig.rig) != 0.0)
        .filter(|key| !variations.iter().any(|v| v.key.name() == key.path))
        .collect();
    let keys: Vec<Key> = variations.iter().map(|v| v.key).chain(uncertain.iter().map(|key| Key::Rig(key))).collect();
    let mut jobs = random(variations, samples, seed);
    for job in &mut jobs {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(job.seed ^ 0x701E);
        for _ in 0..100 {
            job.values.truncate(variations.len());
            job.values.extend(uncertain.iter().map(|key| {
                let normal: f64 = StandardNormal.sample(&mut rng);
                key.get(&base.rig.rig) * (1.0 + base.rig.tolerance.of(key.path) * normal.clamp(-3.0, 3.0))
            }));
            if check(base, &keys, job).is_ok() {
                break;
            }
        }
    }
    (keys, jobs)
}

/// Whether a run can be made.
///
/// # Errors
/// Plant or controller refuse the combination.
pub fn check(base: &Base, keys: &[Key], job: &Job) -> Result<(), LoopError> {
    set_up(base, keys, job).map(|_| ())
}

/// The plant of a run, its controller and its target.
fn set_up(base: &Base, keys: &[Key], job: &Job) -> Result<(ClosedLoop, f64), LoopError> {
    let mut rig = base.rig.clone();
    let mut parameters = base.parameters.clone();
    let mut target_m = base.target_m;
    for (key, &value) in keys.iter().zip(&job.values) {
        match key {
            Key::Rig(key) => key.set(&mut rig.rig, value),
            Key::Effect(effect, place) => {
                let mut values = effect.neutral(&rig.rig);
                if let Some(given) = rig.effects.get(*effect) {
                    values[..given.len()].copy_from_slice(given);
                }
                values[*place] = value;
                rig.effects.set(*effect, &values);
            }
            Key::Gain => (parameters.law, parameters.gain_v_per_m) = (LawChoice::Paper, value as f32),
            Key::Target => target_m = value,
        }
    }
    let settings = LoopSettings { seed: job.seed, ..base.settings };
    Ok((ClosedLoop::with_model(&rig, &base.rig.rig, &parameters, &settings)?, target_m))
}

/// Makes one run.
///
/// # Errors
/// Plant or controller refuse the combination.
pub fn run(base: &Base, keys: &[Key], job: &Job) -> Result<Outcome, LoopError> {
    let (mut positioner, target_m) = set_up(base, keys, job)?;
    let mut observer = StepObserver::new(positioner.position_m(), target_m, base.duration_s);
    let ticks = (base.duration_s / positioner.tick_s()).round() as u64;
    let mut mode = control::Mode::Run;
    for _ in 0..=ticks {
        let tick = positioner.tick(target_m);
        observer.see(tick.t_s, tick.plant.y_m);
        mode = tick.mode;
    }
    Ok(Outcome { metrics: observer.metrics(), state: mode.to_string() })
}

/// The position over time in one run, s and m.
///
/// # Errors
/// Plant or controller refuse the combination.
pub fn response(base: &Base, keys: &[Key], job: &Job) -> Result<(Vec<f64>, Vec<f64>), LoopError> {
    let (mut positioner, target_m) = set_up(base, keys, job)?;
    let ticks = (base.duration_s / positioner.tick_s()).round() as u64;
    Ok((0..=ticks).map(|_| positioner.tick(target_m)).map(|tick| (tick.t_s, tick.plant.y_m)).unzip())
}

/// Makes all runs in parallel. `done` is called after each; once `stop` is set, runs not yet begun are left out (`None`).
pub fn run_all(
    base: &Base,
    keys: &[Key],
    jobs: &[Job],
    stop: &AtomicBool,
    done: impl Fn() + Sync,
) -> Vec<Option<Result<Outcome, LoopError>>> {
    jobs.par_iter()
        .map(|job| {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let outcome = run(base, keys, job);
            done();
            Some(outcome)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::parameters;

    fn base() -> Base {
        let rig = RigFile::paper_b();
        let parameters = parameters(&rig);
        Base { rig, parameters, settings: LoopSettings::default(), target_m: 0.045, duration_s: 0.5 }
    }

    fn outcomes(threads: usize) -> Vec<Option<Result<Outcome, LoopError>>> {
        let base = base();
        let (keys, jobs) = within_tolerance(&base, &[], 24, 7);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| run_all(&base, &keys, &jobs, &AtomicBool::new(false), || ()))
    }

    #[test]
    fn a_sweep_gives_the_same_numbers_on_one_thread_and_on_several() {
        let one = outcomes(1);
        assert_eq!(one, outcomes(4));
        let distinct = |a: &Option<Result<Outcome, LoopError>>| format!("{a:?}");
        assert_ne!(distinct(&one[0]), distinct(&one[1]), "the draws differ");
    }

    #[test]
    fn a_grid_has_every_combination_with_both_ends_and_the_last_key_fastest() {
        let key = |name: &str| Key::parse(name).expect(name);
        let mass = Variation { key: key("mass_kg"), low: 1.0, high: 3.0, count: 3 };
        let leak =
            Variation { key: key("effects.leak-cross-piston.conductance_kg_per_s_pa"), low: 0.0, high: 1.0, count: 2 };
        let values: Vec<_> = grid(&[mass, leak], 1).into_iter().map(|job| job.values).collect();
        assert_eq!(values, [[1.0, 0.0], [1.0, 1.0], [2.0, 0.0], [2.0, 1.0], [3.0, 0.0], [3.0, 1.0]]);
    }

    #[test]
    fn a_stopped_sweep_leaves_out_what_it_had_not_begun() {
        let base = base();
        let jobs = grid(&[], 1);
        let stopped = AtomicBool::new(true);
        assert_eq!(run_all(&base, &[], &jobs, &stopped, || ()), [None]);
    }

    #[test]
    fn a_misspelt_key_is_refused_with_what_was_meant() {
        let refused = Key::parse("load.mas_kg").expect_err("misspelt");
        assert!(refused.contains("did you mean `load.mass_kg`"), "{refused}");
        assert_eq!(Key::parse("gain_v_per_m").expect("known").name(), "gain_v_per_m");
    }

    #[test]
    fn drawn_rigs_stay_within_three_tolerances_and_are_all_valid() {
        let base = base();
        let (keys, jobs) = within_tolerance(&base, &[], 200, 3);
        for job in &jobs {
            for (key, value) in keys.iter().zip(&job.values) {
                let Key::Rig(key) = key else { panic!("only rig keys are uncertain") };
                let nominal = key.get(&base.rig.rig);
                assert!((value / nominal - 1.0).abs() <= 0.0600001, "{}", key.path);
            }
        }
    }
}
