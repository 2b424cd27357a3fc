use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct SupplyDroop;

impl Twin for SupplyDroop {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        let physics = Physics::new(at.rig, &[]);
        let full_flow = physics.full_flow();
        [at.scale * at.between(0.3e5, 1.0e5) / full_flow, at.between(0.05, 0.3), 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        (rig.droop, rig.droop_s) = (p[0], p[1]);
    }
}
