//! A command that moved between the rows of the log is known no better than its jumps: they came at some time between two
//! rows. What that makes of the chamber pressures is a variance of their predictions.

use crate::data::record::Record;
use plant_model::{Plant, Side};

/// How far the command's unknown jumps between rows make its mean, and the pressures behind it, uncertain.
pub(crate) fn doubts(record: &mut Record, plant: &Plant<f64>) {
    let n = record.len();
    let opening = |u: f64| {
        let opening = plant.opening(u);
        if opening.fills_a { opening.magnitude } else { -opening.magnitude }
    };
    // The commands as logged; those of the grid are means.
    let u = &record.u_rows_v;
    let openings: Vec<f64> = u.iter().map(|u| opening(*u)).collect();
    let volts = jumps(u);
    let radians = jumps(&openings);
    // A jump at a time that is equally likely anywhere between two rows: the standard deviation of the mean.
    let spread = 1.0 / 12.0_f64.sqrt();
    record.command_doubt_v = vec![0.0; n];
    record.doubt_a_pa = vec![0.0; n];
    record.doubt_b_pa = vec![0.0; n];
    let c = plant.coefficients();
    for (row, k) in record.rows.clone().into_iter().enumerate() {
        record.command_doubt_v[k] = spread * volts[row];
        let supply = record.p_sup_smooth.value.get(k).copied().unwrap_or(c.supply_pa);
        for side in [Side::A, Side::B] {
            let Some(p) = record.chamber(side).smooth.value.get(k).copied() else { continue };
            let (volume_0, area) = if side == Side::A {
                (c.volume_a0_m3, plant.area_m2(side))
            } else {
                (c.volume_b0_m3, -plant.area_m2(side))
            };
            let volume = (volume_0 + area * record.y_smooth.value[k]).max(plant.minimum_volume_m3(side));
            let fills = (openings[row] >= 0.0) == (side == Side::A);
            let flow = plant.orifices(side).inflow(fills, 1.0, p, supply, c.atmosphere_pa).mass_flow;
            let doubt = plant.energy_j_per_kg() / volume * flow.abs() * spread * radians[row] * record.to_next_row_s(k);
            let doubts = if side == Side::A { &mut record.doubt_a_pa } else { &mut record.doubt_b_pa };
            doubts[k] = doubt;
        }
    }
}

/// How much of the change from each value to the next is not the change before or after it: a ramp has none, a jump all.
fn jumps(signal: &[f64]) -> Vec<f64> {
    let change = |k: usize| signal.get(k + 1).map_or(0.0, |next| next - signal[k]);
    let jump = |k: usize| {
        let here = change(k);
        let before = if k > 0 { change(k - 1) } else { here };
        let after = if k + 2 < signal.len() { change(k + 1) } else { here };
        (here - before).abs().max((here - after).abs())
    };
    (0..signal.len()).map(jump).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_no_jumps_and_a_step_is_one() {
        assert_eq!(jumps(&[0.0, 1.0, 2.0, 3.0])[..3], [0.0, 0.0, 0.0]);
        assert_eq!(jumps(&[0.0, 0.0, 0.0, 2.0, 2.0, 2.0])[1..5], [2.0, 2.0, 2.0, 0.0]);
    }
}
