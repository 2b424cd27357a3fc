//! The synthetic rig in motion: an integrator that shares nothing with the one used for fitting.
//!
//! Operator splitting with a small fixed step: gas for half a step (explicit midpoint at constant piston), mechanics for
//! a whole one (velocity Verlet, the bristle by exact exponentials at frozen plasticity), gas for the other half. Second
//! order, symmetric, no Jacobian, no step control. Delays look up recorded histories by time, and an integration step
//! ends wherever a delayed command changes.

use crate::effects::{self, Gas};
use crate::friction::{plasticity, sliding_force};
use crate::physics::Physics;
use crate::reading::Reading;
use std::collections::VecDeque;

/// Longest integration step, s.
pub const STEP_S: f64 = 40e-6;

/// The state of the synthetic rig.
#[derive(Clone, Debug)]
pub struct Specimen {
    physics: Physics,
    step_s: f64,
    time_s: f64,
    y: f64,
    v: f64,
    p_a: f64,
    p_b: f64,
    /// Temperatures of A and B; those of the supply, unless the walls exchange heat.
    warmth: [f64; 2],
    z: f64,
    /// The spool's place and speed as A and B feel them at the ends of their hoses.
    spool: [f64; 2],
    spool_speed: [f64; 2],
    supply: f64,
    sensed_y: f64,
    sensed_a: f64,
    sensed_b: f64,
    load_y: f64,
    load_v: f64,
    rest_s: f64,
    played: [f64; 2],
    /// Commands with the time at which they were sent, as far back as one chamber still feels them.
    commands: VecDeque<(f64, f64)>,
    command: [f64; 2],
    /// Past positions by time, as far back as the sensor is late.
    positions: VecDeque<(f64, f64)>,
}

impl Specimen {
    /// A rig at rest at `y`, both chambers at the pressures given, valve at mid.
    #[must_use]
    pub fn new(physics: Physics, y_m: f64, p_a_pa: f64, p_b_pa: f64) -> Self {
        Self {
            step_s: STEP_S,
            time_s: 0.0,
            y: y_m,
            v: 0.0,
            p_a: p_a_pa,
            p_b: p_b_pa,
            warmth: [physics.temperature_k; 2],
            z: 0.0,
            spool: [0.0; 2],
            spool_speed: [0.0; 2],
            supply: physics.supply_pa,
            sensed_y: y_m,
            sensed_a: p_a_pa,
            sensed_b: p_b_pa,
            load_y: y_m,
            load_v: 0.0,
            rest_s: 0.0,
            played: [0.0; 2],
            commands: VecDeque::new(),
            command: [0.0; 2],
            positions: VecDeque::new(),
            physics,
        }
    }

    /// True position, m.
    #[must_use]
    pub fn y_m(&self) -> f64 {
        self.y
    }

    /// True velocity, m/s.
    #[must_use]
    pub fn v_m_per_s(&self) -> f64 {
        self.v
    }

    /// True bristle deflection, m.
    #[must_use]
    pub fn z_m(&self) -> f64 {
        self.z
    }

    /// Holds command `u` in V for `dt` seconds.
    pub fn advance(&mut self, u_v: f64, dt_s: f64) {
        let end = self.time_s + dt_s;
        self.commands.push_back((self.time_s, u_v));
        let delays_s = self.physics.line_delays_s;
        let latest_s = delays_s[0].max(delays_s[1]);
        while self.time_s < end {
            let mut stop = end;
            for (felt, delay_s) in self.command.iter_mut().zip(delays_s) {
                for (sent, command) in &self.commands {
                    let from = sent + delay_s;
                    if from > self.time_s {
                        stop = stop.min(from);
                        break;
                    }
                    *felt = *command;
                }
            }
            while self.commands.get(1).is_some_and(|(sent, _)| sent + latest_s <= self.time_s) {
                self.commands.pop_front();
            }
            self.span(stop - self.time_s);
            self.time_s = stop;
        }
    }

    /// Integrates over an interval of constant command.
    fn span(&mut self, duration: f64) {
        let (play, most) = (self.physics.play_v, self.physics.max_v);
        for (played, command) in self.played.iter_mut().zip(self.command) {
            *played = played.clamp(command - play, command + play);
        }
        let target = self.played.map(|played| played.clamp(-most, most));
        let steps = (duration / self.step_s).ceil().max(1.0);
        let h = duration / steps;
        let decay = |tau: f64| if tau > 0.0 { (-0.25 * h / tau).exp() } else { 0.0 };
        let spool_decay = decay(self.physics.lag_s);
        for index in 0..steps as usize {
            let now = self.time_s + h * index as f64;
            if self.physics.y_delay_s > 0.0 {
                self.positions.push_back((now, self.sensed_y));
            }
            self.move_spool(target, spool_decay, 0.25 * h);
            self.gas(0.5 * h, now + 0.25 * h);
            self.move_spool(target, spool_decay, 0.25 * h);
            let before = self.y;
            self.mechanics(h, now + 0.5 * h);
            self.sense_position(before, h);
            self.move_spool(target, spool_decay, 0.25 * h);
            self.gas(0.5 * h, now + 0.75 * h);
            self.move_spool(target, spool_decay, 0.25 * h);
        }
        if self.physics.y_delay_s > 0.0 {
            let oldest = self.time_s + duration - self.physics.y_delay_s - 2.0 * self.step_s;
            while self.positions.len() > 2 && self.positions[1].0 < oldest {
                self.positions.pop_front();
            }
        }
    }

    fn move_spool(&mut self, targets: [f64; 2], decay: f64, h: f64) {
        let (lag, inertia) = (self.physics.lag_s, self.physics.spool_inertia);
        for ((spool, spool_speed), target) in self.spool.iter_mut().zip(&mut self.spool_speed).zip(targets) {
            let before = *spool;
            if lag > 0.0 && inertia > 0.0 {
                // m tau^2 w'' = target - w - tau w', both states at the middle of the step.
                let stiff = 0.5 * h / (inertia * lag * lag);
                let speed = *spool_speed;
                let change =
                    2.0 * stiff * (target - *spool - (lag + 0.5 * h) * speed) / (1.0 + stiff * (lag + 0.5 * h));
                *spool_speed += change;
                *spool += h * (speed + 0.5 * change);
            } else {
                *spool = target + (*spool - target) * decay;
            }
            if let Some(rate) = self.physics.outside.slew {
                *spool = spool.clamp(before - rate * h, before + rate * h);
            }
        }
    }

    /// Rates of the two chamber pressures, of the supply and of both temperatures at constant piston.
    fn gas_rates(&self, [p_a, p_b, supply, t_a, t_b]: [f64; 5], felt: [[f64; 2]; 2], now: f64) -> [f64; 5] {
        let ph = &self.physics;
        // Of the paths from the supply and to atmosphere, one may be closed while the other is open.
        let towards_b = felt.map(|[supplied, vented]| supplied + vented >= 0.0);
        let fills = [towards_b[0], !towards_b[1]];
        let rad = |side: usize| felt[side][usize::from(!fills[side])].abs();
        let into_a = ph.flow_near_end(ph.half_stroke + self.y, 0, fills[0], rad(0), supply, p_a);
        let into_b = ph.flow_near_end(ph.half_stroke - self.y, 1, fills[1], rad(1), supply, p_b);
        let drawn = if fills[0] { into_a } else { 0.0 } + if fills[1] { into_b } else { 0.0 };
        let mut into = [into_a, into_b];
        effects::flow(&ph.present, &Gas { p_a, p_b, atmosphere: ph.atmosphere_pa }, &mut into);
        let [q_a, q_b] = into;
        let temperature = ph.temperature_k + ph.outside.warming * now;
        let heat = ph.gas_constant * ph.exponent * temperature;
        let chamber = |volume: f64, area: f64, growth: f64, p: f64, q: f64, t: f64| {
            // A chamber at its least volume, a part of what the piston sweeps, no longer feels the piston.
            let least = 0.005 * area * (2.0 * ph.half_stroke);
            let growth = if volume > least { growth } else { 0.0 };
            let volume = volume.max(least);
            let Some(coefficient) = ph.walls else {
                return [(heat * q - ph.exponent * p * area * growth) / volume, 0.0];
            };
            // Air comes in as warm as the supply and leaves as warm as it is, through the same opening the faster the colder it
            // is; walls of the supply's temperature.
            let q = if q > 0.0 { q } else { q * (temperature / t).sqrt() };
            let carried = ph.gas_constant * ph.exponent * q * if q > 0.0 { temperature } else { t };
            let walls = 2.0 * area + 2.0 * (std::f64::consts::PI * area).sqrt() * volume / area;
            let gained = (ph.exponent - 1.0) * coefficient * walls * (temperature - t);
            let swept = area * growth;
            let p_rate = (carried - ph.exponent * p * swept + gained) / volume;
            [p_rate, t * (p_rate / p + swept / volume - ph.gas_constant * t * q / (p * volume))]
        };
        let [a, t_a] = chamber(ph.volume_a + ph.area_a * self.y, ph.area_a, self.v, p_a, q_a, t_a);
        let [b, t_b] = if ph.spring.is_some() {
            [0.0; 2]
        } else {
            chamber(ph.volume_b - ph.area_b * self.y, ph.area_b, -self.v, p_b, q_b, t_b)
        };
        let supply = if ph.droop > 0.0 { (self.source(now) - ph.droop * drawn - supply) / ph.droop_s } else { 0.0 };
        [a, b, supply, t_a, t_b]
    }

    /// Pressure of the supply before any droop.
    fn source(&self, now: f64) -> f64 {
        let pulse = self
            .physics
            .outside
            .pulsation
            .map_or(0.0, |[amplitude, hz]| amplitude * (std::f64::consts::TAU * hz * now).sin());
        self.physics.supply_pa + pulse
    }

    /// Gas and pressure sensors for `h` seconds at constant piston.
    fn gas(&mut self, h: f64, now: f64) {
        if self.physics.droop <= 0.0 {
            self.supply = self.source(now);
        }
        let [of_a, of_b] = self.spool;
        let felt_by_a = self.physics.openings(of_a);
        let openings = [felt_by_a, if of_b == of_a { felt_by_a } else { self.physics.openings(of_b) }];
        let [t_a, t_b] = self.warmth;
        let begin = [self.p_a, self.p_b, self.supply, t_a, t_b];
        let first = self.gas_rates(begin, openings, now);
        let mid = 0.5 * h;
        let half_way: [f64; 5] = std::array::from_fn(|k| begin[k] + mid * first[k]);
        let [a, b, ..] = half_way;
        let rates = self.gas_rates(half_way, openings, now);
        let tau = self.physics.sensor_s;
        if tau > 0.0 {
            // Second order in h, like the rest.
            let share = h / tau * (1.0 - 0.5 * h / tau);
            self.sensed_a += share * (a - self.sensed_a);
            self.sensed_b += share * (b - self.sensed_b);
        }
        self.p_a += h * rates[0];
        self.p_b += h * rates[1];
        self.supply += h * rates[2];
        self.warmth = [t_a + h * rates[3], t_b + h * rates[4]];
        if tau <= 0.0 {
            (self.sensed_a, self.sensed_b) = (self.p_a, self.p_b);
        }
    }

    /// Bristle for `h` seconds at constant velocity and plasticity: exact.
    fn bristle(&self, z: f64, v: f64, g: f64, h: f64) -> (f64, f64) {
        let alpha = plasticity(&self.physics, z, v, g);
        let rate = alpha * self.physics.sigma0 / g * v.abs();
        let x = rate * h;
        let z = if x < 1e-9 { z + h * v } else { v / rate + (z - v / rate) * (-x).exp() };
        (z, rate)
    }

    /// Piston, bristle and a loose load for `h` seconds at constant pressures.
    fn mechanics(&mut self, h: f64, now: f64) {
        let limit = self.physics.half_stroke;
        let ph = &self.physics;
        // What one side has more of area also feels the atmosphere from outside.
        let mut push = ph.area_b * (self.p_a - self.p_b) + (ph.area_a - ph.area_b) * (self.p_a - ph.atmosphere_pa);
        if let Some([rate, preload]) = ph.spring {
            push -= preload + rate * (ph.half_stroke + self.y);
        }
        push -= ph.mass * ph.gravity;
        effects::push(&ph.present, self.y, self.v, &mut push);
        let outward = self.y.signum();
        if self.y.abs() >= limit && self.v == 0.0 && (push - self.physics.sigma0 * self.z) * outward >= 0.0 {
            self.loose_load(h);
            return;
        }
        let loose = self.loose_load(h);
        let ph = &self.physics;
        let middle = self.y + 0.5 * h * self.v;
        let g = sliding_force(ph, self.v, middle, self.p_a + self.p_b, now, self.rest_s);
        let (z_half, rate) = self.bristle(self.z, self.v, g, 0.5 * h);
        // z' = v - rate z, with rate proportional to |v|: linear in v at fixed z.
        let pull = if self.v == 0.0 { 0.0 } else { rate * z_half / self.v };
        let damping = ph.sigma1 * (1.0 - pull) + ph.sigma2;
        let drag = ph.outside.drag * self.v * self.v.abs();
        let force = push + loose - ph.sigma0 * z_half - drag;
        let k = 0.5 * h * damping / ph.mass;
        let v_new = ((1.0 - k) * self.v + h * force / ph.mass) / (1.0 + k);
        let y_new = self.y + 0.5 * h * (self.v + v_new);
        let g = sliding_force(ph, v_new, y_new, self.p_a + self.p_b, now, self.rest_s);
        let (z_new, _) = self.bristle(z_half, v_new, g, 0.5 * h);
        let v_rest = 0.5 * ph.stribeck;
        (self.y, self.v, self.z) = (y_new, v_new, z_new);
        self.rest_s = if v_new.abs() < v_rest { self.rest_s + h } else { 0.0 };
        if self.y.abs() >= limit && self.v * self.y > 0.0 {
            self.y = limit.copysign(self.y);
            self.v = 0.0;
        }
    }

    /// Moves a loose part of the load and gives its force on the piston.
    fn loose_load(&mut self, h: f64) -> f64 {
        let Some(second) = self.physics.outside.second_mass else { return 0.0 };
        let gap = (self.y + 0.5 * h * self.v) - (self.load_y + 0.5 * h * self.load_v);
        let pressed = gap - gap.clamp(-second.half_gap, second.half_gap);
        let force = if pressed == 0.0 && second.half_gap > 0.0 {
            0.0
        } else {
            second.stiffness * pressed + second.damping * (self.v - self.load_v)
        };
        let before = self.load_v;
        self.load_v += h * (force / second.mass - self.physics.gravity);
        self.load_y += 0.5 * h * (before + self.load_v);
        -force
    }

    /// The position sensor over `h` seconds in which the piston went from `before` straight to where it is: exact.
    fn sense_position(&mut self, before: f64, h: f64) {
        let tau = self.physics.y_lag_s;
        if tau <= 0.0 {
            self.sensed_y = self.y;
            return;
        }
        let behind = tau * (self.y - before) / h;
        self.sensed_y = self.y - behind + (self.sensed_y - before + behind) * (-h / tau).exp();
    }

    /// What ideal sensors show now.
    #[must_use]
    pub fn read(&self) -> Reading {
        let ph = &self.physics;
        let y = self.late_position();
        let bowed = y + ph.outside.bow * ph.half_stroke * (std::f64::consts::PI * y / ph.half_stroke).sin();
        let mut reading = Reading { y_m: bowed, p_a_pa: self.sensed_a, p_b_pa: self.sensed_b, p_sup_pa: self.supply };
        effects::show(&ph.present, &mut reading);
        reading
    }

    fn late_position(&self) -> f64 {
        let at = self.time_s - self.physics.y_delay_s;
        let mut later = (self.time_s, self.sensed_y);
        for &earlier in self.positions.iter().rev() {
            if earlier.0 <= at {
                let part = if later.0 > earlier.0 { (at - earlier.0) / (later.0 - earlier.0) } else { 0.0 };
                return earlier.1 + part * (later.1 - earlier.1);
            }
            later = earlier;
        }
        later.1
    }
}
