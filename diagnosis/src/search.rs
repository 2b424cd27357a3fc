//! Which causes: forward composition, removal of what a later cause makes needless, exchange, ties.

use crate::extensions::{Memory, SAME, Tried, Wanted, extensions};
use crate::fit::{Fit, ITERATIONS, Problem};
use crate::hypothesis::{self, Hypothesis, Slot};
use crate::starts::mirror;
use crate::worth::{PER_PARAMETER, TIE, charged, gate, negligible, open, promise, unsure, wanting, wide_open};
use plant_model::Effect;
use rayon::prelude::*;

/// Beside [`TIE`], alternatives within this part of what the cause gains cannot be told from it: the balances' numerical
/// error, and when sticking pistons break away, decide so small a difference.
const TIE_OF_GAIN: f64 = 0.003;
/// A cause that gains this many times what it must is there whatever its standard error.
const BEYOND_DOUBT: f64 = 10.0;
/// No more causes than this are composed.
const MOST_CAUSES: usize = 4;
/// Candidates tried in the place of each cause, and most exchanges.
const ALTERNATIVES: usize = 5;
const EXCHANGES: usize = 6;
/// An exchange is likelier if the cost falls by this much; so many of them are tried to the end.
const LIKELIER: f64 = 4.0;
const MOST_PRUNED: usize = 2;
/// Other first causes tried where a search ends wide open.
const RESTARTS: usize = 2;

/// The outcome of the search.
pub(crate) struct Found {
    pub(crate) null: Fit,
    /// With standard errors.
    pub(crate) best: Fit,
    /// For each cause, in the order of the best fit's effects: what cannot be told from it.
    pub(crate) ties: Vec<Vec<Effect>>,
    /// How much the cost grows when the cause is taken out and everything else is fitted anew.
    pub(crate) losses: Vec<f64>,
    pub(crate) tried: Vec<Tried>,
}

/// Takes out every cause whose removal costs less than its charge.
pub(crate) fn prune(problem: &Problem<'_>, mut fit: Fit) -> Fit {
    let (thinned, _) = problem.thinned();
    loop {
        if fit.hypothesis.effects.is_empty() {
            return fit;
        }
        let base = thinned.judge(fit.hypothesis.clone());
        let needless = fit.hypothesis.effects.par_iter().filter_map(|effect| {
            if base.as_ref().is_some_and(|base| needed(&thinned, base, *effect)) {
                return None;
            }
            let smaller = refit_without(problem, &fit, *effect)?;
            let wanting = wanting(problem, &fit, &smaller, *effect);
            (wanting >= 0.0).then_some((wanting, smaller))
        });
        match needless.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, smaller)) => fit = smaller,
            None => return fit,
        }
    }
}

/// Adds cause after cause to a fit, each time the likeliest that makes the whole likelier, and takes out what becomes
/// needless.
fn compose(problem: &Problem<'_>, start: Fit, most: usize, memory: &mut Memory, progress: &dyn Fn(&str)) -> Fit {
    let mut current = start;
    while current.hypothesis.effects.len() < most {
        progress(&format!("causes found: {}", current.hypothesis.effects.len()));
        // The likeliest may act on so many channels that it matters in none.
        let enough = |next: &Fit| {
            next.hypothesis.effects.last().is_some_and(|added| wanting(problem, next, &current, *added) < 0.0)
        };
        let fits = extensions(problem, &current, &Wanted::any(problem), memory);
        let mut pruned = fits.into_iter().filter(enough).take(MOST_PRUNED).map(|next| prune(problem, next));
        let before = charged(problem, &current);
        let Some(next) = pruned.find(|next| charged(problem, next) < before) else { break };
        current = next;
    }
    current
}

/// Whether a part of the data shows already, beyond doubt, that a fit needs a cause.
fn needed(thinned: &Problem<'_>, fit: &Fit, effect: Effect) -> bool {
    if negligible(fit, effect) {
        return false;
    }
    let least = BEYOND_DOUBT * gate(thinned, fit, effect);
    let smaller = fit.hypothesis.without(effect, thinned.nominal);
    let without = thinned.settle(smaller, hypothesis::channels(effect), ITERATIONS, fit.cost(thinned) + least);
    without.is_some_and(|without| without.cost(thinned) - fit.cost(thinned) > least)
}

/// Searches for the causes of the gap. `progress` hears what is being done.
pub(crate) fn search(problem: &mut Problem<'_>, nominal: &Hypothesis, progress: &dyn Fn(&str)) -> Option<Found> {
    let mut memory = Memory::default();
    progress("nominal model");
    let null = problem.fit(nominal.clone(), ITERATIONS)?;
    let mut current = compose(problem, null.clone(), MOST_CAUSES, &mut memory, progress);
    // A wrong first cause can make every later one look wrong: then others come first.
    if wide_open(problem, &current) && !current.hypothesis.effects.is_empty() {
        let first: Vec<Fit> = extensions(problem, &null, &Wanted::any(problem), &mut memory);
        for start in first.into_iter().skip(1).take(RESTARTS) {
            let other = compose(problem, start, MOST_CAUSES - 1, &mut memory, progress);
            if charged(problem, &other) < charged(problem, &current) {
                current = other;
            }
            if !wide_open(problem, &current) {
                break;
            }
        }
    }
    // What no hypothesis explains makes every gain less certain.
    problem.dispersion = problem.dispersion_at(&current);
    let mut pruned = prune(problem, current);
    // What becomes needless may make room for what is missing.
    if wide_open(problem, &pruned) {
        pruned = compose(problem, pruned, MOST_CAUSES, &mut memory, progress);
    }
    progress("alternatives");
    let (best, alternatives) = exchange(problem, pruned, &mut memory);
    let (best, alternatives) = exchange_mirrored(problem, best, alternatives, &mut memory);
    let (best, alternatives) = plainest(problem, best, alternatives);
    let (best, alternatives) = sure(problem, slim(problem, best), alternatives);
    let (ties, losses) = ties(problem, &best, alternatives);
    Some(Found { null, best, ties, losses, tried: memory.tried })
}

/// Leaves out causes whose parameters may as well be neutral: they soak up noise. What is left has standard errors.
fn sure(
    problem: &Problem<'_>,
    mut best: Fit,
    mut alternatives: Vec<Option<Alternatives>>,
) -> (Fit, Vec<Option<Alternatives>>) {
    loop {
        best = problem.with_errors(best);
        let place = best.hypothesis.effects.iter().position(|effect| unsure(&best, *effect));
        let Some(place) = place else { return (best, alternatives) };
        let effect = best.hypothesis.effects[place];
        let smaller = refit_without(problem, &best, effect);
        // Far beyond doubt, it is the standard error that is wrong.
        let doubtful =
            |smaller: &Fit| smaller.cost(problem) - best.cost(problem) < BEYOND_DOUBT * gate(problem, &best, effect);
        let Some(smaller) = smaller.filter(doubtful) else { return (best, alternatives) };
        best = smaller;
        if place < alternatives.len() {
            alternatives.remove(place);
        }
    }
}

/// Leaves out the half of position-dependent friction that the log does not ask for: a slope along the stroke and a
/// ripple of a long wavelength are nearly the same.
fn slim(problem: &Problem<'_>, best: Fit) -> Fit {
    const EFFECT: Effect = Effect::FrictionPosition;
    if !best.hypothesis.effects.contains(&EFFECT) {
        return best;
    }
    let halves: [&[usize]; 2] = [&[0], &[1, 2]];
    let charged = |fit: &Fit| fit.cost(problem) + PER_PARAMETER * fit.hypothesis.parameters.len() as f64;
    let fits = halves.into_iter().filter_map(|kept| problem.fit(best.hypothesis.only(EFFECT, kept), ITERATIONS));
    let least = fits.filter(|fit| !negligible(fit, EFFECT)).min_by(|a, b| charged(a).total_cmp(&charged(b)));
    match least {
        Some(fit) if charged(&fit) <= charged(&best) => fit,
        _ => best,
    }
}

/// What stands in for a cause that is taken out: everything else fitted anew, and its best extensions.
struct Alternatives {
    without: Fit,
    instead: Vec<Fit>,
}

fn alternatives(problem: &Problem<'_>, best: &Fit, effect: Effect, without: Fit, memory: &mut Memory) -> Alternatives {
    let wanted = Wanted { acting: hypothesis::channels(effect), most: ALTERNATIVES };
    let mut instead = extensions(problem, &without, &wanted, memory);
    if let Some(mirrored) = mirrored(problem, best, effect) {
        let last = |fit: &Fit| fit.hypothesis.effects.last().copied();
        instead.retain(|fit| last(fit) != last(&mirrored) || fit.cost(problem) < mirrored.cost(problem));
        if !instead.iter().any(|fit| last(fit) == last(&mirrored)) {
            memory.note(&mirrored);
            instead.push(mirrored);
        }
    }
    Alternatives { without, instead }
}

/// The same with a cause as the one that is nearly its image.
fn mirrored(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Fit> {
    let hypothesis = mirror(problem, fit, effect)?;
    let other = hypothesis.effects.last().copied()?;
    let changed = hypothesis::channels(effect) | hypothesis::channels(other);
    problem.settle(hypothesis, changed, ITERATIONS, fit.cost(problem))
}

/// The fit without one of its causes.
fn refit_without(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Fit> {
    let smaller = fit.hypothesis.without(effect, problem.nominal);
    let goal = fit.cost(problem) + gate(problem, fit, effect);
    problem.settle(smaller, hypothesis::channels(effect), ITERATIONS, goal)
}

/// Replaces causes one at a time by better ones, as long as that helps, those first that are missed least; with what else
/// could stand for each.
fn exchange(problem: &Problem<'_>, mut best: Fit, memory: &mut Memory) -> (Fit, Vec<Option<Alternatives>>) {
    let mut exchanges = 0;
    let mut seen = Vec::new();
    loop {
        let effects = &best.hypothesis.effects;
        let without: Vec<Option<Fit>> = effects.par_iter().map(|e| refit_without(problem, &best, *e)).collect();
        let missed = |k: usize| without[k].as_ref().map_or(f64::INFINITY, |fit| fit.cost(problem));
        let mut order: Vec<usize> = (0..effects.len()).collect();
        order.sort_by(|a, b| missed(*a).total_cmp(&missed(*b)));
        let mut all: Vec<Option<Alternatives>> = effects.iter().map(|_| None).collect();
        let mut exchanged = None;
        for place in order {
            let Some(without) = without[place].clone() else { continue };
            let found = alternatives(problem, &best, effects[place], without, memory);
            if exchanges < EXCHANGES {
                exchanged = better(problem, &best, &found.instead, &mut seen);
            }
            all[place] = Some(found);
            if exchanged.is_some() {
                break;
            }
        }
        match exchanged {
            Some(fit) => best = fit,
            None => return (best, all),
        }
        exchanges += 1;
    }
}

/// The best that becomes of some exchanges for a fit, if it is better; none of those seen before, which are told by their
/// causes and costs.
fn better(problem: &Problem<'_>, best: &Fit, instead: &[Fit], seen: &mut Vec<(Vec<Effect>, f64)>) -> Option<Fit> {
    let (cost, enough) = (best.cost(problem), charged(problem, best) - 1.0);
    // A likelier exchange may be dearer only until what it makes needless is taken out.
    let likelier = |fit: &&Fit| promise(problem, fit) < enough || fit.cost(problem) < cost - LIKELIER;
    let mut likelier: Vec<&Fit> = instead.iter().filter(likelier).collect();
    likelier.sort_by(|a, b| promise(problem, a).total_cmp(&promise(problem, b)));
    let mut new = |fit: &&Fit| {
        let (effects, cost) = (&fit.hypothesis.effects, fit.cost(problem));
        let known = seen.iter().any(|(others, other)| others == effects && (other - cost).abs() < SAME);
        seen.push((effects.clone(), cost));
        !known
    };
    let likelier: Vec<&Fit> = likelier.into_iter().take(MOST_PRUNED).filter(&mut new).collect();
    let pruned = likelier.into_iter().map(|fit| prune(problem, fit.clone()));
    pruned
        .filter(|fit| charged(problem, fit) < enough)
        .min_by(|a, b| charged(problem, a).total_cmp(&charged(problem, b)))
}

/// Of two names for the same beside choked flow, the one that leaves the conductance nearer to what is stated.
fn plainest(problem: &Problem<'_>, best: Fit, mut all: Vec<Option<Alternatives>>) -> (Fit, Vec<Option<Alternatives>>) {
    let conductance = |fit: &Fit| fit.hypothesis.value(Slot::Effect(Effect::ChokedFlow, 1));
    let off = |fit: &Fit| conductance(fit).map_or(f64::INFINITY, |scale| scale.ln().abs());
    let enough = charged(problem, &best) + TIE;
    for place in 0..all.len() {
        let effect = best.hypothesis.effects[place];
        let image = match effect {
            Effect::FillCoefficient => Effect::ExhaustCoefficient,
            Effect::ExhaustCoefficient => Effect::FillCoefficient,
            _ => continue,
        };
        let Some(alternatives) = &mut all[place] else { continue };
        let plainer = |fit: &Fit| {
            fit.hypothesis.effects.last() == Some(&image) && off(fit) < off(&best) && charged(problem, fit) < enough
        };
        let Some(found) = alternatives.instead.iter().position(plainer) else { continue };
        let plain = alternatives.instead.remove(found);
        // The cause that is exchanged stands last in the one and is an alternative of the other.
        let mut other = best;
        other.hypothesis.effects.retain(|e| *e != effect);
        other.hypothesis.effects.push(effect);
        alternatives.instead.push(other);
        let moved = all.remove(place);
        all.push(moved);
        return (plain, all);
    }
    (best, all)
}

/// Where a balance stays open: the same with a cause as its image, and other causes exchanged beside it. One that pulls the
/// other way can keep a third from being found, and look better beside a wrong one.
fn exchange_mirrored(
    problem: &Problem<'_>,
    best: Fit,
    all: Vec<Option<Alternatives>>,
    memory: &mut Memory,
) -> (Fit, Vec<Option<Alternatives>>) {
    if !open(problem, &best) {
        return (best, all);
    }
    for effect in best.hypothesis.effects.clone() {
        let Some(image) = mirrored(problem, &best, effect) else { continue };
        let (other, alternatives) = exchange(problem, image, memory);
        if charged(problem, &other) < charged(problem, &best) - LIKELIER {
            return (other, alternatives);
        }
    }
    (best, all)
}

/// For each cause: alternatives that explain the log as well in its place, and what its absence costs.
fn ties(problem: &Problem<'_>, best: &Fit, all: Vec<Option<Alternatives>>) -> (Vec<Vec<Effect>>, Vec<f64>) {
    let cost = charged(problem, best);
    let of = |(effect, alternatives): (&Effect, Option<Alternatives>)| {
        let mut tied = Vec::new();
        let mut loss = 0.0;
        if let Some(Alternatives { without, instead }) = alternatives {
            loss = without.cost(problem) - best.cost(problem);
            let tie = TIE.max(TIE_OF_GAIN * loss);
            let as_good = instead.iter().filter(|fit| charged(problem, fit) < cost + tie);
            for other in as_good.filter_map(|fit| fit.hypothesis.effects.last().copied()) {
                if other != *effect && !tied.contains(&other) {
                    tied.push(other);
                }
            }
        }
        // One force, two names: g (1 + a sign v) sign v = g sign v + a g, so F_0 = a F_c except around standstill.
        for (one, other) in
            [(Effect::ConstantForce, Effect::FrictionAsymmetry), (Effect::FrictionAsymmetry, Effect::ConstantForce)]
        {
            if *effect == one && !tied.contains(&other) && !best.hypothesis.effects.contains(&other) {
                tied.push(other);
            }
        }
        (tied, loss)
    };
    best.hypothesis.effects.iter().zip(all).map(of).unzip()
}

/// The effects that would change the predictions visibly at a plainly visible strength, were they there.
pub(crate) fn visible(problem: &Problem<'_>, fit: &Fit, candidates: &[Effect]) -> Vec<Effect> {
    candidates.par_iter().copied().filter(|effect| problem.responds(fit, *effect)).collect()
}
