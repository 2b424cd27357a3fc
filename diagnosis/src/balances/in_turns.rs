//! Predictions in turns. Each sample of a prediction waits for the arithmetic of the one before it, so that two predictions, a
//! sample of each in turns, take little longer than one.

use crate::data::split::{Stretch, samples};

/// The prediction of a channel over some stretches, one sample after the other.
pub(super) trait Prediction {
    /// Whether a sample is at hand.
    fn goes_on(&self) -> bool;

    /// Judges the sample at hand and predicts the next one.
    fn step(&mut self);

    /// The errors of all rows so far.
    fn errors(self) -> Vec<f64>;
}

/// The errors of two predictions.
pub(super) fn in_turns<P: Prediction>([mut one, mut other]: [P; 2]) -> [Vec<f64>; 2] {
    while one.goes_on() && other.goes_on() {
        one.step();
        other.step();
    }
    [one, other].map(|mut prediction| {
        while prediction.goes_on() {
            prediction.step();
        }
        prediction.errors()
    })
}

/// The stretches in two parts, each with the place of its first sample among those of all.
pub(super) fn halves(stretches: &[Stretch]) -> [(&[Stretch], usize); 2] {
    let (first, second) = stretches.split_at(stretches.len() / 2);
    [(first, 0), (second, samples(first))]
}
