//! One part of the law at a time, against its equation in f64.

mod asked;
mod beginning;
mod chambers;
mod estimate;
mod lessons;
mod motion;
mod rest;
mod targets;

use super::*;
use crate::config::Config;
use crate::parameters::{LawChoice, Parameters};
use crate::quantities::Velocity;
use fixed::types::I6F26;

/// Tick rate of most tests, 1/s.
const HZ: u32 = 1000;

fn tuning() -> Tuning {
    tuning_at(HZ)
}

fn tuning_at(tick_hz: u32) -> Tuning {
    let p = Parameters {
        tick_hz,
        law: LawChoice::Servo,
        dead_zone_right_v: 0.42,
        dead_zone_left_v: -0.42,
        ..Parameters::default()
    };
    Config::from_parameters(&p).expect("valid").servo.expect("the positioning law")
}

fn metres(y: f64) -> Position {
    Position::from_num(y)
}

fn value<T: Fixed>(x: T) -> f64 {
    x.to_num()
}

/// A new target that stands.
fn standing(y: f64) -> reference::Aim {
    let (motion, target) = (Motion::at(metres(y)), metres(y));
    reference::Aim { motion, jerk: Jerk::ZERO, used: I6F26::ZERO, new: true, target }
}
