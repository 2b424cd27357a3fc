//! Air with a temperature of its own: without heat exchange it is adiabatic, with much of it isothermal.

use plant_model::Effect;
use rig_files::RigFile;
use synthesis::{Cause, Physics, Specimen};

/// How far `p V^n` of a sealed chamber A strays while the piston swings to rest, as a part of it.
fn strays(coefficient: f64, exponent: f64) -> f64 {
    let rig = RigFile::paper_c().rig;
    let mut specimen = Specimen::new(
        Physics::new(&rig, &[Cause::Catalogue(Effect::WallHeat, [coefficient, 0.0, 0.0])]),
        0.0,
        5.0e5,
        3.0e5,
    );
    let invariant = |specimen: &Specimen| {
        let volume = rig.cylinder.volume_a0_m3 + rig.cylinder.area_a_m2 * specimen.y_m();
        specimen.read().p_a_pa * volume.powf(exponent)
    };
    let begin = invariant(&specimen);
    let (mut worst, mut furthest) = (0.0_f64, 0.0_f64);
    for _ in 0..300 {
        specimen.advance(0.0, 1.0e-3);
        worst = worst.max((invariant(&specimen) / begin - 1.0).abs());
        furthest = furthest.max(specimen.y_m());
    }
    assert!(furthest > 0.01, "the piston must move: {furthest} m");
    worst
}

#[test]
fn a_sealed_chamber_is_adiabatic_without_heat_exchange_and_isothermal_with_much() {
    assert!(strays(0.0, 1.4) < 1e-4, "{}", strays(0.0, 1.4));
    assert!(strays(3.0e4, 1.0) < 1e-2, "{}", strays(3.0e4, 1.0));
    // A real wall lies between.
    assert!(strays(60.0, 1.4) > 1e-3 && strays(60.0, 1.0) > 1e-2);
}
