//! The nominal values of the rig file that are corrected within their tolerance.

use super::effects;
use super::parameter::{Parameter, Slot};
use crate::constants;
use crate::data::channel::{Channel, Channels};
use plant_model::similarity::size_exponent;
use plant_model::{Effect, Place, Plant};
use rig_files::{RigFile, RigKey, all_keys, rig_key};

const A: Channels = Channel::PressureA.bit();
const B: Channels = Channel::PressureB.bit();
const Y: Channels = Channel::Position.bit();
const S: Channels = Channel::Supply.bit();

/// The nominal values that are corrected within their tolerance, with the channels they act on.
///
/// What a rig does not have is zero, and not corrected: a valve has coefficients or conductances.
const CORRECTED: [(&str, Channels); 27] = [
    ("valve.fill_coefficient_kg_per_s_pa", A | B),
    ("valve.exhaust_coefficient_kg_per_s_pa", A | B),
    ("valve.fill_conductance_m3_per_s_pa", A | B),
    ("valve.exhaust_conductance_m3_per_s_pa", A | B),
    ("valve.dead_zone_right_v", A | B),
    ("valve.dead_zone_left_v", A | B),
    (SLOPES[0], A | B),
    (SLOPES[1], A | B),
    ("cylinder.volume_a0_m3", A),
    ("cylinder.volume_b0_m3", B),
    (DIAMETERS[0], A),
    (DIAMETERS[1], B),
    ("cushion_a.conductance_m3_per_s_pa", A),
    ("cushion_b.conductance_m3_per_s_pa", B),
    ("cylinder.spring_n_per_m", Y),
    ("cylinder.spring_preload_n", Y),
    ("load.mass_kg", Y),
    ("friction.coulomb_n", Y),
    ("friction.static_n", Y),
    ("friction.viscous_n_s_per_m", Y),
    ("friction.stribeck_velocity_m_per_s", Y),
    ("friction.stiffness_n_per_m", Y),
    ("friction.damping_n_s_per_m", Y),
    ("friction.breakaway_m", Y),
    (TEMPERATURE, A | B),
    (SUPPLY, A | B | S),
    (ATMOSPHERE, A | B),
];
/// By how much each side of the spool opens faster, or than the rig's table of the opening.
const SLOPES: [&str; 2] = ["valve.slope_right", "valve.slope_left"];
/// By how much each hose throttles.
const DIAMETERS: [&str; 2] = ["hose_a.diameter_m", "hose_b.diameter_m"];
/// The piston's area, of both sides and of each.
const AREA: &str = "cylinder.area_m2";
const AREAS: [&str; 2] = ["cylinder.area_a_m2", "cylinder.area_b_m2"];
const TEMPERATURE: &str = "gas.temperature_k";
const SUPPLY: &str = "supply.pressure_pa";
const ATMOSPHERE: &str = "supply.atmosphere_pa";

/// Constants of nature and geometry count as exact unless the rig file gives them a tolerance of their own: they are known
/// far better than the default, and each is degenerate with others here.
const CORRECTED_ON_REQUEST: [(&str, Channels); 9] = [
    ("gas.heat_capacity_ratio", A | B),
    (AREA, A | B | Y),
    (AREAS[0], A | Y),
    (AREAS[1], B | Y),
    ("load.inclination_deg", Y),
    ("hose_a.length_m", A),
    ("hose_b.length_m", B),
    ("cushion_a.length_m", A),
    ("cushion_b.length_m", B),
];

/// What data sheets give of valves of ISO 6358, path by path: no two paths of a valve are alike. They stand for the values of
/// both sides.
const BY_PATH: [(&str, Channels); 8] = [
    ("valve.fill_conductance_a_m3_per_s_pa", A),
    ("valve.fill_conductance_b_m3_per_s_pa", B),
    ("valve.exhaust_conductance_a_m3_per_s_pa", A),
    ("valve.exhaust_conductance_b_m3_per_s_pa", B),
    ("valve.fill_critical_ratio_a", A),
    ("valve.fill_critical_ratio_b", B),
    ("valve.exhaust_critical_ratio_a", A),
    ("valve.exhaust_critical_ratio_b", B),
];

/// The channels of a value that is corrected on this rig by default.
fn corrected(rig: &RigFile, key: &RigKey) -> Option<Channels> {
    let by_path = rig.rig.follows_iso6358();
    let of = |list: &[(&str, Channels)]| list.iter().find(|(path, _)| *path == key.path).map(|(_, channels)| *channels);
    let stood_for = |both: &RigKey| {
        by_path && both.sides.iter().any(|side| BY_PATH.iter().any(|(path, _)| *path == side.key().path))
    };
    (of(&CORRECTED).filter(|_| !stood_for(key))).or_else(|| of(&BY_PATH).filter(|_| by_path))
}

/// Whether a key stands for a value as the rig file says how well it is known: areas are one value, unless a side has an entry of its
/// own. Bore and rod are turned apart.
fn stands_alone(rig: &RigFile, path: &str) -> bool {
    let by_side = || rig.tolerance.entries().any(|(key, _)| AREAS.contains(&key.path));
    match path {
        AREA => !by_side(),
        side if AREAS.contains(&side) => by_side(),
        _ => true,
    }
}

/// The tolerance of a value without an entry of its own. Weather is what it is; a gauge is no better than its class. A default
/// of zero says that all values are exact, but for the setting of a regulator behind which the supply was measured.
fn by_default(rig: &RigFile, path: &str, supply_measured: bool) -> f64 {
    let default = rig.tolerance.default;
    match path {
        SUPPLY if supply_measured => default.max(constants::regulator()),
        _ if default == 0.0 => 0.0,
        TEMPERATURE => constants::weather_temperature(),
        ATMOSPHERE => constants::weather_atmosphere(),
        SUPPLY => default.max(constants::gauge()),
        // A catalogue draws the curve of a type.
        _ if SLOPES.contains(&path) && !rig.rig.opening.is_empty() => default.max(constants::opening_curve()),
        _ => default,
    }
}

/// Whether all that grows with the cross-section of a rig is among what is corrected, so that no log tells its size
/// ([`plant_model::similarity`]). Hoses have a size of their own.
pub(crate) fn sizes_are_free(rig: &RigFile, nominal: &[Parameter]) -> bool {
    let is_free = |path: &str| nominal.iter().any(|p| p.slot.stated_key() == Some(path));
    let sized = CORRECTED.iter().filter_map(|(path, _)| rig_key(path)).filter(|key| size_exponent(key.name) != 0);
    let sides_are_free = |key: &RigKey| !key.sides.is_empty() && key.sides.iter().all(|side| is_free(side.key().path));
    let all = sized.filter(|key| key.get(&rig.rig) != 0.0).all(|key| is_free(key.path) || sides_are_free(key));
    all && (is_free(AREA) || AREAS.iter().all(|path| is_free(path))) && !rig.rig.has_hoses()
}

/// The nominal values to correct on this rig with the commands of a log, V.
pub(crate) fn nominal_parameters(
    rig: &RigFile,
    judgeable: Channels,
    supply_measured: bool,
    commands_v: &[f64],
) -> Vec<Parameter> {
    let mut out = Vec::new();
    for key in all_keys() {
        let default = corrected(rig, key);
        let request = CORRECTED_ON_REQUEST.iter().find(|(path, _)| *path == key.path && stands_alone(rig, path));
        let (channels, relative) = match (default, request, rig.tolerance.own(key.path)) {
            (Some(channels), _, own) => (channels, own.unwrap_or_else(|| by_default(rig, key.path, supply_measured))),
            (None, Some((_, channels)), Some(own)) => (*channels, own),
            _ => continue,
        };
        // With a measured supply the nominal supply pressure only predicts that channel.
        let channels = if key.path == SUPPLY && supply_measured { S } else { channels };
        // Through the rod the atmosphere acts on the piston, too.
        let rod = key.path == ATMOSPHERE && rig.rig.cylinder.area_a_m2 != rig.rig.cylinder.area_b_m2;
        let channels = if rod { channels | Y } else { channels };
        // However well it is measured, what a tube lets pass by its diameter is an estimate.
        let hose = DIAMETERS.contains(&key.path);
        let relative = if hose { relative.max(constants::hose_flow()) } else { relative };
        let nominal = key.get(&rig.rig);
        let tolerance = relative * nominal.abs();
        let flow = [TEMPERATURE, ATMOSPHERE].contains(&key.path) || key.path == SUPPLY && !supply_measured;
        let farthest =
            if flow || hose { constants::weather_farthest() } else { constants::farthest_nominal() } * tolerance;
        if tolerance > 0.0 && channels & judgeable != 0 {
            // No value changes its sign: that is another rig. Bristles known to 40 or 50 %, as data of seals differ, may be a tenth as stiff.
            let [near, far] = [0.1, 3.0].map(|factor| factor * nominal);
            out.push(Parameter {
                slot: Slot::Nominal(key),
                neutral: nominal,
                scale: tolerance.max(1.0e-4 * nominal.abs()),
                negligible: 0.0,
                tolerance: Some(tolerance),
                min: (nominal - farthest).max(near.min(far)).max(key.limits.low),
                max: (nominal + farthest).min(near.max(far)).min(key.limits.high),
                channels: channels & judgeable,
            });
        }
    }
    out.extend(stated_parameters(rig, judgeable));
    out.extend(delay(rig, judgeable));
    out.extend(shapes(rig, judgeable));
    out.extend(opening_points(rig, judgeable, commands_v));
    if supply_measured {
        let tolerance = constants::supply_sensor() * rig.rig.supply.pressure_pa;
        let farthest = constants::farthest_nominal() * tolerance;
        out.push(Parameter {
            slot: Slot::SupplySensor,
            neutral: 0.0,
            scale: tolerance,
            negligible: 0.0,
            tolerance: Some(tolerance),
            min: -farthest,
            max: farthest,
            channels: (A | B | S) & judgeable,
        });
    }
    out
}

/// How well values of effects are known, relative: as the rig file states. A lag of the valve without an entry is known as well as data
/// sheets give it, unless all values are exact.
fn effect_tolerances(rig: &RigFile) -> Vec<(Effect, usize, f64)> {
    let mut all: Vec<_> = rig.tolerance.effect_entries(&rig.effects).collect();
    let lag = Effect::ValveLag;
    if rig.tolerance.default != 0.0 && rig.effects.get(lag).is_some() && all.iter().all(|(effect, ..)| *effect != lag) {
        all.push((lag, 0, constants::stated_lag()));
    }
    all
}

/// The values of effects that are not exact, such as the most that a data sheet allows.
fn stated_parameters(rig: &RigFile, judgeable: Channels) -> Vec<Parameter> {
    let mut out = Vec::new();
    for (effect, index, relative) in effect_tolerances(rig) {
        let nominal = rig.effects.get(effect).and_then(|values| values.get(index)).copied().unwrap_or(0.0);
        let tolerance = relative * nominal.abs();
        let channels = effects::channels(effect) & judgeable;
        if tolerance > 0.0 && channels != 0 {
            let info = &effect.info().parameters[index];
            let farthest = constants::farthest_nominal() * tolerance;
            out.push(Parameter {
                slot: Slot::Stated(effect, index),
                neutral: nominal,
                scale: tolerance,
                negligible: 0.0,
                tolerance: Some(tolerance),
                min: (nominal - farthest).max(info.min),
                max: (nominal + farthest).min(info.max),
                channels,
            });
        }
    }
    out
}

/// The lag of the valve that the rig file states and its tolerance, s; 0 for what it does not state.
fn lag_s(rig: &RigFile) -> (f64, f64) {
    let lag = Effect::ValveLag;
    let stated_s = rig.effects.get(lag).and_then(|values| values.first()).copied().unwrap_or(0.0);
    let part = effect_tolerances(rig).into_iter().find(|(effect, ..)| *effect == lag).map_or(0.0, |(.., part)| part);
    (stated_s, part * stated_s)
}

/// What is left open of how late the valve acts. Filters and converters make all sensors a little late against the command, on any rig.
/// And data sheets describe a valve by one number: a spool of higher order acts later than one time constant says, by no more than what
/// is open of that. Behind hoses the first wave arrives after the time of sound, but in the mean a line that a chamber closes fills it
/// without delay: what the model has of it may be less, down to nothing.
fn delay(rig: &RigFile, judgeable: Channels) -> Option<Parameter> {
    let channels = effects::channels(Effect::LineDelay) & judgeable;
    let (_, of_lag_s) = lag_s(rig);
    let tolerance = of_lag_s.max(constants::sensors_late_s());
    // No more: a delay that is plainly there has a cause.
    let farthest = constants::weather_farthest() * tolerance;
    let [a_s, b_s] = Plant::unchecked(&rig.rig).line_delays_s();
    let of_hoses_s = a_s.max(b_s);
    let tolerance = tolerance.hypot(constants::hose_delay() * of_hoses_s);
    (channels != 0 && rig.effects.get(Effect::LineDelay).is_none()).then_some(Parameter {
        slot: Slot::Stated(Effect::LineDelay, 0),
        neutral: 0.0,
        scale: tolerance,
        negligible: 0.0,
        tolerance: Some(tolerance),
        min: -of_hoses_s,
        max: farthest,
        channels,
    })
}

/// What a data sheet leaves out of a valve: whether a lag that it states by one number is of first or of second order; and how the curve of
/// the opening runs between the points that were read, how sharp its corners are, and whether the edges to atmosphere open together with
/// those from the supply.
fn shapes(rig: &RigFile, judgeable: Channels) -> Vec<Parameter> {
    let (lag_s, of_lag_s) = lag_s(rig);
    let valve = &rig.rig.valve;
    let most_v = valve.max_voltage_v;
    // Edges to atmosphere come no nearer than where both break-points meet.
    let half_v = 0.5 * (valve.dead_zone_right_v - valve.dead_zone_left_v);
    let tabulated = !rig.rig.opening.is_empty();
    let read = tabulated && rig.tolerance.default != 0.0;
    let of = |is_there: bool, is_open: bool, place: Place, by_default: f64, least: f64| {
        let key = place.key();
        let nominal = key.get(&rig.rig);
        let own = rig.tolerance.own(key.path).map(|own| own * nominal.abs());
        let tolerance = own.unwrap_or(if is_open { by_default } else { 0.0 });
        let farthest = constants::farthest_nominal() * tolerance;
        let channels = (A | B) & judgeable;
        (is_there && channels != 0 && tolerance > 0.0).then_some(Parameter {
            slot: Slot::Nominal(key),
            neutral: nominal,
            scale: tolerance,
            negligible: 0.0,
            tolerance: Some(tolerance),
            min: (nominal - farthest).max(least),
            max: (nominal + farthest).min(key.limits.high),
            channels,
        })
    };
    let rounding = of(true, read, Place::corner_rounding_v, constants::corner_rounding() * most_v, 0.0);
    [
        of(lag_s > 0.0, of_lag_s > 0.0, Place::spool_inertia, constants::spool_inertia(), 0.0),
        rounding.map(squared),
        of(true, read, Place::exhaust_overlap_v, constants::exhaust_overlap() * most_v, -half_v),
        of(tabulated, read, Place::opening_smoothness, constants::opening_smoothness(), 0.0),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// A rounding by its square.
fn squared(rounding: Parameter) -> Parameter {
    let square = |value: f64| value * value;
    let tolerance = rounding.tolerance.map(|tolerance| square(rounding.neutral + tolerance) - square(rounding.neutral));
    let scale = tolerance.unwrap_or(rounding.scale);
    let farthest = constants::farthest_nominal() * scale;
    let neutral = square(rounding.neutral);
    Parameter {
        slot: Slot::Rounding,
        neutral,
        scale,
        tolerance,
        min: (neutral - farthest).max(0.0),
        max: (neutral + farthest).min(square(rounding.max)),
        ..rounding
    }
}

/// The points of a table of the opening between closed and full, as far as the commands reach. The slopes of the two sides take
/// up what all points of one have in common.
fn opening_points(rig: &RigFile, judgeable: Channels, commands_v: &[f64]) -> Vec<Parameter> {
    let default = rig.tolerance.default;
    let channels = (A | B) & judgeable;
    if default == 0.0 || channels == 0 {
        return Vec::new();
    }
    let points = rig.rig.opening.points();
    let (least_v, most_v) =
        commands_v.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| (a.min(*u), b.max(*u)));
    let at = |point: usize| points.get(point).map(|[command_v, _]| *command_v);
    let reached = |point: usize| {
        let before = point.checked_sub(1).and_then(at).unwrap_or(f64::NEG_INFINITY);
        before < most_v && at(point + 1).unwrap_or(f64::INFINITY) > least_v
    };
    let parameter = |(point, [_, opening]): (usize, &[f64; 2])| {
        let side = SLOPES[usize::from(*opening < 0.0)];
        let relative = default.max(constants::opening_point()).min(rig.tolerance.own(side).unwrap_or(f64::INFINITY));
        let tolerance = relative * opening.abs().max(constants::opening_read());
        // As with weather: many that move one flow would take up a coefficient.
        let farthest = constants::weather_farthest() * tolerance;
        let between = tolerance > 0.0 && *opening != 0.0 && opening.abs() < 1.0;
        // A point stays on its side of closed and of full.
        let [near, far] = [0.1 * opening, opening.signum()];
        (between && reached(point)).then(|| Parameter {
            slot: Slot::Opening(point),
            neutral: *opening,
            scale: tolerance,
            negligible: 0.0,
            tolerance: Some(tolerance),
            min: (opening - farthest).max(near.min(far)),
            max: (opening + farthest).min(near.max(far)),
            channels,
        })
    };
    points.iter().enumerate().filter_map(parameter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant_model::OpeningTable;

    fn of_table(commands_v: &[f64], change: impl Fn(&mut RigFile)) -> Vec<Slot> {
        let mut rig = RigFile::paper_a();
        let points = [[-5.0, -1.0], [-2.0, -0.5], [-0.4, 0.0], [0.5, 0.0], [1.0, 0.1], [3.0, 0.8], [4.5, 1.0]];
        rig.rig.opening = OpeningTable::new(&points).expect("a table");
        rig.tolerance.default = 0.02;
        change(&mut rig);
        nominal_parameters(&rig, A | B, false, commands_v).into_iter().map(|p| p.slot).collect()
    }

    #[test]
    fn the_points_of_a_table_are_corrected_between_closed_and_full_as_far_as_commands_reach() {
        let points = |commands_v: &[f64], change: &dyn Fn(&mut RigFile)| -> Vec<usize> {
            let slots = of_table(commands_v, change);
            slots
                .into_iter()
                .filter_map(|slot| if let Slot::Opening(point) = slot { Some(point) } else { None })
                .collect()
        };
        assert_eq!(points(&[-5.0, 5.0], &|_| {}), [1, 4, 5]);
        assert_eq!(points(&[-0.1, 0.7], &|_| {}), [4]);
        assert_eq!(points(&[-5.0, 5.0], &|rig| rig.tolerance.default = 0.0), [0; 0]);
        // A side that is said to be exact.
        let exact = |rig: &mut RigFile| assert!(rig.tolerance.set(SLOPES[0], 0.0));
        assert_eq!(points(&[-5.0, 5.0], &exact), [1]);
    }

    #[test]
    fn every_tolerance_that_a_rig_file_states_counts_but_those_of_values_that_are_always_exact() {
        let exact = ["gas.gas_constant_j_per_kg_k", "cylinder.stroke_m", "valve.max_voltage_v"];
        let mut rig = RigFile::paper_a();
        rig.tolerance.default = 0.0;
        rig.rig.load.inclination_deg = 30.0;
        let h = &mut rig.rig.hoses;
        (h.a_length_m, h.a_diameter_m, h.b_length_m, h.b_diameter_m) = (1.0, 4.0e-3, 0.5, 6.0e-3);
        for name in ["cushion_a.length_m", "cushion_b.length_m"] {
            rig_files::rig_key(name).expect("a key").set(&mut rig.rig, 0.02);
        }
        // A value of both sides stands for either, but for the piston's area, which is corrected as one where it is known as one.
        let counts = |key: &&RigKey| key.sides.is_empty() || key.path == AREA;
        let keys: Vec<_> = all_keys().filter(counts).filter(|key| key.get(&rig.rig) != 0.0).collect();
        assert!(keys.len() > 20, "{}", keys.len());
        for key in keys {
            let mut rig = rig.clone();
            assert!(rig.tolerance.set(key.path, 0.05));
            let found = nominal_parameters(&rig, A | B | Y | S, true, &[0.0])
                .into_iter()
                .any(|p| p.slot == Slot::Nominal(key) && p.tolerance.is_some_and(|tolerance| tolerance > 0.0));
            assert_eq!(found, !exact.contains(&key.path), "{}", key.path);
        }
    }

    #[test]
    fn areas_of_which_a_rig_file_says_how_well_each_is_known_are_corrected_side_by_side() {
        let corrected = |stated: &[(&str, f64)]| {
            let mut rig = RigFile::paper_a();
            rig.rig.cylinder.area_b_m2 *= 0.8;
            stated.iter().for_each(|(path, relative)| assert!(rig.tolerance.set(path, *relative)));
            let all = nominal_parameters(&rig, A | B | Y, false, &[0.0]);
            [AREA, AREAS[0], AREAS[1]].map(|path| {
                let found = all.iter().find(|p| p.slot.stated_key() == Some(path));
                found.and_then(|p| Some(((1.0e6 * p.tolerance? / p.neutral).round(), p.channels)))
            })
        };
        assert_eq!(corrected(&[]), [None; 3]);
        assert_eq!(corrected(&[(AREA, 0.01)]), [Some((1.0e4, A | B | Y)), None, None]);
        let [a, b] = [Some((5.0e3, A | Y)), Some((2.0e4, B | Y))];
        assert_eq!(corrected(&[(AREAS[0], 0.005), (AREAS[1], 0.02)]), [None, a, b]);
        assert_eq!(corrected(&[(AREAS[1], 0.02)]), [None, None, b], "the other is exact");
        assert_eq!(corrected(&[(AREA, 0.005), (AREAS[1], 0.02)]), [None, a, b]);
    }

    #[test]
    fn hoses_pass_more_or_less_and_delay_by_less_than_sound_takes_however_exact_a_rig_file_is() {
        let mut rig = RigFile::paper_a();
        rig.tolerance.default = 0.0;
        let h = &mut rig.rig.hoses;
        (h.a_length_m, h.a_diameter_m, h.b_length_m, h.b_diameter_m) = (1.0, 4.0e-3, 0.5, 6.0e-3);
        let open = |rig: &RigFile| nominal_parameters(rig, A | B, false, &[0.0]);
        let diameter = |rig: &RigFile| {
            let found = open(rig).into_iter().find(|p| p.slot.stated_key() == Some(DIAMETERS[1]));
            found.map(|p| (p.channels, p.tolerance.unwrap_or_default()))
        };
        assert_eq!(diameter(&rig), Some((B, constants::hose_flow() * 6.0e-3)));
        assert!(rig.tolerance.set(DIAMETERS[1], 0.1));
        assert_eq!(diameter(&rig), Some((B, 0.1 * 6.0e-3)));
        let late = delay(&rig, A | B).expect("always open");
        // Of the longer one.
        let sound_s = 1.0 / (1.4_f64 * 287.0 * 293.0).sqrt();
        assert!((late.min + sound_s).abs() < 1e-9 && late.max <= 2.0 * constants::sensors_late_s(), "{late:?}");
        let open_s = constants::sensors_late_s().hypot(constants::hose_delay() * sound_s);
        assert!((late.scale - open_s).abs() < 1e-9, "{late:?}");
        assert_eq!(diameter(&RigFile::paper_a()), None);
    }

    #[test]
    fn a_delay_of_the_valve_is_open_by_what_sensors_are_late_and_by_what_is_open_of_its_lag() {
        let rig = |tolerance: f64, change: &dyn Fn(&mut RigFile)| {
            let mut rig = RigFile::paper_a();
            rig.tolerance.default = tolerance;
            change(&mut rig);
            let of = |slot: Slot| {
                let found = nominal_parameters(&rig, A | B, false, &[0.0]).into_iter().find(|p| p.slot == slot);
                found.and_then(|p| p.tolerance)
            };
            [of(Slot::Stated(Effect::LineDelay, 0)), of(Slot::Stated(Effect::ValveLag, 0))]
        };
        let lag = |rig: &mut RigFile| rig.effects.set(Effect::ValveLag, &[0.002]);
        let late = constants::sensors_late_s();
        assert_eq!(rig(0.0, &|_| {}), [Some(late), None]);
        assert_eq!(rig(0.0, &lag), [Some(late), None], "exact, as all values");
        let open = constants::stated_lag() * 0.002;
        assert_eq!(rig(0.02, &lag), [Some(open); 2]);
        let known = |rig: &mut RigFile| {
            lag(rig);
            rig.tolerance.set_effect(Effect::ValveLag, 0, 0.1);
        };
        assert_eq!(rig(0.02, &known), [Some(0.1 * 0.002); 2]);
        let both = |rig: &mut RigFile| {
            lag(rig);
            rig.effects.set(Effect::LineDelay, &[0.003]);
        };
        assert_eq!(rig(0.02, &both), [None, Some(open)]);
        assert_eq!(delay(&RigFile::paper_a(), A | B).map(|p| p.min), Some(0.0));
    }
}
