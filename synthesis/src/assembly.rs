//! The synthetic rig put together: the stated parameters, then the catalogue's effects, then what lies outside it.

use crate::air_way::{Path, Tube, mass_conductance};
use crate::cause::Cause;
use crate::effects;
use crate::foreign::Foreign;
use crate::opening::sides;
use crate::physics::{Outside, Physics, SecondMass};
use plant_model::{Effect, Rig};

/// Duration over which drifts reach their stated total, s.
const DRIFT_S: f64 = 40.0;

impl Physics {
    /// The rig with causes in the order of the catalogue; foreign terms last.
    #[must_use]
    pub fn new(rig: &Rig<f64>, causes: &[Cause]) -> Self {
        let (v, c, f, h) = (&rig.valve, &rig.cylinder, &rig.friction, &rig.hoses);
        let full_drop = (rig.supply.pressure_pa - rig.supply.atmosphere_pa) / rig.supply.pressure_pa;
        let tube_m3 = |length: f64, diameter: f64| 0.25 * std::f64::consts::PI * diameter.powi(2) * length;
        let mut physics = Self {
            gas_constant: rig.gas.gas_constant_j_per_kg_k,
            temperature_k: rig.gas.temperature_k,
            exponent: rig.gas.heat_capacity_ratio,
            supply_pa: rig.supply.pressure_pa,
            atmosphere_pa: rig.supply.atmosphere_pa,
            fill: v.fill_coefficient_kg_per_s_pa,
            exhaust: v.exhaust_coefficient_kg_per_s_pa,
            right_v: v.dead_zone_right_v,
            left_v: v.dead_zone_left_v,
            slope_right: v.slope_right,
            slope_left: v.slope_left,
            max_v: v.max_voltage_v,
            lag_s: 0.0,
            spool_inertia: v.spool_inertia,
            play_v: 0.0,
            line_delays_s: [h.a_length_m, h.b_length_m].map(|length| {
                length / (rig.gas.heat_capacity_ratio * rig.gas.gas_constant_j_per_kg_k * rig.gas.temperature_k).sqrt()
            }),
            sonic: None,
            tubes: [[h.a_length_m, h.a_diameter_m], [h.b_length_m, h.b_diameter_m]]
                .map(|[length, diameter]| Tube::of(length, diameter, rig.gas.temperature_k).into_iter().collect()),
            cushions: [None; 2],
            spring: (c.spring_n_per_m + c.spring_preload_n > 0.0).then_some([c.spring_n_per_m, c.spring_preload_n]),
            sides: if rig.opening.is_empty() { Default::default() } else { sides(rig.opening.points()) },
            rounding_v: v.corner_rounding_v,
            exhaust_overlap_v: v.exhaust_overlap_v,
            smoothness: v.opening_smoothness,
            bent: None,
            choked: None,
            walls: None,
            droop: 0.0,
            droop_s: 1.0,
            area_a: c.area_a_m2,
            area_b: c.area_b_m2,
            half_stroke: c.stroke_m / 2.0,
            volume_a: c.volume_a0_m3 + tube_m3(h.a_length_m, h.a_diameter_m),
            volume_b: c.volume_b0_m3 + tube_m3(h.b_length_m, h.b_diameter_m),
            mass: rig.load.mass_kg,
            gravity: 9.806_65 * rig.load.inclination_deg.to_radians().sin(),
            sigma0: f.stiffness_n_per_m,
            sigma1: f.damping_n_s_per_m,
            sigma2: f.viscous_n_s_per_m,
            coulomb: f.coulomb_n,
            stiction: f.static_n,
            stribeck: f.stribeck_velocity_m_per_s,
            breakaway: f.breakaway_m,
            y_delay_s: 0.0,
            y_lag_s: 0.0,
            sensor_s: 0.0,
            present: Vec::new(),
            outside: Outside::default(),
        };
        if v.fill_conductance_a_m3_per_s_pa > 0.0 {
            let path = |sonic: f64, ratio: f64| [mass_conductance(sonic, rig.gas.temperature_k), ratio];
            physics.sonic = Some([
                [
                    path(v.fill_conductance_a_m3_per_s_pa, v.fill_critical_ratio_a),
                    path(v.exhaust_conductance_a_m3_per_s_pa, v.exhaust_critical_ratio_a),
                ],
                [
                    path(v.fill_conductance_b_m3_per_s_pa, v.fill_critical_ratio_b),
                    path(v.exhaust_conductance_b_m3_per_s_pa, v.exhaust_critical_ratio_b),
                ],
            ]);
            (physics.fill, physics.exhaust) = (1.0, 1.0);
        }
        let ends = [
            [rig.cushions.cushion_a_length_m, rig.cushions.cushion_a_conductance_m3_per_s_pa],
            [rig.cushions.cushion_b_length_m, rig.cushions.cushion_b_conductance_m3_per_s_pa],
        ];
        physics.cushions = ends.map(|[length, sonic]| {
            let conductance = mass_conductance(sonic, rig.gas.temperature_k);
            (length > 0.0).then_some((length, Tube::throttle(conductance, full_drop)))
        });
        for effect in Effect::ALL {
            for cause in causes {
                if let Cause::Catalogue(found, values) = cause
                    && *found == effect
                {
                    effects::apply(effect, values, &mut physics);
                    physics.present.push((effect, *values));
                }
            }
        }
        for cause in causes {
            if let Cause::Foreign(foreign, values) = cause {
                physics.add_foreign(*foreign, values);
            }
        }
        physics
    }

    /// A throttle at a chamber: the fully open valve's conductance, filling (`way` 0) or exhausting (1), is `ratio` times
    /// its own; none at 0.
    pub(crate) fn narrowed(&self, side: usize, way: usize, ratio: f64) -> Option<Tube> {
        let full_drop = (self.supply_pa - self.atmosphere_pa) / self.supply_pa;
        let factor = [self.fill, self.exhaust][way];
        let open = match self.sonic {
            Some(sonic) => factor * sonic[side][way][0],
            None => factor * std::f64::consts::FRAC_PI_2 * full_drop,
        };
        (ratio > 0.0).then(|| Tube::throttle(open / ratio, full_drop))
    }

    fn add_foreign(&mut self, foreign: Foreign, p: &[f64; 2]) {
        let top_speed = self.top_speed();
        let out = &mut self.outside;
        match foreign {
            Foreign::QuadraticDrag => out.drag = p[0] * self.coulomb / (0.5 * top_speed).powi(2),
            Foreign::TemperatureDrift => out.warming = p[0] / DRIFT_S,
            Foreign::PositionBow => out.bow = p[0],
            Foreign::Backlash | Foreign::ElasticLoad => {
                let play = foreign == Foreign::Backlash;
                let share = self.mass * p[1];
                // A rigid contact rings at 40 Hz; an elastic load at the frequency stated.
                let omega = std::f64::consts::TAU * if play { 40.0 } else { p[0] };
                let damping_ratio = if play { 0.3 } else { 0.03 };
                out.second_mass = Some(SecondMass {
                    mass: share,
                    stiffness: share * omega * omega,
                    damping: 2.0 * damping_ratio * share * omega,
                    half_gap: if play { 0.5 * p[0] } else { 0.0 },
                });
                self.mass -= share;
            }
            Foreign::DwellStiction => out.dwell = Some([p[0] * self.coulomb, p[1]]),
            Foreign::SupplyPulsation => out.pulsation = Some(*p),
            Foreign::FrictionDrift => out.running_in = Some(*p),
            Foreign::SpoolSlew => out.slew = Some(p[0]),
        }
    }

    /// The pressures at which filling and exhausting balance in slow motion, mean of both directions, Pa.
    #[must_use]
    pub fn rest_pressures_pa(&self) -> [f64; 2] {
        if self.is_even() {
            return [self.rest_pressure_pa(); 2];
        }
        if let Some([rate, preload]) = self.spring {
            let load = preload + rate * self.half_stroke + self.mass * self.gravity;
            return [(self.atmosphere_pa + load / self.area_a).min(self.supply_pa), self.atmosphere_pa];
        }
        let (toward_b, toward_a) = (self.slow_motion(true), self.slow_motion(false));
        [0.5 * (toward_b[0] + toward_a[0]), 0.5 * (toward_b[1] + toward_a[1])]
    }

    /// Equal areas, level, the linear law: both chambers settle at the same pressure, and a formula gives it.
    fn is_even(&self) -> bool {
        self.spring.is_none() && self.sonic.is_none() && self.area_a == self.area_b && self.gravity == 0.0
    }

    /// Both pressures in slow motion one way.
    fn slow_motion(&self, towards_b: bool) -> [f64; 2] {
        let weight = self.mass * self.gravity;
        let other = |p_a: f64| {
            let force = self.area_a * (p_a - self.atmosphere_pa) - weight;
            (self.atmosphere_pa + force / self.area_b).clamp(self.atmosphere_pa, self.supply_pa)
        };
        // Volume per time that a chamber takes in, as speed of the piston towards B: a moving piston asks the same of both.
        let speeds = |p_a: f64| {
            let p_b = other(p_a);
            let a = self.flow_to_chamber(0, towards_b, 0.01, self.supply_pa, p_a) / (p_a * self.area_a);
            let b = -self.flow_to_chamber(1, !towards_b, 0.01, self.supply_pa, p_b) / (p_b * self.area_b);
            a - b
        };
        let (mut low, mut high) = (self.atmosphere_pa, self.supply_pa);
        while high - low > 1e-6 {
            let middle = 0.5 * (low + high);
            if speeds(middle) > 0.0 { low = middle } else { high = middle }
        }
        [low, other(low)]
    }

    /// Flow into a chamber (0: A, 1: B) at an opening in rad, kg/s.
    pub(crate) fn flow_to_chamber(&self, side: usize, filling: bool, opening: f64, supply: f64, p: f64) -> f64 {
        self.flow_by(&self.tubes[side], side, filling, opening, supply, p)
    }

    /// The same with the chamber's end `distance` away, m: a cushion lets air in freely, and out through its needle.
    pub(crate) fn flow_near_end(
        &self,
        distance: f64,
        side: usize,
        filling: bool,
        opening: f64,
        supply: f64,
        p: f64,
    ) -> f64 {
        let free = self.flow_to_chamber(side, filling, opening, supply, p);
        let Some((length, needle)) = self.cushions[side] else { return free };
        if free >= 0.0 || distance >= length {
            return free;
        }
        let tubes: Vec<Tube> = self.tubes[side].iter().copied().chain([needle]).collect();
        let throttled = self.flow_by(&tubes, side, filling, opening, supply, p);
        // The spear's tip takes a tenth of the length to close the bore.
        let inside = ((length - distance) / (0.1 * length)).min(1.0);
        inside * throttled + (1.0 - inside) * free
    }

    fn flow_by(&self, tubes: &[Tube], side: usize, filling: bool, opening: f64, supply: f64, p: f64) -> f64 {
        if side == 1 && self.spring.is_some() {
            return 0.0;
        }
        let factor = if filling { self.fill } else { self.exhaust };
        let path = match (self.sonic, self.choked) {
            (Some(sonic), choked) => {
                let [full, ratio] = sonic[side][usize::from(!filling)];
                let [ratio, scale] = choked.unwrap_or([ratio, 1.0]);
                Path::Sonic(full * factor * scale / std::f64::consts::FRAC_PI_2, ratio)
            }
            (None, Some([ratio, scale])) => {
                Path::Sonic(scale * factor * (self.supply_pa - self.atmosphere_pa) / self.supply_pa, ratio)
            }
            (None, None) => Path::Linear(factor),
        };
        if filling {
            path.flow(opening, tubes, true, supply, p)
        } else {
            -path.flow(opening, tubes, false, p, self.atmosphere_pa)
        }
    }

    /// The mean of [`Physics::rest_pressures_pa`], Pa.
    #[must_use]
    pub fn rest_pressure_pa(&self) -> f64 {
        if self.is_even() {
            (self.fill * self.supply_pa + self.exhaust * self.atmosphere_pa) / (self.fill + self.exhaust)
        } else {
            let [a, b] = self.rest_pressures_pa();
            0.5 * (a + b)
        }
    }

    /// Flow into A through the fully open valve at rest pressure, kg/s.
    pub(crate) fn full_flow(&self) -> f64 {
        let full = std::f64::consts::FRAC_PI_2;
        if self.is_even() {
            self.fill * full * (self.supply_pa - self.rest_pressure_pa())
        } else {
            full * self.flow_per_opening()
        }
    }

    /// Flow into A, filling at rest pressure, per radian of opening, kg/s.
    pub(crate) fn flow_per_opening(&self) -> f64 {
        if self.is_even() {
            return self.fill * (self.supply_pa - self.rest_pressure_pa());
        }
        let full = std::f64::consts::FRAC_PI_2;
        self.flow_to_chamber(0, true, full, self.supply_pa, self.rest_pressures_pa()[0]) / full
    }

    /// The speed the fully open valve can feed, m/s: a scale for experiments, not a bound.
    #[must_use]
    pub fn top_speed(&self) -> f64 {
        std::f64::consts::FRAC_PI_2 * self.speed_per_opening()
    }

    /// Speed per radian of valve opening in slow motion, m/s.
    pub(crate) fn speed_per_opening(&self) -> f64 {
        let p = self.rest_pressure_pa();
        self.flow_per_opening() * self.gas_constant * self.temperature_k / (p * 0.5 * (self.area_a + self.area_b))
    }
}
