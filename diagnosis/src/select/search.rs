//! The order of the selection: forward selection, backward elimination, exchange, simplification, ties.
//!
//! In two parts: causes are found first, and then compared with others. What they tell of the rows may change all of it, and comparing
//! is most of the work.

use super::backward::{Pruned, prune, prune_earlier};
use super::exchange::{exchange, exchange_images, nearest_to_stated};
use super::forward::{Wanted, extensions};
use super::memory::Memory;
use super::nominal_fit;
use super::penalty::{beyond_noise, out_of_reach, penalised_cost, shortfall, wide_open};
use super::screening::screened;
use super::simplify::{drop_needless_parts, drop_needless_trifles, drop_uncertain, one_of_each_tie};
use super::ties::ties;
use super::two_at_once::two_at_once;
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use plant_model::Effect;

/// The outcome of the search.
pub(crate) struct Found {
    pub(crate) null: Fit,
    /// What forward selection ended with, before over-dispersion made every gain less certain.
    pub(crate) forward: Fit,
    /// With standard errors.
    pub(crate) best: Fit,
    /// For each cause, in the order of the best fit's effects: the effects tied with it.
    pub(crate) ties: Vec<Vec<Effect>>,
    /// For each cause: the growth of the cost when it is removed and everything else is fitted anew.
    pub(crate) losses: Vec<f64>,
    /// For each cause: the fit without it.
    pub(crate) without: Vec<Option<Fit>>,
    /// Causes for which no alternatives were looked for.
    pub(crate) unrivalled: Vec<Effect>,
    pub(crate) memory: Memory,
}

/// Whether there are causes, and what they leave is like noise.
fn leaves_noise(problem: &Problem<'_>, fit: &Fit) -> bool {
    !fit.hypothesis.effects.is_empty() && !beyond_noise(problem, fit)
}

/// Adds one cause at a time, the best that lowers the penalised cost, and removes causes that become needless.
fn forward_selection(
    problem: &Problem<'_>,
    start: Fit,
    (most, until): (usize, Until),
    memory: &mut Memory,
    progress: &dyn Fn(&str),
) -> Fit {
    let noise = problem.noise_cost(problem.judgeable);
    let rest = |fit: &Fit| fit.cost(problem) - noise;
    let (mut current, mut goes_on) = (start, false);
    while current.hypothesis.effects.len() < most {
        if until == Until::LikeNoise && leaves_noise(problem, &current) {
            break;
        }
        // A first cause is looked for in any case: the verdict needs to know whether one explains the gap. So are others as long as each
        // takes most of what is left.
        if !current.hypothesis.effects.is_empty() && !goes_on && problem.effort.millions() > constants::most_effort() {
            break;
        }
        progress(&format!("causes found: {}", current.hypothesis.effects.len()));
        // A candidate must reach the required gain: one that acts on many channels may matter in none.
        let enough = |next: &Fit| {
            next.hypothesis.effects.last().is_some_and(|added| shortfall(problem, next, &current, *added) < 0.0)
        };
        let fits = extensions(problem, &current, &Wanted::any(problem), memory);
        let Some(next) = fits.into_iter().find(enough).map(|next| prune_earlier(problem, next)) else { break };
        if penalised_cost(problem, &next) >= penalised_cost(problem, &current) {
            break;
        }
        let next = two_at_once(problem, nominal_fit::refitted_from_momentum(problem, next));
        goes_on = 2.0 * rest(&next) < rest(&current);
        current = next;
    }
    current
}

/// How far causes are looked for.
#[derive(Clone, Copy, PartialEq)]
enum Until {
    /// Until no more are found.
    NoneIsLeft,
    /// Until what they leave is like noise.
    LikeNoise,
}

/// Whether the search ends with some causes.
pub(crate) type Ends<'a> = dyn FnMut(&Fit) -> bool + 'a;

/// Causes that were not yet compared with others.
pub(crate) struct Selected {
    null: Fit,
    forward: Fit,
    pruned: Pruned,
    memory: Memory,
}

impl Selected {
    /// The fit with all of them.
    pub(crate) fn fit(&self) -> &Fit {
        &self.pruned.fit
    }

    /// Where a search begins that goes on from here.
    pub(crate) fn begin(&self) -> Begin {
        Begin::of(&self.null, &self.pruned.fit, &self.memory)
    }
}

/// What was found before under another reading of the rows, or another noise: most of the way.
pub(crate) struct Begin {
    /// The nominal values alone.
    pub(crate) null: Hypothesis,
    /// With causes.
    causes: Hypothesis,
    memory: Memory,
}

impl Begin {
    /// At a fit of the nominal values.
    pub(crate) fn without_causes(null: &Fit) -> Self {
        Self::of(null, null, &Memory::default())
    }

    pub(crate) fn of(null: &Fit, causes: &Fit, memory: &Memory) -> Self {
        Self { null: null.hypothesis.clone(), causes: causes.hypothesis.clone(), memory: memory.for_another() }
    }
}

/// Selects causes of the gap, from what was found before if there is any; the problem's dispersion is then that of what they leave.
/// As soon as causes leave noise alone, `ends` is asked whether more are looked for. `progress` hears what is being done.
pub(crate) fn select(
    problem: &mut Problem<'_>,
    nominal: &Hypothesis,
    begin: Option<Begin>,
    ends: Option<&mut Ends<'_>>,
    progress: &dyn Fn(&str),
) -> Option<Selected> {
    progress("nominal model");
    let (null, known, mut memory) = match begin {
        Some(Begin { null, causes, memory }) => {
            let known = Some(causes).filter(|causes| !causes.effects.is_empty());
            (problem.fit(null, constants::iterations())?, known, memory)
        }
        None => (nominal_fit::fitted(problem, nominal)?, None, Memory::default()),
    };
    let known = known.and_then(|known| problem.fit(known, constants::iterations())).map(|fit| prune(problem, fit).fit);
    let start = known.unwrap_or_else(|| null.clone());
    let most = constants::most_causes();
    let until = if ends.is_some() { Until::LikeNoise } else { Until::NoneIsLeft };
    let mut current = forward_selection(problem, start, (most, until), &mut memory, progress);
    if let Some(ends) = ends
        && leaves_noise(problem, &current)
    {
        if ends(&current) {
            let pruned = Pruned { fit: current.clone(), without: Vec::new() };
            return Some(Selected { null, forward: current, pruned, memory });
        }
        current = forward_selection(problem, current, (most, Until::NoneIsLeft), &mut memory, progress);
    }
    let until = Until::NoneIsLeft;
    // A wrong first cause can mislead the choice of all later ones. Then the search starts again from other first
    // causes.
    if wide_open(problem, &current) && !current.hypothesis.effects.is_empty() {
        let first: Vec<Fit> = extensions(problem, &null, &Wanted::any(problem), &mut memory);
        for start in first.into_iter().skip(1).take(constants::restarts()) {
            if problem.effort.millions() > constants::most_effort_open() {
                break;
            }
            let other = forward_selection(problem, start, (most - 1, until), &mut memory, progress);
            if penalised_cost(problem, &other) < penalised_cost(problem, &current) {
                current = other;
            }
            if !wide_open(problem, &current) {
                break;
            }
        }
    }
    // Two errors of one sensor are no first cause one at a time: then from what all everyday effects at once tell. More causes than
    // are ever named rather stand for others, too.
    if (beyond_noise(problem, &current) || current.hypothesis.effects.len() > constants::most_named())
        && problem.effort.millions() < constants::most_effort_open()
        && let Some(start) = screened(problem, nominal, &current)
    {
        let other = forward_selection(problem, start, (most, until), &mut memory, progress);
        // Where names were out of reach, a search that brings them within it need not leave noise alone.
        let reached = out_of_reach(problem, &current) && !out_of_reach(problem, &other);
        let cheaper = penalised_cost(problem, &other) < penalised_cost(problem, &current);
        if cheaper && (reached || !beyond_noise(problem, &other)) {
            current = other;
        }
    }
    // What no hypothesis explains is over-dispersion: it makes every gain less certain.
    problem.dispersion = problem.dispersion_at(&current);
    let forward = current.clone();
    let mut pruned = prune(problem, current);
    // After the elimination there is room for further causes.
    if wide_open(problem, &pruned.fit) {
        let fit = forward_selection(problem, pruned.fit, (most, until), &mut memory, progress);
        pruned = Pruned::as_it_is(problem, fit);
    }
    Some(Selected { null, forward, pruned, memory })
}

/// Compares the causes selected with others that explain the log as well, and leaves out what is needless.
pub(crate) fn compare(problem: &Problem<'_>, selected: Selected, progress: &dyn Fn(&str)) -> Found {
    let Selected { null, forward, pruned, mut memory } = selected;
    progress("alternatives");
    let (best, alternatives) = exchange(problem, pruned, &mut memory);
    let (best, alternatives) = exchange_images(problem, best, alternatives, &mut memory);
    let (best, alternatives) = nearest_to_stated(problem, best, alternatives);
    let (best, alternatives) = one_of_each_tie(problem, &null, (best, alternatives), &mut memory);
    let (best, alternatives) = drop_needless_trifles(problem, &null, (best, alternatives));
    let (best, alternatives) = drop_uncertain(problem, drop_needless_parts(problem, best), alternatives);
    let without = alternatives.iter().map(|found| found.as_ref().map(|found| found.without.clone())).collect();
    let pairs = best.hypothesis.effects.iter().zip(&alternatives);
    let unrivalled = pairs.filter(|(_, found)| found.as_ref().is_some_and(|found| !found.searched)).map(|(e, _)| *e);
    let unrivalled = unrivalled.collect();
    let (ties, losses) = ties(problem, &best, alternatives);
    Found { null, forward, best, ties, losses, without, unrivalled, memory }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated};
    use crate::data::channel::Channel;
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::nominal::nominal_parameters;
    use plant_model::{Effects, Plant};
    use rig_files::RigFile;

    #[test]
    fn causes_that_each_take_most_of_what_is_left_are_found_after_much_work_too() {
        let rig = RigFile::paper_a();
        let hidden = Effects::none().with(Effect::PayloadMass, &[15.0]).with(Effect::LeakChamberA, &[2.0e-10]);
        let mut log = simulated(&rig, &hidden, 12_000, |t_s| 0.9 * (3.0 * t_s).sin() + 0.6 * (11.0 * t_s).sin());
        add_noise(&mut log, 2.0e-5, 300.0);
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &effort));
        let null = problem.fit(Hypothesis::null(&nominal), constants::iterations()).expect("a sound rig");
        let plant = Plant::new(&rig.rig, &rig.effects).expect("a sound rig");
        while effort.millions() <= constants::most_effort() {
            effort.add(100_000_000, Channel::Position.bit(), &plant);
        }
        let until = (constants::most_causes(), Until::NoneIsLeft);
        let found = forward_selection(&problem, null, until, &mut Memory::default(), &|_| {});
        let mut effects = found.hypothesis.effects;
        effects.sort_unstable();
        assert_eq!(effects, [Effect::LeakChamberA, Effect::PayloadMass]);
    }
}
