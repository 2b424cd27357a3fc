//! The plant: nominal parameters and effects folded into one right-hand side.

use crate::chamber::Volume;
use crate::dead_zone::DeadZone;
use crate::effects::Effects;
use crate::friction::{Level, LuGre};
use crate::real::Real;
use crate::rig::{ParameterError, Rig};
use crate::valve_flow::{Iso6358, Opening, Orifices};

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

/// Everything the right-hand side needs, effects included. Built by [`Plant::new`], changed by effects only.
///
/// Public so that a single balance can be evaluated against measured signals with the very same coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients<R> {
    /// Polytropic exponent of both balances: gamma, or n under `heat-transfer`.
    pub exponent: R,
    /// Atmospheric pressure, Pa absolute.
    pub atmosphere_pa: R,
    /// Nominal supply pressure, Pa absolute.
    pub supply_pa: R,
    /// Dead zone of the valve.
    pub dead_zone: DeadZone<R>,
    /// Largest command magnitude the valve follows, V.
    pub max_voltage_v: R,
    /// First-order time constant of the spool, s; 0 for none.
    pub spool_time_constant_s: R,
    /// Half-width of the command play, V.
    pub play_half_width_v: R,
    /// Delay of the command, s.
    pub line_delay_s: R,
    /// `beta_fill`, kg/(s Pa).
    pub fill: R,
    /// `beta_exh`, kg/(s Pa).
    pub exhaust: R,
    /// Critical ratio and conductance scale of the ISO 6358 law; absent for the paper's linear law.
    pub choked: Option<(R, R)>,
    /// Supply pressure lost per mass flow, Pa s/kg.
    pub droop_pa_s_per_kg: R,
    /// Recovery time constant of the supply, s.
    pub droop_time_constant_s: R,
    /// Leak conductance from A to B, kg/(s Pa).
    pub leak_cross: R,
    /// Leak conductance from A to atmosphere, kg/(s Pa).
    pub leak_a: R,
    /// Leak conductance from B to atmosphere, kg/(s Pa).
    pub leak_b: R,
    /// Piston area, m2.
    pub area_m2: R,
    /// Half the stroke, m.
    pub half_stroke_m: R,
    /// Volume of chamber A at mid-stroke, m3.
    pub volume_a0_m3: R,
    /// Volume of chamber B at mid-stroke, m3.
    pub volume_b0_m3: R,
    /// Moving mass, kg.
    pub mass_kg: R,
    /// Constant force opposing positive motion, N.
    pub constant_force_n: R,
    /// `sigma0`, N/m.
    pub stiffness: R,
    /// `sigma1`, N s/m.
    pub damping: R,
    /// `sigma2`, N s/m.
    pub viscous: R,
    /// `F_c`, N.
    pub coulomb_n: R,
    /// `F_s`, N.
    pub static_n: R,
    /// `v_s`, m/s.
    pub stribeck_velocity_m_per_s: R,
    /// `z_ba`, m.
    pub breakaway_m: R,
    /// Relative friction asymmetry.
    pub asymmetry: R,
    /// Relative change of friction per metre, 1/m.
    pub position_slope: R,
    /// Relative amplitude of periodic friction.
    pub position_amplitude: R,
    /// Wave number of periodic friction, rad/m.
    pub position_wave_number: R,
    /// Friction per sum of gauge pressures, N/Pa.
    pub pressure_friction: R,
    /// Gain of the position sensor.
    pub position_scale: R,
    /// Offset of pressure sensor A, Pa.
    pub pressure_a_offset_pa: R,
    /// Offset of pressure sensor B, Pa.
    pub pressure_b_offset_pa: R,
    /// Time constant of both pressure sensors, s; 0 for none.
    pub pressure_time_constant_s: R,
    /// Delay of the position signal, s.
    pub position_delay_s: R,
}

/// The model of one rig with its effects, ready to be evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant<R> {
    pub(crate) model: Coefficients<R>,
    orifices: Orifices<R>,
    lugre: LuGre<R>,
    /// `R n T`, J/kg.
    energy: R,
    minimum_volume_m3: R,
    inverse_mass: R,
    minimum_level_n: R,
    level_varies: bool,
    extended: bool,
}

/// What the valve does during a step: known beforehand where the spool follows its command at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drive<R> {
    pub(crate) command_v: R,
    opening: Opening<R>,
    external_force_n: R,
    pub(crate) supply_pa: R,
}

/// Partial derivatives of the right-hand side, `ROW_COLUMN`: chamber pressures `a` and `b`, bristle `z`, velocity `v`,
/// position `y`, spool, supply. The second block is zero in the paper's model.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Jacobian<R> {
    pub(crate) a_a: R,
    pub(crate) a_v: R,
    pub(crate) a_y: R,
    pub(crate) b_b: R,
    pub(crate) b_v: R,
    pub(crate) b_y: R,
    pub(crate) z_z: R,
    pub(crate) z_v: R,
    /// By `p_a`; by `p_b` it is the opposite.
    pub(crate) v_p: R,
    pub(crate) v_z: R,
    pub(crate) v_v: R,

    pub(crate) a_b: R,
    pub(crate) b_a: R,
    pub(crate) z_y: R,
    /// By either pressure.
    pub(crate) z_p: R,
    pub(crate) v_y: R,
    /// By either pressure, through the sliding force.
    pub(crate) v_level_p: R,
    pub(crate) a_supply: R,
    pub(crate) b_supply: R,
    pub(crate) a_spool: R,
    pub(crate) b_spool: R,
    pub(crate) supply_supply: R,
    pub(crate) supply_spool: R,
    /// By the pressure of the chamber that is being filled.
    pub(crate) supply_filled: R,
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
            },
            energy: rig.gas.gas_constant_j_per_kg_k * model.exponent * rig.gas.temperature_k,
            minimum_volume_m3: R::of(MINIMUM_VOLUME_RATIO)
                * model.area_m2
                * (model.half_stroke_m + model.half_stroke_m),
            inverse_mass: R::ONE / model.mass_kg,
            minimum_level_n: R::of(MINIMUM_LEVEL_RATIO) * model.coulomb_n,
            level_varies,
            extended: level_varies
                || model.spool_time_constant_s > R::ZERO
                || model.droop_pa_s_per_kg != R::ZERO
                || model.pressure_time_constant_s > R::ZERO
                || model.leak_cross != R::ZERO,
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
        self.level::<true>(state).0
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

    /// Whether an effect is in use that adds a state, or a coupling between states that the paper's model has not.
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

    #[inline]
    pub(crate) fn drive(&self, inputs: &Inputs<R>) -> Drive<R> {
        let command_v = inputs.u_v.limit(-self.model.max_voltage_v, self.model.max_voltage_v);
        Drive {
            command_v,
            opening: Opening::at(self.model.dead_zone.output_v(command_v)),
            external_force_n: inputs.external_force_n,
            supply_pa: inputs.supply_pa,
        }
    }

    /// Lets those additional states that are not in use follow their sources.
    #[inline]
    pub(crate) fn settle(&self, state: &mut State<R>, drive: &Drive<R>) {
        if self.model.spool_time_constant_s <= R::ZERO {
            state.spool_v = drive.command_v;
        }
        if self.model.droop_pa_s_per_kg == R::ZERO {
            state.p_sup_pa = drive.supply_pa;
        }
        if self.model.pressure_time_constant_s <= R::ZERO {
            state.p_a_sensed_pa = state.p_a_pa;
            state.p_b_sensed_pa = state.p_b_pa;
        }
    }

    #[inline]
    fn opening<const EXTENDED: bool>(&self, state: &State<R>, drive: &Drive<R>) -> Opening<R> {
        if EXTENDED { Opening::at(self.model.dead_zone.output_v(state.spool_v)) } else { drive.opening }
    }

    #[inline]
    fn supply<const EXTENDED: bool>(state: &State<R>, drive: &Drive<R>) -> R {
        if EXTENDED { state.p_sup_pa } else { drive.supply_pa }
    }

    /// Sliding force `g` with the effects of direction, position and pressure, and its derivatives by `y` and by the
    /// sum of the pressures.
    #[inline]
    fn level<const EXTENDED: bool>(&self, state: &State<R>) -> (Level<R>, R, R) {
        let plain = self.lugre.level(state.v_m_per_s);
        if !EXTENDED || !self.level_varies {
            return (plain, R::ZERO, R::ZERO);
        }
        let m = &self.model;
        let angle = m.position_wave_number * state.y_m;
        let (wave, wave_slope) = if m.position_amplitude == R::ZERO {
            (R::ZERO, R::ZERO)
        } else {
            (m.position_amplitude * angle.sin(), m.position_amplitude * m.position_wave_number * angle.cos())
        };
        let direction = R::ONE + m.asymmetry * state.v_m_per_s.sign();
        let place = R::ONE + m.position_slope * state.y_m + wave;
        let factor = direction * place;
        let gauge = state.p_a_pa + state.p_b_pa - m.atmosphere_pa - m.atmosphere_pa;
        let (gauge, by_gauge) = if gauge > R::ZERO { (gauge, m.pressure_friction) } else { (R::ZERO, R::ZERO) };
        let loaded = plain.force_n + m.pressure_friction * gauge;
        let force_n = loaded * factor;
        if force_n < self.minimum_level_n {
            return (Level { force_n: self.minimum_level_n, by_velocity: R::ZERO }, R::ZERO, R::ZERO);
        }
        (
            Level { force_n, by_velocity: plain.by_velocity * factor },
            loaded * direction * (m.position_slope + wave_slope),
            by_gauge * factor,
        )
    }

    #[inline]
    fn volumes(&self, y: R) -> (Volume<R>, Volume<R>) {
        let m = &self.model;
        (
            Volume::of(m.volume_a0_m3 + m.area_m2 * y, m.area_m2, self.minimum_volume_m3),
            Volume::of(m.volume_b0_m3 - m.area_m2 * y, m.area_m2, self.minimum_volume_m3),
        )
    }

    /// Net force on the piston apart from friction, N.
    #[inline]
    fn driving_force(&self, state: &State<R>, drive: &Drive<R>) -> R {
        let m = &self.model;
        m.area_m2 * (state.p_a_pa - state.p_b_pa) - m.constant_force_n + drive.external_force_n
    }

    /// Rates of change. `held` keeps the piston at its end stop.
    #[inline]
    pub(crate) fn rates<const EXTENDED: bool>(&self, state: &State<R>, drive: &Drive<R>, held: bool) -> State<R> {
        self.evaluate::<EXTENDED, false>(state, drive, held).0
    }

    /// Rates of change with their partial derivatives.
    #[inline]
    pub(crate) fn linearise<const EXTENDED: bool>(
        &self,
        state: &State<R>,
        drive: &Drive<R>,
        held: bool,
    ) -> (State<R>, Jacobian<R>) {
        self.evaluate::<EXTENDED, true>(state, drive, held)
    }

    #[inline(always)]
    fn evaluate<const EXTENDED: bool, const PARTIALS: bool>(
        &self,
        state: &State<R>,
        drive: &Drive<R>,
        held: bool,
    ) -> (State<R>, Jacobian<R>) {
        let m = &self.model;
        let (y, v, p_a, p_b) = (state.y_m, state.v_m_per_s, state.p_a_pa, state.p_b_pa);
        let opening = self.opening::<EXTENDED>(state, drive);
        let supply = Self::supply::<EXTENDED>(state, drive);

        let valve_a = self.orifices.inflow(opening.fills_a, opening.magnitude, p_a, supply, m.atmosphere_pa);
        let valve_b = self.orifices.inflow(!opening.fills_a, opening.magnitude, p_b, supply, m.atmosphere_pa);
        let mut into_a = valve_a.mass_flow - m.leak_a * (p_a - m.atmosphere_pa);
        let mut into_b = valve_b.mass_flow - m.leak_b * (p_b - m.atmosphere_pa);
        let mut by_a = valve_a.by_chamber - m.leak_a;
        let mut by_b = valve_b.by_chamber - m.leak_b;
        if EXTENDED {
            let crossing = m.leak_cross * (p_a - p_b);
            into_a -= crossing;
            into_b += crossing;
            by_a -= m.leak_cross;
            by_b -= m.leak_cross;
        }

        let (volume_a, volume_b) = self.volumes(y);
        let rate_a = volume_a.pressure_rate(m.exponent, self.energy, p_a, v, into_a, by_a);
        let rate_b = volume_b.pressure_rate(m.exponent, self.energy, p_b, -v, into_b, by_b);

        let (level, level_by_y, level_by_p) = self.level::<EXTENDED>(state);
        let friction = self.lugre.evaluate::<PARTIALS>(state.z_m, v, &level);
        let acceleration = (self.driving_force(state, drive) - friction.force_n) * self.inverse_mass;

        let mut rates = State {
            y_m: if held { R::ZERO } else { v },
            v_m_per_s: if held { R::ZERO } else { acceleration },
            p_a_pa: rate_a.rate,
            p_b_pa: rate_b.rate,
            z_m: friction.bristle_rate,
            ..State::default()
        };
        if EXTENDED {
            if m.spool_time_constant_s > R::ZERO {
                rates.spool_v = (drive.command_v - state.spool_v) / m.spool_time_constant_s;
            }
            if m.droop_pa_s_per_kg != R::ZERO {
                let drawn = if opening.fills_a { valve_a.mass_flow } else { valve_b.mass_flow };
                rates.p_sup_pa =
                    (drive.supply_pa - m.droop_pa_s_per_kg * drawn - state.p_sup_pa) / m.droop_time_constant_s;
            }
            if m.pressure_time_constant_s > R::ZERO {
                rates.p_a_sensed_pa = (p_a - state.p_a_sensed_pa) / m.pressure_time_constant_s;
                rates.p_b_sensed_pa = (p_b - state.p_b_sensed_pa) / m.pressure_time_constant_s;
            }
        }

        let mut jacobian = Jacobian::default();
        if PARTIALS {
            let zero = R::ZERO;
            let damping = self.lugre.damping * self.inverse_mass;
            jacobian.a_a = rate_a.by_pressure;
            jacobian.a_v = rate_a.by_growth;
            jacobian.a_y = rate_a.by_displacement;
            jacobian.b_b = rate_b.by_pressure;
            jacobian.b_v = -rate_b.by_growth;
            jacobian.b_y = -rate_b.by_displacement;
            jacobian.z_z = friction.rate_by_bristle;
            jacobian.z_v = friction.rate_by_velocity;
            jacobian.v_p = m.area_m2 * self.inverse_mass;
            jacobian.v_z = -(self.lugre.stiffness * self.inverse_mass + damping * friction.rate_by_bristle);
            jacobian.v_v = -(damping * friction.rate_by_velocity + self.lugre.viscous * self.inverse_mass);
            if EXTENDED {
                jacobian.z_y = friction.rate_by_level * level_by_y;
                jacobian.z_p = friction.rate_by_level * level_by_p;
                jacobian.v_y = -damping * jacobian.z_y;
                jacobian.v_level_p = -damping * jacobian.z_p;
                jacobian.a_b = m.leak_cross * rate_a.by_mass_flow;
                jacobian.b_a = m.leak_cross * rate_b.by_mass_flow;
                let (gain_a, gain_b) = if opening.magnitude > zero {
                    let slope = opening.gain_per_v() * m.dead_zone.gain(state.spool_v) / opening.magnitude;
                    (valve_a.mass_flow * slope, valve_b.mass_flow * slope)
                } else {
                    (zero, zero)
                };
                jacobian.a_supply = valve_a.by_supply * rate_a.by_mass_flow;
                jacobian.b_supply = valve_b.by_supply * rate_b.by_mass_flow;
                jacobian.a_spool = gain_a * rate_a.by_mass_flow;
                jacobian.b_spool = gain_b * rate_b.by_mass_flow;
                if m.droop_pa_s_per_kg != zero {
                    let loss = -m.droop_pa_s_per_kg / m.droop_time_constant_s;
                    let (drawn, gain) = if opening.fills_a { (valve_a, gain_a) } else { (valve_b, gain_b) };
                    jacobian.supply_supply = loss * drawn.by_supply - R::ONE / m.droop_time_constant_s;
                    jacobian.supply_spool = loss * gain;
                    jacobian.supply_filled = loss * drawn.by_chamber;
                }
            }
        }
        (rates, jacobian)
    }

    /// The end stop the piston rests against, if it does: −1 at −L/2, +1 at +L/2, and the force holds it there.
    #[inline]
    pub(crate) fn held_at_stop(&self, state: &State<R>, drive: &Drive<R>) -> bool {
        let limit = self.model.half_stroke_m;
        if state.y_m.abs() < limit || state.v_m_per_s != R::ZERO {
            return false;
        }
        // The bristles were pushed towards the stop; held, they only keep what they have.
        let outward = state.y_m.sign();
        let force = self.driving_force(state, drive) - self.lugre.stiffness * state.z_m;
        force * outward >= R::ZERO
    }
}
