//! The right-hand side: every equation's rate and its partial derivatives, evaluated in one pass.

use crate::chamber::{PressureRate, Volume};
use crate::dead_zone::DeadZone;
use crate::effects::terms::{Chamber, ChamberFlow, Force, Seal, Side, Term};
use crate::effects::{Added, WarmthRate};
use crate::friction::Level;
use crate::plant::{Inputs, Plant, State};
use crate::real::Real;
use crate::valve_flow::{Connection, Flow, Opening, Orifices};

/// What the valve does during a step: known beforehand where the spool follows its command at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drive<R> {
    /// As chamber A feels it at the end of its hose.
    pub(crate) command_v: R,
    opening: Opening<R>,
    /// Command and opening as chamber B feels them, if [apart](Plant::feels_apart).
    felt_by_b: Option<(R, Opening<R>)>,
    connection_a: Connection<R>,
    connection_b: Connection<R>,
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
    /// By `p_a` where both areas are equal; by `p_b` it is the opposite.
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
    /// By `p_a`, as far as its area is the larger one.
    pub(crate) v_uneven: R,
    pub(crate) a_supply: R,
    pub(crate) b_supply: R,
    pub(crate) a_spool: R,
    pub(crate) b_spool: R,
    pub(crate) supply_supply: R,
    /// By the spool as A and as B feel it; the chamber that is being emptied draws nothing.
    pub(crate) supply_spool_a: R,
    pub(crate) supply_spool_b: R,
    /// Likewise.
    pub(crate) supply_a: R,
    pub(crate) supply_b: R,
    pub(crate) warmth_a: WarmthRow<R>,
    pub(crate) warmth_b: WarmthRow<R>,
}

/// Partial derivatives of the warmth of a chamber's air, and that of the chamber's pressure by it; zero unless the air has
/// a temperature of its own.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WarmthRow<R> {
    pub(crate) by_warmth: R,
    pub(crate) by_pressure: R,
    pub(crate) by_other_pressure: R,
    pub(crate) by_velocity: R,
    pub(crate) by_position: R,
    pub(crate) by_supply: R,
    pub(crate) by_spool: R,
    /// Derivative of the pressure's rate by the warmth, Pa/s.
    pub(crate) pressure_by_warmth: R,
}

impl<R: Real> Plant<R> {
    #[inline]
    pub(crate) fn drive(&self, inputs: &Inputs<R>) -> Drive<R> {
        self.drive_from(inputs, inputs.u_v, &mut Opening::at(R::ZERO))
    }

    /// [`Plant::drive`], given the opening of an earlier command: a held command costs no arc tangent. `u_b_v` is the command as
    /// chamber B feels it, which counts where that is [apart](Plant::feels_apart).
    #[inline(always)]
    pub(crate) fn drive_from(&self, inputs: &Inputs<R>, u_b_v: R, last: &mut Opening<R>) -> Drive<R> {
        let command_v = inputs.u_v.limit(-self.model.max_voltage_v, self.model.max_voltage_v);
        let w = self.model.dead_zone.output_v(command_v);
        if self.model.exhaust_overlap_v != R::ZERO {
            *last = self.opening(command_v);
        } else if w != last.w {
            *last = self.opening_at(w);
        }
        let opening = *last;
        let connect = |orifices: &Orifices<R>, filling| {
            orifices.connect(filling, opening.through(filling), inputs.supply_pa, self.model.atmosphere_pa)
        };
        Drive {
            command_v,
            opening,
            felt_by_b: self.feels_apart().then(|| self.felt_by_b(u_b_v)),
            connection_a: connect(&self.orifices_a, opening.fills_a),
            connection_b: connect(&self.orifices_b, !opening.fills_a),
            external_force_n: inputs.external_force_n,
            supply_pa: inputs.supply_pa,
        }
    }

    #[cold]
    #[inline(never)]
    fn felt_by_b(&self, u_b_v: R) -> (R, Opening<R>) {
        let command_v = u_b_v.limit(-self.model.max_voltage_v, self.model.max_voltage_v);
        (command_v, self.opening(command_v))
    }

    /// Lets those additional states that are not in use follow their sources.
    #[inline]
    pub(crate) fn settle(&self, state: &mut State<R>, drive: &Drive<R>) {
        let added = &self.added;
        if !added.valve_lag.is_present() {
            state.spool_v = drive.command_v;
            state.spool_b_v = drive.felt_by_b.map_or(drive.command_v, |(command_v, _)| command_v);
        }
        if !added.valve_lag.has_inertia() {
            (state.spool_v_per_s, state.spool_b_v_per_s) = (R::ZERO, R::ZERO);
        }
        if !self.feels_apart() {
            (state.spool_b_v, state.spool_b_v_per_s) = (state.spool_v, state.spool_v_per_s);
        }
        if !added.supply_droop.is_present() {
            state.p_sup_pa = drive.supply_pa;
        }
        if !added.pressure_lag.is_present() {
            state.p_a_sensed_pa = state.p_a_pa;
            state.p_b_sensed_pa = state.p_b_pa;
        }
        if !added.position_lag.is_present() {
            state.y_sensed_m = state.y_m;
        }
        if !added.wall_heat.is_present() {
            (state.warmth_a, state.warmth_b) = (R::ZERO, R::ZERO);
        }
    }

    /// [`Plant::settle`] for a plant that uses none of the additional states.
    #[inline]
    pub(crate) fn follow(&self, state: &mut State<R>, drive: &Drive<R>) {
        (state.spool_v, state.spool_v_per_s) = (drive.command_v, R::ZERO);
        (state.spool_b_v, state.spool_b_v_per_s) = (drive.command_v, R::ZERO);
        state.p_sup_pa = drive.supply_pa;
        state.p_a_sensed_pa = state.p_a_pa;
        state.p_b_sensed_pa = state.p_b_pa;
        state.y_sensed_m = state.y_m;
        (state.warmth_a, state.warmth_b) = (R::ZERO, R::ZERO);
    }

    /// The openings that A and B feel.
    #[inline]
    fn openings_now<const EXTENDED: bool>(&self, state: &State<R>, drive: &Drive<R>) -> [Opening<R>; 2] {
        if !EXTENDED {
            return [drive.opening; 2];
        }
        if !self.added.valve_lag.is_present() {
            return [drive.opening, drive.felt_by_b.map_or(drive.opening, |(_, opening)| opening)];
        }
        let of_a = self.opening(state.spool_v);
        [of_a, if self.feels_apart() { self.opening(state.spool_b_v) } else { of_a }]
    }

    /// Sliding force `g` with the effects of direction, position and pressure, and its derivatives by `y` and by the
    /// sum of the pressures, which are meaningful only with `PARTIALS`.
    #[inline(always)]
    pub(crate) fn level<const EXTENDED: bool, const PARTIALS: bool>(&self, state: &State<R>) -> (Level<R>, R, R) {
        let plain = self.lugre.level(state.v_m_per_s);
        if !EXTENDED || !self.level_varies {
            return (plain, R::ZERO, R::ZERO);
        }
        let atmosphere = self.model.atmosphere_pa;
        let sum = self.added.slide::<PARTIALS>(
            plain.force_n,
            &Seal {
                y_m: state.y_m,
                v_m_per_s: state.v_m_per_s,
                gauge_sum_pa: state.p_a_pa + state.p_b_pa - atmosphere - atmosphere,
            },
        );
        let factor = sum.factor * sum.place;
        let force_n = sum.loaded_n * factor;
        if force_n < self.minimum_level_n {
            return (Level { force_n: self.minimum_level_n, by_velocity: R::ZERO }, R::ZERO, R::ZERO);
        }
        (
            Level { force_n, by_velocity: plain.by_velocity * factor },
            sum.loaded_n * sum.factor * sum.place_by_position,
            sum.loaded_by_pressure * factor,
        )
    }

    #[inline(always)]
    fn volumes<const EXTENDED: bool>(&self, y: R) -> (Volume<R>, Volume<R>) {
        let m = &self.model;
        let (area_b, minimum_b) = (m.area_b_m2, self.minimum_volume_b_m3);
        // The shorter path is for equal areas.
        let (area_a, minimum_a) = if EXTENDED { (m.area_a_m2, self.minimum_volume_a_m3) } else { (area_b, minimum_b) };
        (
            Volume::of(m.volume_a0_m3 + area_a * y, area_a, minimum_a),
            Volume::of(m.volume_b0_m3 - area_b * y, area_b, minimum_b),
        )
    }

    /// Net force on the piston towards chamber B, apart from friction.
    #[inline(always)]
    fn driving_force<const EXTENDED: bool>(&self, state: &State<R>, drive: &Drive<R>) -> Force<R> {
        let mut sum = self.force_at::<EXTENDED>(state.y_m, state.v_m_per_s, state.p_a_pa, state.p_b_pa);
        sum.force_n += drive.external_force_n;
        sum
    }

    /// The part of it that the model knows: `A_a (p_a - p_atm) - A_b (p_b - p_atm)`, written such that equal areas give
    /// `A (p_a - p_b)` to the last bit, and what effects add.
    #[inline(always)]
    pub(crate) fn force_at<const EXTENDED: bool>(&self, y: R, v: R, p_a: R, p_b: R) -> Force<R> {
        let m = &self.model;
        let mut sum = Force { force_n: m.area_b_m2 * (p_a - p_b), ..Force::default() };
        if EXTENDED {
            sum.force_n += self.uneven_area_m2 * (p_a - m.atmosphere_pa) - self.weight_n;
            if self.single_acting {
                sum.force_n -= m.spring_preload_n + m.spring_n_per_m * (m.half_stroke_m + y);
            }
        }
        self.added.force(y, v, &mut sum);
        sum
    }

    /// Rates of change. `held` keeps the piston at its end stop.
    #[inline(always)]
    pub(crate) fn rates<const EXTENDED: bool>(&self, state: &State<R>, drive: &Drive<R>, held: bool) -> State<R> {
        self.evaluate::<EXTENDED, false>(state, drive, held).0
    }

    /// Rates of change with their partial derivatives.
    #[inline(always)]
    pub(crate) fn linearise<const EXTENDED: bool>(
        &self,
        state: &State<R>,
        drive: &Drive<R>,
        held: bool,
    ) -> (State<R>, Jacobian<R>) {
        self.evaluate::<EXTENDED, true>(state, drive, held)
    }

    /// Rates of a chamber's pressure (3.6, 3.7) and of its air's warmth, which stays zero in the paper's model. `growth` is the
    /// velocity with which the chamber of this area grows.
    #[inline(always)]
    fn gas_rates<const EXTENDED: bool>(
        &self,
        (volume, area_m2): (&Volume<R>, R),
        p: R,
        growth: R,
        flow: &ChamberFlow<R>,
        warmth: R,
    ) -> (PressureRate<R>, WarmthRate<R>) {
        if EXTENDED
            && let Some(law) = &self.added.wall_heat.law
            && area_m2 > R::ZERO
        {
            return law.rates((volume, area_m2), self.energy, p, growth, flow, warmth);
        }
        let (q, by_p) = (flow.mass_flow, flow.by_chamber);
        (volume.pressure_rate(self.model.exponent, self.energy, p, growth, q, by_p), WarmthRate::default())
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
        // First, because its exponential and its sine are calls, which cost the least while nothing else is under way.
        let (friction, level_by_y, level_by_p) = if self.lugre.is_elastic(state.z_m, v) {
            (self.lugre.elastic_response(state.z_m, v), R::ZERO, R::ZERO)
        } else {
            let (level, by_y, by_p) = self.level::<EXTENDED, PARTIALS>(state);
            (self.lugre.evaluate::<PARTIALS>(state.z_m, v, &level), by_y, by_p)
        };

        let [opening_a, opening_b] = self.openings_now::<EXTENDED>(state, drive);
        let (fills_a, fills_b) = (opening_a.fills_a, !opening_b.fills_a);
        let (valve_a, valve_b) = if EXTENDED {
            let flow = |orifices: &Orifices<R>, distance, opening: &Opening<R>, filling, p| {
                let magnitude = opening.through(filling);
                orifices.inflow_at(distance, filling, magnitude, p, state.p_sup_pa, m.atmosphere_pa)
            };
            (
                flow(&self.orifices_a, m.half_stroke_m + y, &opening_a, fills_a, p_a),
                flow(&self.orifices_b, m.half_stroke_m - y, &opening_b, fills_b, p_b),
            )
        } else {
            (drive.connection_a.inflow(fills_a, p_a), drive.connection_b.inflow(fills_b, p_b))
        };
        let of = |valve: &Flow<R>| ChamberFlow {
            mass_flow: valve.mass_flow,
            by_chamber: valve.by_chamber,
            by_other: R::ZERO,
        };
        let (mut flow_a, mut flow_b) = (of(&valve_a), of(&valve_b));
        if EXTENDED {
            let chamber =
                |side, p_pa, other| Chamber { side, p_pa, p_other_pa: Some(other), atmosphere_pa: m.atmosphere_pa };
            self.added.flow(&chamber(Side::A, p_a, p_b), &mut flow_a);
            if !self.single_acting {
                self.added.flow(&chamber(Side::B, p_b, p_a), &mut flow_b);
            }
        }

        let (volume_a, volume_b) = self.volumes::<EXTENDED>(y);
        let (rate_a, warmth_a) = self.gas_rates::<EXTENDED>((&volume_a, m.area_a_m2), p_a, v, &flow_a, state.warmth_a);
        let (rate_b, warmth_b) = self.gas_rates::<EXTENDED>((&volume_b, m.area_b_m2), p_b, -v, &flow_b, state.warmth_b);

        let driving = self.driving_force::<EXTENDED>(state, drive);
        let acceleration = (driving.force_n - friction.force_n) * self.inverse_mass;

        let mut rates = State {
            y_m: if held { R::ZERO } else { v },
            v_m_per_s: if held { R::ZERO } else { acceleration },
            p_a_pa: rate_a.rate,
            p_b_pa: rate_b.rate,
            z_m: friction.bristle_rate,
            ..State::default()
        };
        if EXTENDED {
            let drawn_by = |fills: bool, valve: &Flow<R>| if fills { valve.mass_flow } else { R::ZERO };
            let drawn = drawn_by(fills_a, &valve_a) + drawn_by(fills_b, &valve_b);
            let lag = &self.added.valve_lag;
            (rates.spool_v, rates.spool_v_per_s) = lag.rates(drive.command_v, state.spool_v, state.spool_v_per_s);
            if let Some((command_v, _)) = drive.felt_by_b {
                (rates.spool_b_v, rates.spool_b_v_per_s) = lag.rates(command_v, state.spool_b_v, state.spool_b_v_per_s);
            }
            rates.p_sup_pa = self.added.supply_droop.rate(drive.supply_pa, drawn, state.p_sup_pa);
            rates.p_a_sensed_pa = self.added.pressure_lag.rate(p_a, state.p_a_sensed_pa);
            rates.p_b_sensed_pa = self.added.pressure_lag.rate(p_b, state.p_b_sensed_pa);
            rates.y_sensed_m = self.added.position_lag.rate(state.y_m, state.y_sensed_m);
            (rates.warmth_a, rates.warmth_b) = (warmth_a.rate, warmth_b.rate);
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
            jacobian.v_p = self.acceleration_per_pa;
            jacobian.v_z = -(self.lugre.stiffness * self.inverse_mass + damping * friction.rate_by_bristle);
            jacobian.v_v = -(damping * friction.rate_by_velocity + self.lugre.viscous * self.inverse_mass);
            if EXTENDED {
                jacobian.z_y = friction.rate_by_level * level_by_y;
                jacobian.z_p = friction.rate_by_level * level_by_p;
                jacobian.v_y = -damping * jacobian.z_y;
                if Added::<R>::FORCE_VARIES {
                    jacobian.v_y += driving.by_position * self.inverse_mass;
                    jacobian.v_v += driving.by_velocity * self.inverse_mass;
                }
                jacobian.v_y -= m.spring_n_per_m * self.inverse_mass;
                jacobian.v_uneven = self.uneven_acceleration_per_pa;
                jacobian.v_level_p = -damping * jacobian.z_p;
                jacobian.a_y += valve_a.by_distance * rate_a.by_mass_flow;
                jacobian.b_y -= valve_b.by_distance * rate_b.by_mass_flow;
                jacobian.a_b = flow_a.by_other * rate_a.by_mass_flow;
                jacobian.b_a = flow_b.by_other * rate_b.by_mass_flow;
                let slope = |zone: &DeadZone<R>, spool_v: R, opening: &Opening<R>| {
                    let open = opening.magnitude > zero;
                    let per_v = || self.gain_per_v(opening) * zone.gain(spool_v) / opening.magnitude;
                    if open { per_v() } else { zero }
                };
                let slopes = |spool_v: R, opening: &Opening<R>| {
                    let fill = slope(&m.dead_zone, spool_v, opening);
                    let exhaust = (self.exhaust_zone())
                        .map_or(fill, |zone| slope(&zone, spool_v, &self.opening_at(zone.output_v(spool_v))));
                    [fill, exhaust]
                };
                let slopes_a = slopes(state.spool_v, &opening_a);
                let slopes_b = if self.feels_apart() { slopes(state.spool_b_v, &opening_b) } else { slopes_a };
                let gain = |valve: &Flow<R>, filling: bool, [fill, exhaust]: [R; 2]| {
                    valve.mass_flow * if filling { fill } else { exhaust } * valve.opening_exponent
                };
                let (gain_a, gain_b) = (gain(&valve_a, fills_a, slopes_a), gain(&valve_b, fills_b, slopes_b));
                jacobian.a_supply = valve_a.by_supply * rate_a.by_mass_flow;
                jacobian.b_supply = valve_b.by_supply * rate_b.by_mass_flow;
                jacobian.a_spool = gain_a * rate_a.by_mass_flow;
                jacobian.b_spool = gain_b * rate_b.by_mass_flow;
                let drawn_by = |fills: bool, valve: &Flow<R>, gain: R| fills.then_some((*valve, gain));
                let supply = (self.added.supply_droop)
                    .partials([drawn_by(fills_a, &valve_a, gain_a), drawn_by(fills_b, &valve_b, gain_b)]);
                jacobian.supply_supply = supply.by_supply;
                [jacobian.supply_spool_a, jacobian.supply_spool_b] = supply.by_spool;
                [jacobian.supply_a, jacobian.supply_b] = supply.by_pressure;
                if self.added.wall_heat.is_present() {
                    let row =
                        |rate: &WarmthRate<R>, valve: &Flow<R>, flow: &ChamberFlow<R>, gain: R, grows: R| WarmthRow {
                            by_warmth: rate.by_warmth,
                            by_pressure: rate.by_pressure,
                            by_other_pressure: flow.by_other * rate.by_mass_flow,
                            by_velocity: grows * rate.by_growth,
                            by_position: grows * (rate.by_displacement + valve.by_distance * rate.by_mass_flow),
                            by_supply: valve.by_supply * rate.by_mass_flow,
                            by_spool: gain * rate.by_mass_flow,
                            pressure_by_warmth: rate.pressure_by_warmth,
                        };
                    jacobian.warmth_a = row(&warmth_a, &valve_a, &flow_a, gain_a, R::ONE);
                    jacobian.warmth_b = row(&warmth_b, &valve_b, &flow_b, gain_b, -R::ONE);
                }
            }
        }
        (rates, jacobian)
    }

    /// The end stop the piston rests against, if it does: −1 at −L/2, +1 at +L/2, and the force holds it there.
    #[inline]
    pub(crate) fn held_at_stop<const EXTENDED: bool>(&self, state: &State<R>, drive: &Drive<R>) -> bool {
        let limit = self.model.half_stroke_m;
        if state.y_m.abs() < limit || state.v_m_per_s != R::ZERO {
            return false;
        }
        // The bristles were pushed towards the stop; held, they only keep what they have.
        let outward = state.y_m.sign();
        let force = self.driving_force::<EXTENDED>(state, drive).force_n - self.lugre.stiffness * state.z_m;
        force * outward >= R::ZERO
    }
}
