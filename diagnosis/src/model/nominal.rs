//! The nominal values of the rig file that are corrected within their tolerance.

use super::parameter::{Parameter, Slot};
use crate::constants;
use crate::data::channel::{Channel, Channels};
use rig_files::{RigFile, all_keys};

const A: Channels = Channel::PressureA.bit();
const B: Channels = Channel::PressureB.bit();
const Y: Channels = Channel::Position.bit();
const S: Channels = Channel::Supply.bit();

/// The nominal values that are corrected within their tolerance, with the channels they act on.
///
/// Constants of nature and geometry (gas, atmosphere, area, stroke) count as exact unless the rig file gives them a
/// tolerance of their own: they are known far better than the default, and each is degenerate with others here.
///
/// What a rig does not have is zero, and not corrected: a valve has coefficients or conductances.
const CORRECTED: [(&str, Channels); 10] = [
    ("valve.fill_coefficient_kg_per_s_pa", A | B),
    ("valve.exhaust_coefficient_kg_per_s_pa", A | B),
    ("valve.fill_conductance_m3_per_s_pa", A | B),
    ("valve.exhaust_conductance_m3_per_s_pa", A | B),
    ("cylinder.volume_a0_m3", A),
    ("cylinder.volume_b0_m3", B),
    ("load.mass_kg", Y),
    ("friction.coulomb_n", Y),
    ("friction.static_n", Y),
    ("friction.viscous_n_s_per_m", Y),
];
const CORRECTED_ON_REQUEST: [(&str, Channels); 5] = [
    ("gas.temperature_k", A | B),
    ("gas.heat_capacity_ratio", A | B),
    ("supply.pressure_pa", A | B | S),
    ("cylinder.area_m2", A | B | Y),
    ("friction.stribeck_velocity_m_per_s", Y),
];

/// The nominal values to correct on this rig.
pub(crate) fn nominal_parameters(rig: &RigFile, judgeable: Channels, supply_measured: bool) -> Vec<Parameter> {
    let mut out = Vec::new();
    for key in all_keys() {
        let default = CORRECTED.iter().find(|(path, _)| *path == key.path);
        let request = CORRECTED_ON_REQUEST.iter().find(|(path, _)| *path == key.path);
        let (channels, relative) = match (default, request, rig.tolerance.own(key.path)) {
            (Some((_, channels)), _, own) => (*channels, own.unwrap_or(rig.tolerance.default)),
            (None, Some((_, channels)), Some(own)) => (*channels, own),
            _ => continue,
        };
        // With a measured supply the nominal supply pressure only predicts that channel.
        let channels = if key.path == "supply.pressure_pa" && supply_measured { S } else { channels };
        let nominal = key.get(&rig.rig);
        let tolerance = relative * nominal.abs();
        if tolerance > 0.0 && channels & judgeable != 0 {
            out.push(Parameter {
                slot: Slot::Nominal(key),
                neutral: nominal,
                scale: tolerance.max(1.0e-4 * nominal.abs()),
                negligible: 0.0,
                tolerance: Some(tolerance),
                min: (nominal - constants::farthest_nominal() * tolerance).max(0.3 * nominal),
                max: (nominal + constants::farthest_nominal() * tolerance).min(3.0 * nominal),
                channels: channels & judgeable,
            });
        }
    }
    out
}
