//! Nominal parameters with all effects folded in.

use crate::dead_zone::DeadZone;

/// Everything the right-hand side needs, effects included. Built by `Plant::new`, changed by effects only.
///
/// Public so that a single balance can be evaluated against measured signals with the very same coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients<R> {
    /// Polytropic exponent of both balances: gamma, or n under `heat-transfer`.
    pub exponent: R,
    /// Atmospheric pressure, Pa absolute.
    pub atmosphere_pa: R,
    /// Nominal supply pressure, Pa absolute.
    pub supply_pa: R,
    /// Dead zone of the valve.
    pub dead_zone: DeadZone<R>,
    /// Largest command magnitude the valve follows, V.
    pub max_voltage_v: R,
    /// First-order time constant of the spool, s; 0 for none.
    pub spool_time_constant_s: R,
    /// Half-width of the command play, V.
    pub play_half_width_v: R,
    /// Delay of the command, s.
    pub line_delay_s: R,
    /// `beta_fill`, kg/(s Pa).
    pub fill: R,
    /// `beta_exh`, kg/(s Pa).
    pub exhaust: R,
    /// Critical ratio and conductance scale of the ISO 6358 law; absent for the paper's linear law.
    pub choked: Option<(R, R)>,
    /// Supply pressure lost per mass flow, Pa s/kg.
    pub droop_pa_s_per_kg: R,
    /// Recovery time constant of the supply, s.
    pub droop_time_constant_s: R,
    /// Leak conductance from A to B, kg/(s Pa).
    pub leak_cross: R,
    /// Leak conductance from A to atmosphere, kg/(s Pa).
    pub leak_a: R,
    /// Leak conductance from B to atmosphere, kg/(s Pa).
    pub leak_b: R,
    /// Piston area, m2.
    pub area_m2: R,
    /// Half the stroke, m.
    pub half_stroke_m: R,
    /// Volume of chamber A at mid-stroke, m3.
    pub volume_a0_m3: R,
    /// Volume of chamber B at mid-stroke, m3.
    pub volume_b0_m3: R,
    /// Moving mass, kg.
    pub mass_kg: R,
    /// Constant force opposing positive motion, N.
    pub constant_force_n: R,
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
    /// Relative friction asymmetry.
    pub asymmetry: R,
    /// Relative change of friction per metre, 1/m.
    pub position_slope: R,
    /// Relative amplitude of periodic friction.
    pub position_amplitude: R,
    /// Wave number of periodic friction, rad/m.
    pub position_wave_number: R,
    /// Friction per sum of gauge pressures, N/Pa.
    pub pressure_friction: R,
    /// Gain of the position sensor.
    pub position_scale: R,
    /// Offset of pressure sensor A, Pa.
    pub pressure_a_offset_pa: R,
    /// Offset of pressure sensor B, Pa.
    pub pressure_b_offset_pa: R,
    /// Time constant of both pressure sensors, s; 0 for none.
    pub pressure_time_constant_s: R,
    /// Delay of the position signal, s.
    pub position_delay_s: R,
}
