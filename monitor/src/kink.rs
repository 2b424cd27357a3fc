//! Velocity that changes faster than the forces can change it.
//!
//! A sensor that freezes, lags, jumps to another delay or to another scale bends the course of its readings within one
//! tick. A piston cannot: the force balance (3.8) limits its acceleration, and
//!
//! ```text
//! M y'' = A (p_a − p_b) − F_friction,   |F_friction| about F_c + sigma_2 |v|
//! ```
//!
//! Three blocks of readings, 8 ms each, show the bend as the second difference of their means. Bends alone are no fault:
//! end stops and obstacles make them, too. But then the pressures tell of the stop as well. So a bend only makes
//! *suspicious* for a while, and it takes missing motion in the bend's direction, counted over that while, to
//! disagree. What is asked for is far less than without suspicion.

use crate::Check;
use crate::history::{History, KEPT, PER_METRE, SPACING_S};
use crate::parameters::MonitorParameters;
use plant_model::{Plant, Real};

/// Readings per block: three of them are kept.
const BLOCK: usize = KEPT / 3;
/// Duration of a block, s.
const BLOCK_S: f32 = BLOCK as f32 * SPACING_S;
/// How long a bend makes suspicious, in readings.
const SUSPICION: u8 = 30;
/// Second difference of the block means for a change of velocity by 1 m/s in the middle, s.
const BEND_S: f32 = 0.75 * BLOCK_S;
/// Noise of the second difference, as a share of the position's tolerance: six standard deviations of three means of 8.
const NOISE_SHARE: f32 = 0.65;
/// Share of the pressures' acceleration that may be wrong, beyond the share that the parameters allow: the blocks see
/// accelerations that change.
const FORCE_SHARE: f32 = 0.3;
/// Time constant against which missing motion is compared, s.
const BEFORE_S: f32 = 0.03;
/// Missing motion that noise can make in that time, as shares of the tolerances of pressure and position.
const MISSING_NOISE: [f32; 2] = [0.2, 0.3];
/// Share of the motion that the bend hides, over 10 ms, which must be missing.
const MISSING_SHARE_S: f32 = 0.25 * 0.010;

/// Share of what the model's errors may hide over the short memory; the bend itself is recent.
const MODEL_SHARE: f32 = 0.3;

/// What one tick tells.
pub(crate) struct Bent {
    /// Of the pressures on the piston, towards B.
    pub(crate) force_n: f32,
    /// Motion missing according to both chambers, and how much of it the model's errors may be, m.
    pub(crate) missing: (f32, f32),
    /// Motion that makes a pascal, mean of both chambers, m/Pa.
    pub(crate) metres_per_pa: f32,
}

/// What is remembered of bends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KinkWatch {
    sums: [i32; 3],
    force_n: f32,
    seconds2_per_kg: f32,
    before_m: f32,
    take_before: f32,
    take_force: f32,
    suspicion: u8,
    bend_m_per_s: f32,
}

impl KinkWatch {
    pub(crate) fn new(plant: &Plant<f32>, tick_s: f32) -> Self {
        Self {
            sums: [0; 3],
            force_n: 0.0,
            seconds2_per_kg: BLOCK_S * BLOCK_S / plant.coefficients().mass_kg,
            before_m: 0.0,
            take_before: (tick_s / BEFORE_S).min(1.0),
            take_force: (tick_s / BLOCK_S).min(1.0),
            suspicion: 0,
            bend_m_per_s: 0.0,
        }
    }

    pub(crate) fn restart(&mut self) {
        (self.suspicion, self.before_m, self.force_n) = (0, 0.0, 0.0);
    }

    /// One tick; `forgotten` as the history says.
    pub(crate) fn advance(
        &mut self,
        plant: &Plant<f32>,
        parameters: &MonitorParameters,
        tick: &Bent,
        (history, forgotten): (&History, Option<i32>),
    ) -> Check {
        let (missing_m, model_m) = tick.missing;
        let since_before_m = missing_m - self.before_m;
        self.before_m += since_before_m * self.take_before;
        self.force_n += (tick.force_n - self.force_n) * self.take_force;
        if let Some(forgotten) = forgotten {
            self.see(plant, parameters, history, forgotten);
        }
        if self.suspicion == 0 {
            return Check::NOTHING;
        }
        // The sensor slows down, the piston does not: motion is missing in the direction opposite to the bend.
        let against_bend = if self.bend_m_per_s > 0.0 { -since_before_m } else { since_before_m };
        let noise_m =
            MISSING_NOISE[0] * parameters.pressure_pa * tick.metres_per_pa + MISSING_NOISE[1] * parameters.position_m;
        Check {
            residual: against_bend.at_least(0.0),
            threshold: MODEL_SHARE * model_m + noise_m.at_least(MISSING_SHARE_S * self.bend_m_per_s.abs()),
        }
    }

    fn see(&mut self, plant: &Plant<f32>, parameters: &MonitorParameters, history: &History, forgotten: i32) {
        if history.filled() == 1 {
            self.sums = [history.ago(0) * BLOCK as i32; 3];
        } else {
            // The newest enters the first block, each block's oldest passes to the next.
            let passed = [history.ago(0), history.ago(BLOCK), history.ago(2 * BLOCK), forgotten];
            for (sum, pair) in self.sums.iter_mut().zip(passed.windows(2)) {
                if let [enters, leaves] = pair {
                    *sum += enters - leaves;
                }
            }
        }

        const PER_SUM: f32 = 1.0 / (BLOCK as f32 * PER_METRE);
        let [new, middle, old] = self.sums;
        let second_difference_m = (new - 2 * middle + old) as f32 * PER_SUM;
        let velocity = (new - old) as f32 * (PER_SUM * 0.5 / BLOCK_S);
        let m = plant.coefficients();
        let friction_n = m.coulomb_n + m.viscous * velocity.abs();
        let resisting_n = if velocity < 0.0 { -friction_n } else { friction_n };
        let expected_m = (self.force_n - resisting_n) * self.seconds2_per_kg;
        let doubt_n = (parameters.relative + FORCE_SHARE) * self.force_n.abs() + friction_n;
        let allowed_m = NOISE_SHARE * parameters.position_m + doubt_n * self.seconds2_per_kg;
        let bend_m = second_difference_m - expected_m;
        if bend_m.abs() > allowed_m {
            self.suspicion = SUSPICION;
            self.bend_m_per_s = bend_m * (1.0 / BEND_S);
        } else {
            self.suspicion = self.suspicion.saturating_sub(1);
        }
    }
}
