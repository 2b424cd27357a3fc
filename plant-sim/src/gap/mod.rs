//! The diagnosis made presentable: `diagnosis.json`, the report, the words for the terminal.

mod apply;
mod json;
mod page;
mod picture;
mod units;
mod words;

pub use apply::{Applied, Configured, apply};
pub use json::to_json;
pub use page::{Source, page};
pub(crate) use units::significant;
pub use units::{quantity, with_error};
pub use words::{headline, summary};
