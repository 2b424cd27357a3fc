//! Smoothing windows as long as noise asks and as short as the signal allows, sample by sample (after Lepski; Goldenshluger and
//! Nemirovski 1997).
//!
//! A local parabola over a long window averages more noise, and cuts off where the piston breaks away or a valve opens. So each
//! sample takes the longest window that the next shorter ones do not contradict by more than noise.

use super::smoothing::{Reach, Smoothed};
use crate::constants;
use core::ops::Range;

/// A window is compared with so many shorter ones: by chance one of them may agree where a third does not, and all of them would
/// let chance in the shortest, which are the noisiest, decide.
const COMPARED: usize = 2;

/// The windows that samples choose from: the same for all pieces of a signal.
pub(crate) struct Windows {
    /// From the shortest to the longest.
    reaches: Vec<Reach>,
    /// For each window the standard deviation of its difference from each that it is compared with, in that of the signal's noise.
    apart: Vec<Vec<f64>>,
    /// So many samples near either end of a piece do not hold the longest window.
    cut_off: usize,
}

impl Windows {
    /// Windows of at most `longest`, for samples that usually come every `interval_s`; `once` smooths a signal, given at some times,
    /// with one window throughout.
    pub(crate) fn new(longest: Reach, interval_s: f64, once: fn(&[f64], &[f64], Reach) -> Smoothed) -> Self {
        let cut_off = longest.samples(interval_s);
        // Smoothed twice, one sample spreads over four times the reach.
        let width = 8 * cut_off + 1;
        let t_s: Vec<f64> = (0..width).map(|k| k as f64 * interval_s).collect();
        let impulse: Vec<f64> = (0..width).map(|k| if k == width / 2 { 1.0 } else { 0.0 }).collect();
        let reaches = from_the_shortest(longest, interval_s);
        let responses: Vec<Vec<f64>> = reaches.iter().map(|reach| once(&t_s, &impulse, *reach).value).collect();
        let apart = |(one, other): (&Vec<f64>, &Vec<f64>)| {
            one.iter().zip(other).map(|(one, other)| (one - other).powi(2)).sum::<f64>().sqrt()
        };
        let apart = (0..reaches.len())
            .map(|place| responses[compared(place)].iter().map(|other| apart((&responses[place], other))).collect())
            .collect();
        Self { reaches, apart, cut_off }
    }

    /// The windows, from the shortest to the longest.
    pub(crate) fn reaches(&self) -> &[Reach] {
        &self.reaches
    }

    /// One piece of a signal, whose white noise has the standard deviation `noise`, from what each window, given with its place, makes of it
    /// throughout.
    pub(crate) fn smooth(&self, noise: f64, throughout: impl Fn(usize, Reach) -> Smoothed) -> Smoothed {
        let windows: Vec<Smoothed> =
            self.reaches.iter().enumerate().map(|(place, reach)| throughout(place, *reach)).collect();
        let samples = windows[0].value.len();
        let allowed = constants::windows_apart() * noise;
        let contradicted = |k: usize, place: usize| {
            let says = |window: &Smoothed| window.value[k];
            let mut others = windows[compared(place)].iter().zip(&self.apart[place]);
            others.any(|(other, apart)| (says(&windows[place]) - says(other)).abs() > allowed * apart)
        };
        // Near the ends windows are cut off, and short ones there are worse than what they are compared with.
        let whole = self.cut_off..samples.saturating_sub(self.cut_off);
        let agrees = |k: usize, place: usize| !whole.contains(&k) || !contradicted(k, place);
        let chosen = |k: usize| (0..windows.len()).rev().find(|place| agrees(k, *place)).unwrap_or(0) as f64;
        let chosen: Vec<f64> = (0..samples).map(chosen).collect();
        blended(&chosen, &windows)
    }
}

/// The places of the windows that one is compared with: the next shorter ones.
fn compared(place: usize) -> Range<usize> {
    place.saturating_sub(COMPARED)..place
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
fn blended(chosen: &[f64], windows: &[Smoothed]) -> Smoothed {
    let mut out = Smoothed::default();
    let reach = constants::window_blend();
    for k in 0..chosen.len() {
        let near = &chosen[k.saturating_sub(reach)..(k + reach + 1).min(chosen.len())];
        let place = near.iter().sum::<f64>() / near.len() as f64;
        let low = (place as usize).min(windows.len() - 1);
        let high = (low + 1).min(windows.len() - 1);
        let mixed = |of: fn(&Smoothed) -> &Vec<f64>| {
            let [from, to] = [low, high].map(|place| of(&windows[place])[k]);
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
        let own = Windows::new(longest, INTERVAL_S, twice).smooth(noise_pa, |_, reach| twice(&t_s, &signal, reach));
        let throughout = twice(&t_s, &signal, longest);
        [own, throughout].map(|smoothed| {
            let rms = |within: &dyn Fn(usize) -> bool| {
                let squares = (0..4000).filter(|k| within(*k)).map(|k| (smoothed.value[k] - truth[k]).powi(2));
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
