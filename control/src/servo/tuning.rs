//! Parameters → the constants of the law, with every division done beforehand.
//!
//! What the rig decides stands in the table of parameters, what is the same for every rig in [`constants`](super::constants).

use super::air::{Chambers, Critical};
use super::constants::*;
use super::factor::{Factor, Share};
use super::friction::FrictionGains;
use super::hold::{HoldLimits, Weights};
use super::inversion::{Valve, ValveModel};
use super::law::{Feedback, LawGains};
use super::learned::{Learned, Quantities, Quantity};
use super::learning::{BANDWIDTH_BOUNDS, GAIN_BOUNDS, LearningRates, MASS_BOUNDS};
use super::observer::{Body, ObserverGains};
use super::opening::{OPENING_KNOTS, OPENING_STEP_V, Opening};
use super::reference::Limits;
use super::stall::StallLimits;
use super::stick::{LeadGains, StickGains};
use super::stream::StreamGains;
use super::{Acceleration, Damping, Jerk, Micrometres, Ratio, Tick, Ticks};
use crate::arithmetic::{bits, fixed};
use crate::config::{ConfigError, demand};
use crate::dead_zone_inverse::DeadZoneInverse;
use crate::parameters::{Key, Parameters};
use crate::quantities::{Position, Velocity, Voltage};
use fixed::types::{I6F26, I8F24};

/// Reference: shortest time for which a jerk is planned, s.
const PLANNED_S: f64 = 1e-3;
/// Reference: longest unit of length of its plan, m, in which 26 fractional bits are a micrometre.
const MOST_UNIT_M: f64 = 67.0;
/// Observer: stiffest bristle, over the moving mass and times the square of a tick: what 7 bits before the point hold.
const STIFFEST: f64 = 127.0;

/// Every constant of the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning {
    pub(super) tick: Tick,
    pub(super) chambers: Chambers,
    pub(super) observer: ObserverGains,
    /// Coulomb friction that is compensated at most in the first run, where pressures are not measured.
    pub(super) unseen_coulomb: Acceleration,
    /// Ticks after a run begins in which the piston still stands.
    pub(super) standing_ticks: u16,
    pub(super) valve: Valve,
    pub(super) learning: LearningRates,
    pub(super) stream: StreamGains,
    pub(super) limits: Limits,
    pub(super) law: LawGains,
    /// From the force that is missing in a controlled stop to its rate.
    pub(super) equalise: Factor<Acceleration, Jerk>,
    pub(super) hold: HoldLimits,
    pub(super) stick: StickGains,
    pub(super) stall: StallLimits,
    pub(super) friction: FrictionGains,
    /// Speed below which the reference stands.
    pub(super) standing: Velocity,
    /// Distance of the reference from the piston up to which it may brake as planned.
    pub(super) near: Position,
    /// Distance of the reference from its target at which it has arrived.
    pub(super) arrived: Position,
    /// Deceleration of the reference from which it counts as braking.
    pub(super) braking: Acceleration,
    /// Nominal lag.
    pub(super) lag: Ticks,
    /// What a run begins with while none was learned.
    pub(super) start: Learned,
    /// Delay of the command by the hoses.
    pub(super) delay_ticks: u8,
    /// From the reference's acceleration to what the velocity will have changed by when the valve acts.
    pub(super) lead: Factor<Acceleration, Velocity>,
    /// Of a piston that slips as it breaks away: from the error's distance to its mean to the velocity.
    pub(super) slipping: Option<Factor<Position, Velocity>>,
    /// The least caution.
    pub(super) least_caution: i32,
    /// From an innovation of the position to the noise it shows.
    pub(super) noise_of: Factor<Position, Micrometres>,
    /// How fast that is learned, per tick.
    pub(super) noise_follow: Share<Micrometres, Micrometres>,
    /// From the noise to the caution, 24 fractional bits.
    pub(super) caution_of: Factor<Micrometres, I8F24>,
}

impl Tuning {
    /// Computes the constants. The parameters' ranges are checked already.
    ///
    /// # Errors
    /// The first parameter that does not fit another.
    // Apart from its callers: its frame is large.
    #[inline(never)]
    pub(crate) fn new(p: &Parameters, inverse: &DeadZoneInverse) -> Result<Self, ConfigError> {
        let hz = f64::from(p.tick_hz);
        let t = 1.0 / hz;
        demand(hz >= 500.0, Key::tick_hz, hz, "be at least 500 with law = \"servo\", or law = \"paper\"")?;
        let [speed, acceleration, jerk] =
            [p.servo_speed_m_per_s, p.servo_acceleration_m_per_s2, p.servo_jerk_m_per_s3].map(f64::from);
        let w = f64::from(p.servo_bandwidth_rad_per_s);
        let w_o = f64::from(p.servo_observer_rad_per_s);
        let planned = t.max(PLANNED_S);
        let natural = speed * jerk / (acceleration * acceleration);
        demand(
            natural <= 3.0 && planned * jerk <= 0.5 * acceleration,
            Key::servo_jerk_m_per_s3,
            jerk,
            "be at most 3 times the square of servo_acceleration_m_per_s2 over servo_speed_m_per_s, and at most half that \
             acceleration in a tick or a millisecond (metres per second cubed)",
        )?;
        let unit_m = acceleration * acceleration * acceleration / (jerk * jerk);
        demand(
            unit_m <= MOST_UNIT_M,
            Key::servo_jerk_m_per_s3,
            jerk,
            "be more, or servo_acceleration_m_per_s2 less: its cube over the square of the jerk must be at most 67 m (metres per second \
             cubed)",
        )?;
        demand(w_o * t <= 0.5, Key::servo_observer_rad_per_s, w_o, "be at most half of tick_hz (radians per second)")?;
        let per_mass =
            [p.servo_area_m2_per_kg, p.servo_area_b_m2_per_kg.unwrap_or(p.servo_area_m2_per_kg)].map(f64::from);
        let [_, pressures @ ..] = p.calibrated_ranges();
        let highest = pressures.iter().flatten().fold(f64::from(p.servo_supply_pa), |most, end| most.max(*end));
        for (per_mass, key) in per_mass.into_iter().zip([Key::servo_area_m2_per_kg, Key::servo_area_b_m2_per_kg]) {
            demand(
                per_mass * highest <= 30_000.0,
                key,
                per_mass,
                "not turn the highest pressure into more than 30000 m/s2",
            )?;
        }
        let ratio = per_mass[1] / per_mass[0];
        demand(
            (0.125..=7.9).contains(&ratio),
            Key::servo_area_b_m2_per_kg,
            per_mass[1],
            "be from an eighth to 7.9 times servo_area_m2_per_kg",
        )?;
        let force = |side: usize, pressure: f32| fixed::<Acceleration>(per_mass[side] * f64::from(pressure));
        let rest = [force(0, p.servo_rest_pa), force(1, p.servo_rest_b_pa.unwrap_or(p.servo_rest_pa))];
        let rest_force = rest[0].saturating_sub(rest[1]);
        let opening = opening(p)?;
        let tick = Tick { q32: bits(t, 32) };
        let gamma = f64::from(p.servo_heat_capacity_ratio);
        let coulomb = f64::from(p.servo_coulomb_m_per_s2);
        // What friction is a part of must not be zero.
        let unit = coulomb.max(0.01);
        let force_rate = f64::from(p.servo_force_rate_per_s);
        // Where the format of `bristle_q24` ends a piston sticks by its bristles as good as rigidly within a tick.
        let bristle = f64::from(p.servo_bristle_per_s2).min(STIFFEST * hz * hz);
        let viscous = f64::from(p.servo_viscous_per_s);
        let delay_ticks = (f64::from(p.servo_delay_s) * hz).min(MOST_HOSE_DELAY_TICKS as f64) as u8;
        // The lag takes up the rest: what is no whole tick, and what is beyond the ring of commands.
        let lag = f64::from(p.servo_lag_s) + (f64::from(p.servo_delay_s) - f64::from(delay_ticks) * t);
        let coulomb_start = match (p.servo_stick_slip, p.pressure_sensors) {
            (true, true) => SLIPPING_COULOMB_START,
            (false, true) => COULOMB_START,
            (_, false) => UNSEEN_COULOMB_START,
        };
        let weight = (t / if p.servo_stick_slip { SLIPPING_MEAN_S } else { MEAN_S }).min(1.0);
        let ticks = |time_s: f64| (time_s * hz) as u16;
        let whole = ticks(MOST_PER_CHANGE / STREAM_BANDWIDTH).max(1);
        let whole_s = f64::from(whole) * t;
        let stream_w = STREAM_BANDWIDTH.min(MOST_PER_CHANGE / whole_s);
        let valve = valve(p, inverse, opening);
        Ok(Self {
            tick,
            chambers: Chambers {
                per_pa: per_mass.map(Factor::new),
                ratio: fixed(ratio),
                follow: Share::new((t * PRESSURE_RATE).min(1.0)),
                lengths: [p.servo_length_a_m, p.servo_length_b_m].map(|length| fixed(f64::from(length))),
                flow: [
                    [p.servo_fill_m_per_s, p.servo_exhaust_m_per_s],
                    [
                        p.servo_fill_b_m_per_s.unwrap_or(p.servo_fill_m_per_s),
                        p.servo_exhaust_b_m_per_s.unwrap_or(p.servo_exhaust_m_per_s),
                    ],
                ]
                .map(|paths| paths.map(|c| fixed(gamma * f64::from(c)))),
                critical: critical(p)?,
                gamma_q24: bits(gamma, 24),
                atmosphere: [0, 1].map(|side| force(side, p.servo_atmosphere_pa)),
                nominal_supply: force(0, p.servo_supply_pa),
                rest,
            },
            observer: ObserverGains {
                y: Factor::new(3.0 * w_o * t),
                v: Factor::new(3.0 * w_o * w_o * t),
                disturbance: Factor::new(w_o * w_o * w_o * t),
                force: Share::new((force_rate * t).min(1.0)),
                unseen: Share::new((UNSEEN_RATE * t).min(1.0)),
                bristle: Factor::new(bristle * t),
                bristle_q24: bits(bristle * t * t, 24),
            },
            unseen_coulomb: fixed(UNSEEN_COULOMB_START * coulomb),
            standing_ticks: ticks(STANDING_S),
            learning: LearningRates {
                wrong: Factor::new(force_rate),
                gain: Share::new(LEARN[0] * t),
                zone: Share::new(LEARN[1] * t),
                lag: Share::new(LEARN[1] * t),
                turn: Share::new((force_rate * t).min(1.0)),
                turning_square: fixed(TURNING * t * TURNING * t),
                lag_bounds: Quantity::Lag.parts().map(|bound| fixed(bound * lag * hz)),
                body: Factor::new(LEARN[1] * t / unit),
                coulomb: fixed(coulomb),
                viscous: fixed(viscous),
                viscous_bounds: Quantity::Viscous.parts().map(|bound| fixed(bound * viscous)),
                viscous_part: Factor::new(viscous / unit),
                inertia_part: Factor::new(1.0 / unit),
                zone_bounds: valve.zones.map(|zone| {
                    Quantity::ZoneRight
                        .parts()
                        .map(|bound| fixed::<Voltage>(bound * f64::from(zone.to_bits()) / f64::from(1 << 24)))
                }),
                load: Share::new(LOAD_RATE * t),
                load_bounds: [
                    force(1, p.servo_atmosphere_pa).saturating_sub(force(0, p.servo_supply_pa)),
                    force(1, p.servo_supply_pa).saturating_sub(force(0, p.servo_atmosphere_pa)),
                ],
                slowly: Share::new(SLOW_LEARN * t),
                slips: p.servo_stick_slip,
                coulomb_bounds: Quantity::Coulomb.parts().map(|bound| fixed(bound * coulomb)),
            },
            valve,
            stream: StreamGains {
                dead_band: fixed(DEAD_BAND_M),
                longest_hold: ticks(LONGEST_HOLD_S),
                whole,
                off: fixed(acceleration / (stream_w * stream_w)),
                acceleration: fixed(MOST_ACCELERATION * acceleration),
                per_tick: Factor::new(hz),
                y: Factor::new(3.0 * stream_w * whole_s),
                v: Factor::new(3.0 * stream_w * stream_w * whole_s),
                a: Factor::new(stream_w * stream_w * stream_w * whole_s),
                jerk: Factor::new(stream_w * stream_w * stream_w),
                jerk_follow: Share::new((JERK_BANDWIDTH * t).min(1.0)),
                used: (
                    Factor::new(FOLLOWED / speed),
                    Factor::new(1.0 / acceleration),
                    Factor::new(1.0 / (CALM_JERK * jerk)),
                ),
                forget: Share::new(t / PEAK_HELD_S),
                lost: fixed(NOT_FOLLOWED),
                followed_part: fixed(FOLLOWED),
                followed: Factor::new(1.0 / (NOT_FOLLOWED - FOLLOWED)),
            },
            limits: Limits {
                speed: fixed::<I6F26>(natural),
                tick: fixed::<I6F26>(planned * jerk / acceleration),
                length: Factor::new(jerk * jerk / (acceleration * acceleration * acceleration)),
                velocity: Factor::new(jerk / (acceleration * acceleration)),
                aim_jerk: Factor::new(1.0 / jerk),
                acceleration: Factor::new(1.0 / acceleration),
                jerk: Factor::new(acceleration / planned),
                near: (
                    fixed(jerk * planned),
                    fixed(jerk * planned * planned),
                    fixed(NEAR_M + jerk * planned * planned * planned),
                ),
            },
            law: gains(w, if p.servo_stick_slip { SLIPPING_STICK_GAIN } else { STICK_GAIN }),
            equalise: Factor::new(EQUALISE * w),
            hold: HoldLimits {
                enter: fixed(HOLD_M[0]),
                leave: fixed(HOLD_M[1]),
                leave_slowly: [fixed(LEAVE[0] * HOLD_M[1]), fixed(LEAVE[1] * HOLD_M[1])],
                leave_at_once: fixed(LEAVE[2] * HOLD_M[1]),
                settle_ticks: ticks(SETTLE_S),
                coast_ticks: ticks(COAST_S),
                trial_ticks: ticks(TRIAL_S),
                force: fixed(MOVING * coulomb),
                margin: fixed(HELD * coulomb),
                // The disturbance's standard deviations: the observer makes `σ² 3 w_o⁵ T / 16` of a position's variance.
                band: fixed(HELD_DEVIATIONS * w_o * w_o * root(3.0 / 16.0 * w_o * t) * 1e-6 * QUIET_UM),
                target: fixed(DEAD_BAND_M),
                speed: fixed(HOLD_SPEED),
                ticks: ticks(REST_S),
                weights: Weights {
                    error: Share::new(weight),
                    slow: Share::new((t / LONG_MEAN_S).min(1.0)),
                    v: Share::new(weight),
                    force: Share::new((t / FORCE_MEAN_S).min(1.0)),
                },
                drift: fixed(HOLD_DRIFT * coulomb),
                pulse: fixed(HOLD_DRIFT * coulomb / PULSE_S),
                noise_follow: Share::new((FORCE_NOISE_RATE * t).min(1.0)),
                // A mean behind the observer's correction has the variance
                // `T / (2 (1 / L + mean))` of one sample's, a difference of two twice that.
                doubt: Factor::new(DEVIATION * DOUBT * root(t / (1.0 / force_rate + FORCE_MEAN_S))),
                inwards: p.servo_stick_slip,
            },
            stick: StickGains { speed: fixed(STICK_SPEED), ticks: ticks(REST_S), most: fixed(STICK_MOST * coulomb) },
            stall: StallLimits {
                stands: fixed(STANDS_M),
                // From one end of the friction to the other, and half as much again, or what makes a free piston turn round and leave its
                // place meanwhile.
                force: fixed(2.0 * coulomb + coulomb.max(8.0 * STANDS_M / (STALL_S * STALL_S))),
                ticks: ticks(STALL_S),
                suspected: ticks(SUSPECTED * STALL_S),
                growth: fixed(
                    per_mass[0] * f64::from(p.servo_supply_pa - p.servo_atmosphere_pa).max(0.0) * t / STALL_GROWTH_S,
                ),
                follow: Factor::new(STICK_FORCE * w),
            },
            friction: FrictionGains::new(hz, bristle, delay_ticks),
            standing: fixed(STICK_SPEED),
            near: fixed(ERROR_M),
            arrived: fixed(ARRIVED_M),
            braking: fixed(BRAKING * acceleration),
            lag: fixed(lag * hz),
            start: Learned::of(
                &ValveModel { zones: valve.zones, gains: [Ratio::ONE; 2] },
                &Body { coulomb: fixed(coulomb_start * coulomb), viscous: fixed(viscous), mass: Ratio::ONE },
                fixed(lag * hz),
                rest_force.saturating_neg(),
                Ratio::ONE,
            ),
            delay_ticks,
            lead: Factor::new(f64::from(p.servo_lead_s)),
            slipping: p.servo_stick_slip.then(|| Factor::new(weight * hz)),
            least_caution: bits(if p.servo_stick_slip { SLIPPING } else { 1.0 }, 24),
            noise_of: Factor::new(1e6 * DEVIATION),
            noise_follow: Share::new(NOISE_RATE * t),
            caution_of: Factor::new(1.0 / QUIET_UM),
        })
    }

    /// The rig's nominal values of what is learned.
    pub(crate) fn nominal(&self) -> Learned {
        let LearningRates { coulomb, viscous, .. } = self.learning;
        let valve = ValveModel { zones: self.valve.zones, gains: [Ratio::ONE; 2] };
        let load = self.chambers.rest_force().saturating_neg();
        Learned::of(&valve, &Body { coulomb, viscous, mass: Ratio::ONE }, self.lag, load, Ratio::ONE)
    }

    /// The limits that learning keeps to: lowest and highest values.
    pub(super) fn limits(&self) -> [Learned; 2] {
        let LearningRates { coulomb_bounds, viscous_bounds, zone_bounds, lag_bounds, load_bounds, .. } = self.learning;
        let [right, left] = zone_bounds;
        let (gain, mass) = (GAIN_BOUNDS.map(Ratio::to_bits), MASS_BOUNDS.map(Ratio::to_bits));
        let ends = [
            gain,
            gain,
            right.map(Voltage::to_bits),
            left.map(Voltage::to_bits),
            lag_bounds.map(Ticks::to_bits),
            coulomb_bounds.map(Acceleration::to_bits),
            viscous_bounds.map(Damping::to_bits),
            mass,
            load_bounds.map(Acceleration::to_bits),
            BANDWIDTH_BOUNDS.map(Ratio::to_bits),
        ];
        [Learned { bits: ends.map(|[least, _]| least) }, Learned { bits: ends.map(|[_, most]| most) }]
    }

    /// Begins with these values instead of nominal ones.
    ///
    /// # Errors
    /// The first quantity beyond its limits; nothing has changed then.
    pub(crate) fn start_from(&mut self, values: &Quantities, tick_hz: u32) -> Result<(), Quantity> {
        let [least, most] = self.limits();
        let mut values = *values;
        let nominal = self.nominal().values(tick_hz);
        for quantity in Quantity::ALL.into_iter().filter(|quantity| quantity.is_newer()) {
            let place = usize::from(quantity.number());
            if values[place].is_nan() {
                values[place] = nominal[place];
            }
        }
        self.start = Learned::between(&values, [&least, &most], tick_hz)?;
        Ok(())
    }
}

/// The square root of a number between 1e-4 and 1, by Heron's steps: without a library there is none.
fn root(x: f64) -> f64 {
    (0..12).fold(1.0, |root, _| 0.5 * (root + x / root))
}

/// The gains of a bandwidth.
fn gains(w: f64, stick: f64) -> LawGains {
    LawGains {
        feedback: Feedback { a: Factor::new(3.0 * w), v: Factor::new(3.0 * w * w), y: Factor::new(w * w * w) },
        lead: LeadGains {
            error: Factor::new(stick * w * w * w),
            creep: Factor::new(stick * STICK_CREEP * w * w),
            force: Factor::new(STICK_FORCE * w),
        },
    }
}

/// Both critical ratios, or none.
fn critical(p: &Parameters) -> Result<Option<[Critical; 2]>, ConfigError> {
    let of = |b: f32| {
        let b = f64::from(b);
        Critical { down: Factor::new(1.0 / (1.0 - b)), up: Factor::new(b / (1.0 - b)) }
    };
    match (p.servo_fill_critical_ratio, p.servo_exhaust_critical_ratio) {
        (None, None) => Ok(None),
        (Some(fill), Some(exhaust)) => Ok(Some([of(fill), of(exhaust)])),
        (fill, _) => {
            let key = if fill.is_some() { Key::servo_exhaust_critical_ratio } else { Key::servo_fill_critical_ratio };
            demand(false, key, 0.0, "be given, as that of the other path is").map(|()| None)
        }
    }
}

/// All points of the table of openings, rising, or none.
fn opening(p: &Parameters) -> Result<Opening, ConfigError> {
    let points: [(Option<f32>, Key); OPENING_KNOTS.len()] = [
        (p.servo_opening_1_v, Key::servo_opening_1_v),
        (p.servo_opening_2_v, Key::servo_opening_2_v),
        (p.servo_opening_3_v, Key::servo_opening_3_v),
        (p.servo_opening_4_v, Key::servo_opening_4_v),
        (p.servo_opening_5_v, Key::servo_opening_5_v),
        (p.servo_opening_6_v, Key::servo_opening_6_v),
        (p.servo_opening_7_v, Key::servo_opening_7_v),
        (p.servo_opening_8_v, Key::servo_opening_8_v),
        (p.servo_opening_9_v, Key::servo_opening_9_v),
        (p.servo_opening_10_v, Key::servo_opening_10_v),
    ];
    if points.iter().all(|(volts, _)| volts.is_none()) {
        return Ok(Opening::of(None));
    }
    let mut last = 0.0;
    for (volts, key) in points {
        let volts = f64::from(volts.unwrap_or(0.0));
        // Half a step: the voltages are rounded to f32.
        let rises = volts >= last + 0.5 * OPENING_STEP_V;
        demand(rises, key, volts, "be given as the other voltages of openings are, and above the one before (volts)")?;
        last = volts;
    }
    Ok(Opening::of(Some(points.map(|(volts, _)| f64::from(volts.unwrap_or(0.0))))))
}

/// The valve whose dead zone the paper's law compensates, too.
fn valve(p: &Parameters, inverse: &DeadZoneInverse, opening: Opening) -> Valve {
    let DeadZoneInverse { right, left, centre, lowest, highest, .. } = *inverse;
    let slopes = [p.slope_right, p.slope_left].map(f64::from);
    let most = highest.saturating_sub(centre).min(centre.saturating_sub(lowest)).max(Voltage::ZERO);
    Valve {
        centre,
        slopes: slopes.map(fixed),
        per_slopes: [inverse.per_slope_right, inverse.per_slope_left],
        ends: [lowest, highest],
        most,
        blend: fixed(BLEND),
        per_blend: fixed(1.0 / BLEND),
        zones: [right.saturating_sub(centre), centre.saturating_sub(left)],
        opening,
    }
}
