use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct StaticFriction;

impl Twin for StaticFriction {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        let (coulomb, stated) = (at.rig.friction.coulomb_n, at.rig.friction.static_n);
        let raised = at.between(1.5, 2.5) * coulomb;
        [stated + at.scale * (raised - stated), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.stiction = p[0].max(rig.coulomb);
    }
}
