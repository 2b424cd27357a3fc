//! Which causes: forward composition, removal of what a later cause makes needless, exchange, ties.

use crate::balance::{Channel, Channels};
use crate::fit::{Fit, Problem, Slopes};
use crate::hypothesis::{self, Hypothesis, Parameter, Slot};
use crate::starts::{moves_in_step, starts, starts_fitted};
use plant_model::Effect;
use rayon::prelude::*;

/// A cause must lower the cost (minus log-likelihood) by at least this much, plus [`PER_PARAMETER`] for each parameter.
/// The level stands for four standard deviations of a nominal value: the point where a deviation within tolerance is
/// no longer a plausible explanation, over a hundred such values.
const GATE: f64 = 8.0;
const PER_PARAMETER: f64 = 3.0;
/// Alternatives whose cost is within this of the chosen cause cannot be told from it.
const TIE: f64 = 6.0;
/// So are those within this part of what the cause gains: the balances' numerical error, and when sticking pistons break
/// away, decide so small a difference.
const TIE_OF_GAIN: f64 = 0.003;
/// A candidate is fitted in full if its predicted gain is this part of what it must reach: predictions are linear.
const PROMISING: f64 = 0.4;
/// A cause must take away this part of the cost that pure noise would have in the channels it acts on.
const RELEVANT: f64 = 0.008;
/// And this part of what is left over there: breakaways a little early or late make the cost rugged, and everything
/// that moves them gains or loses by chance.
const RELEVANT_REST: f64 = 0.05;
/// What takes mass and friction along with it moves more breakaways.
const RELEVANT_REST_IN_STEP: f64 = 0.5;
/// Standard errors that a cause's parameter must be away from neutral.
const SURE: f64 = 4.0;
/// A cause that gains this many times what it must is there whatever its standard error.
const BEYOND_DOUBT: f64 = 10.0;
/// No more causes than this are composed.
const MOST_CAUSES: usize = 4;
/// Candidates fitted in full in each round, best predicted gain first.
const FITTED: usize = 7;
/// Iterations after which candidates are compared, and how many of them are then finished.
const FIRST_ITERATIONS: usize = 3;
const FINISHED: usize = 3;
const FINISHED_STRAINED: usize = 6;
/// Most candidates tried where nominal values are strained.
const MOST_STRAINED: usize = 14;
/// Candidates tried in the place of each cause, and how often causes are exchanged.
const ALTERNATIVES: usize = 5;
const EXCHANGES: usize = 2;
/// An exchange is likelier if the cost falls by this much; so many of them are tried to the end.
const LIKELIER: f64 = 4.0;
const MOST_PRUNED: usize = 2;
/// A balance with this many times the cost of noise is wide open; then as many other first causes are tried.
const WIDE_OPEN: f64 = 6.0;
const RESTARTS: usize = 2;
/// Fits of the same causes are one fit if their costs differ by no more than this.
const SAME: f64 = 1.0;
/// The best extensions found before are fitted anew where a channel's dispersion has changed by this factor.
const DISPERSED: f64 = 1.1;
/// Iterations of a full fit.
const ITERATIONS: usize = 20;

/// A hypothesis that was tried, for the appendix of the report.
#[derive(Clone, Debug)]
pub(crate) struct Tried {
    pub(crate) effects: Vec<Effect>,
    /// Cost with noise taken as white, whatever dispersion it was compared with: one scale for all.
    pub(crate) cost: f64,
    pub(crate) fitted: bool,
}

/// What a search remembers.
#[derive(Default)]
struct Memory {
    tried: Vec<Tried>,
    explored: Vec<Explored>,
}

/// The extensions of a set of causes.
struct Explored {
    from: Fit,
    /// Dispersion they were compared with.
    dispersion: [f64; 4],
    /// Each acts on one of these.
    acting: Channels,
    fits: Vec<Fit>,
}

impl Memory {
    /// What is known of extending a fit: another with the same causes, and no worse, was extended before. The last counts.
    fn extensions(&self, problem: &Problem<'_>, from: &Fit, acting: Channels) -> Option<&Explored> {
        let effects = &from.hypothesis.effects;
        let same = |known: &Fit| {
            known.hypothesis.effects.len() == effects.len()
                && known.hypothesis.effects.iter().all(|effect| effects.contains(effect))
        };
        let enough = |e: &Explored| acting & !e.acting == 0 && same(&e.from);
        self.explored.iter().rev().find(|e| enough(e) && e.from.cost(problem) < from.cost(problem) + SAME)
    }
}

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

/// What an effect must gain in a fit: enough against chance, and enough to matter in the channels it acts on, beside
/// their noise and beside what the fit leaves over there.
fn gate(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> f64 {
    // Air does not tell a scale of lengths from other values, see `Hypothesis::scale_lengths`.
    let (shows, rest) = if moves_in_step(effect) {
        (Channel::Position.bit(), RELEVANT_REST_IN_STEP)
    } else {
        (hypothesis::channels(effect), RELEVANT_REST)
    };
    let channels = shows & problem.judgeable & !Channel::Supply.bit();
    let noise = problem.noise_cost(channels);
    let left = (fit.cost_in(problem, channels) - noise).max(0.0);
    charge(effect).max(RELEVANT * noise).max(rest * left)
}

/// How much less than it should an effect gains in a fit beside the fit without it; negative if it gains enough. What it
/// gains by relieving strained nominal values needs no weight beside noise: tolerances have no numerical error.
fn wanting(problem: &Problem<'_>, with: &Fit, without: &Fit, effect: Effect) -> f64 {
    if negligible(with, effect) {
        return f64::INFINITY;
    }
    let relieved = without.prior_cost - with.prior_cost;
    let needed = if relieved > charge(effect) { charge(effect) } else { gate(problem, with, effect) };
    needed - (without.cost(problem) - with.cost(problem))
}

/// The parameters that make an effect present at all, with their places and how far they are from neutral. The time
/// constant means nothing while nothing droops, the wavelength while nothing ripples.
fn presence(fit: &Fit, effect: Effect) -> impl Iterator<Item = (usize, &Parameter, f64)> {
    let h = &fit.hypothesis;
    let tells = move |p: &Parameter| match p.slot {
        Slot::Effect(Effect::SupplyDroop, 1) | Slot::Effect(Effect::FrictionPosition, 2) => false,
        Slot::Effect(e, _) => e == effect,
        _ => false,
    };
    let all = h.parameters.iter().zip(&h.values).enumerate();
    all.filter(move |(_, (p, _))| tells(p)).map(|(place, (p, value))| (place, p, (value - p.neutral).abs()))
}

/// Whether an effect is present in name only.
fn negligible(fit: &Fit, effect: Effect) -> bool {
    presence(fit, effect).all(|(_, p, away)| away < p.negligible)
}

/// Whether no parameter of an effect is surely away from neutral, by the fit's standard errors.
fn unsure(fit: &Fit, effect: Effect) -> bool {
    let Some(covariance) = &fit.covariance else { return false };
    presence(fit, effect).all(|(place, _, away)| away < SURE * covariance[(place, place)].max(0.0).sqrt())
}

/// Cost with a charge for every cause and parameter: what is compared between hypotheses. Whether a cause matters is
/// another question, see [`gate`].
fn charged(problem: &Problem<'_>, fit: &Fit) -> f64 {
    if fit.hypothesis.effects.iter().any(|effect| negligible(fit, *effect)) {
        return f64::INFINITY;
    }
    with_charges(problem, fit)
}

fn with_charges(problem: &Problem<'_>, fit: &Fit) -> f64 {
    fit.cost(problem) + fit.hypothesis.effects.iter().map(|e| charge(*e)).sum::<f64>()
}

/// What a cause must gain against chance.
fn charge(effect: Effect) -> f64 {
    GATE + PER_PARAMETER * effect.parameter_count() as f64
}

/// What an addition is worth before what it makes needless is taken out: earlier causes may have become negligible.
fn promise(problem: &Problem<'_>, fit: &Fit) -> f64 {
    if fit.hypothesis.effects.last().is_some_and(|added| negligible(fit, *added)) {
        return f64::INFINITY;
    }
    with_charges(problem, fit)
}

/// Effects that the log could show at all.
pub(crate) fn candidates(problem: &Problem<'_>) -> Vec<Effect> {
    let has = problem.record.available;
    Effect::ALL
        .into_iter()
        .filter(|effect| {
            let channels = hypothesis::channels(*effect);
            let enough = match effect {
                // Needs the pressures of both chambers.
                Effect::LeakCrossPiston => has.pressure_a && has.pressure_b,
                // Between position and pressure only: both must be there to disagree.
                Effect::PositionDelay | Effect::PositionScale => has.pressure_a || has.pressure_b,
                _ => true,
            };
            enough && channels & problem.judgeable != 0
        })
        .collect()
}

/// A candidate addition with its starting values and the gain predicted for it.
struct Candidate {
    effect: Effect,
    starts: Vec<Vec<f64>>,
    predicted: f64,
}

/// Where additions to a fit are compared: on a part of the data, which stands for the rest.
struct Ground<'a> {
    thinned: Problem<'a>,
    /// How many times more data there is.
    ratio: f64,
    slopes: Slopes,
    /// The fit with strained nominal values back where they should be, if any are.
    relaxed: Option<(Fit, Slopes)>,
}

impl<'a> Ground<'a> {
    fn new(problem: &Problem<'a>, from: &Fit) -> Option<Self> {
        let (thinned, ratio) = problem.thinned();
        let slopes = thinned.slopes(from)?;
        let relax = || {
            let fit = thinned.judge(from.hypothesis.relaxed())?;
            let slopes = thinned.slopes(&fit)?;
            Some((fit, slopes))
        };
        let relaxed = if from.hypothesis.strained() == 0 { None } else { relax() };
        Some(Self { thinned, ratio, slopes, relaxed })
    }

    /// The slopes nearest to an addition that begins with strained values anew or where they are.
    fn slopes(&self, anew: bool) -> &Slopes {
        self.relaxed.as_ref().filter(|_| anew).map_or(&self.slopes, |(_, slopes)| slopes)
    }
}

/// The candidates for one more cause that acts on some channels, most promising first.
fn promising(problem: &Problem<'_>, from: &Fit, ground: &Ground<'_>, acting: Channels) -> Vec<Candidate> {
    let open: Vec<(Effect, Vec<f64>)> = candidates(problem)
        .into_iter()
        .filter(|e| !from.hypothesis.effects.contains(e) && hypothesis::channels(*e) & acting != 0)
        .flat_map(|e| starts(problem, from, e).into_iter().map(move |start| (e, start)))
        .collect();
    let extended: Vec<Hypothesis> = open
        .iter()
        .map(|(effect, start)| from.hypothesis.beside(*effect, problem.parameters(*effect), start))
        .collect();
    let mut scores = ground.thinned.scores(from, &ground.slopes, &extended);
    // Strained nominal values hide what an effect would gain: it is judged from where they should be as well.
    if let Some((fit, slopes)) = &ground.relaxed {
        let strained = from.hypothesis.strained();
        let relieves = |k: &usize| hypothesis::channels(open[*k].0) & strained != 0 && !moves_in_step(open[*k].0);
        let relieving: Vec<usize> = (0..open.len()).filter(relieves).collect();
        let beside = |k: &usize| {
            let (effect, start) = &open[*k];
            fit.hypothesis.beside(*effect, problem.parameters(*effect), start)
        };
        let others = ground.thinned.scores(fit, slopes, &relieving.iter().map(beside).collect::<Vec<_>>());
        relieving.into_iter().zip(others).for_each(|(k, other)| scores[k] = scores[k].max(other));
    }
    scores.iter_mut().for_each(|score| *score *= ground.ratio);
    let mut out: Vec<Candidate> = Vec::new();
    let mut order: Vec<usize> = (0..open.len()).collect();
    order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
    for index in order {
        let (effect, start) = &open[index];
        let predicted = scores[index];
        match out.iter_mut().find(|c| c.effect == *effect) {
            Some(candidate) if candidate.starts.len() < starts_fitted(*effect) => candidate.starts.push(start.clone()),
            Some(_) => {}
            None => out.push(Candidate { effect: *effect, starts: vec![start.clone()], predicted }),
        }
    }
    out.sort_by(|a, b| b.predicted.total_cmp(&a.predicted));
    out
}

/// Which additions to a fit are wanted.
struct Wanted {
    /// They act on one of these.
    acting: Channels,
    /// How many are fitted.
    most: usize,
    /// A cost above which they are of no use.
    goal: f64,
}

impl Wanted {
    /// Anything that helps.
    fn any(problem: &Problem<'_>) -> Self {
        Self { acting: problem.judgeable, most: FITTED, goal: f64::INFINITY }
    }
}

/// Fits the most promising additions to a hypothesis; the best first.
fn extensions(problem: &Problem<'_>, from: &Fit, wanted: &Wanted, memory: &mut Memory) -> Vec<Fit> {
    let (explored, mut fits) = match memory.extensions(problem, from, wanted.acting) {
        Some(explored) => (explored.acting, again(problem, explored)),
        None => (wanted.acting, explore(problem, from, wanted, &mut memory.tried)),
    };
    let dispersion = problem.dispersion;
    memory.explored.push(Explored { from: from.clone(), dispersion, acting: explored, fits: fits.clone() });
    let acts = |effect: &Effect| hypothesis::channels(*effect) & wanted.acting != 0;
    fits.retain(|fit| fit.hypothesis.effects.last().is_some_and(acts));
    fits
}

/// Extensions found before, as they compare now.
fn again(problem: &Problem<'_>, explored: &Explored) -> Vec<Fit> {
    let mut fits = explored.fits.clone();
    let by_promise = |a: &Fit, b: &Fit| promise(problem, a).total_cmp(&promise(problem, b));
    fits.sort_by(by_promise);
    let changed = |(new, old): (f64, f64)| new.max(old) > DISPERSED * new.min(old);
    if problem.dispersion.into_iter().zip(explored.dispersion).any(changed) {
        let first = fits.len().min(FINISHED);
        fits[..first].par_iter_mut().for_each(|fit| {
            if let Some(better) = problem.fit(fit.hypothesis.clone(), ITERATIONS) {
                *fit = better;
            }
        });
        fits.sort_by(by_promise);
    }
    fits
}

/// Extensions found anew.
fn explore(problem: &Problem<'_>, from: &Fit, wanted: &Wanted, tried: &mut Vec<Tried>) -> Vec<Fit> {
    let Some(ground) = Ground::new(problem, from) else { return Vec::new() };
    let mut candidates = promising(problem, from, &ground, wanted.acting);
    let base = from.cost(problem);
    let worth = |c: &Candidate| c.predicted > PROMISING * gate(problem, from, c.effect);
    let mut count = candidates.iter().take_while(|c| worth(c)).count().min(wanted.most);
    // Where nominal values are strained they hide what an effect would gain; then all that act there are tried.
    let strained = from.hypothesis.strained();
    if strained != 0 {
        candidates.sort_by_key(|c| hypothesis::channels(c.effect) & strained == 0 && !worth(c));
        let tried = candidates.iter().take_while(|c| hypothesis::channels(c.effect) & strained != 0 || worth(c));
        count = tried.count().min(MOST_STRAINED);
    }
    let flows = Channel::PressureA.bit() | Channel::PressureB.bit();
    if candidates[..count].iter().any(|c| hypothesis::channels(c.effect) & flows != 0)
        && let Some(place) = candidates.iter().position(|c| c.effect == Effect::ChokedFlow)
        && place >= count
    {
        candidates[count..=place].rotate_right(1);
        count += 1;
    }
    let (chosen, rest) = candidates.split_at(count);
    let list = |effect: Effect| {
        let mut effects = from.hypothesis.effects.clone();
        effects.push(effect);
        effects
    };
    tried.extend(rest.iter().map(|c| Tried {
        effects: list(c.effect),
        cost: from.undispersed() - c.predicted,
        fitted: false,
    }));
    let starts: Vec<(Effect, &[f64])> =
        chosen.iter().flat_map(|c| c.starts.iter().map(|start| (c.effect, &start[..]))).collect();
    // A few steps on a part of the data show which are worth more.
    // Strained values stood in for what is missing: they start anew, or from where they are, whichever leads farther.
    let mut begun: Vec<Fit> = starts
        .par_iter()
        .filter_map(|(effect, start)| {
            let ways: &[bool] = if moves_in_step(*effect) {
                &[false]
            } else if strained & hypothesis::channels(*effect) == 0 {
                &[true]
            } else {
                &[true, false]
            };
            let begin = |anew: &bool| {
                let extended = from.hypothesis.with(*effect, problem.parameters(*effect), start, *anew);
                let (channels, slopes) = (hypothesis::channels(*effect), ground.slopes(*anew));
                let fit = ground.thinned.begin(extended, channels, FIRST_ITERATIONS, slopes)?;
                // What only tolerances tell apart must follow all data closely before they show.
                let on_all_data = if moves_in_step(*effect) { FIRST_ITERATIONS } else { 0 };
                problem.refit(fit.hypothesis, channels, on_all_data)
            };
            ways.par_iter().filter_map(begin).min_by(|a, b| a.cost(problem).total_cmp(&b.cost(problem)))
        })
        .collect();
    begun.sort_by(|a, b| a.cost(problem).total_cmp(&b.cost(problem)));
    let lowest = begun.first().map_or(base, |fit| fit.cost(problem));
    let worthy = |fit: &Fit| fit.cost(problem) < lowest + 0.5 * (base - lowest).max(0.0) + 2.0 * TIE;
    // From strained values a few steps lead less far.
    let most = if strained == 0 { FINISHED } else { FINISHED_STRAINED };
    let finished = begun.iter().take_while(|fit| worthy(fit)).count().clamp(1, most).min(begun.len());
    let mut fits: Vec<Fit> = begun
        .par_iter()
        .enumerate()
        .filter_map(|(place, fit)| {
            let changed = fit.hypothesis.effects.last().map_or(0, |effect| hypothesis::channels(*effect));
            let finish = || problem.settle(fit.hypothesis.clone(), changed, ITERATIONS, lowest.min(wanted.goal));
            if place < finished { finish() } else { Some(fit.clone()) }
        })
        .collect();
    // The same effect from several starts: the best one counts.
    fits.sort_by(|a, b| a.cost(problem).total_cmp(&b.cost(problem)));
    let mut seen: Vec<Effect> = Vec::new();
    fits.retain(|fit| {
        let added = fit.hypothesis.effects.last().copied();
        added.is_some_and(|effect| {
            !seen.contains(&effect) && {
                seen.push(effect);
                true
            }
        })
    });
    fits.sort_by(|a, b| promise(problem, a).total_cmp(&promise(problem, b)));
    tried.extend(fits.iter().map(|fit| Tried {
        effects: fit.hypothesis.effects.clone(),
        cost: fit.undispersed(),
        fitted: true,
    }));
    fits
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
        let pruned = fits.into_iter().filter(enough).take(MOST_PRUNED).map(|next| prune(problem, next));
        let before = charged(problem, &current);
        let Some(next) = pruned.into_iter().find(|next| charged(problem, next) < before) else { break };
        current = next;
    }
    current
}

/// Whether a fit leaves a balance so far from noise that its causes may be the wrong ones altogether.
fn wide_open(problem: &Problem<'_>, fit: &Fit) -> bool {
    let open = |channel: &Channel| fit.cost_in(problem, channel.bit()) > WIDE_OPEN * problem.noise_cost(channel.bit());
    Channel::ALL.iter().filter(|c| problem.judgeable & c.bit() != 0).any(open)
}

/// Whether a part of the data shows already, beyond doubt, that a fit needs a cause.
fn needed(thinned: &Problem<'_>, fit: &Fit, effect: Effect) -> bool {
    let least = BEYOND_DOUBT * gate(thinned, fit, effect);
    let smaller = fit.hypothesis.without(effect, thinned.nominal);
    let without = thinned.settle(smaller, hypothesis::channels(effect), ITERATIONS, fit.cost(thinned) + least);
    !negligible(fit, effect) && without.is_some_and(|without| without.cost(thinned) - fit.cost(thinned) > least)
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
    let pruned = prune(problem, current);
    progress("alternatives");
    let (best, alternatives) = exchange(problem, pruned, &mut memory);
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

fn alternatives(problem: &Problem<'_>, best: &Fit, effect: Effect, memory: &mut Memory) -> Option<Alternatives> {
    let without = refit_without(problem, best, effect)?;
    let goal = best.cost(problem) + gate(problem, best, effect);
    let wanted = Wanted { acting: hypothesis::channels(effect), most: ALTERNATIVES, goal };
    let instead = extensions(problem, &without, &wanted, memory);
    Some(Alternatives { without, instead })
}

/// The fit without one of its causes.
fn refit_without(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Fit> {
    let smaller = fit.hypothesis.without(effect, problem.nominal);
    let goal = fit.cost(problem) + gate(problem, fit, effect);
    problem.settle(smaller, hypothesis::channels(effect), ITERATIONS, goal)
}

/// Replaces causes one at a time by better ones, as long as that helps; with what else could stand for each.
fn exchange(problem: &Problem<'_>, mut best: Fit, memory: &mut Memory) -> (Fit, Vec<Option<Alternatives>>) {
    for round in 0.. {
        let effects = best.hypothesis.effects.clone();
        let all: Vec<_> = effects.iter().map(|effect| alternatives(problem, &best, *effect, memory)).collect();
        let (cost, enough) = (best.cost(problem), charged(problem, &best) - 1.0);
        // A likelier exchange may be dearer only until what it makes needless is taken out.
        let better = |fit: &&Fit| promise(problem, fit) < enough || fit.cost(problem) < cost - LIKELIER;
        let mut likelier: Vec<&Fit> = all.iter().flatten().flat_map(|a| &a.instead).filter(better).collect();
        likelier.sort_by(|a, b| promise(problem, a).total_cmp(&promise(problem, b)));
        likelier.truncate(if round < EXCHANGES { MOST_PRUNED } else { 0 });
        let exchanged = likelier
            .into_iter()
            .map(|fit| prune(problem, fit.clone()))
            .filter(|fit| charged(problem, fit) < enough)
            .min_by(|a, b| charged(problem, a).total_cmp(&charged(problem, b)));
        match exchanged {
            Some(fit) => best = fit,
            None => return (best, all),
        }
    }
    (best, Vec::new())
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
            tied.extend(as_good.filter_map(|fit| fit.hypothesis.effects.last().copied()).filter(|e| e != effect));
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
