use super::twin::{Everyday, Twin};
use crate::physics::Physics;

pub(super) struct DeadVolume;

impl Twin for DeadVolume {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.between(0.1, 0.4) * at.chamber_m3(), 0.0, 0.0]
    }

    fn apply(p: &[f64; 3], rig: &mut Physics) {
        rig.volume_a += p[0];
        rig.volume_b += p[0];
    }
}
