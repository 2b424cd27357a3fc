//! What more than one part of the law takes from the parameters.

use super::constants::MOST_HOSE_DELAY_TICKS;
use crate::config_error::{ConfigError, demand};
use crate::parameters::{Key, Parameters};

/// Stiffest bristle, over the moving mass and times the square of a tick: what 7 bits before the point hold.
const STIFFEST: f64 = 127.0;

/// The tick and the rig, in SI units.
pub(crate) struct Rig {
    /// Ticks per second.
    pub(crate) hz: f64,
    /// The tick.
    pub(crate) t: f64,
    /// Bandwidth of the law.
    pub(crate) w: f64,
    /// Bandwidth of the observer.
    pub(crate) observer_w: f64,
    /// How fast the estimated force follows the measured one.
    pub(crate) force_rate: f64,
    /// Coulomb friction over the moving mass.
    pub(crate) coulomb: f64,
    /// Viscous friction over the moving mass.
    pub(crate) viscous: f64,
    /// Stiffness of the bristles over the moving mass.
    pub(crate) bristle: f64,
    /// Delay of the command by the hoses, in whole ticks.
    pub(crate) delay_ticks: u8,
    /// Lag of the spool, and of the delay what is no whole tick and what is beyond the ring of commands.
    pub(crate) lag_s: f64,
    /// Whether the piston slips as it breaks away.
    pub(crate) slips: bool,
}

impl Rig {
    /// As the parameters have it.
    ///
    /// # Errors
    /// A tick too slow for the law.
    pub(crate) fn of(p: &Parameters) -> Result<Self, ConfigError> {
        let hz = f64::from(p.tick_hz);
        let t = 1.0 / hz;
        demand(hz >= 500.0, Key::tick_hz, hz, "be at least 500 with law = \"servo\", or law = \"paper\"")?;
        let delay_ticks = (f64::from(p.servo_delay_s) * hz).min(MOST_HOSE_DELAY_TICKS as f64) as u8;
        Ok(Self {
            hz,
            t,
            w: f64::from(p.servo_bandwidth_rad_per_s),
            observer_w: f64::from(p.servo_observer_rad_per_s),
            force_rate: f64::from(p.servo_force_rate_per_s),
            coulomb: f64::from(p.servo_coulomb_m_per_s2),
            viscous: f64::from(p.servo_viscous_per_s),
            // Where the format of `bristle_q24` ends a piston sticks by its bristles as good as rigidly within a tick.
            bristle: f64::from(p.servo_bristle_per_s2).min(STIFFEST * hz * hz),
            delay_ticks,
            lag_s: f64::from(p.servo_lag_s) + (f64::from(p.servo_delay_s) - f64::from(delay_ticks) * t),
            slips: p.servo_stick_slip,
        })
    }

    /// A time in whole ticks.
    pub(crate) fn ticks(&self, time_s: f64) -> u16 {
        (time_s * self.hz) as u16
    }
}
