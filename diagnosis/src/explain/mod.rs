//! What people read: causes in sentences, corrections, what stays unknown, what to record next, where the errors live.

pub(crate) mod calibration;
pub(crate) mod cause;
pub(crate) mod experiments;
pub(crate) mod identifiability;
pub(crate) mod residuals;
