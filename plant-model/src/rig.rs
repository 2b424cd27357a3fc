//! The rig: the paper's Tables 1 and 2 as one set of nominal parameters.

use crate::real::Real;

/// Nominal parameters of valve, cylinder, load and friction. SI units, absolute pressures.
///
/// The field names are the keys of the rig file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rig<R> {
    /// Properties of the working gas.
    pub gas: Gas<R>,
    /// Supply and ambient pressure.
    pub supply: Supply<R>,
    /// The proportional 5/3 valve.
    pub valve: Valve<R>,
    /// The double-acting cylinder.
    pub cylinder: Cylinder<R>,
    /// What the piston moves.
    pub load: Load<R>,
    /// Seal friction (LuGre with elasto-plastic presliding).
    pub friction: Friction<R>,
}

/// Gas properties (Table 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gas<R> {
    /// Specific gas constant `R`, J/(kg K).
    pub gas_constant_j_per_kg_k: R,
    /// Supply air temperature `T`, K.
    pub temperature_k: R,
    /// Ratio of specific heats `gamma`, dimensionless, greater than 1.
    pub heat_capacity_ratio: R,
}

/// Pressures outside the cylinder (Table 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply<R> {
    /// Supply pressure `p_sup`, Pa absolute.
    pub pressure_pa: R,
    /// Atmospheric pressure `p_atm`, Pa absolute.
    pub atmosphere_pa: R,
}

/// The valve: dead zone (3.1) and flow coefficients (3.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Valve<R> {
    /// `beta` towards a chamber ("ench"), kg/(s Pa).
    pub fill_coefficient_kg_per_s_pa: R,
    /// `beta` from a chamber to atmosphere ("esv"), kg/(s Pa).
    pub exhaust_coefficient_kg_per_s_pa: R,
    /// Right break-point `z_md`, V.
    pub dead_zone_right_v: R,
    /// Left break-point `z_me`, V; not above the right one.
    pub dead_zone_left_v: R,
    /// Slope right of the dead zone `md`, dimensionless, positive.
    pub slope_right: R,
    /// Slope left of the dead zone `me`, dimensionless, positive.
    pub slope_left: R,
    /// Largest command magnitude the valve follows, V; beyond it the command saturates.
    pub max_voltage_v: R,
}

/// The cylinder (Table 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder<R> {
    /// Piston area `A`, m2.
    pub area_m2: R,
    /// Stroke `L`, m; `y` runs over ±L/2.
    pub stroke_m: R,
    /// Volume of chamber A at mid-stroke, hose included `V_a0`, m3.
    pub volume_a0_m3: R,
    /// Volume of chamber B at mid-stroke, hose included `V_b0`, m3.
    pub volume_b0_m3: R,
}

/// The load (Table 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load<R> {
    /// Moving mass `M`, kg.
    pub mass_kg: R,
}

/// Friction (Table 1; `breakaway_m` is not in the paper).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction<R> {
    /// Bristle stiffness `sigma0`, N/m.
    pub stiffness_n_per_m: R,
    /// Bristle damping `sigma1`, N s/m.
    pub damping_n_s_per_m: R,
    /// Viscous coefficient `sigma2`, N s/m.
    pub viscous_n_s_per_m: R,
    /// Coulomb force `F_c`, N.
    pub coulomb_n: R,
    /// Static force `F_s`, N; not below `F_c`.
    pub static_n: R,
    /// Stribeck velocity `v_s`, m/s.
    pub stribeck_velocity_m_per_s: R,
    /// Breakaway deflection `z_ba`, m; below `F_c / sigma0` (3.13).
    pub breakaway_m: R,
}

/// What is wrong with a set of parameters: which key, and what it must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterError {
    /// The offending key with its table, as in the rig file, e.g. `load.mass_kg`.
    pub key: &'static str,
    /// The value found.
    pub value: f64,
    /// What would be accepted, as the end of the sentence "must …".
    pub must: &'static str,
}

impl core::fmt::Display for ParameterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} = {} must {}", self.key, self.value, self.must)
    }
}

impl core::error::Error for ParameterError {}

impl<R: Real> Rig<R> {
    /// Checks every value against its physical range and the values against each other.
    ///
    /// # Errors
    /// The first key that is not finite, out of range or inconsistent with another.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let positive = "be a finite number greater than zero";
        let not_negative = "be a finite number, zero or greater";
        let (g, s, v, c, f) = (&self.gas, &self.supply, &self.valve, &self.cylinder, &self.friction);
        for (key, value) in [
            ("gas.gas_constant_j_per_kg_k", g.gas_constant_j_per_kg_k),
            ("gas.temperature_k", g.temperature_k),
            ("gas.heat_capacity_ratio", g.heat_capacity_ratio),
            ("supply.pressure_pa", s.pressure_pa),
            ("supply.atmosphere_pa", s.atmosphere_pa),
            ("valve.fill_coefficient_kg_per_s_pa", v.fill_coefficient_kg_per_s_pa),
            ("valve.exhaust_coefficient_kg_per_s_pa", v.exhaust_coefficient_kg_per_s_pa),
            ("valve.slope_right", v.slope_right),
            ("valve.slope_left", v.slope_left),
            ("valve.max_voltage_v", v.max_voltage_v),
            ("cylinder.area_m2", c.area_m2),
            ("cylinder.stroke_m", c.stroke_m),
            ("cylinder.volume_a0_m3", c.volume_a0_m3),
            ("cylinder.volume_b0_m3", c.volume_b0_m3),
            ("load.mass_kg", self.load.mass_kg),
            ("friction.stiffness_n_per_m", f.stiffness_n_per_m),
            ("friction.coulomb_n", f.coulomb_n),
            ("friction.static_n", f.static_n),
            ("friction.stribeck_velocity_m_per_s", f.stribeck_velocity_m_per_s),
        ] {
            check(key, value, value > R::ZERO, positive)?;
        }
        for (key, value) in [
            ("friction.damping_n_s_per_m", f.damping_n_s_per_m),
            ("friction.viscous_n_s_per_m", f.viscous_n_s_per_m),
            ("friction.breakaway_m", f.breakaway_m),
        ] {
            check(key, value, value >= R::ZERO, not_negative)?;
        }
        check("valve.dead_zone_right_v", v.dead_zone_right_v, true, "be a finite number")?;
        check("valve.dead_zone_left_v", v.dead_zone_left_v, true, "be a finite number")?;
        check("gas.heat_capacity_ratio", g.heat_capacity_ratio, g.heat_capacity_ratio > R::ONE, "be greater than 1")?;
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

    /// The paper's case (a): bore 25 mm, stroke 1 m; Tables 1 and 2, missing values as stated in `docs/model.md`.
    #[must_use]
    pub fn paper_a() -> Self {
        Self::paper(4.91e-4, 1.0, 2.5e-4)
    }

    /// The paper's case (b): bore 60 mm, stroke 1 m.
    #[must_use]
    pub fn paper_b() -> Self {
        Self::paper(2.8e-3, 1.0, 1.4e-3)
    }

    /// The paper's case (c): bore 60 mm, stroke 174.6 mm, chamber volumes of case (a).
    #[must_use]
    pub fn paper_c() -> Self {
        Self::paper(2.8e-3, 0.1746, 2.5e-4)
    }

    fn paper(area_m2: f64, stroke_m: f64, volume_m3: f64) -> Self {
        let of = R::of;
        Self {
            gas: Gas { gas_constant_j_per_kg_k: of(287.0), temperature_k: of(293.0), heat_capacity_ratio: of(1.4) },
            supply: Supply { pressure_pa: of(7.0e5), atmosphere_pa: of(1.0e5) },
            valve: Valve {
                fill_coefficient_kg_per_s_pa: of(0.69501e-8),
                exhaust_coefficient_kg_per_s_pa: of(0.898105e-8),
                dead_zone_right_v: R::ZERO,
                dead_zone_left_v: R::ZERO,
                slope_right: R::ONE,
                slope_left: R::ONE,
                max_voltage_v: of(5.0),
            },
            cylinder: Cylinder {
                area_m2: of(area_m2),
                stroke_m: of(stroke_m),
                volume_a0_m3: of(volume_m3),
                volume_b0_m3: of(volume_m3),
            },
            load: Load { mass_kg: of(10.125) },
            friction: Friction {
                stiffness_n_per_m: of(0.5e6),
                damping_n_s_per_m: of(400.0),
                viscous_n_s_per_m: of(46.532),
                coulomb_n: of(23.103),
                static_n: of(24.0),
                stribeck_velocity_m_per_s: of(0.010),
                breakaway_m: of(3.234e-5),
            },
        }
    }

    /// The pressure a chamber settles at in slow motion, where the valve's filling and exhausting flows balance:
    /// `p* = (beta_fill p_sup + beta_exh p_atm) / (beta_fill + beta_exh)`, Pa absolute; 3.618 bar for Table 1.
    #[must_use]
    pub fn equilibrium_pressure_pa(&self) -> R {
        let (fill, exhaust) = (self.valve.fill_coefficient_kg_per_s_pa, self.valve.exhaust_coefficient_kg_per_s_pa);
        (fill * self.supply.pressure_pa + exhaust * self.supply.atmosphere_pa) / (fill + exhaust)
    }
}

fn check<R: Real>(key: &'static str, value: R, accepted: bool, must: &'static str) -> Result<(), ParameterError> {
    if value.is_finite() && accepted { Ok(()) } else { Err(ParameterError { key, value: value.to_f64(), must }) }
}
