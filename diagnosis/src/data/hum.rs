//! Hum of the mains in a sensor: a line of the spectrum where neither piston nor valve has one. It is subtracted, because what it
//! adds to a reading is known from what stands before and after.

use core::f64::consts::TAU;
use rig_files::{Column, Log};
use std::borrow::Cow;

/// The mains of the world, Hz.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
/// How far a network strays, Hz.
const STRAYS_HZ: f64 = 0.5;
/// From where to where the spectrum is that it must stand out from, Hz: strokes that repeat have lines, too, one at each multiple of
/// their rate, so that others are beside them.
const AROUND_HZ: [f64; 2] = [0.7, 4.5];
/// What a line of the mains stands out by over the highest around it, in power: an order of magnitude.
const STANDS_OUT: f64 = 10.0;
/// The rows for each period that a line needs to be told from its alias.
const LEAST_ROWS: f64 = 2.5;
/// Sums over so long, s, stand for the rows: a whole number of periods of both mains.
const BLOCK_S: f64 = 0.1;
/// Amplitude and phase are those of so long, s, around: a network's frequency wanders within minutes.
const STEADY_S: f64 = 4.0;

/// Hum that was subtracted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hum {
    pub(crate) column: Column,
    pub(crate) hz: f64,
    /// Amplitude in the column's unit.
    pub(crate) amplitude: f64,
}

#[derive(Clone, Copy, Default)]
struct Complex {
    re: f64,
    im: f64,
}

impl Complex {
    fn add(&mut self, factor: f64, angle: f64) {
        self.re += factor * angle.cos();
        self.im += factor * angle.sin();
    }

    fn turned(self, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { re: self.re * cos - self.im * sin, im: self.re * sin + self.im * cos }
    }

    fn power(self) -> f64 {
        self.re * self.re + self.im * self.im
    }
}

/// The log without hum in its sensors.
pub(crate) fn subtracted<'a>(log: Cow<'a, Log>) -> (Cow<'a, Log>, Vec<Hum>) {
    let (mut cleaned, mut all) = (log, Vec::new());
    for column in [Column::Y, Column::PA, Column::PB, Column::PSup] {
        for mains_hz in MAINS_HZ {
            let found =
                cleaned.column(column).and_then(|values| line(&cleaned.t_s, values, cleaned.period_s(), mains_hz));
            if let Some((hz, amplitude, without)) = found {
                all.push(Hum { column, hz, amplitude });
                cleaned.to_mut().set(column, Some(without));
            }
        }
    }
    (cleaned, all)
}

/// A line near a frequency: its frequency, its mean amplitude, and the signal without it.
fn line(t_s: &[f64], values: &[f64], period_s: f64, mains_hz: f64) -> Option<(f64, f64, Vec<f64>)> {
    if period_s <= 0.0 || 1.0 / period_s < LEAST_ROWS * mains_hz {
        return None;
    }
    // What the signal is beside its mean over a period has no slow motion in it, and the hum whole.
    let half = ((0.5 / mains_hz / period_s).round() as usize).max(1);
    let width = 2 * half + 1;
    let fast: Vec<f64> = (0..values.len())
        .map(|k| match (k.checked_sub(half), values.get(k + half)) {
            (Some(from), Some(_)) => values[k] - values[from..=k + half].iter().sum::<f64>() / width as f64,
            _ => f64::NAN,
        })
        .collect();
    let begin_s = *t_s.first()?;
    let blocks = ((t_s.last()? - begin_s) / BLOCK_S) as usize;
    if (blocks as f64) * BLOCK_S < STEADY_S {
        return None;
    }
    let (mut sums, mut counts) = (vec![Complex::default(); blocks + 1], vec![0.0_f64; blocks + 1]);
    for (t, x) in t_s.iter().zip(&fast).filter(|(_, x)| x.is_finite()) {
        let block = ((t - begin_s) / BLOCK_S) as usize;
        sums[block].add(*x, -TAU * mains_hz * (t - begin_s));
        counts[block] += 1.0;
    }
    let usual = BLOCK_S / period_s;
    let sums: Vec<Complex> = sums.into_iter().map(|c| Complex { re: c.re / usual, im: c.im / usual }).collect();
    let centre_s = |block: usize| (block as f64 + 0.5) * BLOCK_S;
    let at = |off_hz: f64| {
        let mut total = Complex::default();
        for (block, sum) in sums.iter().enumerate() {
            let turned = sum.turned(-TAU * off_hz * centre_s(block));
            total = Complex { re: total.re + turned.re, im: total.im + turned.im };
        }
        total.power()
    };
    // Twice as fine as what the log's length resolves.
    let step_hz = 0.5 / (blocks as f64 * BLOCK_S);
    let steps = (AROUND_HZ[1] / step_hz) as i32;
    let powers: Vec<(f64, f64)> = (-steps..=steps).map(|k| f64::from(k) * step_hz).map(|hz| (at(hz), hz)).collect();
    let near = powers.iter().filter(|(_, off_hz)| off_hz.abs() <= STRAYS_HZ);
    let (highest, mut off_hz) = near.copied().max_by(|one, other| one.0.total_cmp(&other.0))?;
    let beside = powers.iter().filter(|(_, off_hz)| off_hz.abs() >= AROUND_HZ[0]).map(|(power, _)| *power);
    if highest <= STANDS_OUT * beside.fold(0.0, f64::max) {
        return None;
    }
    let mut reach = 0.5 * step_hz;
    for _ in 0..6 {
        off_hz = [off_hz - reach, off_hz, off_hz + reach]
            .into_iter()
            .max_by(|one, other| at(*one).total_cmp(&at(*other)))?;
        reach *= 0.5;
    }
    // A mean over a whole number of rows, not of periods, takes a little of the hum itself.
    let hz = mains_hz + off_hz;
    let half_turn = 0.5 * TAU * hz * period_s;
    let kept = 1.0 - (width as f64 * half_turn).sin() / (width as f64 * half_turn.sin());
    // Amplitude and phase around each block, weighted by a raised cosine.
    let side = (0.5 * STEADY_S / BLOCK_S) as usize;
    let local: Vec<Complex> = (0..sums.len())
        .map(|block| {
            let (mut total, mut weight) = (Complex::default(), 0.0);
            for other in block.saturating_sub(side)..(block + side + 1).min(sums.len()) {
                let off = (other as f64 - block as f64) / side as f64;
                let w = 0.5 * (1.0 + (0.5 * TAU * off).cos());
                let turned = sums[other].turned(-TAU * off_hz * centre_s(other));
                total = Complex { re: total.re + w * turned.re, im: total.im + w * turned.im };
                weight += w * counts[other] / usual;
            }
            let scale = if weight > 0.0 { 2.0 / (weight * kept) } else { 0.0 };
            Complex { re: total.re * scale, im: total.im * scale }
        })
        .collect();
    let without = t_s.iter().zip(values).map(|(t, x)| {
        let now_s = t - begin_s;
        let c = local[((now_s / BLOCK_S) as usize).min(local.len() - 1)];
        x - c.turned(TAU * hz * now_s).re
    });
    let amplitude = (local.iter().map(|c| c.power()).sum::<f64>() / local.len() as f64).sqrt();
    Some((hz, amplitude, without.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    /// A pressure in strokes, with noise of 400 Pa and hum.
    fn pressure(hum_pa: f64, hz: f64, interval_s: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
        let t_s: Vec<f64> = (0..(20.0 / interval_s) as usize).map(|k| k as f64 * interval_s).collect();
        let clean = |t: &f64| 4.0e5 + 1.0e5 * (1.5 * t).sin() + 4.0e4 * (((0.7 * t) % 1.0) * 30.0).min(1.0);
        let clean: Vec<f64> = t_s.iter().map(clean).map(|p| p + 400.0 * rng.sample::<f64, _>(StandardNormal)).collect();
        let noisy = t_s.iter().zip(&clean).map(|(t, p)| p + hum_pa * (TAU * hz * t + 0.4).sin()).collect();
        (t_s, clean, noisy)
    }

    #[test]
    fn hum_is_found_at_its_frequency_and_subtracted_and_strokes_have_none() {
        for (hum_pa, hz, interval_s) in
            [(800.0, 49.83, 1.0e-3), (2500.0, 60.2, 1.0e-3), (900.0, 50.0, 5.0e-3), (700.0, 50.1, 2.0e-4)]
        {
            let (t_s, clean, noisy) = pressure(hum_pa, hz, interval_s);
            let mains_hz = if hz < 55.0 { 50.0 } else { 60.0 };
            let (found_hz, amplitude, without) = line(&t_s, &noisy, interval_s, mains_hz).expect("hum");
            assert!(
                (found_hz - hz).abs() < 0.02 && (amplitude / hum_pa - 1.0).abs() < 0.1,
                "{hz}: {found_hz} {amplitude}"
            );
            let left = without.iter().zip(&clean).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / clean.len() as f64;
            // Strokes have a little at every frequency.
            assert!(left.sqrt() < 0.2 * hum_pa, "{hz}: {}", left.sqrt());
            for none in MAINS_HZ {
                assert!(line(&t_s, &clean, interval_s, none).is_none(), "{none} at {interval_s}");
            }
        }
        // Two rows a period hold only an alias.
        let (t_s, _, noisy) = pressure(2000.0, 50.0, 1.0e-2);
        assert!(line(&t_s, &noisy, 1.0e-2, 50.0).is_none());
    }
}
