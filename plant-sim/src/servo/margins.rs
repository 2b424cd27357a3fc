//! What the tuned law can do and how far it is from its limits: margins of the loop, time of a move, and what would have to
//! change where a demand is not met.

use super::reference::Motion;
use super::tuning::Tuning;
use control::servo::constants::{RESERVE, TICK_DELAY};
use plant_model::{RIG_KEYS, Rig};

/// Margins of the loop of three integrators that the inversion leaves, with valve lag and delay, before the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Crossover, rad/s.
    pub crossover: f64,
    /// Phase margin, degrees.
    pub phase_deg: f64,
    /// Delay beyond lag and output delay at which the loop oscillates, s.
    pub delay_s: f64,
    /// Factor on the valve's flow at which the loop oscillates.
    pub gain: f64,
}

/// What the rig is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Length of a move, m.
    pub move_m: f64,
    /// Time for it, s.
    pub within_s: f64,
    /// Standard deviation of the position's noise, m.
    pub noise_m: f64,
    /// Error allowed at rest, m.
    pub rest_m: f64,
}

/// Noise of the position over the error at rest that it allows: with 20 um the paper's cylinders rest within 45 um (`verdicts.rs`).
const NOISE_OVER_REST: f64 = 20.0 / 45.0;

impl Margins {
    /// Of the loop `(3 w s² + 3 w² s + w³) / s³ · exp(-(1.5 T + delay) s) / (1 + lag s)`.
    #[must_use]
    pub fn of(tuning: &Tuning) -> Self {
        let (w, delay) = (tuning.law_w, (TICK_DELAY + tuning.delay_ticks as f64) * tuning.tick_s);
        let gain = |x: f64| {
            let (real, imaginary) = (w.powi(3) - 3.0 * w * x * x, 3.0 * w * w * x);
            real.hypot(imaginary) / (x.powi(3) * (tuning.lag_s * x).hypot(1.0))
        };
        let phase = |x: f64| {
            let numerator = (3.0 * w * w * x).atan2(w.powi(3) - 3.0 * w * x * x);
            numerator - 1.5 * std::f64::consts::PI - delay * x - (tuning.lag_s * x).atan()
        };
        // Both fall with frequency beyond w.
        let zero = |of: &dyn Fn(f64) -> f64| {
            let (mut low, mut high) = (w, 100.0 * w);
            for _ in 0..60 {
                let middle = (low * high).sqrt();
                if of(middle) > 0.0 { low = middle } else { high = middle }
            }
            low
        };
        let crossover = zero(&|x| gain(x) - 1.0);
        let margin = phase(crossover) + std::f64::consts::PI;
        let turn = zero(&|x| phase(x) + std::f64::consts::PI);
        Self { crossover, phase_deg: margin.to_degrees(), delay_s: margin / crossover, gain: 1.0 / gain(turn) }
    }
}

/// Part of the bandwidth that the air's jerk calls for at which delay and lag begin to cost time.
const KEEPS_UP: f64 = 0.8;
/// Time constants of the law that a move takes longer for each unit of that part below.
const LATE: f64 = 100.0;
/// Part below which no move settles for certain.
const LEAST_KEEPS_UP: f64 = 0.4;

/// Time of a move of `distance` m, s; infinite where none settles for certain. The reference's, and one time constant of the law
/// as long as delay and lag leave it 0.8 of the bandwidth that the air's jerk calls for: measured moves of 10 mm and more on the paper's cylinders
/// take this within a tenth; one of a millimetre takes up to twice as long, until the friction is known. With less the piston swings before it settles:
/// in simulation (`plant-sim/tests/command_line/verdicts.rs`) up to 13 time constants at 0.7 and 27 at 0.5; below 0.4 not every move settles. How long differs from move
/// to move; the line is above what was seen.
#[must_use]
pub fn move_time_s(tuning: &Tuning, distance: f64) -> f64 {
    if tuning.keeps_up < LEAST_KEEPS_UP {
        return f64::INFINITY;
    }
    let t = tuning.tick_s;
    let aim = Motion { y: distance, ..Motion::default() };
    let mut motion = Motion::default();
    let mut ticks = 0;
    while (motion.y - distance).abs() > 1e-4 && ticks < 1_000_000 {
        motion =
            motion.after(motion.jerk_towards(distance, &tuning.limits, RESERVE, t), t).arrived(&aim, &tuning.limits, t);
        ticks += 1;
    }
    f64::from(ticks) * t + (1.0 + LATE * (KEEPS_UP - tuning.keeps_up).max(0.0)) / tuning.law_w
}

/// The rig with that many times the flow through the valve.
#[must_use]
pub fn with_flow(rig: &Rig<f64>, factor: f64) -> Rig<f64> {
    let mut larger = *rig;
    for key in RIG_KEYS.iter().filter(|key| key.name.contains("coefficient_kg") || key.name.contains("conductance")) {
        key.set(&mut larger, factor * key.get(rig));
    }
    larger
}

/// What the rig cannot do of what is asked, each as a sentence with the number that would do; empty if it can.
#[must_use]
pub fn shortfalls(rig: &Rig<f64>, tuning: &Tuning, demand: &Demand) -> Vec<String> {
    let mut said = Vec::new();
    let time_s = move_time_s(tuning, demand.move_m);
    if time_s > demand.within_s {
        let lag_s = tuning.valve_lag_s;
        let does = |rig: &Rig<f64>, lag_s| {
            move_time_s(&Tuning::of(rig, lag_s, tuning.tick_s), demand.move_m) <= demand.within_s
        };
        let missed = if time_s.is_finite() {
            format!("a move of {:.1} mm takes {time_s:.3} s", demand.move_m * 1e3)
        } else {
            format!("a move of {:.1} mm does not settle for certain", demand.move_m * 1e3)
        };
        // The slowest spool first, then the smallest valve: more flow asks for a faster spool, so that the search goes upwards.
        let faster = (1..=100).map(|part| lag_s * (1.0 - 0.01 * f64::from(part))).find(|lag_s| does(rig, *lag_s));
        let larger = || (1..=470).map(|step| 1.01_f64.powi(step)).find(|factor| does(&with_flow(rig, *factor), lag_s));
        let within = format!("would do it in {:.3} s", demand.within_s);
        said.push(if let Some(lag_s) = faster {
            let [has, does] = [tuning.valve_lag_s, lag_s].map(|lag_s| lag_s * 1e3);
            format!("valve too slow: with a lag of {has:.1} ms {missed}; a lag of {does:.2} ms {within}")
        } else if let Some(factor) = larger() {
            format!("valve too small: {missed}; {factor:.2} times the flow {within}")
        } else {
            format!(
                "{missed}; no valve reaches {:.3} s with a lag of {:.1} ms at {:.0} ticks a second",
                demand.within_s,
                lag_s * 1e3,
                1.0 / tuning.tick_s,
            )
        });
    }
    let quiet_m = NOISE_OVER_REST * demand.rest_m;
    if demand.noise_m > quiet_m {
        said.push(format!(
            "sensor too noisy: {:.0} um for a rest within {:.0} um; {:.0} um would do",
            demand.noise_m * 1e6,
            demand.rest_m * 1e6,
            quiet_m * 1e6,
        ));
    }
    said
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKED: Demand = Demand { move_m: 0.045, within_s: 0.35, noise_m: 20e-6, rest_m: 45e-6 };

    #[test]
    fn the_rule_leaves_every_case_its_margins_and_finds_that_it_can_do_what_was_measured() {
        for rig in [Rig::paper_a(), Rig::paper_b(), Rig::paper_c()] {
            let tuning = Tuning::of(&rig, 1.7e-3, 1e-3);
            let margins = Margins::of(&tuning);
            assert!(margins.phase_deg > 19.0 && margins.gain > 1.5, "{margins:?}");
            assert_eq!(shortfalls(&rig, &tuning, &ASKED), Vec::<String>::new());
        }
    }

    #[test]
    fn a_loop_that_has_spent_its_delay_margin_has_no_phase_left() {
        let tuning = Tuning::of(&Rig::paper_a(), 1.7e-3, 1e-3);
        let w = tuning.law_w;
        let margins = Margins::of(&tuning);
        // Without lag and delay the loop's phase margin follows from its polynomial alone.
        let ideal = Margins::of(&Tuning { lag_s: 0.0, tick_s: 0.0, ..tuning });
        let x = ideal.crossover;
        let gain = (w.powi(3) - 3.0 * w * x * x).hypot(3.0 * w * w * x) / x.powi(3);
        assert!((gain - 1.0).abs() < 1e-6, "{gain}");
        assert!(ideal.phase_deg > margins.phase_deg && ideal.delay_s > margins.delay_s);
        // All of the delay margin spent: none left.
        let spent = Tuning { tick_s: tuning.tick_s + margins.delay_s / TICK_DELAY, ..tuning };
        assert!(Margins::of(&spent).phase_deg.abs() < 1e-3, "{:?}", Margins::of(&spent));
    }

    #[test]
    fn each_shortfall_names_the_number_that_would_do() {
        let rig = Rig::paper_b();
        let tuning = Tuning::of(&rig, 1.7e-3, 1e-3);
        let small = shortfalls(&rig, &tuning, &Demand { within_s: 0.22, ..ASKED });
        assert!(small.len() == 1 && small[0].starts_with("valve too small"), "{small:?}");
        let noisy = shortfalls(&rig, &tuning, &Demand { noise_m: 100e-6, ..ASKED });
        assert!(noisy.len() == 1 && noisy[0].contains("20 um would do"), "{noisy:?}");
        let slow = Tuning::of(&rig, 30e-3, 1e-3);
        let slow = shortfalls(&rig, &slow, &Demand { within_s: 0.8, ..ASKED });
        assert!(slow.len() == 1 && slow[0].starts_with("valve too slow"), "{slow:?}");
    }
}
