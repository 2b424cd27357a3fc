//! The fixed-point path against its f64 twin, over the whole input space.

use super::{blend_v, output, position_range, quantity};
use crate::{AdcCode, Config, ControllerState, Inputs, Mode, Parameters, Position, step};
use proptest::prelude::*;

/// Runs the fixed-point controller for one armed tick; the pressures are healthy.
fn fixed(config: &Config, reference: Position, position: u16) -> crate::Outputs {
    let mut state = ControllerState::armed();
    let healthy = AdcCode(u16::MAX / 2);
    let inputs = Inputs {
        reference,
        position: AdcCode(position),
        pressure_a: healthy,
        pressure_b: healthy,
        supply: Some(healthy),
        ..Inputs::default()
    };
    step(config, &mut state, inputs)
}

/// Parameters over the whole space that the checks let through, at most a few refused.
fn any_parameters() -> impl Strategy<Value = Parameters> {
    let converters = (-3.9_f32..3.8, 0.02_f32..7.8, 8_u8..=16, 1.0_f32..100.0, 1.0_f32..100.0, 8_u8..=16);
    let law = (prop_oneof![0.0_f32..20.0, 0.0_f32..10_000.0], prop::option::of(1.0_f32..100.0), 0.1_f32..100.0);
    let zone = (-1.0_f32..1.0, prop_oneof![1 => Just(0.0), 3 => 0.0_f32..1.0], 0.05_f32..20.0, 0.05_f32..20.0);
    let calibration = prop_oneof![Just((0.0_f32, 1.0_f32)), (-1.0_f32..1.0, 0.5_f32..1.0)];
    (converters, law, zone, calibration).prop_map(|(c, l, z, calibration)| {
        let mut p = Parameters {
            // Inside what the range may be.
            position_offset_m: (calibration.0 * 3.9 * (1.0 - calibration.1)).clamp(-1.0, 1.0),
            position_gain: calibration.1,
            position_range_m: [c.0, (c.0 + c.1).min(3.9)],
            adc_bits: c.2,
            valve_range_v: [-c.3, c.4],
            dac_bits: c.5,
            gain_v_per_m: l.0,
            max_voltage_v: l.2,
            slope_right: z.2,
            slope_left: z.3,
            ..Parameters::default()
        };
        let reach = l.2.min(c.3).min(c.4);
        p.dead_zone_left_v = reach * z.0;
        p.dead_zone_right_v = reach * (z.0 + z.1).min(1.0);
        // from the narrowest band allowed to a hundred times that, or the default
        let [low, high] = position_range(&p);
        let code_m = (high - low) as f32 / ((1_u32 << c.2) - 1) as f32;
        if z.1 > 0.0 {
            p.gain_v_per_m = p.gain_v_per_m.min(0.49 / code_m);
        }
        p.dead_zone_blend_v = l.1.map(|k| ((p.gain_v_per_m * code_m).max(5.0e-4) * 1.0001 * k).min(1.0));
        p
    })
}

/// What a real positioner has: sensors of 0.1 … 2 m, at least 10 bits, ±5 … ±12 V, dead zone below 1 V.
fn realistic_parameters() -> impl Strategy<Value = Parameters> {
    let converters = (0.1_f32..2.0, 10_u8..=16, 5.0_f32..12.0, 10_u8..=14);
    let law = 0.5_f32..200.0;
    let zone = (-1.0_f32..0.0, 0.0_f32..1.0, 0.5_f32..2.0, 0.5_f32..2.0);
    let calibration = (-0.05_f32..0.05, 0.95_f32..1.05);
    (converters, law, zone, calibration).prop_map(|(c, gain, z, calibration)| Parameters {
        position_offset_m: calibration.0,
        position_gain: calibration.1,
        position_range_m: [-c.0 / 2.0, c.0 / 2.0],
        adc_bits: c.1,
        valve_range_v: [-c.2, c.2],
        max_voltage_v: c.2,
        dac_bits: c.3,
        gain_v_per_m: gain,
        dead_zone_left_v: z.0,
        dead_zone_right_v: z.1,
        slope_right: z.2,
        slope_left: z.3,
        ..Parameters::default()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(20_000) })]

    /// The error of every stage, carried through the following ones, bounds the difference in DAC codes: half a unit of
    /// position and reference, times the gain; half a unit of voltage; times the inverse's slope; half a code of rounding.
    #[test]
    fn fixed_point_stays_within_the_summed_rounding_of_its_formats(
        p in any_parameters(), code in any::<u16>(), reference in 0.0_f64..1.0,
    ) {
        let config = Config::from_parameters(&p);
        prop_assume!(config.is_ok());
        let config = config.unwrap();
        let code = 1 + code % ((1_u32 << p.adc_bits) - 2) as u16; // the first reading at a rail is not believed
        let [lo, hi] = position_range(&p);
        let reference = Position::saturating_from_num(lo + reference * (hi - lo));
        let outputs = fixed(&config, reference, code);
        let twin = output(&p, reference.to_num(), code);
        let steepest = twin.slope.max(1.0 / f64::from(p.slope_right)).max(1.0 / f64::from(p.slope_left));
        let unit_m = 2.0_f64.powi(-28);
        let unit_v = 2.0_f64.powi(-24);
        // gain and slopes are rounded to 2^-17 themselves, the break-points to 2^-25 V
        let gain = f64::from(p.gain_v_per_m);
        let w_error = gain * unit_m + (hi - lo) * 2.0_f64.powi(-17) + unit_v;
        // a w on the other side of the band's edge sees the other slope: the curve is continuous, so the steeper bounds it
        let band = (f64::from(p.dead_zone_right_v) - f64::from(p.dead_zone_left_v)) / 2.0 / blend_v(&p) + 20.0;
        let slope = if twin.w_v.abs() < blend_v(&p) + w_error { band.max(steepest) } else { steepest };
        let u_error = w_error * slope + twin.w_v.abs() * 2.0_f64.powi(-17) + 4.0 * unit_v;
        let [v_lo, v_hi] = p.valve_range_v.map(f64::from);
        let codes_per_volt = f64::from((1_u32 << p.dac_bits) - 1) / (v_hi - v_lo);
        let u: f64 = outputs.telemetry.u.to_num();
        prop_assert!((u - twin.u_v).abs() <= u_error, "u {u} against {} ± {u_error}", twin.u_v);
        let bound = u_error * codes_per_volt + 0.501;
        prop_assert!(
            (f64::from(outputs.dac.0) - twin.code).abs() <= bound,
            "code {} against {} ± {bound}", outputs.dac.0, twin.code
        );
    }

    #[test]
    fn on_a_realistic_rig_the_dac_code_is_the_twins_or_its_neighbour(
        p in realistic_parameters(), code in 1_u16..1023, scale in any::<bool>(), reference in 0.0_f64..1.0,
    ) {
        let config = Config::from_parameters(&p).unwrap();
        let code = if scale { code << (p.adc_bits - 10) } else { code };
        let [lo, hi] = position_range(&p);
        let reference = Position::from_num(lo + reference * (hi - lo));
        let outputs = fixed(&config, reference, code);
        prop_assert_eq!(outputs.mode, Mode::Run);
        let twin = output(&p, reference.to_num(), code);
        prop_assert!((f64::from(outputs.dac.0) - twin.code).abs() < 1.0, "{} against {}", outputs.dac.0, twin.code);
    }
}

#[test]
fn for_the_paper_rig_every_position_code_gives_the_twins_dac_code_or_its_neighbour() {
    for dead_zone in [0.0_f32, 0.42] {
        for gain_v_per_m in [4.0_f32, 40.0] {
            let p = Parameters {
                gain_v_per_m,
                dead_zone_right_v: dead_zone,
                dead_zone_left_v: -dead_zone,
                ..Parameters::default()
            };
            let config = Config::from_parameters(&p).unwrap();
            let (mut worst, mut different) = (0.0_f64, 0_u32);
            for reference in [-0.5_f64, -0.1, 0.0, 0.045, 0.45] {
                let reference = Position::from_num(reference);
                for code in 1..u16::MAX {
                    let outputs = fixed(&config, reference, code);
                    let twin = output(&p, reference.to_num(), code);
                    worst = worst.max((f64::from(outputs.dac.0) - twin.code).abs());
                    different += u32::from(f64::from(outputs.dac.0) != (twin.code + 0.5).floor());
                }
            }
            // Half a code is the rounding itself. The codes differ only where the twin sits next to a tie.
            assert!(worst < 0.51, "worst {worst} at gain {gain_v_per_m}, dead zone {dead_zone}");
            assert!(different < 100, "{different} of 327,670 at gain {gain_v_per_m}, dead zone {dead_zone}");
        }
    }
}

#[test]
fn every_pressure_code_reads_within_two_units_of_the_twin() {
    let p = Parameters::default();
    let config = Config::from_parameters(&p).unwrap();
    for code in 0..=u16::MAX {
        let reading: f64 = config.scales()[1].pressure(AdcCode(code)).to_num();
        assert!((reading - quantity(p.pressure_range_pa.map(f64::from), 16, code)).abs() < 2.0 / 256.0, "code {code}");
    }
}
