//! What the controller's converters see: ranges, bits and the tick.

/// The `[io]` table of the rig file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Io {
    /// Position at the lowest and the highest code, m.
    pub position_range_m: [f64; 2],
    /// Pressure at the lowest and the highest code, Pa absolute; the same for all three pressure channels.
    pub pressure_range_pa: [f64; 2],
    /// Bits of the code the control loop receives per channel, hardware oversampling included; 1 to 16.
    pub adc_bits: u32,
    /// Valve command at the lowest and the highest DAC code, V about mid position.
    pub valve_range_v: [f64; 2],
    /// Bits of the DAC; 1 to 16.
    pub dac_bits: u32,
    /// Control ticks per second; 1 to 100 000.
    pub tick_hz: u32,
}

impl Default for Io {
    fn default() -> Self {
        let p = control::Parameters::default();
        Self {
            position_range_m: p.position_range_m.map(f64::from),
            pressure_range_pa: p.pressure_range_pa.map(f64::from),
            adc_bits: p.adc_bits.into(),
            valve_range_v: p.valve_range_v.map(f64::from),
            dac_bits: p.dac_bits.into(),
            tick_hz: p.tick_hz,
        }
    }
}

impl Io {
    /// Whether a pressure in Pa absolute is what a sensor reads at the upper end of its range, to half a code.
    #[must_use]
    pub fn is_pressure_end(&self, reading_pa: f64) -> bool {
        let [low, high] = self.pressure_range_pa;
        (reading_pa - high).abs() <= 0.5 * (high - low) / f64::from(self.adc_bits).exp2()
    }

    /// The position channel.
    #[must_use]
    pub fn position(&self) -> Converter {
        Converter::new(self.position_range_m, self.adc_bits)
    }
    /// Any of the pressure channels.
    #[must_use]
    pub fn pressure(&self) -> Converter {
        Converter::new(self.pressure_range_pa, self.adc_bits)
    }
    /// The valve channel.
    #[must_use]
    pub fn valve(&self) -> Converter {
        Converter::new(self.valve_range_v, self.dac_bits)
    }
    /// Duration of a tick, s.
    #[must_use]
    pub fn tick_s(&self) -> f64 {
        1.0 / f64::from(self.tick_hz)
    }
}

/// A linear converter, ends included: `code = round((x - lo) / (hi - lo) * (2^bits - 1))`, clamped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converter {
    low: f64,
    per_code: f64,
    codes_per_unit: f64,
    top: f64,
}

impl Converter {
    /// The converter of a range; `bits` from 1 to 32.
    #[must_use]
    pub fn new([low, high]: [f64; 2], bits: u32) -> Self {
        let top = f64::from(u32::MAX >> (32 - bits.clamp(1, 32)));
        Self { low, per_code: (high - low) / top, codes_per_unit: top / (high - low), top }
    }

    /// The code of a quantity; NaN gives the lowest code.
    #[inline]
    #[must_use]
    pub fn code(&self, quantity: f64) -> u32 {
        // Adding a half and truncating is rounding for what is never negative; `as` saturates and maps NaN to zero.
        (((quantity - self.low) * self.codes_per_unit).clamp(0.0, self.top) + 0.5) as u32
    }

    /// The quantity a code stands for; codes above the top one stand for the top of the range.
    #[inline]
    #[must_use]
    pub fn quantity(&self, code: u32) -> f64 {
        self.low + f64::from(code).min(self.top) * self.per_code
    }

    /// The highest code, `2^bits - 1`.
    #[must_use]
    pub fn top_code(&self) -> u32 {
        self.top as u32
    }

    /// The quantity between two neighbouring codes.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        self.per_code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_linear_over_the_range_with_both_ends_included() {
        let position = Io::default().position();
        assert_eq!((position.code(-0.5), position.code(0.5)), (0, 65535));
        assert_eq!((position.code(-2.0), position.code(2.0)), (0, 65535));
        assert_eq!(position.code(f64::NAN), 0);
        for code in [0, 1, 4095, 32767, 65535] {
            assert_eq!(position.code(position.quantity(code)), code);
        }
        let valve = Io::default().valve();
        assert_eq!((valve.code(-5.0), valve.code(0.0), valve.code(5.0)), (0, 2048, 4095));
    }
}
