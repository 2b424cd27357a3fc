//! Rigs other than the paper's: bore, stroke, load, valve and friction as catalogues have them.

use plant_model::Rig;
use rand::RngExt;
use rand::rngs::Xoshiro256PlusPlus;
use rig_files::RigFile;

/// Draws a rig: bore 20 to 80 mm, stroke 0.1 to 1 m, load 2 to 40 kg, supply 5 to 8 bar, dead zones up to 0.6 V.
#[must_use]
pub fn varied_rig(rng: &mut Xoshiro256PlusPlus) -> RigFile {
    fn log_between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
        rng.random_range(low.ln()..=high.ln()).exp()
    }
    let mut rig = Rig::paper_a();
    let bore = log_between(rng, 0.02, 0.08);
    let area = 0.25 * std::f64::consts::PI * bore * bore;
    let stroke = log_between(rng, 0.1, 1.0);
    rig.cylinder.set_area_m2(area);
    rig.cylinder.stroke_m = stroke;
    // Ends and hoses take 3 to 25 % of half the swept volume.
    rig.cylinder.volume_a0_m3 = 0.5 * area * stroke * rng.random_range(1.03..1.25);
    rig.cylinder.volume_b0_m3 = 0.5 * area * stroke * rng.random_range(1.03..1.25);
    rig.supply.pressure_pa = rng.random_range(5.0e5..8.0e5);
    // A valve that feeds the piston with 0.3 to 1.5 m/s; the paper's feeds 1.7 m/s on 4.91 cm2.
    let valve = log_between(rng, 0.3, 1.5) / 1.7 * area / 4.91e-4;
    rig.valve.fill_coefficient_kg_per_s_pa *= valve * rng.random_range(0.85..1.15);
    rig.valve.exhaust_coefficient_kg_per_s_pa *= valve * rng.random_range(0.85..1.15);
    if rng.random_bool(0.6) {
        rig.valve.dead_zone_right_v = rng.random_range(0.1..0.6);
        rig.valve.dead_zone_left_v = -rng.random_range(0.1..0.6);
    }
    // Heavier loads on larger bores; seal friction grows with the circumference.
    rig.load.mass_kg = (10.0 * bore / 0.025 * log_between(rng, 0.3, 1.5)).clamp(2.0, 40.0);
    let friction = &mut rig.friction;
    friction.coulomb_n = 23.1 * bore / 0.025 * log_between(rng, 0.5, 1.6);
    friction.static_n = friction.coulomb_n * rng.random_range(1.03..1.4);
    friction.viscous_n_s_per_m = 46.5 * bore / 0.025 * log_between(rng, 0.5, 2.0);
    friction.stribeck_velocity_m_per_s = log_between(rng, 0.005, 0.03);
    friction.stiffness_n_per_m = friction.coulomb_n / log_between(rng, 2e-5, 8e-5);
    let damping_ratio = rng.random_range(0.1..0.5);
    friction.damping_n_s_per_m = 2.0 * damping_ratio * (friction.stiffness_n_per_m * rig.load.mass_kg).sqrt();
    friction.breakaway_m = 0.7 * friction.coulomb_n / friction.stiffness_n_per_m;
    let mut rig_file = RigFile::new("varied rig", rig);
    rig_file.io.position_range_m = [-0.5 * stroke, 0.5 * stroke];
    rig_file
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn varied_rigs_are_valid_and_survive_their_file() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
        for _ in 0..200 {
            let rig_file = varied_rig(&mut rng);
            assert!(rig_file.rig.validate().is_ok());
            assert_eq!(RigFile::parse(&rig_file.to_toml(), "varied.toml").as_ref(), Ok(&rig_file));
        }
    }
}
