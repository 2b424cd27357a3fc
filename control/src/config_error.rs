//! What is wrong with a set of parameters.

use crate::parameters::Key;
use parameter_table::{Must, ParameterError};

/// Which parameter is wrong, and what it must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfigError {
    /// The parameter's key.
    pub key: &'static str,
    /// The value found.
    pub value: f64,
    /// What would be accepted, as the end of the sentence "must …".
    pub must: Must,
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} = {} must {}", self.key, self.value, self.must)
    }
}

impl core::error::Error for ConfigError {}

impl From<ParameterError> for ConfigError {
    fn from(error: ParameterError) -> Self {
        Self { key: error.key, value: error.value, must: error.must }
    }
}

impl From<ConfigError> for ParameterError {
    fn from(error: ConfigError) -> Self {
        Self { key: error.key, value: error.value, must: error.must }
    }
}

/// Says what `key` must be if a demand of another parameter is not met.
pub(crate) fn demand(met: bool, key: Key, value: f64, must: impl Into<Must>) -> Result<(), ConfigError> {
    if met { Ok(()) } else { Err(ConfigError { key: key.row().key, value, must: must.into() }) }
}
