//! Parameters → the fixed-point numbers of the tick, checked and with every division done beforehand.
//!
//! This runs outside the tick, on the desktop and on the board; it is the only part of the crate that uses floats.

use crate::codes::DacScale;
use crate::dead_zone_inverse::DeadZoneInverse;
use crate::frozen::{FreezeLimits, LEAST_CODES, OBSTACLE_PA};
use crate::law::Law;
use crate::parameters::Parameters;
use crate::plausibility::{ChannelLimits, GLITCH_WEIGHT};
use crate::quantities::{AdcScale, EXTRA_BITS, Position, Pressure, Velocity, Voltage};
use crate::setpoint::{Motion, SetpointLimits, Smooth};

/// What the tick needs, precomputed.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    pub(crate) position: ChannelLimits,
    pub(crate) pressure: ChannelLimits,
    pub(crate) freeze: FreezeLimits,
    pub(crate) supply_sensor: bool,
    pub(crate) position_rail_is_fault: bool,
    pub(crate) setpoint: SetpointLimits,
    pub(crate) law: Law,
    pub(crate) inverse: DeadZoneInverse,
    pub(crate) dac: DacScale,
    pub(crate) safe_voltage: Voltage,
    pub(crate) supply_minimum: Pressure,
    pub(crate) glitch_ticks: u16,
    pub(crate) timing_limit: u16,
    pub(crate) self_test_ticks: u32,
    pub(crate) command_time_out_ticks: u32,
}

/// Which parameter is wrong, and what it must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfigError {
    /// The parameter's key.
    pub key: &'static str,
    /// The value found.
    pub value: f64,
    /// What would be accepted, as the end of the sentence "must …".
    pub must: &'static str,
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} = {} must {}", self.key, self.value, self.must)
    }
}

impl core::error::Error for ConfigError {}

fn within(key: &'static str, value: f32, low: f64, high: f64, must: &'static str) -> Result<f64, ConfigError> {
    // In f32, so that a limit typed as the value is accepted: 3.9 as f32 is a hair above 3.9 as f64.
    if value >= low as f32 && value <= high as f32 {
        Ok(f64::from(value))
    } else {
        Err(ConfigError { key, value: f64::from(value), must })
    }
}

fn range(
    key: &'static str,
    ends: [f32; 2],
    low: f64,
    high: f64,
    apart: f64,
    must: &'static str,
) -> Result<[f64; 2], ConfigError> {
    let [a, b] = [within(key, ends[0], low, high, must)?, within(key, ends[1], low, high, must)?];
    if b - a >= apart { Ok([a, b]) } else { Err(ConfigError { key, value: b, must }) }
}

/// `value · 2^bits`, rounded to nearest; the caller's range check keeps it inside the result's type.
fn scaled(value: f64, bits: u32) -> i64 {
    let scaled = value * (1_u64 << bits) as f64;
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i64
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
        let tick_hz = f64::from(p.tick_hz);
        if !(50..=20_000).contains(&p.tick_hz) {
            return Err(ConfigError { key: "tick_hz", value: tick_hz, must: "be from 50 to 20000 (ticks per second)" });
        }
        let adc_max = max_code("adc_bits", p.adc_bits)?;
        let dac_max = max_code("dac_bits", p.dac_bits)?;
        let glitch_time = within("glitch_time_s", p.glitch_time_s, 0.0, 0.1, "be from 0 to 0.1 (seconds)")?;
        let stuck_time = within("stuck_time_s", p.stuck_time_s, 0.0, 1.0, "be from 0 to 1 (seconds)")?;
        let self_test_time = within("self_test_time_s", p.self_test_time_s, 0.0, 60.0, "be from 0 to 60 (seconds)")?;
        let glitch_ticks = ticks(glitch_time, tick_hz).max(1) as u16;
        let glitch_limit = glitch_ticks * GLITCH_WEIGHT;
        let stuck_ticks = ticks(stuck_time, tick_hz).max(15) as u16;

        let positions = range(
            "position_range_m",
            p.position_range_m,
            -3.9,
            3.9,
            1.0e-2,
            "be two positions within ±3.9 m, the first at least 10 mm below the second",
        )?;
        let pressures = range(
            "pressure_range_pa",
            p.pressure_range_pa,
            -8.0e6,
            8.0e6,
            1.0e3,
            "be two pressures within ±8e6 Pa, the first at least 1000 Pa below the second",
        )?;
        let believable = range(
            "pressure_limits_pa",
            p.pressure_limits_pa,
            -8.0e6,
            8.0e6,
            1.0e3,
            "be two pressures within ±8e6 Pa, the first at least 1000 Pa below the second",
        )?;
        let margin = within(
            "position_margin_m",
            p.position_margin_m,
            0.0,
            (positions[1] - positions[0]) / 4.0,
            "be from 0 to a quarter of the position range (metres)",
        )?;
        let position_rate = within(
            "position_rate_m_per_s",
            p.position_rate_m_per_s,
            1.0e-3,
            100.0,
            "be from 0.001 to 100 (metres per second)",
        )?;
        let position_noise =
            within("position_noise_m", p.position_noise_m, 0.0, 1.0, "be from 0 to 1 (metres between two samples)")?;
        let pressure_rate = within(
            "pressure_rate_pa_per_s",
            p.pressure_rate_pa_per_s,
            1.0e3,
            1.0e9,
            "be from 1e3 to 1e9 (pascals per second)",
        )?;
        let pressure_noise = within(
            "pressure_noise_pa",
            p.pressure_noise_pa,
            0.0,
            1.0e6,
            "be from 0 to 1e6 (pascals between two samples)",
        )?;
        let position = channel(
            positions,
            adc_max,
            Position::FRAC_NBITS,
            [positions[0] + margin, positions[1] - margin],
            [position_rate / tick_hz, position_noise],
            [glitch_limit, stuck_ticks],
        );
        let pressure = channel(
            pressures,
            adc_max,
            Pressure::FRAC_NBITS,
            believable,
            [pressure_rate / tick_hz, pressure_noise],
            [glitch_limit, stuck_ticks],
        );

        let gain = within("gain_v_per_m", p.gain_v_per_m, 0.0, 10_000.0, "be from 0 to 10000 (volts per metre)")?;
        let (inverse, dac, safe_voltage) =
            output(p, dac_max, gain, (positions[1] - positions[0]) / f64::from(adc_max))?;
        let supply_minimum = within(
            "supply_minimum_pa",
            p.supply_minimum_pa,
            0.0,
            8.0e6,
            "be from 0 to 8e6 (pascals absolute; 0 switches the check off)",
        )?;
        let command_time_out_ticks = match p.command_time_out_s {
            None => u32::MAX,
            Some(time) => ticks(
                within("command_time_out_s", time, 1.0e-3, 3600.0, "be from 0.001 to 3600 (seconds), or absent")?,
                tick_hz,
            ),
        };
        let setpoint = setpoint(p, positions, tick_hz)?;
        Ok(Self {
            freeze: freeze(&setpoint, positions, adc_max, p.tick_hz, stuck_ticks),
            position,
            pressure,
            supply_sensor: p.supply_sensor,
            position_rail_is_fault: margin > 0.0,
            setpoint,
            law: Law { gain_q16: scaled(gain, 16) as i32 },
            inverse,
            dac,
            safe_voltage,
            supply_minimum: Pressure::from_bits(scaled(supply_minimum, Pressure::FRAC_NBITS) as i32),
            glitch_ticks,
            timing_limit: (u16::from(p.timing_fault_ticks) + 1) * GLITCH_WEIGHT,
            self_test_ticks: ticks(self_test_time, tick_hz),
            command_time_out_ticks,
        })
    }

    /// The DAC code of the safe voltage: what the shell writes before the first tick and after the last.
    #[must_use]
    pub fn safe_code(&self) -> crate::DacCode {
        self.dac.code(self.safe_voltage)
    }

    /// Code → position, pressure: the scales of the sensors, for shells that display quantities.
    #[must_use]
    pub fn scales(&self) -> (&AdcScale, &AdcScale) {
        (&self.position.scale, &self.pressure.scale)
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

fn max_code(key: &'static str, bits: u8) -> Result<u16, ConfigError> {
    if (8..=16).contains(&bits) {
        Ok(((1_u32 << bits) - 1) as u16)
    } else {
        Err(ConfigError { key, value: f64::from(bits), must: "be from 8 to 16 (bits)" })
    }
}

fn channel(
    ends: [f64; 2],
    adc_max: u16,
    bits: u32,
    believable: [f64; 2],
    [step, noise]: [f64; 2],
    [glitch_limit, stuck_ticks]: [u16; 2],
) -> ChannelLimits {
    let quantity = |value: f64| scaled(value, bits).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
    let scale = AdcScale {
        lowest: quantity(ends[0]),
        width: scaled((ends[1] - ends[0]) / f64::from(adc_max), bits + EXTRA_BITS),
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
    let [low, high] = match p.setpoint_range_m {
        None => sensor,
        Some(ends) => range(
            "setpoint_range_m",
            ends,
            sensor[0],
            sensor[1],
            0.0,
            "be two positions inside position_range_m, the first not above the second",
        )?,
    };
    let max_velocity = match p.setpoint_velocity_m_per_s {
        None => None,
        Some(v) => Some(within(
            "setpoint_velocity_m_per_s",
            v,
            1.0e-4,
            50.0,
            "be from 0.0001 to 50 (metres per second), or absent",
        )?),
    };
    let motion = match (p.setpoint_acceleration_m_per_s2, max_velocity) {
        (None, None) => Motion::Step,
        (None, Some(velocity)) => Motion::Ramp { step_q56: scaled(velocity / tick_hz, 56) },
        (Some(a), velocity) => {
            // At least 64 units of velocity per tick, so that the acceleration is exact to one in 128; at most 50 m/s.
            let acceleration = within(
                "setpoint_acceleration_m_per_s2",
                a,
                (tick_hz * 64.0 / (1_u32 << 24) as f64).max(0.001),
                (tick_hz * 50.0).min(30_000.0),
                "be from 4e-6 tick_hz (at least 0.001) to 50 tick_hz (at most 30000) (metres per second squared), or absent",
            )?;
            let velocity_step = scaled(acceleration / tick_hz, 24);
            // What the rounded velocity step amounts to, less the rounding of the tick: the braking curve must never
            // promise more than the steps can do.
            let braking = velocity_step as f64 / (1_u32 << 24) as f64 * tick_hz * (1.0 - 2.0e-6);
            Motion::Smooth(Smooth {
                max_velocity: Velocity::from_bits(scaled(velocity.unwrap_or(50.0), 24) as i32),
                velocity_step: Velocity::from_bits(velocity_step as i32),
                two_acceleration_q16: (2.0 * braking * 65_536.0) as u32,
                landing_q56: scaled(braking / (tick_hz * tick_hz), 56),
                tick_q32: scaled(1.0 / tick_hz, 32) as u32,
                tick_hz: p.tick_hz,
            })
        }
    };
    let position = |value: f64| Position::from_bits(scaled(value, Position::FRAC_NBITS) as i32);
    Ok(SetpointLimits { low: position(low), high: position(high), motion })
}

fn output(
    p: &Parameters,
    dac_max: u16,
    gain: f64,
    position_code: f64,
) -> Result<(DeadZoneInverse, DacScale, Voltage), ConfigError> {
    let volts = |value: f64| Voltage::from_bits(scaled(value, Voltage::FRAC_NBITS) as i32);
    let q16 = |value: f64| scaled(value, 16) as i32;
    let [lo, hi] = range(
        "valve_range_v",
        p.valve_range_v,
        -100.0,
        100.0,
        1.0,
        "be two voltages within ±100 V, the first at least 1 V below the second",
    )?;
    let max_voltage =
        within("max_voltage_v", p.max_voltage_v, 0.1, 100.0, "be from 0.1 to 100 (volts about mid position)")?;
    let (lowest, highest) = (lo.max(-max_voltage), hi.min(max_voltage));
    if lowest > highest {
        return Err(ConfigError {
            key: "max_voltage_v",
            value: max_voltage,
            must: "leave a part of valve_range_v (a voltage within ± this value must be in the range)",
        });
    }
    let zone = "be inside both ±max_voltage_v and valve_range_v (volts)";
    let right = within("dead_zone_right_v", p.dead_zone_right_v, lowest, highest, zone)?;
    let left = within("dead_zone_left_v", p.dead_zone_left_v, lowest, highest, zone)?;
    if left > right {
        return Err(ConfigError {
            key: "dead_zone_left_v",
            value: left,
            must: "not be greater than dead_zone_right_v (exchange the two)",
        });
    }
    let slope_right = within("slope_right", p.slope_right, 0.05, 20.0, "be from 0.05 to 20")?;
    let slope_left = within("slope_left", p.slope_left, 0.05, 20.0, "be from 0.05 to 20")?;
    // One code of noise must not cross the dead zone; without a dead zone the band has no effect.
    let least = if left < right { (gain * position_code).max(5.0e-4) } else { 5.0e-4 };
    if least > 0.5 {
        return Err(ConfigError {
            key: "gain_v_per_m",
            value: gain,
            must: "not turn one code of the position into more than 0.5 V, or the dead zone cannot be compensated (lower \
                   the gain or narrow position_range_m)",
        });
    }
    let blend = match p.dead_zone_blend_v {
        None => ((hi - lo) / f64::from(dac_max)).max(2.0 * least),
        Some(blend) => within(
            "dead_zone_blend_v",
            blend,
            least,
            1.0,
            "be at least gain_v_per_m times one code of the position and 0.0005, and at most 1 (volts); or absent",
        )?,
    };
    let centre = 0.5 * (right + left);
    // At most (100 V / 0.5 mV + 20): beyond I16F16.
    let rise_right = (right - centre) / blend + 1.0 / slope_right;
    let rise_left = (centre - left) / blend + 1.0 / slope_left;
    if rise_right.max(rise_left) > 30_000.0 {
        return Err(ConfigError {
            key: "dead_zone_blend_v",
            value: blend,
            must: "be at least 1/60000 of the dead zone's width (volts)",
        });
    }
    let safe = match p.safe_voltage_v {
        None => centre,
        Some(voltage) => within("safe_voltage_v", voltage, lowest, highest, zone)?,
    };
    let inverse = DeadZoneInverse {
        right: volts(right),
        left: volts(left),
        centre: volts(centre),
        blend: volts(blend),
        per_slope_right_q16: q16(1.0 / slope_right),
        per_slope_left_q16: q16(1.0 / slope_left),
        blend_slope_right_q16: q16(rise_right),
        blend_slope_left_q16: q16(rise_left),
        lowest: volts(lowest),
        highest: volts(highest),
    };
    let dac = DacScale {
        lowest: volts(lo),
        highest: volts(hi),
        codes_per_volt_q16: scaled(f64::from(dac_max) / (hi - lo), 16) as u32,
        max_code: dac_max,
    };
    Ok((inverse, dac, volts(safe)))
}
