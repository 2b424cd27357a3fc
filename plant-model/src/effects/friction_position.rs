use super::definition::{
    Definition, Info, MAX_PARAMETERS, NEGLIGIBLE, NEGLIGIBLE_FRICTION, Negligible, ParameterInfo, typical_scales,
};
use super::identification::{Against, Balance, Balances, Identification, Only, Picture, Split, StartContext};
use super::terms::{Seal, Sliding, Term};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Relative change per metre, 1/m.
    pub slope: R,
    /// Relative amplitude of the periodic part.
    pub amplitude: R,
    /// Wave number of the periodic part, rad/m.
    pub wave_number: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn changes_sliding_force(&self) -> bool {
        self.slope != R::ZERO || self.amplitude != R::ZERO
    }

    #[inline(always)]
    fn slide<const PARTIALS: bool>(&self, seal: &Seal<R>, sum: &mut Sliding<R>) {
        let angle = self.wave_number * seal.y_m;
        let (wave, wave_slope) = if self.amplitude == R::ZERO {
            (R::ZERO, R::ZERO)
        } else {
            let slope = if PARTIALS { self.wave_number * angle.cos() } else { R::ZERO };
            (self.amplitude * angle.sin(), self.amplitude * slope)
        };
        sum.place = sum.place + self.slope * seal.y_m + wave;
        sum.place_by_position += self.slope + wave_slope;
    }

    #[inline]
    fn slide_least(&self, half_stroke_m: R, sum: &mut Sliding<R>) {
        sum.place -= self.slope.abs() * half_stroke_m + self.amplitude.abs();
    }
}

/// A step of the wavelength that a fit feels: more would skip a wave on a long stroke.
const WAVELENGTH_STEP: f64 = 0.02;
const SHORTEST_WAVE_M: f64 = 0.005;
/// Amplitude from which fits begin, of either sign.
const START_AMPLITUDE: f64 = 0.3;

pub(super) struct FrictionPosition;

impl Definition for FrictionPosition {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "friction-position",
        title: "Friction depends on position",
        equation: "g := g (1 + slope y/(L/2) + amplitude sin(2 pi y/wavelength))",
        signature: "the odd force residual varies along the stroke, linearly or with a period",
        source: "Armstrong-Helouvry et al. 1994; worn or bent bore, lead screw",
        parameters: &[
            ParameterInfo {
                name: "slope",
                key: "effects.friction-position.slope",
                min: -0.95,
                max: 0.95,
                typical: 0.3,
                meaning: "relative change from mid-stroke to the end",
            },
            ParameterInfo {
                name: "amplitude",
                key: "effects.friction-position.amplitude",
                min: -0.95,
                max: 0.95,
                typical: 0.2,
                meaning: "relative amplitude of the periodic part",
            },
            ParameterInfo {
                name: "wavelength_m",
                key: "effects.friction-position.wavelength_m",
                min: 0.0,
                max: 10.0,
                typical: 0.01,
                meaning: "wavelength of the periodic part, m; 0 switches it off",
            },
        ],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        length_exponents: [0, 0, -1],
        starts_fitted: 2,
        // A slope along the stroke and a ripple of a long wavelength are nearly the same.
        parts: &[&[0], &[1, 2]],
        shape_only: &[2],
        ..Identification::on(
            Balances::FORCE,
            &[Picture::new(
                Balance::Force,
                Against::Position,
                "Opposite errors in the two directions that change along the stroke.",
            )
            .only(Only::Sliding)
            .split(Split::Motion)],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], model: &Coefficients<R>) -> Terms<R> {
        let mut terms = Terms { slope: values[0] / model.half_stroke_m, ..Terms::default() };
        if values[2] > R::ZERO {
            terms.amplitude = values[1];
            terms.wave_number = (R::PI + R::PI) / values[2];
        }
        terms
    }

    fn scales(_rig: &Rig<f64>, neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        let [slope, amplitude, _] = typical_scales(Self::INFO, neutral);
        [slope, amplitude, WAVELENGTH_STEP * neutral[2].max(SHORTEST_WAVE_M)]
    }

    fn negligible(_context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [NEGLIGIBLE_FRICTION, NEGLIGIBLE_FRICTION, NEGLIGIBLE * scales[2]]
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        let [slope, amplitude, wavelength_m] = context.neutral;
        begin(&[slope, amplitude, wavelength_m]);
        // The wavelength shows only once there is a ripple, and its valley is narrow where there are many waves.
        for wavelength_m in context.wavelengths_m {
            begin(&[slope, 0.0, *wavelength_m]);
            for factor in [0.95, 1.0, 1.05] {
                for amplitude in [START_AMPLITUDE, -START_AMPLITUDE] {
                    begin(&[slope, amplitude, factor * wavelength_m]);
                }
            }
        }
    }

    fn visible(_neutral: &[f64; MAX_PARAMETERS], scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [scales[0], 0.0, 0.0]
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [slope, amplitude, wavelength_m] = *values;
        // A ripple is the more striking of the two unless it is three times smaller.
        if amplitude.abs() * 3.0 > slope.abs() && wavelength_m > 0.0 {
            let percent = amplitude.abs() * 100.0;
            write!(f, "Friction ripples along the stroke by {percent:.0} % every {:.1} mm", wavelength_m * 1e3)
        } else {
            write!(f, "Friction changes along the stroke by {:+.0} % from the middle to the B end", slope * 100.0)
        }
    }
}
