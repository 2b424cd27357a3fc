//! What every effect did to a trajectory when it was recorded, it still does, to the last bit, in `f64` and `f32`.
//!
//! A line of the recording names precision, rig and effects at their typical strength, then a hash of all states and
//! measurements. `UPDATE_RECORDINGS=1` before the test rewrites it, with a line for each effect of the catalogue: after a
//! change of the equations that is meant, never to make the test pass.

use plant_model::{Effect, Effects, Real, Rig, Simulator};

const RECORDING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/recorded/trajectories.txt");
const TICKS: u32 = 2500;

/// Combinations beside no effect and each effect alone.
const COMBINATIONS: [&str; 6] = [
    "coulomb-friction+viscous-friction+friction-asymmetry+friction-position+friction-pressure",
    "static-friction+friction-asymmetry+friction-position+friction-pressure+constant-force+payload-mass",
    "choked-flow+supply-droop+leak-cross-piston+leak-chamber-a+leak-chamber-b",
    "valve-dead-zone+valve-lag+valve-hysteresis+line-delay+fill-coefficient+exhaust-coefficient",
    "position-scale+pressure-a-offset+pressure-b-offset+pressure-lag+position-delay",
    "dead-volume+heat-transfer+supply-droop+valve-lag+pressure-lag+friction-pressure+leak-cross-piston",
];

/// Sines that slide, a sine that creeps, steps that hit the ends, rest with the valve closed.
fn command_v(tick: u32) -> f64 {
    let t = f64::from(tick) * 1.0e-3;
    match tick {
        0..800 => 1.2 * libm::sin(9.0 * t) + 0.4 * libm::sin(31.0 * t + 0.4),
        800..1400 => 0.08 * libm::sin(7.0 * t),
        1400..1500 => 0.0,
        1500..1900 => 3.0,
        1900..2300 => -6.0,
        _ => 0.0,
    }
}

/// FNV-1a over the bits of what is simulated.
fn hash<R: Real>(rig: &Rig<R>, effects: &Effects<R>) -> u64 {
    let mut simulator = Simulator::<R>::new(rig, effects).expect("paper rigs take typical effects");
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for tick in 0..TICKS {
        simulator.advance(R::of(command_v(tick)), R::of(1.0e-3));
        let (s, m) = (simulator.state(), simulator.measure());
        let state = [s.y_m, s.v_m_per_s, s.p_a_pa, s.p_b_pa, s.z_m, s.spool_v, s.p_sup_pa, s.p_a_sensed_pa];
        for value in state.into_iter().chain([s.p_b_sensed_pa, m.y_m, m.p_a_pa, m.p_b_pa, m.p_sup_pa]) {
            // Widening keeps every bit of a single-precision number.
            for byte in value.to_f64().to_bits().to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        }
    }
    hash
}

/// `id+id`, or `none`, as a set at typical strength.
fn effects(ids: &str) -> Effects<f64> {
    let mut effects = Effects::none();
    for id in ids.split('+').filter(|id| *id != "none") {
        let effect = Effect::from_id(id).unwrap_or_else(|| panic!("the catalogue has lost `{id}`"));
        let typical: Vec<f64> = effect.info().parameters.iter().map(|p| p.typical).collect();
        effects.set(effect, &typical);
    }
    effects
}

fn line(precision: &str, case: &str, ids: &str) -> String {
    let rig = match case {
        "a" => Rig::<f64>::paper_a(),
        "b" => Rig::paper_b(),
        "c" => Rig::paper_c(),
        _ => panic!("no such rig: {case}"),
    };
    let single = match case {
        "a" => Rig::<f32>::paper_a(),
        "b" => Rig::paper_b(),
        _ => Rig::paper_c(),
    };
    let hash = match precision {
        "f64" => hash(&rig, &effects(ids)),
        "f32" => hash(&single, &effects(ids).convert()),
        _ => panic!("no such precision: {precision}"),
    };
    format!("{precision} {case} {ids} {hash:016x}\n")
}

#[test]
fn every_recorded_trajectory_is_the_same_to_the_last_bit() {
    if std::env::var_os("UPDATE_RECORDINGS").is_some() {
        let alone = Effect::ALL.map(Effect::id);
        let mut recording = String::new();
        for precision in ["f64", "f32"] {
            for case in ["a", "b", "c"] {
                for ids in ["none"].into_iter().chain(alone).chain(COMBINATIONS) {
                    recording += &line(precision, case, ids);
                }
            }
        }
        std::fs::write(RECORDING, recording).unwrap();
    }
    let recording = std::fs::read_to_string(RECORDING).unwrap();
    assert!(recording.lines().count() > 100, "the recording is there");
    let changed: Vec<String> = recording
        .lines()
        .filter(|stored| {
            let words: Vec<&str> = stored.split(' ').collect();
            let [precision, case, ids, _] = words[..] else { panic!("not a line of the recording: {stored}") };
            line(precision, case, ids).trim_end() != *stored
        })
        .map(str::to_owned)
        .collect();
    assert!(changed.is_empty(), "other than recorded: {changed:#?}");
}
