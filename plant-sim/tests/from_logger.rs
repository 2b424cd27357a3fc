//! docs/from-logger-to-verdict.md, walked: every command of the page is typed in its order, every change of a file is made, and what
//! the page shows must come out; `…` stands for anything.

use std::path::{Path, PathBuf};
use std::process::Command;
use test_stages::runs_long;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// One thing that the reader of the page does.
#[derive(Debug)]
enum Step {
    /// A command, and the lines that it prints; a line `…` stands for others.
    Command { line: String, shown: Vec<String> },
    /// Lines of a file that become others, and the file.
    Change { file: String, old: String, new: String },
    /// Lines that are in a file.
    Look { file: String, lines: Vec<String> },
}

/// What the page says, in its order. A block that changes or shows a file belongs to the last `.toml` in backquotes above it.
fn steps(page: &str) -> Vec<Step> {
    let (mut steps, mut file, mut block): (Vec<Step>, String, Option<String>) = (Vec::new(), String::new(), None);
    let mut old = String::new();
    for line in page.lines() {
        if let Some(kind) = line.strip_prefix("```") {
            if kind == "toml" {
                steps.push(Step::Look { file: file.clone(), lines: Vec::new() });
            }
            block = block.is_none().then(|| kind.to_string());
            continue;
        }
        match block.as_deref() {
            None => {
                let quoted = line.split('`').skip(1).step_by(2).filter(|text| text.ends_with(".toml"));
                file = quoted.last().map_or(file, str::to_string);
            }
            Some("console") => match (line.strip_prefix("$ cargo sim "), steps.last_mut()) {
                (Some(command), _) => steps.push(Step::Command { line: command.to_string(), shown: Vec::new() }),
                (None, Some(Step::Command { shown, .. })) => shown.push(line.to_string()),
                _ => panic!("no command above: {line}"),
            },
            Some("toml") => match steps.last_mut() {
                Some(Step::Look { lines, .. }) => lines.push(line.to_string()),
                _ => panic!("{line}"),
            },
            Some("diff") => match (line.strip_prefix('-'), line.strip_prefix('+')) {
                (Some(text), _) => old = text.to_string(),
                (_, Some(new)) => {
                    steps.push(Step::Change { file: file.clone(), old: old.clone(), new: new.to_string() })
                }
                _ => panic!("neither removed nor added: {line}"),
            },
            Some(other) => panic!("a block of {other} is not walked"),
        }
    }
    steps
}

/// Whether a line is as the page shows it.
fn is(line: &str, wanted: &str) -> bool {
    match wanted.split_once('…') {
        Some((begin, end)) => line.len() >= begin.len() + end.len() && line.starts_with(begin) && line.ends_with(end),
        None => line == wanted,
    }
}

fn copy(folder: &str, to: &Path) {
    std::fs::create_dir_all(to.join(folder)).expect("a folder");
    for file in std::fs::read_dir(root().join(folder)).expect("readable") {
        let file = file.expect("readable");
        std::fs::copy(file.path(), to.join(folder).join(file.file_name())).expect("copied");
    }
}

#[test]
fn a_technician_gets_from_the_loggers_file_to_a_verdict_by_the_page_alone() {
    let page = std::fs::read_to_string(root().join("docs/from-logger-to-verdict.md")).expect("the page");
    let folder = tempfile::tempdir().expect("a folder");
    copy("examples/loggers", folder.path());
    let mut steps = steps(&page);
    assert!(steps.len() > 12, "{steps:?}");
    if !runs_long("from the logger's file to a verdict, behind the first verdict") {
        let diagnoses = |step: &Step| matches!(step, Step::Command { line, .. } if line.starts_with("diagnose"));
        steps.truncate(1 + steps.iter().position(diagnoses).expect("a verdict"));
    }
    for step in steps {
        match step {
            Step::Command { line, shown } => {
                let output = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
                    .args(line.split(' '))
                    .current_dir(folder.path())
                    .output()
                    .expect("plant-sim runs");
                let said =
                    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
                let refused = shown.first().is_some_and(|line| line.starts_with("error: "));
                assert_eq!(output.status.success(), !refused, "{line}\n{said}");
                for wanted in shown.iter().filter(|line| *line != "…") {
                    assert!(
                        said.lines().any(|line| is(line, wanted)),
                        "{line}: the page shows {wanted:?}, but it says\n{said}"
                    );
                }
                if !shown.contains(&"…".to_string()) {
                    assert_eq!(
                        said.trim_end().lines().count(),
                        shown.len(),
                        "{line}: the page shows all, but it says\n{said}"
                    );
                }
            }
            Step::Change { file, old, new } => {
                let path = folder.path().join(file);
                let text = std::fs::read_to_string(&path).expect("a file that a command wrote");
                assert!(text.contains(&old), "{old:?} is not in\n{text}");
                std::fs::write(&path, text.replacen(&old, &new, 1)).expect("written");
            }
            Step::Look { file, lines } => {
                let text = std::fs::read_to_string(folder.path().join(file)).expect("a file that a command wrote");
                for line in lines {
                    assert!(text.lines().any(|written| written == line), "{line:?} is not in\n{text}");
                }
            }
        }
    }
}
