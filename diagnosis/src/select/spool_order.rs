//! A spool of second order acts later than one of first order, and so takes up a delay of the command that is not among the causes.

use super::penalty::{beyond_noise_in, penalised_cost};
use super::visibility::candidates;
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::parameter::{Parameter, Slot};
use plant_model::{Effect, Place};

/// A fit; or, where its spool is of second order and more than noise is left, the one with a delay beside a spool of first order, if that is
/// likelier.
///
/// Of `1/(m tau^2 s^2 + tau s + 1)` the impulse response has the mean `tau` and the variance `tau^2 (1 - 2 m)`: so have a delay and a lag of first
/// order of `tau sqrt(1 - 2 m)`, which together take `tau`.
pub(super) fn delay_in_place_of_inertia(problem: &Problem<'_>, fit: Fit) -> Fit {
    let (causes, delay) = (&fit.hypothesis, Effect::LineDelay);
    let is_lag =
        |p: &Parameter| matches!(p.slot, Slot::Effect(Effect::ValveLag, 0) | Slot::Stated(Effect::ValveLag, 0));
    let inertia = Slot::Nominal(Place::spool_inertia.key());
    let lag_s = causes.parameters.iter().zip(&causes.values).find(|(p, _)| is_lag(p)).map(|(_, value)| *value);
    let (Some(lag_s), Some(of_inertia)) = (lag_s, causes.value(inertia)) else { return fit };
    let is_open = !causes.effects.contains(&delay) && candidates(problem).contains(&delay);
    if of_inertia <= 0.0 || !is_open || !beyond_noise_in(problem, &fit, effects::channels(delay)) {
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
    let found = problem.fit_and_search(begun, effects::channels(delay), constants::iterations(), fit.cost(problem));
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

    #[test]
    fn a_delay_beside_a_lag_is_no_spool_of_second_order() {
        let mut rig = RigFile::paper_a();
        rig.effects = Effects::none().with(Effect::ValveLag, &[0.0017]);
        rig.tolerance.default = 0.02;
        let hidden = Effects::none().with(Effect::ValveLag, &[0.006]).with(Effect::LineDelay, &[0.005]);
        let plain = RigFile { effects: Effects::none(), ..rig.clone() };
        let mut log =
            simulated(&plain, &hidden, 12_000, |t_s| 1.2 * (13.0 * t_s).sin().signum() + 0.3 * (31.0 * t_s).sin());
        add_noise(&mut log, 5.0e-6, 200.0);
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &effort));
        let lag = Effect::ValveLag;
        let begun = Hypothesis::null(&nominal).with(lag, problem.parameters(lag), &[0.010], false);
        let held = problem.fit(begun, constants::iterations()).expect("a sound rig");
        let inertia = held.hypothesis.value(Slot::Nominal(Place::spool_inertia.key())).expect("open");
        let found = delay_in_place_of_inertia(&problem, held).hypothesis;
        let values = found.effects.iter().map(|effect| found.values_of(*effect)[0]).collect::<Vec<f64>>();
        assert_eq!(found.effects, [lag, Effect::LineDelay], "{inertia}");
        assert!(
            inertia > 0.1 && (values[0] / 0.006 - 1.0).abs() < 0.1 && (values[1] / 0.005 - 1.0).abs() < 0.1,
            "{inertia} {values:?}"
        );
    }
}
