use super::twin::{Everyday, Twin};
use crate::physics::Physics;
use rand::RngExt;

pub(super) struct ValveDeadZone;

impl Twin for ValveDeadZone {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        let (right, left) = (at.rig.valve.dead_zone_right_v, at.rig.valve.dead_zone_left_v);
        let [a, b] = [0.0; 2].map(|_| at.scale * at.between(0.15, 0.4));
        match at.rng.random_range(0..3) {
            // Wider on both sides, to different degrees.
            0 => [right + a, left - b, 0.0],
            // A null offset.
            1 => {
                let shift = a * at.sign();
                [right + shift, left + shift, 0.0]
            }
            // One side only.
            _ if at.rng.random_bool(0.5) => [right + a, left, 0.0],
            _ => [right, left - b, 0.0],
        }
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        (rig.right_v, rig.left_v) = (p[0], p[1]);
    }
}
