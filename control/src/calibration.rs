//! What a channel's codes stand for: the range of its sensor, corrected by a two-point calibration.
//!
//! A reading of the range `[low, high]` is off by an offset and a gain, each channel's own:
//! `quantity = offset + gain · reading`, where `reading = low + code / highest code · (high − low)`. Both ends are moved
//! beforehand, so that the tick knows nothing of it.

use crate::config_error::ConfigError;
use crate::parameters::{Key, Parameters};
use parameter_table::Must;

/// What of the parameters belongs to one channel.
struct Channel {
    range: (Key, [f32; 2]),
    offset: f32,
    gain: (Key, f32),
}

impl Parameters {
    fn channels(&self) -> [Channel; 4] {
        let position = (Key::position_range_m, self.position_range_m);
        let pressure = (Key::pressure_range_pa, self.pressure_range_pa);
        let channel = |range, offset, key, gain| Channel { range, offset, gain: (key, gain) };
        [
            channel(position, self.position_offset_m, Key::position_gain, self.position_gain),
            channel(pressure, self.pressure_a_offset_pa, Key::pressure_a_gain, self.pressure_a_gain),
            channel(pressure, self.pressure_b_offset_pa, Key::pressure_b_gain, self.pressure_b_gain),
            channel(pressure, self.supply_offset_pa, Key::supply_gain, self.supply_gain),
        ]
    }

    /// The quantities at code 0 and at the highest code of position (m), p_a, p_b and p_sup (Pa absolute), as calibrated.
    #[must_use]
    pub fn calibrated_ranges(&self) -> [[f64; 2]; 4] {
        self.channels().map(|Channel { range: (_, ends), offset, gain: (_, gain) }| {
            ends.map(|end| f64::from(offset) + f64::from(gain) * f64::from(end))
        })
    }

    /// Checks that a calibration leaves every channel inside what its format holds.
    pub(crate) fn check_calibration(&self) -> Result<(), ConfigError> {
        for (channel, ends) in self.channels().iter().zip(self.calibrated_ranges()) {
            let limits = channel.range.0.row().limits;
            if ends.iter().any(|end| !limits.contains(*end as f32)) {
                return Err(ConfigError {
                    key: channel.gain.0.row().key,
                    value: channel.gain.1.into(),
                    must: Must::Be(
                        "leave, with its offset, both ends of the sensor's range inside what that range may be",
                    ),
                });
            }
        }
        Ok(())
    }
}
