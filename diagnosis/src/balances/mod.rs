//! The balances: each predicts one channel from the others as measured, so that only its own physics shows.
//!
//! | balance | predicts | from | shows |
//! | --- | --- | --- | --- |
//! | mass A, mass B | chamber pressure | command, position, supply | valve and gas only: friction never shows here |
//! | force | position | both pressures, external force | mechanics only: the dead zone never shows here |
//! | supply | supply pressure | command, pressures | the air source |
//!
//! Every prediction runs as an observer: it is drawn towards the measurement with a time constant that balances sensor
//! noise against what accumulates in the prediction, so its errors (innovations) are white where the physics is right,
//! and no horizon has to be chosen for the fit.

pub(crate) mod added;
pub(crate) mod chamber;
pub(crate) mod observers;
pub(crate) mod piston;
pub(crate) mod shared;
pub(crate) mod supply;
pub(crate) mod term_library;
pub(crate) mod valve;
