//! The rig files of the project say what the code says.

use plant_model::{Effect, Plant};
use rig_files::RigFile;
use std::path::PathBuf;

fn shipped(name: &str) -> RigFile {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../rigs").join(name);
    RigFile::read(&path).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_papers_rig_files_hold_tables_1_and_2() {
    assert_eq!(shipped("paper-a.toml"), RigFile::paper_a());
    assert_eq!(shipped("paper-b.toml"), RigFile::paper_b());
    assert_eq!(shipped("paper-c.toml"), RigFile::paper_c());
}

#[test]
fn the_real_valves_rig_has_dead_zone_lag_and_hysteresis() {
    let rig = shipped("real-mpye.toml");
    assert_eq!((rig.rig.valve.dead_zone_left_v, rig.rig.valve.dead_zone_right_v), (-0.42, 0.42));
    assert_eq!(rig.effects.get(Effect::ValveLag), Some(&[1.7e-3][..]));
    assert_eq!(rig.effects.get(Effect::ValveHysteresis), Some(&[0.030][..]));
    assert_eq!((rig.tolerance.of("load.mass_kg"), rig.tolerance.of("cylinder.area_m2")), (0.005, 0.02));
    assert!(Plant::new(&rig.rig, &rig.effects).is_ok());
}
