use super::twin::{Everyday, Twin};
use crate::reading::Reading;

pub(super) struct PressureAOffset;

impl Twin for PressureAOffset {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.sign() * at.between(1e4, 3e4), 0.0, 0.0]
    }

    fn show(p: &[f64; 3], reading: &mut Reading) {
        reading.p_a_pa += p[0];
    }
}
