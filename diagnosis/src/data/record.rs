//! The prepared log: made by `prepare`, read by all later stages.

use super::command::Steps;
use super::quality::{Available, Quality};
use super::smoothing::{Reach, Smoothed};
use super::split::Stretch;
use crate::constants;
use core::ops::Range;
use plant_model::{FirstOrderLag, Side};

/// A moment between two samples.
#[derive(Clone, Copy)]
pub(crate) struct Moment {
    low: usize,
    high: usize,
    /// Part of the way from one to the other.
    part: f64,
}

impl Moment {
    /// A signal then, linear between the samples.
    pub(crate) fn of(&self, signal: &[f64]) -> f64 {
        self.between(signal[self.low], signal[self.high])
    }

    /// What is known of a signal at an entry as a function of it, linear between the samples.
    pub(crate) fn of_each<const N: usize>(&self, at: impl Fn(usize) -> [f64; N]) -> [f64; N] {
        let (low, high) = (at(self.low), at(self.high));
        core::array::from_fn(|k| self.between(low[k], high[k]))
    }

    fn between(&self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.part
    }
}

/// The prepared log. All arrays have one entry per usable sample, and between distant samples further ones by
/// interpolation ([`super::grid`]); channels not measured are empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct Record {
    /// The places of the samples that were measured; all others are interpolated.
    pub(crate) rows: Vec<usize>,
    /// Usual time from one entry to the next, s.
    pub(crate) step_s: f64,
    /// Whether each entry was measured; empty where all were.
    pub(crate) measured: Vec<bool>,
    /// The command in the rows as logged, V.
    pub(crate) u_rows_v: Vec<f64>,
    /// Standard deviation of the command's mean from each row to the next, V; empty for a command that was held.
    pub(crate) command_doubt_v: Vec<f64>,
    /// The same for the change of p_a, Pa.
    pub(crate) doubt_a_pa: Vec<f64>,
    /// The same for the change of p_b, Pa.
    pub(crate) doubt_b_pa: Vec<f64>,
    /// The same for the mass flow drawn from the supply, kg/s.
    pub(crate) doubt_drawn_kg_per_s: Vec<f64>,
    /// How much of what the curve between the points of a table may differ by is part of the doubts: 0 to 1.
    pub(crate) curve_doubt: f64,
    pub(crate) t_s: Vec<f64>,
    /// The mean command from each entry to the next, V.
    pub(crate) u_v: Vec<f64>,
    /// The commands within that time, where they are not its mean alone.
    pub(crate) commands: Option<Steps>,
    pub(crate) y_m: Vec<f64>,
    pub(crate) p_a_pa: Vec<f64>,
    pub(crate) p_b_pa: Vec<f64>,
    pub(crate) f_ext_n: Vec<f64>,
    /// Position for volumes.
    pub(crate) y_smooth: Smoothed,
    /// Position for velocity: more smoothing.
    pub(crate) motion: Smoothed,
    pub(crate) p_a_smooth: Smoothed,
    pub(crate) p_b_smooth: Smoothed,
    /// Mean of p_a from each entry to the next less that of a straight line between them, Pa; or empty.
    pub(crate) bend_a_pa: Vec<f64>,
    /// The same for p_b.
    pub(crate) bend_b_pa: Vec<f64>,
    /// Where the lower and the upper end stop read, m, if the piston leans on them.
    pub(crate) end_stops_m: [Option<f64>; 2],
    /// Whether the piston may touch an end stop, or a sensor its limit: there the force balance is open.
    pub(crate) at_end: Vec<bool>,
    /// Time from which on the log determines the state of valve and supply, s.
    pub(crate) valve_known_s: f64,
    /// Bandwidth of the position observer, rad/s.
    pub(crate) observer_rad_per_s: f64,
    /// Where friction falls with speed.
    pub(crate) creeping: Creeping,
    /// What the observer makes of the position's noise: standard deviation of its averaged innovations over that of the
    /// sensor.
    pub(crate) observer_noise: f64,
    /// One over the standard deviation of the error that a perfect prediction of p_a would have, 1/Pa.
    pub(crate) weight_a_per_pa: Vec<f64>,
    /// The same for p_b.
    pub(crate) weight_b_per_pa: Vec<f64>,
    pub(crate) p_sup_pa: Vec<f64>,
    pub(crate) p_sup_smooth: Smoothed,
    pub(crate) stretches: Vec<Stretch>,
    pub(crate) available: Available,
    pub(crate) quality: Quality,
}

/// How a piston that creeps, where friction falls with speed, runs away from its prediction, by the rig as its file states it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Creeping {
    /// By the steepest fall, 1/s.
    pub(crate) runs_away_per_s: f64,
    /// Up to this speed, m/s.
    pub(crate) fastest_m_per_s: f64,
}

/// What was measured of one chamber.
#[derive(Clone, Copy)]
pub(crate) struct ChamberSignals<'a> {
    /// Pressure as logged, Pa.
    pub(crate) p_pa: &'a [f64],
    /// Smoothed.
    pub(crate) smooth: &'a Smoothed,
    /// Of the other chamber; empty if not measured.
    pub(crate) other: &'a Smoothed,
    /// One over the standard deviation of the error that a perfect prediction would have, 1/Pa.
    pub(crate) weight_per_pa: &'a [f64],
    /// Standard deviation of the sensor's noise, Pa.
    pub(crate) noise_pa: f64,
    /// Standard deviation of its change from each row to the next by what is not known of the command, Pa; or empty.
    pub(crate) doubt_pa: &'a [f64],
}

impl Record {
    /// The signals of a chamber.
    pub(crate) fn chamber(&self, side: Side) -> ChamberSignals<'_> {
        match side {
            Side::A => ChamberSignals {
                p_pa: &self.p_a_pa,
                smooth: &self.p_a_smooth,
                other: &self.p_b_smooth,
                weight_per_pa: &self.weight_a_per_pa,
                noise_pa: self.quality.pressure_a.standard_deviation,
                doubt_pa: &self.doubt_a_pa,
            },
            Side::B => ChamberSignals {
                p_pa: &self.p_b_pa,
                smooth: &self.p_b_smooth,
                other: &self.p_a_smooth,
                weight_per_pa: &self.weight_b_per_pa,
                noise_pa: self.quality.pressure_b.standard_deviation,
                doubt_pa: &self.doubt_b_pa,
            },
        }
    }

    /// Position in m and velocity in m/s at entry `k`, as the position sensor would show them without a lag.
    #[inline]
    pub(crate) fn motion_ahead(&self, k: usize, lag: &FirstOrderLag<f64>) -> [f64; 2] {
        let (y, v) = (self.motion.value[k], self.motion.slope[k]);
        if lag.time_constant_s > 0.0 { [lag.ahead(y, v), lag.ahead(v, self.acceleration_m_per_s2(k))] } else { [y, v] }
    }

    /// The position for volumes in m at entry `k`, as the sensor would show it without a lag. The slope of the same windows: a smoother
    /// one cuts peaks, which is more pressure in a small chamber than its noise, and that of the smoothed values is noisier.
    pub(crate) fn position_ahead_m(&self, k: usize, lag: &FirstOrderLag<f64>) -> f64 {
        lag.ahead(self.y_smooth.value[k], self.y_smooth.slope[k])
    }

    /// Slope of the smoothed velocity over [`Record::acceleration_span_s`], m/s2; 0 beside missing rows.
    fn acceleration_m_per_s2(&self, k: usize) -> f64 {
        let half = ((0.5 * self.acceleration_span_s() / self.step_s.max(1.0e-6)).round() as usize).max(1);
        let (low, high) = (k.saturating_sub(half), (k + half).min(self.len() - 1));
        let duration_s = self.t_s[high] - self.t_s[low];
        let is_whole = duration_s > 0.0 && duration_s < 2.0 * (high - low) as f64 * self.step_s;
        if is_whole { (self.motion.slope[high] - self.motion.slope[low]) / duration_s } else { 0.0 }
    }

    /// The time between the two velocities of which an acceleration is the slope, s: as far apart that their windows overlap by half.
    fn acceleration_span_s(&self) -> f64 {
        self.velocity_reach().seconds
    }

    /// What undoing a lag adds to the variance of the position for volumes, as a multiple of it: value and slope of a local parabola of
    /// `n` samples `h` apart err independently, with variances of 9/(4 n) and 12/(n (n^2 - 1) h^2) of the noise's.
    pub(crate) fn position_variance_added(&self, lag: &FirstOrderLag<f64>) -> f64 {
        let interval_s = self.quality.interval_s;
        let window = (2 * self.volume_reach().samples(interval_s) + 1) as f64;
        12.0 / (2.25 * (window * window - 1.0).max(1.0)) * (lag.time_constant_s / interval_s).powi(2)
    }

    /// By what factor the velocity errs more if a lag is undone in it.
    pub(crate) fn velocity_error_ahead(&self, lag: &FirstOrderLag<f64>) -> f64 {
        (core::f64::consts::SQRT_2 * lag.time_constant_s / self.acceleration_span_s()).hypot(1.0)
    }

    /// Mean of a chamber's pressure from entry `k` to the next less that of a straight line between them, Pa; 0 where not known.
    pub(crate) fn bend_pa(&self, side: Side, k: usize) -> f64 {
        let bends = if side == Side::A { &self.bend_a_pa } else { &self.bend_b_pa };
        bends.get(k).copied().unwrap_or(0.0)
    }

    /// Whether a chamber stands open to the atmosphere: its pressure is constant whatever valve and piston do.
    pub(crate) fn is_vented(&self, side: Side) -> bool {
        side == Side::B && self.available.vented_b
    }

    /// Number of usable samples.
    pub(crate) fn len(&self) -> usize {
        self.t_s.len()
    }

    /// The times at which the command changes, s, and the command from there on, V.
    pub(crate) fn commands(&self) -> (&[f64], &[f64]) {
        self.commands.as_ref().map_or((&self.t_s, &self.u_v), |steps| (&steps.t_s, &steps.u_v))
    }

    /// Whether the command moved between rows.
    pub(crate) fn command_moved(&self) -> bool {
        !self.command_doubt_v.is_empty()
    }

    /// Whether there are entries between rows.
    pub(crate) fn is_interpolated(&self) -> bool {
        self.rows.len() < self.len()
    }

    /// Whether the balances usually go more than one step between rows: there they err by themselves. A few missing rows are no matter.
    pub(crate) fn has_distant_rows(&self) -> bool {
        self.quality.interval_s > constants::longest_step()
    }

    /// Whether entry `k` was measured.
    pub(crate) fn is_row(&self, k: usize) -> bool {
        self.measured.get(k).is_none_or(|measured| *measured)
    }

    /// The measured entries among some.
    pub(crate) fn rows_in(&self, range: Range<usize>) -> &[usize] {
        let (low, high) =
            (self.rows.partition_point(|k| *k < range.start), self.rows.partition_point(|k| *k < range.end));
        &self.rows[low..high]
    }

    /// The measured entries in some stretches, in order.
    pub(crate) fn rows_of<'a>(&'a self, stretches: &'a [Stretch]) -> impl Iterator<Item = usize> + 'a {
        stretches.iter().flat_map(|stretch| self.rows_in(stretch.range()).iter().copied())
    }

    /// Time from a measured entry to the next one, s; the usual interval behind the last one.
    pub(crate) fn to_next_row_s(&self, k: usize) -> f64 {
        if self.rows.len() == self.len() {
            return self.interval_s(k);
        }
        let next = (k + 1..self.len()).find(|entry| self.is_row(*entry));
        next.map_or(self.quality.interval_s, |next| self.t_s[next] - self.t_s[k])
    }

    /// Half the window that smooths the position for volumes, and the supply.
    pub(crate) fn volume_reach(&self) -> Reach {
        Reach::new(constants::volume_reach(), self.quality.interval_s, constants::least_reach())
    }

    /// The same for the velocity.
    pub(crate) fn velocity_reach(&self) -> Reach {
        Reach::new(constants::velocity_reach(), self.quality.interval_s, constants::least_velocity_reach())
    }

    /// The same for chamber pressures.
    pub(crate) fn pressure_reach(&self) -> Reach {
        Reach::new(constants::pressure_reach(), self.quality.interval_s, constants::least_reach())
    }

    /// How many innovations are averaged into one.
    pub(crate) fn averaged(&self) -> usize {
        ((constants::averaged() / self.quality.interval_s.max(1.0e-6)).round() as usize).max(1)
    }

    /// Over how many samples means are taken for the long-run variance.
    pub(crate) fn dispersion_span(&self) -> usize {
        ((constants::dispersion_span() / self.quality.interval_s.max(1.0e-6)).round() as usize).max(2)
    }

    /// Time to the next entry, s; the usual one behind the last.
    pub(crate) fn interval_s(&self, k: usize) -> f64 {
        if k + 1 < self.len() { self.t_s[k + 1] - self.t_s[k] } else { self.step_s }
    }

    /// Standard error of the smoothed velocity, m/s: that of the slope of a straight line through `2 m + 1` samples,
    /// `3 sigma^2 / (dt^2 m (m + 1) (2 m + 1))`.
    pub(crate) fn velocity_error_m_per_s(&self) -> f64 {
        let m = self.velocity_reach().samples(self.quality.interval_s) as f64;
        let spread: f64 = 3.0 / (m * (m + 1.0) * (2.0 * m + 1.0));
        self.quality.position.standard_deviation * spread.sqrt() / self.quality.interval_s.max(1.0e-6)
    }

    /// Standard error of a smoothed pressure, Pa: that of the middle of a parabola through `2 m + 1` samples,
    /// `3 (3 m^2 + 3 m - 1) sigma^2 / ((2 m - 1) (2 m + 1) (2 m + 3))`.
    pub(crate) fn smoothed_pressure_error_pa(&self, side: Side) -> f64 {
        let m = self.pressure_reach().samples(self.quality.interval_s) as f64;
        let spread: f64 = 3.0 * (3.0 * m * m + 3.0 * m - 1.0) / ((2.0 * m - 1.0) * (2.0 * m + 1.0) * (2.0 * m + 3.0));
        self.chamber(side).noise_pa * spread.sqrt()
    }

    /// Where the time `by_s` after (before, if negative) sample `k` lies within some samples.
    pub(crate) fn moment(&self, k: usize, by_s: f64, within: Range<usize>) -> Moment {
        let t_s = self.t_s[k] + by_s;
        let guess = k as f64 + by_s / self.step_s.max(1.0e-9);
        let last = within.end.saturating_sub(1).max(within.start);
        // Sampling is nearly even: the place is a few samples from the guess at most, unless the log is interrupted.
        let mut low = (guess.max(0.0) as usize).clamp(within.start, last);
        while low < last && self.t_s[low + 1] <= t_s {
            low += 1;
        }
        while low > within.start && self.t_s[low] > t_s {
            low -= 1;
        }
        let high = (low + 1).min(last);
        let step = self.t_s[high] - self.t_s[low];
        Moment { low, high, part: if step > 0.0 { ((t_s - self.t_s[low]) / step).clamp(0.0, 1.0) } else { 0.0 } }
    }
}
