use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct PistonArea;

impl Twin for PistonArea {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.factor(0.03, 0.08), at.factor(0.03, 0.08), 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.area_a *= p[0];
        rig.area_b *= p[1];
    }
}
