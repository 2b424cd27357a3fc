use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::identification::{Against, Balance, Balances, Identification, Picture, StartContext};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::flow::Flow;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Pressure lost per mass flow drawn, Pa s/kg.
    pub droop_pa_s_per_kg: R,
    /// Recovery time constant, s.
    pub time_constant_s: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.droop_pa_s_per_kg != R::ZERO
    }
}

impl<R: Real> Terms<R> {
    /// The pressure at which the supply settles while `drawn` kg/s flow out of it, Pa.
    #[inline(always)]
    #[must_use]
    pub fn settled_pa(&self, source_pa: R, drawn: R) -> R {
        source_pa - self.droop_pa_s_per_kg * drawn
    }

    /// Rate of the pressure at the valve in Pa/s, zero where nothing droops.
    #[inline(always)]
    pub(crate) fn rate(&self, source_pa: R, drawn: R, supply_pa: R) -> R {
        if self.is_present() { (self.settled_pa(source_pa, drawn) - supply_pa) / self.time_constant_s } else { R::ZERO }
    }

    /// Derivatives of the rate; `drawn` are the flows into chambers that are filled, with their derivatives by the spool's position.
    #[inline(always)]
    pub(crate) fn partials(&self, drawn: [Option<(Flow<R>, R)>; 2]) -> Partials<R> {
        if !self.is_present() {
            return Partials::default();
        }
        let loss = -self.droop_pa_s_per_kg / self.time_constant_s;
        let [a, b] = drawn.map(|drawn| {
            let of = |(flow, per_v): (Flow<R>, R)| [flow.by_supply, per_v, flow.by_chamber].map(|part| loss * part);
            drawn.map_or([R::ZERO; 3], of)
        });
        let by_supply = a[0] + b[0] - R::ONE / self.time_constant_s;
        Partials { by_supply, by_spool: [a[1], b[1]], by_pressure: [a[2], b[2]] }
    }
}

/// Derivatives of the rate of the pressure at the valve, those of chambers for A and B.
#[derive(Default)]
pub(crate) struct Partials<R> {
    pub(crate) by_supply: R,
    /// By the spool's position as a chamber feels it.
    pub(crate) by_spool: [R; 2],
    /// By a chamber's pressure.
    pub(crate) by_pressure: [R; 2],
}

/// A shorter recovery is none: the right-hand side divides by it.
const SHORTEST_S: f64 = 1.0e-3;
/// A plainly visible droop takes this part of the pressure drop that drives the flow, at one radian of opening.
const VISIBLE_SHARE: f64 = 0.02;
/// A plainly visible change of the recovery.
const VISIBLE_S: f64 = 0.05;

pub(super) struct SupplyDroop;

impl Definition for SupplyDroop {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "supply-droop",
        title: "Supply pressure droops with flow",
        equation: "tau p_sup' = p_set - k q - p_sup, q the flow drawn",
        signature: "filling is too slow while much flow is drawn and recovers with a time constant; visible directly where p_sup is recorded",
        source: "receiver and regulator as a first-order source; Beater 2007",
        parameters: &[
            ParameterInfo {
                name: "droop_pa_s_per_kg",
                key: "effects.supply-droop.droop_pa_s_per_kg",
                min: 0.0,
                max: 1.0e9,
                typical: 3.0e7,
                meaning: "pressure lost per mass flow drawn k, Pa s/kg",
            },
            ParameterInfo {
                name: "time_constant_s",
                key: "effects.supply-droop.time_constant_s",
                min: 1.0e-3,
                max: 10.0,
                typical: 0.1,
                meaning: "recovery time constant tau, s",
            },
        ],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        length_exponents: [1, 0, 0],
        starts_fitted: 2,
        shape_only: &[1],
        ..Identification::on(
            Balances::MASS.and(Balances::SUPPLY),
            &[
                Picture::new(
                    Balance::Supply,
                    Against::Command,
                    "The supply gives way when the valve opens, to either side.",
                ),
                Picture::new(
                    Balance::MassA,
                    Against::Command,
                    "Chambers fill less than they should at large commands.",
                ),
            ],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [R::ZERO, R::of(0.1), R::ZERO]
    }

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        let time_constant_s = values[1].at_least(R::of(SHORTEST_S));
        Terms { droop_pa_s_per_kg: values[0], time_constant_s }
    }

    fn scales(rig: &Rig<f64>, _neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [VISIBLE_SHARE / rig.linear_coefficients_kg_per_s_pa()[0], VISIBLE_S, 1.0]
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // A quick and a slow receiver; both begin without droop.
        begin(&[context.neutral[0], 0.03]);
        begin(&[context.neutral[0], 0.2]);
    }

    fn visible(neutral: &[f64; MAX_PARAMETERS], scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [neutral[0] + scales[0], 0.1, 0.0]
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "The supply gives way under flow: {:.2} bar at 1 g/s, recovering within {:.0} ms",
            values[0] * 1.0e-3 * 1.0e-5,
            values[1] * 1e3
        )
    }
}
