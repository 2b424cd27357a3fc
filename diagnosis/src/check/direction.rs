//! Whether command, position and pressures of a log turn the same way, whatever the size of the flows.

use crate::balances::opening;
use crate::data::record::Record;
use crate::data::smoothing::Smoothed;
use plant_model::{Plant, Side};
use rig_files::RigFile;

/// The correlation of the valve's opening with the air that enters A and leaves B, as position and pressures tell it,
/// `V p' + n p V'`: near 1 if a positive command fills A, pressures stand in their columns, and y grows as A does. No flow
/// coefficient is in it, so neither a flow fault nor a load changes its sign. `None` without command or pressure of A, or where
/// nothing moves.
pub(super) fn agreement(rig: &RigFile, record: &Record) -> Option<f64> {
    let plant = Plant::new(&rig.rig, &rig.effects).ok()?;
    let has = record.available;
    if !(has.command && has.pressure_a) {
        return None;
    }
    let openings = opening::openings(record, &plant);
    let c = plant.coefficients();
    let entered = |k: usize, p: &Smoothed, volume_0_m3: f64, area_m2: f64| {
        let volume_m3 = (volume_0_m3 + area_m2 * record.y_smooth.value[k]).max(0.0);
        volume_m3 * p.slope[k] + c.exponent * p.value[k] * area_m2 * record.motion.slope[k]
    };
    let (mut both, mut opening, mut flow) = (0.0, 0.0, 0.0);
    for (k, o) in openings.of(Side::A).iter().enumerate() {
        let mut q = entered(k, &record.p_a_smooth, c.volume_a0_m3, plant.area_m2(Side::A));
        if has.pressure_b && !has.vented_b {
            q -= entered(k, &record.p_b_smooth, c.volume_b0_m3, -plant.area_m2(Side::B));
        }
        both += o * q;
        opening += o * o;
        flow += q * q;
    }
    let sizes = (opening * flow).sqrt();
    (sizes > 0.0).then(|| both / sizes).filter(|r| r.is_finite())
}
