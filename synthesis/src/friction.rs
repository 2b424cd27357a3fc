//! Friction of the synthetic rig: (3.9) to (3.12) written out as printed and corrected, no shared code.

use crate::effects::{self, Rubbing, Seal};
use crate::physics::Physics;

/// `g`: steady sliding force at velocity `v`, with everything that raises or lowers it.
pub(crate) fn sliding_force(ph: &Physics, v: f64, y: f64, p_sum: f64, time_s: f64, rest_s: f64) -> f64 {
    let mut stiction = ph.stiction;
    if let Some([rise, tau]) = ph.outside.dwell {
        stiction += rise * (1.0 - (-rest_s / tau).exp());
    }
    let ratio = v / ph.stribeck;
    let stribeck = if ratio.abs() < 6.5 { (stiction - ph.coulomb) * (-ratio * ratio).exp() } else { 0.0 };
    let mut g = ph.coulomb + stribeck;
    if let Some([lost, tau]) = ph.outside.running_in {
        g *= 1.0 - lost * (1.0 - (-time_s / tau).exp());
    }
    let seal = Seal { v, y, half_stroke: ph.half_stroke, p_sum, atmosphere: ph.atmosphere_pa };
    let mut rubbing = Rubbing { loaded: g, direction: 1.0, place: 1.0 };
    effects::rub(&ph.present, &seal, &mut rubbing);
    (rubbing.loaded * rubbing.direction * rubbing.place).max(1e-3 * ph.coulomb)
}

/// The elasto-plastic switch (3.12).
pub(crate) fn plasticity(ph: &Physics, z: f64, v: f64, g: f64) -> f64 {
    if z * v <= 0.0 {
        return 0.0;
    }
    let z_max = g / ph.sigma0;
    // (3.13) asks for z_ba < z_max; where an effect lowers g too far, z_ba gives way.
    let z_ba = ph.breakaway.min(0.95 * z_max);
    let z = z.abs();
    if z <= z_ba {
        0.0
    } else if z >= z_max {
        1.0
    } else {
        let middle = 0.5 * (z_max + z_ba);
        0.5 * (std::f64::consts::PI * (z - middle) / (z_max - z_ba)).sin() + 0.5
    }
}
