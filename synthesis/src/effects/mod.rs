//! The effects of the catalogue a second time, made from the paper and the effect table alone: how strong an everyday
//! fault is, and what it does to the synthetic rig. One file for each effect of `plant_model`, with the same name; a
//! missing file is a compile error.
//!
//! Nothing here may come from `plant_model`'s equations: an error in one of the two shows as a difference
//! (`tests/agrees_with_plant_model.rs`).

mod twin;

use crate::physics::{Physics, Present};
use crate::reading::Reading;
use plant_model::Effect;
use twin::Twin;

pub(crate) use twin::{Everyday, Gas, Rubbing, Seal};

macro_rules! twins {
    ($($variant:ident => $module:ident),+ $(,)?) => {
        $(mod $module;)+

        /// Draws the values of an effect.
        pub(crate) fn draw(effect: Effect, at: &mut Everyday<'_>) -> [f64; 3] {
            match effect { $(Effect::$variant => $module::$variant::draw(at)),+ }
        }

        /// Changes the rig's parameters.
        pub(crate) fn apply(effect: Effect, p: &[f64; 3], rig: &mut Physics) {
            match effect { $(Effect::$variant => $module::$variant::apply(p, rig)),+ }
        }

        /// Adds the mass flows of the effects present.
        pub(crate) fn flow(present: &[Present], gas: &Gas, into: &mut [f64; 2]) {
            for (effect, p) in present {
                match effect { $(Effect::$variant => $module::$variant::flow(p, gas, into)),+ }
            }
        }

        /// Adds the forces of the effects present.
        pub(crate) fn push(present: &[Present], y: f64, v: f64, push: &mut f64) {
            for (effect, p) in present {
                *push += match effect { $(Effect::$variant => $module::$variant::push(p, y, v)),+ };
            }
        }

        /// Changes the sliding force by the effects present.
        pub(crate) fn rub(present: &[Present], seal: &Seal, g: &mut Rubbing) {
            for (effect, p) in present {
                match effect { $(Effect::$variant => $module::$variant::rub(p, seal, g)),+ }
            }
        }

        /// Changes what the sensors show by the effects present: a sensor's gain, then its offset, which stands before it in the
        /// list.
        pub(crate) fn show(present: &[Present], reading: &mut Reading) {
            for (effect, p) in present.iter().rev() {
                match effect { $(Effect::$variant => $module::$variant::show(p, reading)),+ }
            }
        }
    };
}

plant_model::for_each_effect!(twins);
