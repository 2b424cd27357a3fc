//! What the sensors measure.

/// What a data logger would record, before noise and quantisation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurement<R> {
    /// Position, m.
    pub y_m: R,
    /// Pressure of chamber A, Pa absolute.
    pub p_a_pa: R,
    /// Pressure of chamber B, Pa absolute.
    pub p_b_pa: R,
    /// Supply pressure, Pa absolute.
    pub p_sup_pa: R,
}
