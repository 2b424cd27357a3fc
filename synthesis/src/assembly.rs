//! The synthetic rig put together: the stated parameters, then the catalogue's effects, then what lies outside it.

use crate::cause::Cause;
use crate::effects;
use crate::foreign::Foreign;
use crate::physics::{Outside, Physics, SecondMass};
use plant_model::{Effect, Rig};

/// Duration over which drifts reach their stated total, s.
const DRIFT_S: f64 = 40.0;

impl Physics {
    /// The rig with causes in the order of the catalogue; foreign terms last.
    #[must_use]
    pub fn new(rig: &Rig<f64>, causes: &[Cause]) -> Self {
        let (v, c, f) = (&rig.valve, &rig.cylinder, &rig.friction);
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
            play_v: 0.0,
            line_delay_s: 0.0,
            choked: None,
            droop: 0.0,
            droop_s: 1.0,
            area_a: c.area_m2,
            area_b: c.area_m2,
            half_stroke: c.stroke_m / 2.0,
            volume_a: c.volume_a0_m3,
            volume_b: c.volume_b0_m3,
            mass: rig.load.mass_kg,
            sigma0: f.stiffness_n_per_m,
            sigma1: f.damping_n_s_per_m,
            sigma2: f.viscous_n_s_per_m,
            coulomb: f.coulomb_n,
            stiction: f.static_n,
            stribeck: f.stribeck_velocity_m_per_s,
            breakaway: f.breakaway_m,
            y_delay_s: 0.0,
            sensor_s: 0.0,
            present: Vec::new(),
            outside: Outside::default(),
        };
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

    fn add_foreign(&mut self, foreign: Foreign, p: &[f64; 2]) {
        let top_speed = self.top_speed();
        let out = &mut self.outside;
        match foreign {
            Foreign::OpeningCurve => out.opening = Some(*p),
            Foreign::QuadraticDrag => out.drag = p[0] * self.coulomb / (0.5 * top_speed).powi(2),
            Foreign::TemperatureDrift => out.warming = p[0] / DRIFT_S,
            Foreign::PositionBow => out.bow = p[0],
            Foreign::PressureGain => out.pressure_gain = p[0],
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
            Foreign::Cushioning => out.cushion = Some([p[0] * self.half_stroke, p[1]]),
            Foreign::FrictionDrift => out.running_in = Some(*p),
            Foreign::SpoolSlew => out.slew = Some(p[0]),
        }
    }

    /// The pressure at which filling and exhausting balance in slow motion, Pa.
    #[must_use]
    pub fn rest_pressure_pa(&self) -> f64 {
        (self.fill * self.supply_pa + self.exhaust * self.atmosphere_pa) / (self.fill + self.exhaust)
    }

    /// The speed the fully open valve can feed, m/s: a scale for experiments, not a bound.
    #[must_use]
    pub fn top_speed(&self) -> f64 {
        std::f64::consts::FRAC_PI_2 * self.speed_per_opening()
    }

    /// Speed per radian of valve opening in slow motion, m/s.
    pub(crate) fn speed_per_opening(&self) -> f64 {
        let p = self.rest_pressure_pa();
        self.fill * (self.supply_pa - p) * self.gas_constant * self.temperature_k
            / (p * 0.5 * (self.area_a + self.area_b))
    }
}
