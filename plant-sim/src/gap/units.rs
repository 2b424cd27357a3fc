//! SI values in the units a technician reads.

use diagnosis::Estimate;
use plant_model::Effect;

/// Factor and unit for a key that ends in its SI unit; the key itself where nothing reads better.
fn scale(name: &str) -> (f64, &'static str) {
    // Longest endings first: `_kg_per_s_pa` also ends in `_pa`.
    const UNITS: [(&str, f64, &str); 20] = [
        ("_m3_per_s_pa", 1.0e8, "l/(s bar)"),
        ("_kg_per_s_pa", 1.0e8, "g/s per bar"),
        ("_pa_s_per_kg", 1.0e-8, "bar per g/s"),
        ("_n_per_pa", 1.0e5, "N/bar"),
        ("_n_s_per_m", 1.0, "N s/m"),
        ("_n_per_m", 1.0e-3, "N/mm"),
        ("_j_per_kg_k", 1.0, "J/(kg K)"),
        ("_w_per_m2_k", 1.0, "W/(m²K)"),
        ("_m_per_s", 1.0e3, "mm/s"),
        ("_m3", 1.0e6, "cm³"),
        ("_m2", 1.0e4, "cm²"),
        ("_pa", 1.0e-5, "bar"),
        ("_kg", 1.0, "kg"),
        ("_hz", 1.0, "Hz"),
        ("_n", 1.0, "N"),
        ("_s", 1.0e3, "ms"),
        ("_m", 1.0e3, "mm"),
        ("_v", 1.0, "V"),
        ("_k", 1.0, "K"),
        ("_deg", 1.0, "°"),
    ];
    UNITS.iter().find(|(ending, ..)| name.ends_with(ending)).map_or((1.0, ""), |(_, factor, unit)| (*factor, unit))
}

fn join(text: String, unit: &str) -> String {
    if unit.is_empty() { text } else { format!("{text} {unit}") }
}

/// A value under a key such as `conductance_kg_per_s_pa`, e.g. `0.0200 g/s per bar`.
#[must_use]
pub fn quantity(name: &str, value: f64) -> String {
    let (factor, unit) = scale(name);
    join(significant(value * factor, 4), unit)
}

/// A value with its standard error, e.g. `0.0200 ± 0.0001 g/s per bar`.
#[must_use]
pub fn with_error(name: &str, value: f64, std_error: f64) -> String {
    let (factor, unit) = scale(name);
    if !(std_error.is_finite() && std_error > 0.0) {
        return quantity(name, value);
    }
    let error = std_error * factor;
    // Two digits of the error, and the value to the same place.
    let decimals = (1.0 - error.log10().floor()).clamp(0.0, 9.0) as usize;
    join(format!("{:.decimals$} ± {error:.decimals$}", value * factor), unit)
}

/// A parameter of an effect as the log tells it. A standard error wider than all that the parameter may be says that the log
/// does not determine it: a dead zone beyond any command that was given, for instance.
#[must_use]
pub(crate) fn estimate(effect: &str, found: &Estimate) -> String {
    let parameters = Effect::from_id(effect).map(|effect| effect.info().parameters).unwrap_or_default();
    let within = parameters.iter().find(|p| p.name == found.name).map_or(f64::INFINITY, |p| p.max - p.min);
    if found.std_error > within {
        return "not determined by this log".to_string();
    }
    with_error(&found.name, found.value, found.std_error)
}

/// A number with so many significant digits, without an exponent where it can be avoided.
#[must_use]
pub(crate) fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "–".to_string();
    }
    if value == 0.0 {
        return "0".to_string();
    }
    let magnitude = value.abs().log10().floor() as i32;
    if !(-6..=9).contains(&magnitude) {
        return format!("{value:.*e}", (digits - 1).max(0) as usize);
    }
    format!("{value:.*}", (digits - 1 - magnitude).max(0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_shown_in_the_units_of_the_workshop() {
        assert_eq!(quantity("conductance_kg_per_s_pa", 2.0e-10), "0.02000 g/s per bar");
        assert_eq!(quantity("valve.fill_conductance_m3_per_s_pa", 1.3765e-8), "1.377 l/(s bar)");
        assert_eq!(quantity("delay_s", 0.0042), "4.200 ms");
        assert_eq!(quantity("scale", 0.8), "0.8000");
        assert_eq!(with_error("offset_pa", 2.0e4, 1.23e2), "0.2000 ± 0.0012 bar");
        assert_eq!(with_error("mass_kg", 12.3456, f64::NAN), "12.35 kg");
        assert_eq!(quantity("offset_pa", f64::NAN), "– bar");
    }

    #[test]
    fn what_a_log_does_not_determine_is_not_told_as_a_value() {
        let found = |std_error| Estimate { name: "right_v".into(), value: 0.2, std_error };
        assert_eq!(estimate("valve-dead-zone", &found(0.011)), "0.200 ± 0.011 V");
        assert_eq!(estimate("valve-dead-zone", &found(328.0)), "not determined by this log");
        assert_eq!(estimate("valve-dead-zone", &found(f64::NAN)), "0.2000 V");
    }
}
