//! Any bytes and any mutation of a good file: a value or an error, never a panic; and writing reads back.

use plant_model::{Effect, Plant};
use proptest::prelude::*;
use rig_files::{Column, Log, RIG_KEYS, RigFile};

/// A good file with one stretch replaced by something else.
fn mutated(good: String) -> impl Strategy<Value = String> {
    let alphabet = "[ -~\n\t=\\[\\]\"{}.,e+\\-0-9äλ\u{feff}\u{0}]{0,12}";
    (0..good.len(), 0..20usize, alphabet).prop_map(move |(at, length, insert)| {
        let mut bytes = good.as_bytes().to_vec();
        let end = (at + length).min(bytes.len());
        bytes.splice(at..end, insert.bytes());
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

const LOG: &str = "t_s,u_v,y_m,p_a_pa,p_b_pa\n0,1,0.1,3e5,3e5\n0.001,1,0.1,3e5,\n0.002,1,0.1,3e5,3e5\n";

proptest! {
    #[test]
    fn any_text_as_a_rig_gives_a_rig_or_an_error(text in ".{0,200}") {
        let _ = RigFile::parse(&text, "rig.toml");
    }

    #[test]
    fn a_mutated_rig_gives_a_valid_rig_or_an_error_in_one_line(text in mutated(RigFile::paper_a().to_toml())) {
        match RigFile::parse(&text, "rig.toml") {
            Ok(rig) => prop_assert!(rig.rig.validate().is_ok()),
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
        }
    }

    #[test]
    fn any_bytes_as_a_log_give_a_log_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = Log::parse(bytes, "log.csv");
    }

    #[test]
    fn a_mutated_log_keeps_its_promises_or_gives_an_error(text in mutated(LOG.to_string())) {
        if let Ok(log) = Log::parse(text.into_bytes(), "log.csv") {
            prop_assert!(log.t_s.windows(2).all(|pair| pair[0] < pair[1]));
            for column in Column::ALL {
                if let Some(values) = log.column(column) {
                    prop_assert_eq!(values.len(), log.len());
                    prop_assert!(values.iter().all(|value| value.is_finite() || value.is_nan()));
                }
            }
            let _ = log.gaps();
            let _ = log.suspicions(&RigFile::paper_a());
        }
    }

    #[test]
    fn a_rig_reads_back_bit_for_bit(name in ".{0,20}", at in 0..RIG_KEYS.len(), factor in 0.8..1.2f64, tolerance in 0.0..0.5f64, effect in 0..Effect::ALL.len(), part in 0.0..1.0f64) {
        let mut rig = RigFile::paper_b();
        rig.name = name;
        let key = &RIG_KEYS[at];
        let value = key.get(&rig.rig) * factor;
        let mut varied = rig.rig;
        key.set(&mut varied, value);
        prop_assume!(varied.validate().is_ok());
        rig.rig = varied;
        rig.tolerance.set(key.path, tolerance);
        let effect = Effect::ALL[effect];
        let values: Vec<f64> = effect.info().parameters.iter().map(|info| info.min + part * (info.max - info.min)).collect();
        rig.effects.set(effect, &values);
        prop_assume!(Plant::new(&rig.rig, &rig.effects).is_ok());
        prop_assert_eq!(RigFile::parse(&rig.to_toml(), "rig.toml").map_err(|e| e.to_string()), Ok(rig));
    }

    #[test]
    fn a_log_reads_back_bit_for_bit(rows in proptest::collection::vec((1e-6..1.0f64, any::<f64>(), any::<f64>()), 1..20)) {
        let finite = |value: f64| if value.is_finite() { value } else { 0.5 };
        let mut t_s = 0.0;
        let mut log = Log::default();
        let mut u_v = Vec::new();
        for (step_s, y_m, u) in rows {
            t_s += step_s;
            log.t_s.push(t_s);
            log.y_m.push(finite(y_m));
            u_v.push(finite(u));
        }
        log.u_v = Some(u_v);
        prop_assert_eq!(Log::parse(log.to_csv().into_bytes(), "log.csv").map_err(|e| e.to_string()), Ok(log));
    }
}
