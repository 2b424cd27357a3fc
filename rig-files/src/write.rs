//! Reading text whole and writing files whole or not at all.

use crate::InputError;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Reads a file as UTF-8 text; a UTF-8 byte-order mark (some spreadsheets write one) is dropped.
///
/// # Errors
/// The file cannot be read, is empty, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, InputError> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| InputError::unreadable(&file, &error))?;
    to_text(bytes, &file, "save it as UTF-8 text")
}

/// Bytes as text under the rules of [`read_text`], with what to do about other encodings.
pub(crate) fn to_text(bytes: Vec<u8>, file: &str, remedy: &str) -> Result<String, InputError> {
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        return Err(InputError::new(file, "is UTF-16 text", remedy));
    }
    let mut text = String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..valid].iter().filter(|&&byte| byte == b'\n').count() as u64;
        InputError::new(file, "is not UTF-8 text", remedy).at_line(line)
    })?;
    if text.starts_with('\u{FEFF}') {
        text.remove(0);
    }
    if text.contains('\0') {
        return Err(InputError::new(file, "contains NUL bytes: a binary file or UTF-16 text", remedy));
    }
    if text.trim().is_empty() {
        return Err(InputError::new(file, "is empty", "check that the program that made it has finished"));
    }
    Ok(text)
}

/// Writes a file through a temporary name in the same folder and renames it, so that no reader ever sees half of it and
/// a failure leaves what was there before. The folder is made if it is not there. A path that names a device
/// (`/dev/stdout`) is written directly.
///
/// # Errors
/// The folder or the file cannot be created, written or renamed, or `fill` fails.
pub fn write_file(path: &Path, fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<(), InputError> {
    let name = path.display().to_string();
    let failed = |error: std::io::Error| InputError::unwritable(&name, &error);
    if path.is_dir() {
        return Err(failed(std::io::Error::from(std::io::ErrorKind::IsADirectory)));
    }
    if path.exists() && !path.is_file() {
        let mut device = BufWriter::new(std::fs::OpenOptions::new().write(true).open(path).map_err(failed)?);
        return fill(&mut device).and_then(|()| device.flush()).map_err(failed);
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(folder).map_err(failed)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".writing-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    // Without its source the error does not name the temporary file, which nobody asked for.
    let mut temporary = builder.tempfile_in(folder).map_err(|error| failed(error.kind().into()))?;
    {
        let mut buffered = BufWriter::with_capacity(1 << 16, &mut temporary);
        fill(&mut buffered).and_then(|()| buffered.flush()).map_err(failed)?;
    }
    temporary.persist(path).map(drop).map_err(|error| failed(error.error))
}
