//! What the law learns, as one list: names, units and limits, and the numbers by which telemetry, board and flash know it.

use super::inversion::ValveModel;
use super::observer::Body;
use super::{Acceleration, Damping, Ratio, Ticks};
use crate::arithmetic::bits;
use crate::parameters::Key;
use crate::quantities::Voltage;

/// A quantity that is learned. Its number identifies it for ever in flash: append only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Quantity {
    /// Flow of the valve where it fills chamber A, over nominal flow.
    FlowRight = 0,
    /// The same where it fills chamber B.
    FlowLeft = 1,
    /// Half-width of the dead zone towards chamber A, V.
    ZoneRight = 2,
    /// The same towards chamber B, V.
    ZoneLeft = 3,
    /// Lag of the spool, with what of the hoses' delay is no whole tick, s.
    Lag = 4,
    /// Coulomb friction per nominal moving mass, m/s2.
    Coulomb = 5,
    /// Viscous friction per nominal moving mass, 1/s.
    Viscous = 6,
    /// Moving mass over nominal moving mass.
    Mass = 7,
    /// Constant force from outside along +y per nominal moving mass, m/s2: weight, rod, and what the rig file does not know.
    Load = 8,
    /// Bandwidth of the law over that of its parameters: less where the rig lets it cycle.
    Bandwidth = 9,
}

/// How many quantities are learned.
pub const QUANTITIES: usize = Quantity::ALL.len();
/// A value of each, in the order of their numbers and in their units.
pub type Quantities = [f32; QUANTITIES];

/// The parameters that learned values are measured against: with another value of one of these they mean another rig. What only
/// says how fast the law moves is not among them.
pub const MEASURED_AGAINST: [Key; 38] = [
    Key::law,
    Key::tick_hz,
    Key::dead_zone_right_v,
    Key::dead_zone_left_v,
    Key::slope_right,
    Key::slope_left,
    Key::max_voltage_v,
    Key::servo_area_m2_per_kg,
    Key::servo_area_b_m2_per_kg,
    Key::servo_length_a_m,
    Key::servo_length_b_m,
    Key::servo_fill_m_per_s,
    Key::servo_fill_b_m_per_s,
    Key::servo_exhaust_m_per_s,
    Key::servo_exhaust_b_m_per_s,
    Key::servo_fill_critical_ratio,
    Key::servo_exhaust_critical_ratio,
    Key::servo_heat_capacity_ratio,
    Key::servo_atmosphere_pa,
    Key::servo_supply_pa,
    Key::servo_rest_pa,
    Key::servo_rest_b_pa,
    Key::servo_bristle_per_s2,
    Key::servo_viscous_per_s,
    Key::servo_coulomb_m_per_s2,
    Key::servo_lag_s,
    Key::servo_delay_s,
    Key::servo_stick_slip,
    Key::servo_opening_1_v,
    Key::servo_opening_2_v,
    Key::servo_opening_3_v,
    Key::servo_opening_4_v,
    Key::servo_opening_5_v,
    Key::servo_opening_6_v,
    Key::servo_opening_7_v,
    Key::servo_opening_8_v,
    Key::servo_opening_9_v,
    Key::servo_opening_10_v,
];

impl Quantity {
    /// Every quantity, in the order of their numbers.
    pub const ALL: [Self; 10] = [
        Self::FlowRight,
        Self::FlowLeft,
        Self::ZoneRight,
        Self::ZoneLeft,
        Self::Lag,
        Self::Coulomb,
        Self::Viscous,
        Self::Mass,
        Self::Load,
        Self::Bandwidth,
    ];

    /// The number in flash.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The name, with its unit, in telemetry and commands.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FlowRight => "flow_right",
            Self::FlowLeft => "flow_left",
            Self::ZoneRight => "dead_zone_right_v",
            Self::ZoneLeft => "dead_zone_left_v",
            Self::Lag => "lag_s",
            Self::Coulomb => "coulomb_m_per_s2",
            Self::Viscous => "viscous_per_s",
            Self::Mass => "mass",
            Self::Load => "load_m_per_s2",
            Self::Bandwidth => "bandwidth",
        }
    }

    /// Whether firmware has kept and told values without it.
    #[must_use]
    pub const fn is_newer(self) -> bool {
        matches!(self, Self::Load | Self::Bandwidth)
    }

    /// Lowest and highest value ever learned, over the nominal one. `None` for the load, which may be whatever the supply can hold.
    #[must_use]
    pub const fn limits(self) -> Option<[f64; 2]> {
        match self {
            Self::Load => None,
            _ => Some(self.parts()),
        }
    }

    /// The same of what has a nominal value to be a part of.
    pub(super) const fn parts(self) -> [f64; 2] {
        match self {
            Self::Load => [1.0, 1.0],
            Self::FlowRight | Self::FlowLeft => [0.4, 1.8],
            Self::ZoneRight | Self::ZoneLeft => [0.75, 1.25],
            Self::Lag => [0.25, 3.5],
            Self::Coulomb | Self::Viscous => [0.3, 1.5],
            Self::Mass => [0.6, 1.5],
            Self::Bandwidth => [0.55, 1.0],
        }
    }

    /// The same of a ratio, whose nominal value is one.
    pub(super) const fn ratio_limits(self) -> [Ratio; 2] {
        let [least, most] = self.parts();
        [Ratio::from_bits(bits(least, Ratio::FRAC_NBITS)), Ratio::from_bits(bits(most, Ratio::FRAC_NBITS))]
    }

    /// What the last bit of the tick's number stands for, in the quantity's unit.
    fn resolution(self, tick_hz: f64) -> f64 {
        let bits = match self {
            Self::FlowRight | Self::FlowLeft | Self::Mass | Self::Bandwidth => Ratio::FRAC_NBITS,
            Self::ZoneRight | Self::ZoneLeft => Voltage::FRAC_NBITS,
            Self::Lag => return 1.0 / ((1_u32 << Ticks::FRAC_NBITS) as f64 * tick_hz),
            Self::Coulomb | Self::Load => Acceleration::FRAC_NBITS,
            Self::Viscous => Damping::FRAC_NBITS,
        };
        1.0 / (1_u32 << bits) as f64
    }
}

/// What is learned, as the tick holds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Learned {
    /// The bits of the tick's numbers, in the order of [`Quantity::ALL`].
    pub bits: [i32; QUANTITIES],
}

impl Learned {
    #[inline]
    pub(super) fn of(valve: &ValveModel, body: &Body, lag: Ticks, load: Acceleration, bandwidth: Ratio) -> Self {
        let ([flow_right, flow_left], [zone_right, zone_left]) = (valve.gains, valve.zones);
        Self {
            bits: [
                flow_right.to_bits(),
                flow_left.to_bits(),
                zone_right.to_bits(),
                zone_left.to_bits(),
                lag.to_bits(),
                body.coulomb.to_bits(),
                body.viscous.to_bits(),
                body.mass.to_bits(),
                load.to_bits(),
                bandwidth.to_bits(),
            ],
        }
    }

    #[inline]
    pub(super) fn parts(&self) -> (ValveModel, Body, Ticks, Acceleration, Ratio) {
        let [flow_right, flow_left, zone_right, zone_left, lag, coulomb, viscous, mass, load, bandwidth] = self.bits;
        let valve = ValveModel {
            gains: [Ratio::from_bits(flow_right), Ratio::from_bits(flow_left)],
            zones: [Voltage::from_bits(zone_right), Voltage::from_bits(zone_left)],
        };
        let body = Body {
            coulomb: Acceleration::from_bits(coulomb),
            viscous: Damping::from_bits(viscous),
            mass: Ratio::from_bits(mass),
        };
        (valve, body, Ticks::from_bits(lag), Acceleration::from_bits(load), Ratio::from_bits(bandwidth))
    }

    /// In the quantities' units, for a tick of `tick_hz` 1/s. Not for the tick: it uses floats.
    #[must_use]
    pub fn values(&self, tick_hz: u32) -> Quantities {
        let mut values = [0.0; QUANTITIES];
        for ((value, bits), quantity) in values.iter_mut().zip(self.bits).zip(Quantity::ALL) {
            *value = (f64::from(bits) * quantity.resolution(f64::from(tick_hz))) as f32;
        }
        values
    }

    /// The reverse, between `least` and `most`.
    ///
    /// # Errors
    /// The first quantity that is outside, or no number.
    pub(super) fn between(values: &Quantities, [least, most]: [&Self; 2], tick_hz: u32) -> Result<Self, Quantity> {
        let mut all = Self::default();
        let ends = least.values(tick_hz).into_iter().zip(most.values(tick_hz));
        let end_bits = least.bits.into_iter().zip(most.bits);
        for ((((learned, value), (low, high)), (least, most)), quantity) in
            all.bits.iter_mut().zip(values).zip(ends).zip(end_bits).zip(Quantity::ALL)
        {
            if !(low..=high).contains(value) {
                return Err(quantity);
            }
            // An end rounded to single precision may lie a bit beyond itself.
            let exact = f64::from(*value) / quantity.resolution(f64::from(tick_hz));
            *learned = bits(exact, 0).clamp(least.min(most), most);
        }
        Ok(all)
    }
}
