//! The plant: nominal parameters and effects folded into one right-hand side.

use crate::coefficients::Coefficients;
use crate::dead_zone::DeadZone;
use crate::effects::Effects;
use crate::friction::{LARGEST_BREAKAWAY_RATIO, Level, LuGre, Response};
use crate::real::Real;
use crate::rig::{ParameterError, Rig};
use crate::valve_flow::{Iso6358, Orifices};

/// The smallest volume a chamber can have, as a part of the swept volume `A L` (erratum: case (b) would reach zero).
pub const MINIMUM_VOLUME_RATIO: f64 = 0.005;

/// The sliding force never falls below this part of the Coulomb force, whatever effects are combined.
const MINIMUM_LEVEL_RATIO: f64 = 1.0e-3;

/// The state: the paper's five, and four that exist only under effects and else follow their sources at once.
///
/// Also used for rates of change (each field then per second).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<R> {
    /// Piston position from mid-stroke, positive towards chamber B, m.
    pub y_m: R,
    /// Piston velocity, m/s.
    pub v_m_per_s: R,
    /// Pressure of chamber A, Pa absolute.
    pub p_a_pa: R,
    /// Pressure of chamber B, Pa absolute.
    pub p_b_pa: R,
    /// Bristle deflection, m.
    pub z_m: R,
    /// Spool position as a voltage, V (`valve-lag`).
    pub spool_v: R,
    /// Supply pressure at the valve, Pa absolute (`supply-droop`).
    pub p_sup_pa: R,
    /// Pressure of A behind the sensor's lag, Pa absolute, offset not included (`pressure-lag`).
    pub p_a_sensed_pa: R,
    /// Pressure of B behind the sensor's lag, Pa absolute, offset not included (`pressure-lag`).
    pub p_b_sensed_pa: R,
}

/// What acts on the plant from outside, constant over an integration step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs<R> {
    /// Valve command about mid position, V.
    pub u_v: R,
    /// External force on the piston, positive along +y, N.
    pub external_force_n: R,
    /// Supply pressure before any droop, Pa absolute.
    pub supply_pa: R,
}

/// The model of one rig with its effects, ready to be evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant<R> {
    pub(crate) model: Coefficients<R>,
    pub(crate) orifices: Orifices<R>,
    pub(crate) lugre: LuGre<R>,
    /// `R n T`, J/kg.
    pub(crate) energy: R,
    pub(crate) minimum_volume_m3: R,
    pub(crate) inverse_mass: R,
    /// `A / M`, m/(s2 Pa).
    pub(crate) acceleration_per_pa: R,
    pub(crate) minimum_level_n: R,
    pub(crate) level_varies: bool,
    extended: bool,
}

impl<R: Real> Plant<R> {
    /// Folds the effects into the rig's nominal parameters.
    ///
    /// # Errors
    /// The first parameter of rig or effects that is not finite, out of range or inconsistent.
    pub fn new(rig: &Rig<R>, effects: &Effects<R>) -> Result<Self, ParameterError> {
        rig.validate()?;
        effects.validate()?;
        let mut model = Self::nominal(rig);
        effects.apply(&mut model);
        Ok(Self::assemble(rig, model))
    }

    /// The paper's model of a rig, without effects: the same as [`Plant::new`] with [`Effects::none`], but without the
    /// effect catalogue and its texts in the program, which a microcontroller has no room for.
    ///
    /// # Errors
    /// The first parameter of the rig that is not finite, out of range or inconsistent.
    pub fn without_effects(rig: &Rig<R>) -> Result<Self, ParameterError> {
        rig.validate()?;
        Ok(Self::assemble(rig, Self::nominal(rig)))
    }

    fn nominal(rig: &Rig<R>) -> Coefficients<R> {
        let (v, c, f) = (&rig.valve, &rig.cylinder, &rig.friction);
        Coefficients {
            exponent: rig.gas.heat_capacity_ratio,
            atmosphere_pa: rig.supply.atmosphere_pa,
            supply_pa: rig.supply.pressure_pa,
            dead_zone: DeadZone {
                right_v: v.dead_zone_right_v,
                left_v: v.dead_zone_left_v,
                slope_right: v.slope_right,
                slope_left: v.slope_left,
            },
            max_voltage_v: v.max_voltage_v,
            spool_time_constant_s: R::ZERO,
            play_half_width_v: R::ZERO,
            line_delay_s: R::ZERO,
            fill: v.fill_coefficient_kg_per_s_pa,
            exhaust: v.exhaust_coefficient_kg_per_s_pa,
            choked: None,
            droop_pa_s_per_kg: R::ZERO,
            droop_time_constant_s: R::ONE,
            leak_cross: R::ZERO,
            leak_a: R::ZERO,
            leak_b: R::ZERO,
            area_m2: c.area_m2,
            half_stroke_m: c.stroke_m * R::HALF,
            volume_a0_m3: c.volume_a0_m3,
            volume_b0_m3: c.volume_b0_m3,
            mass_kg: rig.load.mass_kg,
            constant_force_n: R::ZERO,
            stiffness: f.stiffness_n_per_m,
            damping: f.damping_n_s_per_m,
            viscous: f.viscous_n_s_per_m,
            coulomb_n: f.coulomb_n,
            static_n: f.static_n,
            stribeck_velocity_m_per_s: f.stribeck_velocity_m_per_s,
            breakaway_m: f.breakaway_m,
            asymmetry: R::ZERO,
            position_slope: R::ZERO,
            position_amplitude: R::ZERO,
            position_wave_number: R::ZERO,
            pressure_friction: R::ZERO,
            position_scale: R::ONE,
            pressure_a_offset_pa: R::ZERO,
            pressure_b_offset_pa: R::ZERO,
            pressure_time_constant_s: R::ZERO,
            position_delay_s: R::ZERO,
        }
    }

    fn assemble(rig: &Rig<R>, model: Coefficients<R>) -> Self {
        let iso6358 = model.choked.map(|(critical_ratio, scale)| {
            // With scale 1 the two laws agree at full pressure drop from supply to atmosphere.
            let full = scale * (model.supply_pa - model.atmosphere_pa) / model.supply_pa;
            Iso6358 { critical_ratio, fill: model.fill * full, exhaust: model.exhaust * full }
        });
        let level_varies = model.asymmetry != R::ZERO
            || model.position_slope != R::ZERO
            || model.position_amplitude != R::ZERO
            || model.pressure_friction != R::ZERO;
        Self {
            orifices: Orifices { fill: model.fill, exhaust: model.exhaust, iso6358 },
            lugre: LuGre {
                stiffness: model.stiffness,
                inverse_stiffness: R::ONE / model.stiffness,
                damping: model.damping,
                viscous: model.viscous,
                coulomb_n: model.coulomb_n,
                static_n: model.static_n,
                inverse_stribeck_velocity: R::ONE / model.stribeck_velocity_m_per_s,
                breakaway_m: model.breakaway_m,
                elastic_m: model.breakaway_m.at_most(
                    R::of(LARGEST_BREAKAWAY_RATIO) * model.coulomb_n.at_most(model.static_n) / model.stiffness,
                ),
            },
            energy: rig.gas.gas_constant_j_per_kg_k * model.exponent * rig.gas.temperature_k,
            minimum_volume_m3: R::of(MINIMUM_VOLUME_RATIO)
                * model.area_m2
                * (model.half_stroke_m + model.half_stroke_m),
            inverse_mass: R::ONE / model.mass_kg,
            acceleration_per_pa: model.area_m2 / model.mass_kg,
            minimum_level_n: R::of(MINIMUM_LEVEL_RATIO) * model.coulomb_n,
            level_varies,
            extended: level_varies
                || model.spool_time_constant_s > R::ZERO
                || model.droop_pa_s_per_kg != R::ZERO
                || model.pressure_time_constant_s > R::ZERO
                || model.choked.is_some()
                || model.leak_cross != R::ZERO
                || model.leak_a != R::ZERO
                || model.leak_b != R::ZERO,
            model,
        }
    }

    /// The friction law with its effects folded in, as it stands at rest position and without chamber pressure.
    #[must_use]
    pub fn friction(&self) -> &LuGre<R> {
        &self.lugre
    }

    /// Nominal parameters with all effects folded in.
    #[must_use]
    pub fn coefficients(&self) -> &Coefficients<R> {
        &self.model
    }

    /// `R n T`, the factor from mass flow to `V p'`, J/kg.
    #[must_use]
    pub fn energy_j_per_kg(&self) -> R {
        self.energy
    }

    /// The sliding force `g` in N at a state, effects of direction, position and pressure included, and its derivative
    /// by velocity.
    #[inline]
    #[must_use]
    pub fn friction_level(&self, state: &State<R>) -> Level<R> {
        self.level::<true, false>(state).0
    }

    /// A force in N below which no sliding force lies, at any state.
    #[must_use]
    pub fn least_friction_level_n(&self) -> R {
        if self.level_varies { self.minimum_level_n } else { self.lugre.coulomb_n.at_most(self.lugre.static_n) }
    }

    /// Friction force and bristle rate at a state (3.9, 3.10), effects included, with partial derivatives. Resting pistons
    /// are cheap: their sliding force need not be known.
    #[inline]
    #[must_use]
    pub fn friction_at(&self, state: &State<R>) -> Response<R> {
        let (z, v) = (state.z_m, state.v_m_per_s);
        if !self.level_varies && self.lugre.is_elastic(z, v) {
            return self.lugre.elastic_response(z, v);
        }
        self.lugre.respond(z, v, &self.friction_level(state))
    }

    /// The dead zone in force.
    #[must_use]
    pub fn dead_zone(&self) -> &DeadZone<R> {
        &self.model.dead_zone
    }

    /// The valve's flow law in force.
    #[must_use]
    pub fn orifices(&self) -> &Orifices<R> {
        &self.orifices
    }

    /// Half the stroke, m: the end stops stand at plus and minus this position.
    #[must_use]
    pub fn half_stroke_m(&self) -> R {
        self.model.half_stroke_m
    }

    /// Volumes of chambers A and B at piston position `y` in m, m3; never below the stated minimum (3.5).
    #[must_use]
    pub fn volumes_m3(&self, y_m: R) -> (R, R) {
        let m = &self.model;
        (
            (m.volume_a0_m3 + m.area_m2 * y_m).at_least(self.minimum_volume_m3),
            (m.volume_b0_m3 - m.area_m2 * y_m).at_least(self.minimum_volume_m3),
        )
    }

    /// A state at rest with the given position in m and chamber pressures in Pa absolute, valve at mid.
    #[must_use]
    pub fn state_at_rest(&self, y_m: R, p_a_pa: R, p_b_pa: R) -> State<R> {
        State {
            y_m,
            p_a_pa,
            p_b_pa,
            p_sup_pa: self.model.supply_pa,
            p_a_sensed_pa: p_a_pa,
            p_b_sensed_pa: p_b_pa,
            ..State::default()
        }
    }

    /// The inputs for a valve command in V with nominal supply and no external force.
    #[must_use]
    pub fn inputs(&self, u_v: R) -> Inputs<R> {
        Inputs { u_v, external_force_n: R::ZERO, supply_pa: self.model.supply_pa }
    }

    /// Whether an effect is in use that adds a state, a flow or a coupling between states that the paper's model has not.
    /// Without one the right-hand side takes a shorter path.
    #[inline]
    pub(crate) fn is_extended(&self) -> bool {
        self.extended
    }

    /// The right-hand side: rates of change of the whole state under constant inputs.
    ///
    /// The command acts on the spool directly; delay and hysteresis are the command path's business
    /// ([`Simulator`](crate::Simulator)).
    #[must_use]
    pub fn derivative(&self, state: &State<R>, inputs: &Inputs<R>) -> State<R> {
        let mut state = *state;
        let drive = self.drive(inputs);
        if self.is_extended() {
            self.settle(&mut state, &drive);
            self.rates::<true>(&state, &drive, false)
        } else {
            self.rates::<false>(&state, &drive, false)
        }
    }
}
