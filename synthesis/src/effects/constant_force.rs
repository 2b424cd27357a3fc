use super::twin::{Everyday, Twin};

pub(super) struct ConstantForce;

impl Twin for ConstantForce {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.sign() * at.between(0.2, 0.6) * at.rig.friction.coulomb_n, 0.0, 0.0]
    }

    fn push(p: &[f64; 3], _y: f64, _v: f64) -> f64 {
        -p[0]
    }
}
