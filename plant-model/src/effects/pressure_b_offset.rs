use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::identification::{Against, Balance, Balances, Identification, Picture};
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
        shown.p_b_pa += self.offset_pa;
    }

    #[inline(always)]
    fn true_pressure_pa(&self, side: Side, shown_pa: R) -> R {
        if side == Side::B { shown_pa - self.offset_pa } else { shown_pa }
    }
}

pub(super) struct PressureBOffset;

impl Definition for PressureBOffset {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "pressure-b-offset",
        title: "Pressure sensor B offset",
        equation: "measured p_b = p_b + b; behind a gain error, g p_b + b",
        signature: "a constant force and, at once, a constant error of p_b in the flow law; gravity is only the first",
        source: "calibration or ageing of the pressure sensor",
        parameters: &[ParameterInfo {
            name: "offset_pa",
            key: "effects.pressure-b-offset.offset_pa",
            min: -2.0e5,
            max: 2.0e5,
            typical: 1.5e4,
            meaning: "offset b, Pa",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification::on(
        Balances::MASS_B.and(Balances::FORCE),
        &[
            Picture::new(
                Balance::MassB,
                Against::Command,
                "The flow does not fit the pressure read, most at large openings.",
            ),
            Picture::new(Balance::Force, Against::Velocity, "The force does not fit either, alike in both directions."),
        ],
    );

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { offset_pa: values[0] }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Pressure sensor B reads {:+.3} bar off, in the flow law and in the force alike", values[0] * 1e-5)
    }
}
