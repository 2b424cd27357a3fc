use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct ExhaustCoefficient;

impl Twin for ExhaustCoefficient {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.factor(0.15, 0.35), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.exhaust *= p[0];
    }
}
