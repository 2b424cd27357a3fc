use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct HeatTransfer;

impl Twin for HeatTransfer {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        let gamma = at.rig.gas.heat_capacity_ratio;
        [gamma + at.scale * (at.between(1.0, 1.25).min(gamma) - gamma), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.exponent = p[0];
    }
}
