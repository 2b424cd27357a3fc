//! Filters in all sensors: together they look like a delay of the command, while neither of them alone takes anything away.

use super::penalty::{beyond_noise, penalised_cost};
use super::visibility::candidates;
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use plant_model::Effect;

/// The lags that filters of pressures and position are.
const FILTERS: [Effect; 2] = [Effect::PressureLag, Effect::PositionLag];

/// A fit; or, where a delay of the command is among its causes and more than noise is left, the one with filters of all sensors in its
/// place, if that is likelier.
pub(super) fn in_place_of_a_delay(problem: &Problem<'_>, fit: Fit) -> Fit {
    let causes = &fit.hypothesis;
    let delays = causes.effects.contains(&Effect::LineDelay);
    let candidates = candidates(problem);
    let are_open = FILTERS.iter().all(|filter| candidates.contains(filter) && !causes.effects.contains(filter));
    if !delays || !are_open || !beyond_noise(problem, &fit) {
        return fit;
    }
    let delay_s = causes.values_of(Effect::LineDelay);
    let filtered = FILTERS.iter().fold(causes.without(Effect::LineDelay, problem.nominal), |begun, filter| {
        begun.with(*filter, problem.parameters(*filter), &delay_s, false)
    });
    let found = problem.fit_and_search(filtered, problem.judgeable, constants::iterations(), fit.cost(problem));
    found.filter(|found| penalised_cost(problem, found) < penalised_cost(problem, &fit)).unwrap_or(fit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated};
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::hypothesis::Hypothesis;
    use crate::model::nominal::nominal_parameters;
    use plant_model::Effects;
    use rig_files::RigFile;

    /// The causes of a log with some effects, a delay fitted first.
    fn causes(hidden: &[(Effect, f64)]) -> Hypothesis {
        let rig = RigFile::paper_a();
        let effects = hidden.iter().fold(Effects::none(), |all, (effect, value)| all.with(*effect, &[*value]));
        let mut log = simulated(&rig, &effects, 12_000, |t_s| 0.9 * (3.0 * t_s).sin() + 0.6 * (11.0 * t_s).sin());
        add_noise(&mut log, 5.0e-6, 200.0);
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &effort));
        let delayed =
            Hypothesis::null(&nominal).extended_by(Effect::LineDelay, problem.parameters(Effect::LineDelay), &[0.004]);
        let fit = problem.fit(delayed, constants::iterations()).expect("a sound rig");
        in_place_of_a_delay(&problem, fit).hypothesis
    }

    #[test]
    fn filters_of_all_sensors_are_no_delay_and_a_delay_is_no_filters() {
        let found = causes(&[(Effect::PressureLag, 0.004), (Effect::PositionLag, 0.004)]);
        assert_eq!(found.effects, FILTERS);
        for filter in FILTERS {
            let value = found.values_of(filter)[0];
            assert!((value / 0.004 - 1.0).abs() < 0.05, "{filter}: {value}");
        }
        // Beside a leak, which leaves more than noise.
        let found = causes(&[(Effect::LineDelay, 0.004), (Effect::LeakChamberA, 2.0e-10)]);
        assert_eq!(found.effects, [Effect::LineDelay]);
    }
}
