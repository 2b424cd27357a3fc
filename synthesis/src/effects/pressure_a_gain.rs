use super::twin::{Everyday, Twin};
use crate::reading::Reading;

pub(super) struct PressureAGain;

impl Twin for PressureAGain {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.factor(0.03, 0.08), 0.0, 0.0]
    }

    fn show(p: &[f64; 3], reading: &mut Reading) {
        reading.p_a_pa *= p[0];
    }
}
