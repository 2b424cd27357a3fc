use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct Cushioning;

impl Twin for Cushioning {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        // Needles a turn or two open: at full opening a tenth to a third of the flow is left. The screws differ. Long
        // cushions, as short cylinders have them: experiments keep away from the ends.
        let length = at.between(0.35, 0.6) * 0.5 * at.rig.cylinder.stroke_m;
        let ratio = at.between(2.0, 8.0);
        [length, ratio, ratio * at.between(0.6, 1.6)]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        let [length, ratios @ ..] = *p;
        if length > 0.0 {
            for (side, ratio) in ratios.into_iter().enumerate() {
                let needle = rig.narrowed(side, 1, ratio);
                rig.cushions[side] = needle.map(|needle| (length, needle));
            }
        }
    }
}
