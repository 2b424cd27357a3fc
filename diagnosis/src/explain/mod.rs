//! The report's content: causes with evidence, corrected nominal values, what the log says nothing about, what to
//! record next, and on what the errors depend.

pub(crate) mod calibration;
pub(crate) mod cause;
pub(crate) mod experiments;
pub(crate) mod extension;
pub(crate) mod identifiability;
pub(crate) mod residuals;
