//! One rule from the rig's nominal numbers to every constant of the law.

use super::reference::Limits;
use control::Parameters;
use control::servo::constants::*;
use plant_model::Rig;
use rig_files::tuning::{Pneumatics, Rule, STIFFER};

/// Every constant of the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning {
    /// Tick, s.
    pub tick_s: f64,
    /// Limits of the reference.
    pub limits: Limits,
    /// Bandwidth of the law `w`, rad/s.
    pub law_w: f64,
    /// Bandwidth that delay and lag allow over the one that the air's jerk allows.
    pub keeps_up: f64,
    /// Bandwidth of the observer `w_o`, rad/s.
    pub observer_w: f64,
    /// How fast the estimated force follows the measured one, 1/s.
    pub force_rate: f64,
    /// Moving mass, kg.
    pub mass: f64,
    /// Bristle stiffness, N/m.
    pub bristle_stiffness: f64,
    /// Viscous friction, N s/m.
    pub viscous: f64,
    /// Nominal Coulomb friction, N.
    pub coulomb: f64,
    /// Part of the nominal Coulomb friction that is compensated before any is learned.
    pub coulomb_start: f64,
    /// Coulomb friction compensated at most where pressures are not measured, N.
    pub unseen_coulomb: f64,
    /// How fast Coulomb friction is learned in slow motion towards a standing target, 1/s.
    pub slow_learn: f64,
    /// Loads that the supply can hold, N.
    pub load_bounds: [f64; 2],
    /// Ticks after a run begins in which the piston still stands.
    pub standing_ticks: u32,
    /// Part of the Coulomb friction that is unlearned each time that the piston passes a standing target.
    pub unlearn: f64,
    /// Lag of the spool, and what of the hoses' delay is no whole tick, s.
    pub lag_s: f64,
    /// Time by which the stiffness's force is led, s.
    pub lead_s: f64,
    /// Whether the piston slips as it breaks away.
    pub stick_slip: bool,
    /// Lag of the spool alone, s.
    pub valve_lag_s: f64,
    /// Delay of the command by the hoses, ticks.
    pub delay_ticks: usize,
    /// Nominal half-width of the dead zone, V, to the right and to the left of its middle.
    pub zone_v: [f64; 2],
    /// Middle of the dead zone, V.
    pub centre_v: f64,
    /// Largest command, V.
    pub most_v: f64,
    /// Angle below which the dead zone is crossed on a straight line, rad.
    pub blend: f64,
    /// Rates of learning, 1/s: gain, dead zone, friction.
    pub learn: [f64; 3],
    /// Hold: enter below this error and leave beyond that, m.
    pub hold_m: [f64; 2],
    /// Hold: enter below this speed, m/s.
    pub hold_speed: f64,
    /// Hold: ticks of rest before entering.
    pub hold_ticks: u32,
    /// Hold: change of force that may have moved the piston, N.
    pub hold_force: f64,
    /// Hold: force below the Coulomb friction within which the piston counts as held, N.
    pub hold_margin: f64,
    /// Hold: force within which the piston counts as held where friction is not told from noise, N.
    pub hold_band: f64,
    /// Hold: ticks after entering within which the piston may still coast.
    pub coast_ticks: u32,
    /// Hold: ticks after entering until the spool stands in the middle and the means have followed.
    pub settle_ticks: u32,
    /// Hold: ticks after entering within which the place is on trial.
    pub trial_ticks: u32,
    /// Hold: part of the error to leave at beyond which the long mean leaves a place on trial.
    pub trial: f64,
    /// Hold: change of the mean force that noise may feign, over the noise of one tick.
    pub doubt: f64,
    /// Hold: how fast the noise of the force is learned, 1/s.
    pub force_noise_rate: f64,
    /// Stick: mean speed below which the piston sticks, m/s.
    pub stick_speed: f64,
    /// Stick: ticks before the force is led.
    pub stick_ticks: u32,
    /// Stick: rate of force over that of the law.
    pub stick_gain: f64,
    /// Stick: how fast the force follows, 1/s.
    pub stick_force_rate: f64,
    /// Stall: growth of the force that any friction takes, N.
    pub stall_force: f64,
    /// Stall: ticks with more than that until the piston counts as blocked.
    pub stall_ticks: u32,
    /// Stall: how fast the force grows then, N/s.
    pub stall_rate: f64,
    /// Hold: weight of a new value in the means of error, speed and force.
    pub hold_weights: [f64; 3],
    /// Deceleration of the reference from which it counts as braking, m/s2.
    pub braking: f64,
    /// Distance of the reference from the piston up to which it may brake as planned, m.
    pub near_m: f64,
    /// Distance of the reference from its target at which it has arrived, m.
    pub arrived_m: f64,
    /// Hold: weight of a new value in the long mean of the error.
    pub slow_weight: f64,
}

impl Tuning {
    /// The rule; `lag_s` is the lag of the valve's spool.
    #[must_use]
    pub fn of(rig: &Rig<f64>, lag_s: f64, tick_s: f64) -> Self {
        let (valve, friction) = (&rig.valve, &rig.friction);
        let Rule { speed, acceleration, jerk, law_w, observer_w, lead_s, bandwidths, .. } =
            Rule::of(rig, lag_s, tick_s);
        let stick_slip = rig_files::tuning::stick_slip(rig);
        // The velocity of a slipping piston is a difference of positions, and noisier.
        let mean_s = if stick_slip { SLIPPING_MEAN_S } else { MEAN_S };
        let Pneumatics { delay_s, areas_m2: [area_a, area_b], .. } = Pneumatics::of(rig);
        let (supply, atmosphere) = (rig.supply.pressure_pa, rig.supply.atmosphere_pa);
        let delay_ticks = (delay_s / tick_s).min(MOST_HOSE_DELAY_TICKS as f64) as usize;
        let centre_v = (valve.dead_zone_right_v + valve.dead_zone_left_v) / 2.0;
        let half_v = (valve.dead_zone_right_v - valve.dead_zone_left_v) / 2.0;
        let force_rate = f64::from(Parameters::default().servo_force_rate_per_s);
        Self {
            tick_s,
            limits: Limits { speed, acceleration, jerk },
            law_w,
            keeps_up: bandwidths[0] / bandwidths[1],
            observer_w,
            force_rate,
            mass: rig.load.mass_kg,
            bristle_stiffness: STIFFER * friction.stiffness_n_per_m,
            viscous: friction.viscous_n_s_per_m,
            coulomb: friction.coulomb_n,
            coulomb_start: if stick_slip { SLIPPING_COULOMB_START } else { COULOMB_START },
            unseen_coulomb: UNSEEN_COULOMB_START * friction.coulomb_n,
            slow_learn: SLOW_LEARN,
            load_bounds: [area_b * atmosphere - area_a * supply, area_b * supply - area_a * atmosphere],
            standing_ticks: (STANDING_S / tick_s) as u32,
            unlearn: UNLEARN,
            // What is no whole tick the lag takes up.
            lag_s: lag_s + delay_s - delay_ticks as f64 * tick_s,
            lead_s,
            stick_slip,
            valve_lag_s: lag_s,
            delay_ticks,
            zone_v: [half_v; 2],
            centre_v,
            most_v: valve.max_voltage_v,
            blend: BLEND,
            learn: [LEARN[0], LEARN[1], LEARN[1]],
            hold_m: HOLD_M,
            hold_speed: HOLD_SPEED,
            hold_ticks: (REST_S / tick_s) as u32,
            hold_force: MOVING * friction.coulomb_n,
            hold_margin: HELD * friction.coulomb_n,
            hold_band: HELD_DEVIATIONS
                * rig.load.mass_kg
                * observer_w.powi(2)
                * (3.0 / 16.0 * observer_w * tick_s).sqrt()
                * 1e-6
                * QUIET_UM,
            coast_ticks: (COAST_S / tick_s) as u32,
            settle_ticks: (SETTLE_S / tick_s) as u32,
            trial_ticks: (TRIAL_S / tick_s) as u32,
            trial: LEAVE[0],
            doubt: DOUBT * (tick_s / (1.0 / force_rate + FORCE_MEAN_S)).sqrt(),
            force_noise_rate: FORCE_NOISE_RATE,
            stick_speed: STICK_SPEED,
            stick_ticks: (REST_S / tick_s) as u32,
            stick_gain: if stick_slip { SLIPPING_STICK_GAIN } else { STICK_GAIN },
            stick_force_rate: law_w * STICK_FORCE,
            // From one end of the friction to the other, and half as much again, or what makes a free piston turn round
            // and leave its place meanwhile.
            stall_force: 2.0 * friction.coulomb_n
                + friction.coulomb_n.max(rig.load.mass_kg * 8.0 * STANDS_M / (STALL_S * STALL_S)),
            stall_ticks: (STALL_S / tick_s) as u32,
            stall_rate: area_a * (supply - atmosphere) / STALL_GROWTH_S,
            hold_weights: [mean_s, mean_s, FORCE_MEAN_S].map(|mean_s| tick_s / mean_s),
            braking: BRAKING * acceleration,
            near_m: ERROR_M,
            arrived_m: ARRIVED_M,
            slow_weight: tick_s / LONG_MEAN_S,
        }
    }

    /// The same with hold and stick judging `scale` times as coarsely, for a noisier position.
    #[must_use]
    pub fn coarser(mut self, scale: f64) -> Self {
        self.hold_m = self.hold_m.map(|limit| scale * limit);
        self.hold_speed *= scale;
        self.stick_speed *= scale;
        self
    }
}

/// Bandwidths of the law that delay and lag allow, and that the air's jerk allows, rad/s.
#[must_use]
pub fn law_bandwidths(rig: &Rig<f64>, lag_s: f64, tick_s: f64) -> [f64; 2] {
    Rule::of(rig, lag_s, tick_s).bandwidths
}
