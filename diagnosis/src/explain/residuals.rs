//! The errors of a balance against every quantity they may depend on, and over frequency.
//!
//! For a chamber the innovations are turned back into the rate of pressure that the balance lacks, because that is
//! proportional to a missing flow. For the piston and the supply the error itself is shown.

use crate::constants;
use crate::data::channel::Channel;
use crate::data::quality::Quality;
use crate::outcome::{Dependence, Evidence, Peak};
use plant_model::Rig;
use rayon::prelude::*;
use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex;
use rustfft::{Fft as _, FftDirection};

/// Half the window over which rates are taken, s.
const RATE_WINDOW_S: f64 = 0.02;
/// Points of a curve: each is the mean over as many samples as any other.
const BINS: usize = 24;
/// Fewer samples than this make no curve.
const LEAST_SAMPLES: usize = 240;
/// The extremes at either end that are left out.
const TRIMMED: f64 = 0.004;
/// Length of the pieces whose spectra are averaged, s, and their least number.
const PIECE_S: f64 = 1.0;
const LEAST_PIECES: usize = 4;

/// What an error is looked at against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Valve command, V.
    Command,
    /// Its rate, V/s.
    CommandRate,
    /// Position, m.
    Position,
    /// Velocity, m/s.
    Velocity,
    /// Acceleration, m/s².
    Acceleration,
    /// Pressure of A, Pa absolute.
    PressureA,
    /// Pressure of B, Pa absolute.
    PressureB,
    /// Pressure ratio, downstream over upstream, of the orifice between A and supply or atmosphere.
    RatioA,
    /// The same for B.
    RatioB,
    /// `p_a - p_b`, Pa.
    Difference,
    /// `p_a + p_b`, Pa absolute.
    Sum,
    /// Rate of the pressure of A, Pa/s.
    RateA,
    /// Rate of the pressure of B, Pa/s.
    RateB,
    /// Time, s.
    Time,
}

impl Quantity {
    /// Name in `diagnosis.json`, unit included.
    #[must_use]
    pub const fn id(self) -> &'static str {
        match self {
            Self::Command => "u_v",
            Self::CommandRate => "u_rate_v_per_s",
            Self::Position => "y_m",
            Self::Velocity => "v_m_per_s",
            Self::Acceleration => "a_m_per_s2",
            Self::PressureA => "p_a_pa",
            Self::PressureB => "p_b_pa",
            Self::RatioA => "pressure_ratio_a",
            Self::RatioB => "pressure_ratio_b",
            Self::Difference => "p_a_minus_p_b_pa",
            Self::Sum => "p_a_plus_p_b_pa",
            Self::RateA => "p_a_rate_pa_per_s",
            Self::RateB => "p_b_rate_pa_per_s",
            Self::Time => "t_s",
        }
    }

    /// The quantities a channel's errors are looked at against.
    #[must_use]
    pub const fn of(channel: Channel) -> &'static [Self] {
        use Quantity as Q;
        match channel {
            Channel::PressureA => &[
                Q::Command,
                Q::CommandRate,
                Q::RatioA,
                Q::PressureA,
                Q::RateA,
                Q::Difference,
                Q::Velocity,
                Q::Position,
                Q::Acceleration,
                Q::Time,
            ],
            Channel::PressureB => &[
                Q::Command,
                Q::CommandRate,
                Q::RatioB,
                Q::PressureB,
                Q::RateB,
                Q::Difference,
                Q::Velocity,
                Q::Position,
                Q::Acceleration,
                Q::Time,
            ],
            Channel::Position => &[
                Q::Velocity,
                Q::Acceleration,
                Q::Position,
                Q::Difference,
                Q::Sum,
                Q::RateA,
                Q::RateB,
                Q::Command,
                Q::Time,
            ],
            Channel::Supply => &[Q::Command, Q::CommandRate, Q::Velocity, Q::Position, Q::Time],
        }
    }
}

/// Whose errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// The rig file as given, its nominal values corrected within their tolerance.
    Nominal,
    /// With the causes found.
    Extended,
}

/// The mean error over groups of samples alike in a quantity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// The quantity, in its unit, increasing.
    pub x: Vec<f64>,
    /// The mean error there: Pa/s for a chamber, m for the position, Pa for the supply.
    pub y: Vec<f64>,
    /// Share of the variance of the errors that the means make up, 0 to 1.
    pub explained: f64,
}

/// Power of the errors over frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// Frequency, Hz, increasing.
    pub hz: Vec<f64>,
    /// Power density over that of the sensor's noise, white.
    pub power: Vec<f64>,
}

/// The errors of the balances with everything they may depend on.
pub struct Residuals<'a> {
    evidence: &'a Evidence,
    atmosphere_pa: f64,
    supply_pa: f64,
    interval_s: f64,
    acceleration: Vec<f64>,
    command_rate: Vec<f64>,
    rate_a: Vec<f64>,
    rate_b: Vec<f64>,
    nominal: [Vec<f64>; 4],
    extended: [Vec<f64>; 4],
}

impl<'a> Residuals<'a> {
    /// From the evidence of a diagnosis, the quality of its log and the rig as given.
    #[must_use]
    pub fn new(evidence: &'a Evidence, quality: &Quality, rig: &Rig<f64>) -> Self {
        let t_s = &evidence.t_s;
        let reach = ((RATE_WINDOW_S / quality.interval_s.max(1e-6)).round() as usize).max(1);
        let lacking = |errors: &[Vec<f64>; 4]| {
            let chamber = |errors: &[f64], sigma: f64| -> Vec<f64> {
                let smooth = mean_around(t_s, errors, reach);
                let growth = rate(t_s, &smooth, reach);
                // From the innovation of the observer back to the rate of pressure that the balance lacks.
                smooth.iter().zip(&growth).map(|(e, g)| (g + e / constants::chamber_memory_s()) * sigma).collect()
            };
            let plain = |errors: &[f64], sigma: f64| -> Vec<f64> { errors.iter().map(|e| e * sigma).collect() };
            [
                chamber(&errors[0], quality.pressure_a.standard_deviation),
                chamber(&errors[1], quality.pressure_b.standard_deviation),
                plain(&errors[2], quality.position.standard_deviation),
                plain(&errors[3], quality.supply.standard_deviation),
            ]
        };
        Self {
            atmosphere_pa: rig.supply.atmosphere_pa,
            supply_pa: rig.supply.pressure_pa,
            interval_s: quality.interval_s,
            acceleration: rate(t_s, &evidence.v_m_per_s, reach),
            command_rate: rate(t_s, &evidence.u_v, reach),
            rate_a: rate(t_s, &evidence.p_a_pa, reach),
            rate_b: rate(t_s, &evidence.p_b_pa, reach),
            nominal: lacking(&evidence.nominal),
            extended: lacking(&evidence.extended),
            evidence,
        }
    }

    /// The value of a quantity at a sample; NaN where it was not measured.
    #[must_use]
    pub fn at(&self, quantity: Quantity, k: usize) -> f64 {
        let e = self.evidence;
        let at = |signal: &[f64]| signal.get(k).copied().unwrap_or(f64::NAN);
        // Downstream over upstream: a chamber fills while the command is on its side.
        let ratio = |p: f64, fills: bool| if fills { p / self.supply_pa } else { self.atmosphere_pa / p };
        match quantity {
            Quantity::Command => at(&e.u_v),
            Quantity::CommandRate => at(&self.command_rate),
            Quantity::Position => at(&e.y_m),
            Quantity::Velocity => at(&e.v_m_per_s),
            Quantity::Acceleration => at(&self.acceleration),
            Quantity::PressureA => at(&e.p_a_pa),
            Quantity::PressureB => at(&e.p_b_pa),
            Quantity::RatioA => ratio(at(&e.p_a_pa), at(&e.u_v) >= 0.0),
            Quantity::RatioB => ratio(at(&e.p_b_pa), at(&e.u_v) < 0.0),
            Quantity::Difference => at(&e.p_a_pa) - at(&e.p_b_pa),
            Quantity::Sum => at(&e.p_a_pa) + at(&e.p_b_pa),
            Quantity::RateA => at(&self.rate_a),
            Quantity::RateB => at(&self.rate_b),
            Quantity::Time => at(&e.t_s),
        }
    }

    /// A channel's errors, sample by sample; empty if it was not judged, NaN where a prediction is not settled.
    fn errors(&self, channel: Channel, model: Model) -> &[f64] {
        let all = if model == Model::Nominal { &self.nominal } else { &self.extended };
        &all[channel as usize]
    }

    /// Mean errors over groups of samples that are neighbours in a quantity, of the samples `keep` lets through; `None`
    /// if too few are left.
    pub fn curve(
        &self,
        channel: Channel,
        model: Model,
        against: Quantity,
        keep: impl Fn(usize) -> bool,
    ) -> Option<Curve> {
        let points = self.points(channel, model, |k| if keep(k) { self.at(against, k) } else { f64::NAN })?;
        let variance = Variance::of(&points);
        let mut out = Curve::default();
        for group in groups(&points) {
            let n = group.len() as f64;
            let (x, y) = group.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
            out.explained += variance.share(n, y);
            out.x.push(x);
            out.y.push(y);
        }
        Some(out)
    }

    /// The parts of a channel's errors that are alike (even) and opposite (odd) in the two directions of motion,
    /// against the speed.
    #[must_use]
    pub fn parity(&self, channel: Channel, model: Model) -> Option<[Curve; 2]> {
        let points = self.points(channel, model, |k| self.evidence.v_m_per_s[k])?;
        let variance = Variance::of(&points);
        let mut by_speed = points;
        by_speed.sort_unstable_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let mut out = [Curve::default(), Curve::default()];
        for group in groups(&by_speed) {
            let n = group.len() as f64;
            let speed = group.iter().map(|p| p.0.abs()).sum::<f64>() / n;
            let mean = |forward: bool| {
                let side = group.iter().filter(|p| (p.0 > 0.0) == forward);
                let (sum, count) = side.fold((0.0, 0.0), |(sum, count), p| (sum + p.1, count + 1.0));
                if count > 0.0 { sum / count } else { variance.mean }
            };
            let (forward, backward) = (mean(true), mean(false));
            let (even, odd) = (0.5 * (forward + backward), 0.5 * (forward - backward));
            for (curve, value, share) in
                [(0, even, variance.share(n, even)), (1, odd, variance.share(n, odd + variance.mean))]
            {
                out[curve].x.push(speed);
                out[curve].y.push(value);
                out[curve].explained += share;
            }
        }
        Some(out)
    }

    /// Power of a channel's errors over frequency, from pieces without interruption; `None` if too few hang together.
    #[must_use]
    pub fn spectrum(&self, channel: Channel, model: Model) -> Option<Spectrum> {
        let e = self.evidence;
        let errors = match model {
            Model::Nominal => &e.nominal[channel as usize],
            Model::Extended => &e.extended[channel as usize],
        };
        let length = ((PIECE_S / self.interval_s.max(1e-6)) as usize).next_power_of_two();
        // The length is a power of two, which this algorithm asks for. A planner would compile every other algorithm as well.
        let transform = Radix4::new(length, FftDirection::Forward);
        let turn = core::f64::consts::TAU / length as f64;
        let window: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * (turn * k as f64).cos()).collect();
        let white: f64 = window.iter().map(|w| w * w).sum();
        let mut values = vec![Complex::new(0.0, 0.0); length];
        let mut scratch = vec![Complex::new(0.0, 0.0); transform.get_inplace_scratch_len()];
        let mut power = vec![0.0; length / 2 + 1];
        let (mut pieces, mut start) = (0, 0);
        while start + length <= errors.len() {
            let piece = start..start + length;
            let lasts = e.t_s[piece.end - 1] - e.t_s[start];
            let whole = lasts < (length as f64 + 2.0) * self.interval_s;
            // Behind what is missing a new piece begins.
            let missing = errors[piece.clone()].iter().rposition(|error| error.is_nan());
            if missing.is_none() && whole {
                for ((to, error), w) in values.iter_mut().zip(&errors[piece]).zip(&window) {
                    *to = Complex::new(error * w, 0.0);
                }
                // Lengths agree by construction.
                transform.process_with_scratch(&mut values, &mut scratch);
                power.iter_mut().zip(&values).for_each(|(sum, x)| *sum += x.norm_sqr() / white);
                pieces += 1;
                start += length / 2;
            } else {
                start += missing.map_or(length / 4, |place| place + 1).max(1);
            }
        }
        if pieces < LEAST_PIECES {
            return None;
        }
        power.iter_mut().for_each(|sum| *sum /= pieces as f64);
        let hz = (0..power.len()).map(|k| k as f64 / (length as f64 * self.interval_s)).collect();
        Some(Spectrum { hz, power })
    }

    /// The dependence of a channel's errors on every quantity, strongest for the nominal rig first.
    #[must_use]
    pub fn dependences(&self, channel: Channel) -> Vec<Dependence> {
        let share = |model, against| self.curve(channel, model, against, |_| true).map(|curve| curve.explained);
        let mut out: Vec<Dependence> = Quantity::of(channel)
            .par_iter()
            .filter_map(|against| {
                let (nominal, extended) = (share(Model::Nominal, *against)?, share(Model::Extended, *against)?);
                Some(Dependence { quantity: against.id(), nominal, extended })
            })
            .collect();
        if let (Some(nominal), Some(extended)) =
            (self.parity(channel, Model::Nominal), self.parity(channel, Model::Extended))
        {
            for (quantity, part) in [("v_even", 0), ("v_odd", 1)] {
                let (nominal, extended) = (nominal[part].explained, extended[part].explained);
                out.push(Dependence { quantity, nominal, extended });
            }
        }
        out.sort_by(|a, b| b.nominal.total_cmp(&a.nominal));
        out
    }

    /// Where in frequency the nominal rig errs most.
    #[must_use]
    pub fn peak(&self, channel: Channel) -> Option<Peak> {
        let (nominal, extended) = (self.spectrum(channel, Model::Nominal)?, self.spectrum(channel, Model::Extended)?);
        let place = (0..nominal.hz.len()).max_by(|a, b| nominal.power[*a].total_cmp(&nominal.power[*b]))?;
        let hz = nominal.hz[place];
        Some(Peak { hz, nominal: nominal.power[place], extended: extended.power[place] })
    }

    /// A quantity and the error, sorted by the quantity, extremes left out.
    fn points(&self, channel: Channel, model: Model, x: impl Fn(usize) -> f64) -> Option<Vec<(f64, f64)>> {
        let errors = self.errors(channel, model).iter().enumerate();
        let all = errors.map(|(k, error)| (x(k), *error));
        let mut points: Vec<(f64, f64)> = all.filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
        if points.len() < LEAST_SAMPLES {
            return None;
        }
        points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let trimmed = (points.len() as f64 * TRIMMED) as usize;
        points.truncate(points.len() - trimmed);
        points.drain(..trimmed);
        Some(points)
    }
}

/// The variance of some errors, to be shared out among groups.
struct Variance {
    mean: f64,
    total: f64,
}

impl Variance {
    fn of(points: &[(f64, f64)]) -> Self {
        let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len().max(1) as f64;
        Self { mean, total: points.iter().map(|p| (p.1 - mean).powi(2)).sum() }
    }

    /// The share of `n` samples with some mean.
    fn share(&self, n: f64, mean: f64) -> f64 {
        if self.total > 0.0 { n * (mean - self.mean).powi(2) / self.total } else { 0.0 }
    }
}

fn groups(points: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    points.chunks(points.len().div_ceil(BINS).max(1))
}

/// Whether `k ± reach` lies within one uninterrupted stretch.
fn window(t_s: &[f64], k: usize, reach: usize) -> Option<(usize, usize)> {
    let (low, high) = (k.checked_sub(reach)?, k + reach);
    let usual = t_s.get(k + 1).map_or(0.0, |next| next - t_s[k]).max(1e-6);
    (high < t_s.len() && t_s[high] - t_s[low] < 3.0 * (2 * reach) as f64 * usual).then_some((low, high))
}

fn rate(t_s: &[f64], signal: &[f64], reach: usize) -> Vec<f64> {
    (0..signal.len())
        .map(|k| match window(t_s, k, reach) {
            Some((low, high)) => (signal[high] - signal[low]) / (t_s[high] - t_s[low]),
            None => f64::NAN,
        })
        .collect()
}

fn mean_around(t_s: &[f64], signal: &[f64], reach: usize) -> Vec<f64> {
    (0..signal.len())
        .map(|k| match window(t_s, k, reach) {
            Some((low, high)) => signal[low..=high].iter().sum::<f64>() / (high - low + 1) as f64,
            None => f64::NAN,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::noise::ChannelNoise;
    use rig_files::RigFile;

    /// Errors of unit noise plus `gap(v, t)` for the nominal model, of noise alone for the extended one.
    fn evidence(gap: impl Fn(f64, f64) -> f64) -> (Evidence, Quality) {
        let n = 20_000;
        let t_s: Vec<f64> = (0..n).map(|k| 1e-3 * k as f64).collect();
        let v: Vec<f64> = t_s.iter().map(|t| 0.2 * (2.0 * t).sin() + 0.1 * (3.3 * t).sin()).collect();
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5) * 12_f64.sqrt()
        };
        let white: Vec<f64> = (0..n).map(|_| noise()).collect();
        let nominal: Vec<f64> = (0..n).map(|k| white[k] + gap(v[k], t_s[k])).collect();
        let y_m = t_s.iter().map(|t| (0.7 * t).cos()).collect();
        let only = |errors: Vec<f64>| [Vec::new(), Vec::new(), errors, Vec::new()];
        let out =
            Evidence { t_s, y_m, v_m_per_s: v, nominal: only(nominal), extended: only(white), ..Evidence::default() };
        let position = ChannelNoise { standard_deviation: 1.0, resolution: 0.0 };
        (out, Quality { interval_s: 1e-3, position, ..Quality::default() })
    }

    fn share(dependences: &[Dependence], quantity: &str) -> f64 {
        dependences.iter().find(|d| d.quantity == quantity).map_or(f64::NAN, |d| d.nominal)
    }

    #[test]
    fn errors_are_found_against_what_they_depend_on_and_by_their_parity() {
        let rig = RigFile::paper_a();
        let (even, quality) = evidence(|v, _| 20.0 * v * v);
        let found = Residuals::new(&even, &quality, &rig.rig).dependences(Channel::Position);
        assert!(found[..2].iter().all(|d| d.quantity.starts_with("v_")), "{found:?}");
        assert!(share(&found, "v_even") > 10.0 * share(&found, "v_odd"), "{found:?}");
        assert!(found.iter().all(|d| d.extended < 0.01), "{found:?}");

        let (odd, quality) = evidence(|v, _| 3.0 * v.signum());
        let found = Residuals::new(&odd, &quality, &rig.rig).dependences(Channel::Position);
        assert!(share(&found, "v_odd") > 0.8 && share(&found, "v_even") < 0.01, "{found:?}");
    }

    #[test]
    fn a_tone_is_found_at_its_frequency_and_white_noise_is_one_everywhere() {
        let rig = RigFile::paper_a();
        let (tone, quality) = evidence(|_, t| (core::f64::consts::TAU * 37.0 * t).sin());
        let residuals = Residuals::new(&tone, &quality, &rig.rig);
        let peak = residuals.peak(Channel::Position).expect("a spectrum");
        assert!((peak.hz - 37.0).abs() < 1.0 && peak.nominal > 20.0, "{peak:?}");
        let white = residuals.spectrum(Channel::Position, Model::Extended).expect("a spectrum");
        let mean = white.power.iter().sum::<f64>() / white.power.len() as f64;
        assert!((mean - 1.0).abs() < 0.05 && peak.extended < 2.0, "{mean} {peak:?}");
    }

    #[test]
    fn an_interrupted_log_has_no_spectrum_across_its_gaps() {
        let rig = RigFile::paper_a();
        let (mut gaps, quality) = evidence(|_, _| 0.0);
        for k in 0..gaps.t_s.len() {
            gaps.t_s[k] += 0.5 * (k / 700) as f64;
        }
        assert_eq!(Residuals::new(&gaps, &quality, &rig.rig).peak(Channel::Position), None);
    }
}
