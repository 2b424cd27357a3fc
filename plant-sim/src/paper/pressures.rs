//! Figure 8: chamber pressures with the valve held open.

use super::{Claim, Figure};
use crate::charts::{BAR, MM};
use plant_model::{Effects, Rig, Simulator};
use report_html::{Plot, Series};

pub(super) fn open_valve() -> Figure {
    let rig = Rig::<f64>::paper_a();
    let (mut t, mut p_a, mut p_b, mut y) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    if let Ok(mut simulator) = Simulator::<f64>::new(&rig, &Effects::none()) {
        for tick in 0..=4000_u32 {
            let state = simulator.state();
            t.push(f64::from(tick) * 1e-3);
            p_a.push(state.p_a_pa * BAR);
            p_b.push(state.p_b_pa * BAR);
            y.push(state.y_m * MM);
            simulator.advance(2.0, 1e-3);
        }
    }
    let last = |values: &[f64]| values.last().copied().unwrap_or(f64::NAN);
    let (end_a, end_b, end_y) = (last(&p_a), last(&p_b), last(&y));
    let rising = p_a.windows(2).skip(2000).all(|pair| pair[1] >= pair[0] - 1e-9);
    let falling = p_b.windows(2).skip(2000).all(|pair| pair[1] <= pair[0] + 1e-9);
    Figure {
        number: 8,
        title: "Chamber pressures at u = 2 V",
        setting: "Case (a) from rest at mid-stroke, both chambers at p* = 3.618 bar (the paper does not give the start). The piston runs to its stop after about half a second; then the chambers are vessels of constant volume.",
        plots: vec![
            Plot::new("Fig. 8: pressures at u = 2 V", "time, s", "pressure, bar absolute")
                .with(Series::line("p_a", t.clone(), p_a))
                .with(Series::line("p_b", t.clone(), p_b))
                .cursor_group("fig8"),
            Plot::new("Position", "time, s", "y, mm").with(Series::line("y", t, y)).cursor_group("fig8"),
        ],
        claims: vec![
            Claim::new(
                "the valve connects port b to the atmosphere: p_b falls to it",
                falling && end_b < 1.02,
                format!("p_b = {end_b:.3} bar after 4 s, falling once the piston stands at {end_y:.0} mm"),
            ),
            Claim::new(
                "p_a rises towards the supply pressure",
                rising && end_a > 6.9,
                format!("p_a = {end_a:.3} bar after 4 s"),
            ),
        ],
    }
}
