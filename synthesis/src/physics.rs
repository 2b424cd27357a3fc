//! What the synthetic rig is made of: the paper's parameters after all effects, as plain numbers.
//!
//! This is a transcription of its own, made from the paper and the effect table alone. It shares names and units with
//! `plant-model`, and nothing of its equations, so that an error in one of the two shows as a difference.

use crate::air_way::Tube;
use plant_model::Effect;

/// One side of a table of the opening, from the end of flow on: distance in V, opening, slope of the smooth curve in 1/V.
pub(crate) type Nodes = Vec<[f64; 3]>;

/// Parameters of the synthetic rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Physics {
    pub(crate) gas_constant: f64,
    pub(crate) temperature_k: f64,
    pub(crate) exponent: f64,
    pub(crate) supply_pa: f64,
    pub(crate) atmosphere_pa: f64,
    /// Coefficients of the linear law, kg/(s Pa); factors on the conductances, where the valve follows ISO 6358.
    pub(crate) fill: f64,
    pub(crate) exhaust: f64,
    /// Conductances in kg/(s Pa) of the fully open paths and critical ratios of ISO 6358: of A, then of B, each filling,
    /// then exhausting.
    pub(crate) sonic: Option<[[[f64; 2]; 2]; 2]>,
    /// Hoses and throttles to A and B.
    pub(crate) tubes: [Vec<Tube>; 2],
    /// Cushions at the ends of A and B: length in m, and the needle.
    pub(crate) cushions: [Option<(f64, Tube)>; 2],
    /// Rate in N/m and preload in N of a spring in chamber B, which then breathes freely.
    pub(crate) spring: Option<[f64; 2]>,
    /// The table's two sides, positive commands first, instead of the arc tangent; empty for none.
    pub(crate) sides: [Nodes; 2],
    /// How far corners are rounded to either side, V.
    pub(crate) rounding_v: f64,
    /// How much further out than those from the supply the paths to atmosphere open, V.
    pub(crate) exhaust_overlap_v: f64,
    /// From straight lines between the table's points, 0, to the cubic, 1.
    pub(crate) smoothness: f64,
    /// Curvature and effective commands of full opening to the right and left, V, instead of the arc tangent.
    pub(crate) bent: Option<[f64; 3]>,
    pub(crate) right_v: f64,
    pub(crate) left_v: f64,
    pub(crate) slope_right: f64,
    pub(crate) slope_left: f64,
    pub(crate) max_v: f64,
    pub(crate) lag_s: f64,
    /// `1 / (4 ζ²)` of a spool whose lag is of second order.
    pub(crate) spool_inertia: f64,
    pub(crate) play_v: f64,
    /// How late A and B feel the spool.
    pub(crate) line_delays_s: [f64; 2],
    /// Critical ratio and conductance scale of ISO 6358.
    pub(crate) choked: Option<[f64; 2]>,
    pub(crate) droop: f64,
    pub(crate) droop_s: f64,
    pub(crate) area_a: f64,
    pub(crate) area_b: f64,
    pub(crate) half_stroke: f64,
    pub(crate) volume_a: f64,
    pub(crate) volume_b: f64,
    pub(crate) mass: f64,
    /// Gravity against positive motion, m/s2.
    pub(crate) gravity: f64,
    pub(crate) sigma0: f64,
    pub(crate) sigma1: f64,
    pub(crate) sigma2: f64,
    pub(crate) coulomb: f64,
    pub(crate) stiction: f64,
    pub(crate) stribeck: f64,
    pub(crate) breakaway: f64,
    pub(crate) y_delay_s: f64,
    /// Time constant of the position sensor, s.
    pub(crate) y_lag_s: f64,
    pub(crate) sensor_s: f64,
    /// Heat transfer coefficient of the walls, W/(m2 K): the air's temperature is then a state.
    pub(crate) walls: Option<f64>,
    /// Catalogue effects in its order, with their values.
    pub(crate) present: Vec<Present>,
    pub(crate) outside: Outside,
}

/// Terms outside the catalogue, absent by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Outside {
    /// N s2/m2.
    pub(crate) drag: f64,
    /// K/s.
    pub(crate) warming: f64,
    /// Relative to half the stroke.
    pub(crate) bow: f64,
    pub(crate) second_mass: Option<SecondMass>,
    /// Additional static force in N and its time constant in s.
    pub(crate) dwell: Option<[f64; 2]>,
    /// Amplitude in Pa and frequency in Hz.
    pub(crate) pulsation: Option<[f64; 2]>,
    /// Part of the friction that is lost, and its time constant in s.
    pub(crate) running_in: Option<[f64; 2]>,
    /// V/s.
    pub(crate) slew: Option<f64>,
}

/// A part of the load that is not rigidly attached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SecondMass {
    pub(crate) mass: f64,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) half_gap: f64,
}

/// An effect with its values.
pub(crate) type Present = (Effect, [f64; 3]);
