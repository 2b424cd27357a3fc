//! The right-hand side of `plant-model` against the second transcription, state by state.

use plant_model::{Effects, Plant, Rig, State};
use validation::{NUMBER_OF_STATES, Reference, state::*};

#[test]
fn both_transcriptions_agree_to_rounding_over_the_state_space() {
    let cases = [
        (Rig::<f64>::paper_a(), Reference::case_a()),
        (Rig::paper_b(), Reference::case_b()),
        (Rig::paper_c(), Reference::case_c()),
    ];
    for (rig, reference) in cases {
        let plant = Plant::new(&rig, &Effects::none()).unwrap();
        // A lattice of irrational steps covers every branch of (3.3) and (3.12).
        for k in 0..20_000 {
            let at = |irrational: f64| 2.0 * (irrational * f64::from(k)).fract() - 1.0;
            let y = 0.49 * rig.cylinder.stroke_m * at(0.618_033_988_7);
            let v = 1.5 * at(0.414_213_562_3).powi(5);
            let p_a = 4.0e5 + 3.0e5 * at(0.732_050_807_5);
            let p_b = 4.0e5 + 3.0e5 * at(0.236_067_977_4);
            let z = 5.0e-5 * at(0.645_751_311_0);
            let u = 5.0 * at(0.316_624_790_3);
            let mut expected = [0.0; NUMBER_OF_STATES];
            let mut x = reference.start();
            (x[Y], x[V], x[P_A], x[P_B], x[Z]) = (y, v, p_a, p_b, z);
            reference.right_hand_side(u, &x, &mut expected);
            let state = State { y_m: y, v_m_per_s: v, z_m: z, ..plant.state_at_rest(y, p_a, p_b) };
            let found = plant.derivative(&state, &plant.inputs(u));
            let found = [found.y_m, found.v_m_per_s, found.p_a_pa, found.p_b_pa, found.z_m];
            for (i, (found, size)) in found.into_iter().zip([1.0, 100.0, 1e7, 1e7, 1.0]).enumerate() {
                let error = (found - expected[i]).abs();
                assert!(error < 1e-11 * size, "rate {i} off by {error:e} at u {u}, {state:?}");
            }
        }
    }
}
