//! The bytes of a foreign file → text. Loggers and spreadsheets write UTF-8, UTF-16 and Windows-1252.

use rig_files::InputError;
use std::path::Path;

/// How files begin that are no text, and what they are.
const BINARY: [(&[u8], &str); 6] = [
    (b"PK\x03\x04", "a spreadsheet or an archive (XLSX, ODS, ZIP)"),
    (b"\xD0\xCF\x11\xE0", "an old spreadsheet (XLS)"),
    (b"MATLAB 5.0", "a MAT file"),
    (b"TDSm", "a TDMS file"),
    (b"MDF ", "an MDF file"),
    (b"\x89HDF", "an HDF5 file"),
];

/// The text of a file, and a sentence where it was not UTF-8.
///
/// # Errors
/// The file cannot be read, is empty, or is not text.
pub(super) fn read(path: &Path) -> Result<(String, Option<String>), InputError> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| InputError::unreadable(&file, &error))?;
    decode(&bytes, &file)
}

/// As [`read`], of bytes.
pub(super) fn decode(bytes: &[u8], file: &str) -> Result<(String, Option<String>), InputError> {
    let remedy = "export the table as text (CSV)";
    if let Some((_, what)) = BINARY.iter().find(|(begin, _)| bytes.starts_with(begin)) {
        return Err(InputError::new(file, format!("is {what}, not text"), remedy));
    }
    let (encoding, bytes) = match encoding_rs::Encoding::for_bom(bytes) {
        Some((encoding, mark)) => (encoding, &bytes[mark..]),
        None => (without_mark(bytes), bytes),
    };
    let (text, damaged) = encoding.decode_without_bom_handling(bytes);
    if damaged || text.contains('\0') {
        let problem = format!("is no text: it is not {} throughout", encoding.name());
        return Err(InputError::new(file, problem, remedy));
    }
    if text.trim().is_empty() {
        return Err(InputError::new(file, "is empty", "check that the program that made it has finished"));
    }
    // Line ends of old Macs.
    let text = if text.contains('\n') { text.into_owned() } else { text.replace('\r', "\n") };
    let note = (encoding != encoding_rs::UTF_8).then(|| format!("read as {} text", encoding.name()));
    Ok((text, note))
}

/// UTF-16 has zero bytes in text; what is not UTF-8 either is taken for Windows-1252.
fn without_mark(bytes: &[u8]) -> &'static encoding_rs::Encoding {
    let zeros = |begin: usize| bytes.iter().skip(begin).step_by(2).filter(|byte| **byte == 0).count();
    let (even, odd) = (zeros(0), zeros(1));
    let many = bytes.len() / 4;
    if odd > many && even == 0 {
        encoding_rs::UTF_16LE
    } else if even > many && odd == 0 {
        encoding_rs::UTF_16BE
    } else if std::str::from_utf8(bytes).is_ok() {
        encoding_rs::UTF_8
    } else {
        encoding_rs::WINDOWS_1252
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_read_whatever_wrote_it() {
        let text = "Weg;Größe\n1,5;µ\n";
        let utf16 = |unit: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(unit).collect::<Vec<u8>>();
        let marked = |mark: &[u8], bytes: &[u8]| [mark, bytes].concat();
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        for (bytes, said) in [
            (text.as_bytes().to_vec(), false),
            (marked(b"\xEF\xBB\xBF", text.as_bytes()), false),
            (marked(b"\xFF\xFE", &utf16(u16::to_le_bytes)), true),
            (marked(b"\xFE\xFF", &utf16(u16::to_be_bytes)), true),
            (utf16(u16::to_le_bytes), true),
            (latin, true),
            (text.replace('\n', "\r").into_bytes(), false),
        ] {
            let (read, note) = decode(&bytes, "a.csv").expect("text");
            assert_eq!((read.as_str(), note.is_some()), (text, said));
        }
    }

    #[test]
    fn what_is_no_text_is_named() {
        for (bytes, word) in [(&b"PK\x03\x04xx"[..], "spreadsheet"), (b"", "empty"), (b"a\0\0\0b", "no text")] {
            let error = decode(bytes, "a.csv").expect_err("no text").to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
