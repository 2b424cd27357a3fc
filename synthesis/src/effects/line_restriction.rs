use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct LineRestriction;

impl Twin for LineRestriction {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        // A kinked hose or a small fitting: at full opening 50 to 75 % of the flow are left. One line, or both unequally.
        let worse = at.scale * at.between(0.35, 1.0);
        let other = worse * at.between(0.3, 1.0);
        match at.between(0.0, 3.0) {
            ..1.0 => [worse, 0.0, 0.0],
            ..2.0 => [0.0, worse, 0.0],
            _ => [worse, other, 0.0],
        }
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        for side in [0, 1] {
            let line = rig.narrowed(side, 0, p[side]);
            rig.tubes[side].extend(line);
        }
    }
}
