use super::twin::{Everyday, Gas, REFERENCE_VOLUME_M3, Twin};

pub(super) struct LeakCrossPiston;

impl Twin for LeakCrossPiston {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.between(1e-10, 5e-10) * at.chamber_m3() / REFERENCE_VOLUME_M3, 0.0, 0.0]
    }

    fn flow(p: &[f64; 3], gas: &Gas, into: &mut [f64; 2]) {
        let across = p[0] * (gas.p_a - gas.p_b);
        into[0] -= across;
        into[1] += across;
    }
}
