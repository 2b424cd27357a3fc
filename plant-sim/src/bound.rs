//! The shortest time in which a rig's valve can move its piston: full flow one way, then the other, then back to balance.
//!
//! One input between two ends moves position, velocity and force from rest to rest fastest when it stands at its ends and
//! changes sides twice (Pontryagin's maximum principle; Athans and Falb 1966). What runs is the simulated rig itself, with its
//! dead zone, lag, flow and friction, so no law on this valve is faster. Friction holds the piston where it stops: the
//! force there need only be within the Coulomb friction of where it began.

use plant_model::{Effects, ParameterError, Rig, Simulator, State};

/// Within this distance the piston has arrived, m.
const BAND_M: f64 = 1.0e-4;
/// Steps of the search, s: coarse on the way, fine while it brakes.
const STEPS_S: [f64; 3] = [1.0e-3, 2.0e-4, 2.0e-4];
/// No move takes longer, s.
const LONGEST_S: f64 = 20.0;
/// Halvings of the interval of each of the two times.
const HALVINGS: u32 = 24;

/// How a try ended.
#[derive(Clone, Copy, Debug)]
struct Stop {
    /// Where the piston first stood, m along the move.
    at_m: f64,
    /// Change of the force since the start, N along the move.
    force_n: f64,
    /// When it came within the band around that place for good, s.
    arrived_s: f64,
    /// Whether it stood at all.
    stood: bool,
}

/// Time of the fastest move over `distance_m` from rest at mid-stroke until within 0.1 mm, s; infinite where the rig cannot make it in 20 s.
///
/// # Errors
/// The plant refuses a parameter.
pub fn bound_s(rig: &Rig<f64>, effects: &Effects<f64>, distance_m: f64) -> Result<f64, ParameterError> {
    let side = distance_m.signum();
    let distance_m = distance_m.abs();
    let attempt = |first_s: f64, second_s: f64| attempt(rig, effects, side, [first_s, second_s]);
    // Braking without end reaches furthest back: the first time needed with it bounds both.
    let mut longest_s = 0.05;
    while attempt(longest_s, LONGEST_S)?.at_m < distance_m {
        longest_s *= 2.0;
        if longest_s > LONGEST_S {
            return Ok(f64::INFINITY);
        }
    }
    // The longest braking that leaves the force within friction.
    let braked = |first_s: f64| {
        let (mut low, mut high) = (0.0, 2.0 * longest_s);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let stop = attempt(first_s, middle)?;
            if !stop.stood || stop.force_n > -rig.friction.coulomb_n { low = middle } else { high = middle }
        }
        attempt(first_s, high)
    };
    let (mut low, mut high) = (0.0, longest_s);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if braked(middle)?.at_m < distance_m { low = middle } else { high = middle }
    }
    Ok(braked(high)?.arrived_s)
}

fn attempt(rig: &Rig<f64>, effects: &Effects<f64>, side: f64, lengths_s: [f64; 2]) -> Result<Stop, ParameterError> {
    let mut simulator: Simulator<f64> = Simulator::new(rig, effects)?;
    let begin = *simulator.state();
    let force = |state: &State<f64>| {
        let cylinder = &rig.cylinder;
        side * (cylinder.area_a_m2 * (state.p_a_pa - begin.p_a_pa) - cylinder.area_b_m2 * (state.p_b_pa - begin.p_b_pa))
    };
    let most = side * rig.valve.max_voltage_v;
    let [first_s, second_s] = lengths_s;
    let ends_s = [first_s, first_s + second_s, LONGEST_S];
    let mut path = Vec::new();
    let (mut t_s, mut stood, mut gone) = (0.0, false, false);
    for (phase, (u, end_s)) in [most, -most, most].into_iter().zip(ends_s).enumerate() {
        let entered = side * simulator.state().v_m_per_s;
        while t_s < end_s.min(LONGEST_S) && !stood && !gone {
            let step_s = STEPS_S[phase].min(end_s - t_s);
            simulator.advance(u, step_s);
            t_s += step_s;
            let state = simulator.state();
            let v = side * state.v_m_per_s;
            path.push((t_s, side * (state.y_m - begin.y_m)));
            stood = phase > 0 && v <= 0.0;
            // Faster again than when the last change of side came: it will not stand before the end stop.
            gone = phase == 2 && v > entered;
        }
    }
    let state = simulator.state();
    let at_m = side * (state.y_m - begin.y_m);
    let outside = path.iter().rposition(|(_, y_m)| (y_m - at_m).abs() > BAND_M);
    Ok(Stop { at_m, force_n: force(state), arrived_s: outside.map_or(0.0, |n| path[n].0), stood })
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant_model::Effect;

    #[test]
    fn the_paper_s_cylinders_have_the_bounds_of_an_independent_simulator_within_6_percent() {
        let effects = Effects::none().with(Effect::ValveLag, &[1.7e-3]);
        for (mut rig, moves) in [
            (Rig::paper_a(), [(1e-3, 0.057), (0.045, 0.199)]),
            (Rig::paper_b(), [(1e-3, 0.055), (-0.045, 0.198)]),
            (Rig::paper_c(), [(0.01, 0.061), (0.045, 0.175)]),
        ] {
            for half_v in [0.42, 0.0] {
                (rig.valve.dead_zone_right_v, rig.valve.dead_zone_left_v) = (half_v, -half_v);
                for (distance_m, expected_s) in moves {
                    let found_s = bound_s(&rig, &effects, distance_m).expect("a valid rig");
                    assert!(
                        (found_s / expected_s - 1.0).abs() < 0.06,
                        "{distance_m} m: {found_s} s, not {expected_s} s"
                    );
                }
            }
        }
    }

    #[test]
    fn a_piston_that_friction_holds_never_arrives() {
        let mut rig = Rig::paper_a();
        (rig.friction.coulomb_n, rig.friction.static_n) = (2000.0, 2100.0);
        assert_eq!(bound_s(&rig, &Effects::none(), 0.045).expect("a valid rig"), f64::INFINITY);
    }
}
