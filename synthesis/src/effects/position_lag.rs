use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct PositionLag;

impl Twin for PositionLag {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.between(5e-3, 20e-3), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.y_lag_s = p[0];
    }
}
