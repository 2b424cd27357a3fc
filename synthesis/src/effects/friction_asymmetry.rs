use super::twin::{Everyday, Rubbing, Seal, Twin};

pub(super) struct FrictionAsymmetry;

impl Twin for FrictionAsymmetry {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        [at.scale * at.sign() * at.between(0.15, 0.4), 0.0, 0.0]
    }

    fn rub(p: &[f64; 3], seal: &Seal, g: &mut Rubbing) {
        if seal.v > 0.0 {
            g.direction *= 1.0 + p[0];
        } else if seal.v < 0.0 {
            g.direction *= 1.0 - p[0];
        }
    }
}
