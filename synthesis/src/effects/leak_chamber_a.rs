use super::twin::{Everyday, Gas, REFERENCE_VOLUME_M3, Twin};

pub(super) struct LeakChamberA;

impl Twin for LeakChamberA {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.between(1e-10, 5e-10) * at.chamber_m3() / REFERENCE_VOLUME_M3, 0.0, 0.0]
    }

    fn flow(p: &[f64; 3], gas: &Gas, into: &mut [f64; 2]) {
        into[0] -= p[0] * (gas.p_a - gas.atmosphere);
    }
}
