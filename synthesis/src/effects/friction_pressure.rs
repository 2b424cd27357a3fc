use super::twin::{Everyday, Rubbing, Seal, Twin};
use crate::physics::Physics;

pub(super) struct FrictionPressure;

impl Twin for FrictionPressure {
    fn draw(at: &mut Everyday<'_>) -> [f64; 3] {
        let physics = Physics::new(at.rig, &[]);
        let gauge_sum = 2.0 * (physics.rest_pressure_pa() - physics.atmosphere_pa);
        [at.scale * at.between(0.2, 0.6) * at.rig.friction.coulomb_n / gauge_sum, 0.0, 0.0]
    }

    fn rub(p: &[f64; 3], seal: &Seal, g: &mut Rubbing) {
        g.loaded += p[0] * (seal.p_sum - 2.0 * seal.atmosphere).max(0.0);
    }
}
