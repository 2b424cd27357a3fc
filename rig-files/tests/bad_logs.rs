//! A table of malformed logs, and what a good one may look like.

use rig_files::{Column, Log, RigFile};

const BAD: &[(&[u8], &[&str])] = &[
    (b"", &["is empty"]),
    (b"\n\n", &["is empty"]),
    (b"t_s,y_m,u_v\n", &["no data"]),
    (b"y_m,u_v\n0,0\n", &["line 1", "`t_s` is missing"]),
    (b"t_s,u_v\n0,0\n", &["line 1", "`y_m` is missing"]),
    (b"t_s,y_m\n0,0\n", &["only time and position", "at least one of u_v"]),
    (b"t_s,y_m,u_v\n0,0,\n1,0,\n", &["only time and position"]),
    (b"t_s,y_m,u_v\n0,,1\n1,,1\n", &["`y_m` has no sample"]),
    (b"t_s,y_m,p_a\n0,0,1\n", &["line 1", "`p_a` is not known", "did you mean `p_a_pa`"]),
    (b"t_s,y_m,colour\n0,0,1\n", &["line 1", "`colour` is not known", "remove it; known columns"]),
    (b"AI0 AI1,AO0\n0 0,1\n", &["line 1", "`AI0 AI1` is not known", "`plant-sim import`", "known columns"]),
    (b"Zeit,Dr\xFCcke\n0,1\n", &["line 1", "is not UTF-8", "`plant-sim import`"]),
    (b"t_s,y_m,u_v,y_m\n0,0,1,2\n", &["line 1", "`y_m` appears twice"]),
    (b"0.0,1.0,2.0\n1.0,1.0,1.0\n", &["line 1", "header row"]),
    (b"t_s;y_m;u_v\n0;0;0\n", &["line 1", "semicolons", "commas", "`plant-sim import`", "--suggest"]),
    (b"t_s;y_m;u_v\n0,1;0,2;0,3\n", &["line 1", "semicolons", "`plant-sim import`", "--suggest"]),
    (b"t_s\ty_m\tu_v\n0\t0\t0\n", &["line 1", "tabs", "commas", "`plant-sim import`", "--suggest"]),
    (b"t_s,y_m,u_v,\n0,0,0,\n", &["line 1", "column 4 has no name", "remove it"]),
    (b"t_s,y_m,u_v\n0,0,0\n1,\"0,0\n2,0,0\n3,0,0\n", &["line 3", "quote opens", "not closed", "remove the quote"]),
    (b"t_s,y_m,u_v\n0,\"0\n0\",0\n1,0,0\n", &["line 2", "quote opens"]),
    (b"t_s,y_m,u_v\n1e300,0,0\n-1e300,0,0\n", &["line 3", "goes from 1e300 to -1e300"]),
    (b"t_s,y_m,u_v\n0,0,0\n1,5 mm,0\n", &["line 3", "`y_m`", "5 mm"]),
    (b"t_s,y_m,u_v\n0,0,0\n1,NaN,0\n", &["line 3", "`y_m`", "leave the field blank"]),
    (b"t_s,y_m,u_v\n0,0,0\n1,0,-inf\n", &["line 3", "`u_v`", "finite"]),
    (b"t_s,y_m,u_v\n0,0,0\n1,0,1e400\n", &["line 3", "`u_v`", "finite"]),
    (b"t_s,y_m,u_v\n0,0,0\n2,0,0\n1,0,0\n", &["line 4", "`t_s` goes from 2 to 1", "sort"]),
    (b"t_s,y_m,u_v\n0,0,0\n0,0,0\n", &["line 3", "`t_s` goes from 0 to 0"]),
    (b"t_s,y_m,u_v\n,0,0\n", &["line 2", "`t_s` is blank"]),
    (b"t_s,y_m,u_v\n0,0,5,0\n", &["line 2", "4 fields", "3"]),
    (b"t_s,y_m,u_v\n0,0,0\n1,0\n", &["line 3", "2 fields", "3"]),
    (b"t_s,y_m,u_v\n0,0,0\n\xFF\xFE,0,0\n", &["line 3", "UTF-8"]),
    (b"\xFF\xFEt\0_\0s\0", &["UTF-16"]),
    (b"t_s,y_m,u_v\n0,0,\0\n", &["NUL"]),
];

#[test]
fn every_malformed_log_gives_one_error_that_names_place_and_remedy() {
    for (bytes, words) in BAD {
        let shown = String::from_utf8_lossy(bytes);
        let error = Log::parse(bytes.to_vec(), "run.csv").expect_err(&shown).to_string();
        assert!(error.starts_with("run.csv") && error.lines().count() == 1, "{shown}: {error}");
        assert!(error.contains("; "), "{shown} has no remedy: {error}");
        for word in *words {
            assert!(error.contains(word), "{shown}: expected {word:?} in: {error}");
        }
    }
}

#[test]
fn columns_may_stand_in_any_order_with_blanks_spaces_quotes_and_a_byte_order_mark() {
    let text = "\u{FEFF}u_v,\"t_s\", y_m ,p_a_pa\r\n1, 0 ,0.1,\r\n\r\n-1,0.001,,3e5\r\n";
    let log = Log::parse(text.as_bytes().to_vec(), "run.csv").expect("good");
    assert_eq!(log.t_s, [0.0, 0.001]);
    assert_eq!(log.u_v.as_deref(), Some(&[1.0, -1.0][..]));
    assert!(log.y_m[1].is_nan() && log.p_a_pa.as_ref().is_some_and(|p| p[0].is_nan() && p[1] == 3e5));
    assert_eq!(log.p_b_pa, None);
}

#[test]
fn a_column_without_a_single_sample_counts_as_not_measured() {
    let log = Log::parse(b"t_s,y_m,u_v,p_sup_pa\n0,0,0,\n1,0,0,\n".to_vec(), "run.csv").expect("good");
    assert_eq!(log.column(Column::PSup), None);
}

#[test]
fn missing_rows_and_runs_of_blanks_are_reported_as_gaps() {
    let text = b"t_s,y_m,u_v\n0,0,0\n1,0,\n2,0,\n3,0,0\n4,0,0\n8,0,0\n9,,0\n";
    let gaps = Log::parse(text.to_vec(), "run.csv").expect("good").gaps();
    let found: Vec<_> = gaps.iter().map(|gap| (gap.column, gap.from_s, gap.to_s)).collect();
    assert_eq!(found, [(None, 4.0, 8.0), (Some(Column::U), 0.0, 3.0), (Some(Column::Y), 8.0, 9.0)]);
}

#[test]
fn wrong_units_are_suspected_aloud_and_right_ones_are_not() {
    let suspicions = |text: &str| Log::parse(text.into(), "run.csv").expect("good").suspicions(&RigFile::paper_a());
    assert_eq!(suspicions("t_s,y_m,u_v,p_a_pa\n0,0.4,5,1e5\n1,-0.4,-5,7e5\n"), Vec::<String>::new());
    assert!(suspicions("t_s,y_m,u_v\n0,400,5\n")[0].contains("metres"));
    assert!(suspicions("t_s,y_m,p_a_pa\n0,0.4,6.1\n")[0].contains("bar"));
    assert!(suspicions("t_s,y_m,p_a_pa\n0,0.4,0\n1,0.4,6e5\n")[0].contains("gauge"));
    for (text, said) in [
        ("t_s,y_m,u_v\n0,-1e300,5\n", "from -1.000e300 to -1.000e300 m"),
        ("t_s,y_m,u_v\n0,0.4,1e300\n", "from 1.000e300 to 1.000e300 V"),
        ("t_s,y_m,p_a_pa\n0,0.4,-1e300\n1,0.4,6e5\n", "falls to -1.000e300 Pa"),
        ("t_s,y_m,p_a_pa\n0,0.4,1e308\n", "rises to 1.000e308 Pa, far above the supply of 7e5 Pa"),
    ] {
        assert!(suspicions(text)[0].contains(said), "{said:?} in {:?}", suspicions(text));
    }
    assert!(suspicions("t_s,y_m,u_v\n0,0.4,10\n")[0].contains("mid position"));
    assert!(suspicions("t_s,y_m,p_a_pa\n0,0.4,1e6\n1,0.4,6e5\n")[0].contains("sensor's range, in 1 of 2 rows"));
    assert!(suspicions("t_s,y_m,p_a_pa\n0,0.4,1.2e6\n1,0.4,6e5\n")[0].contains("unit"));
}

#[test]
fn a_written_log_reads_back_to_the_same_bits() {
    let mut log =
        Log { t_s: vec![0.0, 0.1, 0.30000000000000004], y_m: vec![1e-300, 0.045, -1.0 / 3.0], ..Log::default() };
    log.set(Column::PA, Some(vec![361_800.123, 3.6e5, 1.0]));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("log.csv");
    log.write(&path).expect("writable");
    assert_eq!(Log::read(&path).expect("good"), log);
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("readable").collect();
    assert_eq!(left.len(), 1, "no temporary file stays behind");
}

#[test]
fn writing_makes_the_folder_or_fails_with_a_remedy_and_leaves_no_half_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let log = Log { t_s: vec![0.0], y_m: vec![0.0], ..Log::default() };
    let path = folder.path().join("new/folder/log.csv");
    log.write(&path).expect("the folder is made");
    let error = log.write(&path.join("log.csv")).expect_err("a file is no folder");
    assert!(error.to_string().contains("a part of the path is a file"), "{error}");
    std::fs::remove_dir_all(folder.path().join("new")).expect("removable");
    let failed = rig_files::write_file(&folder.path().join("half.csv"), |out| {
        out.write_all(b"half")?;
        Err(std::io::Error::other("the disk is full"))
    });
    assert!(failed.is_err());
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0, "no half-written file");
}
