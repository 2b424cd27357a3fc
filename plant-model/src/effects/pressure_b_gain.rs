use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::effect::Effect;
use super::identification::{Against, Balance, Balances, Confusion, Identification, Likeness, Picture};
use super::terms::{Side, Term};
use crate::coefficients::Coefficients;
use crate::measurement::Measurement;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms<R> {
    /// Gain of the sensor.
    pub gain: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn sense(&self, shown: &mut Measurement<R>) {
        shown.p_b_pa = self.gain * shown.p_b_pa;
    }

    #[inline(always)]
    fn true_pressure_pa(&self, side: Side, shown_pa: R) -> R {
        if side == Side::B { shown_pa / self.gain } else { shown_pa }
    }
}

impl<R: Real> Default for Terms<R> {
    fn default() -> Self {
        Self { gain: R::ONE }
    }
}

pub(super) struct PressureBGain;

impl Definition for PressureBGain {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "pressure-b-gain",
        title: "Pressure sensor B gain error",
        equation: "measured p_b = g p_b",
        signature: "the force misses a share of this chamber's pressure, and the same share shows in its flow; an offset is the same at every pressure",
        source: "calibration or ageing of the pressure sensor",
        parameters: &[ParameterInfo {
            name: "gain",
            key: "effects.pressure-b-gain.gain",
            min: 0.5,
            max: 1.5,
            typical: 1.04,
            meaning: "sensor gain g on the absolute pressure",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        confused_with: &[
            Confusion {
                with: Effect::PressureBOffset,
                kind: Likeness::Near,
                experiment: Some(
                    "Read the sensor against a gauge at atmosphere and at supply: an offset is the same at both, a gain error grows.",
                ),
            },
            Confusion {
                with: Effect::PistonArea,
                kind: Likeness::Near,
                experiment: Some(
                    "Read the sensor against a gauge at supply: a wrong area leaves the pressure right, a wrong gain does not.",
                ),
            },
        ],
        ..Identification::on(
            Balances::MASS_B.and(Balances::FORCE),
            &[
                Picture::new(
                    Balance::MassB,
                    Against::PressureB,
                    "A flow error that turns its sign between low and high pressure.",
                ),
                Picture::new(Balance::Force, Against::PressureB, "A force error that grows with this pressure."),
            ],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [R::ONE, R::ZERO, R::ZERO]
    }

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { gain: values[0] }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Pressure sensor B reads {:.2} % too {}, in the flow law and in the force alike",
            (values[0] - 1.0).abs() * 100.0,
            if values[0] < 1.0 { "low" } else { "high" }
        )
    }
}
