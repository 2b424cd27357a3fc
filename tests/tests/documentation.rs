//! The tables of parameters in `docs/` are made from the tables in the code, between two marks each.
//!
//! After a change in a table: `UPDATE_DOCS=1 cargo test -p scenarios --test documentation` writes them anew.

use board_link::Parameter;
use control::{Key, Value};
use plant_model::{Rig, all_keys};
use rig_files::controller::choices;
use std::path::Path;

const BEGIN: &str = "<!-- This table is generated. UPDATE_DOCS=1 cargo test -p scenarios --test documentation -->\n";
const END: &str = "<!-- End of the generated table. -->";

fn row(cells: &[String]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

fn table<const N: usize>(head: [&str; N], rows: impl Iterator<Item = [String; N]>) -> String {
    let lines = row(&head.map(str::to_owned)) + &row(&head.map(|_| "---".to_owned()));
    lines + &rows.map(|cells| row(&cells)).collect::<String>()
}

fn or_dash(unit: &str) -> String {
    if unit.is_empty() { "–".into() } else { unit.into() }
}

/// The limits without their unit, which has a column of its own.
fn range(limits: control::Limits) -> String {
    let plain = control::Limits { unit: "", ..limits }.to_string();
    if limits.apart > 0.0 { format!("{plain}, at least {} apart", limits.apart) } else { plain }
}

fn of_the_controller() -> String {
    let rows = Key::ALL.into_iter().map(|key| {
        let (row, default) = (key.row(), key.default_value());
        let range = choices(key).unwrap_or_else(|| range(row.limits));
        [format!("`{}`", row.key), or_dash(row.limits.unit), default.to_string(), range, key.meaning().into()]
    });
    table(["key", "unit", "default", "range", "meaning"], rows)
}

fn of_the_board() -> String {
    let rows = Parameter::ALL.into_iter().map(|parameter| {
        let info = parameter.info();
        let name = format!("`{}`", info.name);
        [name, Value::Number(info.default).to_string(), info.range().to_string(), info.words().to_string()]
    });
    table(["name", "new board", "range", "meaning"], rows)
}

fn of_the_rig() -> String {
    let paper = Rig::<f64>::paper_a();
    let rows = all_keys().map(|key| {
        let optional = key.limits.optional;
        let stated = key.get(&paper);
        let value = if optional && stated == 0.0 { "–".into() } else { Value::Number(stated as f32).to_string() };
        let range = range(key.limits) + if optional { ", or absent" } else { "" };
        [format!("`{}`", key.path), or_dash(key.limits.unit), value, range, key.meaning().into()]
    });
    table(["key", "unit", "case (a)", "range", "meaning"], rows)
}

/// Compares the generated part of a page with what it should be, or writes it if that is asked for.
fn check(page: &str, wanted: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(page);
    let text = std::fs::read_to_string(&path).expect(page);
    let (before, rest) = text.split_once(BEGIN).unwrap_or_else(|| panic!("docs/{page} lacks the line {BEGIN}"));
    let (found, after) = rest.split_once(END).unwrap_or_else(|| panic!("docs/{page} lacks the line {END}"));
    if found != wanted && std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{wanted}{END}{after}")).expect(page);
    } else {
        assert!(
            found == wanted,
            "the table in docs/{page} is not that of the code; write it anew with `UPDATE_DOCS=1 cargo test -p scenarios \
             --test documentation` and look at the difference"
        );
    }
}

#[test]
fn the_controllers_page_shows_the_controllers_table() {
    check("controller.md", &of_the_controller());
}

#[test]
fn the_commissioning_page_shows_the_boards_table() {
    check("commissioning.md", &of_the_board());
}

#[test]
fn the_page_on_file_formats_shows_the_rigs_table() {
    check("formats.md", &of_the_rig());
}
