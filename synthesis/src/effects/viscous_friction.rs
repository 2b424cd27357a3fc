use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct ViscousFriction;

impl Twin for ViscousFriction {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.rig.friction.viscous_n_s_per_m * at.factor_outside([0.5, 0.75, 1.3, 2.0]), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.sigma2 = p[0];
    }
}
