//! Open-loop inputs, chosen so that the piston stays clear of the end stops of all three of the paper's rigs.

use std::f64::consts::TAU;

/// A family of valve commands over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpenLoop {
    /// Sum of sines: continuous sliding with a few reversals.
    Smooth,
    /// A slow sine of small amplitude: the piston sticks at every reversal and breaks away again.
    StickSlip,
    /// Random-looking steps held for 50 ms: sliding, stopping, presliding oscillation.
    Steps,
}

impl OpenLoop {
    /// All families.
    pub const ALL: [Self; 3] = [Self::Smooth, Self::StickSlip, Self::Steps];

    /// The command in V at time `t` in s.
    #[must_use]
    pub fn command_v(self, t: f64) -> f64 {
        match self {
            Self::Smooth => 0.8 * (TAU * 1.0 * t).cos() + 0.4 * (TAU * 2.3 * t + 0.4).sin(),
            Self::StickSlip => 0.06 * (TAU * 1.1 * t).sin(),
            Self::Steps => {
                let slot = (t / 0.05).floor();
                // Golden-ratio sequence: evenly spread over -0.6 … 0.6 without a random number generator.
                1.2 * ((slot * 0.618_033_988_749_895).fract() - 0.5)
            }
        }
    }
}

/// The command at the start of each of `count` intervals of `dt` seconds.
#[must_use]
pub fn sampled(input: OpenLoop, count: usize, dt: f64) -> Vec<f64> {
    (0..count).map(|k| input.command_v((k as f64 + 1e-9) * dt)).collect()
}
