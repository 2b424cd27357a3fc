//! The units a foreign table may use, per column.

const TIME: &[&str] = &["t_s"];
const LENGTH: &[&str] = &["y_m", "y_ref_m"];
const PRESSURE: &[&str] = &["p_a_pa", "p_b_pa", "p_sup_pa"];
const VOLTAGE: &[&str] = &["u_v"];
const FORCE: &[&str] = &["f_ext_n"];

/// Columns, unit, factor to SI.
pub(super) const UNITS: &[(&[&str], &str, f64)] = &[
    (TIME, "s", 1.0),
    (TIME, "ms", 1.0e-3),
    (TIME, "us", 1.0e-6),
    (TIME, "min", 60.0),
    (LENGTH, "m", 1.0),
    (LENGTH, "cm", 1.0e-2),
    (LENGTH, "mm", 1.0e-3),
    (LENGTH, "um", 1.0e-6),
    (LENGTH, "in", 0.0254),
    (PRESSURE, "Pa", 1.0),
    (PRESSURE, "hPa", 1.0e2),
    (PRESSURE, "mbar", 1.0e2),
    (PRESSURE, "kPa", 1.0e3),
    (PRESSURE, "bar", 1.0e5),
    (PRESSURE, "MPa", 1.0e6),
    (PRESSURE, "psi", 6_894.757_293_168),
    (VOLTAGE, "V", 1.0),
    (VOLTAGE, "mV", 1.0e-3),
    (FORCE, "N", 1.0),
    (FORCE, "kN", 1.0e3),
    (FORCE, "lbf", 4.448_221_615_260_5),
    (FORCE, "kgf", 9.806_65),
];

/// The factor of a unit for a column of the log.
pub(super) fn unit_factor(column: &str, unit: &str) -> Option<f64> {
    UNITS.iter().find(|(columns, name, _)| columns.contains(&column) && *name == unit).map(|(_, _, factor)| *factor)
}
