use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct CoulombFriction;

impl Twin for CoulombFriction {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.factor_outside([0.6, 0.8, 1.25, 1.8]), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.coulomb *= p[0];
        rig.stiction *= p[0];
    }
}
