//! Both chambers together: how far the piston went by the pressures, and how far by its sensor.
//!
//! Motion that the position sensor does not show lowers the pressure of one chamber and raises the other's. The mean of
//! both balances, in metres, is therefore the missing motion; noise of the pressures enters it only halfway, and a
//! little smoothing takes most of the rest. What remains allows half the threshold of a single chamber, which is
//! what slow motion and small errors of scale need.
//!
//! Two memories look back over different times: the short one answers quickly, because a share of the motion over a short
//! time is little motion; the long one gathers what is just beyond the tolerated share.

use crate::Check;
use crate::parameters::MonitorParameters;

/// Memories as shares of the horizon: 20 ms and 100 ms by default.
const MEMORIES: [f32; 2] = [0.4, 2.0];
/// Share of a difference that one tick of smoothing takes over at 1 kHz, per second: 5 ms.
const SMOOTHING_S: f32 = 0.005;
/// How much of a single chamber's noise band is left after averaging two chambers over the smoothing time.
const NOISE_LEFT: f32 = 0.35;
/// The position's noise is smoothed as well, play in the mounting is not.
const POSITION_LEFT: f32 = 0.5;

/// One chamber's contribution, as lengths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contribution {
    /// Unexplained change of pressure in this tick, as motion towards chamber B, m.
    pub(crate) missing_m: f32,
    /// How much of it is allowed, m.
    pub(crate) allowed_m: f32,
    /// How much of it a valve without lag would make, m.
    pub(crate) by_lag_m: f32,
    /// Pressure that a metre of motion makes, inverted, m/Pa.
    pub(crate) metres_per_pa: f32,
}

impl Contribution {
    /// In place of the other chamber's, where there is none: the mean of both is then that of one, whose noise nothing
    /// averages out.
    pub(crate) fn alone(self) -> Self {
        const TWICE_ROOT_TWO_LESS_ONE: f32 = 1.828_427_1;
        Self { metres_per_pa: TWICE_ROOT_TWO_LESS_ONE * self.metres_per_pa, ..self }
    }
}

/// What the sensor does not show of the motion.
#[derive(Clone, Copy, Debug, Default)]
struct Memory {
    missing_m: f32,
    allowed_m: f32,
    smooth_m: f32,
    by_lag_m: f32,
    smooth_lag_m: f32,
}

/// Both memories.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MissingMotion {
    keep: [f32; MEMORIES.len()],
    take: f32,
    memories: [Memory; MEMORIES.len()],
}

impl MissingMotion {
    pub(crate) fn new(parameters: &MonitorParameters, tick_s: f32) -> Self {
        let keep = |share: f32| (1.0 - tick_s / (share * parameters.horizon_s)).max(0.0);
        Self { keep: MEMORIES.map(keep), take: (tick_s / SMOOTHING_S).min(1.0), memories: Default::default() }
    }

    pub(crate) fn restart(&mut self) {
        self.memories = Default::default();
    }

    /// Missing motion over the long memory, smoothed, and what the model's errors may make of it over the short one, m.
    pub(crate) fn since_a_bend(&self) -> (f32, f32) {
        let [short, long] = &self.memories;
        (long.smooth_m, short.allowed_m)
    }

    /// One tick; returns what is missing and what may be, in metres, for each memory.
    pub(crate) fn advance(
        &mut self,
        parameters: &MonitorParameters,
        a: &Contribution,
        b: &Contribution,
    ) -> [Check; MEMORIES.len()] {
        let missing_m = 0.5 * (a.missing_m + b.missing_m);
        let allowed_m = 0.5 * (a.allowed_m + b.allowed_m);
        let by_lag_m = 0.5 * (a.by_lag_m + b.by_lag_m);
        let noise_m = POSITION_LEFT * parameters.position_m
            + NOISE_LEFT * 0.5 * (a.metres_per_pa + b.metres_per_pa) * parameters.pressure_pa;
        let mut found = [Check::default(); MEMORIES.len()];
        for ((memory, keep), found) in self.memories.iter_mut().zip(self.keep).zip(&mut found) {
            memory.missing_m = (memory.missing_m + missing_m) * keep;
            memory.allowed_m = (memory.allowed_m + allowed_m) * keep;
            memory.smooth_m += (memory.missing_m - memory.smooth_m) * self.take;
            memory.by_lag_m = (memory.by_lag_m + by_lag_m) * keep;
            memory.smooth_lag_m += (memory.by_lag_m - memory.smooth_lag_m) * self.take;
            let threshold = memory.allowed_m + memory.smooth_lag_m.abs() + noise_m;
            *found = Check { residual: memory.smooth_m, threshold };
        }
        found
    }
}
