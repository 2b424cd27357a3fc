//! The log made ready: samples, stretches, noise, smoothing, masks.

mod adaptive_window;
mod chamber_pressure;
pub(crate) mod channel;
pub(crate) mod cleaned;
pub(crate) mod command;
pub(crate) mod grid;
pub(crate) mod hum;
pub(crate) mod masks;
pub(crate) mod noise;
pub(crate) mod outliers;
mod position_observer;
pub(crate) mod prepare;
pub(crate) mod quality;
pub(crate) mod record;
pub(crate) mod repeats;
pub(crate) mod smoothing;
pub(crate) mod spline;
pub(crate) mod split;
