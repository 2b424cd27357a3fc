use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct LineDelay;

impl Twin for LineDelay {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.between(5e-3, 20e-3), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.line_delays_s = rig.line_delays_s.map(|delay_s| (delay_s + p[0]).max(0.0));
    }
}
