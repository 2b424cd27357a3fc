use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct OpeningCurve;

impl Twin for OpeningCurve {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        // Of the largest command; the two sides of a valve differ a little.
        let full = at.between(0.4, 0.9) * at.rig.valve.max_voltage_v;
        [at.between(-0.3, 0.6), full, full * at.between(0.9, 1.1)]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.bent = Some(*p);
    }
}
