//! The rig: the paper's Tables 1 and 2 as one set of nominal parameters.
//!
//! The table in this file is the only place where a key, its unit, its value in the paper's case (a), its range and its
//! meaning are stated: structs, checks, rig file, tolerances and the board's parameters are made of it.

use crate::hose;
use crate::opening_table::{OPENING_POINTS, OpeningTable};
use crate::real::Real;
pub use parameter_table::{Limits, Must, ParameterError, Short};

/// The full name of a key: that of its field, unless another is given.
macro_rules! path {
    ($table:ident $name:ident) => {
        concat!(stringify!($table), ".", stringify!($name))
    };
    ($table:ident $name:ident $path:literal) => {
        $path
    };
}

/// Whether a key may be absent.
macro_rules! may_be_absent {
    () => {
        false
    };
    (optional) => {
        true
    };
}

macro_rules! rig {
    ($(
        $(#[$about:meta])*
        $table:ident: $Table:ident {
            $($(#[doc = $meaning:literal])+ $name:ident $(as $path:literal)? = $paper_a:literal, $unit:literal, $low:literal => $high:literal $(, $optional:ident)?;)+
        }
    )+
    => both sides {
        $($(#[doc = $both:literal])+ $short:ident as $short_path:literal = $table_a:ident.$a:ident, $table_b:ident.$b:ident, $short_unit:literal, $short_low:literal => $short_high:literal $(, $short_optional:ident)?;)+
    }) => {
        /// Nominal parameters of valve, hoses, cylinder, load and friction. SI units, absolute pressures.
        ///
        /// The field names are the keys of the rig file. A key that may be absent is 0 where it is.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Rig<R> {
            $($(#[$about])* pub $table: $Table<R>,)+
            /// The valve's opening over its command (`valve.opening`); empty: dead zone and arc tangent of the paper. Its
            /// ends of flow stand in `valve.dead_zone_right_v` and `valve.dead_zone_left_v`; other values there move it.
            pub opening: OpeningTable<R>,
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
            $($short,)+
        }

        /// Every numeric key of the rig file that a rig holds, in the order it is written.
        pub const RIG_KEYS: &[RigKey; [$($(stringify!($name)),+),+].len()] = &[$($(RigKey {
            limits: Limits { optional: may_be_absent!($($optional)?), ..Limits::new($unit, $low, $high) },
            ..named(path!($table $name $($path)?), Place::$name, &[])
        }),+),+];

        /// The keys that stand for two of [`RIG_KEYS`], one of each side.
        pub const BOTH_SIDES: &[RigKey; [$(stringify!($short)),+].len()] = &[$(RigKey {
            limits: Limits { optional: may_be_absent!($($short_optional)?), ..Limits::new($short_unit, $short_low, $short_high) },
            ..named($short_path, Place::$short, &[Place::$a, Place::$b])
        }),+];

        impl RigKey {
            /// What the value is.
            #[must_use]
            pub const fn meaning(&self) -> &'static str {
                match self.place {
                    // A doc comment's text begins with a blank.
                    $($(Place::$name => const { concat!($($meaning),+).trim_ascii_start() },)+)+
                    $(Place::$short => const { concat!($($both),+).trim_ascii_start() },)+
                }
            }

            /// The value in a rig.
            #[must_use]
            pub fn get<R: Real>(&self, rig: &Rig<R>) -> R {
                match self.place {
                    $($(Place::$name => rig.$table.$name,)+)+
                    $(Place::$short => mean(rig.$table_a.$a, rig.$table_b.$b),)+
                }
            }

            /// Sets the value in a rig; the result wants [`Rig::validate`]. What stands for both sides keeps the ratio of
            /// sides that differ.
            pub fn set<R: Real>(&self, rig: &mut Rig<R>, value: R) {
                match self.place {
                    $($(Place::$name => rig.$table.$name = value,)+)+
                    $(Place::$short => set_both(&mut rig.$table_a.$a, &mut rig.$table_b.$b, value),)+
                }
            }
        }

        impl<R: Real> Rig<R> {
            /// The paper's case (a): bore 25 mm, stroke 1 m; Tables 1 and 2, missing values as stated in `docs/model.md`.
            #[must_use]
            pub fn paper_a() -> Self {
                Self { $($table: $Table { $($name: R::of($paper_a),)+ },)+ opening: OpeningTable::none() }
            }

            /// The values of all keys, in the order of [`RIG_KEYS`].
            fn values(&self) -> [R; RIG_KEYS.len()] {
                [$($(self.$table.$name),+),+]
            }

            fn from_values(values: &[R; RIG_KEYS.len()], opening: OpeningTable<R>) -> Self {
                let [$($($name),+),+] = *values;
                Self { $($table: $Table { $($name,)+ },)+ opening }
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
        /// `β` towards a chamber ("ench"); with `flow_law = "paper"` only.
        fill_coefficient_kg_per_s_pa = 0.69501e-8, "kg/(s Pa)", 1.0e-13 => 1.0e-4, optional;
        /// `β` from a chamber to atmosphere ("esv"); with `flow_law = "paper"` only.
        exhaust_coefficient_kg_per_s_pa = 0.898105e-8, "kg/(s Pa)", 1.0e-13 => 1.0e-4, optional;
        /// Sonic conductance `C` of ISO 6358 of the fully open path from the supply to chamber A.
        fill_conductance_a_m3_per_s_pa = 0.0, "m3/(s Pa)", 1.0e-11 => 1.0e-4, optional;
        /// Sonic conductance `C` of the fully open path from the supply to chamber B.
        fill_conductance_b_m3_per_s_pa = 0.0, "m3/(s Pa)", 1.0e-11 => 1.0e-4, optional;
        /// Sonic conductance `C` of the fully open path from chamber A to atmosphere.
        exhaust_conductance_a_m3_per_s_pa = 0.0, "m3/(s Pa)", 1.0e-11 => 1.0e-4, optional;
        /// Sonic conductance `C` of the fully open path from chamber B to atmosphere.
        exhaust_conductance_b_m3_per_s_pa = 0.0, "m3/(s Pa)", 1.0e-11 => 1.0e-4, optional;
        /// Critical pressure ratio `b` of the path from the supply to chamber A.
        fill_critical_ratio_a = 0.0, "", 0.0 => 0.9, optional;
        /// Critical pressure ratio `b` of the path from the supply to chamber B.
        fill_critical_ratio_b = 0.0, "", 0.0 => 0.9, optional;
        /// Critical pressure ratio `b` of the path from chamber A to atmosphere.
        exhaust_critical_ratio_a = 0.0, "", 0.0 => 0.9, optional;
        /// Critical pressure ratio `b` of the path from chamber B to atmosphere.
        exhaust_critical_ratio_b = 0.0, "", 0.0 => 0.9, optional;
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
        /// Inertia of the spool, `1 / (4 ζ²)` with its damping ratio `ζ`, beside the effect `valve-lag`; absent: a lag of first order.
        spool_inertia = 0.0, "", 0.0 => 2.0, optional;
        /// How far from a break-point of the dead zone, or of the table's, its corner is rounded on either side; absent: sharp.
        corner_rounding_v = 0.0, "V", 0.0 => 1.0e3, optional;
        /// By how much the paths to atmosphere open later than those from the supply on either side, sooner if negative; absent: together.
        exhaust_overlap_v = 0.0, "V", -1.0e3 => 1.0e3, optional;
        /// How smooth the opening runs between the points of `valve.opening`: 1 by a monotone cubic, absent straight.
        opening_smoothness = 0.0, "", 0.0 => 1.0, optional;
    }
    /// The double-acting cylinder (Table 2).
    cylinder: Cylinder {
        /// Area on which chamber A's pressure acts `A_a`; where it is the larger one, the atmosphere presses on the rod.
        area_a_m2 = 4.91e-4, "m2", 1.0e-7 => 1.0;
        /// Area on which chamber B's pressure acts `A_b`.
        area_b_m2 = 4.91e-4, "m2", 1.0e-7 => 1.0;
        /// Stroke `L`; `y` runs over ±L/2.
        stroke_m = 1.0, "m", 1.0e-3 => 20.0;
        /// Volume of chamber A at mid-stroke `V_a0`, hose included unless `hose_a` describes it.
        volume_a0_m3 = 2.5e-4, "m3", 1.0e-9 => 10.0;
        /// Volume of chamber B at mid-stroke `V_b0`, hose included unless `hose_b` describes it.
        volume_b0_m3 = 2.5e-4, "m3", 1.0e-9 => 10.0;
        /// Rate of the spring in chamber B of a single-acting cylinder, which presses towards `−L/2` and breathes freely.
        spring_n_per_m = 0.0, "N/m", 1.0 => 1.0e7, optional;
        /// Force of that spring with the piston at `−L/2`.
        spring_preload_n = 0.0, "N", 1.0e-2 => 1.0e6, optional;
    }
    /// What the piston moves (Table 1).
    load: Load {
        /// Moving mass `M`.
        mass_kg = 10.125, "kg", 1.0e-3 => 1.0e5;
        /// Angle of the direction of positive `y` above the horizontal: 90 lifts the load, −90 lowers it.
        inclination_deg = 0.0, "deg", -90.0 => 90.0, optional;
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
    /// The hoses between valve and cylinder, where the rig file describes them: `hose.rs` has the model.
    hoses: Hoses {
        /// Length of the hose from the valve to chamber A.
        a_length_m as "hose_a.length_m" = 0.0, "m", 1.0e-3 => 100.0, optional;
        /// Inner diameter of the hose from the valve to chamber A.
        a_diameter_m as "hose_a.diameter_m" = 0.0, "m", 5.0e-4 => 0.1, optional;
        /// Length of the hose from the valve to chamber B.
        b_length_m as "hose_b.length_m" = 0.0, "m", 1.0e-3 => 100.0, optional;
        /// Inner diameter of the hose from the valve to chamber B.
        b_diameter_m as "hose_b.diameter_m" = 0.0, "m", 5.0e-4 => 0.1, optional;
    }
    /// The cushions at the ends of the stroke, where the rig file describes them: `cushion.rs` has the model.
    cushions: Cushions {
        /// Length of the cushion at chamber A's end.
        cushion_a_length_m as "cushion_a.length_m" = 0.0, "m", 1.0e-4 => 1.0, optional;
        /// Sonic conductance `C` of ISO 6358 of its needle.
        cushion_a_conductance_m3_per_s_pa as "cushion_a.conductance_m3_per_s_pa" = 0.0, "m3/(s Pa)", 1.0e-13 => 1.0e-5, optional;
        /// Length of the cushion at chamber B's end.
        cushion_b_length_m as "cushion_b.length_m" = 0.0, "m", 1.0e-4 => 1.0, optional;
        /// Sonic conductance `C` of ISO 6358 of its needle.
        cushion_b_conductance_m3_per_s_pa as "cushion_b.conductance_m3_per_s_pa" = 0.0, "m3/(s Pa)", 1.0e-13 => 1.0e-5, optional;
    }
    => both sides {
        /// Piston area `A` of both sides, instead of `area_a_m2` and `area_b_m2`.
        area_m2 as "cylinder.area_m2" = cylinder.area_a_m2, cylinder.area_b_m2, "m2", 1.0e-7 => 1.0;
        /// Sonic conductance `C` of ISO 6358 from the supply to either chamber; with `flow_law = "iso6358"` only.
        fill_conductance_m3_per_s_pa as "valve.fill_conductance_m3_per_s_pa" = valve.fill_conductance_a_m3_per_s_pa, valve.fill_conductance_b_m3_per_s_pa, "m3/(s Pa)", 1.0e-11 => 1.0e-4, optional;
        /// Sonic conductance `C` of ISO 6358 from either chamber to atmosphere; with `flow_law = "iso6358"` only.
        exhaust_conductance_m3_per_s_pa as "valve.exhaust_conductance_m3_per_s_pa" = valve.exhaust_conductance_a_m3_per_s_pa, valve.exhaust_conductance_b_m3_per_s_pa, "m3/(s Pa)", 1.0e-11 => 1.0e-4, optional;
        /// Critical pressure ratio `b` of ISO 6358 from the supply to either chamber; with `flow_law = "iso6358"` only.
        fill_critical_ratio as "valve.fill_critical_ratio" = valve.fill_critical_ratio_a, valve.fill_critical_ratio_b, "", 0.0 => 0.9, optional;
        /// Critical pressure ratio `b` of ISO 6358 from either chamber to atmosphere; with `flow_law = "iso6358"` only.
        exhaust_critical_ratio as "valve.exhaust_critical_ratio" = valve.exhaust_critical_ratio_a, valve.exhaust_critical_ratio_b, "", 0.0 => 0.9, optional;
    }
}

/// One numeric key of the rig file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigKey {
    /// The table it stands in, e.g. `load`.
    pub table: &'static str,
    /// The key in the table, e.g. `mass_kg`.
    pub name: &'static str,
    /// The full name, e.g. `load.mass_kg`; unique.
    pub path: &'static str,
    /// SI unit, and the smallest and largest value that can belong to a pneumatic positioner; anything beyond is a wrong unit.
    pub limits: Limits,
    /// The two keys of [`RIG_KEYS`] it stands for, if it is one of [`BOTH_SIDES`].
    pub sides: &'static [Place],
    place: Place,
}

/// A key without unit and range. Table and name are parts of the path, so that the board's flash holds each text once.
const fn named(path: &'static str, place: Place, sides: &'static [Place]) -> RigKey {
    let mut dot = 0;
    while path.as_bytes()[dot] != b'.' {
        dot += 1;
    }
    let (table, rest) = path.split_at(dot);
    RigKey { table, name: rest.split_at(1).1, path, limits: Limits::new("", 0.0, 0.0), sides, place }
}

fn mean<R: Real>(a: R, b: R) -> R {
    R::HALF * (a + b)
}

/// Sets two equal values; two that differ change by the same factor, so that the new value is their mean.
fn set_both<R: Real>(a: &mut R, b: &mut R, value: R) {
    if *a == *b {
        (*a, *b) = (value, value);
    } else {
        let factor = value / mean(*a, *b);
        (*a, *b) = (*a * factor, *b * factor);
    }
}

impl Place {
    /// The key itself.
    #[must_use]
    pub const fn key(self) -> &'static RigKey {
        let at = self as usize;
        if at < RIG_KEYS.len() { &RIG_KEYS[at] } else { &BOTH_SIDES[at - RIG_KEYS.len()] }
    }
}

impl RigKey {
    /// A number from 0, its own among all keys.
    #[must_use]
    pub const fn index(&self) -> usize {
        self.place as usize
    }

    /// The key that stands for this one and that of the other side, if there is one.
    #[must_use]
    pub fn both_sides(&self) -> Option<&'static Self> {
        BOTH_SIDES.iter().find(|key| key.sides.contains(&self.place))
    }

    /// Whether a value lies inside the range, or is absent where it may be.
    fn accepts<R: Real>(&self, value: R) -> bool {
        let Limits { low, high, optional, .. } = self.limits;
        // A NaN fails all comparisons.
        (value >= R::of(low) && value <= R::of(high)) || (optional && value == R::ZERO)
    }
}

/// All of [`RIG_KEYS`], each of [`BOTH_SIDES`] before the first key that it stands for.
pub fn all_keys() -> impl Iterator<Item = &'static RigKey> + Clone {
    RIG_KEYS.iter().flat_map(|key| {
        let both = BOTH_SIDES.iter().find(|both| both.sides[0] == key.place);
        [both, Some(key)].into_iter().flatten()
    })
}

/// Looks a key up by its full name (`load.mass_kg`), or by its plain one (`mass_kg`) if no other key has it.
#[must_use]
pub fn rig_key(name: &str) -> Option<&'static RigKey> {
    let mut named = all_keys().filter(|key| key.path == name || key.name == name);
    named.next().filter(|_| named.next().is_none())
}

/// How many numbers make a rig: its keys, and the table of the valve's opening with the number of its points.
pub const RIG_NUMBERS: usize = RIG_KEYS.len() + 1 + 2 * OPENING_POINTS;

impl<R: Real> Cylinder<R> {
    /// Whether a spring in chamber B takes the place of its air.
    #[must_use]
    pub fn is_single_acting(&self) -> bool {
        self.spring_n_per_m > R::ZERO || self.spring_preload_n > R::ZERO
    }

    /// The spring's force against positive motion with the piston at `y_m` in m; 0 for a double-acting cylinder.
    #[must_use]
    pub fn spring_force_n(&self, y_m: R) -> R {
        self.spring_preload_n + self.spring_n_per_m * (R::HALF * self.stroke_m + y_m)
    }

    /// The mean of both areas, m2; what a figure for the cylinder as a whole is made of.
    #[must_use]
    pub fn mean_area_m2(&self) -> R {
        mean(self.area_a_m2, self.area_b_m2)
    }

    /// The same area on both sides, m2: a rod on both sides, or none.
    pub fn set_area_m2(&mut self, area_m2: R) {
        (self.area_a_m2, self.area_b_m2) = (area_m2, area_m2);
    }
}

impl<R: Real> Rig<R> {
    /// All numbers that make the rig, for a transport: keys in the order of [`RIG_KEYS`], then the table of the opening.
    #[must_use]
    pub fn numbers(&self) -> [R; RIG_NUMBERS] {
        let mut numbers = [R::ZERO; RIG_NUMBERS];
        let (keys, table) = numbers.split_at_mut(RIG_KEYS.len());
        keys.copy_from_slice(&self.values());
        let points = self.opening.points();
        table[0] = R::of(points.len() as f64);
        for (to, from) in table[1..].chunks_exact_mut(2).zip(points) {
            to.copy_from_slice(from);
        }
        numbers
    }

    /// The rig of [`Rig::numbers`]; wants [`Rig::validate`].
    #[must_use]
    pub fn from_numbers(numbers: &[R; RIG_NUMBERS]) -> Self {
        let (keys, table) = numbers.split_at(RIG_KEYS.len());
        let mut values = [R::ZERO; RIG_KEYS.len()];
        values.copy_from_slice(keys);
        let mut points = [[R::ZERO; 2]; OPENING_POINTS];
        for (to, from) in points.iter_mut().zip(table[1..].chunks_exact(2)) {
            to.copy_from_slice(from);
        }
        // A cast saturates, and a count of NaN is none.
        let count = (table[0].to_f64() as usize).min(OPENING_POINTS);
        Self::from_values(&values, OpeningTable::unchecked(&points[..count]))
    }

    /// Checks every value against its range and the values against each other.
    ///
    /// # Errors
    /// The first key that is not finite, out of range or inconsistent with another.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for key in RIG_KEYS {
            let value = key.get(self);
            check(key.path, value, key.accepts(value), Must::Fit(&key.limits))?;
        }
        let (s, v, f) = (&self.supply, &self.valve, &self.friction);
        check(
            "supply.pressure_pa",
            s.pressure_pa,
            s.pressure_pa > s.atmosphere_pa,
            "be greater than supply.atmosphere_pa (both absolute)",
        )?;
        self.validate_valve()?;
        self.validate_hoses()?;
        self.validate_cushions()?;
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

    /// One flow law, stated whole.
    fn validate_valve(&self) -> Result<(), ParameterError> {
        const PAPER: [Place; 2] = [Place::fill_coefficient_kg_per_s_pa, Place::exhaust_coefficient_kg_per_s_pa];
        const ISO: [Place; 4] = [
            Place::fill_conductance_a_m3_per_s_pa,
            Place::fill_conductance_b_m3_per_s_pa,
            Place::exhaust_conductance_a_m3_per_s_pa,
            Place::exhaust_conductance_b_m3_per_s_pa,
        ];
        let stated = |place: &Place| place.key().get(self) > R::ZERO;
        let complete = |place: &Place, wanted: bool, must: &'static str| {
            check(place.key().path, place.key().get(self), stated(place) == wanted, must)
        };
        let iso = ISO.iter().any(stated);
        for place in &PAPER {
            complete(
                place,
                !iso,
                if iso {
                    "be absent beside the conductances of ISO 6358"
                } else {
                    "be stated, or the conductances of ISO 6358"
                },
            )?;
        }
        for place in &ISO {
            complete(place, iso, "be stated like the conductances of the other paths")?;
        }
        if let Err(must) = self.opening.check() {
            check("valve.opening", self.opening.points().len() as f64, false, must)?;
        }
        Ok(())
    }

    fn validate_hoses(&self) -> Result<(), ParameterError> {
        const PAIRS: [[Place; 2]; 2] =
            [[Place::a_length_m, Place::a_diameter_m], [Place::b_length_m, Place::b_diameter_m]];
        for [length, diameter] in PAIRS {
            let [l, d] = [length, diameter].map(|place| place.key().get(self));
            check(
                length.key().path,
                l,
                (l > R::ZERO) == (d > R::ZERO),
                "be stated together with the hose's diameter_m",
            )?;
        }
        Ok(())
    }

    fn validate_cushions(&self) -> Result<(), ParameterError> {
        const PAIRS: [[Place; 2]; 2] = [
            [Place::cushion_a_length_m, Place::cushion_a_conductance_m3_per_s_pa],
            [Place::cushion_b_length_m, Place::cushion_b_conductance_m3_per_s_pa],
        ];
        for [length, conductance] in PAIRS {
            let [l, c] = [length, conductance].map(|place| place.key().get(self));
            let path = length.key().path;
            check(
                path,
                l,
                (l > R::ZERO) == (c > R::ZERO),
                "be stated together with the cushion's conductance_m3_per_s_pa",
            )?;
            check(path, l, l + l <= self.cylinder.stroke_m, "not be longer than half the stroke")?;
        }
        Ok(())
    }

    /// The keys that say what this rig is, in the order of [`all_keys`]: without what is absent, one key for sides that are
    /// alike.
    pub fn stated_keys(&self) -> impl Iterator<Item = &'static RigKey> + '_ {
        const RATIOS: [Place; 6] = [
            Place::fill_critical_ratio,
            Place::fill_critical_ratio_a,
            Place::fill_critical_ratio_b,
            Place::exhaust_critical_ratio,
            Place::exhaust_critical_ratio_a,
            Place::exhaust_critical_ratio_b,
        ];
        let alike = |key: &RigKey| key.sides.windows(2).all(|s| s[0].key().get(self) == s[1].key().get(self));
        all_keys().filter(move |key| {
            // No air passes at a critical ratio of 0 that would not at 0.01: it is a value like any other.
            let ratio = self.follows_iso6358() && RATIOS.contains(&key.place);
            let absent = key.limits.optional && key.get(self) == R::ZERO && !ratio;
            let both = key.both_sides();
            !absent && if key.sides.is_empty() { !both.is_some_and(alike) } else { alike(key) }
        })
    }

    /// Whether the valve follows ISO 6358, and not the paper's linear law.
    #[must_use]
    pub fn follows_iso6358(&self) -> bool {
        self.valve.fill_conductance_a_m3_per_s_pa > R::ZERO
    }

    /// The paper's case (b): bore 60 mm, stroke 1 m.
    #[must_use]
    pub fn paper_b() -> Self {
        let mut rig = Self::paper_a();
        rig.cylinder.set_area_m2(R::of(2.8e-3));
        (rig.cylinder.volume_a0_m3, rig.cylinder.volume_b0_m3) = (R::of(1.4e-3), R::of(1.4e-3));
        rig
    }

    /// The paper's case (c): bore 60 mm, stroke 174.6 mm, chamber volumes of case (a).
    #[must_use]
    pub fn paper_c() -> Self {
        let mut rig = Self::paper_a();
        rig.cylinder.set_area_m2(R::of(2.8e-3));
        rig.cylinder.stroke_m = R::of(0.1746);
        rig
    }

    /// The rig in another scalar type, as the board holds it.
    #[must_use]
    pub fn convert<S: Real>(&self) -> Rig<S> {
        Rig::from_numbers(&self.numbers().map(|value| S::of(value.to_f64())))
    }

    /// Coefficients of the paper's linear law for filling and exhausting, kg/(s Pa); for a valve of ISO 6358 those of the
    /// same flow at full opening and full pressure drop, mean of both sides.
    #[must_use]
    pub fn linear_coefficients_kg_per_s_pa(&self) -> [R; 2] {
        if !self.follows_iso6358() {
            return [self.valve.fill_coefficient_kg_per_s_pa, self.valve.exhaust_coefficient_kg_per_s_pa];
        }
        let valve = &self.valve;
        let drop = (self.supply.pressure_pa - self.supply.atmosphere_pa) / self.supply.pressure_pa;
        let per_rad = |a, b| mean(self.sonic_flow_per_rad(a), self.sonic_flow_per_rad(b)) / drop;
        [
            per_rad(valve.fill_conductance_a_m3_per_s_pa, valve.fill_conductance_b_m3_per_s_pa),
            per_rad(valve.exhaust_conductance_a_m3_per_s_pa, valve.exhaust_conductance_b_m3_per_s_pa),
        ]
    }

    /// Whether a hose between valve and cylinder is described.
    #[must_use]
    pub fn has_hoses(&self) -> bool {
        self.hoses.a_length_m > R::ZERO || self.hoses.b_length_m > R::ZERO
    }

    /// Choked mass flow per Pa of upstream pressure and rad of opening, kg/(s Pa rad), of a path with sonic conductance
    /// `C` of ISO 6358 in m3/(s Pa): the conductance is that of the fully open valve, whose opening is pi/2.
    pub(crate) fn sonic_flow_per_rad(&self, conductance: R) -> R {
        hose::mass_conductance(conductance, self.gas.temperature_k) * R::of(core::f64::consts::FRAC_2_PI)
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
    fn full_key_names_are_unique_and_a_plain_one_is_looked_up_unless_several_have_it() {
        let names: HashSet<_> = all_keys().map(|key| key.path).collect();
        assert_eq!(names.len(), RIG_KEYS.len() + BOTH_SIDES.len());
        assert_eq!(all_keys().count(), names.len());
        for key in all_keys() {
            assert_eq!(rig_key(key.path), Some(key));
            let shared = all_keys().filter(|other| other.name == key.name).count() > 1;
            assert_eq!(rig_key(key.name), (!shared).then_some(key));
        }
    }

    #[test]
    fn a_key_of_both_sides_keeps_their_ratio_and_reads_their_mean() {
        let mut rig = Rig::<f64>::paper_a();
        let area = rig_key("area_m2").unwrap();
        assert_eq!(area.get(&rig), 4.91e-4);
        (rig.cylinder.area_a_m2, rig.cylinder.area_b_m2) = (8.0e-4, 6.0e-4);
        area.set(&mut rig, 14.0e-4);
        assert!((rig.cylinder.area_a_m2 - 16.0e-4).abs() < 1e-15 && (rig.cylinder.area_b_m2 - 12.0e-4).abs() < 1e-15);
    }

    #[test]
    fn numbers_make_the_same_rig_again_with_its_table() {
        let mut rig = Rig::<f64>::paper_c();
        rig.opening = OpeningTable::new(&[[-5.0, -1.0], [-0.5, 0.0], [0.4, 0.0], [2.0, 0.3], [5.0, 1.0]]).unwrap();
        rig.load.inclination_deg = 30.0;
        assert_eq!(Rig::from_numbers(&rig.numbers()), rig);
        assert_eq!(rig.convert::<f32>().opening.points().len(), 5);
    }

    #[test]
    fn half_a_flow_law_two_flow_laws_and_half_a_hose_are_refused_by_key() {
        let refused = |change: fn(&mut Rig<f64>)| {
            let mut rig = Rig::paper_a();
            change(&mut rig);
            rig.validate().unwrap_err().key
        };
        assert_eq!(refused(|rig| rig.valve.fill_coefficient_kg_per_s_pa = 0.0), "valve.fill_coefficient_kg_per_s_pa");
        assert_eq!(
            refused(|rig| rig.valve.fill_conductance_a_m3_per_s_pa = 1e-8),
            "valve.fill_coefficient_kg_per_s_pa"
        );
        let half = refused(|rig| {
            iso(rig, 1e-8);
            rig.valve.exhaust_conductance_b_m3_per_s_pa = 0.0;
        });
        assert_eq!(half, "valve.exhaust_conductance_b_m3_per_s_pa");
        assert_eq!(refused(|rig| rig.hoses.b_length_m = 1.0), "hose_b.length_m");
        assert_eq!(refused(|rig| rig.opening = OpeningTable::unchecked(&[[0.0, 1.0]])), "valve.opening");
    }

    /// A valve of ISO 6358 instead of the paper's.
    fn iso<R: Real>(rig: &mut Rig<R>, conductance: R) {
        for name in ["fill", "exhaust"] {
            let key = |rest: &str| all_keys().find(|key| key.name == std::format!("{name}_{rest}")).unwrap();
            key("coefficient_kg_per_s_pa").set(rig, R::ZERO);
            key("conductance_m3_per_s_pa").set(rig, conductance);
        }
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
            _ if key.table.starts_with("cushion") => {
                rig.cylinder.stroke_m = R::of(2.0);
                let c = &mut rig.cushions;
                (c.cushion_a_length_m, c.cushion_a_conductance_m3_per_s_pa) = (R::ONE, R::of(1.0e-9));
                (c.cushion_b_length_m, c.cushion_b_conductance_m3_per_s_pa) = (R::ONE, R::of(1.0e-9));
            }
            "length_m" | "diameter_m" => {
                let hoses = &mut rig.hoses;
                (hoses.a_length_m, hoses.a_diameter_m) = (R::ONE, R::of(0.01));
                (hoses.b_length_m, hoses.b_diameter_m) = (R::ONE, R::of(0.01));
            }
            name if name.contains("conductance") => iso(&mut rig, R::of(1.0e-8)),
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
