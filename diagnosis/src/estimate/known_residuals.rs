//! The residuals of the last fits, channel by channel. A hypothesis with the same values in a channel has the same there: a candidate
//! that acts on the air leaves those of mechanics, and a fit goes on from where another one ended.

use super::likelihood::Residuals;
use crate::balances::shared::Shared;
use crate::data::channel::{Channel, Channels};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Slot;

/// What the residuals of a channel depend on.
type Values = Vec<(Slot, f64)>;

/// Residuals known.
#[derive(Default)]
pub(crate) struct Known {
    channels: [Shared<Values, (Vec<f64>, f64)>; 4],
}

impl Known {
    /// Those of a hypothesis at some values in the `wanted` channels; empty where they are not known.
    pub(super) fn find(&self, hypothesis: &Hypothesis, values: &[f64], wanted: Channels) -> Residuals {
        let mut out = Residuals::default();
        for channel in Channel::ALL.into_iter().filter(|channel| wanted & channel.bit() != 0) {
            let known = self.channels[channel as usize].find(&in_channel(hypothesis, values, channel));
            if let Some(known) = known {
                (out.channels[channel as usize], out.log_widths[channel as usize]) = (*known).clone();
            }
        }
        out
    }

    /// Keeps those of a hypothesis at its own values.
    pub(super) fn keep(&self, hypothesis: &Hypothesis, residuals: &Residuals) {
        for channel in Channel::ALL {
            let found = &residuals.channels[channel as usize];
            if !found.is_empty() {
                let key = in_channel(hypothesis, &hypothesis.values, channel);
                self.channels[channel as usize].of(key, || (found.clone(), residuals.log_widths[channel as usize]));
            }
        }
    }
}

fn in_channel(hypothesis: &Hypothesis, values: &[f64], channel: Channel) -> Values {
    let pairs = hypothesis.parameters.iter().zip(values);
    pairs.filter(|(p, _)| p.channels & channel.bit() != 0).map(|(p, value)| (p.slot, *value)).collect()
}

#[cfg(test)]
mod tests {
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::simulated;
    use crate::data::channel::Channel;
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::estimate::problem::Problem;
    use crate::model::hypothesis::Hypothesis;
    use crate::model::nominal::nominal_parameters;
    use plant_model::{Effect, Effects};
    use rig_files::RigFile;

    #[test]
    fn what_is_known_is_what_would_be_computed() {
        let rig = RigFile::paper_a();
        let log = simulated(&rig, &Effects::none(), 4000, |t_s| (2.0 * t_s).sin() + (7.0 * t_s).sin());
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &effort));
        let null = Hypothesis::null(&nominal);
        let mut residuals = Vec::new();
        for (effect, value) in [(None, 0.0), (Some(Effect::PayloadMass), 0.7), (Some(Effect::LeakChamberA), 2.0e-9)] {
            let extended = effect
                .map_or_else(|| null.clone(), |effect| null.extended_by(effect, problem.parameters(effect), &[value]));
            let fit = problem.evaluate_as_is(extended).expect("a sound rig");
            let of = |problem: &Problem<'_>| problem.evaluate(&fit.hypothesis, &fit.hypothesis.values, judgeable);
            let [known, anew] = [of(&problem), of(&problem.on(problem.stretches.clone()))].map(|r| r.expect("sound"));
            assert_eq!(known.channels, anew.channels, "{effect:?}");
            residuals.push(anew);
        }
        // Each cause changes its own channels: what was known of the others served.
        let [null, payload, leak] = &residuals[..] else { panic!("three") };
        let same = |one: usize, a: &super::Residuals, b: &super::Residuals| a.channels[one] == b.channels[one];
        assert!(same(Channel::PressureA as usize, null, payload) && !same(Channel::Position as usize, null, payload));
        assert!(same(Channel::Position as usize, null, leak) && !same(Channel::PressureA as usize, null, leak));
    }
}
