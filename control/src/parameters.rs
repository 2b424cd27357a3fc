//! The controller's parameters: physical numbers with units, as they stand in files, in flash and in commands.
//!
//! This is the only place where a key, its unit, its default, its range and its meaning are stated. What one parameter
//! demands of another is checked in [`Config::from_parameters`](crate::Config::from_parameters), also only there.

use parameter_table::{End, Field, Value, parameter_table};

/// Which law drives the valve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum LawChoice {
    /// The paper's: proportional to the error.
    #[default]
    Paper,
    /// The positioning law, which knows the rig.
    Servo,
}

impl LawChoice {
    const WORDS: &[&str] = &["paper", "servo"];

    /// As files write it.
    #[must_use]
    pub fn word(self) -> &'static str {
        Self::WORDS.get(usize::from(self as u8)).copied().unwrap_or_default()
    }
}

impl Field for LawChoice {
    fn value(&self) -> Value {
        Value::Choice(*self as u8, Self::WORDS)
    }
    fn put(&mut self, _: End, number: f32) {
        *self = if number >= 0.5 { Self::Servo } else { Self::Paper };
    }
}

parameter_table! {
    /// Everything that can be set. `Default` is the converter ranges of the rig file's defaults, the paper's law at 4 V/m, no
    /// dead zone, and plausibility limits wide enough for the paper's three cylinders.
    ///
    /// Turned into a [`Config`](crate::Config) by [`Config::from_parameters`](crate::Config::from_parameters), which checks
    /// every value.
    #[derive(Clone, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
    pub struct Parameters, keys "";

    // A control error is up to twice the range: 7.8 m in a format that ends at 8 m.
    /// Position at code 0 and at the highest code. Make the sensor's range a little wider than the stroke and set
    /// `position_margin_m`: otherwise a broken wire looks like a piston at its end stop.
    position_range_m: [f32; 2] = [-0.5, 0.5], "m", -3.9 => 3.9, apart 0.01;
    // The format of pressures ends at 8.39 MPa.
    /// Pressure at code 0 and at the highest code, absolute; the same for the three pressure channels.
    pressure_range_pa: [f32; 2] = [0.0, 1.0e6], "Pa", -8.0e6 => 8.0e6, apart 1.0e3;
    // A sensor whose calibration goes further than half or double has the wrong range.
    /// Calibration of the position: added to the reading of its range times the gain; `plant-sim board calibrate` finds both.
    position_offset_m: f32 = 0.0, "m", -1.0 => 1.0;
    /// Calibration of the position: factor on the reading of its range.
    position_gain: f32 = 1.0, "", 0.5 => 2.0;
    /// Calibration of the pressure of chamber A: added to the reading of the range times the gain.
    pressure_a_offset_pa: f32 = 0.0, "Pa", -1.0e6 => 1.0e6;
    /// Calibration of the pressure of chamber A: factor on the reading of the range.
    pressure_a_gain: f32 = 1.0, "", 0.5 => 2.0;
    /// Calibration of the pressure of chamber B: added to the reading of the range times the gain.
    pressure_b_offset_pa: f32 = 0.0, "Pa", -1.0e6 => 1.0e6;
    /// Calibration of the pressure of chamber B: factor on the reading of the range.
    pressure_b_gain: f32 = 1.0, "", 0.5 => 2.0;
    /// Calibration of the supply pressure: added to the reading of the range times the gain.
    supply_offset_pa: f32 = 0.0, "Pa", -1.0e6 => 1.0e6;
    /// Calibration of the supply pressure: factor on the reading of the range.
    supply_gain: f32 = 1.0, "", 0.5 => 2.0;
    /// Bits of an ADC code, hardware oversampling included.
    adc_bits: u8 = 16, "", 8 => 16;
    // The format of voltages ends at 128 V.
    /// Valve voltage about mid position at code 0 and at the highest code.
    valve_range_v: [f32; 2] = [-5.0, 5.0], "V", -100.0 => 100.0, apart 1.0;
    /// Bits of a DAC code.
    dac_bits: u8 = 12, "", 8 => 16;
    // A longer tick leaves the setpoint limiter's format; with shorter ones the times below leave their counters of ticks.
    /// Control ticks per second.
    tick_hz: u32 = 1000, "1/s", 50 => 20_000;
    /// Whether a supply pressure sensor is connected.
    supply_sensor: bool = true, "", 0 => 1;
    /// Whether the chambers' pressure sensors are connected. Without them the positioning law goes by its model, slower; the
    /// model monitor and the checks of these channels are off.
    pressure_sensors: bool = true, "", 0 => 1;
    /// Whether a chamber's pressure that is out of range, jumping or stuck leads to the safe state; else the positioning law goes
    /// by its model until the sensor is plausible again, and the model monitor stays silent meanwhile.
    pressure_loss_trips: bool = true, "", 0 => 1;

    /// Which law drives the valve: `paper`, proportional to the error, or `servo`, the positioning law, which needs the
    /// numbers of the rig that begin with `servo_`. On the board 0 or 1.
    law: LawChoice = LawChoice::Paper, "", 0 => 1;
    // The defaults of these are the paper's case (a) with a valve lag of 1.7 ms. Their ranges end where a format of the law does.
    /// Positioning law: highest speed of the reference.
    servo_speed_m_per_s: f32 = 1.3917, "m/s", 1.0e-3 => 50.0;
    /// Positioning law: highest acceleration of the reference.
    servo_acceleration_m_per_s2: f32 = 9.327265, "m/s2", 1.0e-2 => 5_000.0;
    /// Positioning law: highest jerk of the reference.
    servo_jerk_m_per_s3: f32 = 94.77153, "m/s3", 0.1 => 2.0e6;
    /// Positioning law: bandwidth of the law.
    servo_bandwidth_rad_per_s: f32 = 68.10603, "rad/s", 1.0 => 1_000.0;
    /// Positioning law: bandwidth of the observer.
    servo_observer_rad_per_s: f32 = 115.78025, "rad/s", 1.0 => 2_000.0;
    /// Positioning law: how fast the estimated force follows the measured one.
    servo_force_rate_per_s: f32 = 375.0, "1/s", 1.0 => 10_000.0;
    /// Positioning law: area of the piston on the side of chamber A over the moving mass.
    servo_area_m2_per_kg: f32 = 4.849383e-5, "m2/kg", 1.0e-7 => 1.0;
    /// Positioning law: volume of chamber A at mid-stroke, its hose included, over its area.
    servo_length_a_m: f32 = 0.509165, "m", 1.0e-3 => 3.9;
    /// Positioning law: volume of chamber B at mid-stroke, its hose included, over its area.
    servo_length_b_m: f32 = 0.509165, "m", 1.0e-3 => 3.9;
    /// Positioning law: flow into a chamber, as the speed of a piston that it would follow, for a radian of opening and a
    /// pressure drop equal to the chamber's pressure: `R T β_fill / A`. With `servo_fill_critical_ratio` for choked flow from a
    /// supply at the chamber's pressure.
    servo_fill_m_per_s: f32 = 1.190307, "m/s", 1.0e-4 => 60.0;
    /// Positioning law: the same out of a chamber, `R T β_exh / A`.
    servo_exhaust_m_per_s: f32 = 1.538137, "m/s", 1.0e-4 => 60.0;
    /// Positioning law: ratio of the gas's heat capacities.
    servo_heat_capacity_ratio: f32 = 1.4, "", 1.0 => 2.0;
    /// Positioning law: pressure of the atmosphere, absolute.
    servo_atmosphere_pa: f32 = 1.0e5, "Pa", 1.0e3 => 1.0e6;
    /// Positioning law: nominal supply pressure, absolute; used where it is not measured.
    servo_supply_pa: f32 = 7.0e5, "Pa", 1.0e3 => 8.0e6;
    /// Positioning law: pressure of the chambers at rest, absolute; used where it is not measured.
    servo_rest_pa: f32 = 3.617551e5, "Pa", 1.0e3 => 8.0e6;
    /// Positioning law: the same of chamber B, where it is another.
    servo_rest_b_pa: Option<f32> = None, "Pa", 1.0e3 => 8.0e6;
    /// Positioning law: area of the piston on the side of chamber B over the moving mass; absent: that of chamber A.
    servo_area_b_m2_per_kg: Option<f32> = None, "m2/kg", 1.0e-7 => 1.0;
    /// Positioning law: flow into chamber B, where it is not `servo_fill_m_per_s`.
    servo_fill_b_m_per_s: Option<f32> = None, "m/s", 1.0e-4 => 60.0;
    /// Positioning law: flow out of chamber B, where it is not `servo_exhaust_m_per_s`.
    servo_exhaust_b_m_per_s: Option<f32> = None, "m/s", 1.0e-4 => 60.0;
    // Below 0.01 no flow tells the ratio from 0.01.
    /// Positioning law: critical pressure ratio `b` of ISO 6358 of filling, hose included; absent: the paper's linear flow law.
    servo_fill_critical_ratio: Option<f32> = None, "", 0.01 => 0.9;
    /// Positioning law: critical pressure ratio `b` of ISO 6358 of exhausting, hose included.
    servo_exhaust_critical_ratio: Option<f32> = None, "", 0.01 => 0.9;
    /// Positioning law: effective voltage at which 1/64 of the valve's full flow passes, hoses included; absent: the opening is
    /// the paper's arc tangent.
    servo_opening_1_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: effective voltage at which 1/32 of the full flow passes.
    servo_opening_2_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: effective voltage at which 1/16 of the full flow passes.
    servo_opening_3_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: effective voltage at which 1/8 of the full flow passes.
    servo_opening_4_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: effective voltage at which 1/4 of the full flow passes.
    servo_opening_5_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: effective voltage at which 3/8 of the full flow pass.
    servo_opening_6_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: effective voltage at which 1/2 of the full flow passes.
    servo_opening_7_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: effective voltage at which 3/4 of the full flow pass.
    servo_opening_8_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: effective voltage at which 7/8 of the full flow pass.
    servo_opening_9_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: effective voltage at which the full flow passes.
    servo_opening_10_v: Option<f32> = None, "V", 5.0e-3 => 100.0;
    /// Positioning law: time by which the hoses delay what the valve does.
    servo_delay_s: f32 = 0.0, "s", 0.0 => 0.1;
    /// Positioning law: time by which it leads the force that the air's stiffness makes of the motion: delay, lag and a tick where
    /// there are hoses.
    servo_lead_s: f32 = 0.0, "s", 0.0 => 0.1;
    /// Positioning law: whether the piston slips as it breaks away, the static friction being far above the Coulomb friction. Hold
    /// and stick then judge the velocity by the position alone, and more coarsely.
    servo_stick_slip: bool = false, "", 0 => 1;
    /// Positioning law: stiffness of the seal's bristles, as the law takes it, over the moving mass.
    servo_bristle_per_s2: f32 = 7.407407e4, "1/s2", 0.0 => 1.0e9;
    /// Positioning law: viscous friction over the moving mass.
    servo_viscous_per_s: f32 = 4.595753, "1/s", 0.0 => 1.0e4;
    /// Positioning law: Coulomb friction over the moving mass.
    servo_coulomb_m_per_s2: f32 = 2.281778, "m/s2", 0.0 => 5_000.0;
    /// Positioning law and monitor: time constant with which the valve's spool follows its command.
    servo_lag_s: f32 = 1.7e-3, "s", 0.0 => 0.1;

    // The law's format ends at 32,767 V/m. At 10,000 V/m half a millimetre opens a 5 V valve fully: beyond, the law is a
    // switch, and its rounding is proven up to here.
    /// Proportional gain `K_p` of the paper's law. A controller file that gives it and no `law` selects that law.
    gain_v_per_m: f32 = 4.0, "V/m", 0.0 => 10_000.0;
    /// Lowest and highest position the reference may take, inside `position_range_m`; absent: the sensor's range.
    setpoint_range_m: Option<[f32; 2]> = None, "m", -3.9 => 3.9;
    /// Highest velocity of the reference; absent: a step passes as a step.
    setpoint_velocity_m_per_s: Option<f32> = None, "m/s", 1.0e-4 => 50.0;
    // Narrowed by `acceleration_range`.
    /// Highest acceleration of the reference; absent: not limited. `tick_hz` narrows its range; a refusal says to what.
    setpoint_acceleration_m_per_s2: Option<f32> = None, "m/s2", 1.0e-3 => 30_000.0;

    /// Right break-point of the valve's dead zone that the inverse compensates.
    dead_zone_right_v: f32 = 0.0, "V", -100.0 => 100.0;
    /// Left break-point of the dead zone; not above the right one.
    dead_zone_left_v: f32 = 0.0, "V", -100.0 => 100.0;
    /// Slope right of the dead zone.
    slope_right: f32 = 1.0, "", 0.05 => 20.0;
    /// Slope left of the dead zone.
    slope_left: f32 = 1.0, "", 0.05 => 20.0;
    /// Half-width, in effective voltage, of the band over which the inverse crosses the dead zone; at least the gain times
    /// one position code. Absent: one DAC code, or the gain times two position codes if that is more.
    dead_zone_blend_v: Option<f32> = None, "V", 5.0e-4 => 1.0;
    /// Largest magnitude of valve voltage ever commanded.
    max_voltage_v: f32 = 5.0, "V", 0.1 => 100.0;
    // Counted in ticks in 16 bits. What is longer than equalising takes keeps the air on for nothing.
    /// How long after a trip the valve goes on moving to equalise the chambers' forces (stop category 1), before it takes the safe
    /// voltage and the air output drops; 0: both at once (stop category 0), as always under the paper's law and without
    /// pressure sensors.
    stop_time_s: f32 = 0.1, "s", 0.0 => 0.2;
    /// Valve voltage in every mode but run; absent: the middle of the dead zone, where both chambers are blocked.
    safe_voltage_v: Option<f32> = None, "V", -100.0 => 100.0;

    /// Readings closer than this to an end of the position range are a fault; at most a quarter of the range. Zero: the
    /// stroke reaches the ends of the range; an end reached continuously then counts as the end stop, one reached by a
    /// jump or found at self-test as a fault.
    position_margin_m: f32 = 0.0, "m", 0.0 => 1.95;
    /// Lowest and highest believable pressure, absolute. No chamber is ever far below atmosphere, so a dead sensor shows.
    pressure_limits_pa: [f32; 2] = [5.0e4, 9.9e5], "Pa", -8.0e6 => 8.0e6, apart 1.0e3;
    /// Fastest believable piston.
    position_rate_m_per_s: f32 = 3.0, "m/s", 1.0e-3 => 100.0;
    /// Largest difference between two samples of the position that noise alone makes.
    position_noise_m: f32 = 1.0e-3, "m", 0.0 => 1.0;
    /// Fastest believable pressure change. A chamber of a few cm3 at its end stop empties at 2e8 Pa/s. Under the positioning law a
    /// chamber's pressure is bounded besides by what twice the widest flow makes in its volume at the piston's place.
    pressure_rate_pa_per_s: f32 = 2.5e8, "Pa/s", 1.0e3 => 1.0e9;
    /// Largest difference between two samples of a pressure that noise alone makes.
    pressure_noise_pa: f32 = 1.0e4, "Pa", 0.0 => 1.0e6;
    // Counted in quarters of ticks in 16 bits: 0.8 s at 20 kHz would be the end. A tenth is ten times too long for a piston.
    /// How long implausible readings of one channel are bridged with the last good one; then the reason is raised.
    glitch_time_s: f32 = 5.0e-3, "s", 0.0 => 0.1;
    // Counted in ticks in 16 bits: 3.3 s at 20 kHz would be the end.
    /// How long a channel that is known to be noisy may repeat the same code; never less than 15 ticks.
    stuck_time_s: f32 = 15.0e-3, "s", 0.0 => 1.0;
    /// Supply pressure below which the controller does not run, absolute; 0 switches the check off.
    supply_minimum_pa: f32 = 4.0e5, "Pa", 0.0 => 8.0e6;
    /// Timing faults (ticks missed, late or overrun) in a row that raise the reason; fewer are bridged. 0 counts as 1.
    timing_fault_ticks: u8 = 3, "", 0 => 255;
    /// How long every sensor must be plausible before idle is reached.
    self_test_time_s: f32 = 0.1, "s", 0.0 => 60.0;
    /// Longest silence of the host while running; absent: the host may be silent.
    command_time_out_s: Option<f32> = None, "s", 1.0e-3 => 3600.0;
}

/// Smallest and largest acceleration of the reference at a tick rate, m/s2.
///
/// The change of velocity per tick is at least 64 units of its format, so that it is exact to one in 128, and at most
/// 50 m/s; and the acceleration's own format ends beyond 30,000 m/s2.
#[must_use]
pub const fn acceleration_range(tick_hz: u32) -> [f64; 2] {
    let whole = Key::setpoint_acceleration_m_per_s2.row().limits;
    let (least, most) = (tick_hz as f64 * 64.0 / (1_u32 << 24) as f64, tick_hz as f64 * 50.0);
    [if least > whole.low { least } else { whole.low }, if most < whole.high { most } else { whole.high }]
}
