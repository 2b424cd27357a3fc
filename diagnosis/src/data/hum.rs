//! Hum of the mains in a sensor: a line of the spectrum where neither piston nor valve has one. It is subtracted, because what it
//! adds to a reading is known from what stands before and after.

use crate::statistics::median;
use core::f64::consts::TAU;
use rig_files::{Column, Log};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
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
/// Over so many blocks, a minute, the network keeps its frequency: powers of longer logs are the sums of those of such pieces.
const PIECE_BLOCKS: usize = 600;

/// Hum that was subtracted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hum {
    pub(crate) column: Column,
    pub(crate) hz: f64,
    /// Amplitude in the column's unit.
    pub(crate) amplitude: f64,
}

/// The rows of [`BLOCK_S`].
struct Block {
    /// Its number since the log began; where the log has a gap, blocks are missing.
    place: usize,
    /// Its rows times a turning pointer of the mains' frequency, over the number of rows that it should have.
    sum: Complex<f64>,
    /// Rows counted in that sum, over the number that it should have.
    part: f64,
    /// Its squares, summed over as much.
    squares: f64,
}

impl Block {
    fn centre_s(&self) -> f64 {
        (self.place as f64 + 0.5) * BLOCK_S
    }

    /// The sum less the turns that a line beside the mains' frequency has made since the log began.
    fn turned_back(&self, off_hz: f64) -> Complex<f64> {
        self.sum * Complex::cis(-TAU * off_hz * self.centre_s())
    }
}

/// The blocks of a signal without slow motion.
fn blocks(t_s: &[f64], fast: &[f64], period_s: f64, mains_hz: f64) -> Vec<Block> {
    let (begin_s, usual) = (t_s.first().copied().unwrap_or_default(), BLOCK_S / period_s);
    let mut out: Vec<Block> = Vec::new();
    for (t, x) in t_s.iter().zip(fast) {
        let place = ((t - begin_s) / BLOCK_S) as usize;
        if out.last().is_none_or(|last| last.place < place) {
            out.push(Block { place, sum: Complex::ZERO, part: 0.0, squares: 0.0 });
        }
        if let Some(block) = out.last_mut().filter(|_| x.is_finite()) {
            block.sum += Complex::from_polar(x / usual, -TAU * mains_hz * (t - begin_s));
            block.part += 1.0 / usual;
            block.squares += x * x / usual;
        }
    }
    out
}

/// Blocks in pieces of [`PIECE_BLOCKS`].
fn pieces(blocks: &[Block]) -> Vec<&[Block]> {
    let (mut out, mut rest) = (Vec::new(), blocks);
    while let Some(first) = rest.first() {
        let (piece, behind) = rest.split_at(rest.partition_point(|block| block.place < first.place + PIECE_BLOCKS));
        out.push(piece);
        rest = behind;
    }
    out
}

/// The blocks of the longest piece, missing ones included.
fn longest(pieces: &[&[Block]]) -> usize {
    let span = |piece: &&[Block]| piece.last().map_or(0, |last| last.place - piece[0].place + 1);
    pieces.iter().map(span).max().unwrap_or(0)
}

/// Powers beside the mains' frequency, each with its distance from it, Hz: in steps twice as fine as what a piece resolves.
fn powers(pieces: &[&[Block]]) -> Vec<(f64, f64)> {
    let length = 2 * longest(pieces);
    let transform = FftPlanner::new().plan_fft_forward(length);
    let mut sums = vec![0.0; length];
    for piece in pieces {
        let mut bins = vec![Complex::ZERO; length];
        piece.iter().for_each(|block| bins[block.place - piece[0].place] = block.sum);
        transform.process(&mut bins);
        sums.iter_mut().zip(bins).for_each(|(sum, bin)| *sum += bin.norm_sqr());
    }
    let step_hz = 1.0 / (length as f64 * BLOCK_S);
    let steps = (AROUND_HZ[1] / step_hz) as usize;
    // Behind the middle stand the frequencies below the mains'.
    let below = (1..=steps).map(|k| (sums[length - k], -(k as f64) * step_hz));
    below.chain((0..=steps).map(|k| (sums[k], k as f64 * step_hz))).collect()
}

/// Amplitude and phase of a line beside the mains' frequency around each block, weighted by a raised cosine over [`STEADY_S`] and by
/// `weights`, one for each block. As much of it as a mean over rows has left.
fn around(blocks: &[Block], off_hz: f64, weights: &[f64]) -> Vec<Complex<f64>> {
    let side = (0.5 * STEADY_S / BLOCK_S) as usize;
    let at = |block: &Block| {
        let from = blocks.partition_point(|other| other.place + side < block.place);
        let near = blocks[from..].iter().zip(&weights[from..]);
        let (mut total, mut weight) = (Complex::ZERO, 0.0);
        for (other, own) in near.take_while(|(other, _)| other.place <= block.place + side) {
            let off = (other.place as f64 - block.place as f64) / side as f64;
            let w = own * 0.5 * (1.0 + (0.5 * TAU * off).cos());
            total += w * other.turned_back(off_hz);
            weight += w * other.part;
        }
        if weight > 0.0 { 2.0 * total / weight } else { Complex::ZERO }
    };
    blocks.iter().map(at).collect()
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
    let blocks = blocks(t_s, &fast, period_s, mains_hz);
    if blocks.len() as f64 * BLOCK_S < STEADY_S {
        return None;
    }
    let pieces = pieces(&blocks);
    let powers = powers(&pieces);
    let near = powers.iter().filter(|(_, off_hz)| off_hz.abs() <= STRAYS_HZ);
    let (highest, mut off_hz) = near.copied().max_by(|one, other| one.0.total_cmp(&other.0))?;
    let beside = powers.iter().filter(|(_, off_hz)| off_hz.abs() >= AROUND_HZ[0]).map(|(power, _)| *power);
    if highest <= STANDS_OUT * beside.fold(0.0, f64::max) {
        return None;
    }
    let power = |off_hz: f64| {
        let of =
            |piece: &&[Block]| piece.iter().map(|block| block.turned_back(off_hz)).sum::<Complex<f64>>().norm_sqr();
        pieces.iter().map(of).sum::<f64>()
    };
    // From half a step of the powers on.
    let mut reach = 0.25 / (longest(&pieces) as f64 * BLOCK_S);
    for _ in 0..6 {
        off_hz = [off_hz - reach, off_hz, off_hz + reach]
            .into_iter()
            .max_by(|one, other| power(*one).total_cmp(&power(*other)))?;
        reach *= 0.5;
    }
    // A mean over a whole number of rows, not of periods, takes a little of the hum itself.
    let hz = mains_hz + off_hz;
    let half_turn = 0.5 * TAU * hz * period_s;
    let kept = 1.0 - (width as f64 * half_turn).sin() / (width as f64 * half_turn.sin());
    // Strokes have a little at every frequency: blocks in which more than hum and noise is left count less.
    let all = vec![1.0; blocks.len()];
    let first = around(&blocks, off_hz, &all);
    let left: Vec<f64> = (blocks.iter().zip(&first))
        .map(|(block, hum)| {
            (block.squares - 0.5 * hum.norm_sqr() * block.part).max(0.0) / block.part.max(f64::MIN_POSITIVE)
        })
        .collect();
    let usual = median(&mut left.clone()).unwrap_or_default().max(f64::MIN_POSITIVE);
    let weights: Vec<f64> = left.iter().map(|left| usual / (usual + left)).collect();
    let local: Vec<Complex<f64>> = around(&blocks, off_hz, &weights).into_iter().map(|hum| hum / kept).collect();
    let mut here = 0;
    let without = t_s.iter().zip(values).map(|(t, x)| {
        let now_s = t - begin_s;
        while blocks.get(here + 1).is_some_and(|next| next.place <= (now_s / BLOCK_S) as usize) {
            here += 1;
        }
        x - (local[here] * Complex::cis(TAU * hz * now_s)).re
    });
    let without = without.collect();
    let amplitude = (local.iter().map(Complex::norm_sqr).sum::<f64>() / local.len() as f64).sqrt();
    Some((hz, amplitude, without))
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
            assert!(left.sqrt() < 0.1 * hum_pa, "{hz}: {}", left.sqrt());
            for none in MAINS_HZ {
                assert!(line(&t_s, &clean, interval_s, none).is_none(), "{none} at {interval_s}");
            }
        }
        // A clock that was set during the log leaves a gap of half a century; a log of three minutes has several pieces.
        for (later_s, length_s) in [(1.7e9, 20.0), (0.0, 180.0)] {
            let t_s: Vec<f64> = (0..(length_s / 2.0e-3) as usize).map(|k| 2.0e-3 * k as f64).collect();
            let hum = |t: &f64| 4.0e5 + 1.0e5 * (1.5 * t).sin() + 900.0 * (TAU * 50.13 * t).sin();
            let noisy: Vec<f64> = t_s.iter().map(hum).collect();
            let late = |t: &f64| if *t < 10.0 { *t } else { t + later_s };
            let set: Vec<f64> = t_s.iter().map(late).collect();
            let (found_hz, amplitude, _) = line(&set, &noisy, 2.0e-3, 50.0).expect("hum");
            assert!((found_hz - 50.13).abs() < 0.02 && (amplitude / 900.0 - 1.0).abs() < 0.1, "{found_hz} {amplitude}");
        }
        // Two rows a period hold only an alias.
        let (t_s, _, noisy) = pressure(2000.0, 50.0, 1.0e-2);
        assert!(line(&t_s, &noisy, 1.0e-2, 50.0).is_none());
    }
}
