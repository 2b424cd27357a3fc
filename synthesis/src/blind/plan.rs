//! Which cases a suite contains, and how one is drawn from its seed.

use crate::case::{Case, Stated, draw_edges, true_opening, true_rig};
use crate::cause::{Cause, Which};
use crate::chain::Chain;
use crate::foreign::Foreign;
use crate::law::Law;
use crate::sequences::Family;
use crate::strength;
use crate::varied::varied_rig;
use plant_model::{Effect, Rig};
use rand::rngs::Xoshiro256PlusPlus;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rig_files::{Column, RigFile};
use std::fmt;
use std::str::FromStr;

/// Kinds of cases.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Class {
    /// One effect of everyday strength.
    Single,
    /// One effect of a quarter of everyday strength.
    Weak,
    /// Two effects.
    Pairs,
    /// Three effects.
    Triples,
    /// No effect.
    Null,
    /// One effect from outside the catalogue.
    Unknown,
    /// One effect, and columns missing.
    Partial,
    /// An experiment that shows little, with one effect or none.
    Poor,
    /// A logger that keeps every second, fifth or tenth row of a controller at 1 kHz; one effect or none.
    Decimated,
    /// A controller, and its log, at 200, 100 or 50 Hz; one effect or none.
    Slow,
    /// Supply, temperature and atmosphere off by what gauges and weather allow, the supply measured; one effect or none.
    Weather,
    /// A position sensor that reads no farther than a part of the way; one effect or none.
    Clipped,
    /// One effect far below everyday strength that is still plain in the log.
    Slight,
    /// A valve with a dead zone, which the file states, and slopes; each is off within its tolerance. One effect or none.
    Valve,
    /// Sensors from far better to far worse than the usual ones, quiet ones beside noisy ones, with coarse and fine converters;
    /// one effect or none.
    Sensors,
}

impl Class {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 15] = [
        Self::Single,
        Self::Weak,
        Self::Pairs,
        Self::Triples,
        Self::Null,
        Self::Unknown,
        Self::Partial,
        Self::Poor,
        Self::Decimated,
        Self::Slow,
        Self::Weather,
        Self::Clipped,
        Self::Slight,
        Self::Valve,
        Self::Sensors,
    ];

    /// Word on the command line and in tables.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Weak => "weak",
            Self::Pairs => "pairs",
            Self::Triples => "triples",
            Self::Null => "null",
            Self::Unknown => "unknown",
            Self::Partial => "partial",
            Self::Poor => "poor",
            Self::Decimated => "decimated",
            Self::Slow => "slow",
            Self::Weather => "weather",
            Self::Clipped => "clipped",
            Self::Slight => "slight",
            Self::Valve => "valve",
            Self::Sensors => "sensors",
        }
    }
}

/// How good the rig file's nominal values are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Nominal {
    /// Exact, and the rig file says so.
    Exact,
    /// 2 % standard error in flow coefficients, volumes, mass and friction, and the rig file says so.
    TwoPercent,
}

impl Nominal {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Exact, Self::TwoPercent];

    /// Word on the command line and in tables.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::TwoPercent => "2%",
        }
    }

    const fn relative(self) -> f64 {
        match self {
            Self::Exact => 0.0,
            Self::TwoPercent => 0.02,
        }
    }
}

/// One case of a suite; written and read as `class/nominal/seed`, with `@effects` behind it where the catalogue was shorter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Plan {
    /// Kind.
    pub class: Class,
    /// Nominal values.
    pub nominal: Nominal,
    /// Everything else follows from this.
    pub seed: u64,
    /// Of how many effects of the catalogue, the first ones, the case draws: all there were when it was named. New ones are appended.
    pub effects: usize,
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/{:016x}", self.class.word(), self.nominal.word(), self.seed)?;
        if self.effects == Effect::ALL.len() { Ok(()) } else { write!(f, "@{}", self.effects) }
    }
}

/// A case that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no case: write class/nominal/seed as in the table, e.g. single/exact/00000000000000ff, and behind `@` of how many \
     effects it draws, 1 to {all}, if not of all",
    all = Effect::ALL.len()
)]
pub struct PlanError(String);

impl FromStr for Plan {
    type Err = PlanError;

    fn from_str(text: &str) -> Result<Self, PlanError> {
        let mut parts = text.split('/');
        let mut read = || {
            let (class, nominal, last) = (parts.next()?, parts.next()?, parts.next()?);
            let (seed, effects) = match last.split_once('@') {
                Some((seed, effects)) => (seed, effects.parse().ok()?),
                None => (last, Effect::ALL.len()),
            };
            Some(Self {
                class: Class::ALL.into_iter().find(|known| known.word() == class)?,
                nominal: Nominal::ALL.into_iter().find(|known| known.word() == nominal)?,
                seed: u64::from_str_radix(seed, 16).ok()?,
                effects: (1..=Effect::ALL.len()).contains(&effects).then_some(effects)?,
            })
        };
        let plan = read();
        plan.filter(|_| parts.next().is_none()).ok_or_else(|| PlanError(text.to_string()))
    }
}

/// `count` plans of a class. Single effects are stratified: every block of as many plans as there are effects holds each
/// effect once, in random order; the seeds are searched so that a seed alone still determines its case.
#[must_use]
pub fn plans(class: Class, nominal: Nominal, count: usize, suite_seed: u64) -> Vec<Plan> {
    let mut rng = suite_rng(class, nominal, suite_seed);
    let mut wanted: Vec<Vec<&'static str>> = Vec::new();
    (0..count)
        .map(|_| {
            loop {
                let plan = Plan { class, nominal, seed: rng.random(), effects: Effect::ALL.len() };
                let ids: Vec<&str> = plan.which(&mut plan.rng()).iter().map(|which| which.id()).collect();
                if ids.len() != 1 {
                    break plan;
                }
                if wanted.is_empty() {
                    wanted = plan.singles().iter().map(|which| vec![which.id()]).collect();
                }
                if let Some(at) = wanted.iter().position(|id| *id == ids) {
                    wanted.swap_remove(at);
                    break plan;
                }
            }
        })
        .collect()
}

/// `count` plans of a class that hide an effect, alone or with others; empty for a class that never hides it.
#[must_use]
pub fn plans_hiding(id: &str, class: Class, nominal: Nominal, count: usize, suite_seed: u64) -> Vec<Plan> {
    let plan = |seed| Plan { class, nominal, seed, effects: Effect::ALL.len() };
    if class == Class::Null || !plan(0).singles().iter().any(|which| which.id() == id) {
        return Vec::new();
    }
    let mut rng = suite_rng(class, nominal, suite_seed);
    let drawn = std::iter::repeat_with(|| plan(rng.random()));
    drawn.filter(|plan| plan.which(&mut plan.rng()).iter().any(|which| which.id() == id)).take(count).collect()
}

fn suite_rng(class: Class, nominal: Nominal, suite_seed: u64) -> Xoshiro256PlusPlus {
    let mix = (class as u64) << 8 | nominal as u64;
    Xoshiro256PlusPlus::seed_from_u64(suite_seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ mix)
}

impl Plan {
    /// The effects of which a case of this kind holds one.
    fn singles(&self) -> Vec<Which> {
        let known = Effect::ALL.into_iter().take(self.effects);
        match self.class {
            Class::Unknown => Foreign::ALL.into_iter().map(Which::Foreign).collect(),
            Class::Weak => {
                let weak = known.filter(|effect| strength::scales_to_neutral(*effect));
                weak.map(Which::Catalogue).collect()
            }
            Class::Slight => [Effect::ValveDeadZone, Effect::ValveLag].map(Which::Catalogue).to_vec(),
            _ => known.map(Which::Catalogue).collect(),
        }
    }
}

/// An effect far below everyday strength: a null offset of 8 to 15 mV, or a lag of 0.6 to 1 ms.
fn slight(which: Which, rig: &Rig<f64>, rng: &mut Xoshiro256PlusPlus) -> Cause {
    let mut cause = which.neutral(rig);
    if let Cause::Catalogue(effect, values) = &mut cause {
        if *effect == Effect::ValveDeadZone {
            let shift = rng.random_range(0.008..0.015) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            values[..2].iter_mut().for_each(|edge| *edge += shift);
        } else {
            values[0] = rng.random_range(0.6e-3..1.0e-3);
        }
    }
    cause
}

impl Plan {
    fn rng(&self) -> Xoshiro256PlusPlus {
        Xoshiro256PlusPlus::seed_from_u64(self.seed)
    }

    /// The first thing drawn: which effects.
    fn which(&self, rng: &mut Xoshiro256PlusPlus) -> Vec<Which> {
        let count = match self.class {
            Class::Null => 0,
            Class::Pairs => 2,
            Class::Triples => 3,
            Class::Poor
            | Class::Decimated
            | Class::Slow
            | Class::Weather
            | Class::Clipped
            | Class::Valve
            | Class::Sensors
                if rng.random_bool(0.5) =>
            {
                0
            }
            _ => 1,
        };
        let pool = self.singles();
        loop {
            let set: Vec<Which> = pool.sample(rng, count).copied().collect();
            // Both of a structural tie at once have no right answer.
            let tied = |effect: Effect| effect.structural_ties().any(|other| set.contains(&Which::Catalogue(other)));
            let muddled = set.iter().any(|which| matches!(which, Which::Catalogue(effect) if tied(*effect)));
            if !muddled {
                return set;
            }
        }
    }

    /// Draws the case on one of the paper's three rigs.
    #[must_use]
    pub fn draw(&self) -> Case {
        self.draw_on(&[RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()])
    }

    /// Draws the case on one of the rigs given, or on a rig of its own ([`varied_rig`]) if there are none.
    #[must_use]
    pub fn draw_on(&self, rigs: &[RigFile]) -> Case {
        let mut rng = self.rng();
        let which = self.which(&mut rng);
        let mut rig_file = rigs.choose(&mut rng).cloned().unwrap_or_else(|| varied_rig(&mut rng));
        if self.class == Class::Valve {
            rig_file.rig.valve.dead_zone_right_v = rng.random_range(0.1..0.6);
            rig_file.rig.valve.dead_zone_left_v = -rng.random_range(0.1..0.6);
        }
        let relative = self.nominal.relative();
        let stated = if rng.random_bool(0.5) { Stated::Everywhere } else { Stated::UncertainKeys };
        rig_file.tolerance = stated(relative).tolerance(&rig_file.rig);
        for hidden in &which {
            if let Which::Catalogue(effect) = hidden {
                // Nothing is hidden that the file states.
                rig_file.effects.remove(*effect);
            }
        }
        let mut truth = true_rig(&rig_file.rig, relative, &mut rng);
        if self.class == Class::Valve {
            let off = rig_file.tolerance.default;
            truth.valve.slope_right *= 1.0 + rng.random_range(-2.0 * off..=2.0 * off);
            truth.valve.slope_left *= 1.0 + rng.random_range(-2.0 * off..=2.0 * off);
        }
        if rig_file.tolerance.default > 0.0 {
            truth.opening = true_opening(&truth.opening, rig_file.tolerance.default, &mut rng);
            draw_edges(&mut truth, &mut rng);
        }
        if self.class == Class::Weather {
            // A file that calls all values exact would not be honest.
            rig_file.tolerance.default = rig_file.tolerance.default.max(0.005);
            truth.supply.pressure_pa *= 1.0 + rng.random_range(-0.02..0.02);
            truth.gas.temperature_k += rng.random_range(-10.0..10.0);
            truth.supply.atmosphere_pa += rng.random_range(-2.0e3..2.0e3);
        }

        let strength = if self.class == Class::Weak { 0.25 } else { 1.0 };
        let causes: Vec<Cause> = if self.class == Class::Slight {
            which.iter().map(|which| slight(*which, &truth, &mut rng)).collect()
        } else {
            which.iter().map(|which| strength::draw(*which, &truth, strength, &mut rng)).collect()
        };

        let family = if self.class == Class::Poor { Family::POOR } else { Family::GOOD };
        let family = family[rng.random_range(0..3)];
        let experiment = family.draw(&rig_file.rig, 40.0, &mut rng);
        let law = Law::for_rig(&rig_file.rig, rng.random_range(0.8..1.6));
        let mut chain = self.chain(&rig_file, &which, &mut rng);
        let seed = rng.random();
        if rng.random_bool(0.3) {
            chain.begins_s = rng.random_range(0.5..5.0);
        }
        Case { rig_file, truth, causes, experiment, law, chain, seed }
    }

    fn chain(&self, rig_file: &RigFile, which: &[Which], rng: &mut Xoshiro256PlusPlus) -> Chain {
        let mut chain = Chain::standard(rig_file.io.position_range_m);
        chain.pressure_noise_pa *= rng.random_range(0.7..1.3);
        chain.position_noise_m *= rng.random_range(0.7..1.3);
        if rng.random_bool(0.3) {
            chain.jitter = rng.random_range(0.05..0.3);
        }
        if rng.random_bool(0.2) {
            chain.lost_rows_per_s = rng.random_range(0.05..0.3);
        }
        if rng.random_bool(0.2) {
            chain.blanks_per_s = rng.random_range(0.05..0.2);
        }
        // A supply that pulsates is only outside the catalogue while nobody records it.
        let pulsates = which.contains(&Which::Foreign(Foreign::SupplyPulsation));
        if rng.random_bool(0.5) && !pulsates || self.class == Class::Weather {
            chain.columns.push(Column::PSup);
        }
        match self.class {
            Class::Decimated => chain.logged_every = [2, 5, 10][rng.random_range(0..3)],
            Class::Slow => chain.period_s = [5.0e-3, 10.0e-3, 20.0e-3][rng.random_range(0..3)],
            Class::Clipped => chain.clipped_above = Some(rng.random_range(0.75..0.95)),
            Class::Sensors => {
                let mut between = |least: f64, most: f64| least * (most / least).powf(rng.random_range(0.0..1.0));
                (chain.position_noise_m, chain.pressure_noise_pa) = (between(3.0e-6, 0.1e-3), between(100.0, 1000.0));
                (chain.position.1, chain.pressure.1) = (rng.random_range(14..=20), rng.random_range(11..=16));
            }
            _ => {}
        }
        if self.class == Class::Partial {
            let missing: &[Column] = match rng.random_range(0..5) {
                0 => &[Column::U],
                1 => &[Column::PA],
                2 => &[Column::PB],
                3 => &[Column::PA, Column::PB],
                _ => &[Column::U, Column::PB],
            };
            chain.columns.retain(|column| !missing.contains(column));
        }
        chain
    }
}
