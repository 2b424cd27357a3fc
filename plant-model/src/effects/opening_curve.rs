use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo};
use super::effect::Effect;
use super::identification::{
    Against, Balance, Balances, Confusion, Identification, Likeness, Only, Picture, StartContext,
};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// A parabola from the end of flow to full opening on each side, from there on straight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OpeningParabola<R> {
    curvature: R,
    full_right_v: R,
    full_left_v: R,
}

impl<R: Real> OpeningParabola<R> {
    /// Magnitude in rad at an effective command in V, and its derivative by the command's magnitude in rad/V.
    #[inline]
    pub(crate) fn at(&self, w: R) -> (R, R) {
        let full_v = if w >= R::ZERO { self.full_right_v } else { self.full_left_v };
        let (part, full) = (w.abs() / full_v, R::PI * R::HALF);
        if part >= R::ONE {
            return (full, R::ZERO);
        }
        let straight = R::ONE - self.curvature;
        let bent = self.curvature * part;
        (full * part * (straight + bent), full / full_v * (straight + bent + bent))
    }
}

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// The curve; absent for the arc tangent or the rig's table.
    pub curve: Option<OpeningParabola<R>>,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.curve.is_some()
    }
}

pub(super) struct OpeningCurve;

impl Definition for OpeningCurve {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "opening-curve",
        title: "Valve opens by another curve",
        equation: "opening = (pi/2) ((1 - c) x + c x^2), x = min(1, |w|/w_full) by side, instead of atan(2w)",
        signature: "the flow error changes with the command alone, alike in both chambers and at every pressure: too little near the dead zone, too much beyond, or the other way round",
        source: "flow over command in catalogues of proportional valves",
        parameters: &[
            ParameterInfo {
                name: "curvature",
                key: "effects.opening-curve.curvature",
                min: -0.9,
                max: 0.9,
                typical: 0.4,
                meaning: "curvature c; positive: opens slowly at first",
            },
            ParameterInfo {
                name: "full_right_v",
                key: "effects.opening-curve.full_right_v",
                min: 0.1,
                max: 100.0,
                typical: 4.0,
                meaning: "effective command of full opening, chamber A filled, V",
            },
            ParameterInfo {
                name: "full_left_v",
                key: "effects.opening-curve.full_left_v",
                min: 0.1,
                max: 100.0,
                typical: 4.0,
                meaning: "the same on the other side, V",
            },
        ],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        starts_fitted: 2,
        replaces_a_law: true,
        confused_with: &[Confusion {
            with: Effect::ValveDeadZone,
            kind: Likeness::Near,
            experiment: Some(
                "Raise the command in steps of 0.2 V from the dead zone to full opening at one position: a dead zone moves the curve, a law bends it.",
            ),
        }],
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(Balance::MassA, Against::Command, "The flow error bends with the command.")
                    .only(Only::Filling),
                Picture::new(Balance::MassB, Against::Command, "The same in the other chamber.").only(Only::Exhausting),
            ],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        // No command of full opening stands for the arc tangent, or for the rig's table.
        [R::ZERO; MAX_PARAMETERS]
    }

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        let [curvature, full_right_v, full_left_v] = *values;
        let stated = full_right_v > R::ZERO && full_left_v > R::ZERO;
        Terms { curve: stated.then_some(OpeningParabola { curvature, full_right_v, full_left_v }) }
    }

    fn scales(rig: &Rig<f64>, _neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        // A fifth of the command's range.
        let wide = 0.2 * rig.valve.max_voltage_v;
        [Self::INFO.parameters[0].typical, wide, wide]
    }

    fn negligible(_context: &Negligible<'_>, _scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        // Another curve, not more or less of the nominal one.
        [0.0; MAX_PARAMETERS]
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // Open at the largest command and progressive, as catalogues draw it; or open early and straight.
        let [_, right, left] = context.scales;
        for (curvature, scales) in [(0.4, 4.5), (0.0, 2.0)] {
            begin(&[curvature, scales * right, scales * left]);
        }
    }

    fn visible(_neutral: &[f64; MAX_PARAMETERS], _scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [0.4, 4.0, 4.0]
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let half = |full_v: f64| {
            // Where (1 - c) x + c x^2 is one half.
            let (c, straight) = (values[0], 1.0 - values[0]);
            let x = 1.0 / (straight + libm::sqrt(straight * straight + 2.0 * c));
            full_v * x
        };
        write!(
            f,
            "The valve is half open {:.2} V beyond its dead zone to the right and {:.2} V to the left, where atan(2w) says 0.5 V",
            half(values[1]),
            half(values[2])
        )
    }
}
