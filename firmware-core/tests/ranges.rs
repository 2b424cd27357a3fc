//! What `board parameters` lists is what the board takes: both ends of every range, and nothing beyond.

use board_link::{Parameter, ParameterError};
use firmware_core::Settings;

/// Settings in which `parameter` is `value`, and whatever depends on it makes room for it.
fn with(parameter: Parameter, value: f32) -> Settings {
    use Parameter as P;
    let widest = |low: P, high: P| [(low, low.info().limits.low as f32), (high, high.info().limits.high as f32)];
    let positions = widest(P::PositionLow, P::PositionHigh);
    let pressures = widest(P::PressureLow, P::PressureHigh);
    let believable = widest(P::PressureLimitLow, P::PressureLimitHigh);
    let valve = widest(P::ValveLow, P::ValveHigh);
    let zone = [(P::DeadZoneRight, value), (P::DeadZoneLeft, value), (P::MaxVoltage, 100.0)];
    let others = match parameter {
        P::PositionLow | P::PositionHigh => {
            [&positions[..], &[(P::SetpointLow, value), (P::SetpointHigh, value)]].concat()
        }
        P::SetpointLow | P::SetpointHigh => {
            [&positions[..], &[(P::SetpointLow, value), (P::SetpointHigh, value)]].concat()
        }
        P::PositionMargin => positions.to_vec(),
        P::PressureLow | P::PressureHigh => pressures.to_vec(),
        P::PressureLimitLow | P::PressureLimitHigh => believable.to_vec(),
        P::ValveLow | P::ValveHigh | P::DeadZoneRight | P::DeadZoneLeft => [&valve[..], &zone].concat(),
        P::MonitorHorizon => vec![(P::TickHz, 10_000.0)],
        P::SupplyPressure => vec![(P::Atmosphere, 1.0e3)],
        P::Atmosphere => vec![(P::SupplyPressure, 1.0e8)],
        P::BristleStiffness => vec![(P::Breakaway, 0.0)],
        P::Coulomb => vec![(P::StaticFriction, 1.0e6), (P::Breakaway, 0.0)],
        P::StaticFriction => vec![(P::Coulomb, 1.0e-6), (P::Breakaway, 0.0)],
        P::Breakaway => vec![(P::BristleStiffness, 1.0)],
        P::PositionOffset => vec![(P::SetpointLow, value), (P::SetpointHigh, value)],
        P::PositionGain => vec![(P::SetpointLow, 0.0), (P::SetpointHigh, 0.0)],
        // One flow law, stated whole.
        P::FillCoefficient | P::ExhaustCoefficient if value == 0.0 => vec![
            (P::FillCoefficient, 0.0),
            (P::ExhaustCoefficient, 0.0),
            (P::FillConductance, 2.0e-8),
            (P::ExhaustConductance, 2.0e-8),
        ],
        P::FillConductance | P::ExhaustConductance if value > 0.0 => vec![
            (P::FillCoefficient, 0.0),
            (P::ExhaustCoefficient, 0.0),
            (P::FillConductance, 2.0e-8),
            (P::ExhaustConductance, 2.0e-8),
        ],
        // The monitor follows a hose for 30 ticks only.
        P::HoseALength | P::HoseADiameter if value > 0.0 => {
            vec![(P::HoseALength, 1.0), (P::HoseADiameter, 0.004), (P::Monitor, 0.0)]
        }
        P::HoseBLength | P::HoseBDiameter if value > 0.0 => {
            vec![(P::HoseBLength, 1.0), (P::HoseBDiameter, 0.004), (P::Monitor, 0.0)]
        }
        P::CushionALength | P::CushionAConductance if value > 0.0 => {
            vec![(P::CushionALength, 0.1), (P::CushionAConductance, 1.0e-9), (P::Stroke, 4.0)]
        }
        P::CushionBLength | P::CushionBConductance if value > 0.0 => {
            vec![(P::CushionBLength, 0.1), (P::CushionBConductance, 1.0e-9), (P::Stroke, 4.0)]
        }
        _ => Vec::new(),
    };
    let mut settings = Settings::default();
    for (other, value) in others.into_iter().chain([(parameter, value)]) {
        assert_eq!(settings.set(other, value), Ok(()), "{} = {value}", other.name());
    }
    settings
}

#[test]
fn a_board_takes_both_ends_of_every_range_that_it_lists() {
    for parameter in Parameter::ALL {
        let limits = parameter.info().limits;
        for end in [limits.low, limits.high] {
            assert_eq!(with(parameter, end as f32).check(), Ok(()), "{} = {end}", parameter.name());
        }
        if limits.optional {
            assert_eq!(with(parameter, 0.0).check(), Ok(()), "{} = 0", parameter.name());
        }
    }
}

#[test]
fn a_board_takes_nothing_beyond_the_ranges_that_it_lists() {
    for parameter in Parameter::ALL {
        let limits = parameter.info().limits;
        let step = 1.0e-6 * (limits.low.abs() + limits.high.abs());
        for beyond in [limits.low - step, limits.high + step, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let refused = Settings::default().set(parameter, beyond as f32);
            assert_eq!(refused, Err(ParameterError::Range), "{} = {beyond}", parameter.name());
        }
    }
}

#[test]
fn the_valve_that_the_board_compensates_is_one_that_the_rig_can_have() {
    use plant_model::Place;
    // The monitor allows for any lag of the spool, whatever its order, and for an opening that is off by more than corners, edges
    // and curves between points come to. The law inverts a curve of its own.
    let shapes = [Place::spool_inertia, Place::corner_rounding_v, Place::exhaust_overlap_v, Place::opening_smoothness]
        .map(Place::key);
    for key in plant_model::RIG_KEYS.iter().filter(|key| key.table == "valve" && !shapes.contains(key)) {
        let both = key.both_sides().unwrap_or(key);
        let Some(parameter) = Parameter::from_name(both.name) else { panic!("{} cannot be set", key.path) };
        let limits = parameter.info().limits;
        assert!(key.limits.low <= limits.low && limits.high <= key.limits.high, "{}", key.path);
    }
}
