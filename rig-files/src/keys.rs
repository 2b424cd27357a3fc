//! The keys of the rig file: where each value lives, its unit and how far it may plausibly go.

use plant_model::Rig;

/// One numeric key of the rig file.
#[derive(Clone, Copy, Debug)]
pub struct RigKey {
    /// The TOML table, e.g. `load`.
    pub table: &'static str,
    /// The key in the table, e.g. `mass_kg`; unique over all tables.
    pub name: &'static str,
    /// The full name, e.g. `load.mass_kg`.
    pub path: &'static str,
    /// SI unit, empty for a ratio.
    pub unit: &'static str,
    /// Smallest value that can belong to a pneumatic positioner; anything below is a wrong unit.
    pub low: f64,
    /// Largest such value.
    pub high: f64,
    slot: fn(&mut Rig<f64>) -> &mut f64,
}

impl RigKey {
    /// The value in a rig.
    #[must_use]
    pub fn get(&self, rig: &Rig<f64>) -> f64 {
        let mut copy = *rig;
        *(self.slot)(&mut copy)
    }

    /// Sets the value in a rig; the result wants [`Rig::validate`].
    pub fn set(&self, rig: &mut Rig<f64>, value: f64) {
        *(self.slot)(rig) = value;
    }
}

macro_rules! rig_keys {
    ($($table:ident.$name:ident [$unit:literal] $low:literal..$high:literal),+ $(,)?) => {
        /// Every numeric key of the rig file in the order it is written.
        pub const RIG_KEYS: &[RigKey] = &[$(RigKey {
            table: stringify!($table),
            name: stringify!($name),
            path: concat!(stringify!($table), ".", stringify!($name)),
            unit: $unit,
            low: $low,
            high: $high,
            slot: |rig| &mut rig.$table.$name,
        }),+];
    };
}

// The bounds are wide: two decades or more beyond anything sold. They catch bar for Pa, mm for m, g for kg, cm2 for m2.
rig_keys! {
    gas.gas_constant_j_per_kg_k ["J/(kg K)"] 10.0..5000.0,
    gas.temperature_k ["K"] 150.0..600.0,
    gas.heat_capacity_ratio [""] 1.0..2.0,
    supply.pressure_pa ["Pa"] 2.0e4..1.0e8,
    supply.atmosphere_pa ["Pa"] 1.0e3..2.0e6,
    valve.fill_coefficient_kg_per_s_pa ["kg/(s Pa)"] 1.0e-13..1.0e-4,
    valve.exhaust_coefficient_kg_per_s_pa ["kg/(s Pa)"] 1.0e-13..1.0e-4,
    valve.dead_zone_right_v ["V"] -1.0e3..1.0e3,
    valve.dead_zone_left_v ["V"] -1.0e3..1.0e3,
    valve.slope_right [""] 1.0e-3..1.0e3,
    valve.slope_left [""] 1.0e-3..1.0e3,
    valve.max_voltage_v ["V"] 1.0e-3..1.0e3,
    cylinder.area_m2 ["m2"] 1.0e-7..1.0,
    cylinder.stroke_m ["m"] 1.0e-3..20.0,
    cylinder.volume_a0_m3 ["m3"] 1.0e-9..10.0,
    cylinder.volume_b0_m3 ["m3"] 1.0e-9..10.0,
    load.mass_kg ["kg"] 1.0e-3..1.0e5,
    friction.stiffness_n_per_m ["N/m"] 1.0..1.0e10,
    friction.damping_n_s_per_m ["N s/m"] 0.0..1.0e7,
    friction.viscous_n_s_per_m ["N s/m"] 0.0..1.0e7,
    friction.coulomb_n ["N"] 1.0e-6..1.0e6,
    friction.static_n ["N"] 1.0e-6..1.0e6,
    friction.stribeck_velocity_m_per_s ["m/s"] 1.0e-7..10.0,
    friction.breakaway_m ["m"] 0.0..1.0e-1,
}

/// Looks a key up by its full name (`load.mass_kg`) or by its plain one (`mass_kg`).
#[must_use]
pub fn rig_key(name: &str) -> Option<&'static RigKey> {
    RIG_KEYS.iter().find(|key| key.path == name || key.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn plain_key_names_are_unique_so_that_a_tolerance_can_use_them() {
        let names: HashSet<_> = RIG_KEYS.iter().map(|key| key.name).collect();
        assert_eq!(names.len(), RIG_KEYS.len());
    }

    #[test]
    fn the_papers_values_lie_inside_the_plausible_bounds() {
        for rig in [Rig::paper_a(), Rig::paper_b(), Rig::paper_c()] {
            for key in RIG_KEYS {
                assert!((key.low..=key.high).contains(&key.get(&rig)), "{}", key.path);
            }
        }
    }

    #[test]
    fn set_then_get_returns_the_value_for_every_key() {
        for key in RIG_KEYS {
            let mut rig = Rig::paper_a();
            key.set(&mut rig, 0.125);
            assert_eq!(key.get(&rig), 0.125, "{}", key.path);
        }
    }
}
