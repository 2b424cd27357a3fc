//! The structure of the source: files import one another in one direction only, inside every crate.
//!
//! What counts is a `use` of a path inside the same crate (`crate::…`, `super::…`). The declaration of a module by its
//! parent is not an import.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The crates of the workspace, by the folders that hold a `src`.
fn crates() -> Vec<PathBuf> {
    let folders = std::fs::read_dir(root()).expect("the workspace");
    let mut out: Vec<PathBuf> = folders.filter_map(|entry| Some(entry.ok()?.path())).collect();
    out.retain(|folder| folder.join("Cargo.toml").is_file() && folder.join("src").is_dir());
    out.sort();
    out
}

fn rust_files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a source folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            out.push(path);
        }
    }
}

/// The module path of a file below `src`: `select/forward.rs` is `[select, forward]`.
fn module_of(file: &Path, source: &Path) -> Vec<String> {
    let inside = file.strip_prefix(source).expect("a file of the crate").with_extension("");
    let mut path: Vec<String> = inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if path.last().is_some_and(|last| ["mod", "lib", "main"].contains(&last.as_str())) {
        path.pop();
    }
    path
}

/// Every path that the `use` declarations of a text name, groups written out.
fn used_paths(text: &str) -> Vec<String> {
    let mut out = Vec::new();
    let plain = text.split("#[cfg(test)]").next().unwrap_or_default();
    for statement in plain.split(';') {
        let Some(begin) = statement.rfind("use crate::").or_else(|| statement.rfind("use super::")) else { continue };
        let path: String = statement[begin + 4..].split_whitespace().collect::<Vec<_>>().join(" ");
        expand("", &path, &mut out);
    }
    out
}

fn expand(prefix: &str, path: &str, out: &mut Vec<String>) {
    let path = path.trim();
    let Some(open) = path.find('{') else {
        out.push(format!("{prefix}{path}"));
        return;
    };
    let prefix = format!("{prefix}{}", &path[..open]);
    let inside = path[open + 1..].trim_end().trim_end_matches('}');
    let (mut depth, mut start) = (0, 0);
    for (place, character) in inside.char_indices() {
        match character {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                expand(&prefix, &inside[start..place], out);
                start = place + 1;
            }
            _ => {}
        }
    }
    if !inside[start..].trim().is_empty() {
        expand(&prefix, &inside[start..], out);
    }
}

/// The module that a used path leads to: the longest part of it that is a file of the crate.
fn target(path: &str, from: &[String], modules: &BTreeSet<Vec<String>>) -> Option<Vec<String>> {
    let mut full: Vec<String> = Vec::new();
    for (place, part) in path.split("::").enumerate() {
        match part.trim() {
            "crate" => full.clear(),
            "super" if place == 0 => full = from[..from.len().checked_sub(1)?].to_vec(),
            "super" => {
                full.pop()?;
            }
            other => full.push(other.split(' ').next().unwrap_or_default().to_string()),
        }
    }
    while !full.is_empty() && !modules.contains(&full) {
        full.pop();
    }
    (full != from).then_some(full)
}

/// One cycle, if there is any: modules that lead from the first to itself.
fn cycle(graph: &BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) -> Option<Vec<Vec<String>>> {
    fn visit<'a>(
        at: &'a Vec<String>,
        graph: &'a BTreeMap<Vec<String>, BTreeSet<Vec<String>>>,
        way: &mut Vec<&'a Vec<String>>,
        done: &mut BTreeSet<&'a Vec<String>>,
    ) -> Option<Vec<Vec<String>>> {
        if let Some(place) = way.iter().position(|other| *other == at) {
            return Some(way[place..].iter().map(|module| (*module).clone()).collect());
        }
        if !done.insert(at) {
            return None;
        }
        way.push(at);
        let found = graph.get(at).into_iter().flatten().find_map(|next| visit(next, graph, way, done));
        way.pop();
        found
    }
    let mut done = BTreeSet::new();
    graph.keys().find_map(|start| visit(start, graph, &mut Vec::new(), &mut done))
}

#[test]
fn no_crate_has_an_import_cycle() {
    let crates = crates();
    assert!(crates.len() > 10, "{crates:?}");
    for folder in crates {
        let source = folder.join("src");
        let mut files = Vec::new();
        rust_files(&source, &mut files);
        let modules: BTreeSet<Vec<String>> = files.iter().map(|file| module_of(file, &source)).collect();
        let mut graph: BTreeMap<Vec<String>, BTreeSet<Vec<String>>> = BTreeMap::new();
        for file in &files {
            // The root re-exports; what is imported from it is imported from where it is defined.
            let from = module_of(file, &source);
            if from.is_empty() {
                continue;
            }
            let text = std::fs::read_to_string(file).expect("a source file");
            let targets = used_paths(&text).into_iter().filter_map(|path| target(&path, &from, &modules));
            graph.entry(from.clone()).or_default().extend(targets.filter(|to| !to.is_empty()));
        }
        if let Some(cycle) = cycle(&graph) {
            let names: Vec<String> = cycle.iter().map(|module| module.join("::")).collect();
            panic!("{}: import cycle {}", folder.display(), names.join(" → "));
        }
    }
}

/// Cargo starts a program for every target and every crate's documentation, empty or not; where there is nothing to run,
/// the manifest says so. A test written there later must not be passed over in silence.
#[test]
fn what_cargo_is_told_not_to_test_holds_no_tests() {
    let mut switched_off = 0;
    for folder in crates() {
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).expect("a manifest");
        let manifest: toml::Table = manifest.parse().expect("TOML");
        let off = |target: &toml::Value, key: &str| target.get(key).and_then(toml::Value::as_bool) == Some(false);
        let mut holds = |path: &Path, what: fn(&str) -> bool| {
            switched_off += 1;
            let mut files = Vec::new();
            if path.is_dir() {
                rust_files(path, &mut files)
            } else {
                files.push(path.to_path_buf())
            }
            let text = |file: &PathBuf| std::fs::read_to_string(file).expect("a source file");
            files.into_iter().find(|file| what(&text(file)))
        };
        if let Some(library) = manifest.get("lib") {
            if off(library, "test") {
                let found = holds(&folder.join("src"), has_test);
                assert_eq!(found, None, "a test that `test = false` in its Cargo.toml leaves out");
            }
            if off(library, "doctest") {
                let found = holds(&folder.join("src"), has_example);
                assert_eq!(found, None, "an example that `doctest = false` in its Cargo.toml leaves out");
            }
        }
        for program in manifest.get("bin").and_then(toml::Value::as_array).into_iter().flatten() {
            let Some(path) = program.get("path").and_then(toml::Value::as_str) else { continue };
            if off(program, "test") {
                assert_eq!(holds(&folder.join(path), has_test), None, "a test that `test = false` leaves out");
            }
        }
    }
    assert!(switched_off > 10, "{switched_off}");
}

fn has_test(text: &str) -> bool {
    text.lines().any(|line| ["#[test]", "proptest! {"].contains(&line.trim()))
}

/// Whether documentation shows code that is to be compiled: a fence without a language.
fn has_example(text: &str) -> bool {
    let comments = text.lines().filter_map(|line| line.trim().strip_prefix("//")?.strip_prefix(['/', '!']));
    let fences = comments.filter_map(|line| line.trim().strip_prefix("```"));
    fences.step_by(2).any(|language| language.is_empty() || language == "rust")
}

#[test]
fn tests_and_examples_would_be_found() {
    assert!(has_test("mod tests {\n    #[test]\n    fn it() {}"));
    assert!(!has_test("// it has no `#[test]`"));
    assert!(has_example("/// ```\n/// let x = 1;\n/// ```"));
    assert!(has_example("//! ```text\n//! a → b\n//! ```\n//! ```\n//! code();\n//! ```"));
    assert!(!has_example("//! ```text\n//! a → b\n//! ```"));
}

#[test]
fn a_cycle_would_be_found() {
    let modules: BTreeSet<Vec<String>> = [vec!["a".to_string()], vec!["b".into()], vec!["b".into(), "c".into()]].into();
    let uses = |from: &[&str], text: &str| -> BTreeSet<Vec<String>> {
        let from: Vec<String> = from.iter().map(|part| (*part).to_string()).collect();
        used_paths(text).into_iter().filter_map(|path| target(&path, &from, &modules)).collect()
    };
    let mut graph = BTreeMap::new();
    graph.insert(vec!["a".to_string()], uses(&["a"], "use crate::b::{self, c::{One, Two}};\nuse std::fmt;"));
    graph.insert(vec!["b".into(), "c".into()], uses(&["b", "c"], "/// Text.\nuse super::super::a::Thing;"));
    assert_eq!(graph[&vec!["a".to_string()]].len(), 2);
    assert_eq!(cycle(&graph).map(|found| found.len()), Some(2));
    graph.insert(vec!["b".into(), "c".into()], BTreeSet::new());
    assert_eq!(cycle(&graph), None);
}
