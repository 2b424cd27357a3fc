//! Parameters → the constants of the law, with every division done beforehand.
//!
//! What the rig decides stands in the table of parameters, what is the same for every rig in [`constants`](super::constants).

use super::air::{Areas, Chambers};
use super::constants::*;
use super::factor::{Factor, Share};
use super::friction::FrictionGains;
use super::hold::{HoldLimits, mean_weight};
use super::inversion::{Valve, ValveModel};
use super::law::LawGains;
use super::learned::{Learned, Quantities, Quantity};
use super::learning::{BANDWIDTH_BOUNDS, GAIN_BOUNDS, LearningRates, MASS_BOUNDS};
use super::observer::{Body, ObserverGains};
use super::opening::Opening;
use super::reference::Limits;
use super::rig::Rig;
use super::stall::StallLimits;
use super::stick::StickGains;
use super::stream::StreamGains;
use super::{Acceleration, Damping, Jerk, Micrometres, Ratio, Tick, Ticks};
use crate::arithmetic::{bits, fixed};
use crate::config_error::ConfigError;
use crate::dead_zone_inverse::DeadZoneInverse;
use crate::parameters::Parameters;
use crate::quantities::{Position, Velocity, Voltage};
use fixed::types::I8F24;

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
    /// The least scale of thresholds.
    pub(super) least_scale: i32,
    /// From an innovation of the position to the noise it shows.
    pub(super) noise_of: Factor<Position, Micrometres>,
    /// How fast that is learned, per tick.
    pub(super) noise_follow: Share<Micrometres, Micrometres>,
    /// From the noise to that scale, 24 fractional bits.
    pub(super) scale_of: Factor<Micrometres, I8F24>,
}

impl Tuning {
    /// Computes the constants. The parameters' ranges are checked already.
    ///
    /// # Errors
    /// The first parameter that does not fit another.
    // Apart from its callers: its frame is large.
    #[inline(never)]
    pub(crate) fn new(p: &Parameters, inverse: &DeadZoneInverse) -> Result<Self, ConfigError> {
        let rig = &Rig::of(p)?;
        let limits = Limits::new(p, rig)?;
        let observer = ObserverGains::new(rig)?;
        let areas = Areas::of(p)?;
        let valve = Valve::new(p, inverse, Opening::from_parameters(p)?);
        let chambers = Chambers::new(p, rig, &areas)?;
        let learning = LearningRates::new(p, rig, &areas, valve.zones);
        let lag = fixed(rig.lag_s * rig.hz);
        let coulomb_start = match (rig.slips, p.pressure_sensors) {
            (true, true) => SLIPPING_COULOMB_START,
            (false, true) => COULOMB_START,
            (_, false) => UNSEEN_COULOMB_START,
        };
        Ok(Self {
            tick: Tick { q32: bits(rig.t, 32) },
            stream: StreamGains::new(p, rig),
            limits,
            standing: fixed(STICK_SPEED),
            near: fixed(ERROR_M),
            arrived: fixed(ARRIVED_M),
            braking: fixed(BRAKING * f64::from(p.servo_acceleration_m_per_s2)),
            chambers,
            observer,
            standing_ticks: rig.ticks(STANDING_S),
            delay_ticks: rig.delay_ticks,
            lag,
            unseen_coulomb: fixed(UNSEEN_COULOMB_START * rig.coulomb),
            start: unlearned(&valve, &chambers, lag, fixed(coulomb_start * rig.coulomb), learning.viscous),
            learning,
            law: LawGains::new(rig.w, if rig.slips { SLIPPING_STICK_GAIN } else { STICK_GAIN }),
            lead: Factor::new(f64::from(p.servo_lead_s)),
            friction: FrictionGains::new(rig),
            valve,
            hold: HoldLimits::new(rig),
            stick: StickGains::new(rig),
            slipping: rig.slips.then(|| Factor::new(mean_weight(rig) * rig.hz)),
            stall: StallLimits::new(p, rig, &areas),
            equalise: Factor::new(EQUALISE * rig.w),
            noise_of: Factor::new(1e6 * DEVIATION),
            noise_follow: Share::new(NOISE_RATE * rig.t),
            scale_of: Factor::new(1.0 / QUIET_UM),
            least_scale: bits(if rig.slips { SLIPPING } else { 1.0 }, 24),
        })
    }

    /// The rig's nominal values of what is learned.
    pub(crate) fn nominal(&self) -> Learned {
        let LearningRates { coulomb, viscous, .. } = self.learning;
        unlearned(&self.valve, &self.chambers, self.lag, coulomb, viscous)
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

/// What is learned, before any of it is: nominal but for the friction, and a load that balances the pressures at rest.
fn unlearned(valve: &Valve, chambers: &Chambers, lag: Ticks, coulomb: Acceleration, viscous: Damping) -> Learned {
    let body = Body { coulomb, viscous, mass: Ratio::ONE };
    Learned::of(&ValveModel::nominal(valve), &body, lag, chambers.rest_force().saturating_neg(), Ratio::ONE)
}
