use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct ValveHysteresis;

impl Twin for ValveHysteresis {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.between(0.05, 0.2), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.play_v = p[0];
    }
}
