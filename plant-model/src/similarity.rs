//! Similarity: a rig of another cross-section, whose masses, forces and flows are larger in proportion, moves alike at the same
//! pressures.
//!
//! In `dp/dt = n (R T w - p A v) / V` and `M dv/dt = A_a p_a - A_b p_b - F` a common factor on areas, volumes, masses, flows and
//! forces cancels. So no log tells that factor; only what is known of the rig does.

/// How a quantity changes with the cross-section, as the exponent of its factor, from the SI unit that ends its name: 1 for areas,
/// volumes, masses, forces and flows and for what is one of them per length, speed or pressure; -1 for the reciprocal of a flow;
/// else 0, as for pressures, lengths, times, voltages and ratios.
#[must_use]
pub fn size_exponent(name: &str) -> i8 {
    const GROWS: [&str; 9] =
        ["_m2", "_m3", "_kg", "_n", "_n_per_m", "_n_s_per_m", "_n_per_pa", "_kg_per_s_pa", "_m3_per_s_pa"];
    if name.ends_with("_pa_s_per_kg") { -1 } else { i8::from(GROWS.iter().any(|unit| name.ends_with(unit))) }
}
