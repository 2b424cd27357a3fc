//! Prediction errors on the part of the log held back: the whole model, restarted from the measured state.

use crate::balance::motion;
use crate::outcome::{Gain, HoldOut, PerChannel};
use crate::record::{Record, Stretch};
use plant_model::{Inputs, Plant, Simulator, State, Stepper, Tolerance};
use rig_files::RigFile;

/// Prediction horizon, s.
pub(crate) const HORIZON_S: f64 = 0.2;
/// The command path is run in for this long before each restart, s.
const RUN_IN_S: f64 = 0.15;

/// One prediction beside the measurement, for pictures.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Time, s.
    pub t_s: Vec<f64>,
    /// Measured position, m, and pressures, Pa.
    pub measured: [Vec<f64>; 3],
    /// Predicted by the nominal rig; NaN at restarts.
    pub baseline: [Vec<f64>; 3],
    /// Predicted by the extended rig.
    pub extended: [Vec<f64>; 3],
}

/// Errors of both models and of a perfect one; `None` if the log does not hold what a full prediction needs.
pub(crate) fn gain(record: &Record, nominal: &RigFile, extended: &RigFile) -> Option<(Gain, Overlay)> {
    let has = record.available;
    if !(has.command && has.pressure_a && has.pressure_b) {
        return None;
    }
    let baseline = Plant::new(&nominal.rig, &nominal.effects).ok()?;
    let better = Plant::new(&extended.rig, &extended.effects).ok()?;
    let mut errors = [Errors::default(), Errors::default(), Errors::default()];
    let mut overlay = Overlay::default();
    let mut noise = Deviates(0x2545_F491_4F6C_DD1D);
    for stretch in record.stretches.iter().filter(|s| s.held_back) {
        for window in windows(record, stretch) {
            let (start, end) = window;
            let predictions = [&baseline, &better].map(|plant| predict(record, plant, stretch, start, end, [0.0; 4]));
            // A perfect model would still start from a state that is known within the sensors' noise.
            let blurred = predict(record, &better, stretch, start, end, restart_error(record, &mut noise));
            for (k, at) in (start..end).enumerate() {
                let measured = [record.y_m[at], record.p_a_pa[at], record.p_b_pa[at]];
                errors[0].add(&measured, &predictions[0][k]);
                errors[1].add(&measured, &predictions[1][k]);
                let q = &record.quality;
                let sensed = [
                    blurred[k][0] + noise.next() * q.position.standard_deviation,
                    blurred[k][1] + noise.next() * q.pressure_a.standard_deviation,
                    blurred[k][2] + noise.next() * q.pressure_b.standard_deviation,
                ];
                errors[2].add(&sensed, &predictions[1][k]);
                overlay.t_s.push(record.t_s[at]);
                for channel in 0..3 {
                    overlay.measured[channel].push(measured[channel]);
                    overlay.baseline[channel].push(predictions[0][k][channel]);
                    overlay.extended[channel].push(predictions[1][k][channel]);
                }
            }
        }
    }
    if errors[0].count == 0.0 {
        return None;
    }
    let [baseline_rmse, extended_rmse, noise_floor] = errors.map(|e| e.rmse());
    Some((Gain { holdout: HoldOut { baseline_rmse, extended_rmse, noise_floor }, horizon_s: HORIZON_S }, overlay))
}

/// Starts and ends of predictions within a stretch, none of them touching an end stop.
fn windows(record: &Record, stretch: &Stretch) -> Vec<(usize, usize)> {
    let interval = record.quality.interval_s.max(1.0e-6);
    let (run_in, length) = ((RUN_IN_S / interval) as usize, (HORIZON_S / interval) as usize);
    let mut out = Vec::new();
    let mut start = stretch.start + run_in;
    while start + length <= stretch.end && length > 1 {
        if !record.at_end[start - run_in..start + length].iter().any(|at_end| *at_end) {
            out.push((start, start + length));
        }
        start += length;
    }
    out
}

/// Position, velocity and pressure errors of a measured state, one draw.
fn restart_error(record: &Record, noise: &mut Deviates) -> [f64; 4] {
    let q = &record.quality;
    // Standard errors at the middle of the smoothing parabolas: sigma sqrt(2.25 / samples).
    let of = |sigma: f64, samples: f64| sigma * (2.25 / samples).sqrt();
    [
        noise.next() * of(q.position.standard_deviation, 15.0),
        noise.next() * motion::velocity_error(record),
        noise.next() * of(q.pressure_a.standard_deviation, 17.0),
        noise.next() * of(q.pressure_b.standard_deviation, 17.0),
    ]
}

/// Predicts position and pressures, sample by sample, from the state measured at `start`.
fn predict(
    record: &Record,
    plant: &Plant<f64>,
    stretch: &Stretch,
    start: usize,
    end: usize,
    blur: [f64; 4],
) -> Vec<[f64; 3]> {
    let c = plant.coefficients();
    let measured_state = |k: usize| -> State<f64> {
        let v = record.motion.slope[k] / c.position_scale;
        let y = record.motion.value[k] / c.position_scale + v * c.position_delay_s;
        let lag = c.pressure_time_constant_s;
        let (sensed_a, sensed_b) =
            (record.p_a_smooth.value[k] - c.pressure_a_offset_pa, record.p_b_smooth.value[k] - c.pressure_b_offset_pa);
        let (p_a, p_b) = (
            sensed_a + lag * record.p_a_smooth.slope[k] + blur[2],
            sensed_b + lag * record.p_b_smooth.slope[k] + blur[3],
        );
        let mut state = plant.state_at_rest(y + blur[0], p_a, p_b);
        state.p_a_sensed_pa = sensed_a + blur[2];
        state.p_b_sensed_pa = sensed_b + blur[3];
        state.p_sup_pa = record.p_sup_smooth.value.get(k).copied().unwrap_or(c.supply_pa);
        let moving = v.abs() > 4.0 * motion::velocity_error(record);
        let limit = plant.friction_level(&State { v_m_per_s: v, ..state }).force_n / c.stiffness;
        if moving {
            state.v_m_per_s = v + blur[1];
            state.z_m = limit * v.signum();
        } else {
            let force = c.area_m2 * (p_a - p_b) - c.constant_force_n;
            state.z_m = (force / c.stiffness).clamp(-limit, limit);
        }
        state
    };
    let inputs = |k: usize| Inputs {
        u_v: record.u_v[k],
        external_force_n: record.f_ext_n.get(k).copied().unwrap_or(0.0),
        supply_pa: if c.droop_pa_s_per_kg > 0.0 {
            c.supply_pa
        } else {
            record.p_sup_smooth.value.get(k).copied().unwrap_or(c.supply_pa)
        },
    };
    let interval = record.quality.interval_s.max(1.0e-6);
    let run_in = (start - ((RUN_IN_S / interval) as usize).min(start - stretch.start)).max(stretch.start);
    let stepper = Stepper::adaptive(&Tolerance::standard());
    let mut simulator = Simulator::<f64, 256>::from_state(*plant, measured_state(run_in), stepper);
    for k in run_in..start {
        simulator.advance_with(&inputs(k), record.interval_s(k));
    }
    // What is under way to the valve stays; everything the sensors see is set to what they saw.
    let kept = *simulator.state();
    let mut state = measured_state(start);
    state.spool_v = kept.spool_v;
    if !record.available.supply {
        state.p_sup_pa = kept.p_sup_pa;
    }
    simulator.set_state(state);
    let mut out = Vec::with_capacity(end - start);
    for k in start..end {
        let m = simulator.measure();
        // A late position signal first shows what was there before the restart, which is what was measured.
        let late = c.position_delay_s > 0.0 && record.t_s[k] - record.t_s[start] < c.position_delay_s;
        out.push([if late { record.motion.value[k] } else { m.y_m }, m.p_a_pa, m.p_b_pa]);
        simulator.advance_with(&inputs(k), record.interval_s(k));
    }
    out
}

#[derive(Clone, Copy, Default)]
struct Errors {
    squares: [f64; 3],
    count: f64,
}

impl Errors {
    fn add(&mut self, measured: &[f64; 3], predicted: &[f64; 3]) {
        for channel in 0..3 {
            self.squares[channel] += (measured[channel] - predicted[channel]).powi(2);
        }
        self.count += 1.0;
    }

    fn rmse(&self) -> PerChannel {
        let [y, a, b] = self.squares.map(|square| Some((square / self.count.max(1.0)).sqrt()));
        PerChannel { y_m: y, p_a_pa: a, p_b_pa: b }
    }
}

/// Normal deviates from a xorshift generator with a fixed seed: the floor of a log is always the same.
struct Deviates(u64);

impl Deviates {
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}
