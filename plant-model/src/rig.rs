//! The rig: the paper's Tables 1 and 2 as one set of nominal parameters.
//!
//! The table in this file is the only place where a key, its unit, its value in the paper's case (a), its range and its
//! meaning are stated: structs, checks, rig file, tolerances and the board's parameters are made of it.

use crate::real::Real;
pub use parameter_table::{Limits, Must, ParameterError};

macro_rules! rig {
    ($(
        $(#[$about:meta])*
        $table:ident: $Table:ident {
            $($(#[doc = $meaning:literal])+ $name:ident = $paper_a:literal, $unit:literal, $low:literal => $high:literal;)+
        }
    )+) => {
        /// Nominal parameters of valve, cylinder, load and friction. SI units, absolute pressures.
        ///
        /// The field names are the keys of the rig file.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Rig<R> {
            $($(#[$about])* pub $table: $Table<R>,)+
        }

        $(
            $(#[$about])*
            #[derive(Clone, Copy, Debug, PartialEq)]
            pub struct $Table<R> {
                $($(#[doc = $meaning])+
                #[doc = concat!("\n\nFrom `", stringify!($low), "` to `", stringify!($high), "` ", $unit, "; case (a): `", stringify!($paper_a), "`.")]
                pub $name: R,)+
            }
        )+

        /// The place of a key in [`RIG_KEYS`], by its plain name.
        #[allow(non_camel_case_types, missing_docs, reason = "written as in files, explained in the structs")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Place {
            $($($name,)+)+
        }

        /// Every numeric key of the rig file, in the order it is written.
        pub const RIG_KEYS: &[RigKey; [$($(stringify!($name)),+),+].len()] = &[$($(RigKey {
            limits: Limits::new($unit, $low, $high),
            ..named(concat!(stringify!($table), ".", stringify!($name)), stringify!($table).len(), Place::$name)
        }),+),+];

        impl RigKey {
            /// What the value is.
            #[must_use]
            pub const fn meaning(&self) -> &'static str {
                match self.place {
                    // A doc comment's text begins with a blank.
                    $($(Place::$name => const { concat!($($meaning),+).trim_ascii_start() },)+)+
                }
            }

            /// The value in a rig.
            #[must_use]
            pub fn get<R: Real>(&self, rig: &Rig<R>) -> R {
                match self.place {
                    $($(Place::$name => rig.$table.$name,)+)+
                }
            }

            /// Sets the value in a rig; the result wants [`Rig::validate`].
            pub fn set<R: Real>(&self, rig: &mut Rig<R>, value: R) {
                match self.place {
                    $($(Place::$name => rig.$table.$name = value,)+)+
                }
            }
        }

        impl<R: Real> Rig<R> {
            /// The paper's case (a): bore 25 mm, stroke 1 m; Tables 1 and 2, missing values as stated in `docs/model.md`.
            #[must_use]
            pub fn paper_a() -> Self {
                Self { $($table: $Table { $($name: R::of($paper_a),)+ },)+ }
            }

            /// All values, in the order of [`RIG_KEYS`].
            #[must_use]
            pub fn numbers(&self) -> [R; RIG_KEYS.len()] {
                [$($(self.$table.$name),+),+]
            }

            /// The rig of all values, in the order of [`RIG_KEYS`]; wants [`Rig::validate`].
            #[must_use]
            pub fn from_numbers(numbers: &[R; RIG_KEYS.len()]) -> Self {
                let [$($($name),+),+] = *numbers;
                Self { $($table: $Table { $($name,)+ },)+ }
            }
        }
    };
}

// The ranges are wide: two decades or more beyond anything sold. They catch bar for Pa, mm for m, g for kg, cm2 for m2.
rig! {
    /// Properties of the working gas (Table 1).
    gas: Gas {
        /// Specific gas constant `R`.
        gas_constant_j_per_kg_k = 287.0, "J/(kg K)", 1.0 => 1.0e4;
        /// Supply air temperature `T`.
        temperature_k = 293.0, "K", 150.0 => 600.0;
        // 1 is no gas but an isothermal process; and nearer to it, `γ / (γ − 1)` of choked flow loses its digits in f32.
        /// Ratio of specific heats `γ`.
        heat_capacity_ratio = 1.4, "", 1.001 => 2.0;
    }
    /// Pressures outside the cylinder (Table 1).
    supply: Supply {
        /// Supply pressure `p_sup`, absolute; above `atmosphere_pa`.
        pressure_pa = 7.0e5, "Pa", 2.0e4 => 1.0e8;
        /// Atmospheric pressure `p_atm`, absolute.
        atmosphere_pa = 1.0e5, "Pa", 1.0e3 => 2.0e6;
    }
    /// The proportional 5/3 valve: dead zone (3.1) and flow coefficients (3.3).
    valve: Valve {
        /// `β` towards a chamber ("ench").
        fill_coefficient_kg_per_s_pa = 0.69501e-8, "kg/(s Pa)", 1.0e-13 => 1.0e-4;
        /// `β` from a chamber to atmosphere ("esv").
        exhaust_coefficient_kg_per_s_pa = 0.898105e-8, "kg/(s Pa)", 1.0e-13 => 1.0e-4;
        /// Right break-point of the dead zone `z_md`.
        dead_zone_right_v = 0.0, "V", -1.0e3 => 1.0e3;
        /// Left break-point of the dead zone `z_me`; not above the right one.
        dead_zone_left_v = 0.0, "V", -1.0e3 => 1.0e3;
        /// Slope right of the dead zone `md`.
        slope_right = 1.0, "", 1.0e-3 => 1.0e3;
        /// Slope left of the dead zone `me`.
        slope_left = 1.0, "", 1.0e-3 => 1.0e3;
        /// Largest command magnitude the valve follows; beyond it the command saturates.
        max_voltage_v = 5.0, "V", 1.0e-3 => 1.0e3;
    }
    /// The double-acting cylinder (Table 2).
    cylinder: Cylinder {
        /// Piston area `A`.
        area_m2 = 4.91e-4, "m2", 1.0e-7 => 1.0;
        /// Stroke `L`; `y` runs over ±L/2.
        stroke_m = 1.0, "m", 1.0e-3 => 20.0;
        /// Volume of chamber A at mid-stroke, hose included, `V_a0`.
        volume_a0_m3 = 2.5e-4, "m3", 1.0e-9 => 10.0;
        /// Volume of chamber B at mid-stroke, hose included, `V_b0`.
        volume_b0_m3 = 2.5e-4, "m3", 1.0e-9 => 10.0;
    }
    /// What the piston moves (Table 1).
    load: Load {
        /// Moving mass `M`.
        mass_kg = 10.125, "kg", 1.0e-3 => 1.0e5;
    }
    /// Seal friction: LuGre with elasto-plastic presliding (Table 1; `breakaway_m` is not in the paper).
    friction: Friction {
        /// Bristle stiffness `σ0`.
        stiffness_n_per_m = 0.5e6, "N/m", 1.0 => 1.0e10;
        /// Bristle damping `σ1`.
        damping_n_s_per_m = 400.0, "N s/m", 0.0 => 1.0e7;
        /// Viscous coefficient `σ2`.
        viscous_n_s_per_m = 46.532, "N s/m", 0.0 => 1.0e7;
        /// Coulomb force `F_c`.
        coulomb_n = 23.103, "N", 1.0e-6 => 1.0e6;
        /// Static force `F_s`; not below `F_c`.
        static_n = 24.0, "N", 1.0e-6 => 1.0e6;
        /// Stribeck velocity `v_s`.
        stribeck_velocity_m_per_s = 0.010, "m/s", 1.0e-7 => 10.0;
        /// Breakaway deflection `z_ba`; below `F_c / σ0` (3.13).
        breakaway_m = 3.234e-5, "m", 0.0 => 1.0e-1;
    }
}

/// One numeric key of the rig file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigKey {
    /// The table it stands in, e.g. `load`.
    pub table: &'static str,
    /// The key in the table, e.g. `mass_kg`; unique over all tables.
    pub name: &'static str,
    /// The full name, e.g. `load.mass_kg`.
    pub path: &'static str,
    /// SI unit, and the smallest and largest value that can belong to a pneumatic positioner; anything beyond is a wrong unit.
    pub limits: Limits,
    place: Place,
}

/// A key without unit and range. Table and name are parts of the path, so that the board's flash holds each text once.
const fn named(path: &'static str, dot: usize, place: Place) -> RigKey {
    let (table, rest) = path.split_at(dot);
    RigKey { table, name: rest.split_at(1).1, path, limits: Limits::new("", 0.0, 0.0), place }
}

impl Place {
    /// The key itself.
    #[must_use]
    pub const fn key(self) -> &'static RigKey {
        &RIG_KEYS[self as usize]
    }
}

/// Looks a key up by its full name (`load.mass_kg`) or by its plain one (`mass_kg`).
#[must_use]
pub fn rig_key(name: &str) -> Option<&'static RigKey> {
    RIG_KEYS.iter().find(|key| key.path == name || key.name == name)
}

impl<R: Real> Rig<R> {
    /// Checks every value against its range and the values against each other.
    ///
    /// # Errors
    /// The first key that is not finite, out of range or inconsistent with another.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for key in RIG_KEYS {
            let (value, Limits { low, high, .. }) = (key.get(self), key.limits);
            // A NaN fails both comparisons.
            check(key.path, value, value >= R::of(low) && value <= R::of(high), Must::Fit(&key.limits))?;
        }
        let (s, v, f) = (&self.supply, &self.valve, &self.friction);
        check(
            "supply.pressure_pa",
            s.pressure_pa,
            s.pressure_pa > s.atmosphere_pa,
            "be greater than supply.atmosphere_pa (both absolute)",
        )?;
        check(
            "valve.dead_zone_left_v",
            v.dead_zone_left_v,
            v.dead_zone_left_v <= v.dead_zone_right_v,
            "not be greater than valve.dead_zone_right_v",
        )?;
        check("friction.static_n", f.static_n, f.static_n >= f.coulomb_n, "not be less than friction.coulomb_n")?;
        check(
            "friction.breakaway_m",
            f.breakaway_m,
            f.breakaway_m * f.stiffness_n_per_m < f.coulomb_n,
            "be less than friction.coulomb_n / friction.stiffness_n_per_m (3.13)",
        )
    }

    /// The paper's case (b): bore 60 mm, stroke 1 m.
    #[must_use]
    pub fn paper_b() -> Self {
        let mut rig = Self::paper_a();
        rig.cylinder.area_m2 = R::of(2.8e-3);
        (rig.cylinder.volume_a0_m3, rig.cylinder.volume_b0_m3) = (R::of(1.4e-3), R::of(1.4e-3));
        rig
    }

    /// The paper's case (c): bore 60 mm, stroke 174.6 mm, chamber volumes of case (a).
    #[must_use]
    pub fn paper_c() -> Self {
        let mut rig = Self::paper_a();
        (rig.cylinder.area_m2, rig.cylinder.stroke_m) = (R::of(2.8e-3), R::of(0.1746));
        rig
    }

    /// The rig in another scalar type, as the board holds it.
    #[must_use]
    pub fn convert<S: Real>(&self) -> Rig<S> {
        Rig::from_numbers(&self.numbers().map(|value| S::of(value.to_f64())))
    }

    /// The pressure a chamber settles at in slow motion, where the valve's filling and exhausting flows balance:
    /// `p* = (beta_fill p_sup + beta_exh p_atm) / (beta_fill + beta_exh)`, Pa absolute; 3.618 bar for Table 1.
    #[must_use]
    pub fn equilibrium_pressure_pa(&self) -> R {
        let (fill, exhaust) = (self.valve.fill_coefficient_kg_per_s_pa, self.valve.exhaust_coefficient_kg_per_s_pa);
        (fill * self.supply.pressure_pa + exhaust * self.supply.atmosphere_pa) / (fill + exhaust)
    }
}

fn check<R: Real>(key: &'static str, value: R, accepted: bool, must: impl Into<Must>) -> Result<(), ParameterError> {
    if accepted { Ok(()) } else { Err(ParameterError { key, value: value.to_f64(), must: must.into() }) }
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
    fn set_changes_one_value_and_get_returns_it_for_every_key() {
        let paper = Rig::<f64>::paper_a();
        for key in RIG_KEYS {
            let mut rig = paper;
            key.set(&mut rig, 0.125);
            assert_eq!(key.get(&rig), 0.125, "{}", key.path);
            key.set(&mut rig, key.get(&paper));
            assert_eq!(rig, paper, "{}", key.path);
        }
    }

    /// A rig whose values that depend on each other leave room for `key` at an end of its range.
    fn with<R: Real>(key: &RigKey, value: R) -> Rig<R> {
        let mut rig = Rig::paper_a();
        match key.name {
            "pressure_pa" => rig.supply.atmosphere_pa = R::of(1.0e3),
            "atmosphere_pa" => rig.supply.pressure_pa = R::of(1.0e8),
            "dead_zone_right_v" => rig.valve.dead_zone_left_v = R::of(-1.0e3),
            "dead_zone_left_v" => rig.valve.dead_zone_right_v = R::of(1.0e3),
            "stiffness_n_per_m" => rig.friction.breakaway_m = R::ZERO,
            "coulomb_n" => (rig.friction.static_n, rig.friction.breakaway_m) = (R::of(1.0e6), R::ZERO),
            "static_n" => (rig.friction.coulomb_n, rig.friction.breakaway_m) = (R::of(1.0e-6), R::ZERO),
            "breakaway_m" => rig.friction.stiffness_n_per_m = R::ONE,
            _ => {}
        }
        key.set(&mut rig, value);
        rig
    }

    fn both_ends_are_accepted_and_nothing_beyond<R: Real>() {
        for key in RIG_KEYS {
            for end in [key.limits.low, key.limits.high] {
                assert_eq!(with(key, R::of(end)).validate(), Ok(()), "{} = {end}", key.path);
            }
            let Limits { low, high, .. } = key.limits;
            let step = 1.0e-5 * (low.abs() + high.abs());
            for beyond in [low - step, high + step, f64::NAN, f64::INFINITY] {
                let error = with(key, R::of(beyond)).validate().expect_err(key.path);
                assert_eq!((error.key, error.must), (key.path, Must::Fit(&key.limits)), "{beyond}");
            }
        }
    }

    #[test]
    fn every_value_is_accepted_at_both_ends_of_its_range_and_refused_beyond_by_its_key() {
        both_ends_are_accepted_and_nothing_beyond::<f64>();
        both_ends_are_accepted_and_nothing_beyond::<f32>();
    }
}
