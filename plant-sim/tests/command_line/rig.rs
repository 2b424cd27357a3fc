//! `plant-sim rig`, and the set-ups in `rigs/` that it wrote.

use crate::{program, root};
use rig_files::RigFile;
use std::path::PathBuf;
use std::process::{Output, Stdio};

/// The shipped set-ups: file, and the arguments it was written with.
const SHIPPED: [(&str, &[&str]); 5] = [
    (
        "festo-dsbc-32-200.toml",
        &[
            "--name",
            "Festo DSBC-32-200-PPVA-N3 behind MPYE-5-1/8-LF-010-B",
            "--note",
            "Standard cylinder ISO 15552; position: MLO-POT-225-TLF, its middle at mid-stroke; pressure: SPTW-P10R.",
            "--bore",
            "32",
            "--rod",
            "12",
            "--stroke",
            "200",
            "--mass",
            "4",
            "--valve",
            "mpye-5-1/8-lf",
            "--hose-length",
            "1",
            "0.8",
            "--hose-diameter",
            "4",
            "--position-range",
            "-112.5",
            "112.5",
        ],
    ),
    (
        "festo-dgc-25-500.toml",
        &[
            "--name",
            "Festo DGC-25-500-KF (rodless) behind MPYE-5-1/8-LF-010-B",
            "--note",
            "Rodless cylinder with recirculating ball guide; position: MLO-POT-500-TLF; pressure: SPTW-P10R.",
            "--bore",
            "25",
            "--rod",
            "0",
            "--stroke",
            "500",
            "--mass",
            "6",
            "--valve",
            "mpye-5-1/8-lf",
            "--hose-length",
            "0.6",
            "--hose-diameter",
            "4",
        ],
    ),
    (
        "smc-cp96-50-300-lifting.toml",
        &[
            "--name",
            "SMC CP96SDB50-300, rod up, behind Festo MPYE-5-1/4-010-B",
            "--note",
            "Standard cylinder ISO 15552; hoses TU1065 (6.5 mm inside); position: 300 mm transducer; pressure: 0 to 10 bar.",
            "--bore",
            "50",
            "--rod",
            "20",
            "--stroke",
            "300",
            "--mass",
            "15",
            "--inclination",
            "90",
            "--valve",
            "mpye-5-1/4",
            "--hose-length",
            "1.5",
            "--hose-diameter",
            "6.5",
        ],
    ),
    (
        "festo-dsnu-25-100.toml",
        &[
            "--name",
            "Festo DSNU-25-100-PPS-A behind MPYE-5-M5-010-B",
            "--note",
            "Round cylinder ISO 6432; hoses PUN-4x0,75 (2.6 mm inside); position: MLO-POT-100-TLF; pressure: SPTW-P10R.",
            "--bore",
            "25",
            "--rod",
            "10",
            "--stroke",
            "100",
            "--mass",
            "1.5",
            "--valve",
            "mpye-5-m5",
            "--hose-length",
            "0.5",
            "--hose-diameter",
            "2.6",
        ],
    ),
    (
        "festo-esnu-25-50.toml",
        &[
            "--name",
            "Festo ESNU-25-50-P-A behind MPYE-5-M5-010-B",
            "--note",
            "Single-acting round cylinder ISO 6432, the valve's port B plugged; hose PUN-4x0,75 (2.6 mm inside); position: MLO-POT-50-TLF.",
            "--note",
            "The spring's forces are typical of round cylinders of this bore: press the rod in by hand over a scale.",
            "--bore",
            "25",
            "--rod",
            "10",
            "--stroke",
            "50",
            "--spring",
            "20",
            "40",
            "--mass",
            "0.8",
            "--valve",
            "mpye-5-m5",
            "--hose-length",
            "0.5",
            "--hose-diameter",
            "2.6",
        ],
    ),
];

fn rig(arguments: &[&str]) -> Output {
    program(&root()).arg("rig").args(arguments).stdin(Stdio::null()).output().expect("plant-sim runs")
}

fn path(file: &str) -> PathBuf {
    root().join("rigs").join(file)
}

#[test]
fn the_shipped_set_ups_are_what_the_command_writes() {
    for (file, arguments) in SHIPPED {
        let output = rig(arguments);
        assert!(output.status.success(), "{file}: {}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).unwrap();
        if std::env::var_os("UPDATE_DOCS").is_some() {
            std::fs::write(path(file), &text).unwrap();
        }
        let stored = std::fs::read_to_string(path(file)).unwrap();
        assert!(stored == text, "rigs/{file} is out of date: run this test with UPDATE_DOCS=1");
        let read = RigFile::parse(&text, file).unwrap();
        assert!(read.rig.follows_iso6358() && !read.rig.opening.is_empty());
    }
}

#[test]
fn a_missing_or_implausible_number_is_one_line_with_a_remedy_and_status_2() {
    let good = ["--bore", "32", "--rod", "12", "--stroke", "200", "--mass", "4", "--valve", "mpye-5-1/8-lf"];
    assert!(rig(&good).status.success());
    for (place, value, said) in [
        (0, None, "--bore is missing"),
        (1, Some("0.032"), "mm"),
        (3, Some("40"), "thinner"),
        (5, Some("200000"), "--stroke"),
        (7, Some("4000000"), "--mass"),
        (9, Some("mpye"), "--flow in l/min"),
    ] {
        let mut arguments = good.to_vec();
        match value {
            Some(value) => arguments[place] = value,
            None => drop(arguments.drain(place..place + 2)),
        }
        let output = rig(&arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(error.trim_end().lines().count() == 1 && error.contains(said), "{error}");
    }
    let with = |more: &[&str]| {
        let arguments: Vec<&str> = good.iter().chain(more).copied().collect();
        String::from_utf8_lossy(&rig(&arguments).stderr).into_owned()
    };
    assert!(with(&["--spring", "40", "20"]).contains("no less"), "forces in the wrong order");
    assert!(with(&["--cushion-length", "0.02"]).contains("mm"), "a length in metres");
    assert!(with(&["--dead-volume", "8000"]).contains("cm3"), "a volume a thousand times off");
    assert!(with(&["--position-range", "0", "200"]).contains("-100 to 100"), "a range that begins at the end stop");
    assert!(with(&["--pressure-range", "0", "1000000"]).contains("bar"), "a range in pascals");
}
