//! What the air in both chambers does at one instant.

/// The air at this tick: how the force answers to the valve and to motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Stiffness `K = gamma (A_a² p_a/V_a + A_b² p_b/V_b)`, N/m.
    pub stiffness: f64,
    /// Force slope while chamber A is filled, N/(s rad).
    pub slope_fill_a: f64,
    /// Force slope while chamber B is filled, N/(s rad).
    pub slope_fill_b: f64,
}
