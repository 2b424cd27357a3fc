//! The names of the effects.

/// The most parameters one effect has.
pub const MAX_PARAMETERS: usize = 3;

macro_rules! names {
    ($($variant:ident => $module:ident),+ $(,)?) => {
        /// Every effect the model can take on.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Effect {
            $(#[doc = concat!("See `effects/", stringify!($module), ".rs`.")] $variant,)+
        }

        impl Effect {
            /// All effects, in the order in which they are applied to the model.
            pub const ALL: [Self; 0 $(+ { let _ = Self::$variant; 1 })+] = [$(Self::$variant),+];
        }
    };
}

crate::for_each_effect!(names);
