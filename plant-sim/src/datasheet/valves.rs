//! Proportional valves by their type: what their data sheets say.

/// A proportional 5/3 valve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Valve {
    /// How `--valve` calls it.
    pub id: &'static str,
    /// Maker and type.
    pub title: &'static str,
    /// Standard nominal flow, l/min, from 6 to 5 bar gauge.
    pub nominal_l_per_min: f64,
    /// Opening over the command about mid position, from 0 V up: V and part of the nominal flow.
    pub opening: &'static [[f64; 2]],
    /// Where the opening comes from.
    pub opening_origin: &'static str,
    /// Frequency at which the spool's full stroke has fallen by 3 dB, Hz.
    pub cut_off_hz: f64,
}

/// Largest hysteresis of the MPYE over its stroke (data sheet). A valve has from none to this much: half of it is expected, give
/// or take half of that.
pub const HYSTERESIS: f64 = 0.004;
/// See there.
pub const HYSTERESIS_TOLERANCE: f64 = 0.5;
/// How well a time constant follows from a data sheet's cut-off frequency: that of the full stroke is a third lower than that
/// of small strokes (Bode diagrams of the MPYE at 20 and 100 %).
pub const LAG_TOLERANCE: f64 = 0.3;
/// Command from mid position to full stroke, V (0…10 V about 5 V).
pub const STROKE_V: f64 = 5.0;
/// Tolerance of the nominal flow (data sheet).
pub const FLOW_TOLERANCE: f64 = 0.1;

/// Flow of the MPYE-5-M5-010-B from 6 to 5 bar by command: Y. Zhu, PhD thesis, Vanderbilt University 2006, table 2-2 (facts of
/// Festo's catalogue). Of its forty points those are left out that lie on straight lines to within 1 %.
const M5: &[[f64; 2]] = &[
    [0.0, 0.0],
    [0.375, 0.0044],
    [0.5, 0.0175],
    [0.625, 0.0351],
    [0.75, 0.0789],
    [1.0, 0.1404],
    [1.5, 0.2763],
    [2.0, 0.4298],
    [2.25, 0.5],
    [2.5, 0.5482],
    [3.0, 0.6579],
    [3.5, 0.7588],
    [4.0, 0.8509],
    [4.5, 0.9474],
    [4.875, 1.0],
];

/// Flow of the MPYE-5-1/4 by command, digitised from Festo's catalogue, its current as a command of ±5 V.
const QUARTER: &[[f64; 2]] = &[
    [0.0, 0.0],
    [0.3604, 0.010246],
    [0.7055, 0.030738],
    [0.9356, 0.061475],
    [1.204, 0.107582],
    [1.4341, 0.179303],
    [1.6641, 0.255902],
    [1.8558, 0.3125],
    [2.1242, 0.39959],
    [2.4693, 0.476926],
    [2.8144, 0.589139],
    [3.1595, 0.671107],
    [3.4662, 0.742828],
    [4.1948, 0.901639],
    [4.6166, 0.983607],
    [5.0, 1.0],
];

const DIGITISED: &str = "data sheet, digitised";
const OF_THE_QUARTER: &str = "typical: curve of the MPYE-5-1/4";

/// The valves known by name.
pub const VALVES: [Valve; 5] = [
    Valve {
        id: "mpye-5-m5",
        title: "Festo MPYE-5-M5-010-B",
        nominal_l_per_min: 100.0,
        opening: M5,
        opening_origin: "data sheet, by Zhu 2006, table 2-2",
        cut_off_hz: 115.0,
    },
    Valve {
        id: "mpye-5-1/8-lf",
        title: "Festo MPYE-5-1/8-LF-010-B",
        nominal_l_per_min: 350.0,
        opening: QUARTER,
        opening_origin: OF_THE_QUARTER,
        cut_off_hz: 95.0,
    },
    Valve {
        id: "mpye-5-1/8-hf",
        title: "Festo MPYE-5-1/8-HF-010-B",
        nominal_l_per_min: 700.0,
        opening: QUARTER,
        opening_origin: OF_THE_QUARTER,
        cut_off_hz: 95.0,
    },
    Valve {
        id: "mpye-5-1/4",
        title: "Festo MPYE-5-1/4-010-B",
        nominal_l_per_min: 1400.0,
        opening: QUARTER,
        opening_origin: DIGITISED,
        cut_off_hz: 80.0,
    },
    Valve {
        id: "mpye-5-3/8",
        title: "Festo MPYE-5-3/8-010-B",
        nominal_l_per_min: 2000.0,
        opening: QUARTER,
        opening_origin: OF_THE_QUARTER,
        cut_off_hz: 70.0,
    },
];

/// Sonic conductance in m3/(s Pa) of a path that lets the standard nominal flow in l/min pass from 6 to 5 bar gauge, by ISO
/// 6358 at its critical ratio.
#[must_use]
pub fn conductance_of_flow(l_per_min: f64, critical_ratio: f64) -> f64 {
    let (up, down) = (7.0e5, 6.0e5);
    let fraction = (down / up - critical_ratio) / (1.0 - critical_ratio);
    l_per_min * 1.0e-3 / 60.0 / (up * (1.0 - fraction * fraction).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_valve_of_1400_l_per_min_has_a_conductance_of_5_and_a_half_litres_per_second_and_bar() {
        let litres = conductance_of_flow(1400.0, 0.3) * 1.0e8;
        assert!((litres - 5.5).abs() < 0.05, "{litres}");
    }

    #[test]
    fn every_curve_fits_into_a_table_on_both_sides() {
        for valve in VALVES {
            let mirrored: Vec<[f64; 2]> =
                valve.opening[1..].iter().rev().map(|[u, f]| [-u, -f]).chain(valve.opening.iter().copied()).collect();
            assert!(plant_model::OpeningTable::new(&mirrored).is_ok(), "{}", valve.id);
        }
    }
}
