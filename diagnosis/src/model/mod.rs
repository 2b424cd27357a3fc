//! The model as a parameter vector: nominal values within their tolerance, and effects of the catalogue on top.

pub(crate) mod effects;
pub(crate) mod hypothesis;
pub(crate) mod nominal;
pub(crate) mod parameter;
mod without_trace;
