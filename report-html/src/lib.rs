//! Reports: one HTML file with text, tables and interactive plots that works offline, and the same plots as SVG.
//!
//! ```
//! use report_html::{Page, Plot, Series, Tone};
//! let t: Vec<f64> = (0..100).map(|i| f64::from(i) * 0.01).collect();
//! let y = t.iter().map(|t| t.sin()).collect();
//! let mut page = Page::new("Position step");
//! page.callout(Tone::Good, "The piston arrives.");
//! page.plot(Plot::new("Position", "time, s", "y, m").with(Series::line("y", t, y)));
//! let html: String = page.to_html();
//! # assert!(html.contains("Position step"));
//! ```
#![forbid(unsafe_code)]

mod page;
mod plot;
mod svg;

pub use page::{Block, Page, Table, Tone};
pub use plot::{Marker, Plot, Series, Style, thin};
pub use svg::{SvgError, svg};
