//! Every effect of everyday strength must leave a trace in the log that noise does not hide.

use plant_model::Effect;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rayon::prelude::*;
use rig_files::RigFile;
use synthesis::{Case, Cause, Chain, Family, Foreign, Law, Physics, Specimen, Which, strength};

/// Root mean square difference of position (in units of 0.05 mm) and pressures (in units of 600 Pa) between a recording
/// with the cause and a rig without it that is given the same commands.
fn trace(rig_file: &RigFile, cause: Cause, seed: u64) -> f64 {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let case = Case {
        truth: rig_file.rig,
        law: Law::for_rig(&rig_file.rig, 1.0),
        chain: Chain::ideal(),
        experiment: Family::Identification.draw(&rig_file.rig, 8.0, &mut rng),
        rig_file: rig_file.clone(),
        causes: vec![cause],
        seed,
    };
    let (log, with) = case.record();
    let physics = Physics::new(&case.truth, &[]);
    let rest = physics.rest_pressure_pa();
    let mut without = Specimen::new(physics, case.experiment.start_m, rest, rest);
    let u = log.u_v.as_ref().expect("recorded");
    let (mut position, mut pressure) = (0.0, 0.0);
    for row in 0..log.len() {
        let plain = without.read();
        position += ((plain.y_m - with[row].y_m) / 0.05e-3).powi(2);
        pressure += 0.5 * ((plain.p_a_pa - with[row].p_a_pa) / 600.0).powi(2);
        pressure += 0.5 * ((plain.p_b_pa - with[row].p_b_pa) / 600.0).powi(2);
        if row + 1 < log.len() {
            without.advance(u[row], log.t_s[row + 1] - log.t_s[row]);
        }
    }
    (position.max(pressure) / log.len() as f64).sqrt()
}

#[test]
fn every_effect_in_and_outside_the_catalogue_is_visible_in_the_recommended_experiment() {
    // Case (c) shows least of most effects.
    let rig_file = RigFile::paper_c();
    let all: Vec<Which> =
        Effect::ALL.map(Which::Catalogue).into_iter().chain(Foreign::ALL.map(Which::Foreign)).collect();
    let hidden_in_noise: Vec<String> = all
        .into_par_iter()
        .filter_map(|which| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(21);
            let cause = strength::draw(which, &rig_file.rig, 1.0, &mut rng);
            let seen = trace(&rig_file, cause, 2);
            (seen < 1.0).then(|| format!("{}: {seen:.3} of the noise", cause.describe()))
        })
        .collect();
    assert!(hidden_in_noise.is_empty(), "{hidden_in_noise:#?}");
}
