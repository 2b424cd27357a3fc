//! The balances: each predicts one channel from the others as measured, so that only its own physics shows.
//!
//! | balance | predicts | from | shows |
//! | --- | --- | --- | --- |
//! | mass A, mass B | chamber pressure | command, position, supply | valve and gas only: friction never shows here |
//! | force | position | both pressures, external force | mechanics only: the dead zone never shows here |
//! | supply | supply pressure | command, pressures | the air source |
//!
//! Every prediction runs as an observer, a predictor in innovations form (Ljung 1999): a gain, the same for all
//! hypotheses, corrects it towards the measurement. The gain balances sensor noise against the error that a prediction
//! accumulates. So the innovations are white where the physics is right, and no prediction horizon has to be chosen for
//! the fit.

pub(crate) mod added;
pub(crate) mod between;
pub(crate) mod chamber;
pub(crate) mod compression;
pub(crate) mod correction;
mod decay;
mod drift;
pub(crate) mod force;
mod in_turns;
mod initial_warmth;
pub(crate) mod judged;
pub(crate) mod linearised;
pub(crate) mod momentum;
pub(crate) mod motion;
pub(crate) mod observers;
pub(crate) mod opening;
pub(crate) mod piston;
pub(crate) mod shared;
#[cfg(test)]
pub(crate) mod simulated;
mod spool;
pub(crate) mod supply;
pub(crate) mod term_library;
mod valve;
