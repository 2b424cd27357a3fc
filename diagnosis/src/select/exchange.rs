//! Exchange: a cause replaced by another that explains the log better, one at a time.

use super::backward::{Pruned, prune};
use super::forward::{Wanted, rivals};
use super::image::{companion, image, nearest};
use super::memory::Memory;
use super::penalty::{cost_before_pruning, near_noise, open, out_of_reach, penalised_cost};
use super::visibility::candidates;
use crate::constants;
use crate::estimate::derivatives::Jacobian;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::parameter::Slot;
use core::cell::OnceCell;
use plant_model::Effect;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// The alternatives to a cause: the fit without it, and that fit's best extensions by another effect.
pub(crate) struct Alternatives {
    pub(crate) without: Fit,
    pub(crate) instead: Vec<Fit>,
    /// Whether any were looked for: not where too much was spent already.
    pub(crate) searched: bool,
}

/// The alternatives to a cause of a fit. `slopes` are that fit's.
fn alternatives(
    problem: &Problem<'_>,
    (best, slopes): (&Fit, &OnceCell<Option<Jacobian>>),
    effect: Effect,
    without: Fit,
    memory: &mut Memory,
) -> Alternatives {
    let wanted = Wanted { acting: effects::channels(effect), most: constants::alternatives() };
    let mut instead = rivals(problem, &without, &wanted, memory);
    fit_alike(problem, best, effect, &mut instead, memory);
    let slopes = slopes.get_or_init(|| problem.jacobian(best));
    let nearest =
        slopes.as_ref().map_or_else(Vec::new, |slopes| fit_nearest(problem, (best, slopes), effect, &instead));
    for other in nearest.into_iter().chain(fit_images(problem, best, effect)) {
        let last = |fit: &Fit| fit.hypothesis.effects.last().copied();
        instead.retain(|fit| last(fit) != last(&other) || fit.cost(problem) < other.cost(problem));
        if !instead.iter().any(|fit| last(fit) == last(&other)) {
            memory.note(&other);
            instead.push(other);
        }
    }
    Alternatives { without, instead, searched: true }
}

/// Fits to the end what a cause is confused with. Forward selection ends most fits after a few steps; of two effects alike
/// these do not tell which comes closer, for instance while a nominal value is far off under one of them only.
fn fit_alike(problem: &Problem<'_>, best: &Fit, effect: Effect, instead: &mut [Fit], memory: &mut Memory) {
    let alike = |fit: &Fit| {
        let other = fit.hypothesis.effects.last();
        other.is_some_and(|other| effect.confused_with().any(|(confused, _)| confused == *other))
    };
    let finish = |fit: &mut Fit| {
        let changed = fit.hypothesis.effects.last().map_or(0, |effect| effects::channels(*effect));
        let goal = best.cost(problem);
        for left in (0..constants::rounds_alike()).rev() {
            let again = fit.hypothesis.clone();
            let Some(found) = problem.fit_and_search(again, changed, constants::iterations(), goal) else { break };
            let (gained, missing) = (fit.cost(problem) - found.cost(problem), found.cost(problem) - goal);
            *fit = found;
            // Rounds gain less and less.
            if gained < constants::likelier() || gained * (left as f64) < missing {
                break;
            }
        }
    };
    instead.par_iter_mut().filter(|fit| alike(fit)).for_each(finish);
    instead.iter().filter(|fit| alike(fit)).for_each(|fit| memory.note(fit));
}

/// What a cause may be confused with, begun where it comes nearest to the cause ([`nearest`]); not what fits nearly as well already, nor
/// what can do little of what the cause does.
fn fit_nearest(problem: &Problem<'_>, (best, slopes): (&Fit, &Jacobian), effect: Effect, instead: &[Fit]) -> Vec<Fit> {
    let as_good = best.cost(problem) + constants::tie();
    let last = |fit: &Fit| fit.hypothesis.effects.last().copied();
    let known = |other: &Effect| instead.iter().any(|fit| last(fit) == Some(*other) && fit.cost(problem) < as_good);
    let alike = effect.confused_with().map(|(other, _)| other).chain(instead.iter().filter_map(last));
    let candidates = candidates(problem);
    let images: Vec<Effect> = effect.images_among(&best.hypothesis.effects).collect();
    let wanted = |other: &Effect| candidates.contains(other) && !known(other) && !images.contains(other);
    let others: BTreeSet<Effect> = alike.filter(wanted).collect();
    let normal = problem.normal_of(slopes, best);
    let begun = |other: &Effect| {
        let found = nearest(problem, (best, slopes, &normal), effect, *other)?;
        let hypothesis = (found.correlation > constants::correlated()).then_some(found.hypothesis)?;
        let changed = effects::channels(effect) | effects::channels(*other);
        problem.fit_and_search(hypothesis, changed, constants::iterations(), best.cost(problem))
    };
    others.par_iter().filter_map(begun).collect()
}

/// The fits with a cause replaced by its images, see [`super::image`].
fn fit_images(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Vec<Fit> {
    let fitted = |other: Effect| {
        let changed = effects::channels(effect) | effects::channels(other);
        let begun = image(problem, fit, effect, other)?;
        problem.fit_and_search(begun, changed, constants::iterations(), fit.cost(problem))
    };
    let images: Vec<Effect> = effect.images_among(&fit.hypothesis.effects).collect();
    images.into_par_iter().filter_map(fitted).collect()
}

/// Replaces causes one at a time as long as that lowers the penalised cost, beginning with the cause whose removal
/// costs least. Returns the best fit, and for each of its causes the alternatives that were fitted.
pub(crate) fn exchange(problem: &Problem<'_>, begin: Pruned, memory: &mut Memory) -> (Fit, Vec<Option<Alternatives>>) {
    let mut seen = Vec::new();
    let Pruned { fit: mut best, mut without } = begin;
    loop {
        let effects = &best.hypothesis.effects;
        let missed = |k: usize| without[k].as_ref().map_or(f64::INFINITY, |fit| fit.cost(problem));
        let mut order: Vec<usize> = (0..effects.len()).collect();
        order.sort_by(|a, b| missed(*a).total_cmp(&missed(*b)));
        let mut all: Vec<Option<Alternatives>> = effects.iter().map(|_| None).collect();
        let mut exchanged = None;
        let slopes = OnceCell::new();
        for place in order {
            let Some(without) = without[place].clone() else { continue };
            // A cause whose own balances are closed can be named while others stay wide open: what those took counts for nothing.
            let nameable = out_of_reach(problem, &best) && near_noise(problem, &best, effects[place]);
            // Where too much is spent only the image of a cause is looked at; other ties that its file does not state stay untold.
            let found = if nameable || !exhausted(problem, &best) {
                alternatives(problem, (&best, &slopes), effects[place], without, memory)
            } else if given_up(problem, &best) {
                Alternatives { without, instead: Vec::new(), searched: false }
            } else {
                let instead = fit_images(problem, &best, effects[place]);
                Alternatives { without, instead, searched: false }
            };
            exchanged = best_exchange(problem, &best, &found.instead, &mut seen);
            all[place] = Some(found);
            if exchanged.is_some() {
                break;
            }
        }
        match exchanged {
            Some(pruned) => Pruned { fit: best, without } = pruned,
            None => return (best, all),
        }
    }
}

/// Whether so much is spent that no more exchanges are tried, and names are out of reach: then no further cause will be named.
pub(super) fn given_up(problem: &Problem<'_>, best: &Fit) -> bool {
    exhausted(problem, best) && out_of_reach(problem, best)
}

/// Whether so much is spent that no more exchanges are tried: less where names are out of reach.
fn exhausted(problem: &Problem<'_>, best: &Fit) -> bool {
    let most = if out_of_reach(problem, best) { constants::most_effort_open() } else { constants::most_effort() };
    problem.effort.millions() > most
}

/// The best of some exchanges, after backward elimination, if its penalised cost is lower than the present one and its causes and
/// cost were not `seen` before.
fn best_exchange(
    problem: &Problem<'_>,
    best: &Fit,
    instead: &[Fit],
    seen: &mut Vec<(Vec<Effect>, f64)>,
) -> Option<Pruned> {
    let (cost, enough) = (best.cost(problem), penalised_cost(problem, best) - 1.0);
    // An exchange of higher likelihood may have the higher penalty until backward elimination removes what it makes
    // needless.
    let likelier =
        |fit: &&Fit| cost_before_pruning(problem, fit) < enough || fit.cost(problem) < cost - constants::likelier();
    let first = (instead.iter().filter(likelier))
        .min_by(|a, b| cost_before_pruning(problem, a).total_cmp(&cost_before_pruning(problem, b)))?;
    let (effects, cost) = (&first.hypothesis.effects, first.cost(problem));
    if seen.iter().any(|(others, other)| others == effects && (other - cost).abs() < constants::same_cost()) {
        return None;
    }
    seen.push((effects.clone(), cost));
    Some(prune(problem, first.clone())).filter(|pruned| penalised_cost(problem, &pruned.fit) < enough)
}

/// A cause and its image are equivalent if a third effect (the companion) takes another value. Of the two, chooses the
/// one that leaves the companion nearer to its neutral value.
pub(crate) fn nearest_to_stated(
    problem: &Problem<'_>,
    best: Fit,
    mut all: Vec<Option<Alternatives>>,
) -> (Fit, Vec<Option<Alternatives>>) {
    let enough = penalised_cost(problem, &best) + constants::tie();
    for place in 0..all.len() {
        let effect = best.hypothesis.effects[place];
        let with_companion = |image| Some((image, companion(problem, &best, effect, image)?));
        let Some((image, (companion, index))) = effect.images_among(&best.hypothesis.effects).find_map(with_companion)
        else {
            continue;
        };
        let Some(neutral) = problem.parameters(companion).get(index).map(|p| p.neutral) else { continue };
        let value = |fit: &Fit| fit.hypothesis.value(Slot::Effect(companion, index));
        let off = |fit: &Fit| value(fit).map_or(f64::INFINITY, |value| (value / neutral).ln().abs());
        let Some(alternatives) = &mut all[place] else { continue };
        let nearer = |fit: &Fit| {
            fit.hypothesis.effects.last() == Some(&image)
                && off(fit) < off(&best)
                && penalised_cost(problem, fit) < enough
        };
        let Some(found) = alternatives.instead.iter().position(nearer) else { continue };
        let nearest = alternatives.instead.remove(found);
        // The new cause is the last effect of its fit; the old one becomes its alternative.
        let mut other = best;
        other.hypothesis.effects.retain(|e| *e != effect);
        other.hypothesis.effects.push(effect);
        alternatives.instead.push(other);
        let moved = all.remove(place);
        all.push(moved);
        return (nearest, all);
    }
    (best, all)
}

/// Where a balance stays open, replaces a cause by its image and then exchanges the other causes too. A cause of the
/// wrong name can keep another from being found, so that only both exchanges together lower the cost.
pub(crate) fn exchange_images(
    problem: &Problem<'_>,
    best: Fit,
    all: Vec<Option<Alternatives>>,
    memory: &mut Memory,
) -> (Fit, Vec<Option<Alternatives>>) {
    if !open(problem, &best) {
        return (best, all);
    }
    for effect in best.hypothesis.effects.clone() {
        if exhausted(problem, &best) {
            break;
        }
        for image in fit_images(problem, &best, effect) {
            let (other, alternatives) = exchange(problem, Pruned::as_it_is(problem, image), memory);
            if penalised_cost(problem, &other) < penalised_cost(problem, &best) - constants::likelier() {
                return (other, alternatives);
            }
        }
    }
    (best, all)
}
