//! Foreign tables as loggers write them: a log with what was done, or one error that names the line to write. Drafts of mappings.

use crate::{program, root};
use plant_sim::import::{Imported, Mapping, suggest};
use proptest::prelude::*;
use rig_files::RigFile;
use std::path::Path;

/// A mapping of a time, a position in mm and a pressure in bar.
fn mapping(source: &str, time: &str, more: &str) -> String {
    let time = if time.is_empty() { String::new() } else { format!("[column.t_s]\n{time}\n") };
    format!(
        "[source]\natmosphere_pa = 1e5\n{source}\n{time}[column.y_m]\nfrom = \"y\"\nunit = \"mm\"\n[column.p_a_pa]\nfrom = \
         \"p\"\n{more}\n"
    )
}

fn convert(map: &str, table: &[u8]) -> Result<Imported, String> {
    let mapping = Mapping::parse(map, "map.toml").map_err(|error| error.to_string())?;
    mapping.convert(table, "table.csv").map_err(|error| error.to_string())
}

const BAR: &str = "unit = \"bar\"";
const STAMPED: &str = "from = \"t\"\ntime = \"datetime\"";
const CLOCK: &str = "from = \"t\"\ntime = \"clock\"";
const SECONDS: &str = "from = \"t\"";

/// Source keys, time keys, table, times and positions in mm that must come out.
type Good = (&'static str, &'static str, &'static str, &'static [f64], &'static [f64]);

const GOOD: &[Good] = &[
    ("", STAMPED, "t,y,p\n2026-03-01 10:00:00.125,1,2\n2026-03-01 10:00:00.250,2,2\n", &[0.0, 0.125], &[1.0, 2.0]),
    ("", STAMPED, "t,y,p\n2026-03-01T23:59:59.5Z,1,2\n2026-03-02T00:00:00.0Z,2,2\n", &[0.0, 0.5], &[1.0, 2.0]),
    ("", STAMPED, "t,y,p\n2026-03-01 10:00:00.5 UTC,1,2\n2026-03-01 10:00:01 GMT,2,2\n", &[0.0, 0.5], &[1.0, 2.0]),
    ("", CLOCK, "t,y,p\n10:00:00.5 UTC,1,2\n10:00:01.0 UTC,2,2\n", &[0.0, 0.5], &[1.0, 2.0]),
    (
        "",
        "from = \"t\"\ntime = \"datetime\"\nformat = \"%d.%m.%Y %H:%M:%S%.f CET\"",
        "t,y,p\n01.03.2026 10:00:00.5 CET,1,2\n01.03.2026 10:00:01.0 CET,2,2\n",
        &[0.0, 0.5],
        &[1.0, 2.0],
    ),
    // The end of summer time, in stamps that say their zone.
    ("", STAMPED, "t,y,p\n2026-10-25T02:59:59+02:00,1,2\n2026-10-25T02:00:00+01:00,2,2\n", &[0.0, 1.0], &[1.0, 2.0]),
    (
        "separator = \"semicolon\"\ndecimal_comma = true",
        STAMPED,
        "t;y;p\n01.03.2026 10:00:00,125;1,5;2\n01.03.2026 10:00:00,25;2,5;2\n",
        &[0.0, 0.125],
        &[1.5, 2.5],
    ),
    (
        "",
        "from = \"t\"\ntime = \"datetime\"\nformat = \"%m/%d/%Y %I:%M:%S%.f %p\"",
        "t,y,p\n03/01/2026 11:59:59.5 AM,1,2\n03/01/2026 12:00:00 PM,2,2\n",
        &[0.0, 0.5],
        &[1.0, 2.0],
    ),
    (
        "",
        "from = [\"d\", \"t\"]\ntime = \"datetime\"",
        "d,t,y,p\n2026-03-01,23:59:59.9,1,2\n2026-03-02,00:00:00.1,2,2\n",
        &[0.0, 0.2],
        &[1.0, 2.0],
    ),
    ("", CLOCK, "t,y,p\n23:59:59.900,1,2\n00:00:00.100,2,2\n", &[0.0, 0.2], &[1.0, 2.0]),
    ("", CLOCK, "t,y,p\n9:00:00 PM,1,2\n9:00:01 PM,2,2\n", &[0.0, 1.0], &[1.0, 2.0]),
    ("interval_s = 0.005", "", "y,p\n1,2\n2,2\n3,2\n", &[0.0, 0.005, 0.01], &[1.0, 2.0, 3.0]),
    ("rate_hz = 200", "", "y,p\n1,2\n2,2\n", &[0.0, 0.005], &[1.0, 2.0]),
    (
        "time_from_zero = true",
        "from = \"t\"\nunit = \"ms\"",
        "t,y,p\n1772359200125,1,2\n1772359200130,2,2\n",
        &[0.0, 0.005],
        &[1.0, 2.0],
    ),
    ("time_from_zero = true", SECONDS, "t,y,p\n1772359200.25,1,2\n1772359200.5,2,2\n", &[0.0, 0.25], &[1.0, 2.0]),
    ("thousands = \",\"", SECONDS, "t,y,p\n0,\"1,234.5\",2\n1,2,2\n", &[0.0, 1.0], &[1234.5, 2.0]),
    (
        "separator = \"tab\"\ndecimal_comma = true\nthousands = \" \"",
        SECONDS,
        "t\ty\tp\n0\t1\u{a0}234,5\t2\n1\t2\t2\n",
        &[0.0, 1.0],
        &[1234.5, 2.0],
    ),
    ("decimal_comma = true", SECONDS, "t,y,p\n\"0,5\",\"1,5\",2\n1,2,2\n", &[0.5, 1.0], &[1.5, 2.0]),
    ("", SECONDS, "t,y,p,\r\n0,1,2,\r\n1,2,2,\r\n", &[0.0, 1.0], &[1.0, 2.0]),
    ("", SECONDS, "t,y,p\n0,1 mm,2\n1,2 mm,2\n", &[0.0, 1.0], &[1.0, 2.0]),
    ("units_line = true", SECONDS, "t,y,p\ns,mm,bar\n0,1,2\n1,2,2\n", &[0.0, 1.0], &[1.0, 2.0]),
    ("", SECONDS, "t [s],y (mm),p / bar\n0,1,2\n1,2,2\n", &[0.0, 1.0], &[1.0, 2.0]),
    ("", SECONDS, "t [ms],y,p\n0,1,2\n5,2,2\n", &[0.0, 0.005], &[1.0, 2.0]),
    // Spreadsheets break the lines of long names.
    ("", SECONDS, "t,\"y\n[mm]\",p\n0,1,2\n1,2,2\nt,\"y\n[mm]\",p\n", &[0.0, 1.0], &[1.0, 2.0]),
    // Inches.
    ("", SECONDS, "t,y,p,valve\n0,1,2,1/4\" body\n1,2,2,1/4\" body\n", &[0.0, 1.0], &[1.0, 2.0]),
    // A last line that was not written to its end, between quotes or not.
    ("", SECONDS, "t,y,p\n0,1,2\n1,2,2\n2,\"3", &[0.0, 1.0], &[1.0, 2.0]),
    ("", SECONDS, "\"t\",\"y\",\"p\"\n\"0\",\"1\",\"2\"\n\"1\",\"2\",\"2\"\n\"2\",\"3\",\"1", &[0.0, 1.0], &[1.0, 2.0]),
    (
        "separator = \"space\"\ncomment = \"#\"\nskip_lines = 1",
        SECONDS,
        "made by\n# x\n\n t  y p\n0 1 2\n1 2 2\n",
        &[0.0, 1.0],
        &[1.0, 2.0],
    ),
];

#[test]
fn tables_as_loggers_write_them_become_logs() {
    for (source, time, table, times, positions) in GOOD {
        let Imported { log, .. } =
            convert(&mapping(source, time, BAR), table.as_bytes()).unwrap_or_else(|error| panic!("{table}: {error}"));
        assert_eq!(log.t_s, *times, "{table}");
        let y_mm: Vec<f64> = log.y_m.iter().map(|y| (y * 1.0e3 * 1.0e6).round() * 1.0e-6).collect();
        assert_eq!(y_mm, *positions, "{table}");
        let expected = if log.p_a_pa.as_ref().is_some_and(|p| p[0] == 2.0e5) { 2.0e5 } else { f64::NAN };
        assert_eq!(log.p_a_pa.as_ref().map(|p| p[0]), Some(expected), "{table}");
    }
}

#[test]
fn what_is_missing_is_a_gap_and_what_was_done_is_said() {
    let table = "t,y,p\n0,1,2\n1,-,n/a\n2,3,#NV\n,4,2\n3,5,OL\nt,y,p\n4,6,\n4,,2\n5,7,2\n6,8\n";
    let Imported { log, notes } =
        convert(&mapping("missing = [\"OL\"]", SECONDS, BAR), table.as_bytes()).expect("a log");
    assert_eq!(log.t_s, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    let missing = |values: &[f64]| values.iter().map(|value| value.is_nan()).collect::<Vec<bool>>();
    assert_eq!(missing(&log.y_m), [false, true, false, false, false, false]);
    assert_eq!(missing(log.p_a_pa.as_deref().expect("a column")), [false, true, true, true, false, false]);
    let said = notes.join("; ");
    // A header with a name more than the rows have fields: no row is cut off.
    let table = "t,y,p,Comment\n0,1,2\n1,2,2\n";
    let Imported { log, notes } = convert(&mapping("", SECONDS, BAR), table.as_bytes()).expect("a log");
    assert_eq!((log.len(), notes.join(";").contains("cut off")), (2, false));
    for words in [
        "8 rows read",
        "1 repeated header left out",
        "1 row without a time left out, the first in line 5",
        "1 row joined with the row before",
        "the last line is cut off",
        "y_m: 1 of 6 samples are missing",
        "p_a_pa: 3 of 6 samples are missing",
    ] {
        assert!(said.contains(words), "{words:?} in: {said}");
    }
}

#[test]
fn a_table_without_a_header_gets_the_separator_that_reaches_its_columns() {
    let map = "[source]\nheader = false\n[column.t_s]\nfrom = 1\n[column.y_m]\nfrom = 3\n[column.u_v]\nfrom = 2\n";
    for (table, separator) in
        [("0;1;2\n1;1;2\n", "semicolon"), ("0\t1\t2\n1\t1\t2\n", "tab"), ("0 1 2\n1 1 2\n", "space")]
    {
        let error = convert(map, table.as_bytes()).expect_err(table);
        for words in
            ["line 1", "has 1 field, but column 3", &format!("set `separator = \"{separator}\"` under [source]")]
        {
            assert!(error.contains(words), "{table}: expected {words:?} in: {error}");
        }
    }
    let error = convert(map, b"0,1\n1,1\n").expect_err("two columns");
    assert!(error.contains("has 2 fields, but column 3") && error.contains("the column numbers"), "{error}");
}

#[test]
fn an_empty_column_beside_others_is_said() {
    let more = "unit = \"bar\"\n[column.u_v]\nfrom = \"u\"";
    let Imported { log, notes } = convert(&mapping("", SECONDS, more), b"t,y,p,u\n0,1,2,\n1,2,2,-\n").expect("a log");
    assert_eq!(log.u_v, None);
    let said = "no row has a sample in column `u`, which map.toml takes for u_v";
    assert!(notes.iter().any(|note| note == said), "{notes:?}");
}

#[test]
fn two_points_make_a_signal_a_quantity() {
    let more = "unit = \"bar\"\npoints = [[4, 0.0], [20, 10.0]]\ngauge = true\n[column.u_v]\nfrom = \"u\"\npoints = [[0, -5], [100, 5]]";
    for table in ["t,y,p,u\n0,1,4,50\n1,1,12,100\n", "t,y,p,u\n0,1,4 mA,50%\n1,1,12 mA,100 %\n"] {
        let log = convert(&mapping("", SECONDS, more), table.as_bytes()).expect("a log").log;
        assert_eq!(log.p_a_pa, Some(vec![1.0e5, 6.0e5]), "{table}");
        assert_eq!(log.u_v, Some(vec![0.0, 5.0]), "{table}");
    }
}

#[test]
fn encodings_of_loggers_are_read() {
    let table = "t;y;p\n0;1;2\n1;2;°\n";
    let map = mapping("separator = \";\"\nmissing = [\"°\"]", SECONDS, BAR);
    let utf16: Vec<u8> = [0xFF, 0xFE].into_iter().chain(table.encode_utf16().flat_map(u16::to_le_bytes)).collect();
    let latin: Vec<u8> = table.chars().map(|c| c as u8).collect();
    let marked = [b"\xEF\xBB\xBF", table.as_bytes()].concat();
    let wanted = convert(&map, table.as_bytes()).expect("a log").log.to_csv();
    for (bytes, name) in [(utf16, "UTF-16"), (latin, "windows-1252"), (marked, "")] {
        let Imported { log, notes } = convert(&map, &bytes).expect("a log");
        assert_eq!(log.to_csv(), wanted);
        assert!(notes.join(";").contains(name), "{notes:?}");
    }
}

/// Source keys, time keys, table, words of the error.
type Bad = (&'static str, &'static str, &'static str, &'static [&'static str]);

const BAD: &[Bad] = &[
    (
        "",
        SECONDS,
        "t,y,p\n0,1,2\n2026-03-01 10:00:00.125,1,2\n",
        &["line 3", "column `t`", "`2026-03-01 10:00:00.125`", "`time = \"datetime\"` under [column.t_s] in map.toml"],
    ),
    ("", SECONDS, "t,y,p\n01.03.2026 10:00:00,1,2\n", &["line 2", "date with a time", "`time = \"datetime\"`"]),
    ("", SECONDS, "t,y,p\n10:00:00.125,1,2\n", &["time of day", "`time = \"clock\"`"]),
    (
        "",
        SECONDS,
        "t,y,p\n13/03/2026 10:00:00,1,2\n",
        &["`time = \"datetime\"`", "`format = \"%d/%m/%Y %H:%M:%S%.f\"`"],
    ),
    ("", STAMPED, "t,y,p\n03/04/2026 10:00:00,1,2\n", &["%d/%m/%Y", "if the month comes first, \"%m/%d/%Y"]),
    ("", STAMPED, "t,y,p\n0.5,1,2\n", &["a number", "remove `time`"]),
    ("", STAMPED, "t,y,p\n10:00:00,1,2\n", &["a time of day", "`time = \"clock\"`"]),
    ("", CLOCK, "t,y,p\n10:00,1,2\n", &["without seconds", "`interval_s`"]),
    ("", STAMPED, "t,y,p\n1st of March 10h,1,2\n", &["`format`"]),
    ("", SECONDS, "t,y,p\n0,2026-03-01 10:00:00,2\n", &["column `y`", "date with a time", "`from` under [column.y_m]"]),
    (
        "separator = \";\"",
        SECONDS,
        "t;y;p\n0;1,5;2\n",
        &["column `y` is `1,5`, a number with a decimal comma,", "`decimal_comma = true` under [source]"],
    ),
    ("", SECONDS, "t,y,p\n0,\"1,234.5\",2\n", &["groups of thousands", "`thousands = \",\"`"]),
    ("separator = \";\"\ndecimal_comma = true", SECONDS, "t;y;p\n0;1.234,5;2\n", &["`thousands = \".\"`"]),
    (
        "separator = \";\"\ndecimal_comma = true",
        SECONDS,
        "t;y;p\n0;1.5;2\n",
        &["decimal point", "`decimal_comma = false`"],
    ),
    ("separator = \";\"", SECONDS, "t;y;p\n0;1.234,5;2\n", &["`decimal_comma = true` and `thousands = \".\"`"]),
    ("", SECONDS, "t,y,p\n0,1,2 psi\n", &["a number with a unit", "`unit = \"psi\"` under [column.p_a_pa]"]),
    (
        "",
        SECONDS,
        "t,y,p\n0,1,50 %\n",
        &["a number with a unit", "`points = [[0, 1.0e5], [100, 1.1e6]]` under [column.p_a_pa] in map.toml"],
    ),
    ("", SECONDS, "t,y,p\n0,1,12mA\n", &["a number with a unit", "`points = [[4, 1.0e5], [20, 1.1e6]]`"]),
    (
        "",
        SECONDS,
        "t,y,p\n0,1,20 rpm\n",
        &["export the numbers without units, or let `from` under [column.p_a_pa] in map.toml name another column"],
    ),
    ("", SECONDS, "t,y,p\n0,1,2\n1,1,OL\n", &["line 3", "`missing = [\"OL\"]` under [source] in map.toml if it marks"]),
    (
        "",
        SECONDS,
        "t,y,p\n0,1,1e308\n",
        &["line 2", "column `p` is `1e308`", "no finite number in SI", "[column.p_a_pa]"],
    ),
    // A quote that is not closed takes the rows below into its cell.
    ("", SECONDS, "t,y,p\n0,1,2\n1,\"2,2\n2,3,2\n3,4,2\n", &["line 3", "a quote opens", "not closed", "remove"]),
    ("", SECONDS, "t,y,p\n0,1,2\n\n1,\"2,2\n2,3,2\n3,\"4,2\n", &["line 4", "a quote opens"]),
    ("", SECONDS, "t,y,p\n0,\"1\n\",2\n1,2,2\n", &["line 2", "a quote opens"]),
    ("", SECONDS, "t,\"y,p\n0,1,2\n1,2,2\n", &["line 1", "a quote opens"]),
    ("units_line = true", SECONDS, "t,y,p\ns,\"mm,bar\n0,1,2\n1,2,2\n", &["line 2", "a quote opens"]),
    // Another separator than the mapping's, and lines above the header.
    ("", SECONDS, "t;y;p\n0;1;2\n", &["no column `t`", "set `separator = \"semicolon\"` under [source] in map.toml"]),
    ("", SECONDS, "t;y;p\n0,5;1,5;2,5\n", &["no column `t`", "`separator = \"semicolon\"`"]),
    ("", SECONDS, "t\ty\tp\n0\t1\t2\n", &["no column `t`", "`separator = \"tab\"`"]),
    ("", SECONDS, "t y p\n0 1 2\n", &["no column `t`", "`separator = \"space\"`"]),
    ("separator = \"semicolon\"", SECONDS, "t,y,p\n0,1,2\n", &["no column `t`", "`separator = \"comma\"`"]),
    ("", SECONDS, "Zeit;Weg;Druck\n0;1;2\n", &["no column `t`", "`separator = \"semicolon\"`"]),
    ("", SECONDS, "Made by X, 2026\n\nt,y,p\n0,1,2\n", &["no column `t`", "set `skip_lines = 2` under [source]"]),
    (
        "",
        SECONDS,
        "Made by X, 2026\n\nt;y;p\n0;1;2\n",
        &["no column `t`", "set `separator = \"semicolon\"` and `skip_lines = 2` under [source]"],
    ),
    ("", SECONDS, "Made by X\nx,y,p,,\n0,1,2,,\n", &["no column `t`", "use one of: Made by X"]),
    ("", SECONDS, "x,,y,p\n0,,1,2\n", &["no column `t`", "use one of: x, y, p"]),
    // Columns that are there, and empty.
    (
        "",
        SECONDS,
        "t,y,p\n0,,2\n1,n/a,2\n",
        &["no row has a sample in column `y`, which map.toml takes for y_m", "`from` under [column.y_m] in map.toml"],
    ),
    (
        "",
        "from = [\"d\", \"t\"]\ntime = \"datetime\"",
        "d,t,y,p\n,,1,2\n,,1,2\n",
        &["no row has a sample in column `d` and `t`", "[column.t_s]"],
    ),
    ("", SECONDS, "t,y,p\n0,1,\n1,1,\n", &["no row has a sample in column `p`"]),
    ("", SECONDS, "t,y,p\n,1,2\n,1,2\n", &["no row has a sample in column `t`"]),
    ("", SECONDS, "t,y,p\n1e300,1,2\n-1e300,1,2\n", &["line 3", "goes from 1e300 s to -1e300 s"]),
    ("", SECONDS, "t,y,p\n0,1,2\n1,1,Inf\n", &["no finite number", "`missing = [\"Inf\"]`"]),
    ("", SECONDS, "t,y,p\n0,1,2\n1,1,1e999\n", &["no finite number"]),
    ("", SECONDS, "t,y,p\n0,1,TRUE\n", &["a switch", "[column.p_a_pa]"]),
    ("", SECONDS, "t,y,p\ns,mm,bar\n0,1,2\n", &["line 2", "a unit", "`units_line = true`"]),
    ("", SECONDS, "t,y,p\n0,1,2\nEnd of file,,\n", &["line 3", "`End of file`", "delete the line"]),
    ("separator = \"space\"", SECONDS, "t y p\n0;1;2 1 2\n", &["several cells", "`separator = \"semicolon\"`"]),
    ("", SECONDS, "x,y,p\n0,1,2\n", &["no column `t`", "use one of: x, y, p"]),
    ("", SECONDS, "t,y,p,p\n0,1,2,2\n", &["more than one column `p`", "from = 3 or from = 4"]),
    ("", SECONDS, "t,y,p\n0,001,1,5,2,5\n", &["line 2", "6 fields", "decimal commas"]),
    (
        "",
        SECONDS,
        "t,y,p\n0,1,2\n0,1,3\n",
        &["line 3", "the time of the row before, 0 s, and other values", "interval_s"],
    ),
    (
        "",
        STAMPED,
        "t,y,p\n2026-03-01 10:00:00,1,2\n2026-03-01 10:00:00,2,2\n",
        &["without fractions of a second", "interval_s"],
    ),
    ("", STAMPED, "t,y,p\n2026-10-25 02:59:59.9,1,2\n2026-10-25 02:00:00.0,2,2\n", &["put back by an hour", "zone"]),
    ("", STAMPED, "t,y,p\n2026-10-25 02:00:00Z,1,2\n2026-10-25 02:00:01,2,2\n", &["others do not"]),
    // The end of summer time, in stamps that name their zone, with and without a format that passes over names.
    (
        "",
        STAMPED,
        "t,y,p\n2026-10-25 02:59:59 CEST,1,2\n2026-10-25 02:00:00 CET,2,2\n",
        &[
            "line 2",
            "`2026-10-25 02:59:59 CEST`",
            "a time in a zone called by its name",
            "+01:00",
            "`format` under [column.t_s]",
        ],
    ),
    (
        "",
        "from = \"t\"\ntime = \"datetime\"\nformat = \"%Y-%m-%d %H:%M:%S %Z\"",
        "t,y,p\n2026-10-25 02:59:59 CEST,1,2\n2026-10-25 02:00:00 CET,2,2\n",
        &["line 2", "a time in a zone called by its name", "+01:00"],
    ),
    (
        "",
        "from = \"t\"\ntime = \"datetime\"\nformat = \"%Y-%m-%d %H:%M:%S CEST\"",
        "t,y,p\n2026-10-25 02:59:59 CEST,1,2\n2026-10-25 02:00:00 CET,2,2\n",
        &["line 3", "`2026-10-25 02:00:00 CET`", "+01:00"],
    ),
    ("", CLOCK, "t,y,p\n10:00:00 EST,1,2\n", &["line 2", "zone called by its name", "without one", "[column.t_s]"]),
    ("", SECONDS, "t,y,p\n2026-10-25 02:59:59 CEST,1,2\n", &["a date with a time", "`time = \"datetime\"`"]),
    ("", SECONDS, "t,y,p\n0,1,2\n1,1,2\n0,1,2\n", &["line 4", "from 1 s to 0 s", "second recording"]),
    ("", SECONDS, "t,y,p\n", &["no data"]),
    ("skip_lines = 9", SECONDS, "t,y,p\n", &["no header row", "skip_lines"]),
    // The mapping itself.
    ("interval_s = 0.001", SECONDS, "", &["column.t_s", "second source of the time"]),
    ("interval_s = 5000", "", "", &["source.interval_s", "not plausible"]),
    ("", "", "", &["column.t_s", "`interval_s = SECONDS`"]),
    ("separator = \"?\"", SECONDS, "", &["line 3", "source.separator", "still to be chosen"]),
    ("thousands = \".\"", SECONDS, "", &["source.thousands", "decimal sign"]),
    ("thousands = \"x\"", SECONDS, "", &["source.thousands", "use"]),
    ("units_line = true\nheader = false", "from = 1", "", &["name", "no header"]),
    ("", "from = \"t\"\ntime = \"date\"", "", &["column.t_s.time", "datetime"]),
    ("", "from = \"t\"\nformat = \"%H\"", "", &["column.t_s.format", "needs `time"]),
    ("", "from = \"t\"\ntime = \"datetime\"\nformat = \"dd.mm\"", "", &["is no format", "%d/%m/%Y"]),
    ("", "from = [\"d\", \"t\"]", "", &["joins columns", "datetime"]),
    ("", "value = 3.0", "", &["column.t_s.value", "interval_s"]),
];

#[test]
fn each_wrong_cell_gets_the_line_that_would_take_it() {
    for (source, time, table, words) in BAD {
        let error = convert(&mapping(source, time, BAR), table.as_bytes()).expect_err(table);
        for word in *words {
            assert!(error.contains(word), "{table}: expected {word:?} in: {error}");
        }
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    for (more, words) in [
        ("unit = \"%\"", "points = [[0, 1.0e5], [100, 1.1e6]]"),
        ("unit = \"mA\"", "[[4, 1.0e5], [20, 1.1e6]]"),
        ("points = [[4, 1], [4, 2]]", "straight line"),
        ("points = [[4, 1]]", "two readings"),
        ("time = \"clock\"", "[column.t_s] only"),
    ] {
        let error = convert(&mapping("", SECONDS, more), b"").expect_err(more);
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn another_unit_than_the_headers_is_said_and_the_mapping_holds() {
    let Imported { log, notes } = convert(&mapping("", SECONDS, BAR), b"t,y,p [kPa]\n0,1,2\n1,1,2\n").expect("a log");
    assert_eq!(log.p_a_pa, Some(vec![2.0e5, 2.0e5]));
    assert!(notes.join(";").contains("the header says kPa, the mapping bar"), "{notes:?}");
    let Imported { log, notes } = convert(&mapping("", SECONDS, ""), b"t,y,p [kPa]\n0,1,2\n1,1,2\n").expect("a log");
    assert_eq!(log.p_a_pa, Some(vec![2.0e3, 2.0e3]));
    assert!(notes.join(";").contains("kPa taken from the header"), "{notes:?}");
}

#[test]
fn a_draft_of_counts_and_of_currents_leaves_open_what_they_mean_and_takes_its_own_advice() {
    let counts = |part: f64| [4000.0 * part, 1500.0 + part, 2048.0].map(|value| format!("{value:.0}")).to_vec();
    let page = draft(&table("AI0,AI1,AO0", ",", counts), None).text;
    assert!(page.contains("# gauge = true") && page.contains("atmosphere_pa = 1.013e5"), "{page}");
    let current = |part: f64| [part, 4.0 + 16.0 * part, 3.0].map(|value| format!("{value:.3}")).to_vec();
    let page = draft(&table("t [s],Rod Position [mA],pA_barg", ",", current), None).text;
    assert!(page.contains("[column.y_m]\nfrom = \"Rod Position [mA]\""), "{page}");
    assert!(page.contains("points = \"?\"") && page.contains("4 to 20 mA: [[4.0, -"), "{page}");
}

#[test]
fn a_draft_finds_the_supply_by_a_letter_as_it_finds_the_chambers() {
    let row = |part: f64| [part, 200.0 * part, 3.0, 4.0, 6.0].map(|value| format!("{value:.3}")).to_vec();
    let page = draft(&table("t,y_mm,pA_barg,pB_barg,pS_barg", ",", row), None).text;
    for (column, name) in [("p_a_pa", "pA_barg"), ("p_b_pa", "pB_barg"), ("p_sup_pa", "pS_barg")] {
        assert!(page.contains(&format!("[column.{column}]\nfrom = \"{name}\"")), "{page}");
    }
}

#[test]
fn a_draft_sees_a_time_in_stamps_that_name_their_zone() {
    let stamps = (0..50).map(|k| format!("2026-03-01 10:00:00.{k:03} CET,{k},{}\n", k % 7));
    let page = draft(&format!("Time,y [mm],p [bar]\n{}", stamps.collect::<String>()), None).text;
    assert!(page.contains("time = \"datetime\""), "{page}");
}

fn draft(table: &str, rig: Option<&RigFile>) -> suggest::Draft {
    suggest::suggest_bytes(table.as_bytes(), "table.csv", rig).unwrap_or_else(|error| panic!("{table}: {error}"))
}

/// A table with a header and rows of a piston that moves from end to end.
fn table(header: &str, separator: &str, row: impl Fn(f64) -> Vec<String>) -> String {
    let rows = (0..100).map(|k| row(f64::from(k) / 99.0).join(separator) + "\n");
    format!("{header}\n{}", rows.collect::<String>())
}

#[test]
fn a_draft_says_what_the_table_tells_and_leaves_open_what_it_does_not() {
    let rig = RigFile::read(&root().join("rigs/festo-dsbc-32-200.toml")).expect("a rig");
    let number = |value: f64| format!("{value:.4}");
    let row = |part: f64| vec![number(part), number(200.0 * part), number(6.0 * part), number(10.0 * part)];
    let good = table("Zeit [s],Weg [mm],Druck A [bar],Ventil [V]", ",", row);
    for (what, text, rig, lines, open) in [
        (
            "everything stated",
            good.clone(),
            Some(&rig),
            &[
                "separator = \"comma\"",
                "unit = \"mm\"",
                "points = [[0.0, -100.0], [200.0, 100.0]]",
                "gauge = true",
                "points = [[0.0, -5.0], [10.0, 5.0]]",
            ][..],
            0,
        ),
        ("without the rig's stroke", good.clone(), None, &["points = \"?\"", "at the two end stops"], 1),
        (
            "bar for 600 bar",
            good.replace("[bar]", "[MPa]"),
            Some(&rig),
            &["header says MPa", "bar or psi would fit"],
            2,
        ),
        ("no unit", good.replace(" [mm]", ""), Some(&rig), &["only mm fits 0 to 200"], 0),
        (
            "two positions",
            good.replace("Ventil [V]", "Position [mm]"),
            Some(&rig),
            &["`Weg [mm]`, `Position [mm]` fit alike"],
            1,
        ),
        (
            "no position",
            good.replace("Weg [mm]", "CH2"),
            Some(&rig),
            &["no name or unit says position", "the end stop of A", "# Not used: `CH2`"],
            2,
        ),
        (
            "numbered chambers",
            good.replace("Druck A", "P4"),
            Some(&rig),
            &["from = \"P4 [bar]\"", "uncertain, by its name"],
            0,
        ),
        (
            "day or month",
            table("t,Weg [mm],u [V]", ",", |part| {
                vec![format!("03/04/2026 10:00:{:07.4}", 50.0 * part), number(200.0 * part), number(4.0 - 8.0 * part)]
            }),
            Some(&rig),
            &["time = \"datetime\"", "format = \"?\"", "day first: \"%d/%m/%Y %H:%M:%S%.f\""],
            1,
        ),
        (
            "day and month in a column of its own, halves of the day",
            table("Date,Time,Weg [mm],u [V]", ",", |part| {
                vec![
                    "3/13/2026".into(),
                    format!("10:00:{:07.4} PM", 50.0 * part),
                    number(200.0 * part),
                    number(4.0 - 8.0 * part),
                ]
            }),
            Some(&rig),
            &["from = [\"Date\", \"Time\"]", "format = \"%m/%d/%Y %I:%M:%S%.f %p\""],
            0,
        ),
        (
            "stamps of whole seconds",
            table("Zeit;Weg [mm];u [V]", ";", |part| {
                vec![
                    format!("01.03.2026 10:00:{:02}", (10.0 * part) as u32),
                    number(200.0 * part),
                    number(4.0 - 8.0 * part),
                ]
            }),
            Some(&rig),
            &["interval_s = \"?\"", "the stamps of `Zeit` repeat"],
            1,
        ),
        (
            "a rate above the table",
            "Abtastrate: 2 kHz\n\n".to_string()
                + &table("Weg [mm];u [V]", ";", |part| vec![number(200.0 * part), number(4.0 - 8.0 * part)]),
            Some(&rig),
            &["rate_hz = 2000", "line 1: Abtastrate: 2 kHz"],
            0,
        ),
        (
            "milliseconds since 1970",
            table("timestamp,position_mm,cmd [%]", ",", |part| {
                vec![format!("{:.0}", 1.7723592e12 + 990.0 * part), number(200.0 * part), number(100.0 * part)]
            }),
            Some(&rig),
            &["unit = \"ms\"", "time_from_zero = true", "points = [[0.0, -5.0], [100.0, 5.0]]"],
            0,
        ),
    ] {
        let draft = draft(&text, rig);
        for line in lines {
            assert!(draft.text.contains(line), "{what}: expected {line:?} in:\n{}", draft.text);
        }
        assert_eq!(draft.open.len(), open, "{what}:\n{}", draft.text);
        assert_eq!(draft.refused, None, "{what}:\n{}", draft.text);
        // Unchanged it works, or is refused at the first line that is left open.
        match Mapping::parse(&draft.text, "draft.toml") {
            Ok(mapping) => assert!(mapping.convert(text.as_bytes(), "table.csv").is_ok(), "{what}"),
            Err(error) => assert_eq!(error.line, draft.open.first().map(|line| *line as u64), "{what}: {error}"),
        }
    }
}

#[test]
fn a_table_with_one_value_in_each_row_is_refused_with_the_remedy() {
    let table = "VarName;TimeString;VarValue\nWeg;2026-03-01 10:00:00,0;1,5\nDruck;2026-03-01 10:00:00,0;6,5\n";
    let error = suggest::suggest_bytes(table.as_bytes(), "a.csv", None).expect_err("long").to_string();
    assert!(error.contains("a column for each signal"), "{error}");
}

#[test]
fn a_log_of_this_project_drafts_to_itself() {
    let rig = RigFile::paper_a();
    let text = table("t_s,y_m,u_v,p_a_pa,p_b_pa,p_sup_pa", ",", |part| {
        [part, part - 0.5, 4.0 - 8.0 * part, 1.0e5 + 5.0e5 * part, 6.0e5 - 5.0e5 * part, 7.0e5]
            .map(|v| v.to_string())
            .to_vec()
    });
    let draft = draft(&text, Some(&rig));
    assert_eq!((draft.open.len(), draft.refused), (0, None), "{}", draft.text);
    let log =
        Mapping::parse(&draft.text, "draft").expect("a mapping").convert(text.as_bytes(), "t").expect("a log").log;
    assert_eq!(log.to_csv(), rig_files::Log::parse(text.into_bytes(), "t").expect("a log").to_csv());
}

/// Files as they come out of loggers, some of them damaged.
fn any_table() -> impl Strategy<Value = String> {
    let cell = "[0-9]{1,3}[.,][0-9]{1,3}|-?[0-9.,:eE+-]{0,9}|[0-9]{1,2}[./-][0-9]{1,2}[./-]20[0-9]{2}[ T][0-9]{2}:[0-9]{2}:[0-9.,]{2,6}Z?|\
                [ -~]{0,8}|NaN|#NV|\"[^\"]{0,5}|Weg|Druck [AB]|p_sup|Zeit|\\[?(mm|bar|s|V|%)\\]?|[äµ°\u{a0}\u{202f}]{1,2}";
    let row = proptest::collection::vec(cell, 1..6);
    (proptest::collection::vec(row, 0..12), 0..4_usize, any::<bool>()).prop_map(|(rows, mark, cr)| {
        let end = if cr { "\r\n" } else { "\n" };
        rows.into_iter().map(|row| row.join([",", ";", "\t", " "][mark]) + end).collect()
    })
}

proptest! {
    #[test]
    fn any_bytes_give_a_log_or_one_error(
        table in any_table(),
        noise in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        which in 0..GOOD.len(),
    ) {
        let mut bytes = table.into_bytes();
        for (at, byte) in noise {
            if !bytes.is_empty() {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
        }
        let (source, time, good, ..) = GOOD[which];
        let mut under_a_good_header = good.lines().next().unwrap_or_default().as_bytes().to_vec();
        under_a_good_header.push(b'\n');
        under_a_good_header.extend(&bytes);
        for bytes in [&bytes, &under_a_good_header] {
            match convert(&mapping(source, time, BAR), bytes) {
                Ok(Imported { log, .. }) => prop_assert!(!log.is_empty()),
                Err(error) => prop_assert_eq!(error.lines().count(), 1, "{}", error),
            }
            match suggest::suggest_bytes(bytes, "table.csv", None) {
                Ok(draft) => {
                    let mapping = Mapping::parse(&draft.text, "draft.toml");
                    prop_assert_eq!(mapping.is_err(), !draft.open.is_empty(), "{}\n{:?}", draft.text, mapping);
                }
                Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
            }
        }
    }
}

// The examples of docs/from-logger-to-verdict.md.

/// A logger's file: how it writes a row, and what stands above.
struct Style {
    file: &'static str,
    above: &'static str,
    row: fn(&rig_files::Log, usize) -> String,
    /// What is changed in the draft, as the page says.
    change: &'static [(&'static str, &'static str)],
    synthesized: &'static [&'static str],
}

fn cell(value: f64, digits: usize, missing: &str) -> String {
    if value.is_nan() { missing.to_string() } else { format!("{value:.digits$}") }
}

fn clock(t_s: f64) -> String {
    let ms = (t_s * 1.0e3).round() as u64;
    format!("10:{:02}:{:02}.{:03}", 24 + ms / 60_000, ms / 1000 % 60, ms % 1000)
}

fn column(values: &Option<Vec<f64>>, row: usize) -> f64 {
    values.as_ref().map_or(f64::NAN, |values| values[row])
}

const ATMOSPHERE_PA: f64 = 1.013e5;
const PSI_PA: f64 = 6_894.757_293_168;

const STYLES: [Style; 3] = [
    Style {
        file: "messung.csv",
        above: "Messdatei;Zylinder 3\nBediener;Huber\nMessgerät;8 Kanäle, 16 bit\n\n\
                Zeitstempel;Weg [mm];Druck A [bar];Druck B [bar];Versorgungsdruck [bar];Ventil [V]\n",
        row: |log, row| {
            let gauge = |values| (column(values, row) - ATMOSPHERE_PA) * 1.0e-5;
            let cells = [
                format!("01.03.2026 {}", clock(log.t_s[row])),
                cell((log.y_m[row] + 0.1) * 1.0e3, 2, "#NV"),
                cell(gauge(&log.p_a_pa), 3, "#NV"),
                cell(gauge(&log.p_b_pa), 3, "#NV"),
                cell(gauge(&log.p_sup_pa), 3, "#NV"),
                cell(column(&log.u_v, row) + 5.0, 3, "#NV"),
            ];
            let [stamp, rest @ ..] = cells;
            [
                &[stamp.replace(":00.", ":00,").replace('.', ",").replacen(',', ".", 2)],
                &rest.map(|c| c.replace('.', ","))[..],
            ]
            .concat()
            .join(";")
        },
        change: &[],
        synthesized: &[
            "--effect",
            "leak-cross-piston:conductance_kg_per_s_pa=4e-10",
            "--seed",
            "11",
            "--blanks",
            "0.1",
            "--lost-rows",
            "0.1",
        ],
    },
    Style {
        file: "plc-trend.csv",
        above: "Date,Time,Cyl1.ActPos,Cyl1.PressA,Cyl1.PressB,Cyl1.PressSupply,Cyl1.ValveCmd\n,,mm,kPa,kPa,kPa,%\n",
        row: |log, row| {
            let gauge = |values| (column(values, row) - ATMOSPHERE_PA) * 1.0e-3;
            [
                "2026-03-01".to_string(),
                clock(log.t_s[row]),
                cell((0.1 - log.y_m[row]) * 1.0e3, 2, "---"),
                cell(gauge(&log.p_a_pa), 1, "---"),
                cell(gauge(&log.p_b_pa), 1, "---"),
                cell(gauge(&log.p_sup_pa), 1, "---"),
                cell((column(&log.u_v, row) + 5.0) * 10.0, 2, "---"),
            ]
            .join(",")
        },
        change: &[("sign = 1 ", "sign = -1 ")],
        synthesized: &["--effect", "payload-mass:mass_kg=1.2", "--seed", "12", "--blanks", "0.1"],
    },
    Style {
        file: "scope.csv",
        above: "Model,four channels and one\nRecord Length,1200\nSample Interval,1.000E-02,s\nTrigger,CH5\n\n\
                CH1 Position (mm),CH2 Pressure A (psi),CH3 Pressure B (psi),CH4 Supply Pressure (psi),CH5 Valve (V)\n",
        row: |log, row| {
            let gauge = |values| (column(values, row) - ATMOSPHERE_PA) / PSI_PA;
            [
                cell(log.y_m[row] * 1.0e3, 2, ""),
                cell(gauge(&log.p_a_pa), 2, ""),
                cell(gauge(&log.p_b_pa), 2, ""),
                cell(gauge(&log.p_sup_pa), 2, ""),
                cell(column(&log.u_v, row) + 5.0, 3, ""),
            ]
            .join(",")
        },
        change: &[],
        synthesized: &["--seed", "13"],
    },
];

impl Style {
    fn text(&self, log: &rig_files::Log) -> String {
        let rows = (0..log.len()).map(|row| (self.row)(log, row) + "\n");
        self.above.to_string() + &rows.collect::<String>()
    }

    /// Every tenth row of a log of the project's own simulator.
    fn synthesize(&self, rig: &Path) -> rig_files::Log {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("log.csv");
        let done = program(&root())
            .args(["synthesize", "--experiment", "identification", "--duration", "12"])
            .arg("--rig")
            .arg(rig)
            .arg("--out")
            .arg(&out)
            .args(self.synthesized)
            .output()
            .expect("runs");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let text = std::fs::read_to_string(&out).expect("written");
        let tenth = |line: &&str| {
            let ms = line.split(',').next().and_then(|t| t.parse::<f64>().ok()).map(|t| (t * 1.0e3).round() as u64);
            ms.is_none_or(|ms| ms.is_multiple_of(10))
        };
        let thin: String = text.lines().filter(tenth).map(|line| format!("{line}\n")).collect();
        rig_files::Log::parse(thin.into_bytes(), "thin").expect("a log")
    }
}

/// The files of examples/loggers/ are made by this test when UPDATE_DOCS is set. Whenever it runs, they are drafted, imported and
/// written again in their style: what comes out is the file, to the last digit.
#[test]
fn the_examples_of_loggers_survive_draft_import_and_writing() {
    let path = root().join("rigs/festo-dsbc-32-200.toml");
    let rig = RigFile::read(&path).expect("a rig");
    for style in STYLES {
        let file = root().join("examples/loggers").join(style.file);
        if std::env::var_os("UPDATE_DOCS").is_some() {
            rig_files::write_file(&file, |out| out.write_all(style.text(&style.synthesize(&path)).as_bytes()))
                .expect("written");
        }
        let stored = std::fs::read_to_string(&file).expect("the example");
        let draft = suggest::suggest(&file, Some(&rig)).expect("a draft");
        println!("{}", draft.text);
        assert_eq!((draft.open.len(), &draft.refused), (0, &None), "{}", draft.text);
        let mut text = draft.text;
        for (old, new) in style.change {
            assert!(text.contains(old), "{old} in {text}");
            text = text.replacen(old, new, 1);
        }
        let log = Mapping::parse(&text, "draft").expect("a mapping").import(&file).expect("a log").log;
        for (line, (wanted, found)) in stored.lines().zip(style.text(&log).lines()).enumerate() {
            assert_eq!(wanted, found, "{} line {}", style.file, line + 1);
        }
        assert_eq!(stored.lines().count(), style.text(&log).lines().count());
    }
}

#[test]
fn a_column_stamped_by_another_clock_is_moved_by_whole_rows() {
    let mapping = |shift: &str| {
        format!("[source]\n[column.t_s]\nfrom = \"t\"\n[column.y_m]\nfrom = \"y\"\n{shift}[column.u_v]\nfrom = \"u\"\n")
    };
    let table: String = (0..6).map(|k| format!("{},{},{}\n", f64::from(k) * 0.001, k, 10 * k)).collect();
    let file = std::env::temp_dir().join(format!("shift-{}.csv", std::process::id()));
    std::fs::write(&file, format!("t,y,u\n{table}")).expect("written");
    let log = |shift: &str| Mapping::parse(&mapping(shift), "m.toml").and_then(|m| m.import(&file)).expect("a log").log;
    let (as_is, later, earlier) = (log(""), log("shift_s = 0.0024\n"), log("shift_s = -0.001\n"));
    let finite = |y: &[f64]| y.iter().copied().filter(|y| y.is_finite()).collect::<Vec<_>>();
    assert_eq!(as_is.y_m, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    assert!(later.y_m[..2].iter().all(|y| y.is_nan()), "{:?}", later.y_m);
    assert_eq!((finite(&later.y_m), later.u_v), (vec![0.0, 1.0, 2.0, 3.0], as_is.u_v));
    assert_eq!(finite(&earlier.y_m), [1.0, 2.0, 3.0, 4.0, 5.0]);
    for (wrong, word) in [("shift_s = 30\n", "no offset of a clock"), ("shift_s = \"1 ms\"\n", "shift_s")] {
        let said = Mapping::parse(&mapping(wrong), "m.toml").expect_err("refused").to_string();
        assert!(said.contains(word) && said.contains("m.toml"), "{said}");
    }
    std::fs::remove_file(&file).expect("removed");
}
