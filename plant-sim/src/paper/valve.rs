//! Figures 5 and 6: the dead zone and the mass flow.

use super::{Claim, Figure};
use plant_model::dead_zone::DeadZone;
use plant_model::valve_flow::{Opening, Orifices};
use plant_model::{Effects, Plant, Rig};
use report_html::{Marker, Plot, Series};

fn span(low: f64, high: f64, count: u32) -> Vec<f64> {
    (0..=count).map(|at| low + (high - low) * f64::from(at) / f64::from(count)).collect()
}

pub(super) fn dead_zone() -> Figure {
    let zone = DeadZone { right_v: 0.6, left_v: -0.4, slope_right: 1.2, slope_left: 0.8, rounding_v: 0.0 };
    let u = span(-2.0, 2.0, 800);
    let w: Vec<f64> = u.iter().map(|u| zone.output_v(*u)).collect();
    let inside = u.iter().zip(&w).filter(|(u, _)| **u > zone.left_v && **u < zone.right_v).all(|(_, w)| *w == 0.0);
    let steepest = u.windows(2).zip(w.windows(2)).map(|(u, w)| (w[1] - w[0]) / (u[1] - u[0])).fold(0.0, f64::max);
    Figure {
        number: 5,
        title: "Dead zone",
        setting: "Break-points −0.4 and 0.6 V, slopes 0.8 and 1.2: the paper draws it without numbers.",
        plots: vec![
            Plot::new("Fig. 5: dead zone (3.1)", "u, V", "u after the dead zone, V")
                .with(Series::line("after the dead zone", u, w))
                .marker(Marker::Vertical(zone.left_v))
                .marker(Marker::Vertical(zone.right_v)),
        ],
        claims: vec![
            Claim::new(
                "for a range of input values it gives no output",
                inside,
                "0 V at every command between the break-points",
            ),
            Claim::new(
                "neither the break-points nor the slopes are equal in general, and the output joins them without a jump",
                steepest <= zone.slope_right + 1e-9,
                format!("steepest rise {steepest:.3}, the larger of the two slopes"),
            ),
        ],
    }
}

pub(super) fn flow() -> Figure {
    let rig = Rig::<f64>::paper_a();
    let supply = rig.supply;
    let orifices = Orifices {
        fill: rig.valve.fill_coefficient_kg_per_s_pa,
        exhaust: rig.valve.exhaust_coefficient_kg_per_s_pa,
        iso6358: None,
        hose: None,
        cushion: None,
    };
    let flow = |u: f64, drop: f64| {
        let opening = Opening::at(u);
        let p = if opening.fills_a { supply.pressure_pa - drop } else { supply.atmosphere_pa + drop };
        orifices.inflow(opening.fills_a, opening.magnitude, p, supply.pressure_pa, supply.atmosphere_pa).mass_flow
    };
    let u = span(-5.0, 5.0, 500);
    let mut plot = Plot::new("Fig. 6: mass flow into chamber A (3.2)", "u, V", "mass flow, g/s").height_px(360);
    for bar in 1..=6_u8 {
        let drop = f64::from(bar) * 1e5;
        let q = u.iter().map(|u| 1e3 * flow(*u, drop)).collect();
        plot = plot.with(Series::line(format!("{bar} bar"), u.clone(), q));
    }
    let monotone = (1..=6)
        .all(|bar| u.windows(2).all(|pair| flow(pair[1], f64::from(bar) * 1e5) > flow(pair[0], f64::from(bar) * 1e5)));
    // The paper's reason for the form: u can be isolated.
    let worst = u
        .iter()
        .map(|u| {
            let drop = 3e5;
            let beta = if *u >= 0.0 { orifices.fill } else { orifices.exhaust };
            ((flow(*u, drop) / (beta * drop)).tan() / 2.0 - u).abs()
        })
        .fold(0.0, f64::max);
    let plant = Plant::new(&rig, &Effects::none());
    let settled = plant.map_or(f64::NAN, |_| rig.equilibrium_pressure_pa());
    let balance = orifices.fill * (supply.pressure_pa - settled) - orifices.exhaust * (settled - supply.atmosphere_pa);
    Figure {
        number: 6,
        title: "Mass flow through the valve",
        setting: "The fitted surface as curves over the command, one per pressure drop. Filling to the right (u > 0), exhausting to the left.",
        plots: vec![plot],
        claims: vec![
            Claim::new(
                "the flow grows with the opening and with the pressure difference",
                monotone,
                "rises with u at each of six drops, in proportion to the drop",
            ),
            Claim::new(
                "the input u can be isolated, which control methods need",
                worst < 1e-9,
                format!("u = tan(q / (beta Δp)) / 2 returns u to {worst:.0e} V over ±5 V"),
            ),
            Claim::new(
                "(a consequence of (3.3)) in slow motion both chambers settle at one pressure, 3.618 bar for Table 1",
                (settled - 3.618e5).abs() < 50.0 && balance.abs() < 1e-15,
                format!("p* = {:.3} bar, where filling and exhausting balance", settled * 1e-5),
            ),
        ],
    }
}
