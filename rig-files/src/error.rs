//! The one error of malformed input: where it is, what is wrong, what to do.

use std::fmt;

/// Malformed input: the file, the line where there is one, what is wrong with which key or column, and the remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    /// The file as the user named it.
    pub file: String,
    /// Line number from 1, where the problem has one.
    pub line: Option<u64>,
    /// What is wrong, naming the key or column and the value found.
    pub problem: String,
    /// What the user can do about it.
    pub remedy: String,
}

impl InputError {
    /// An error about the file as a whole.
    pub fn new(file: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { file: file.into(), line: None, problem: problem.into(), remedy: remedy.into() }
    }

    /// The same error at a line (from 1).
    #[must_use]
    pub fn at_line(mut self, line: u64) -> Self {
        self.line = Some(line);
        self
    }

    /// A file that could not be opened or read.
    #[must_use]
    pub fn unreadable(file: &str, error: &std::io::Error) -> Self {
        let remedy = match error.kind() {
            std::io::ErrorKind::NotFound => "check the path; it is taken relative to the current directory",
            std::io::ErrorKind::PermissionDenied => "check the permissions of the file and its folder",
            std::io::ErrorKind::IsADirectory => "name a file, not a folder",
            _ => "check that the path names a readable file",
        };
        Self::new(file, format!("cannot be read: {error}"), remedy)
    }

    /// A file or a folder that could not be created or written.
    #[must_use]
    pub fn unwritable(file: &str, error: &std::io::Error) -> Self {
        let remedy = match error.kind() {
            std::io::ErrorKind::PermissionDenied => "choose a folder you may write to",
            std::io::ErrorKind::NotADirectory | std::io::ErrorKind::AlreadyExists => {
                "choose another name: a part of the path is a file"
            }
            std::io::ErrorKind::IsADirectory => "name a file, not a folder",
            _ => "check the path and the free space",
        };
        Self::new(file, format!("cannot be written: {error}"), remedy)
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if let Some(line) = self.line {
            write!(f, ", line {line}")?;
        }
        write!(f, ": {}; {}", self.problem, self.remedy)
    }
}

impl std::error::Error for InputError {}

/// The known word nearest to a misspelt one, if any is near enough to be what was meant.
#[must_use]
pub fn closest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|candidate| {
            let prefix = !word.is_empty() && (candidate.starts_with(word) || word.starts_with(candidate));
            let score = strsim::jaro_winkler(word, candidate) + if prefix { 0.1 } else { 0.0 };
            (score, candidate)
        })
        .filter(|(score, _)| *score > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}
