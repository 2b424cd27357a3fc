use super::twin::{Everyday, Rubbing, Seal, Twin};
use rand::RngExt;

pub(super) struct FrictionPosition;

impl Twin for FrictionPosition {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        if at.rng.random_bool(0.6) {
            [at.scale * at.sign() * at.between(0.2, 0.5), 0.0, 0.0]
        } else {
            let wavelength = at.rig.cylinder.stroke_m * at.between(0.05, 0.2);
            [0.0, at.scale * at.between(0.2, 0.5), wavelength]
        }
    }

    fn rub(p: &[f64; 3], seal: &Seal, g: &mut Rubbing) {
        g.place += p[0] * seal.y / seal.half_stroke;
        if p[2] > 0.0 && p[1] != 0.0 {
            g.place += p[1] * (std::f64::consts::TAU * seal.y / p[2]).sin();
        }
    }
}
