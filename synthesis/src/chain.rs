//! The measurement chain: noise, converters, irregular sampling, lost samples and columns that were never recorded.

use rand::RngExt;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rig_files::{Column, Converter};

/// How the log is recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Standard deviation of pressure noise, Pa.
    pub pressure_noise_pa: f64,
    /// Standard deviation of position noise, m.
    pub position_noise_m: f64,
    /// Range and bits of the pressure converters.
    pub pressure: ([f64; 2], u32),
    /// Range and bits of the position converter.
    pub position: ([f64; 2], u32),
    /// Nominal period of the controller, s.
    pub period_s: f64,
    /// Of so many periods the logger keeps one row.
    pub logged_every: usize,
    /// The logged position goes no higher than the value below which this part of its readings lie.
    pub clipped_above: Option<f64>,
    /// Standard deviation of the sampling period, relative; the times recorded are the true ones.
    pub jitter: f64,
    /// Lost stretches per second, each a few to some dozen rows.
    pub lost_rows_per_s: f64,
    /// Blank stretches per second and column.
    pub blanks_per_s: f64,
    /// The log begins this long after the experiment, s: in the middle of things.
    pub begins_s: f64,
    /// Columns that are recorded, besides the position.
    pub columns: Vec<Column>,
}

impl Chain {
    /// 12-bit pressures over 10 bar with 600 Pa of noise, position with 0.05 mm of noise over `range` with 16 bits, 1 kHz.
    #[must_use]
    pub fn standard(position_range_m: [f64; 2]) -> Self {
        Self {
            pressure_noise_pa: 600.0,
            position_noise_m: 0.05e-3,
            pressure: ([0.0, 1.0e6], 12),
            position: (position_range_m, 16),
            period_s: 1e-3,
            logged_every: 1,
            clipped_above: None,
            jitter: 0.0,
            lost_rows_per_s: 0.0,
            blanks_per_s: 0.0,
            begins_s: 0.0,
            columns: vec![Column::U, Column::PA, Column::PB, Column::YRef],
        }
    }

    /// Neither noise nor quantisation.
    #[must_use]
    pub fn ideal() -> Self {
        let mut chain = Self::standard([-1.0, 1.0]);
        (chain.pressure_noise_pa, chain.position_noise_m) = (0.0, 0.0);
        (chain.pressure.1, chain.position.1) = (0, 0);
        chain
    }

    /// Whether a column is recorded.
    #[must_use]
    pub fn records(&self, column: Column) -> bool {
        column == Column::Y || self.columns.contains(&column)
    }
}

/// Noise and converters of one channel; `bits` of zero means none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Channel {
    noise: f64,
    converter: Option<Converter>,
}

impl Channel {
    pub(crate) fn new(noise: f64, (range, bits): ([f64; 2], u32)) -> Self {
        Self { noise, converter: (bits > 0).then(|| Converter::new(range, bits)) }
    }

    pub(crate) fn sample(&self, value: f64, rng: &mut Xoshiro256PlusPlus) -> f64 {
        let normal: f64 = StandardNormal.sample(rng);
        let noisy = value + self.noise * normal;
        self.converter.map_or(noisy, |converter| converter.quantity(converter.code(noisy)))
    }
}

/// Stretches of rows, drawn as a Poisson process with lengths from 3 to 60 rows.
pub(crate) fn stretches(rows: usize, period_s: f64, per_s: f64, rng: &mut Xoshiro256PlusPlus) -> Vec<bool> {
    let mut hit = vec![false; rows];
    if per_s <= 0.0 {
        return hit;
    }
    let mut row = 0.0;
    loop {
        let uniform: f64 = rng.random();
        row += -(1.0 - uniform).ln() / (per_s * period_s);
        let start = row as usize;
        if start >= rows {
            return hit;
        }
        let length = rng.random_range(3..=60_usize);
        hit[start..(start + length).min(rows)].fill(true);
        row += length as f64;
    }
}
