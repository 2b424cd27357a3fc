//! The plant: nominal parameters and effects folded into one right-hand side.

use crate::coefficients::{Coefficients, ValvePaths};
use crate::cushion::Cushion;
use crate::dead_zone::DeadZone;
use crate::effects::terms::Chamber;
use crate::effects::{Added, ChamberFlow, Effect, Effects, Side};
use crate::friction::{LARGEST_BREAKAWAY_RATIO, Level, LuGre, Response};
use crate::hose::{self, Resistance, Throttle};
use crate::measurement::Measurement;
use crate::opening::OpeningCurve;
use crate::real::Real;
use crate::rig::{ParameterError, Rig};
use crate::tube::Tube;
use crate::valve_flow::{Flow, Opening, Orifices};

/// The smallest volume a chamber can have, as a part of the swept volume `A L` (erratum: case (b) would reach zero).
pub const MINIMUM_VOLUME_RATIO: f64 = 0.005;

/// Standard gravity, m/s2.
pub const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// The sliding force never falls below this part of the Coulomb force, whatever effects are combined.
const MINIMUM_LEVEL_RATIO: f64 = 1.0e-3;

/// The state: the paper's five, and others that exist only under effects and else follow their sources at once.
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
    /// Spool position as a voltage, V (`valve-lag`), as chamber A feels it at the end of its hose.
    pub spool_v: R,
    /// Velocity of a spool with inertia, V/s (`valve.spool_inertia`).
    pub spool_v_per_s: R,
    /// Supply pressure at the valve, Pa absolute (`supply-droop`).
    pub p_sup_pa: R,
    /// Pressure of A behind the sensor's lag, Pa absolute, offset not included (`pressure-lag`).
    pub p_a_sensed_pa: R,
    /// Pressure of B behind the sensor's lag, Pa absolute, offset not included (`pressure-lag`).
    pub p_b_sensed_pa: R,
    /// Position behind the sensor's lag, before its scale, m (`position-lag`).
    pub y_sensed_m: R,
    /// How much warmer the air of A is than the supply, relative to the supply's temperature (`wall-heat`).
    pub warmth_a: R,
    /// How much warmer the air of B is than the supply, relative to the supply's temperature (`wall-heat`).
    pub warmth_b: R,
    /// Spool position as chamber B feels it, V: earlier or later by what the hoses' delays differ.
    pub spool_b_v: R,
    /// Velocity of the spool as chamber B feels it, V/s.
    pub spool_b_v_per_s: R,
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
    pub(crate) added: Added<R>,
    pub(crate) orifices_a: Orifices<R>,
    pub(crate) orifices_b: Orifices<R>,
    curve: Option<OpeningCurve<R>>,
    pub(crate) lugre: LuGre<R>,
    /// `R n T`, J/kg.
    pub(crate) energy: R,
    pub(crate) minimum_volume_a_m3: R,
    pub(crate) minimum_volume_b_m3: R,
    pub(crate) inverse_mass: R,
    /// `A_b / M`, m/(s2 Pa).
    pub(crate) acceleration_per_pa: R,
    /// `A_a - A_b`, m2.
    pub(crate) uneven_area_m2: R,
    /// Weight along the incline, N.
    pub(crate) weight_n: R,
    /// `(A_a - A_b) / M`, m/(s2 Pa).
    pub(crate) uneven_acceleration_per_pa: R,
    pub(crate) minimum_level_n: R,
    /// No sliding force lies below, at any state, N.
    least_level_n: R,
    pub(crate) level_varies: bool,
    /// A spring in place of chamber B's air.
    pub(crate) single_acting: bool,
    feels_apart: bool,
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
        let mut added = Added::default();
        effects.apply(&mut model, &mut added);
        let delay = added.line_delay.delay_s;
        if delay < R::ZERO && model.hose_delays_s == [R::ZERO; 2] {
            let key = Effect::LineDelay.info().parameters[0].key;
            let must = "not be negative where no hose delays the command".into();
            return Err(ParameterError { key, value: delay.to_f64(), must });
        }
        Ok(Self::assemble(rig, model, added))
    }

    /// The paper's model of a rig, without effects: the same as [`Plant::new`] with [`Effects::none`], but without the
    /// effect catalogue and its texts in the program, which a microcontroller has no room for.
    ///
    /// # Errors
    /// The first parameter of the rig that is not finite, out of range or inconsistent.
    pub fn without_effects(rig: &Rig<R>) -> Result<Self, ParameterError> {
        rig.validate()?;
        Ok(Self::unchecked(rig))
    }

    /// The plant of a rig that nobody has checked: for figures of a rig, not for motion.
    #[must_use]
    pub fn unchecked(rig: &Rig<R>) -> Self {
        Self::assemble(rig, Self::nominal(rig), Added::default())
    }

    fn nominal(rig: &Rig<R>) -> Coefficients<R> {
        let (v, c, f, g, h) = (&rig.valve, &rig.cylinder, &rig.friction, &rig.gas, &rig.hoses);
        Coefficients {
            exponent: rig.gas.heat_capacity_ratio,
            temperature_k: rig.gas.temperature_k,
            atmosphere_pa: rig.supply.atmosphere_pa,
            supply_pa: rig.supply.pressure_pa,
            dead_zone: DeadZone {
                right_v: v.dead_zone_right_v,
                left_v: v.dead_zone_left_v,
                slope_right: v.slope_right,
                slope_left: v.slope_left,
                rounding_v: v.corner_rounding_v,
            },
            exhaust_overlap_v: v.exhaust_overlap_v,
            max_voltage_v: v.max_voltage_v,
            valve_a: Self::valve_paths(rig, Side::A),
            valve_b: Self::valve_paths(rig, Side::B),
            area_a_m2: c.area_a_m2,
            area_b_m2: if c.is_single_acting() { R::ZERO } else { c.area_b_m2 },
            spring_n_per_m: c.spring_n_per_m,
            spring_preload_n: c.spring_preload_n,
            half_stroke_m: c.stroke_m * R::HALF,
            volume_a0_m3: c.volume_a0_m3 + hose::volume_m3(h.a_length_m, h.a_diameter_m),
            volume_b0_m3: c.volume_b0_m3 + hose::volume_m3(h.b_length_m, h.b_diameter_m),
            spool_inertia: rig.valve.spool_inertia,
            hose_delays_s: if rig.has_hoses() {
                let sound = (g.heat_capacity_ratio * g.gas_constant_j_per_kg_k * g.temperature_k).sqrt();
                [h.a_length_m / sound, h.b_length_m / sound]
            } else {
                [R::ZERO; 2]
            },
            mass_kg: rig.load.mass_kg,
            gravity_m_per_s2: if rig.load.inclination_deg == R::ZERO {
                R::ZERO
            } else {
                R::of(GRAVITY_M_PER_S2) * (rig.load.inclination_deg * R::of(core::f64::consts::PI / 180.0)).sin()
            },
            stiffness: f.stiffness_n_per_m,
            damping: f.damping_n_s_per_m,
            viscous: f.viscous_n_s_per_m,
            coulomb_n: f.coulomb_n,
            static_n: f.static_n,
            stribeck_velocity_m_per_s: f.stribeck_velocity_m_per_s,
            breakaway_m: f.breakaway_m,
        }
    }

    /// The valve's paths to and from a chamber, and the hose, as the rig states them.
    fn valve_paths(rig: &Rig<R>, side: Side) -> ValvePaths<R> {
        let (v, h, s) = (&rig.valve, &rig.hoses, &rig.supply);
        let (length_m, diameter_m) = match side {
            Side::A => (h.a_length_m, h.a_diameter_m),
            Side::B => (h.b_length_m, h.b_diameter_m),
        };
        let full_drop = (s.pressure_pa - s.atmosphere_pa) / s.pressure_pa;
        let hose = Tube::hose(length_m, diameter_m, rig.gas.temperature_k);
        let cushion = Self::cushion(rig, side, full_drop);
        if !rig.follows_iso6358() {
            let (fill, exhaust) = (v.fill_coefficient_kg_per_s_pa, v.exhaust_coefficient_kg_per_s_pa);
            return ValvePaths { fill, exhaust, critical_ratios: None, hose, line: None, cushion };
        }
        let (fill, exhaust, ratios) = match side {
            Side::A => (
                v.fill_conductance_a_m3_per_s_pa,
                v.exhaust_conductance_a_m3_per_s_pa,
                [v.fill_critical_ratio_a, v.exhaust_critical_ratio_a],
            ),
            Side::B => (
                v.fill_conductance_b_m3_per_s_pa,
                v.exhaust_conductance_b_m3_per_s_pa,
                [v.fill_critical_ratio_b, v.exhaust_critical_ratio_b],
            ),
        };
        let [fill, exhaust] = [fill, exhaust].map(|sonic| rig.sonic_flow_per_rad(sonic));
        ValvePaths { fill, exhaust, critical_ratios: Some(ratios), hose, line: None, cushion }
    }

    fn cushion(rig: &Rig<R>, side: Side, full_drop: R) -> Option<(R, Throttle<R>)> {
        let c = &rig.cushions;
        let (length_m, sonic) = match side {
            Side::A => (c.cushion_a_length_m, c.cushion_a_conductance_m3_per_s_pa),
            Side::B => (c.cushion_b_length_m, c.cushion_b_conductance_m3_per_s_pa),
        };
        let conductance = hose::mass_conductance(sonic, rig.gas.temperature_k);
        let needle = Throttle::new(conductance, R::ONE, true, full_drop);
        (length_m > R::ZERO).then_some((length_m, needle))
    }

    fn assemble(rig: &Rig<R>, model: Coefficients<R>, added: Added<R>) -> Self {
        let single_acting = rig.cylinder.is_single_acting();
        let orifices = |valve: &ValvePaths<R>| {
            let iso6358 = added.choked_flow.on(valve, model.supply_pa, model.atmosphere_pa);
            let behind = |throttles: &[Option<Throttle<R>>]| Resistance::of(valve.hose, throttles, iso6358.is_some());
            Orifices {
                fill: valve.fill,
                exhaust: valve.exhaust,
                iso6358,
                hose: behind(&[valve.line]),
                cushion: valve.cushion.and_then(|(length_m, needle)| {
                    behind(&[valve.line, Some(needle)]).map(|needle| Cushion { length_m, needle })
                }),
            }
        };
        let orifices_a = orifices(&model.valve_a);
        // The valve's port to a chamber that breathes freely is plugged.
        let plugged = Orifices { fill: R::ZERO, exhaust: R::ZERO, iso6358: None, hose: None, cushion: None };
        let orifices_b = if single_acting { plugged } else { orifices(&model.valve_b) };
        let linear = |o: &Orifices<R>| o.iso6358.is_none() && o.hose.is_none() && o.cushion.is_none();
        let minimum_level_n = R::of(MINIMUM_LEVEL_RATIO) * model.coulomb_n;
        let least_level_n = added
            .least_sliding_n(model.coulomb_n.at_most(model.static_n), model.half_stroke_m)
            .at_least(minimum_level_n);
        let weight_n = model.mass_kg * model.gravity_m_per_s2;
        let level_varies = added.changes_sliding_force();
        let stroke_m = model.half_stroke_m + model.half_stroke_m;
        let uneven_area_m2 = model.area_a_m2 - model.area_b_m2;
        let [delay_a, delay_b] = line_delays_s(&model, &added);
        let minimum_volume = |area_m2: R| R::of(MINIMUM_VOLUME_RATIO) * area_m2 * stroke_m;
        Self {
            orifices_a,
            orifices_b,
            curve: (added.opening_curve.curve.map(OpeningCurve::Parabola))
                .or_else(|| OpeningCurve::of(&rig.opening, rig.valve.opening_smoothness)),
            weight_n,
            lugre: LuGre {
                stiffness: model.stiffness,
                inverse_stiffness: R::ONE / model.stiffness,
                damping: model.damping,
                viscous: model.viscous,
                coulomb_n: model.coulomb_n,
                static_n: model.static_n,
                inverse_stribeck_velocity: R::ONE / model.stribeck_velocity_m_per_s,
                breakaway_m: model.breakaway_m,
                elastic_m: model.breakaway_m.at_most(R::of(LARGEST_BREAKAWAY_RATIO) * least_level_n / model.stiffness),
            },
            energy: rig.gas.gas_constant_j_per_kg_k * model.exponent * rig.gas.temperature_k,
            minimum_volume_a_m3: minimum_volume(model.area_a_m2),
            minimum_volume_b_m3: minimum_volume(model.area_b_m2),
            inverse_mass: R::ONE / model.mass_kg,
            acceleration_per_pa: model.area_b_m2 / model.mass_kg,
            uneven_area_m2,
            uneven_acceleration_per_pa: uneven_area_m2 / model.mass_kg,
            minimum_level_n,
            least_level_n,
            level_varies,
            single_acting,
            feels_apart: delay_a != delay_b,
            extended: level_varies
                || added.is_present()
                || uneven_area_m2 != R::ZERO
                || weight_n != R::ZERO
                || single_acting
                || !(linear(&orifices_a) && linear(&orifices_b)),
            model,
            added,
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

    /// Coefficients of the terms that effects add to the paper's equations.
    #[must_use]
    pub fn added(&self) -> &Added<R> {
        &self.added
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
        self.least_level_n
    }

    /// Friction force and bristle rate at a state (3.9, 3.10), effects included, with partial derivatives. Resting pistons
    /// are cheap: their sliding force need not be known.
    #[inline]
    #[must_use]
    pub fn friction_at(&self, state: &State<R>) -> Response<R> {
        let (z, v) = (state.z_m, state.v_m_per_s);
        if self.lugre.is_elastic(z, v) {
            return self.lugre.elastic_response(z, v);
        }
        self.lugre.respond(z, v, &self.friction_level(state))
    }

    /// The dead zone in force.
    #[must_use]
    pub fn dead_zone(&self) -> &DeadZone<R> {
        &self.model.dead_zone
    }

    /// The valve's flow law in force on the paths of a chamber, its hose included.
    #[inline]
    #[must_use]
    pub fn orifices(&self, side: Side) -> &Orifices<R> {
        match side {
            Side::A => &self.orifices_a,
            Side::B => &self.orifices_b,
        }
    }

    /// The valve's opening with its spool at a command in V.
    #[inline]
    #[must_use]
    pub fn opening(&self, spool_v: R) -> Opening<R> {
        let w = self.model.dead_zone.output_v(spool_v);
        let opening = self.opening_at(w);
        match self.exhaust_zone() {
            None => opening,
            Some(zone) => self.with_exhaust(&opening, zone.output_v(spool_v)),
        }
    }

    /// An opening with its paths to atmosphere at an effective command of their own, V.
    #[cold]
    #[inline(never)]
    fn with_exhaust(&self, opening: &Opening<R>, w: R) -> Opening<R> {
        opening.with_exhaust(&self.opening_at(w))
    }

    /// The magnitude of the opening in rad at an effective command in V.
    #[inline]
    #[must_use]
    pub fn magnitude(&self, w: R) -> R {
        self.curve.as_ref().map_or_else(|| Opening::arc_tangent(w), |curve| curve.at(w).0)
    }

    /// The opening at an effective command in V.
    #[inline]
    pub(crate) fn opening_at(&self, w: R) -> Opening<R> {
        Opening::open(w, self.magnitude(w))
    }

    /// Derivative of an opening's magnitude by the effective command, rad/V.
    #[inline]
    #[must_use]
    pub fn gain_per_v(&self, opening: &Opening<R>) -> R {
        match &self.curve {
            None => opening.gain_per_v(),
            Some(curve) => {
                let slope = curve.at(opening.w).1;
                if opening.fills_a { slope } else { -slope }
            }
        }
    }

    /// The dead zone of the paths to atmosphere, if they have one of their own.
    #[must_use]
    pub fn exhaust_zone(&self) -> Option<DeadZone<R>> {
        let overlap_v = self.model.exhaust_overlap_v;
        (overlap_v != R::ZERO).then(|| self.model.dead_zone.widened(overlap_v))
    }

    /// The curve by which the valve opens, if it is not the arc tangent.
    #[must_use]
    pub fn opening_curve(&self) -> Option<&OpeningCurve<R>> {
        self.curve.as_ref()
    }

    /// Whether another plant is the same but for what leads from the command to the valve's opening: delay, hysteresis and lag
    /// of the spool, dead zone, opening curve.
    #[must_use]
    pub fn differs_in_opening_only(&self, other: &Self) -> bool {
        let mut alike = *other;
        alike.model.dead_zone = self.model.dead_zone;
        alike.model.exhaust_overlap_v = self.model.exhaust_overlap_v;
        alike.model.spool_inertia = self.model.spool_inertia;
        alike.curve = self.curve;
        alike.added.opening_curve = self.added.opening_curve;
        alike.added.line_delay = self.added.line_delay;
        alike.added.valve_hysteresis = self.added.valve_hysteresis;
        alike.added.valve_lag = self.added.valve_lag;
        alike.model.hose_delays_s = self.model.hose_delays_s;
        alike.feels_apart = self.feels_apart;
        alike.extended = self.extended;
        alike == *self
    }

    /// Whether a spring in chamber B takes the place of its air, which is at atmospheric pressure.
    #[must_use]
    pub fn is_single_acting(&self) -> bool {
        self.single_acting
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
            (m.volume_a0_m3 + m.area_a_m2 * y_m).at_least(self.minimum_volume_a_m3),
            (m.volume_b0_m3 - m.area_b_m2 * y_m).at_least(self.minimum_volume_b_m3),
        )
    }

    /// Piston area towards a chamber, m2.
    #[must_use]
    pub fn area_m2(&self, side: Side) -> R {
        match side {
            Side::A => self.model.area_a_m2,
            Side::B => self.model.area_b_m2,
        }
    }

    /// Flow into a chamber through the valve, its hose and cushion, with the piston at `y_m` in m; as
    /// [`Orifices::inflow_at`].
    #[inline(always)]
    #[must_use]
    pub fn valve_inflow(&self, side: Side, y_m: R, filling: bool, magnitude: R, p: R, supply: R) -> Flow<R> {
        let (half, atmosphere) = (self.model.half_stroke_m, self.model.atmosphere_pa);
        let distance_m = if side == Side::A { half + y_m } else { half - y_m };
        self.orifices(side).inflow_at(distance_m, filling, magnitude, p, supply, atmosphere)
    }

    /// The volume below which a chamber is never taken to shrink, m3.
    #[must_use]
    pub fn minimum_volume_m3(&self, side: Side) -> R {
        match side {
            Side::A => self.minimum_volume_a_m3,
            Side::B => self.minimum_volume_b_m3,
        }
    }

    /// Adds what effects let into a chamber beside the valve, such as leaks, to a flow; pressures in Pa absolute. Without
    /// the other chamber's pressure, what depends on it is left out.
    #[inline]
    pub fn add_flows(&self, side: Side, p_pa: R, p_other_pa: Option<R>, flow: &mut ChamberFlow<R>) {
        if self.single_acting && side == Side::B {
            return;
        }
        self.added.flow(&Chamber { side, p_pa, p_other_pa, atmosphere_pa: self.model.atmosphere_pa }, flow);
    }

    /// What effects let into a chamber beside the valve, see [`Plant::add_flows`].
    #[must_use]
    pub fn leaks(&self, side: Side, p_pa: R, p_other_pa: Option<R>) -> ChamberFlow<R> {
        let mut flow = ChamberFlow::default();
        self.add_flows(side, p_pa, p_other_pa, &mut flow);
        flow
    }

    /// Net force on the piston towards chamber B in N, apart from friction and from forces outside the model; pressures in
    /// Pa absolute.
    #[must_use]
    pub fn net_force_n(&self, y_m: R, v_m_per_s: R, p_a_pa: R, p_b_pa: R) -> R {
        self.force_at::<true>(y_m, v_m_per_s, p_a_pa, p_b_pa).force_n
    }

    /// What a pressure sensor shows in Pa absolute, from the pressure behind its lag.
    #[inline]
    #[must_use]
    pub fn shown_pressure_pa(&self, side: Side, behind_lag_pa: R) -> R {
        let p = behind_lag_pa;
        let shown = self.added.sense(Measurement { p_a_pa: p, p_b_pa: p, ..Measurement::default() });
        match side {
            Side::A => shown.p_a_pa,
            Side::B => shown.p_b_pa,
        }
    }

    /// The pressure behind the sensor's lag in Pa absolute, from what the sensor shows.
    #[must_use]
    pub fn pressure_behind_lag_pa(&self, side: Side, shown_pa: R) -> R {
        self.added.true_pressure_pa(side, shown_pa)
    }

    /// The pressure in a chamber in Pa absolute, from what the sensor shows and its slope in Pa/s.
    #[must_use]
    pub fn true_pressure_pa(&self, side: Side, shown_pa: R, slope_pa_per_s: R) -> R {
        let ahead_pa = self.added.pressure_lag.ahead(shown_pa, slope_pa_per_s);
        self.added.true_pressure_pa(side, ahead_pa)
    }

    /// The position in m, from what the sensor shows (of the moment to which that belongs, see
    /// [`Plant::position_delay_s`]).
    #[must_use]
    pub fn true_position_m(&self, shown_m: R) -> R {
        self.added.true_position_m(shown_m)
    }

    /// What the position sensor shows in m, of a position.
    #[must_use]
    pub fn shown_position_m(&self, y_m: R) -> R {
        self.added.sense(Measurement { y_m, ..Measurement::default() }).y_m
    }

    /// By how much the position signal is late, s.
    #[must_use]
    pub fn position_delay_s(&self) -> R {
        self.added.position_delay.delay_s
    }

    /// By how much chambers A and B feel the command late, s: the delays of their hoses, and more or less of them by an effect.
    #[must_use]
    pub fn line_delays_s(&self) -> [R; 2] {
        line_delays_s(&self.model, &self.added)
    }

    /// The same in the mean of both chambers, s.
    #[must_use]
    pub fn mean_line_delay_s(&self) -> R {
        let [a, b] = self.line_delays_s();
        R::HALF * (a + b)
    }

    /// Whether one chamber feels a motion of the spool later than the other, behind a longer hose.
    #[inline]
    #[must_use]
    pub fn feels_apart(&self) -> bool {
        self.feels_apart
    }

    /// A state at rest with the given position in m and chamber pressures in Pa absolute, valve at mid.
    #[must_use]
    pub fn state_at_rest(&self, y_m: R, p_a_pa: R, p_b_pa: R) -> State<R> {
        let p_b_pa = if self.single_acting { self.model.atmosphere_pa } else { p_b_pa };
        State {
            y_m,
            p_a_pa,
            p_b_pa,
            p_sup_pa: self.model.supply_pa,
            p_a_sensed_pa: p_a_pa,
            p_b_sensed_pa: p_b_pa,
            y_sensed_m: y_m,
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

/// See [`Plant::line_delays_s`].
fn line_delays_s<R: Real>(model: &Coefficients<R>, added: &Added<R>) -> [R; 2] {
    model.hose_delays_s.map(|hose_s| (hose_s + added.line_delay.delay_s).at_least(R::ZERO))
}
