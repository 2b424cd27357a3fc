//! One case, with what the arguments change of it.

use crate::arguments::Arguments;
use crate::draws;
use crate::trials::with_friction;
use plant_model::Rig;
use plant_sim::servo::Tuning;
use plant_sim::servo::bench::{Bench, Driver, Lost};
use rayon::prelude::*;

const LAG_S: f64 = 1.7e-3;
const ZONE_V: f64 = 0.42;

/// A case, as the law takes it and as it is.
pub(crate) struct Study<'a> {
    pub(crate) arguments: &'a Arguments,
    pub(crate) case: char,
    /// What the law takes for the rig.
    pub(crate) rig: Rig<f64>,
    /// What it is.
    actual: Rig<f64>,
    /// The longest move, m.
    pub(crate) longest: f64,
    pub(crate) tuning: Tuning,
    /// The first seed.
    pub(crate) first: u64,
}

fn nominal(case: char) -> (Rig<f64>, f64) {
    let (mut rig, longest) = match case {
        'a' => (Rig::paper_a(), 0.3),
        'b' => (Rig::paper_b(), 0.2),
        _ => (Rig::paper_c(), 0.01),
    };
    rig.valve.dead_zone_right_v = ZONE_V;
    rig.valve.dead_zone_left_v = -ZONE_V;
    (rig, longest)
}

/// The law's constants for a rig, with those that the arguments change.
fn tuning(rig: &Rig<f64>, arguments: &Arguments) -> Tuning {
    let mut tuning = Tuning::of(rig, LAG_S, 1.0 / arguments.or("hz", 1000.0));
    tuning.bristle_stiffness *= arguments.or("bs", 1.0);
    for (name, place) in [
        ("w", &mut tuning.law_w),
        ("wo", &mut tuning.observer_w),
        ("J", &mut tuning.limits.jerk),
        ("A", &mut tuning.limits.acceleration),
        ("V", &mut tuning.limits.speed),
        ("fr", &mut tuning.force_rate),
        ("blend", &mut tuning.blend),
        ("sg", &mut tuning.stick_gain),
        ("sf", &mut tuning.stick_force_rate),
        ("sv", &mut tuning.stick_speed),
        ("he", &mut tuning.hold_m[0]),
        ("hs", &mut tuning.hold_speed),
        ("hf", &mut tuning.hold_force),
        ("hb", &mut tuning.hold_band),
        ("hm", &mut tuning.hold_margin),
        ("sr", &mut tuning.stall_rate),
        ("sm", &mut tuning.stall_force),
    ] {
        *place *= arguments.or(name, 1.0);
    }
    for (name, ticks) in
        [("jt", &mut tuning.coast_ticks), ("st", &mut tuning.stick_ticks), ("sn", &mut tuning.stall_ticks)]
    {
        *ticks = arguments.value(name).map_or(*ticks, |ticks| ticks as u32);
    }
    tuning.hold_m[1] *= arguments.or("hl", 1.0);
    tuning.coulomb_start = arguments.or("fc0", tuning.coulomb_start);
    tuning.unlearn = arguments.or("ul", tuning.unlearn);
    for (name, rate) in ["lg", "lz", "lf"].into_iter().zip(&mut tuning.learn) {
        *rate = arguments.or(name, *rate);
    }
    tuning
}

impl<'a> Study<'a> {
    pub(crate) fn new(case: char, arguments: &'a Arguments) -> Self {
        let (rig, longest) = nominal(case);
        let mut actual = rig;
        actual.friction = with_friction(&rig, arguments.or("friction", 1.0)).friction;
        let stiff = arguments.or("stiff", 1.0);
        actual.friction.stiffness_n_per_m *= stiff;
        actual.friction.breakaway_m /= stiff;
        let tuning = tuning(&rig, arguments);
        Self { arguments, case, rig, actual, longest, tuning, first: arguments.or("first", 0.0) as u64 }
    }

    /// A count that was given by this name, or none.
    pub(crate) fn count(&self, name: &str) -> u64 {
        self.arguments.or(name, 0.0) as u64
    }

    /// Ticks of a move.
    pub(crate) fn ticks(&self) -> u32 {
        (2.5 / self.tuning.tick_s) as u32
    }

    /// The rig or a draw of it, with the law closed around it.
    pub(crate) fn on(&self, drawn: bool, seed: u64) -> Bench {
        let arguments = self.arguments;
        let [valve_s, pressures_s] = ["valve_ms", "pressures_ms"].map(|name| 1e-3 * arguments.or(name, 0.0));
        let lost = [Lost::None, Lost::A, Lost::Both][arguments.or("lost", 0.0) as usize % 3];
        let noise = arguments.or("noise", 1.0);
        let bench = draws::bench(&self.rig, &self.actual, self.tuning, drawn, noise, seed, lost);
        let bench = bench.late(valve_s, pressures_s);
        if arguments.in_tick() { bench.with_tick(Driver::Tick) } else { bench }
    }

    /// What becomes of so many seeds, side by side.
    pub(crate) fn each<T: Send>(&self, seeds: u64, run: impl Fn(u64) -> T + Send + Sync) -> Vec<T> {
        (self.first..self.first + seeds).into_par_iter().map(run).collect()
    }
}
