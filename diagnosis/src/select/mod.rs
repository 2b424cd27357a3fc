//! Which causes: score test, forward selection, backward elimination, exchange, ties; and what every rig has a little of.

pub(crate) mod backward;
mod breakaway;
pub(crate) mod everyday;
pub(crate) mod exchange;
mod first_steps;
pub(crate) mod forward;
pub(crate) mod held_rows;
pub(crate) mod image;
pub(crate) mod initial_values;
mod memory;
pub(crate) mod nominal_fit;
pub(crate) mod penalty;
pub(crate) mod ripple_spectrum;
pub(crate) mod score_test;
pub(crate) mod scoring;
pub(crate) mod screening;
pub(crate) mod search;
pub(crate) mod simplify;
pub(crate) mod ties;
mod two_at_once;
pub(crate) mod visibility;
