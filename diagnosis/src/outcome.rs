//! What a diagnosis says: the content of `diagnosis.json`.

use crate::balance::Channel;
use crate::hypothesis::STRAINED;
use crate::residual::{Dependence, Peak};
use serde::Serialize;

/// A fitted value with its standard error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Parameter key, unit included.
    pub name: String,
    /// Fitted value, SI.
    pub value: f64,
    /// Standard error of the value, SI.
    pub std_error: f64,
}

/// A named cause of the gap.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    /// Identifier of the effect catalogue.
    pub id: String,
    /// Its parameters.
    pub parameters: Vec<Estimate>,
    /// Identifiers this log cannot tell from the cause.
    pub ties: Vec<String>,
    /// One sentence a technician understands.
    pub evidence: String,
    /// Share of the explained gap that returns when this cause alone is taken out, 0 to 1.
    pub share: f64,
}

/// A nominal value corrected as far as its stated tolerance makes likely: within a few times that.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// Full rig key, e.g. `valve.fill_coefficient_kg_per_s_pa`.
    pub name: String,
    /// Value of the rig file.
    pub nominal: f64,
    /// Corrected value.
    pub value: f64,
    /// Standard error of the corrected value.
    pub std_error: f64,
    /// Stated standard error of the rig file's value, in its unit.
    pub tolerance: f64,
}

impl Calibration {
    /// How many times its stated tolerance the value was moved by.
    #[must_use]
    pub fn tolerances(&self) -> f64 {
        (self.value - self.nominal).abs() / self.tolerance.max(f64::MIN_POSITIVE)
    }

    /// Whether it was moved farther than its tolerance makes likely.
    #[must_use]
    pub fn is_strained(&self) -> bool {
        self.tolerances() > STRAINED
    }
}

/// How one balance stands after all.
#[derive(Clone, Debug, Serialize)]
pub struct Balance {
    /// `p_a_pa`, `p_b_pa`, `y_m` or `p_sup_pa`: the channel it predicts.
    pub channel: Channel,
    /// Misfit of the nominal rig over that of white noise; 1 is perfect.
    pub nominal_misfit: f64,
    /// The same with the causes found.
    pub extended_misfit: f64,
    /// Long-run variance of the remaining errors over that of white noise; 1 is white.
    pub remaining_dispersion: f64,
    /// Whether nothing beyond noise remains.
    pub closed: bool,
    /// Where its errors live: how much of them depends on what, most first.
    pub depends_on: Vec<Dependence>,
    /// The frequency at which the nominal rig errs most; `null` where the log is too broken for a spectrum.
    pub peak: Option<Peak>,
}

/// One figure per predicted channel; `null` where the channel was not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PerChannel {
    /// Position, m.
    pub y_m: Option<f64>,
    /// Pressure of A, Pa.
    pub p_a_pa: Option<f64>,
    /// Pressure of B, Pa.
    pub p_b_pa: Option<f64>,
}

impl PerChannel {
    /// Each figure over another's, where both were measured.
    pub(crate) fn over(&self, other: &Self) -> impl Iterator<Item = f64> {
        let pairs = [(self.y_m, other.y_m), (self.p_a_pa, other.p_a_pa), (self.p_b_pa, other.p_b_pa)];
        pairs.into_iter().filter_map(|(one, other)| Some(one? / other?))
    }
}

/// Prediction errors on the part of the log held back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HoldOut {
    /// Nominal rig.
    pub baseline_rmse: PerChannel,
    /// Extended rig.
    pub extended_rmse: PerChannel,
    /// What a perfect model would show, given the sensors' noise.
    pub noise_floor: PerChannel,
}

/// The whole model predicts the part held back as well as it can while its errors are no more than this many times what
/// noise alone makes: beside a right extended rig they were at most 1.5 times that, where the piston sticks and slips.
const CLOSED: f64 = 1.75;

impl HoldOut {
    /// Whether the extended rig predicts about as well as noise allows.
    #[must_use]
    pub fn closed(&self) -> bool {
        self.worst_ratio() < CLOSED
    }

    /// Error of the extended rig over the noise floor, in the channel where it is largest; 0 where nothing was measured.
    #[must_use]
    pub fn worst_ratio(&self) -> f64 {
        self.extended_rmse.over(&self.noise_floor).fold(0.0, f64::max)
    }
}

/// The gain of the extended model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Gain {
    /// On held-back data.
    pub holdout: HoldOut,
    /// Prediction horizon, s.
    pub horizon_s: f64,
}
