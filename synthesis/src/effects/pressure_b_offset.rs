use super::twin::{Everyday, Twin};
use crate::reading::Reading;

pub(super) struct PressureBOffset;

impl Twin for PressureBOffset {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.sign() * at.between(1e4, 3e4), 0.0, 0.0]
    }

    fn show(p: &[f64; 3], reading: &mut Reading) {
        reading.p_b_pa += p[0];
    }
}
