//! Two effects that are not reached one at a time: neither alone takes anything away, or what one of them does another value takes up.

use super::penalty::{beyond_noise, beyond_noise_in, penalised_cost};
use super::visibility::candidates;
use crate::constants;
use crate::data::channel::Channels;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::{Parameter, Slot};
use plant_model::{Effect, Place};

/// The lags that filters of pressures and position are.
const FILTERS: [Effect; 2] = [Effect::PressureLag, Effect::PositionLag];

/// A fit; or, where more than noise is left, a likelier one with two effects in place of one, or of a value.
pub(super) fn two_at_once(problem: &Problem<'_>, fit: Fit) -> Fit {
    delay_in_place_of_inertia(problem, filters_in_place_of_a_delay(problem, fit))
}

/// A fit; or, where a delay of the command is among its causes and more than noise is left, the one with filters of all sensors in its
/// place, if that is likelier: together they look like a delay.
fn filters_in_place_of_a_delay(problem: &Problem<'_>, fit: Fit) -> Fit {
    let causes = &fit.hypothesis;
    if !causes.effects.contains(&Effect::LineDelay)
        || !beyond_noise(problem, &fit)
        || !are_open(problem, causes, &FILTERS)
    {
        return fit;
    }
    let delay_s = causes.values_of(Effect::LineDelay);
    let filtered = FILTERS.iter().fold(causes.without(Effect::LineDelay, problem.nominal), |begun, filter| {
        begun.with(*filter, problem.parameters(*filter), &delay_s, false)
    });
    likelier(problem, fit, filtered, problem.judgeable)
}

/// A fit; or, where its spool is of second order and more than noise is left, the one with a delay beside a spool of first order, if that is
/// likelier: both act later than a spool of first order.
///
/// Of `1/(m tau^2 s^2 + tau s + 1)` the impulse response has the mean `tau` and the variance `tau^2 (1 - 2 m)`: so have a delay and a lag of first
/// order of `tau sqrt(1 - 2 m)`, which together take `tau`.
fn delay_in_place_of_inertia(problem: &Problem<'_>, fit: Fit) -> Fit {
    let (causes, delay) = (&fit.hypothesis, Effect::LineDelay);
    let is_lag =
        |p: &Parameter| matches!(p.slot, Slot::Effect(Effect::ValveLag, 0) | Slot::Stated(Effect::ValveLag, 0));
    let inertia = Slot::Nominal(Place::spool_inertia.key());
    let lag_s = causes.parameters.iter().zip(&causes.values).find(|(p, _)| is_lag(p)).map(|(_, value)| *value);
    let (Some(lag_s), Some(of_inertia)) = (lag_s, causes.value(inertia)) else { return fit };
    let channels = effects::channels(delay);
    if of_inertia <= 0.0 || !beyond_noise_in(problem, &fit, channels) || !are_open(problem, causes, &[delay]) {
        return fit;
    }
    let first_order_s = lag_s * (1.0 - 2.0 * of_inertia).max(0.01).sqrt();
    let mut begun = causes.with(delay, problem.parameters(delay), &[lag_s - first_order_s], false);
    for (p, value) in begun.parameters.iter().zip(&mut begun.values) {
        if p.slot == inertia {
            *value = p.min;
        } else if is_lag(p) {
            *value = first_order_s.clamp(p.min, p.max);
        }
    }
    likelier(problem, fit, begun, channels)
}

/// Whether some effects may be causes, and are not among them.
fn are_open(problem: &Problem<'_>, causes: &Hypothesis, some: &[Effect]) -> bool {
    let candidates = candidates(problem);
    some.iter().all(|effect| candidates.contains(effect) && !causes.effects.contains(effect))
}

/// Of a fit and of one that begins elsewhere, after something `changed` in some channels, the one of lower penalised cost.
fn likelier(problem: &Problem<'_>, fit: Fit, begun: Hypothesis, changed: Channels) -> Fit {
    let found = problem.fit_and_search(begun, changed, constants::iterations(), fit.cost(problem));
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
    use crate::model::nominal::nominal_parameters;
    use plant_model::Effects;
    use rig_files::RigFile;

    /// The fit of one cause to a log with some effects and a command in V, and what takes its place.
    fn before_and_after(
        rig: &RigFile,
        hidden: &[(Effect, f64)],
        (cause, start): (Effect, f64),
        command_v: impl Fn(f64) -> f64,
    ) -> [Hypothesis; 2] {
        let plain = RigFile { effects: Effects::none(), ..rig.clone() };
        let effects = hidden.iter().fold(Effects::none(), |all, (effect, value)| all.with(*effect, &[*value]));
        let mut log = simulated(&plain, &effects, 12_000, command_v);
        add_noise(&mut log, 5.0e-6, 200.0);
        let record = prepare(&log, rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((rig, &record), judgeable, &nominal, (&signals, &effort));
        let begun = Hypothesis::null(&nominal).with(cause, problem.parameters(cause), &[start], false);
        let fit = problem.fit(begun, constants::iterations()).expect("a sound rig");
        [fit.hypothesis.clone(), two_at_once(&problem, fit).hypothesis]
    }

    #[test]
    fn filters_of_all_sensors_are_no_delay_and_a_delay_is_no_filters() {
        let rig = RigFile::paper_a();
        let causes = |hidden: &[(Effect, f64)]| {
            let command_v = |t_s: f64| 0.9 * (3.0 * t_s).sin() + 0.6 * (11.0 * t_s).sin();
            let [_, found] = before_and_after(&rig, hidden, (Effect::LineDelay, 0.004), command_v);
            found
        };
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

    #[test]
    fn a_delay_beside_a_lag_is_no_spool_of_second_order() {
        let mut rig = RigFile::paper_a();
        rig.effects = Effects::none().with(Effect::ValveLag, &[0.0017]);
        rig.tolerance.default = 0.02;
        let (lag, delay) = (Effect::ValveLag, Effect::LineDelay);
        let command_v = |t_s: f64| 1.2 * (13.0 * t_s).sin().signum() + 0.3 * (31.0 * t_s).sin();
        let [held, found] = before_and_after(&rig, &[(lag, 0.006), (delay, 0.005)], (lag, 0.010), command_v);
        let inertia = held.value(Slot::Nominal(Place::spool_inertia.key())).expect("open");
        let values = found.effects.iter().map(|effect| found.values_of(*effect)[0]).collect::<Vec<f64>>();
        assert_eq!(found.effects, [lag, delay], "{inertia}");
        assert!(
            inertia > 0.1 && (values[0] / 0.006 - 1.0).abs() < 0.1 && (values[1] / 0.005 - 1.0).abs() < 0.1,
            "{inertia} {values:?}"
        );
    }
}
