use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct WallHeat;

impl Twin for WallHeat {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        // Replaces the law of warm air as a whole, so that it cannot be made weak.
        [at.between(20.0, 100.0), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.walls = (p[0] >= 0.0).then_some(p[0]);
    }
}
