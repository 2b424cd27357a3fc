//! What the air in both chambers does at one instant.
//!
//! ```text
//! K / M  = γ (f_a / (l_a + y) + f_b / (l_b − y))                              f = A p / M, per moving mass
//! G₊ / M = γ (c_fill (f_sup ⊳ f_a) / (l_a + y) + c_exh (f_b ⊳ f_atm) / (l_b − y))   c = R T β / A,  l = V_0 / A
//! ```
//!
//! each with the area of its chamber. `up ⊳ down` is the difference in the paper's flow law, and by ISO 6358
//! `up ψ(down / up) = sqrt(up² − x²)` with `x = (down − b up) / (1 − b)`, which counts only where it is positive: one root, no quotient.

use super::constants::{LEAST_DRIVE, LEAST_LENGTH, PRESSURE_RATE};
use super::factor::{Factor, Share, quotient, root_of_product};
use super::rig::Rig;
use super::{Acceleration, Jerk, Ratio, Stiffness};
use crate::arithmetic::{bits, fixed, limit, multiply, product, saturate};
use crate::config_error::{ConfigError, demand};
use crate::parameters::{Key, Parameters};
use crate::quantities::{Position, Pressure, Velocity};

/// Areas of the piston on the sides of chambers A and B over the moving mass, m2/kg.
#[derive(Clone, Copy)]
pub(crate) struct Areas {
    pub(crate) per_mass: [f64; 2],
    ratio: f64,
}

impl Areas {
    /// As the parameters have them; the one of chamber A for both sides where chamber B has none of its own.
    ///
    /// # Errors
    /// Areas that make more force of the highest pressure than its format holds, or differ by more than the format of their ratio holds.
    pub(crate) fn of(p: &Parameters) -> Result<Self, ConfigError> {
        let per_mass =
            [p.servo_area_m2_per_kg, p.servo_area_b_m2_per_kg.unwrap_or(p.servo_area_m2_per_kg)].map(f64::from);
        let [_, pressures @ ..] = p.calibrated_ranges();
        let highest = pressures.iter().flatten().fold(f64::from(p.servo_supply_pa), |most, end| most.max(*end));
        for (per_mass, key) in per_mass.into_iter().zip([Key::servo_area_m2_per_kg, Key::servo_area_b_m2_per_kg]) {
            demand(
                per_mass * highest <= 30_000.0,
                key,
                per_mass,
                "not turn the highest pressure into more than 30000 m/s2",
            )?;
        }
        let ratio = per_mass[1] / per_mass[0];
        demand(
            (0.125..=7.9).contains(&ratio),
            Key::servo_area_b_m2_per_kg,
            per_mass[1],
            "be from an eighth to 7.9 times servo_area_m2_per_kg",
        )?;
        Ok(Self { per_mass, ratio })
    }

    /// Force of a pressure in Pa on one side.
    pub(crate) fn force(&self, side: usize, pressure: f32) -> Acceleration {
        fixed(self.per_mass[side] * f64::from(pressure))
    }
}

/// Constants of the chambers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Chambers {
    /// Force of a pressure on either side, `A / M`.
    pub(crate) per_pa: [Factor<Pressure, Acceleration>; 2],
    /// Area of chamber B over that of A.
    pub(crate) ratio: Ratio,
    /// How fast stiffness and slopes follow the measured pressures, per tick.
    pub(crate) follow: Share<Acceleration, Acceleration>,
    /// Volumes at mid-stroke over the area, `l_a` and `l_b`.
    pub(crate) lengths: [Position; 2],
    /// `γ c_fill` and `γ c_exh` of chamber A and B, for one radian of opening.
    pub(crate) flow: [[Velocity; 2]; 2],
    /// The critical ratios of filling and exhausting, where the valve follows ISO 6358.
    pub(crate) critical: Option<[Critical; 2]>,
    /// `γ` with 24 fractional bits.
    pub(crate) gamma_q24: i32,
    /// Force of the atmosphere on either side.
    pub(crate) atmosphere: [Acceleration; 2],
    /// Force of the nominal supply, where it is not measured.
    pub(crate) nominal_supply: Acceleration,
    /// Forces of the chambers at rest, where they are not measured.
    pub(crate) rest: [Acceleration; 2],
}

/// A path of ISO 6358: `x` is `down / (1 − b) − up b / (1 − b)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Critical {
    /// `1 / (1 − b)`.
    pub(crate) down: Factor<Acceleration, Acceleration>,
    /// `b / (1 − b)`.
    pub(crate) up: Factor<Acceleration, Acceleration>,
}

impl Critical {
    /// Of filling and exhausting, or none.
    fn both(p: &Parameters) -> Result<Option<[Self; 2]>, ConfigError> {
        let of = |b: f32| {
            let b = f64::from(b);
            Self { down: Factor::new(1.0 / (1.0 - b)), up: Factor::new(b / (1.0 - b)) }
        };
        match (p.servo_fill_critical_ratio, p.servo_exhaust_critical_ratio) {
            (None, None) => Ok(None),
            (Some(fill), Some(exhaust)) => Ok(Some([of(fill), of(exhaust)])),
            (fill, _) => {
                let key =
                    if fill.is_some() { Key::servo_exhaust_critical_ratio } else { Key::servo_fill_critical_ratio };
                demand(false, key, 0.0, "be given, as that of the other path is").map(|()| None)
            }
        }
    }

    /// What drives the flow from one pressure to a lower one.
    #[inline]
    fn drive(&self, up: Acceleration, down: Acceleration) -> Acceleration {
        let x = self.down.of(down).saturating_sub(self.up.of(up));
        if x <= 0 {
            return up;
        }
        let (less, more) = (up.saturating_sub(x).max(Acceleration::ZERO), up.saturating_add(x));
        let root = root_of_product(less.to_bits().unsigned_abs(), more.to_bits().unsigned_abs());
        Acceleration::from_bits(saturate(i64::from(root)))
    }
}

/// The air at this tick: how the force answers to the valve and to motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Air {
    /// Stiffness `K / M`.
    pub(crate) stiffness: Stiffness,
    /// Force slope while chamber A is filled, per radian.
    pub(crate) slope_fill_a: Jerk,
    /// Force slope while chamber B is filled, per radian.
    pub(crate) slope_fill_b: Jerk,
}

impl Chambers {
    /// With the numbers of chamber A where chamber B has none of its own.
    ///
    /// # Errors
    /// A critical ratio of one path alone.
    pub(crate) fn new(p: &Parameters, rig: &Rig, areas: &Areas) -> Result<Self, ConfigError> {
        let gamma = f64::from(p.servo_heat_capacity_ratio);
        Ok(Self {
            per_pa: areas.per_mass.map(Factor::new),
            ratio: fixed(areas.ratio),
            follow: Share::new((rig.t * PRESSURE_RATE).min(1.0)),
            lengths: [p.servo_length_a_m, p.servo_length_b_m].map(|length| fixed(f64::from(length))),
            flow: [
                [p.servo_fill_m_per_s, p.servo_exhaust_m_per_s],
                [
                    p.servo_fill_b_m_per_s.unwrap_or(p.servo_fill_m_per_s),
                    p.servo_exhaust_b_m_per_s.unwrap_or(p.servo_exhaust_m_per_s),
                ],
            ]
            .map(|paths| paths.map(|c| fixed(gamma * f64::from(c)))),
            critical: Critical::both(p)?,
            gamma_q24: bits(gamma, 24),
            atmosphere: [0, 1].map(|side| areas.force(side, p.servo_atmosphere_pa)),
            nominal_supply: areas.force(0, p.servo_supply_pa),
            rest: [areas.force(0, p.servo_rest_pa), areas.force(1, p.servo_rest_b_pa.unwrap_or(p.servo_rest_pa))],
        })
    }

    /// Force of both chambers at rest, where neither is measured.
    #[inline]
    pub(crate) fn rest_force(&self) -> Acceleration {
        let [a, b] = self.rest;
        a.saturating_sub(b)
    }

    /// Force of the supply on the side of chamber B.
    #[inline]
    fn on_side_b(&self, supply: Acceleration) -> Acceleration {
        if self.ratio == Ratio::ONE { supply } else { product(supply, self.ratio) }
    }

    /// The forces of chamber A, chamber B and supply, the last on the side of chamber A, with those that are not measured from the modelled force.
    #[inline]
    pub(crate) fn complete(
        &self,
        [f_a, f_b]: [Option<Acceleration>; 2],
        supply: Acceleration,
        force: Acceleration,
    ) -> [Acceleration; 3] {
        let half = Acceleration::from_bits(force.saturating_sub(self.rest_force()).to_bits() / 2);
        let [a, b] = match (f_a, f_b) {
            (Some(a), Some(b)) => [a, b],
            (Some(a), None) => [a, a.saturating_sub(force)],
            (None, Some(b)) => [b.saturating_add(force), b],
            (None, None) => {
                let [a, b] = self.rest;
                [a.saturating_add(half), b.saturating_sub(half)]
            }
        };
        let inside = |f: Acceleration, supply: Acceleration, atmosphere: Acceleration| {
            limit(f, atmosphere, supply.max(atmosphere))
        };
        let [atmosphere_a, atmosphere_b] = self.atmosphere;
        [inside(a, supply, atmosphere_a), inside(b, self.on_side_b(supply), atmosphere_b), supply]
    }

    /// At a position, with the forces of chamber A, chamber B and supply.
    #[inline]
    pub(crate) fn air(&self, y: Position, [f_a, f_b, f_sup]: [Acceleration; 3]) -> Air {
        let [l_a, l_b] = self.lengths;
        let per_a = per_length(l_a.saturating_add(y), l_a);
        let per_b = per_length(l_b.saturating_sub(y), l_b);
        let supplies = [f_sup, self.on_side_b(f_sup)];
        let drive = |up: Acceleration, down: Acceleration, path: usize| match &self.critical {
            None => up.saturating_sub(down),
            Some(paths) => paths[path].drive(up, down),
        };
        let part = const { bits(LEAST_DRIVE, 16) };
        let small = supplies.map(|supply| Acceleration::from_bits(multiply(supply.to_bits(), part, 16)));
        let share = |drive: Acceleration, per: i32, side: usize, path: usize| {
            i64::from(multiply(drive.max(small[side]).to_bits(), per, 28)) * i64::from(self.flow[side][path].to_bits())
        };
        let (forces, per) = ([f_a, f_b], [per_a, per_b]);
        let slope = |fills: usize, empties: usize| {
            let fill = share(drive(supplies[fills], forces[fills], 0), per[fills], fills, 0);
            let exhaust = share(drive(forces[empties], self.atmosphere[empties], 1), per[empties], empties, 1);
            // Both below 2^62, and positive.
            Jerk::from_bits(saturate((fill >> 24) + (exhaust >> 24)).max(1))
        };
        let [k_a, k_b] = [(f_a, per_a), (f_b, per_b)].map(|(f, per)| multiply(f.to_bits(), per, 28));
        Air {
            stiffness: Stiffness::from_bits(multiply(k_a.saturating_add(k_b).max(0), self.gamma_q24, 24)),
            slope_fill_a: slope(0, 1),
            slope_fill_b: slope(1, 0),
        }
    }
}

/// `1 / l` in 1/m with 20 fractional bits.
#[inline]
fn per_length(length: Position, at_middle: Position) -> i32 {
    let least = multiply(at_middle.to_bits(), const { bits(LEAST_LENGTH, 16) }, 16);
    quotient(1 << 20, length.to_bits().max(least).unsigned_abs(), 28)
}
