//! Nominal parameters with all effects folded in.

use crate::dead_zone::DeadZone;
use crate::hose::Throttle;
use crate::tube::Tube;

/// Everything the right-hand side needs, effects included. Built by `Plant::new`, changed by effects only: they change
/// the coefficients of the paper's model, or set those of a term of their own.
///
/// Public so that a single balance can be evaluated against measured signals with the very same coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients<R> {
    /// Polytropic exponent of both balances: gamma, or n under `heat-transfer`.
    pub exponent: R,
    /// Temperature of the supply and of the walls, K.
    pub temperature_k: R,
    /// Atmospheric pressure, Pa absolute.
    pub atmosphere_pa: R,
    /// Nominal supply pressure, Pa absolute.
    pub supply_pa: R,
    /// Dead zone of the valve.
    pub dead_zone: DeadZone<R>,
    /// By how much the paths to atmosphere open later than those from the supply, V.
    pub exhaust_overlap_v: R,
    /// Largest command magnitude the valve follows, V.
    pub max_voltage_v: R,
    /// The valve's paths to and from chamber A.
    pub valve_a: ValvePaths<R>,
    /// The valve's paths to and from chamber B.
    pub valve_b: ValvePaths<R>,
    /// Piston area towards chamber A, m2.
    pub area_a_m2: R,
    /// Piston area towards chamber B, m2; 0 for a single-acting cylinder, whose chamber B breathes freely.
    pub area_b_m2: R,
    /// Half the stroke, m.
    pub half_stroke_m: R,
    /// Volume of chamber A at mid-stroke, m3.
    pub volume_a0_m3: R,
    /// Volume of chamber B at mid-stroke, m3.
    pub volume_b0_m3: R,
    /// Rate of the spring in chamber B, N/m; 0 for a double-acting cylinder.
    pub spring_n_per_m: R,
    /// The spring's force with the piston at `−L/2`, N.
    pub spring_preload_n: R,
    /// Inertia of a spool that lags, `1 / (4 ζ²)`; 0 for a lag of first order.
    pub spool_inertia: R,
    /// How late the air at the ends of the hoses of A and B follows the spool, s.
    pub hose_delays_s: [R; 2],
    /// Moving mass, kg.
    pub mass_kg: R,
    /// What the moving mass presses against positive motion, m/s2: gravity along the incline.
    pub gravity_m_per_s2: R,
    /// `sigma0`, N/m.
    pub stiffness: R,
    /// `sigma1`, N s/m.
    pub damping: R,
    /// `sigma2`, N s/m.
    pub viscous: R,
    /// `F_c`, N.
    pub coulomb_n: R,
    /// `F_s`, N.
    pub static_n: R,
    /// `v_s`, m/s.
    pub stribeck_velocity_m_per_s: R,
    /// `z_ba`, m.
    pub breakaway_m: R,
}

/// The paths between the valve's ports and one chamber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValvePaths<R> {
    /// `beta_fill`; under ISO 6358 the mass conductance. kg/(s Pa) per rad of opening.
    pub fill: R,
    /// `beta_exh`; under ISO 6358 the mass conductance. kg/(s Pa) per rad of opening.
    pub exhaust: R,
    /// Critical pressure ratios of filling and exhausting, where the valve follows ISO 6358 by itself.
    pub critical_ratios: Option<[R; 2]>,
    /// The hose, if it is described.
    pub hose: Option<Tube<R>>,
    /// What throttles the line behind it.
    pub line: Option<Throttle<R>>,
    /// The cushion at the chamber's end, if it has one: its length in m, and its needle.
    pub cushion: Option<(R, Throttle<R>)>,
}
