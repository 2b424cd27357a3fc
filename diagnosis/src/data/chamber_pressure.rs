//! Smoothed chamber pressures. What the piston's motion makes of them is taken out before, and put back behind.
//!
//! A window that is long enough against noise cuts off how the air answers a piston that reverses or breaks away, an oscillation at
//! tens of hertz, and with it the force that accelerates the piston: a mass comes out too small. The position tells that part with
//! far less noise.

use super::smoothing::{Reach, Smoothed, slopes, twice};
use plant_model::{Plant, Side};

/// The pressure of a chamber of the rig as its file states it, smoothed with one window throughout.
///
/// Smoothed is `p V^n`, which is constant while no air comes or goes, and the volume `V` takes the position smoothed alike
/// (`smooth_y_m`, by [`twice`]): so the position's noise does not come back, and of the piston's motion only what the window cuts off
/// twice is lost (twicing, Tukey 1977).
pub(super) fn smoothed(
    (plant, side): (&Plant<f64>, Side),
    t_s: &[f64],
    (p_pa, smooth_y_m): (&[f64], &[f64]),
    reach: Reach,
) -> Smoothed {
    let exponent = plant.coefficients().exponent;
    let growth = |shown_m: &f64| volume_m3((plant, side), *shown_m).powf(exponent);
    let growths: Vec<f64> = smooth_y_m.iter().map(growth).collect();
    let constant: Vec<f64> = p_pa.iter().zip(&growths).map(|(p, growth)| p * growth).collect();
    let value: Vec<f64> =
        twice(t_s, &constant, reach).value.iter().zip(&growths).map(|(c, growth)| c / growth).collect();
    let slope = slopes(t_s, &value, 0..value.len()).collect();
    Smoothed { value, slope }
}

/// How much the piston's way changes the pressure of a chamber at its usual pressure and place, Pa/m.
pub(super) fn pa_per_m((plant, side): (&Plant<f64>, Side), p_pa: &[f64], y_m: &[f64]) -> f64 {
    let mean = |signal: &[f64]| signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    plant.coefficients().exponent * mean(p_pa) * plant.area_m2(side) / volume_m3((plant, side), mean(y_m))
}

fn volume_m3((plant, side): (&Plant<f64>, Side), shown_m: f64) -> f64 {
    let (a, b) = plant.volumes_m3(plant.true_position_m(shown_m));
    if side == Side::A { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::simulated::simulated;
    use crate::constants;
    use rig_files::RigFile;

    #[test]
    fn a_window_cuts_off_little_of_what_a_light_piston_makes_of_its_air() {
        let mut file = RigFile::paper_c();
        file.rig.load.mass_kg *= 0.2;
        let log = simulated(&file, &file.effects, 3000, |t_s| 0.3 * (20.0 * t_s).sin());
        let plant = Plant::new(&file.rig, &file.effects).expect("a sound rig");
        let reach = Reach::new(constants::pressure_reach(), 1.0e-3, constants::least_reach());
        for (side, p_pa) in [(Side::A, &log.p_a_pa), (Side::B, &log.p_b_pa)] {
            let p_pa = p_pa.as_ref().expect("simulated");
            let rms_pa = |smoothed: Smoothed| {
                let squares = p_pa.iter().zip(&smoothed.value).map(|(p, value)| (p - value).powi(2));
                (squares.skip(100).take(2800).sum::<f64>() / 2800.0).sqrt()
            };
            let smooth_y_m = twice(&log.t_s, &log.y_m, reach).value;
            let own = rms_pa(smoothed((&plant, side), &log.t_s, (p_pa, &smooth_y_m), reach));
            let plain = rms_pa(twice(&log.t_s, p_pa, reach));
            assert!(own < 0.5 * plain, "{own} {plain}");
        }
    }
}
