//! Logs with a known truth, for testing a diagnosis that must not see it.
//!
//! A synthetic rig ([`Specimen`]) is integrated by equations and methods of its own, follows an [`Experiment`] under a
//! control [`Law`], and is recorded through a measurement [`Chain`] with noise, converters, jitter and losses. Hidden
//! [`Cause`]s come from the catalogue of effects or from outside it ([`Foreign`]); [`strength`] says how strong an
//! everyday fault is.
//!
//! ```
//! use synthesis::{Case, Cause, Chain, Family, Law};
//! use plant_model::Effect;
//! use rand::SeedableRng;
//!
//! let rig_file = rig_files::RigFile::paper_a();
//! let mut rng = rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1);
//! let case = Case {
//!     truth: rig_file.rig,
//!     causes: vec![Cause::Catalogue(Effect::LeakCrossPiston, [2e-10, 0.0, 0.0])],
//!     experiment: Family::Everyday.draw(&rig_file.rig, 2.0, &mut rng),
//!     law: Law::for_rig(&rig_file.rig, 0.8),
//!     chain: Chain::standard(rig_file.io.position_range_m),
//!     seed: 7,
//!     rig_file,
//! };
//! let (log, _ideal) = case.record();
//! assert_eq!(log.len(), 2000);
//! ```
#![forbid(unsafe_code)]

mod air_way;
mod assembly;
pub mod blind;
mod case;
mod cause;
mod chain;
mod effects;
mod experiment;
mod foreign;
mod friction;
mod furnished;
mod law;
mod opening;
mod physics;
mod reading;
mod recording;
mod sequences;
mod specimen;
pub mod strength;
mod varied;

pub use case::{Case, Stated, UNCERTAIN_KEYS, true_opening, true_rig};
pub use cause::{Cause, CauseError, Which};
pub use chain::Chain;
pub use experiment::{Demand, Experiment, Periodic, Player, Reference, Segment, Wave};
pub use foreign::{Foreign, ForeignParameter};
pub use furnished::{furnished, is_furnished_with};
pub use law::{Controller, Law};
pub use physics::Physics;
pub use reading::Reading;
pub use recording::record;
pub use sequences::{Family, Part, identification, identification_parts};
pub use specimen::{STEP_S, Specimen};
pub use varied::varied_rig;
