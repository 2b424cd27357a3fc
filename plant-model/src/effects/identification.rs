//! What the identification of an effect from a log has to know, as data. The method is the diagnosis' business.

use super::effect::{Effect, MAX_PARAMETERS};
use crate::rig::Rig;

/// A balance predicts one measured signal from the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Balance {
    /// Air in chamber A: predicts its pressure.
    MassA,
    /// Air in chamber B: predicts its pressure.
    MassB,
    /// Force on the piston: predicts the position.
    Force,
    /// The air source: predicts the supply pressure.
    Supply,
}

/// A set of balances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Balances(u8);

impl Balances {
    /// The air balance of chamber A.
    pub const MASS_A: Self = Self(1 << Balance::MassA as u8);
    /// The air balance of chamber B.
    pub const MASS_B: Self = Self(1 << Balance::MassB as u8);
    /// The air balances of both chambers: valve and gas.
    pub const MASS: Self = Self::MASS_A.and(Self::MASS_B);
    /// The force balance: mechanics.
    pub const FORCE: Self = Self(1 << Balance::Force as u8);
    /// The air source.
    pub const SUPPLY: Self = Self(1 << Balance::Supply as u8);

    /// The union of two sets.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// One bit for each balance, in the order of [`Balance`].
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether a balance is in the set.
    #[must_use]
    pub const fn contains(self, balance: Balance) -> bool {
        self.0 & (1 << balance as u8) != 0
    }
}

/// What must be measured beside the signals that its balances predict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Nothing.
    Nothing,
    /// A pressure, because a position can only disagree with one.
    AnyPressure,
    /// The pressures of both chambers.
    BothPressures,
}

/// The values of the rig file that an effect stands in for: a log shows only what both make together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandsFor {
    /// None.
    Nothing,
    /// Its first parameter is a factor on whichever of these values the rig has: only the product shows.
    FactorOn(&'static [&'static str]),
    /// Its parameters are these values, in this order.
    ValuesOf(&'static [&'static str]),
    /// Its first parameter, not negative, is added to each of these values.
    AddedTo(&'static [&'static str]),
}

impl StandsFor {
    /// The keys, as paths in the rig file.
    #[must_use]
    pub const fn keys(&self) -> &[&'static str] {
        match self {
            Self::Nothing => &[],
            Self::ValuesOf(keys) | Self::FactorOn(keys) | Self::AddedTo(keys) => keys,
        }
    }

    /// The place of the parameter that stands in for a key; `None` if none does.
    #[must_use]
    pub fn parameter_of(&self, key: &str) -> Option<usize> {
        let place = self.keys().iter().position(|own| *own == key)?;
        Some(if matches!(self, Self::ValuesOf(_)) { place } else { 0 })
    }

    /// Whether each of its parameters stands in for a single value of a rig, and not for several at once.
    #[must_use]
    pub const fn is_single(&self) -> bool {
        !matches!(self, Self::AddedTo(_))
    }

    /// The parameter once it has taken over the correction of one of the keys from `nominal` to `value`.
    #[must_use]
    pub fn take_over(&self, parameter: f64, value: f64, nominal: f64) -> f64 {
        match self {
            Self::Nothing => parameter,
            Self::FactorOn(_) => parameter * (value / nominal),
            Self::ValuesOf(_) => parameter + (value - nominal),
            Self::AddedTo(keys) => (parameter + (value - nominal) / keys.len() as f64).max(0.0),
        }
    }

    /// The value of a key once the effect with this parameter is gone.
    #[must_use]
    pub fn give_back(&self, parameter: f64, nominal: f64) -> f64 {
        match self {
            Self::Nothing => nominal,
            Self::FactorOn(_) => nominal * parameter,
            Self::ValuesOf(_) => parameter,
            Self::AddedTo(_) => nominal + parameter,
        }
    }

    /// The keys whose relative tolerance the parameter inherits, because only their product shows: a rig has one of them.
    #[must_use]
    pub const fn inherits_tolerance_of(&self) -> &[&'static str] {
        match self {
            Self::FactorOn(keys) => keys,
            _ => &[],
        }
    }
}

/// Two effects that do nearly the same. Stated in the file of one of the two, found from either.
#[derive(Clone, Copy, Debug)]
pub struct Confusion {
    /// The other effect.
    pub with: Effect,
    /// How alike they are.
    pub kind: Likeness,
    /// The recording that tells them apart; `None`: the recommended experiment.
    pub experiment: Option<&'static str>,
}

/// How alike two effects are.
#[derive(Clone, Copy, Debug)]
pub enum Likeness {
    /// Different equations that many logs do not tell apart.
    Near,
    /// The same forces or flows under another name: no log of these sensors tells them apart.
    Structural,
    /// One does nearly the same as the other at a value that can be computed.
    Image(Image),
}

/// How a value of one effect becomes a value of another that does nearly the same.
#[derive(Clone, Copy, Debug)]
pub struct Image {
    /// The effect that makes the two alike; `None`: they always are.
    pub beside: Option<Effect>,
    /// From the effect whose file states it to the other.
    pub forward: fn(&ImageContext<'_>) -> Option<Imaged>,
    /// The way back.
    pub backward: fn(&ImageContext<'_>) -> Option<Imaged>,
}

/// What an image is computed from.
#[derive(Clone, Copy, Debug)]
pub struct ImageContext<'a> {
    /// The rig as stated.
    pub rig: &'a Rig<f64>,
    /// Distance of the first parameter from neutral.
    pub away: f64,
    /// Neutral value of the first parameter.
    pub neutral: f64,
    /// Neutral value of the image's first parameter.
    pub image_neutral: f64,
    /// Mean of the sum of both gauge pressures in the log, Pa; `None` unless both are measured and above atmosphere.
    pub gauge_sum_pa: Option<f64>,
}

/// An effect as another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imaged {
    /// First parameter of the image.
    pub value: f64,
    /// What either adds to the level of friction, N. A factor on friction multiplies what is stated of breaking away and
    /// leaves alone what is fitted; an addition adds to both.
    pub added_friction_n: f64,
    /// A parameter of a third effect that has to be multiplied by a factor for the two to be alike.
    pub companion: Option<(Effect, usize, f64)>,
}

impl Imaged {
    /// A value and nothing else.
    #[must_use]
    pub const fn at(value: f64) -> Self {
        Self { value, added_friction_n: 0.0, companion: None }
    }
}

/// A quantity against which a balance's error is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// Valve command.
    Command,
    /// Rate of the valve command.
    CommandRate,
    /// Position.
    Position,
    /// Velocity.
    Velocity,
    /// Acceleration.
    Acceleration,
    /// Pressure of A.
    PressureA,
    /// Pressure of B.
    PressureB,
    /// Rate of the pressure of A.
    RateA,
    /// Difference of the chamber pressures.
    Difference,
    /// Sum of the chamber pressures.
    Sum,
}

/// Which samples of a log are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Only {
    /// All.
    All,
    /// Inside the rig file's dead zone, or close to mid position.
    ValveClosed,
    /// Around the dead zone.
    SmallCommand,
    /// While the valve fills A and exhausts B.
    Filling,
    /// While the valve exhausts A and fills B.
    Exhausting,
    /// While the piston slides.
    Sliding,
}

/// Two curves instead of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// One curve.
    No,
    /// Command rising or falling.
    Command,
    /// Motion towards B or towards A.
    Motion,
}

/// A picture that betrays an effect: what a balance misses, against a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Whose error.
    pub of: Balance,
    /// Drawn over what.
    pub against: Against,
    /// Which samples.
    pub only: Only,
    /// One curve or two.
    pub split: Split,
    /// What to look for.
    pub note: &'static str,
}

impl Picture {
    /// All samples in one curve.
    #[must_use]
    pub const fn new(of: Balance, against: Against, note: &'static str) -> Self {
        Self { of, against, only: Only::All, split: Split::No, note }
    }

    /// The same of some samples only.
    #[must_use]
    pub const fn only(self, only: Only) -> Self {
        Self { only, ..self }
    }

    /// The same in two curves.
    #[must_use]
    pub const fn split(self, split: Split) -> Self {
        Self { split, ..self }
    }
}

/// What the identification of an effect has to know.
#[derive(Clone, Copy, Debug)]
pub struct Identification {
    /// The balances it acts on.
    pub balances: Balances,
    /// What must be measured.
    pub needs: Needs,
    /// The values of the rig file it stands in for.
    pub stands_for: StandsFor,
    /// Values of the rig file, as paths, that a factor of this effect multiplies along: they return to what is stated when
    /// the effect takes over.
    pub carries_along: &'static [&'static str],
    /// Values of the rig file that change in step with it, with their exponent (−1 or 1) in its first parameter over
    /// neutral: together they change nothing that air and mass show. A fit has to begin on that line.
    pub moves_in_step: &'static [(&'static str, i8)],
    /// Friction levels of the rig file, as paths, to each of which its first parameter times the sum of both gauge pressures adds: what it
    /// adds on average a log shows only together with them.
    pub adds_to_levels: &'static [&'static str],
    /// Values of the rig file, as paths, that its parameters multiply, in their order: only the products show.
    pub factors_on: &'static [&'static str],
    /// How its own parameters change when lengths read too long by a factor: the exponents, −1, 0 or 1.
    pub length_exponents: [i8; MAX_PARAMETERS],
    /// How those of its parameters that are factors change with the cross-section, see [`crate::similarity`]: 1 for a factor on an area,
    /// a force or a flow. What has a unit is told by that.
    pub size_exponents: [i8; MAX_PARAMETERS],
    /// How many of its starting values are fitted: several where the misfit has several minima.
    pub starts_fitted: usize,
    /// The starting values form a grid over several minima: of neighbours only the best counts.
    pub starts_form_a_grid: bool,
    /// It acts on a part of the stroke, and so perhaps nowhere in a part of a log.
    pub acts_locally: bool,
    /// Whether its influence has a derivative at the neutral setting. A play or a delay has to be overcome first.
    pub smooth_at_neutral: bool,
    /// It replaces an equation, so that a derivative at neutral says nothing: fitted whenever another effect on the same
    /// balances is.
    pub replaces_a_law: bool,
    /// Two parameters of which the first must not be the smaller one.
    pub ordered: Option<[usize; 2]>,
    /// Groups of parameters of which each makes an effect of its own; empty: they belong together. A group is absent where
    /// its first parameter is zero.
    pub parts: &'static [&'static [usize]],
    /// Parameters that mean nothing while the others are neutral: a time constant, a wavelength.
    pub shape_only: &'static [usize],
    /// What else does nearly the same, apart from what other files state.
    pub confused_with: &'static [Confusion],
    /// What betrays it.
    pub pictures: &'static [Picture],
}

impl Identification {
    /// An effect on some balances that is like nothing else and has nothing special about it.
    #[must_use]
    pub const fn on(balances: Balances, pictures: &'static [Picture]) -> Self {
        Self {
            balances,
            needs: Needs::Nothing,
            stands_for: StandsFor::Nothing,
            carries_along: &[],
            moves_in_step: &[],
            adds_to_levels: &[],
            factors_on: &[],
            length_exponents: [0; MAX_PARAMETERS],
            size_exponents: [0; MAX_PARAMETERS],
            starts_fitted: 1,
            starts_form_a_grid: false,
            acts_locally: false,
            smooth_at_neutral: true,
            replaces_a_law: false,
            ordered: None,
            parts: &[],
            shape_only: &[],
            confused_with: &[],
            pictures,
        }
    }
}

/// What a log can tell at all.
#[derive(Clone, Copy, Debug)]
pub struct LogQuality {
    /// Sampling interval, s.
    pub interval_s: f64,
    /// Standard deviation of the pressure force computed from single samples, N.
    pub force_noise_n: f64,
}

/// Bounds of a fitted parameter.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

/// Where a fit of an effect may begin.
#[derive(Clone, Copy, Debug)]
pub struct StartContext<'a> {
    /// Neutral values of its parameters on this rig.
    pub neutral: [f64; MAX_PARAMETERS],
    /// Plainly visible changes.
    pub scales: [f64; MAX_PARAMETERS],
    /// Bounds.
    pub bounds: [Bounds; MAX_PARAMETERS],
    /// Wavelengths in m at which the friction residual ripples along the stroke, strongest first.
    pub wavelengths_m: &'a [f64],
}

/// The experiment for pairs that name none.
pub(crate) const RECOMMENDED_EXPERIMENT: &str =
    "Record the sequence of `plant-sim experiment`: it excites every effect of the catalogue by itself.";
