use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::identification::{Against, Balance, Balances, Identification, Only, Picture, StandsFor};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

pub(super) struct ExhaustCoefficient;

impl Definition for ExhaustCoefficient {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "exhaust-coefficient",
        title: "Exhaust conductance changed",
        equation: "beta_exh := scale beta_exh",
        signature: "mass flow out of a chamber is off by a constant factor whenever it exhausts, at all pressures, in both chambers",
        source: "Valdiero et al. 2011 (3.3); clogged silencer",
        parameters: &[ParameterInfo {
            name: "scale",
            key: "effects.exhaust-coefficient.scale",
            min: 0.05,
            max: 10.0,
            typical: 0.8,
            meaning: "factor on beta_exh",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        stands_for: StandsFor::FactorOn(&[
            "valve.exhaust_coefficient_kg_per_s_pa",
            "valve.exhaust_conductance_m3_per_s_pa",
        ]),
        length_exponents: [-1, 0, 0],
        size_exponents: [1, 0, 0],
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::PressureA,
                    "While A exhausts: an error that grows with its pressure.",
                )
                .only(Only::Exhausting),
                Picture::new(Balance::MassB, Against::PressureB, "While B exhausts.").only(Only::Filling),
            ],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [R::ONE, R::ZERO, R::ZERO]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        model.valve_a.exhaust = model.valve_a.exhaust * values[0];
        model.valve_b.exhaust = model.valve_b.exhaust * values[0];
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Chambers exhaust at {:.0} % of the nominal flow at all pressures (silencer, fittings)",
            values[0] * 100.0
        )
    }
}
