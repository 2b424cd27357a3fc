//! The page of constants says what the table says: `docs/diagnosis-constants.md` is made from `constants::table()` and from
//! the measured effects in `docs/diagnosis-constants.csv`.

use diagnosis::constants::{Constant, table};
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::PathBuf;

const HEAD: &str = "\
# The constants of the diagnosis

Every number that the diagnosis was given and did not derive, with its reason, and what happens when it is halved and
doubled: of the ten logs of a fixed set, how many are answered rightly, and how many answers (verdict or names) change.
A dash means not measured yet. \"same\" means that none of the ten answers changed; it does not mean that the constant is
needless: the set holds no sensor at its limit, no interruption and no end stop. Numbers that follow from a derivation stand
beside it in the code.

The measurement: `cargo run --release -p diagnosis --features sensitivity --example sensitivity -- all
docs/diagnosis-constants.csv`. This page: `RECORDED=write cargo test --test constants_page`.
[diagnosis-statistics.md](diagnosis-statistics.md) says where each constant acts.
";

const STAGES: [(&str, &str); 8] = [
    ("check", "Before anything is fitted"),
    ("data", "The log made ready"),
    ("model", "Hypotheses and their parameters"),
    ("balances", "Observers on single balances"),
    ("estimate", "Likelihood, optimiser, standard errors"),
    ("select", "Which causes"),
    ("validate", "What stands of the causes found"),
    ("explain", "What is told"),
];

/// Right answers and what was said, by constant and factor.
fn measured(csv: &str) -> HashMap<(String, String), (String, String)> {
    let row = |line: &str| {
        let mut cells = line.splitn(5, ',').map(str::to_string);
        let (name, factor) = (cells.next()?, cells.next()?);
        let right = cells.next()?;
        Some(((name, factor), (right, cells.nth(1).unwrap_or_default())))
    };
    csv.lines().skip(1).filter_map(row).collect()
}

fn page(constants: &[Constant], csv: &str) -> String {
    let measured = measured(csv);
    let base = measured.get(&("none".to_string(), "1".to_string()));
    let cell = |name: &str, factor: &str| match (measured.get(&(name.to_string(), factor.to_string())), base) {
        (Some((right, _)), _) if right == "failed" => "no diagnosis".to_string(),
        (Some((right, said)), Some((_, before))) => {
            let changed = said.split(';').zip(before.split(';')).filter(|(new, old)| new != old).count();
            if changed == 0 { format!("{right}, same") } else { format!("{right}, {changed} changed") }
        }
        _ => "–".to_string(),
    };
    let mut out = HEAD.to_string();
    if let Some((right, said)) = base {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "\nAs they are: {right} of {} right.", said.split(';').count());
    }
    for (stage, title) in STAGES {
        let _ = writeln!(out, "\n## {title}\n\n| constant | value | what it decides | where from | halved | doubled |");
        let _ = writeln!(out, "| --- | --- | --- | --- | --- | --- |");
        for c in constants.iter().filter(|c| c.stage == stage) {
            let (halved, doubled) = (cell(c.name, "0.5"), cell(c.name, "2"));
            let value = format!("{} {}", c.value, c.unit);
            let _ = writeln!(
                out,
                "| `{}` | {} | {} | {} | {halved} | {doubled} |",
                c.name,
                value.trim(),
                c.meaning,
                c.origin
            );
        }
    }
    out
}

#[test]
fn the_page_of_constants_is_that_of_the_table() {
    let docs = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let csv = std::fs::read_to_string(docs.join("diagnosis-constants.csv")).expect("docs/diagnosis-constants.csv");
    let page = page(&table(), &csv);
    let path = docs.join("diagnosis-constants.md");
    if std::env::var("RECORDED").is_ok_and(|value| value == "write") {
        std::fs::write(&path, page).expect("the page can be written");
        return;
    }
    let known = std::fs::read_to_string(&path).expect("docs/diagnosis-constants.md");
    assert!(known == page, "docs/diagnosis-constants.md is stale: RECORDED=write cargo test --test constants_page");
}

#[test]
fn every_constant_has_a_stage_a_meaning_an_origin_and_a_name_of_its_own() {
    let all = table();
    for c in &all {
        assert!(STAGES.iter().any(|(stage, _)| *stage == c.stage), "{}: {}", c.name, c.stage);
        assert!(c.meaning.ends_with('.') && !c.origin.is_empty() && c.value > 0.0, "{}", c.name);
        assert_eq!(all.iter().filter(|other| other.name == c.name).count(), 1, "{}", c.name);
        assert!(!c.whole || c.value.fract() == 0.0, "{}", c.name);
    }
}
