//! Experiments for a rig: the recommended identification sequence, everyday motion, open loop, and poor ones.

use crate::experiment::{Experiment, Periodic, Reference, Segment, Wave};
use crate::physics::Physics;
use plant_model::Rig;
use rand::RngExt;
use rand::rngs::Xoshiro256PlusPlus;
use rand::seq::SliceRandom;
use std::f64::consts::TAU;

/// Families of experiments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// The recommended identification sequence.
    Identification,
    /// Closed-loop steps, ramps and sines with closed-valve pauses, in random order.
    Everyday,
    /// Everyday motion and open-loop stretches, mixed.
    Mixed,
    /// The piston never moves.
    PoorStill,
    /// A single slow motion in one direction.
    PoorOneWay,
    /// A very small range in the middle of the stroke.
    PoorSmall,
}

impl Family {
    /// Those with enough motion to judge a rig.
    pub const GOOD: [Self; 3] = [Self::Identification, Self::Everyday, Self::Mixed];
    /// Those without.
    pub const POOR: [Self; 3] = [Self::PoorStill, Self::PoorOneWay, Self::PoorSmall];

    /// Name on the command line and in tables.
    #[must_use]
    pub const fn id(self) -> &'static str {
        match self {
            Self::Identification => "identification",
            Self::Everyday => "everyday",
            Self::Mixed => "mixed",
            Self::PoorStill => "poor-still",
            Self::PoorOneWay => "poor-one-way",
            Self::PoorSmall => "poor-small",
        }
    }

    /// The family of this name.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        Self::GOOD.into_iter().chain(Self::POOR).find(|family| family.id() == id)
    }

    /// Draws an experiment of about `duration_s`.
    #[must_use]
    pub fn draw(self, rig: &Rig<f64>, duration_s: f64, rng: &mut Xoshiro256PlusPlus) -> Experiment {
        let scale = Scale::of(rig);
        let (start_m, segments) = match self {
            Self::Identification => return identification(rig, duration_s),
            Self::Everyday => (scale.half * rng.random_range(-0.6..0.6), everyday(&scale, duration_s, rng)),
            Self::Mixed => (scale.half * rng.random_range(-0.4..0.4), mixed(&scale, duration_s, rng)),
            Self::PoorStill => (scale.half * rng.random_range(-0.5..0.5), vec![Segment::closed_valve(duration_s)]),
            Self::PoorOneWay => {
                let direction = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                let ramp = Segment::follow(duration_s - 2.0, Reference::Ramp(0.6 * direction * scale.half));
                (-0.6 * direction * scale.half, vec![Segment::closed_valve(2.0), ramp])
            }
            Self::PoorSmall => {
                let at = scale.half * rng.random_range(-0.5..0.5);
                let small = Periodic::new(Wave::Sine, at, 0.002 * scale.half, rng.random_range(0.2..0.5));
                (at, vec![Segment::follow(duration_s, Reference::Periodic(small))])
            }
        };
        Experiment { name: self.id(), start_m, segments }
    }
}

/// What a rig can do, for scaling experiments.
#[derive(Clone, Copy, Debug)]
struct Scale {
    half: f64,
    top_speed: f64,
    /// Least command that certainly opens the valve, V.
    threshold_v: f64,
    max_v: f64,
}

impl Scale {
    fn of(rig: &Rig<f64>) -> Self {
        Self {
            half: 0.5 * rig.cylinder.stroke_m,
            top_speed: Physics::new(rig, &[]).top_speed(),
            threshold_v: rig.valve.dead_zone_right_v.abs().max(rig.valve.dead_zone_left_v.abs()),
            max_v: rig.valve.max_voltage_v,
        }
    }

    /// The largest sine at `hz` that the valve can feed with room, at most `share` of half the stroke.
    fn amplitude(&self, hz: f64, share: f64) -> f64 {
        (share * self.half).min(0.5 * self.top_speed / (TAU * hz))
    }

    /// Frequency at which full opening in alternation moves the piston over this share of half the stroke.
    fn stroke_hz(&self, share: f64) -> f64 {
        (self.top_speed / (2.0 * share * self.half)).clamp(0.3, 4.0)
    }

    /// A command a given voltage beyond the dead zone.
    fn open_v(&self, beyond_v: f64) -> f64 {
        (self.threshold_v + beyond_v).min(self.max_v)
    }
}

/// A part of the recommended sequence, and what it is good for.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What it makes visible.
    pub purpose: &'static str,
    /// What is done.
    pub segments: Vec<Segment>,
}

/// The recommended sequence as an experiment; see [`identification_parts`].
#[must_use]
pub fn identification(rig: &Rig<f64>, duration_s: f64) -> Experiment {
    let segments = identification_parts(rig, duration_s).into_iter().flat_map(|part| part.segments).collect();
    Experiment { name: Family::Identification.id(), start_m: 0.0, segments }
}

/// The sequence recommended for telling the effects of the catalogue apart on this rig.
///
/// Every part has a purpose; all together are stretched or squeezed to `duration_s`. It starts at mid-stroke.
#[must_use]
pub fn identification_parts(rig: &Rig<f64>, duration_s: f64) -> Vec<Part> {
    let s = Scale::of(rig);
    // Going from one place to another takes a slow rig longer than the sequence would give it.
    let travel = |from: f64, to: f64, least: f64| least.max(1.4 * (to - from).abs() * s.half / (0.7 * s.top_speed));
    let step = |from: f64, to: f64, least: f64| Segment::follow(travel(from, to, least), Reference::Step(to * s.half));
    let ramp = |from: f64, to: f64, least: f64| Segment::follow(travel(from, to, least), Reference::Ramp(to * s.half));
    let sine = |hz: f64, share: f64, centre: f64, duration: f64| {
        let amplitude = s.amplitude(hz, share);
        Segment::follow(duration, Reference::Periodic(Periodic::new(Wave::Sine, centre * s.half, amplitude, hz)))
    };
    // The loop holds the middle while a command is added to it: for motion faster than the loop.
    let shaken = |wave: Wave, centre: f64, volts: f64, hz: f64, end_hz: f64, duration: f64| {
        let command = Periodic { wave, centre: 0.0, amplitude: volts, hz, end_hz };
        Segment::shaken(duration, Reference::Step(centre * s.half), command)
    };
    // The last quarter of half the stroke at 0.4 V beyond the dead zone (0.43 of full opening), and a second to build up.
    let push_s = 1.0 + 0.25 * s.half / (0.43 * s.top_speed);
    let everything = vec![
        (
            "full flow both ways: flow coefficients, choking, droop, inertia",
            vec![step(0.0, 0.55, 1.6), step(0.55, -0.55, 1.6)],
        ),
        (
            "sealed unequal chambers above atmosphere: leaks to atmosphere, offsets, heat after the move",
            vec![Segment::closed_valve(2.2), step(-0.55, 0.7, 1.8), Segment::closed_valve(2.2)],
        ),
        (
            "slow ramps both ways: Coulomb and static friction, position dependence, constant force",
            vec![ramp(0.7, -0.1, 3.0), ramp(-0.1, 0.5, 2.6)],
        ),
        (
            "sines, slow and large to fast and small: mass, viscous friction, volumes, exponent",
            vec![sine(0.4, 0.6, 0.0, 2.5), sine(1.0, 0.5, 0.3, 2.0), sine(2.5, 0.3, -0.3, 2.0)],
        ),
        (
            "a sweep faster than the loop: lag against delay, sensor lag, position delay",
            vec![shaken(Wave::Sine, 0.0, s.open_v(0.8), 1.0, 10.0, 4.0)],
        ),
        (
            "the valve wide open in alternation: the largest flows and accelerations",
            vec![
                Segment::open(3.0, Periodic::new(Wave::Square, 0.0, s.open_v(3.0), s.stroke_hz(0.5))),
                step(0.0, -0.2, 0.8),
            ],
        ),
        (
            "small slow reversals of the valve: dead zone, hysteresis, breakaway",
            vec![
                shaken(Wave::Triangle, -0.2, s.open_v(0.25), 0.5, 0.5, 4.0),
                shaken(Wave::Triangle, 0.3, s.open_v(0.6), 1.0, 1.0, 2.0),
            ],
        ),
        (
            "gently against both end stops, then sealed: the largest pressure difference and sum there are",
            vec![
                ramp(0.3, 0.95, 1.2),
                Segment::push(push_s, s.open_v(0.4)),
                Segment::closed_valve(2.0),
                ramp(0.95, -0.95, 1.8),
                Segment::push(push_s, -s.open_v(0.4)),
                Segment::closed_valve(2.0),
            ],
        ),
        (
            "motion once more: the last part of a log is held back for checking",
            vec![step(-0.95, 0.2, 1.0), sine(0.8, 0.5, 0.0, 1.5), step(0.0, -0.4, 1.0), step(-0.4, 0.4, 1.0)],
        ),
    ];
    let total: f64 = everything.iter().flat_map(|(_, parts)| parts).map(|segment| segment.duration_s).sum();
    everything
        .into_iter()
        .map(|(purpose, parts)| Part {
            purpose,
            segments: parts
                .into_iter()
                .map(|part| Segment { duration_s: part.duration_s * duration_s / total, ..part })
                .collect(),
        })
        .collect()
}

/// Parts until the time is used up, reshuffled whenever all kinds have been played.
fn fill_time(
    duration_s: f64,
    kinds: usize,
    rng: &mut Xoshiro256PlusPlus,
    mut draw: impl FnMut(usize, &mut Xoshiro256PlusPlus) -> Vec<Segment>,
) -> Vec<Segment> {
    let mut segments: Vec<Segment> = Vec::new();
    let mut left = duration_s;
    let mut order: Vec<usize> = Vec::new();
    while left > 0.0 {
        let kind = order.pop().unwrap_or_else(|| {
            order = (0..kinds).collect();
            order.shuffle(rng);
            order.pop().unwrap_or(0)
        });
        for mut segment in draw(kind, rng) {
            segment.duration_s = segment.duration_s.min(left);
            left -= segment.duration_s;
            if segment.duration_s > 0.0 {
                segments.push(segment);
            }
        }
    }
    segments
}

/// The closed-loop parts of ordinary operation.
fn closed_loop_part(kind: usize, s: &Scale, rng: &mut Xoshiro256PlusPlus) -> Vec<Segment> {
    let place = |rng: &mut Xoshiro256PlusPlus| s.half * rng.random_range(-0.75..0.75);
    match kind {
        0 => (0..2).map(|_| Segment::follow(rng.random_range(1.0..2.0), Reference::Step(place(rng)))).collect(),
        1 => vec![Segment::follow(rng.random_range(1.5..4.0), Reference::Ramp(place(rng)))],
        2 | 3 => {
            let hz = (rng.random_range(0.25_f64.ln()..if kind == 2 { 0.9_f64.ln() } else { 4.0_f64.ln() })).exp();
            let amplitude = s.amplitude(hz, rng.random_range(0.15..0.6));
            let centre = (s.half - amplitude) * rng.random_range(-0.6..0.6);
            let wave = if rng.random_bool(0.75) { Wave::Sine } else { Wave::Triangle };
            let periodic = Periodic::new(wave, centre, amplitude, hz);
            vec![Segment::follow(rng.random_range(2.0..4.0), Reference::Periodic(periodic))]
        }
        _ => vec![
            Segment::follow(rng.random_range(0.8..1.5), Reference::Step(place(rng))),
            Segment::closed_valve(rng.random_range(1.0..2.5)),
        ],
    }
}

fn everyday(s: &Scale, duration_s: f64, rng: &mut Xoshiro256PlusPlus) -> Vec<Segment> {
    fill_time(duration_s, 5, rng, |kind, rng| closed_loop_part(kind, s, rng))
}

fn mixed(s: &Scale, duration_s: f64, rng: &mut Xoshiro256PlusPlus) -> Vec<Segment> {
    fill_time(duration_s, 8, rng, |kind, rng| match kind {
        5 => {
            // Open-loop sweep about the middle.
            let beyond = rng.random_range(0.3..1.5);
            let [low, high] = [rng.random_range(0.8..2.0), rng.random_range(5.0..10.0)];
            let sweep = Periodic { wave: Wave::Sine, centre: 0.0, amplitude: s.open_v(beyond), hz: low, end_hz: high };
            let home = Segment::follow(1.0, Reference::Step(s.half * rng.random_range(-0.2..0.2)));
            vec![home, Segment::open(rng.random_range(2.0..4.0), sweep)]
        }
        6 => {
            // Open-loop steps of the valve; the limit switches turn the piston back.
            let count = rng.random_range(2..5);
            let pause = Segment::closed_valve(rng.random_range(0.5..1.5));
            (0..count)
                .map(|_| {
                    let volts = s.open_v(rng.random_range(0.1..3.0)) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                    Segment::open(rng.random_range(0.2..0.8), Periodic::constant(volts))
                })
                .chain([pause])
                .collect()
        }
        7 => {
            let volts = s.open_v(rng.random_range(0.1..0.8));
            let wave = if rng.random_bool(0.5) { Wave::Triangle } else { Wave::Square };
            let hz = rng.random_range(0.7..3.0);
            let about = Reference::Step(s.half * rng.random_range(-0.4..0.4));
            vec![Segment::shaken(rng.random_range(2.0..4.0), about, Periodic::new(wave, 0.0, volts, hz))]
        }
        _ => closed_loop_part(kind, s, rng),
    })
}
