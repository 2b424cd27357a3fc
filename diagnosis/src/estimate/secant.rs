//! Secant updates of a Jacobian (Broyden 1965): a step that was taken tells the derivatives along itself, so that they need not be
//! computed anew after each step. Used between the steps of a fit; the last steps have derivatives of their own.

use super::likelihood::Residuals;
use crate::constants;
use crate::data::channel::Channel;
use crate::model::hypothesis::Hypothesis;

/// Corrects derivatives by the change of the residuals `[before, after]` over a step in scales: the least change with which they
/// predict it, among the parameters that act on each channel (Schubert 1970). A channel along which the step was shorter than
/// that of a difference quotient keeps its derivatives: single breakaways would rule.
pub(super) fn corrected(
    hypothesis: &Hypothesis,
    columns: &mut [Residuals],
    step: &[f64],
    [before, after]: [&Residuals; 2],
) {
    for channel in Channel::ALL {
        let at = channel as usize;
        let acts = |columns: &[Residuals], i: usize| {
            hypothesis.parameters[i].channels & channel.bit() != 0 && !columns[i].channels[at].is_empty()
        };
        let acting: Vec<usize> = (0..columns.len()).filter(|i| acts(columns, *i)).collect();
        let square: f64 = acting.iter().map(|i| step[*i] * step[*i]).sum();
        let shortest = if channel == Channel::Position { constants::step_rough() } else { constants::step_smooth() };
        if square.sqrt() < shortest {
            continue;
        }
        let pairs = after.channels[at].iter().zip(&before.channels[at]);
        let mut missed: Vec<f64> = pairs.map(|(after, before)| after - before).collect();
        for &i in &acting {
            missed.iter_mut().zip(&columns[i].channels[at]).for_each(|(missed, slope)| *missed -= slope * step[i]);
        }
        for &i in &acting {
            let part = step[i] / square;
            columns[i].channels[at].iter_mut().zip(&missed).for_each(|(slope, missed)| *slope += part * missed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::channel::Channels;
    use crate::model::parameter::{Parameter, Slot};

    fn parameter(channels: Channels) -> Parameter {
        let (neutral, scale, tolerance) = (1.0, 0.1, None);
        Parameter { slot: Slot::Term(0), neutral, scale, negligible: 0.0, tolerance, min: 0.0, max: 2.0, channels }
    }

    fn residuals(a: &[f64], position: &[f64]) -> Residuals {
        let mut out = Residuals::default();
        out.channels[Channel::PressureA as usize] = a.to_vec();
        out.channels[Channel::Position as usize] = position.to_vec();
        out
    }

    #[test]
    fn corrected_derivatives_predict_the_step_and_change_nothing_across_it() {
        let (air, force) = (Channel::PressureA.bit(), Channel::Position.bit());
        let parameters = vec![parameter(air), parameter(air | force), parameter(force)];
        let hypothesis = Hypothesis { effects: vec![], values: vec![1.0; 3], parameters };
        let mut columns = [residuals(&[1.0, 0.0], &[]), residuals(&[0.0, 2.0], &[1.0]), residuals(&[], &[3.0])];
        let before = residuals(&[0.5, 0.5], &[1.0]);
        let after = residuals(&[1.0, 1.5], &[1.2]);
        let step = [0.3, 0.4, 0.0];
        let across = |columns: &[Residuals; 3]| {
            // A step at a right angle to the one taken, of the two that act on A.
            let of = |k: usize, row: usize| columns[k].channels[Channel::PressureA as usize][row];
            [0, 1].map(|row| 0.4 * of(0, row) - 0.3 * of(1, row))
        };
        let unmoved = across(&columns);
        corrected(&hypothesis, &mut columns, &step, [&before, &after]);
        for (channel, changes) in [(Channel::PressureA, vec![0.5, 1.0]), (Channel::Position, vec![0.2])] {
            for (row, change) in changes.into_iter().enumerate() {
                let slope = |k: usize| columns[k].channels[channel as usize].get(row).copied().unwrap_or(0.0);
                let predicted: f64 = (0..3).map(|k| slope(k) * step[k]).sum();
                assert!((predicted - change).abs() < 1e-12, "{channel:?} {row}: {predicted}");
            }
        }
        for (now, then) in across(&columns).into_iter().zip(unmoved) {
            assert!((now - then).abs() < 1e-12, "{now} {then}");
        }
        assert!(columns[0].channels[Channel::Position as usize].is_empty());
    }

    #[test]
    fn a_step_shorter_than_a_difference_quotients_says_nothing_of_a_rough_balance() {
        let both = Channel::PressureA.bit() | Channel::Position.bit();
        let hypothesis = Hypothesis { effects: vec![], values: vec![1.0], parameters: vec![parameter(both)] };
        let mut columns = [residuals(&[1.0], &[1.0])];
        let [before, after] = [residuals(&[0.0], &[0.0]), residuals(&[1.0], &[1.0])];
        corrected(&hypothesis, &mut columns, &[0.01], [&before, &after]);
        assert!((columns[0].channels[Channel::PressureA as usize][0] - 100.0).abs() < 1e-9);
        assert_eq!(columns[0].channels[Channel::Position as usize], [1.0]);
    }
}
