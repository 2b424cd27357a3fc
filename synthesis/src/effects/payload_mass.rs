use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct PayloadMass;

impl Twin for PayloadMass {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.rig.load.mass_kg * at.factor(0.15, 0.4), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.mass = p[0];
    }
}
