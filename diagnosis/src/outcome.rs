//! The result of a diagnosis: the content of `diagnosis.json`.

use crate::constants;
use crate::data::channel::Channel;
use crate::data::quality::{Available, Quality};
use rig_files::{RigFile, Verdict};
use serde::{Serialize, Serializer};

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
    /// Identifiers of the effects that are tied with the cause.
    pub ties: Vec<String>,
    /// One sentence a technician understands.
    pub evidence: String,
    /// Share of the explained gap that returns when this cause alone is taken out, 0 to 1.
    pub share: f64,
}

/// How well an effect of the extended rig stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Standing {
    /// A named cause.
    Named,
    /// A named cause that this log cannot tell from others.
    Tied,
    /// Not proven, but the part held back is predicted better with it.
    WorkingHypothesis,
}

impl Standing {
    /// In words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Named => "named cause",
            Self::Tied => "named cause with ties",
            Self::WorkingHypothesis => "working hypothesis",
        }
    }
}

/// An effect that the extended rig has and the rig file has not.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Supported {
    /// Identifier of the effect catalogue.
    pub id: String,
    /// How well it stands.
    pub standing: Standing,
    /// Its parameters.
    pub parameters: Vec<Estimate>,
    /// Share of the misfit of the balances it acts on that it takes away on the part held back, everything else as it is;
    /// `null` where nothing was held back.
    pub gain: Option<f64>,
}

/// The key of the table of the opening.
pub(crate) const OPENING: &str = "valve.opening";

/// A nominal value, corrected within a few of its stated tolerances.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// Full rig key, e.g. `valve.fill_coefficient_kg_per_s_pa`; `p_sup_pa` for the mean of the supply as measured;
    /// `valve.opening[K]` for the opening of point K of the table, counted from 0.
    pub name: String,
    /// Value of the rig file; of the log, for a column.
    pub nominal: f64,
    /// Corrected value.
    pub value: f64,
    /// Standard error of the corrected value.
    pub std_error: f64,
    /// Stated standard error of the rig file's value, in its unit.
    pub tolerance: f64,
}

impl Calibration {
    /// Whether it is a point of the table of the opening, of which there are many.
    #[must_use]
    pub fn is_opening_point(&self) -> bool {
        self.name.starts_with(OPENING)
    }

    /// The correction relative to the nominal value; `None` where that is zero.
    #[must_use]
    pub fn relative(&self) -> Option<f64> {
        (self.nominal != 0.0).then(|| self.value / self.nominal - 1.0)
    }

    /// The correction in stated tolerances.
    #[must_use]
    pub fn tolerances(&self) -> f64 {
        (self.value - self.nominal).abs() / self.tolerance.max(f64::MIN_POSITIVE)
    }

    /// Whether the correction is too large to be likely by its tolerance.
    #[must_use]
    pub fn is_strained(&self) -> bool {
        self.tolerances() > constants::strained()
    }
}

/// Misfit of one balance, before and after, and on what its errors depend.
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
    /// The dependence of its errors on each quantity, strongest first.
    pub depends_on: Vec<Dependence>,
    /// The frequency at which the nominal rig errs most; `null` where the log is too broken for a spectrum.
    pub peak: Option<Peak>,
}

impl Balance {
    /// Whether it is closed although it errs longer than noise: a measured supply that varies by itself.
    #[must_use]
    pub fn varies_by_itself(&self) -> bool {
        self.channel == Channel::Supply
            && self.closed
            && self.remaining_dispersion >= constants::closed_dispersion_mass()
    }
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
    /// The noise floor: the error that a perfect model would have, given the sensors' noise.
    pub noise_floor: PerChannel,
}

/// The gain of the extended model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Gain {
    /// On held-back data.
    pub holdout: HoldOut,
    /// Prediction horizon, s.
    pub horizon_s: f64,
    /// Error of the extended rig over the noise floor, in the channel where it is largest, without the worst twentieth of the
    /// predictions: whether a piston sticks or slips in one of them is chance. 0 where nothing was measured.
    pub worst_ratio: f64,
}

impl Gain {
    /// Whether the extended rig predicts about as well as noise allows.
    #[must_use]
    pub fn closed(&self) -> bool {
        self.worst_ratio < constants::closed_hold_out()
    }
}

/// How much of a balance's error depends on one quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dependence {
    /// See [`Quantity::id`](crate::Quantity::id); `v_even` and `v_odd` are the parts of the dependence on velocity that are alike and
    /// opposite in the two directions of motion.
    pub quantity: &'static str,
    /// Share of the variance of the nominal rig's errors, 0 to 1.
    pub nominal: f64,
    /// The same for the extended rig.
    pub extended: f64,
}

/// Where in frequency the nominal rig errs most.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Peak {
    /// Frequency, Hz.
    pub hz: f64,
    /// Power density of the nominal rig's errors there, over that of the sensor's noise.
    pub nominal: f64,
    /// The same for the extended rig.
    pub extended: f64,
}

/// What a balance lacks, in closed form.
#[derive(Clone, Debug, Serialize)]
pub struct Description {
    /// The terms, in the order found: largest gain first.
    pub terms: Vec<MissingTerm>,
    /// Share of the misfit of the balances they act on that they take away on the part of the log held back; negative
    /// where they make it worse.
    pub holdout_share: f64,
}

/// A term found to be missing.
#[derive(Clone, Debug, Serialize)]
pub struct MissingTerm {
    /// The channels whose balance lacks it.
    pub channels: Vec<Channel>,
    /// Its physical meaning, in words.
    pub words: &'static str,
    /// The closed form, with `c` for the factor.
    pub formula: String,
    /// The factor.
    pub factor: f64,
    /// Standard error of the factor.
    pub std_error: f64,
}

/// Predictions and measurement on the part held back, for pictures.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Time, s.
    pub t_s: Vec<f64>,
    /// Measured position, m, and pressures, Pa.
    pub measured: [Vec<f64>; 3],
    /// Predicted by the nominal rig; NaN at restarts.
    pub baseline: [Vec<f64>; 3],
    /// Predicted by the extended rig.
    pub extended: [Vec<f64>; 3],
}

fn as_word<S: Serializer>(verdict: &Verdict, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(verdict.word())
}

/// A hypothesis that was tried.
#[derive(Clone, Debug, Serialize)]
pub struct Hypothesised {
    /// Identifiers of its effects.
    pub effects: Vec<&'static str>,
    /// Minus log-likelihood.
    pub cost: f64,
    /// Whether it was fitted in full; else its cost is predicted to first order.
    pub fitted: bool,
}

/// The result of a diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The verdict.
    #[serde(serialize_with = "as_word")]
    pub verdict: Verdict,
    /// Causes, by how much of the gap each explains.
    pub causes: Vec<Cause>,
    /// All effects that the extended rig has and the rig file has not, named or not.
    pub extension: Vec<Supported>,
    /// Nominal values corrected within tolerance.
    pub calibration: Vec<Calibration>,
    /// Gain on the part held back; `null` where the log does not allow full predictions.
    pub gain: Option<Gain>,
    /// The same for a shorter and a longer horizon, where the part held back has room for them.
    pub horizons: Vec<Gain>,
    /// Rig keys and effects this log says nothing about.
    pub not_identifiable: Vec<String>,
    /// What to record next.
    pub next_experiment: Option<String>,
    /// Leads: effects that lower the misfit but are not proven.
    pub leads: Vec<Cause>,
    /// What the open balances lack, in closed form, where a few terms outside the catalogue describe it.
    pub description: Option<Description>,
    /// The balances.
    pub balances: Vec<Balance>,
    /// What the log holds and how good it is.
    pub log: LogSummary,
    /// All hypotheses tried, best first.
    pub hypotheses: Vec<Hypothesised>,
    /// The rig with its nominal values corrected and the effects of `extension` added.
    #[serde(skip)]
    pub extended_rig: RigFile,
    /// Material for pictures.
    #[serde(skip)]
    pub evidence: Evidence,
}

/// What the log holds.
#[derive(Clone, Debug, Serialize)]
pub struct LogSummary {
    /// Columns measured.
    pub available: Available,
    /// Sampling and noise.
    pub quality: Quality,
    /// How much of it was held back to confirm what was found, s; 0 for a log too short.
    pub held_back_s: f64,
}

/// Signals for pictures: innovations of nominal and extended model, and the quantities they may depend on.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Time, s, of every sample used for fitting.
    pub t_s: Vec<f64>,
    /// Command, V (empty if not measured).
    pub u_v: Vec<f64>,
    /// Position, m.
    pub y_m: Vec<f64>,
    /// Velocity, m/s.
    pub v_m_per_s: Vec<f64>,
    /// Pressure of A, Pa (empty if not measured).
    pub p_a_pa: Vec<f64>,
    /// Pressure of B, Pa (empty if not measured).
    pub p_b_pa: Vec<f64>,
    /// Errors of the nominal rig in units of noise: p_a, p_b, y, p_sup; NaN where a prediction is not settled.
    pub nominal: [Vec<f64>; 4],
    /// The same for the extended rig.
    pub extended: [Vec<f64>; 4],
    /// Predictions on the part held back.
    pub overlay: Overlay,
}
