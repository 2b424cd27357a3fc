//! A case: a rig with hidden causes, nominal values that may be wrong, an experiment, and the log it gives.

use crate::cause::Cause;
use crate::chain::Chain;
use crate::experiment::Experiment;
use crate::law::Law;
use crate::physics::Physics;
use crate::reading::Reading;
use crate::recording::record;
use plant_model::{OpeningTable, Rig};
use rand::RngExt;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rig_files::{Log, RigFile, RigKey, Tolerance, rig_key};

/// The keys whose nominal values are wrong on a rig with nominal errors.
pub const UNCERTAIN_KEYS: [&str; 10] = [
    "valve.fill_coefficient_kg_per_s_pa",
    "valve.exhaust_coefficient_kg_per_s_pa",
    "cylinder.volume_a0_m3",
    "cylinder.volume_b0_m3",
    "load.mass_kg",
    "friction.viscous_n_s_per_m",
    "friction.coulomb_n",
    "friction.static_n",
    "valve.dead_zone_right_v",
    "valve.dead_zone_left_v",
];

/// Errors are redrawn beyond this many standard deviations: the rig file states its tolerance honestly.
const CUT: f64 = 2.5;

/// An uncertain key of what the rig has; on a valve of ISO 6358, the conductance instead of the coefficient.
fn key_of(rig: &Rig<f64>, path: &str) -> Option<&'static RigKey> {
    match path {
        "valve.fill_coefficient_kg_per_s_pa" if rig.follows_iso6358() => rig_key("valve.fill_conductance_m3_per_s_pa"),
        "valve.exhaust_coefficient_kg_per_s_pa" if rig.follows_iso6358() => {
            rig_key("valve.exhaust_conductance_m3_per_s_pa")
        }
        _ => rig_key(path).filter(|key| key.get(rig) != 0.0),
    }
}

/// Draws the true rig from a nominal one whose uncertain values have the relative standard error `relative`. The two
/// friction forces err together, so that the static one never falls below the other. No chamber is smaller than what the piston
/// sweeps of it: at the end of the stroke less than nothing would be left.
#[must_use]
pub fn true_rig(nominal: &Rig<f64>, relative: f64, rng: &mut Xoshiro256PlusPlus) -> Rig<f64> {
    let mut rig = *nominal;
    let mut error = || -> f64 {
        loop {
            let normal: f64 = StandardNormal.sample(rng);
            if normal.abs() <= CUT {
                return 1.0 + relative * normal;
            }
        }
    };
    let mut coulomb = 1.0;
    for path in UNCERTAIN_KEYS {
        let Some(key) = key_of(nominal, path) else { continue };
        let factor = if path == "friction.static_n" { coulomb } else { error() };
        if path == "friction.coulomb_n" {
            coulomb = factor;
        }
        let value = key.get(&rig) * factor;
        key.set(&mut rig, value);
    }
    let c = &mut rig.cylinder;
    c.volume_a0_m3 = c.volume_a0_m3.max(0.5 * c.area_a_m2 * c.stroke_m);
    c.volume_b0_m3 = c.volume_b0_m3.max(0.5 * c.area_b_m2 * c.stroke_m);
    // Presliding must stay below sliding (3.13), whatever the friction forces came to.
    rig.friction.breakaway_m *= coulomb.min(1.0);
    rig
}

/// A table of the opening as its valve has it: the points between closed and full are each off by the relative standard error
/// `relative` from what was read off a drawing. The table as it was where that would not rise.
#[must_use]
pub fn true_opening(read: &OpeningTable<f64>, relative: f64, rng: &mut Xoshiro256PlusPlus) -> OpeningTable<f64> {
    let mut error = || -> f64 {
        let normal: f64 = StandardNormal.sample(rng);
        1.0 + relative * normal.clamp(-CUT, CUT)
    };
    let point = |[u, opening]: &[f64; 2]| {
        let between = *opening != 0.0 && opening.abs() < 1.0;
        [*u, if between { (opening * error()).clamp(-1.0, 1.0) } else { *opening }]
    };
    let points: Vec<[f64; 2]> = read.points().iter().map(point).collect();
    OpeningTable::new(&points).unwrap_or(*read)
}

/// What a table of the opening does not say of its valve: how it runs between the points, how round its corners are, and by how much its
/// edges to atmosphere open later or sooner. Nothing where there is no table.
pub(crate) fn draw_edges(rig: &mut Rig<f64>, rng: &mut Xoshiro256PlusPlus) {
    if rig.opening.is_empty() {
        return;
    }
    let valve = &mut rig.valve;
    let most_v = valve.max_voltage_v;
    valve.opening_smoothness = rng.random_range(0.0..1.0);
    valve.corner_rounding_v = most_v * rng.random_range(0.0..0.015);
    valve.exhaust_overlap_v = most_v * rng.random_range(-0.004..0.004);
}

/// How the rig file states the tolerance of its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stated {
    /// The same for every key.
    Everywhere(f64),
    /// For the uncertain keys alone; all others are exact.
    UncertainKeys(f64),
}

impl Stated {
    /// The tolerance table of a rig.
    #[must_use]
    pub fn tolerance(self, rig: &Rig<f64>) -> Tolerance {
        match self {
            Self::Everywhere(relative) => Tolerance::uniform(relative),
            Self::UncertainKeys(relative) => {
                let mut tolerance = Tolerance::uniform(0.0);
                for key in UNCERTAIN_KEYS.iter().filter_map(|path| key_of(rig, path)) {
                    tolerance.set(key.path, relative);
                }
                tolerance
            }
        }
    }
}

/// Everything that determines a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// What the diagnosis is told about the rig.
    pub rig_file: RigFile,
    /// What the rig really is, before effects.
    pub truth: Rig<f64>,
    /// What is hidden in it, beside the effects that the rig file states. A hidden effect replaces a stated one.
    pub causes: Vec<Cause>,
    /// What is done with it.
    pub experiment: Experiment,
    /// How its controller is set.
    pub law: Law,
    /// How it is recorded.
    pub chain: Chain,
    /// Seed of noise, timing and losses.
    pub seed: u64,
}

impl Case {
    /// All that is present: the effects that the rig file states, and what is hidden.
    #[must_use]
    pub fn present(&self) -> Vec<Cause> {
        let stated = self.rig_file.effects.iter().map(|(effect, values)| {
            let mut all = [0.0; 3];
            all[..values.len()].copy_from_slice(values);
            Cause::Catalogue(effect, all)
        });
        let hidden = |id: &str| self.causes.iter().any(|cause| cause.id() == id);
        stated.filter(|cause| !hidden(cause.id())).chain(self.causes.iter().cloned()).collect()
    }

    /// Records the log, and what ideal sensors would have shown.
    #[must_use]
    pub fn record(&self) -> (Log, Vec<Reading>) {
        record(&Physics::new(&self.truth, &self.present()), &self.experiment, &self.law, &self.chain, self.seed)
    }

    /// The truth as text, `key = value` lines that TOML reads.
    #[must_use]
    pub fn truth_toml(&self) -> String {
        use std::fmt::Write as _;
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "seed = {}\nexperiment = \"{}\"\n\n[rig_errors]", self.seed, self.experiment.name);
        for path in UNCERTAIN_KEYS {
            if let Some(key) = key_of(&self.truth, path) {
                let ratio = key.get(&self.truth) / key.get(&self.rig_file.rig);
                let _ = writeln!(text, "\"{}\" = {ratio:?}", key.path);
            }
        }
        for cause in self.present() {
            let _ = writeln!(text, "\n[effects.{}]", cause.id());
            for (name, value) in cause.parameters() {
                let _ = writeln!(text, "{name} = {value:?}");
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn no_chamber_is_smaller_than_what_the_piston_sweeps_of_it() {
        // Its chambers are stated without any dead volume.
        let nominal = RigFile::paper_b().rig;
        let swept_m3 = 0.5 * nominal.cylinder.area_a_m2 * nominal.cylinder.stroke_m;
        let mut larger = 0;
        for seed in 0..50 {
            let rig = true_rig(&nominal, 0.02, &mut Xoshiro256PlusPlus::seed_from_u64(seed));
            for volume_m3 in [rig.cylinder.volume_a0_m3, rig.cylinder.volume_b0_m3] {
                assert!(volume_m3 >= swept_m3, "{volume_m3}");
                larger += i32::from(volume_m3 > swept_m3);
            }
        }
        assert!((30..70).contains(&larger), "{larger}");
    }
}
