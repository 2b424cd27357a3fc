//! From a hypothesis to its maximum a posteriori estimate with standard errors.

pub(crate) mod between_rows;
pub(crate) mod clocks;
pub(crate) mod compensation;
mod coordinate_search;
pub(crate) mod covariance;
pub(crate) mod derivatives;
pub(crate) mod effort;
pub(crate) mod gauges;
mod known_residuals;
pub(crate) mod likelihood;
pub(crate) mod noise_level;
pub(crate) mod optimiser;
pub(crate) mod passed_on;
pub(crate) mod principal_axes;
pub(crate) mod problem;
mod reading;
mod secant;
mod through_opening;
