//! What is measured on the synthetic rig.

/// What ideal sensors show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Position, m.
    pub y_m: f64,
    /// Pressure in A, Pa absolute.
    pub p_a_pa: f64,
    /// Pressure in B, Pa absolute.
    pub p_b_pa: f64,
    /// Supply pressure, Pa absolute.
    pub p_sup_pa: f64,
}
