use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct ChokedFlow;

impl Twin for ChokedFlow {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        // Replaces the linear law as a whole, so that it cannot be made weak.
        [at.between(0.2, 0.5), at.between(0.85, 1.15), 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.choked = (p[0] >= 0.0).then_some([p[0], p[1]]);
    }
}
