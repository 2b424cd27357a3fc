//! Parameters → the fixed-point numbers of the tick, checked and with every division done beforehand.
//!
//! This runs outside the tick, on the desktop and on the board; the tick uses no floats.

use crate::arithmetic::{bits, fixed, scaled};
use crate::config_error::{ConfigError, demand};
use crate::dead_zone_inverse::DeadZoneInverse;
use crate::frozen::{FreezeLimits, LEAST_CODES, OBSTACLE_PA};
use crate::law::Law;
use crate::parameters::{Key, LawChoice, Parameters, acceleration_range};
use crate::plausibility::{AirStep, ChannelLimits, GLITCH_WEIGHT};
use crate::quantities::{Position, Pressure, Velocity, Voltage};
use crate::scales::{AdcScale, DacScale, EXTRA_BITS};
use crate::servo::learned::{Learned, Quantities, Quantity};
use crate::servo::{ServoState, Tuning};
use crate::setpoint::{Motion, SetpointLimits, Smooth};
use parameter_table::{Limits, Must};

/// What the tick needs, precomputed.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    pub(crate) position: ChannelLimits,
    pub(crate) pressure_a: ChannelLimits,
    pub(crate) pressure_b: ChannelLimits,
    pub(crate) supply: ChannelLimits,
    /// Of chambers A and B, where the positioning law knows the rig.
    pub(crate) air_steps: Option<[AirStep; 2]>,
    pub(crate) freeze: FreezeLimits,
    pub(crate) supply_sensor: bool,
    pub(crate) pressure_sensors: bool,
    pub(crate) pressure_loss_trips: bool,
    pub(crate) position_rail_is_fault: bool,
    pub(crate) setpoint: SetpointLimits,
    pub(crate) law: Law,
    /// The positioning law, where it drives the valve.
    pub(crate) servo: Option<Tuning>,
    pub(crate) inverse: DeadZoneInverse,
    pub(crate) dac: DacScale,
    pub(crate) safe_voltage: Voltage,
    /// Ticks of the controlled stop.
    pub(crate) stop_ticks: u16,
    pub(crate) supply_minimum: Pressure,
    pub(crate) glitch_ticks: u16,
    pub(crate) timing_limit: u16,
    pub(crate) self_test_ticks: u32,
    pub(crate) command_time_out_ticks: u32,
}

/// Whether a value lies in a range that was computed. In f32, so that a limit typed as the value is accepted.
fn within(value: f32, low: f64, high: f64) -> bool {
    value >= low as f32 && value <= high as f32
}

/// The smallest number of ticks not shorter than `time_s`.
fn ticks(time_s: f64, tick_hz: f64) -> u32 {
    let exact = time_s * tick_hz;
    // A relative hair less than exact, so that 0.005 s (as f32) at 1000 Hz is 5 ticks and not 6.
    let ticks = (exact * (1.0 - 1.0e-6)) as u32;
    ticks.saturating_add(1)
}

impl Config {
    /// Checks the parameters and computes the numbers of the tick.
    ///
    /// # Errors
    /// The first parameter that is not finite, out of range or inconsistent with another.
    pub fn from_parameters(p: &Parameters) -> Result<Self, ConfigError> {
        p.check_ranges()?;
        p.check_calibration()?;
        let tick_hz = f64::from(p.tick_hz);
        let [adc_max, dac_max] = [p.adc_bits, p.dac_bits].map(|bits| ((1_u32 << bits) - 1) as u16);
        let glitch_ticks = ticks(f64::from(p.glitch_time_s), tick_hz).max(1) as u16;
        let glitch_limit = glitch_ticks * GLITCH_WEIGHT;
        let stuck_ticks = ticks(f64::from(p.stuck_time_s), tick_hz).max(15) as u16;

        let [positions, pressures @ ..] = p.calibrated_ranges();
        let margin = f64::from(p.position_margin_m);
        demand(
            within(p.position_margin_m, 0.0, (positions[1] - positions[0]) / 4.0),
            Key::position_margin_m,
            margin,
            "be at most a quarter of position_range_m (metres)",
        )?;
        let position = channel(
            positions,
            adc_max,
            Position::FRAC_NBITS,
            [positions[0] + margin, positions[1] - margin],
            [f64::from(p.position_rate_m_per_s) / tick_hz, f64::from(p.position_noise_m)],
            [glitch_limit, stuck_ticks],
        );
        let [pressure_a, pressure_b, supply] = pressures.map(|ends| {
            channel(
                ends,
                adc_max,
                Pressure::FRAC_NBITS,
                p.pressure_limits_pa.map(f64::from),
                [f64::from(p.pressure_rate_pa_per_s) / tick_hz, f64::from(p.pressure_noise_pa)],
                [glitch_limit, stuck_ticks],
            )
        });

        let gain = f64::from(p.gain_v_per_m);
        let (inverse, dac, safe_voltage) =
            output(p, dac_max, gain, (positions[1] - positions[0]) / f64::from(adc_max))?;
        let command_time_out_ticks = p.command_time_out_s.map_or(u32::MAX, |time| ticks(f64::from(time), tick_hz));
        let setpoint = setpoint(p, positions, tick_hz)?;
        // Without the positioning law nothing knows how force answers to the valve, and without pressures none is known.
        let equalises = p.law == LawChoice::Servo && p.pressure_sensors && p.stop_time_s > 0.0;
        let stop_ticks = if equalises { ticks(f64::from(p.stop_time_s), tick_hz) as u16 } else { 0 };
        Ok(Self {
            freeze: freeze(&setpoint, positions, adc_max, p.tick_hz, stuck_ticks),
            position,
            pressure_a,
            pressure_b,
            supply,
            air_steps: (p.law == LawChoice::Servo).then(|| AirStep::of(p)),
            supply_sensor: p.supply_sensor,
            pressure_sensors: p.pressure_sensors,
            // The paper's law has no model to go by.
            pressure_loss_trips: p.pressure_loss_trips || p.law == LawChoice::Paper,
            position_rail_is_fault: margin > 0.0,
            setpoint,
            law: Law { gain: fixed(gain) },
            servo: match p.law {
                LawChoice::Paper => None,
                LawChoice::Servo => Some(Tuning::new(p, &inverse)?),
            },
            inverse,
            dac,
            safe_voltage,
            stop_ticks,
            supply_minimum: fixed(f64::from(p.supply_minimum_pa)),
            glitch_ticks,
            timing_limit: u16::from(p.timing_fault_ticks.max(1)) * GLITCH_WEIGHT,
            self_test_ticks: ticks(f64::from(p.self_test_time_s), tick_hz),
            command_time_out_ticks,
        })
    }

    /// The DAC code of the safe voltage: what the shell writes before the first tick and after the last.
    #[must_use]
    pub fn safe_code(&self) -> crate::DacCode {
        self.dac.code(self.safe_voltage)
    }

    /// Nominal values of what the positioning law learns. `None` under the paper's law, which learns nothing.
    #[must_use]
    pub fn nominal(&self) -> Option<Learned> {
        self.servo.as_ref().map(Tuning::nominal)
    }

    /// What the positioning law has learned, or what its first run would begin with. `None` under the paper's law.
    #[inline]
    #[must_use]
    pub fn learned(&self, state: &ServoState) -> Option<Learned> {
        self.servo.as_ref().map(|servo| servo.learned(state))
    }

    /// Lets the positioning law's first run begin with values learned before, at the tick rate of this configuration. Under the
    /// paper's law nothing changes.
    ///
    /// # Errors
    /// The first quantity beyond the limits of learning; nothing has changed then.
    pub fn start_from(&mut self, values: &Quantities, tick_hz: u32) -> Result<(), Quantity> {
        self.servo.as_mut().map_or(Ok(()), |servo| servo.start_from(values, tick_hz))
    }

    /// Code → position, p_a, p_b, p_sup: the scales of the sensors, for shells that display quantities.
    #[must_use]
    pub fn scales(&self) -> [&AdcScale; 4] {
        [&self.position.scale, &self.pressure_a.scale, &self.pressure_b.scale, &self.supply.scale]
    }

    /// The limits of the reference.
    #[must_use]
    pub fn setpoint_limits(&self) -> &SetpointLimits {
        &self.setpoint
    }

    /// Valve voltage → code.
    #[must_use]
    pub fn dac_scale(&self) -> &DacScale {
        &self.dac
    }
}

fn channel(
    ends: [f64; 2],
    adc_max: u16,
    fraction: u32,
    believable: [f64; 2],
    [step, noise]: [f64; 2],
    [glitch_limit, stuck_ticks]: [u16; 2],
) -> ChannelLimits {
    let quantity = |value: f64| bits(value, fraction);
    let scale = AdcScale {
        lowest: quantity(ends[0]),
        width: scaled((ends[1] - ends[0]) / f64::from(adc_max), fraction + EXTRA_BITS),
        max_code: adc_max,
    };
    ChannelLimits {
        scale,
        low: quantity(believable[0]),
        // The highest code may read one unit of the format below the end of the range, never above by more than that.
        high: quantity(believable[1]).saturating_add(1),
        step: quantity(step).max(1),
        noise: quantity(noise),
        glitch_limit,
        stuck_ticks,
    }
}

/// Speed below which a freeze is not noticed, m/s.
const BRISK_M_PER_S: f64 = 0.05;

fn freeze(setpoint: &SetpointLimits, sensor: [f64; 2], adc_max: u16, tick_hz: u32, stuck_ticks: u16) -> FreezeLimits {
    let codes_per_m = f64::from(adc_max) / (sensor[1] - sensor[0]);
    let spacing_ticks = (tick_hz / 1000).max(1);
    // The history spans from three to four samples, depending on when in between the freeze begins.
    let span_s = 3.0 * f64::from(spacing_ticks) / f64::from(tick_hz);
    let travel_codes = (BRISK_M_PER_S * span_s * codes_per_m) as u16;
    let code = |position: f64| ((position - sensor[0]) * codes_per_m).clamp(0.0, f64::from(adc_max)) as u16;
    let (low, high) = (setpoint.low.to_num::<f64>(), setpoint.high.to_num::<f64>());
    let margin = 0.01 * (high - low);
    FreezeLimits {
        spacing_ticks: spacing_ticks as u16,
        travel_codes: travel_codes.max(LEAST_CODES),
        freeze_ticks: stuck_ticks,
        obstacle: OBSTACLE_PA << Pressure::FRAC_NBITS,
        low: code(low + margin),
        high: code(high - margin),
    }
}

fn setpoint(p: &Parameters, sensor: [f64; 2], tick_hz: f64) -> Result<SetpointLimits, ConfigError> {
    let [low, high] = p.setpoint_range_m.map_or(sensor, |ends| ends.map(f64::from));
    for end in p.setpoint_range_m.iter().flatten() {
        demand(
            within(*end, sensor[0], sensor[1]),
            Key::setpoint_range_m,
            f64::from(*end),
            "be two positions inside position_range_m",
        )?;
    }
    let max_velocity = p.setpoint_velocity_m_per_s.map(f64::from);
    let motion = match (p.setpoint_acceleration_m_per_s2, max_velocity) {
        (None, None) => Motion::Step,
        (None, Some(velocity)) => Motion::Ramp { step_q56: scaled(velocity / tick_hz, 56) },
        (Some(a), velocity) => {
            let fastest = Key::setpoint_velocity_m_per_s.row().limits.high;
            let key = Key::setpoint_acceleration_m_per_s2;
            let [low, high] = acceleration_range(p.tick_hz);
            let acceleration = f64::from(a);
            demand(within(a, low, high), key, acceleration, Must::FitNow(Limits { low, high, ..key.row().limits }))?;
            let velocity_step: Velocity = fixed(acceleration / tick_hz);
            // What the rounded velocity step amounts to, less the rounding of the tick: the braking curve must never
            // promise more than the steps can do.
            let braking = velocity_step.to_num::<f64>() * tick_hz * (1.0 - 2.0e-6);
            Motion::Smooth(Smooth {
                max_velocity: fixed(velocity.unwrap_or(fastest)),
                velocity_step,
                two_acceleration_q16: (2.0 * braking * 65_536.0) as u32,
                landing_q56: scaled(braking / (tick_hz * tick_hz), 56),
                tick_q32: scaled(1.0 / tick_hz, 32) as u32,
                tick_hz: p.tick_hz,
            })
        }
    };
    Ok(SetpointLimits { low: fixed(low), high: fixed(high), motion })
}

fn output(
    p: &Parameters,
    dac_max: u16,
    gain: f64,
    position_code: f64,
) -> Result<(DeadZoneInverse, DacScale, Voltage), ConfigError> {
    let [lo, hi] = p.valve_range_v.map(f64::from);
    let max_voltage = f64::from(p.max_voltage_v);
    let (lowest, highest) = (lo.max(-max_voltage), hi.min(max_voltage));
    demand(
        lowest <= highest,
        Key::max_voltage_v,
        max_voltage,
        "leave a part of valve_range_v (a voltage within ± this value must be in the range)",
    )?;
    let inside = |key, voltage: f32| {
        let met = within(voltage, lowest, highest);
        demand(met, key, f64::from(voltage), "be inside both ±max_voltage_v and valve_range_v (volts)")?;
        Ok::<f64, ConfigError>(f64::from(voltage))
    };
    let right = inside(Key::dead_zone_right_v, p.dead_zone_right_v)?;
    let left = inside(Key::dead_zone_left_v, p.dead_zone_left_v)?;
    demand(left <= right, Key::dead_zone_left_v, left, "not be greater than dead_zone_right_v (exchange the two)")?;
    let [slope_right, slope_left] = [p.slope_right, p.slope_left].map(f64::from);
    // One code of noise must not cross the dead zone; without a dead zone the band has no effect.
    let narrowest = Key::dead_zone_blend_v.row().limits.low;
    let least = if left < right { (gain * position_code).max(narrowest) } else { narrowest };
    demand(
        least <= 0.5,
        Key::gain_v_per_m,
        gain,
        "not turn one code of the position into more than 0.5 V, or the dead zone cannot be compensated (lower the gain or \
         narrow position_range_m)",
    )?;
    let blend = p.dead_zone_blend_v.map_or(((hi - lo) / f64::from(dac_max)).max(2.0 * least), f64::from);
    demand(
        p.dead_zone_blend_v.is_none_or(|given| within(given, least, f64::INFINITY)),
        Key::dead_zone_blend_v,
        blend,
        "be at least gain_v_per_m times one code of the position (volts), or absent",
    )?;
    let centre = 0.5 * (right + left);
    // At most (100 V / 0.5 mV + 20): beyond I16F16.
    let rise_right = (right - centre) / blend + 1.0 / slope_right;
    let rise_left = (centre - left) / blend + 1.0 / slope_left;
    demand(
        rise_right.max(rise_left) <= 30_000.0,
        Key::dead_zone_blend_v,
        blend,
        "be at least 1/60000 of the dead zone's width (volts)",
    )?;
    let safe = p.safe_voltage_v.map_or(Ok(centre), |voltage| inside(Key::safe_voltage_v, voltage))?;
    let inverse = DeadZoneInverse {
        right: fixed(right),
        left: fixed(left),
        centre: fixed(centre),
        blend: fixed(blend),
        per_slope_right: fixed(1.0 / slope_right),
        per_slope_left: fixed(1.0 / slope_left),
        blend_slope_right: fixed(rise_right),
        blend_slope_left: fixed(rise_left),
        lowest: fixed(lowest),
        highest: fixed(highest),
    };
    let dac = DacScale {
        lowest: fixed(lo),
        highest: fixed(hi),
        codes_per_volt_q16: scaled(f64::from(dac_max) / (hi - lo), 16) as u32,
        max_code: dac_max,
    };
    Ok((inverse, dac, fixed(safe)))
}
