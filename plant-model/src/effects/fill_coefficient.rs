use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::effect::Effect;
use super::identification::{
    Against, Balance, Balances, Confusion, Identification, Image, ImageContext, Imaged, Likeness, Only, Picture,
    StandsFor,
};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Choked flow has a scale of its own: with it, less in one direction is more in the other.
fn less_the_other_way(context: &ImageContext<'_>) -> Option<Imaged> {
    let factor = 1.0 + context.away / context.neutral;
    Some(Imaged { companion: Some((Effect::ChokedFlow, 1, factor)), ..Imaged::at(context.image_neutral / factor) })
}

pub(super) struct FillCoefficient;

impl Definition for FillCoefficient {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "fill-coefficient",
        title: "Filling conductance changed",
        equation: "beta_fill := scale beta_fill",
        signature: "mass flow into a chamber is off by a constant factor whenever it fills, at all pressures, in both chambers",
        source: "Valdiero et al. 2011 (3.3); clogged supply filter or undersized fitting",
        parameters: &[ParameterInfo {
            name: "scale",
            key: "effects.fill-coefficient.scale",
            min: 0.05,
            max: 10.0,
            typical: 0.8,
            meaning: "factor on beta_fill",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        stands_for: StandsFor::FactorOn(&["valve.fill_coefficient_kg_per_s_pa", "valve.fill_conductance_m3_per_s_pa"]),
        length_exponents: [-1, 0, 0],
        size_exponents: [1, 0, 0],
        confused_with: &[
            Confusion {
                with: Effect::SupplyDroop,
                kind: Likeness::Near,
                experiment: Some("Record the supply pressure at the valve."),
            },
            Confusion {
                with: Effect::ExhaustCoefficient,
                kind: Likeness::Image(Image {
                    beside: Some(Effect::ChokedFlow),
                    forward: less_the_other_way,
                    backward: less_the_other_way,
                }),
                experiment: None,
            },
        ],
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::PressureA,
                    "While A fills: an error that grows with the pressure drop.",
                )
                .only(Only::Filling),
                Picture::new(Balance::MassB, Against::PressureB, "While B fills.").only(Only::Exhausting),
            ],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [R::ONE, R::ZERO, R::ZERO]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        model.valve_a.fill = model.valve_a.fill * values[0];
        model.valve_b.fill = model.valve_b.fill * values[0];
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Chambers fill at {:.0} % of the nominal flow at all pressures", values[0] * 100.0)
    }
}
