//! Smoothing windows as long as noise asks and as short as the signal allows, sample by sample (after Lepski; Goldenshluger and
//! Nemirovski 1997).
//!
//! A local parabola over a long window averages more noise, and cuts off where the piston breaks away or a valve opens. So each
//! sample takes the longest window that the next shorter ones do not contradict by more than noise.

use super::smoothing::{Reach, Smoothed};
use crate::constants;

/// A window throughout a signal.
struct Window {
    smoothed: Smoothed,
    /// What it makes of one sample of one amid zeros.
    response: Vec<f64>,
}

/// Smooths one piece of a signal, given at some times, with windows of at most `longest`. `once` smooths with one window
/// throughout; `noise` is the standard deviation of the signal's white noise, `interval_s` the usual time between samples.
pub(crate) fn smooth(
    (t_s, signal): (&[f64], &[f64]),
    noise: f64,
    (longest, interval_s): (Reach, f64),
    once: fn(&[f64], &[f64], Reach) -> Smoothed,
) -> Smoothed {
    // Smoothed twice, one sample spreads over four times the reach.
    let width = 8 * longest.samples(interval_s) + 1;
    let impulse_t_s: Vec<f64> = (0..width).map(|k| k as f64 * interval_s).collect();
    let impulse: Vec<f64> = (0..width).map(|k| if k == width / 2 { 1.0 } else { 0.0 }).collect();
    let window =
        |reach| Window { smoothed: once(t_s, signal, reach), response: once(&impulse_t_s, &impulse, reach).value };
    let windows: Vec<Window> = from_the_shortest(longest, interval_s).into_iter().map(window).collect();
    let contradicted: Vec<Vec<bool>> = (0..windows.len())
        .map(|place| {
            let shorter = &windows[place.saturating_sub(COMPARED)..place];
            contradicted(&windows[place], shorter, noise, signal.len())
        })
        .collect();
    // Near the ends windows are cut off, and short ones there are worse than what they are compared with.
    let whole = longest.samples(interval_s)..signal.len().saturating_sub(longest.samples(interval_s));
    let agrees = |k: usize, place: usize| !whole.contains(&k) || !contradicted[place][k];
    let longest = |k: usize| (0..windows.len()).rev().find(|place| agrees(k, *place)).unwrap_or(0);
    let chosen: Vec<f64> = (0..signal.len()).map(|k| longest(k) as f64).collect();
    blended(&chosen, &windows)
}

/// A window is compared with so many shorter ones: by chance one of them may agree where a third does not, and all of them would
/// let chance in the shortest, which are the noisiest, decide.
const COMPARED: usize = 2;

/// Where one of some shorter windows says something else than a window, by more than noise.
fn contradicted(window: &Window, shorter: &[Window], noise: f64, count: usize) -> Vec<bool> {
    let allowed = |other: &Window| {
        let apart = window.response.iter().zip(&other.response).map(|(one, other)| (one - other).powi(2)).sum::<f64>();
        constants::windows_apart() * noise * apart.sqrt()
    };
    let allowed: Vec<f64> = shorter.iter().map(allowed).collect();
    let apart = |k: usize, other: &Window| (window.smoothed.value[k] - other.smoothed.value[k]).abs();
    (0..count).map(|k| shorter.iter().zip(&allowed).any(|(other, allowed)| apart(k, other) > *allowed)).collect()
}

/// Windows from the shortest to the longest, each about twice as long as the one before.
fn from_the_shortest(longest: Reach, interval_s: f64) -> Vec<Reach> {
    let mut samples = longest.samples(interval_s);
    let mut out = vec![longest];
    while samples > longest.least {
        samples = (samples / 2).max(longest.least);
        out.push(Reach::new(samples as f64 * interval_s, interval_s, longest.least));
    }
    out.reverse();
    out
}

/// The chosen windows, mixed over neighbouring samples: no step where one window follows another. Slopes are mixed as values are,
/// so that a value with a multiple of its slope stays what one window makes of it.
fn blended(chosen: &[f64], windows: &[Window]) -> Smoothed {
    let mut out = Smoothed::default();
    let reach = constants::window_blend();
    for k in 0..chosen.len() {
        let near = &chosen[k.saturating_sub(reach)..(k + reach + 1).min(chosen.len())];
        let place = near.iter().sum::<f64>() / near.len() as f64;
        let low = (place as usize).min(windows.len() - 1);
        let high = (low + 1).min(windows.len() - 1);
        let mixed = |of: fn(&Smoothed) -> &Vec<f64>| {
            let [from, to] = [low, high].map(|place| of(&windows[place].smoothed)[k]);
            from + (to - from) * (place - low as f64)
        };
        out.value.push(mixed(|smoothed| &smoothed.value));
        out.slope.push(mixed(|smoothed| &smoothed.slope));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::smoothing::twice;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand_distr::{Distribution, StandardNormal};

    const INTERVAL_S: f64 = 1.0e-3;
    const NOISE_PA: f64 = 100.0;

    /// A pressure that is held, and from the middle on rises by 20 bar/s; root mean squares of its error about there and elsewhere,
    /// of windows as the signal allows and of the longest one throughout.
    fn errors(noise_pa: f64) -> [[f64; 2]; 2] {
        let t_s: Vec<f64> = (0..4000).map(|k| INTERVAL_S * f64::from(k)).collect();
        let truth: Vec<f64> = t_s.iter().map(|t| 2.0e6 * (t - 2.0).max(0.0)).collect();
        let draws = StandardNormal.sample_iter(Xoshiro256PlusPlus::seed_from_u64(7));
        let signal: Vec<f64> = truth.iter().zip(draws).map(|(x, e): (&f64, f64)| x + noise_pa * e).collect();
        let longest = Reach::new(9.0e-3, INTERVAL_S, 1);
        let own = smooth((&t_s, &signal), noise_pa, (longest, INTERVAL_S), twice);
        let throughout = twice(&t_s, &signal, longest);
        [own, throughout].map(|smoothed| {
            let rms = |mean: &dyn Fn(usize) -> bool| {
                let squares = (0..4000).filter(|k| mean(*k)).map(|k| (smoothed.value[k] - truth[k]).powi(2));
                let squares: Vec<f64> = squares.collect();
                (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
            };
            [rms(&|k| k.abs_diff(2000) < 10), rms(&|k| k.abs_diff(2000) > 40)]
        })
    }

    #[test]
    fn a_window_is_short_where_a_valve_opens_and_long_elsewhere() {
        let [[kink, elsewhere], [kink_throughout, noise]] = errors(NOISE_PA);
        assert!(kink < 0.5 * kink_throughout && kink < 1.5 * NOISE_PA, "{kink} {kink_throughout}");
        // Chance shortens few windows.
        assert!(elsewhere < 1.1 * noise && elsewhere < 0.4 * NOISE_PA, "{elsewhere} {noise}");
    }

    #[test]
    fn noise_as_large_as_what_a_window_cuts_off_leaves_it_long() {
        let [[kink, elsewhere], [kink_throughout, noise]] = errors(50.0 * NOISE_PA);
        assert!((kink / kink_throughout - 1.0).abs() < 0.2, "{kink} {kink_throughout}");
        assert!(elsewhere < 1.1 * noise, "{elsewhere} {noise}");
    }

    #[test]
    fn a_signal_without_noise_is_left_as_it_is() {
        let [[kink, _], [kink_throughout, _]] = errors(0.0);
        assert!(kink < 0.05 * kink_throughout, "{kink} {kink_throughout}");
    }
}
