//! What the noise of the pressure sensors costs the force balance.

use super::problem::{Fit, Problem};
use crate::constants;
use crate::data::channel::Channel;
use crate::data::grid::splined;
use crate::data::record::Record;
use crate::data::smoothing::twice;
use plant_model::{Plant, Side};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// How much more of the pressure sensors' noise one fit passes on to the position than another, as a cost with the problem's
/// dispersion: negative if less.
///
/// Measured by simulation: noise like the sensors' is added to the force once more, and what it adds to a cost is what that of the
/// log costs there already (Cook and Stefanski 1994). A piston that creeps, where friction falls with speed, is unstable and
/// amplifies noise; a larger mass amplifies less and predicts better, without being true.
pub(crate) fn more_noise_passed_on(problem: &Problem<'_>, one: &Fit, other: &Fit) -> f64 {
    let Ok(plant) = Plant::new(&problem.rig.rig, &problem.rig.effects) else { return 0.0 };
    let position = Channel::Position.bit();
    let added = |noisy: &Problem<'_>, fit: &Fit| {
        let cost = noisy.cost_of(&fit.hypothesis, &fit.hypothesis.values, position)?;
        Some(cost - fit.cost_in(problem, position))
    };
    let more = |draw: u64| {
        let noise_n = force_noise_n(problem.record, &plant, draw);
        let noisy = problem.disturbed(&noise_n);
        Some(added(&noisy, one)? - added(&noisy, other)?)
    };
    let draws = constants::noise_floor_draws() as u64;
    (0..draws).into_par_iter().filter_map(more).sum::<f64>() / draws as f64
}

/// One draw of what the noise of the pressure sensors makes of the force, N, smoothed as the pressures are.
fn force_noise_n(record: &Record, plant: &Plant<f64>, draw: u64) -> Vec<f64> {
    let mut draws = StandardNormal.sample_iter(Xoshiro256PlusPlus::seed_from_u64(draw));
    let t_s: Vec<f64> = record.rows.iter().map(|k| record.t_s[*k]).collect();
    let quality = &record.quality;
    let by_rows = |noise_n: f64| {
        let white: Vec<f64> = draws.by_ref().take(t_s.len()).map(|e: f64| noise_n * e).collect();
        twice(&t_s, &white, record.pressure_reach()).value
    };
    let sides = [(Side::A, quality.pressure_a), (Side::B, quality.pressure_b)];
    let [a, b] = sides.map(|(side, noise)| plant.area_m2(side) * noise.standard_deviation).map(by_rows);
    // Between rows pressures are interpolated, and so is their noise.
    splined(record, a.iter().zip(&b).map(|(a, b)| a - b).collect()).value
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated};
    use crate::data::grid::{Between, refined};
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::hypothesis::Hypothesis;
    use plant_model::Effect;
    use rig_files::RigFile;

    #[test]
    fn a_larger_mass_passes_on_less_of_the_pressures_noise_and_the_same_mass_no_less() {
        let rig = RigFile::paper_c();
        let mut log = simulated(&rig, &rig.effects, 8000, |t_s| if t_s % 2.0 < 1.0 { 0.62 } else { -0.62 });
        add_noise(&mut log, 4.0e-5, 700.0);
        let record = refined(prepare(&log, &rig), Between::Held);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable(&record), &[], (&signals, &effort));
        let of_mass = |mass_kg: f64| {
            let effect = Effect::PayloadMass;
            let hypothesis = Hypothesis::null(&[]).extended_by(effect, problem.parameters(effect), &[mass_kg]);
            problem.evaluate_as_is(hypothesis).expect("a sound rig")
        };
        let (true_mass, twice) = (of_mass(rig.rig.load.mass_kg), of_mass(2.0 * rig.rig.load.mass_kg));
        assert_eq!(more_noise_passed_on(&problem, &true_mass, &true_mass), 0.0);
        let (less, more) =
            (more_noise_passed_on(&problem, &true_mass, &twice), more_noise_passed_on(&problem, &twice, &true_mass));
        assert!(less > 0.02 * problem.noise_cost(Channel::Position.bit()), "{less}");
        assert!((less + more).abs() < 1.0e-9, "{less} {more}");
    }
}
