//! Parameters that raise a level on average: centred, so that what varies and the level are fitted apart.
//!
//! Friction that grows with pressure raises friction at the mean pressure too. A log tells the growth; of the level it tells the sum with
//! the rig file's friction. Moved alone, either makes the piston break away at other moments, and difference quotients of the two do not
//! cancel: a valley of the cost becomes invisible, fits stop in it anywhere, and standard errors come out many times too small. So where one
//! is moved the levels move against it. That is centring a regressor, for derivatives that are differences.

use super::likelihood::Residuals;
use super::problem::Problem;
use crate::data::channel::Channel;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Slot;

/// A parameter that moves against another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Companion {
    /// Its place.
    place: usize,
    /// Its change per change of the other.
    rate: f64,
}

impl Problem<'_> {
    /// The mean of both chambers' gauge pressures, summed, Pa; `None` unless both are measured and above atmosphere.
    pub(crate) fn gauge_sum_pa(&self) -> Option<f64> {
        let record = self.record;
        let atmosphere_pa = self.rig.rig.supply.atmosphere_pa;
        let mean = |signal: &[f64]| signal.iter().sum::<f64>() / signal.len().max(1) as f64;
        let both = record.available.pressure_a && record.available.pressure_b;
        let sum = mean(&record.p_a_pa) + mean(&record.p_b_pa) - 2.0 * atmosphere_pa;
        (both && sum > 0.1 * atmosphere_pa).then_some(sum)
    }

    /// The parameters that move against each one of a hypothesis; mostly none.
    pub(super) fn companions(&self, hypothesis: &Hypothesis) -> Vec<Vec<Companion>> {
        let levels_of = |slot: Slot| match slot {
            Slot::Effect(effect, 0) | Slot::Stated(effect, 0) => effect.identification().adds_to_levels,
            _ => &[],
        };
        let of = |slot: Slot| {
            let levels = levels_of(slot);
            let Some(rate) = (!levels.is_empty()).then(|| self.gauge_sum_pa()).flatten() else { return Vec::new() };
            let all = hypothesis.parameters.iter().enumerate();
            all.filter(|(_, p)| levels.iter().any(|path| p.is_value_of(path)))
                .map(|(place, _)| Companion { place, rate: -rate })
                .collect()
        };
        hypothesis.parameters.iter().map(|p| of(p.slot)).collect()
    }
}

/// Values with one moved by a step, and its companions against it. None passes its bounds.
pub(super) fn moved(
    hypothesis: &Hypothesis,
    values: &[f64],
    (index, step): (usize, f64),
    companions: &[Companion],
) -> Vec<f64> {
    let mut out = values.to_vec();
    let mut to = |place: usize, by: f64| {
        let p = &hypothesis.parameters[place];
        out[place] = (values[place] + by).clamp(p.min, p.max);
        out[place] - values[place]
    };
    let moved = to(index, step);
    for companion in companions {
        to(companion.place, companion.rate * moved);
    }
    out
}

/// The derivatives by single parameters from those with companions: what the companions did is taken out again.
pub(super) fn separated(
    hypothesis: &Hypothesis,
    columns: &mut [Residuals],
    (index, companions): (usize, &[Companion]),
) {
    const POSITION: usize = Channel::Position as usize;
    let scale = |place: usize| hypothesis.parameters[place].scale;
    for Companion { place, rate } in companions {
        let rate = rate * scale(index) / scale(*place);
        let together = std::mem::take(&mut columns[index].channels[POSITION]);
        let of_companion = &columns[*place].channels[POSITION];
        columns[index].channels[POSITION] = together.iter().zip(of_companion).map(|(a, b)| a - rate * b).collect();
    }
}
