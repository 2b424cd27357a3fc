//! The force balance: the position predicted from the chamber pressures as measured (3.8 to 3.12).

use crate::record::{Quality, Record, Stretch};
use plant_model::friction::Response;
use plant_model::{Effect, Plant, State};
use rig_files::RigFile;

/// The first part of every stretch, s, during which the prediction settles and is not counted.
const SETTLING_S: f64 = 0.1;
/// Below this measured speed, in standard errors of the velocity, the piston is taken to be at rest at the start.
const REST_SIGMAS: f64 = 4.0;

/// Less motion than this tells nothing of mechanics and friction, s.
const LEAST_MOTION_S: f64 = 0.5;

/// A prediction this many standard deviations off while one piston rests and the other moves is given up.
const MISPREDICTED: f64 = 6.0;

/// Whether one of two velocities means rest and the other motion.
fn at_odds(v: f64, measured: f64, at_rest: f64) -> bool {
    let (slower, faster) = if v.abs() < measured.abs() { (v, measured) } else { (measured, v) };
    slower.abs() < at_rest && faster.abs() > 2.0 * at_rest
}

/// Bandwidth of the position observer, rad/s: where sensor noise and force noise contribute alike on the rig as stated. It
/// is the same for all models, or one with a larger mass would follow the measurement less and seem noisier.
pub(crate) fn bandwidth(quality: &Quality, rig: &RigFile) -> f64 {
    let mass = rig.effects.get(Effect::PayloadMass).and_then(|values| values.first().copied());
    let mass_kg = mass.unwrap_or(rig.rig.load.mass_kg);
    let pressure = quality.pressure_a.standard_deviation.hypot(quality.pressure_b.standard_deviation).max(50.0);
    let acceleration = rig.rig.cylinder.area_m2 * pressure / mass_kg;
    let position = quality.position.standard_deviation.max(1.0e-6);
    (acceleration / position).sqrt().clamp(15.0, 80.0)
}

/// Prediction errors of the position in units of its noise.
///
/// `added_n` is a force beside the model's, by sample, opposing positive motion; empty for none.
pub(crate) fn innovations(record: &Record, plant: &Plant<f64>, added_n: &[f64], stretches: &[Stretch]) -> Vec<f64> {
    let c = plant.coefficients();
    let inverse_sigma = 1.0 / record.quality.position.standard_deviation.max(1.0e-7);
    let omega = record.observer_rad_per_s;
    let at_rest = REST_SIGMAS * velocity_error(record);
    let driving = |stretch: &Stretch, k: usize| driving(record, plant, added_n, stretch, k);
    let mut out = Vec::new();
    for stretch in stretches {
        let settled = record.t_s[stretch.start] + SETTLING_S;
        let mut force = driving(stretch, stretch.start);
        let mut piston = Piston::start(record, plant, &force, stretch.start);
        // After breaking away before the real one did, the piston waits for it.
        let mut waits = false;
        for k in stretch.range() {
            if record.at_end[k] {
                // Follow the measurement until the piston has left the end for good.
                out.push(f64::NAN);
                if k + 1 < stretch.end {
                    force = driving(stretch, k + 1);
                    piston = Piston::start(record, plant, &force, k + 1);
                }
                continue;
            }
            let error = record.y_m[k] - c.position_scale * piston.y;
            out.push(if record.t_s[k] >= settled { error * inverse_sigma } else { f64::NAN });
            if k + 1 == stretch.end {
                break;
            }
            let dt = record.interval_s(k);
            let w = omega * dt;
            piston.y += error / c.position_scale * (core::f64::consts::SQRT_2 * w).min(0.5);
            let measured_v = record.motion.slope[k] / c.position_scale;
            if waits {
                force = driving(stretch, k + 1);
                waits = measured_v.abs() < 2.0 * at_rest;
                if !waits {
                    piston = Piston::start(record, plant, &force, k + 1);
                }
                continue;
            }
            // Kicks of noise would shake resting bristles loose before their time.
            if piston.v.abs() > at_rest || measured_v.abs() > at_rest {
                piston.v += error / c.position_scale * omega * w;
            }
            let next = driving(stretch, k + 1);
            if error.abs() * inverse_sigma > MISPREDICTED && at_odds(piston.v, measured_v, at_rest) {
                // The piston broke away or came to rest at another time than predicted. That has been charged, and is
                // charged once; what follows is predicted from how it really moves.
                piston = Piston::start(record, plant, &next, k + 1);
                waits = measured_v.abs() < at_rest;
                force = next;
                continue;
            }
            piston.step(plant, &force.middle(&next), dt);
            force = next;
        }
    }
    out
}

/// Bristles are fully bent from this part of the sliding limit on.
const FULLY_BENT: f64 = 0.97;
/// While they bend, a step may move them by this part of the limit.
const BEND_STEP: f64 = 0.2;
/// Most parts an interval is divided into.
const MOST_PARTS: f64 = 40.0;
/// Static friction can hold the bristles beyond the sliding limit of the moment, but never this far.
const BRISTLE_BACKSTOP: f64 = 3.0;

/// What drives the piston at one instant.
#[derive(Clone, Copy)]
struct Driving {
    /// Net force apart from friction, N.
    force_n: f64,
    p_a_pa: f64,
    p_b_pa: f64,
}

impl Driving {
    fn middle(&self, other: &Self) -> Self {
        Self {
            force_n: 0.5 * (self.force_n + other.force_n),
            p_a_pa: 0.5 * (self.p_a_pa + other.p_a_pa),
            p_b_pa: 0.5 * (self.p_b_pa + other.p_b_pa),
        }
    }
}

/// True pressures as the sensors' model says, and the force they make. A late position is compared with late pressures.
fn driving(record: &Record, plant: &Plant<f64>, added_n: &[f64], stretch: &Stretch, k: usize) -> Driving {
    let c = plant.coefficients();
    let (a, b) = (&record.p_a_smooth, &record.p_b_smooth);
    let late = (c.position_delay_s > 0.0).then(|| record.moment(k, -c.position_delay_s, stretch.range()));
    let at = |x: &[f64]| late.map_or_else(|| x[k], |moment| moment.of(x));
    let lag = c.pressure_time_constant_s;
    let p_a_pa = at(&a.value) + lag * at(&a.slope) - c.pressure_a_offset_pa;
    let p_b_pa = at(&b.value) + lag * at(&b.slope) - c.pressure_b_offset_pa;
    let external = if record.available.force { at(&record.f_ext_n) } else { 0.0 };
    let added = if added_n.is_empty() { 0.0 } else { at(added_n) };
    Driving { force_n: c.area_m2 * (p_a_pa - p_b_pa) - c.constant_force_n - added + external, p_a_pa, p_b_pa }
}

/// Position, velocity and bristle deflection.
struct Piston {
    y: f64,
    v: f64,
    z: f64,
}

impl Piston {
    /// The state at a sample to start from: moving pistons have their bristles fully bent, resting ones hold the force.
    fn start(record: &Record, plant: &Plant<f64>, drive: &Driving, k: usize) -> Self {
        let c = plant.coefficients();
        let v = record.motion.slope[k] / c.position_scale;
        let y = record.motion.value[k] / c.position_scale;
        let state = State { y_m: y, v_m_per_s: v, p_a_pa: drive.p_a_pa, p_b_pa: drive.p_b_pa, ..State::default() };
        let limit = plant.friction_level(&state).force_n / c.stiffness;
        let doubtful = REST_SIGMAS * velocity_error(record);
        if v.abs() > doubtful {
            Self { y, v, z: limit * v.signum() }
        } else {
            Self { y, v: 0.0, z: (drive.force_n / c.stiffness).clamp(-limit, limit) }
        }
    }

    /// One interval. While the bristles are still bending the step must resolve them; once they are fully bent they
    /// follow the velocity, and the method's stability allows the whole interval at once.
    fn step(&mut self, plant: &Plant<f64>, drive: &Driving, dt: f64) {
        let c = plant.coefficients();
        let way = self.v.abs() * dt;
        if way * c.stiffness <= BEND_STEP * plant.least_friction_level_n() {
            // The bristles hardly bend within the interval, whatever the sliding force.
            self.part(plant, drive, &plant.friction_at(&self.state(drive)), dt);
            return;
        }
        let mut level = plant.friction_level(&self.state(drive));
        let limit = level.force_n / c.stiffness;
        let bending = self.z * self.v.signum() < FULLY_BENT * limit;
        let bends = if bending { (way / (BEND_STEP * limit)).ceil() } else { 1.0 };
        let parts = bends.clamp(1.0, MOST_PARTS);
        for part in 0..parts as usize {
            if part > 0 {
                level = plant.friction_level(&self.state(drive));
            }
            let first = plant.friction().respond(self.z, self.v, &level);
            self.part(plant, drive, &first, dt / parts);
        }
        // A backstop only: the model itself keeps the bristles within the limit.
        self.z = self.z.clamp(-BRISTLE_BACKSTOP * limit, BRISTLE_BACKSTOP * limit);
    }

    /// As the plant model knows it.
    fn state(&self, drive: &Driving) -> State<f64> {
        State {
            y_m: self.y,
            v_m_per_s: self.v,
            z_m: self.z,
            p_a_pa: drive.p_a_pa,
            p_b_pa: drive.p_b_pa,
            ..State::default()
        }
    }

    /// A part of an interval, with the friction at its start: velocity and bristles by an L-stable Rosenbrock method of
    /// order 2 (ROS2).
    fn part(&mut self, plant: &Plant<f64>, drive: &Driving, first: &Response<f64>, dt: f64) {
        const GAMMA: f64 = 1.0 - core::f64::consts::FRAC_1_SQRT_2;
        let c = plant.coefficients();
        let inverse_mass = 1.0 / c.mass_kg;
        let rate = |r: &Response<f64>| ((drive.force_n - r.force_n) * inverse_mass, r.bristle_rate);
        let v_v = -(c.damping * first.rate_by_velocity + c.viscous) * inverse_mass;
        let v_z = -(c.stiffness + c.damping * first.rate_by_bristle) * inverse_mass;
        let (z_v, z_z) = (first.rate_by_velocity, first.rate_by_bristle);
        let h = GAMMA * dt;
        let (m00, m01, m10, m11) = (1.0 - h * v_v, -h * v_z, -h * z_v, 1.0 - h * z_z);
        let inverse = 1.0 / (m00 * m11 - m01 * m10);
        let solve = |(a, b): (f64, f64)| ((a * m11 - b * m01) * inverse, (b * m00 - a * m10) * inverse);
        let k1 = solve(rate(first));
        let between = Self { y: self.y, v: self.v + dt * k1.0, z: self.z + dt * k1.1 };
        let second = plant.friction_at(&between.state(drive));
        let f2 = rate(&second);
        let k2 = solve((f2.0 - 2.0 * k1.0, f2.1 - 2.0 * k1.1));
        let v = self.v + dt * (1.5 * k1.0 + 0.5 * k2.0);
        self.z += dt * (1.5 * k1.1 + 0.5 * k2.1);
        self.y += 0.5 * dt * (self.v + v);
        self.v = v;
        let limit = c.half_stroke_m;
        if self.y.abs() > limit && self.v * self.y > 0.0 {
            self.y = self.y.clamp(-limit, limit);
            self.v = 0.0;
        }
    }
}

/// Whether the piston moves for long enough that its mechanics can be judged. A resting one answers the noise of the
/// measured pressures in the model and stands still in truth: what suppresses that noise would look like a cause.
pub(crate) fn moves(record: &Record) -> bool {
    let at_rest = REST_SIGMAS * velocity_error(record);
    let moving = record.motion.slope.iter().filter(|v| v.abs() > at_rest).count();
    moving as f64 * record.quality.interval_s >= LEAST_MOTION_S
}

/// Standard error of the smoothed velocity, m/s.
pub(crate) fn velocity_error(record: &Record) -> f64 {
    // A straight line through 2 m + 1 samples: variance 3 sigma^2 / (dt^2 m (m + 1) (2 m + 1)).
    let m = 15.0;
    let spread: f64 = 3.0 / (m * (m + 1.0) * (2.0 * m + 1.0));
    record.quality.position.standard_deviation * spread.sqrt() / record.quality.interval_s.max(1.0e-6)
}
