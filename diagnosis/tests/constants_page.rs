//! The page of constants says what the table says: `docs/diagnosis-constants.md` is made from `constants::table()` and from
//! the measured effects in `docs/diagnosis-constants.csv` and `docs/diagnosis-constants-disturbed.csv`.

use diagnosis::constants::{Constant, table};
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::PathBuf;

const HEAD: &str = "\
# The constants of the diagnosis

The numbers by which causes are searched, judged and named, given and not derived, with their reasons, and what happens when each is halved and
doubled: of the ten logs of each of two fixed sets, how many are answered rightly, and how many answers (verdict or names)
change. The tidy set holds causes of every class. In the disturbed set a sensor is at its limit, the recording is interrupted
or short, a pressure is not measured, or there is no noise. \"same\" means that none of the ten answers changed; a dash means
not measured. Numbers that follow from a derivation stand beside it in the code.

What could be switched off, alone and together with others, without another answer in these sets and in the recorded
diagnoses (`diagnosis/tests/recorded`) is gone, and its constants with it. What is left and reads \"same\" twice is of three kinds:
numerical tolerances, which have to be so small that half or double changes nothing; limits that end a search and bound its time;
guards against recordings that neither set holds. Both sets were measured after the last
change of the optimiser and before these: no cause is added once the effort is spent, a trifle must explain misfit beyond
noise by itself, the gains of both pressure sensors are compared with each other, temperature is known to 1.7 % instead of 1.2 %, and
searches end later (the rows of both limits, measured again, are those of their present values), and a plain gain is a twentieth of the noise's cost instead of a tenth (its rows are those of a twentieth and a fifth).
As they are, both sets get the same answers before and after. One log of the tidy set, in which hardly anything moves, stands near a
second name, a lag of the pressure sensors or a scale of the position beside a dead zone. Of thirteen changes that led to one, measured
again since, four still do.

The measurement: `cargo run --release -p diagnosis --features sensitivity --example sensitivity -- all tidy
docs/diagnosis-constants.csv`, and `-- all disturbed docs/diagnosis-constants-disturbed.csv`. This page:
`RECORDED=write cargo test --test constants_page`. [diagnosis-statistics.md](diagnosis-statistics.md) says where each constant acts.
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

/// What a set shows of a constant that is halved and doubled.
struct Measured {
    rows: HashMap<(String, String), (String, String)>,
}

impl Measured {
    fn base(&self) -> Option<&(String, String)> {
        self.rows.get(&("none".to_string(), "1".to_string()))
    }

    fn cell(&self, name: &str, factor: &str) -> String {
        match (self.rows.get(&(name.to_string(), factor.to_string())), self.base()) {
            (Some((right, _)), _) if right == "failed" => "no diagnosis".to_string(),
            (Some((right, said)), Some((_, before))) => {
                let changed = said.split(';').zip(before.split(';')).filter(|(new, old)| new != old).count();
                if changed == 0 { format!("{right}, same") } else { format!("{right}, {changed} changed") }
            }
            _ => "–".to_string(),
        }
    }
}

fn page(constants: &[Constant], [tidy, disturbed]: [&str; 2]) -> String {
    let sets = [("tidy", tidy), ("disturbed", disturbed)].map(|(name, csv)| (name, Measured { rows: measured(csv) }));
    let mut out = HEAD.to_string();
    // Writing to a String cannot fail.
    for (name, set) in &sets {
        if let Some((right, said)) = set.base() {
            let _ = writeln!(out, "\nAs they are, {name}: {right} of {} right.", said.split(';').count());
        }
    }
    for (stage, title) in STAGES {
        let _ = writeln!(
            out,
            "\n## {title}\n\n| constant | value | what it decides | where from | tidy: halved | doubled | disturbed: halved | doubled |"
        );
        let _ = writeln!(out, "| --- | --- | --- | --- | --- | --- | --- | --- |");
        for c in constants.iter().filter(|c| c.stage == stage) {
            let value = format!("{} {}", c.value, c.unit);
            let _ = write!(out, "| `{}` | {} | {} | {} |", c.name, value.trim(), c.meaning, c.origin);
            for (_, set) in &sets {
                let _ = write!(out, " {} | {} |", set.cell(c.name, "0.5"), set.cell(c.name, "2"));
            }
            out.push('\n');
        }
    }
    out
}

#[test]
fn the_page_of_constants_is_that_of_the_table() {
    let docs = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let read =
        |file: &str| std::fs::read_to_string(docs.join(file)).unwrap_or_else(|error| panic!("docs/{file}: {error}"));
    let [tidy, disturbed] = ["diagnosis-constants.csv", "diagnosis-constants-disturbed.csv"].map(read);
    let page = page(&table(), [&tidy, &disturbed]);
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
