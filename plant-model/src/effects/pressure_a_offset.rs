use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::effect::Effect;
use super::identification::{
    Against, Balance, Balances, Confusion, Identification, Image, ImageContext, Imaged, Likeness, Picture,
};
use super::terms::{Side, Term};
use crate::coefficients::Coefficients;
use crate::measurement::Measurement;
use crate::real::Real;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Offset of the sensor, Pa.
    pub offset_pa: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn sense(&self, shown: &mut Measurement<R>) {
        shown.p_a_pa += self.offset_pa;
    }

    #[inline(always)]
    fn true_pressure_pa(&self, side: Side, shown_pa: R) -> R {
        if side == Side::A { shown_pa - self.offset_pa } else { shown_pa }
    }
}

/// The same force from the other sensor, on the other side's area.
fn at_b(context: &ImageContext<'_>) -> Option<Imaged> {
    let c = &context.rig.cylinder;
    Some(Imaged::at(context.image_neutral - context.away * c.area_a_m2 / c.area_b_m2))
}

/// The way back.
fn at_a(context: &ImageContext<'_>) -> Option<Imaged> {
    let c = &context.rig.cylinder;
    Some(Imaged::at(context.image_neutral - context.away * c.area_b_m2 / c.area_a_m2))
}

pub(super) struct PressureAOffset;

impl Definition for PressureAOffset {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "pressure-a-offset",
        title: "Pressure sensor A offset",
        equation: "measured p_a = p_a + b; behind a gain error, g p_a + b",
        signature: "a constant force and, at once, a constant error of p_a in the flow law; gravity is only the first",
        source: "calibration or ageing of the pressure sensor",
        parameters: &[ParameterInfo {
            name: "offset_pa",
            key: "effects.pressure-a-offset.offset_pa",
            min: -2.0e5,
            max: 2.0e5,
            typical: 1.5e4,
            meaning: "offset b, Pa",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        confused_with: &[Confusion {
            with: Effect::PressureBOffset,
            // Mechanics see the difference of the pressures, and the air of one chamber or the other must be a few percent
            // off.
            kind: Likeness::Image(Image { beside: None, forward: at_b, backward: at_a }),
            experiment: None,
        }],
        ..Identification::on(
            Balances::MASS_A.and(Balances::FORCE),
            &[
                Picture::new(
                    Balance::MassA,
                    Against::Command,
                    "The flow does not fit the pressure read, most at large openings.",
                ),
                Picture::new(
                    Balance::Force,
                    Against::Velocity,
                    "The force does not fit either, alike in both directions.",
                ),
            ],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { offset_pa: values[0] }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Pressure sensor A reads {:+.3} bar off, in the flow law and in the force alike", values[0] * 1e-5)
    }
}
