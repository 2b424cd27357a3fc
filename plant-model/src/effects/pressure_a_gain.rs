use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::effect::Effect;
use super::identification::{
    Against, Balance, Balances, Confusion, Identification, Image, ImageContext, Imaged, Likeness, Picture,
};
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
        shown.p_a_pa = self.gain * shown.p_a_pa;
    }

    #[inline(always)]
    fn true_pressure_pa(&self, side: Side, shown_pa: R) -> R {
        if side == Side::A { shown_pa / self.gain } else { shown_pa }
    }
}

impl<R: Real> Default for Terms<R> {
    fn default() -> Self {
        Self { gain: R::ONE }
    }
}

/// The same ratio of both sensors' gains by the other one.
fn in_the_other(context: &ImageContext<'_>) -> Option<Imaged> {
    Some(Imaged::at(context.image_neutral * context.neutral / (context.neutral + context.away)))
}

pub(super) struct PressureAGain;

impl Definition for PressureAGain {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "pressure-a-gain",
        title: "Pressure sensor A gain error",
        equation: "measured p_a = g p_a",
        signature: "the force misses a share of this chamber's pressure, and the same share shows in its flow; an offset is the same at every pressure",
        source: "calibration or ageing of the pressure sensor",
        parameters: &[ParameterInfo {
            name: "gain",
            key: "effects.pressure-a-gain.gain",
            min: 0.5,
            max: 1.5,
            typical: 1.04,
            meaning: "sensor gain g on the absolute pressure",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        confused_with: &[
            Confusion {
                with: Effect::PressureAOffset,
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
            Confusion {
                with: Effect::PressureBGain,
                // Mechanics see the ratio of both sensors; the scale of all pressures is that of mass, friction, supply and
                // flow, each of which may be a few percent off.
                kind: Likeness::Image(Image { beside: None, forward: in_the_other, backward: in_the_other }),
                experiment: Some("Connect both ports at supply pressure and read both sensors against one gauge."),
            },
        ],
        ..Identification::on(
            Balances::MASS_A.and(Balances::FORCE),
            &[
                Picture::new(
                    Balance::MassA,
                    Against::PressureA,
                    "A flow error that turns its sign between low and high pressure.",
                ),
                Picture::new(Balance::Force, Against::PressureA, "A force error that grows with this pressure."),
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
            "Pressure sensor A reads {:.2} % too {}, in the flow law and in the force alike",
            (values[0] - 1.0).abs() * 100.0,
            if values[0] < 1.0 { "low" } else { "high" }
        )
    }
}
