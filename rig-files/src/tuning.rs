//! The one rule from a rig's nominal numbers to the limits and bandwidths of the positioning law; `docs/control-law.md` derives it.

use crate::rig_file::RigFile;
use plant_model::{Effect, Rig};

/// Lag of a fast proportional valve, for a rig file that has no effect `valve-lag`, s.
pub const USUAL_LAG_S: f64 = 1.7e-3;

/// Lag of the valve's spool as the rig file has it, else [`USUAL_LAG_S`], s.
#[must_use]
pub fn lag_s(rig: &RigFile) -> f64 {
    rig.effects.get(Effect::ValveLag).map_or(USUAL_LAG_S, |values| values[0])
}

/// Limits and bandwidths for a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Highest speed of the reference, m/s.
    pub speed: f64,
    /// Highest acceleration of the reference, m/s2.
    pub acceleration: f64,
    /// Highest jerk of the reference, m/s3.
    pub jerk: f64,
    /// Bandwidth of the law that delay and lag allow, and that the air's jerk allows for an error of half a millimetre, rad/s.
    pub bandwidths: [f64; 2],
    /// Bandwidth of the law, rad/s.
    pub law_w: f64,
    /// Bandwidth of the observer, rad/s.
    pub observer_w: f64,
}

impl Rule {
    /// For a valve whose spool lags by `lag_s`, at a tick of `tick_s`.
    #[must_use]
    pub fn of(rig: &Rig<f64>, lag_s: f64, tick_s: f64) -> Self {
        let (gas, valve, cylinder) = (&rig.gas, &rig.valve, &rig.cylinder);
        let p = rig.equilibrium_pressure_pa();
        let area = cylinder.mean_area_m2();
        let stiffness =
            gas.heat_capacity_ratio * area * area * p * (1.0 / cylinder.volume_a0_m3 + 1.0 / cylinder.volume_b0_m3);
        let natural_w = (stiffness / rig.load.mass_kg).sqrt();
        let centre_v = (valve.dead_zone_right_v + valve.dead_zone_left_v) / 2.0;
        let half_v = (valve.dead_zone_right_v - valve.dead_zone_left_v) / 2.0;
        let angle = (2.0 * (valve.max_voltage_v - centre_v.abs() - half_v)).atan();
        let flow = gas.gas_constant_j_per_kg_k * gas.temperature_k * rig.linear_coefficients_kg_per_s_pa()[0];
        // What the flow holds up, and the jerk it gives.
        let speed = flow * (rig.supply.pressure_pa - p) * angle / (area * p);
        let jerk = speed * natural_w * natural_w;
        let bandwidths = [0.32 / (1.5 * tick_s + lag_s), (jerk / 0.5e-3).cbrt()];
        let law_w = bandwidths[0].min(bandwidths[1]);
        Self {
            speed: 0.85 * speed,
            acceleration: 0.65 * speed * natural_w,
            jerk: 0.51 * jerk,
            bandwidths,
            law_w,
            observer_w: 1.7 * law_w,
        }
    }
}

/// How fast the estimated force follows the measured one, 1/s: bounded by the noise of the pressures.
pub const FORCE_RATE: f64 = 375.0;
