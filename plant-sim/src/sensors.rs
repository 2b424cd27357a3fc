//! Truth → codes: sensor noise and the oversampling converter. The closed loop and the scenarios share it.
//!
//! The converter sums `oversampling` raw conversions of `raw_bits`; instead of drawing each, one normal deviate stands for
//! their mean: its variance is that of the sensor noise plus the raw quantisation's `LSB^2/12`, divided by the number of
//! conversions. That is exact as long as the noise spans a raw code, which is what oversampling relies on anyway.

use plant_model::Measurement;
use rig_files::{Converter, Io};
use serde::Deserialize;

/// Standard deviations of what the sensors and lines add to one raw conversion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConversionNoise {
    /// Position, m.
    pub position_m: f64,
    /// Pressures, Pa.
    pub pressure_pa: f64,
}

impl ConversionNoise {
    /// No noise at all; quantisation remains.
    pub const NONE: Self = Self { position_m: 0.0, pressure_pa: 0.0 };

    /// What is left of it in a code summed of `oversampling` raw conversions of `raw_bits`.
    #[must_use]
    pub fn of_code(&self, io: &Io, oversampling: u32, raw_bits: u32) -> CodeNoise {
        let left = |noise: f64, range: [f64; 2]| {
            // Without noise there is nothing to average: only the final code's rounding is left.
            if noise > 0.0 {
                let raw_lsb = Converter::new(range, raw_bits).resolution();
                ((noise * noise + raw_lsb * raw_lsb / 12.0) / f64::from(oversampling.max(1))).sqrt()
            } else {
                0.0
            }
        };
        CodeNoise {
            position_m: left(self.position_m, io.position_range_m),
            pressure_pa: left(self.pressure_pa, io.pressure_range_pa),
        }
    }
}

impl Default for ConversionNoise {
    /// A potentiometric rod over 1 m and a 10 bar sensor on a 12-bit converter: 0.05 mm and 600 Pa.
    fn default() -> Self {
        Self { position_m: 5.0e-5, pressure_pa: 600.0 }
    }
}

/// Standard deviations of the noise in a finished code, as the controller receives it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CodeNoise {
    /// Position, m.
    pub position_m: f64,
    /// Pressures, Pa.
    pub pressure_pa: f64,
}

impl CodeNoise {
    /// No noise at all; quantisation remains.
    pub const NONE: Self = Self { position_m: 0.0, pressure_pa: 0.0 };
}

impl Default for CodeNoise {
    /// 0.05 mm and 600 Pa: what the defaults of the plausibility checks and of the model monitor are made for.
    fn default() -> Self {
        Self { position_m: 5.0e-5, pressure_pa: 600.0 }
    }
}

/// One sensor with its converter.
#[derive(Clone, Copy, Debug)]
pub struct SensorChannel {
    converter: Converter,
    deviation: f64,
}

impl SensorChannel {
    /// The code of a quantity disturbed by `normal` standard deviations.
    #[inline]
    #[must_use]
    pub fn code(&self, quantity: f64, normal: f64) -> u16 {
        // Codes have 16 bits at most, see `Io::adc_bits`.
        self.converter.code(quantity + self.deviation * normal) as u16
    }

    /// The highest code.
    #[must_use]
    pub fn top_code(&self) -> u16 {
        self.converter.top_code() as u16
    }
}

/// The four sensors: position, pressures of A and B, supply pressure.
#[must_use]
pub fn channels(io: &Io, noise: &CodeNoise) -> [SensorChannel; 4] {
    let position = SensorChannel { converter: io.position(), deviation: noise.position_m };
    let pressure = SensorChannel { converter: io.pressure(), deviation: noise.pressure_pa };
    [position, pressure, pressure, pressure]
}

/// What the four sensors measure, in the order of [`channels`].
#[must_use]
pub fn quantities(truth: &Measurement<f64>) -> [f64; 4] {
    [truth.y_m, truth.p_a_pa, truth.p_b_pa, truth.p_sup_pa]
}
