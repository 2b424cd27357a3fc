//! Which causes are named and which are leads, and the verdict.

use super::closure::{closed_cost, judged, like_noise, misfit_of};
use super::confirmation::{confirmed_singly, confirmed_together};
use super::foreign_terms;
use super::hold_out::{HORIZON_S, Predictions};
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::estimate::likelihood::by_chance;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::parameter::Parameter;
use crate::outcome::{Balance, Cause};
use crate::select::penalty::told_only_together;
use crate::select::search::Found;
use nalgebra::{DMatrix, DVector};
use plant_model::Effect;
use rig_files::Verdict;

/// The causes found, divided into named ones and leads, with what the verdict needs.
pub(crate) struct Judgement {
    pub(crate) causes: Vec<Cause>,
    /// Effects that lower the misfit but are not proven.
    pub(crate) leads: Vec<Cause>,
    /// Channels whose balance stays open.
    pub(crate) open: Channels,
    /// Whether part of the gap remains that no named cause explains.
    gap: bool,
    /// Whether the causes are not confirmed on the part held back and all balances look like noise without them.
    quiet: bool,
}

impl Judgement {
    /// Takes back the names of some effects: what they explained has no known cause then.
    pub(crate) fn doubt(&mut self, effects: &[Effect]) {
        let doubtful = |cause: &Cause| effects.iter().any(|effect| effect.id() == cause.id);
        let (doubted, kept): (Vec<Cause>, Vec<Cause>) =
            core::mem::take(&mut self.causes).into_iter().partition(doubtful);
        self.gap |= !doubted.is_empty();
        self.causes = kept;
        self.leads.extend(doubted);
    }

    /// `closed`: whether the whole model predicts the part held back with what is named as well as noise allows.
    pub(crate) fn verdict(&self, closed: bool) -> Verdict {
        match (self.causes.is_empty(), self.gap && !self.quiet || !closed) {
            (true, false) => Verdict::NoGap,
            (true, true) => Verdict::Unexplained,
            (false, false) => Verdict::Explained,
            (false, true) => Verdict::PartlyExplained,
        }
    }
}

/// Judges the causes found, given in the order of the best fit's effects. `predictions`: of that fit, if the log allows any.
pub(crate) fn judge(
    problem: &Problem<'_>,
    found: &Found,
    balances: &[Balance],
    all: Vec<Cause>,
    predictions: Option<&Predictions<'_>>,
) -> Judgement {
    let open: Channels = balances.iter().filter(|b| !b.closed).map(|b| b.channel.bit()).sum();
    // More causes at once rather approximate a single effect that the catalogue lacks.
    let few = all.iter().filter(|c| c.share >= constants::trifle()).count() <= constants::most_named();
    let trifles = all.len() > constants::most_named();
    let held = explains_excess(problem, &found.null, &found.best, touched(found))
        && confirmed_together(problem, found, predictions);
    let singly = confirmed_singly(problem, found);
    let without = |place: usize| found.without.get(place).and_then(Option::as_ref);
    // Beside large causes a trifle that only suppresses noise would pass together with them.
    let counts = |place: usize, cause: &Cause, effect: &Effect| {
        cause.share >= constants::trifle()
            || without(place)
                .is_none_or(|without| explains_excess(problem, without, &found.best, effects::channels(*effect)))
    };
    // While a balance is open, a cause for which no alternatives were tried is no more than a guess.
    let guess = |effect: &Effect| open != 0 && found.unrivalled.contains(effect);
    let closed = |effect: &Effect| effects::channels(*effect) & open == 0 && !guess(effect);
    // What a lead leaves open elsewhere says nothing of a cause whose own balances are closed.
    let in_reach = found.best.hypothesis.effects.iter().filter(|effect| closed(effect));
    let in_reach = in_reach.fold(0, |all, effect| all | effects::channels(*effect));
    let most = explains_most(if in_reach == 0 { touched(found) } else { in_reach }, balances);
    // Values that act in open balances alone make up for what is missing there.
    let confirmed = few && most && held && are_likely(&found.best, !open);
    let told = open != 0 || !few || trifles || !most;
    let stands = |place: usize, cause: &Cause, effect: &Effect| {
        // While a balance is open, a cause with a small share may only compensate for what is missing there.
        let large = open == 0 || cause.share >= constants::least_share_beside_a_gap();
        let little = cause.share < constants::least_share() && !restores_rig(problem, without(place), &found.best);
        let trifle = trifles && cause.share < constants::trifle() || little;
        let confirmed =
            confirmed && singly.get(place).is_none_or(|confirmed| *confirmed) && counts(place, cause, effect);
        let shadow =
            without(place).is_some_and(|without| !takes_more_than_is_left(problem, without, *effect, balances));
        let certain = !told_only_together(&found.best, *effect);
        closed(effect) && confirmed && large && !trifle && !shadow && certain
    };
    let (mut causes, mut leads) = (Vec::new(), Vec::new());
    for (place, (cause, effect)) in all.into_iter().zip(&found.best.hypothesis.effects).enumerate() {
        if stands(place, &cause, effect) { causes.push(cause) } else { leads.push(cause) }
    }
    doubt_beside_leads(&mut causes, &mut leads);
    // A model that errs as a whole is no place for names whose alternatives were never tried.
    let unrivalled = |cause: &Cause| found.unrivalled.iter().any(|effect| effect.id() == cause.id);
    let guessed = !causes.is_empty() && causes.iter().all(unrivalled) && !closes(problem, predictions);
    if guessed {
        leads.append(&mut causes);
    }
    // Only where a name is in reach, or whether there is a gap is still to be told: the search for such terms takes its time.
    let in_question = !guessed && (!causes.is_empty() || !told);
    let superseded = if in_question { superseded(problem, found) } else { Vec::new() };
    let outdone = |cause: &Cause| superseded.iter().any(|effect| effect.id() == cause.id);
    leads.extend(causes.extract_if(.., |cause| outdone(cause)));
    doubt_beside_leads(&mut causes, &mut leads);
    let by_share = |a: &Cause, b: &Cause| b.share.total_cmp(&a.share);
    causes.sort_by(by_share);
    leads.sort_by(by_share);
    // Without a named cause there is a gap only if a balance is clearly open under the nominal model.
    let any = !found.best.hypothesis.effects.is_empty();
    let plain = |b: &Balance| b.nominal_misfit >= 0.5 * closed_cost(b.channel);
    let unclosed = any && causes.is_empty() && balances.iter().any(plain);
    let gap = told || guessed || !superseded.is_empty() || unclosed;
    let quiet = !held && balances.iter().all(|b| b.nominal_misfit < constants::like_noise());
    Judgement { causes, leads, open, gap, quiet }
}

/// Whether the nominal values of a fit are, all together, no farther from those stated than their tolerances make likely. Values that
/// are all off by two or three tolerances at once rather stand for a cause that was not found, and names beside them would be guesses.
///
/// A maximum a posteriori estimate strays from nominal, in tolerances, with the covariance `I - S`, where `S` is the one it is left with.
/// Along its principal axes that the log tells better than half, squares over that variance are those of normal variables.
pub(crate) fn is_likely_rig(fit: &Fit) -> bool {
    are_likely(fit, Channels::MAX)
}

/// The same of the nominal values that act in some channels.
fn are_likely(fit: &Fit, channels: Channels) -> bool {
    let hypothesis = &fit.hypothesis;
    let stated =
        |(place, (p, value)): (usize, (&Parameter, &f64))| Some((place, p.tolerance?, p.tolerances_off(*value)?));
    let pairs = hypothesis.parameters.iter().zip(&hypothesis.values).enumerate();
    let acting = pairs.filter(|(_, (p, _))| p.channels & channels != 0);
    let stated: Vec<(usize, f64, f64)> = acting.filter_map(stated).collect();
    let Some(covariance) = &fit.covariance else { return true };
    let left = DMatrix::from_fn(stated.len(), stated.len(), |row, column| {
        let ((i, of_i, _), (j, of_j, _)) = (stated[row], stated[column]);
        covariance[(i, j)] / (of_i * of_j)
    });
    // No value open to correction, or errors that could not be told: nothing speaks against the rig, and there are no axes.
    if stated.is_empty() || left.iter().any(|variance| !variance.is_finite()) {
        return true;
    }
    let away = DVector::from_iterator(stated.len(), stated.iter().map(|(.., away)| *away));
    let axes = left.symmetric_eigen();
    let told = axes.eigenvalues.iter().zip(axes.eigenvectors.column_iter()).filter(|(left, _)| **left < 0.5);
    let squares: Vec<f64> = told.map(|(left, axis)| axis.dot(&away).powi(2) / (1.0 - left.max(0.0))).collect();
    squares.iter().sum::<f64>() <= chi_squared(squares.len() as f64, constants::likely_rig())
}

/// Whether nominal values are likely with a cause and all together unlikely without it: however small a part of the gap that is, the
/// rig file's tolerances ask for the cause.
fn restores_rig(problem: &Problem<'_>, without: Option<&Fit>, with: &Fit) -> bool {
    without.is_some_and(|without| is_likely_rig(with) && !is_likely_rig(&problem.with_errors(without.clone())))
}

/// What a sum of so many squared normal variables reaches at so many standard deviations, by Wilson and Hilferty (1931).
fn chi_squared(count: f64, standard_deviations: f64) -> f64 {
    let variance = 2.0 / (9.0 * count.max(1.0));
    count.max(1.0) * (1.0 - variance + standard_deviations * variance.sqrt()).powi(3)
}

/// Whether the whole model predicts the part held back as well as noise allows; so it does where the log allows no predictions.
pub(crate) fn closes(problem: &Problem<'_>, predictions: Option<&Predictions<'_>>) -> bool {
    let predicted = predictions.and_then(|predictions| predictions.gain(problem, None, HORIZON_S));
    predicted.is_none_or(|(gain, _)| gain.closed())
}

/// A cause that shares a balance with a lead may only compensate for that lead's error: it becomes one.
fn doubt_beside_leads(causes: &mut Vec<Cause>, leads: &mut Vec<Cause>) {
    loop {
        let doubtful = acted_on(leads.iter().filter(|c| c.share >= constants::trifle()));
        let shares = |c: &Cause| Effect::from_id(&c.id).is_some_and(|e| effects::channels(e) & doubtful != 0);
        let Some(place) = causes.iter().position(shares) else { break };
        leads.push(causes.remove(place));
    }
}

/// The channels that some causes act on.
pub(crate) fn acted_on<'a>(causes: impl IntoIterator<Item = &'a Cause>) -> Channels {
    causes.into_iter().filter_map(|c| Effect::from_id(&c.id)).fold(0, |all, e| all | effects::channels(e))
}

/// The channels that the causes act on.
fn touched(found: &Found) -> Channels {
    found.best.hypothesis.effects.iter().fold(0, |all, e| all | effects::channels(*e))
}

/// Causes that terms outside the catalogue make needless, or that one of them replaces.
fn superseded(problem: &Problem<'_>, found: &Found) -> Vec<Effect> {
    let touched = touched(found);
    if touched == 0 {
        return Vec::new();
    }
    let extended = foreign_terms::extend(problem, &found.best, touched, constants::most_terms());
    // Terms that only suppress noise describe nothing that the catalogue lacks.
    let tells = |with: &Fit| explains_excess(problem, &found.best, with, touched);
    if extended.terms.is_empty() || !tells(&extended.fit) {
        return Vec::new();
    }
    let needless = foreign_terms::superseded(problem, &extended);
    let replaced = |(effect, without): (&Effect, &Option<Fit>)| {
        let without = without.as_ref().filter(|_| !needless.contains(effect))?;
        let other = foreign_terms::replacing(problem, &found.best, *effect, without)?;
        tells(&other).then_some(*effect)
    };
    let pairs = found.best.hypothesis.effects.iter().zip(&found.without);
    let replaced: Vec<Effect> = pairs.filter_map(replaced).collect();
    [needless, replaced].concat()
}

/// Whether the causes remove more misfit from the balances they act on (`touched`) than they leave. Otherwise most of the gap has
/// another reason, and the names would be guesses.
fn explains_most(touched: Channels, balances: &[Balance]) -> bool {
    gains_more_than_is_left(touched, balances, |balance| balance.nominal_misfit)
}

/// The same of one cause and its own balances: a small one beside larger ones may be the shadow of what all of them leave there.
fn takes_more_than_is_left(problem: &Problem<'_>, without: &Fit, effect: Effect, balances: &[Balance]) -> bool {
    gains_more_than_is_left(effects::channels(effect), balances, |balance| misfit_of(problem, without, balance.channel))
}

/// Whether misfit falls from what it was `before` by more than what is left of it beyond noise.
fn gains_more_than_is_left(touched: Channels, balances: &[Balance], before: impl Fn(&Balance) -> f64) -> bool {
    let (mut gained, mut left) = (0.0, 0.0);
    for balance in balances.iter().filter(|b| touched & b.channel.bit() != 0) {
        gained += before(balance) - balance.extended_misfit;
        if !like_noise(balance.extended_misfit, balance.remaining_dispersion) {
            left += (balance.extended_misfit - constants::like_noise()).max(0.0);
        }
    }
    left == 0.0 || gained > left
}

/// Whether misfit beyond noise, and strain of nominal values, is less with some causes than without them.
fn explains_excess(problem: &Problem<'_>, without: &Fit, with: &Fit, touched: Channels) -> bool {
    // Between distant rows, and those of the air behind hoses, the balances err by themselves: what is like noise tells nothing.
    let air = |channel: Channel| [Channel::PressureA, Channel::PressureB].contains(&channel);
    let rough = |channel: Channel| problem.record.has_distant_rows() || air(channel) && problem.rig.rig.has_hoses();
    let balances = judged(problem).filter(|channel| touched & channel.bit() != 0).map(|channel| {
        let [before, after] = [without, with].map(|fit| misfit_of(problem, fit, channel));
        let noise = problem.noise_cost(channel.bit());
        let least = if rough(channel) { constants::like_noise() } else { 1.0 };
        let doubted = air(channel) && problem.record.curve_doubt > 0.0;
        Excess { before, after, noise, like: level(after, doubted) * least.max(by_chance(noise)) }
    });
    touched == 0 || mostly_beyond_noise(without.prior_cost - with.prior_cost, balances)
}

/// How much of what counts as noise is noise, given the misfit that causes leave. What is not known of the curve of a table counts as
/// noise, where it is in doubt: causes that leave less show that it is less.
fn level(after: f64, doubted: bool) -> f64 {
    if doubted { after.min(1.0) } else { 1.0 }
}

/// What causes make of a balance.
struct Excess {
    /// Misfit without and with them.
    before: f64,
    after: f64,
    /// The cost of its noise.
    noise: f64,
    /// A misfit up to this is noise.
    like: f64,
}

/// Whether enough of what is gained lies beyond noise: in strain of nominal values (`relieved`), and in some balances. A model that
/// suppresses noise, such as a very large volume or mass, lowers the misfit below that of white noise: that is no gain.
fn mostly_beyond_noise(relieved: f64, balances: impl Iterator<Item = Excess>) -> bool {
    let (mut beyond_noise, mut all) = (relieved, relieved);
    for Excess { before, after, noise, like } in balances {
        beyond_noise += (before.max(like) - after.max(like)) * noise;
        all += (before - after) * noise;
    }
    beyond_noise >= constants::least_excess() * all.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::hypothesis::Hypothesis;
    use crate::model::nominal::nominal_parameters;
    use rig_files::RigFile;

    fn judgement(named: bool, gap: bool, quiet: bool) -> Judgement {
        let cause =
            Cause { id: "payload-mass".into(), parameters: vec![], ties: vec![], evidence: String::new(), share: 1.0 };
        Judgement { causes: if named { vec![cause] } else { vec![] }, leads: vec![], open: 0, gap, quiet }
    }

    #[test]
    fn what_only_suppresses_noise_is_no_gain() {
        for (relieved, balances, like, expected) in [
            // Nothing touched, nothing gained: nothing to object to.
            (0.0, vec![], 1.0, true),
            (0.0, vec![(3.0, 1.0, 100.0)], 1.0, true),
            (0.0, vec![(0.95, 0.88, 100.0)], 1.0, false),
            (0.0, vec![(1.1, 0.9, 100.0)], 1.0, true),
            (0.0, vec![(1.01, 0.9, 100.0)], 1.0, false),
            // Nominal values that are no longer strained count in full.
            (10.0, vec![(0.95, 0.88, 100.0)], 1.0, true),
            // A balance that gets worse beyond noise beside one that only gets quieter.
            (0.0, vec![(1.0, 1.2, 100.0), (0.9, 0.5, 100.0)], 1.0, false),
            // Between distant rows more is noise.
            (0.0, vec![(1.1, 1.05, 100.0)], 1.0, true),
            (0.0, vec![(1.1, 1.05, 100.0)], 1.25, false),
        ] {
            let excess = |(before, after, noise)| Excess { before, after, noise, like };
            let found = mostly_beyond_noise(relieved, balances.iter().copied().map(excess));
            assert_eq!(found, expected, "{relieved} {balances:?} {like}");
        }
    }

    #[test]
    fn beside_a_doubted_curve_what_causes_leave_says_how_much_is_noise() {
        let is_gain = |doubted: bool| {
            let excess = |(before, after): (f64, f64)| Excess {
                before,
                after,
                noise: 3000.0,
                like: level(after, doubted) * constants::like_noise(),
            };
            mostly_beyond_noise(0.0, [(1.2, 0.8), (1.1, 0.75)].into_iter().map(excess))
        };
        assert!(is_gain(true) && !is_gain(false));
        assert!(level(1.3, true) == 1.0 && level(0.7, false) == 1.0);
    }

    #[test]
    fn values_that_are_all_off_together_are_no_likely_rig_unless_the_log_tells_none_of_them() {
        let mut rig = RigFile::paper_a();
        rig.tolerance.default = 0.02;
        let channels = Channel::PressureA.bit() | Channel::PressureB.bit() | Channel::Position.bit();
        let nominal = nominal_parameters(&rig, channels, false, &[1.0, -1.0]);
        let is_likely = |away: f64, of: usize, left: f64| {
            let mut hypothesis = Hypothesis::null(&nominal);
            let mut covariance = DMatrix::zeros(nominal.len(), nominal.len());
            for (place, p) in nominal.iter().enumerate() {
                let tolerance = p.tolerance.expect("stated");
                covariance[(place, place)] = (left * tolerance).powi(2);
                if place < of {
                    hypothesis.values[place] += away * tolerance;
                }
            }
            is_likely_rig(&Fit::of_values(hypothesis, covariance))
        };
        let all = nominal.len();
        assert!(all > 5, "{all}");
        assert!(is_likely(1.0, all, 0.1) && is_likely(2.5, 1, 0.1));
        assert!(!is_likely(2.5, all, 0.1) && !is_likely(9.0, 1, 0.1));
        assert!(is_likely(2.5, all, 1.0) && is_likely(2.5, all, f64::NAN));
        let without_any = Hypothesis::null(&[]);
        assert!(is_likely_rig(&Fit::of_values(without_any, DMatrix::zeros(0, 0))));
    }

    #[test]
    fn values_of_the_air_alone_say_nothing_of_a_cause_in_the_force_balance() {
        let mut rig = RigFile::paper_a();
        rig.tolerance.default = 0.02;
        let air = Channel::PressureA.bit() | Channel::PressureB.bit();
        let nominal = nominal_parameters(&rig, air | Channel::Position.bit(), false, &[1.0, -1.0]);
        let off = |moved: &dyn Fn(&Parameter) -> bool| {
            let mut hypothesis = Hypothesis::null(&nominal);
            let tolerances = nominal.iter().map(|p| p.tolerance.expect("stated")).collect::<Vec<f64>>();
            let off = hypothesis.values.iter_mut().zip(&nominal).zip(&tolerances).filter(|((_, p), _)| moved(p));
            off.for_each(|((value, _), tolerance)| *value += 4.0 * tolerance);
            let variances = tolerances.iter().map(|tolerance| (0.1 * tolerance).powi(2)).collect();
            Fit::of_values(hypothesis, DMatrix::from_diagonal(&DVector::from_vec(variances)))
        };
        let air_alone = off(&|p| p.channels & !air == 0);
        assert!(are_likely(&air_alone, !air) && !is_likely_rig(&air_alone));
        assert!(!are_likely(&off(&|p| p.channels & !air != 0), !air));
    }

    #[test]
    fn sums_of_squares_reach_what_tables_say_once_in_a_thousand() {
        // Quantiles of 99.9 % (Abramowitz and Stegun, table 26.8).
        for (count, table) in [(1.0, 10.83), (5.0, 20.52), (10.0, 29.59), (20.0, 45.31), (30.0, 59.70)] {
            let found = chi_squared(count, 3.09);
            assert!((found / table - 1.0).abs() < 0.04, "{count}: {found}");
        }
    }

    #[test]
    fn a_cause_takes_more_of_its_balances_than_is_left_there_or_is_a_shadow_of_it() {
        let balance = |channel, extended_misfit, remaining_dispersion| Balance {
            channel,
            nominal_misfit: 30.0,
            extended_misfit,
            remaining_dispersion,
            closed: true,
            depends_on: vec![],
            peak: None,
        };
        let force = Channel::Position.bit();
        for (misfit, dispersion, without, expected) in [
            (1.44, 1.36, 1.56, false),
            (1.44, 1.36, 1.64, true),
            // What is left may be noise: nothing it could be the shadow of.
            (1.2, 1.1, 1.21, true),
        ] {
            // What is left of another balance does not count.
            let balances = [balance(Channel::PressureA, 9.0, 40.0), balance(Channel::Position, misfit, dispersion)];
            let found = gains_more_than_is_left(force, &balances, |_| without);
            assert_eq!(found, expected, "{misfit} {dispersion} {without}");
        }
    }

    #[test]
    fn misfit_that_noise_reaches_by_chance_is_within_two_of_its_standard_deviations() {
        // 5000 squares of white noise: their mean is one, its standard deviation 0.02.
        assert!((by_chance(2500.0) - 1.04).abs() < 1e-12);
        let gained = |like| {
            // A large volume that took a little from one balance and much of the other's noise.
            let excess = |(before, after)| Excess { before, after, noise: 2500.0, like };
            mostly_beyond_noise(0.0, [(1.039, 0.999), (0.93, 0.796)].into_iter().map(excess))
        };
        assert!(gained(1.0) && !gained(by_chance(2500.0)));
    }

    #[test]
    fn the_verdict_follows_from_names_gap_noise_and_hold_out() {
        use Verdict as V;
        // named, gap left, noise only, hold-out closed
        for ((named, gap, quiet, closed), expected) in [
            ((false, false, false, true), V::NoGap),
            ((false, false, false, false), V::Unexplained),
            ((false, true, false, true), V::Unexplained),
            ((false, true, false, false), V::Unexplained),
            ((false, true, true, true), V::NoGap),
            ((false, true, true, false), V::Unexplained),
            ((true, false, false, true), V::Explained),
            ((true, false, false, false), V::PartlyExplained),
            ((true, true, false, true), V::PartlyExplained),
            ((true, true, false, false), V::PartlyExplained),
        ] {
            let found = judgement(named, gap, quiet).verdict(closed);
            assert_eq!(found, expected, "named {named}, gap {gap}, noise {quiet}, hold-out {closed}");
        }
    }
}
