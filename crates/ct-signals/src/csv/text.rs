//! The text of a CSV file: its encoding, its delimiter, the reader of its rows, and their line numbers.

use std::borrow::Cow;

use csv::{Reader, ReaderBuilder, StringRecord, Trim};

use crate::{Error, LONGEST_LINE, MOST_COLUMNS, ReadError, quoted};

/// The content of a file.
pub(super) struct Decoded<'a> {
    /// Without a byte-order mark.
    pub text: Cow<'a, str>,
    /// Its encoding, where it is not UTF-8.
    pub encoding: Option<&'static str>,
}

/// The content of a file as text: UTF-8, UTF-16 with a byte-order mark, or, as spreadsheets in western Europe write it, Latin-1.
pub(super) fn decode<'a>(file: &str, bytes: &'a [u8]) -> Result<Decoded<'a>, Error> {
    let not_text = |found| {
        Error::Read(ReadError::NotText {
            file: file.into(),
            found,
        })
    };
    if bytes.starts_with(b"PK\x03\x04") {
        return Err(not_text("a zip archive or a spreadsheet"));
    }
    let wide = match bytes {
        [0xff, 0xfe, wide @ ..] => Some((wide, u16::from_le_bytes as fn([u8; 2]) -> u16)),
        [0xfe, 0xff, wide @ ..] => Some((wide, u16::from_be_bytes as fn([u8; 2]) -> u16)),
        _ => None,
    };
    let (text, encoding) = if let Some((wide, unit)) = wide {
        let (units, _) = wide.as_chunks();
        let characters = char::decode_utf16(units.iter().map(|pair| unit(*pair)));
        let text: Result<String, _> = characters.collect();
        let text = text.map_err(|_| not_text("binary data"))?;
        (Cow::Owned(text), Some("UTF-16"))
    } else if let Ok(text) = std::str::from_utf8(bytes) {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        (Cow::Borrowed(text), None)
    } else {
        if bytes.utf8_chunks().any(|chunk| !chunk.valid().is_ascii()) {
            return Err(not_text("a mix of UTF-8 and another encoding"));
        }
        if bytes.iter().any(|byte| is_control(*byte)) {
            return Err(not_text("binary data"));
        }
        // The characters of Latin-1 are the first 256 of Unicode.
        let text = bytes.iter().copied().map(char::from).collect();
        (Cow::Owned(text), Some("Latin-1"))
    };
    if text.as_bytes().contains(&0) {
        return Err(not_text("binary data"));
    }
    let mut begin = 0;
    for line in text.as_bytes().split(|byte| b"\r\n".contains(byte)) {
        if line.len() > LONGEST_LINE {
            return Err(Error::Read(ReadError::LongLine {
                file: file.into(),
                row: line_number(&text, begin + line.len()),
                longest: LONGEST_LINE,
            }));
        }
        begin += line.len() + 1;
    }
    Ok(Decoded { text, encoding })
}

/// Whether a byte is a control character that no text file has.
fn is_control(byte: u8) -> bool {
    byte.is_ascii_control() && !b"\t\r\n\x0c\x1a".contains(&byte)
}

/// The line number of the row that the reader finished at the byte `end`. A line ends as it does for the reader: at a line feed, a carriage
/// return, or the two together.
pub(super) fn line_number(text: &str, end: usize) -> u64 {
    let read = text.as_bytes().get(..end).unwrap_or(text.as_bytes());
    let last = read
        .iter()
        .rposition(|byte| *byte != b'\r' && *byte != b'\n');
    let row = &read[..last.map_or(0, |last| last + 1)];
    let mut before = 0;
    let mut ends = 0;
    for &byte in row {
        ends += u64::from(byte == b'\r' || byte == b'\n' && before != b'\r');
        before = byte;
    }
    ends + 1
}

/// What spreadsheets write before the delimiter in a first line of its own: `sep=;`.
pub(crate) const DELIMITER_KEY: &str = "sep=";

/// Whether a row comes before the header: an empty one, or the one that names the delimiter.
pub(super) fn is_before_header(row: &StringRecord) -> bool {
    let mut cells = row.iter();
    let first = cells.next().unwrap_or_default();
    (first.is_empty() || first == DELIMITER_KEY) && cells.all(str::is_empty)
}

/// Checks that a header has at most [`MOST_COLUMNS`] columns.
pub(crate) fn check_width(file: &str, row: u64, found: usize) -> Result<(), Error> {
    if found > MOST_COLUMNS {
        return Err(Error::Read(ReadError::ManyColumns {
            file: file.into(),
            row,
            found,
            most: MOST_COLUMNS,
        }));
    }
    Ok(())
}

/// A cell that names no column: a number, with a decimal comma too, or nothing.
pub(crate) fn is_number(cell: &str) -> bool {
    cell.is_empty() || cell.replace(',', ".").parse::<f64>().is_ok()
}

/// Numbers alone are no header, and neither are too many columns.
pub(super) fn check_header(file: &str, row: u64, record: &StringRecord) -> Result<(), Error> {
    check_width(file, row, record.len())?;
    if record.iter().all(is_number) {
        return Err(Error::Read(ReadError::NoHeader {
            file: file.into(),
            row,
            first: quoted(&record.iter().collect::<Vec<_>>().join(", ")),
        }));
    }
    Ok(())
}

/// The one of comma, semicolon and tab that the first row has most of.
pub(crate) fn delimiter(text: &str) -> u8 {
    let named = text.strip_prefix(DELIMITER_KEY);
    if let Some(&named) = named.and_then(|named| named.as_bytes().first())
        && b";\t,|".contains(&named)
    {
        return named;
    }
    let header = text
        .split(['\n', '\r'])
        .find(|line| !line.trim().is_empty() && !line.starts_with('#'))
        .unwrap_or_default();
    let count = |delimiter: &u8| header.bytes().filter(|byte| byte == delimiter).count();
    // `max_by_key` returns the last of equal items: a comma, if no delimiter occurs.
    b";\t,".iter().copied().max_by_key(count).unwrap_or(b',')
}

/// Name of a delimiter.
pub(crate) fn delimiter_name(delimiter: u8) -> &'static str {
    match delimiter {
        b';' => "semicolon",
        b'\t' => "tab",
        b'|' => "bar",
        _ => "comma",
    }
}

/// Reads the rows of a text, which may differ in length, without comments and without blanks around the cells.
pub(super) fn reader(text: &str, delimiter: u8) -> Reader<&[u8]> {
    ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .trim(Trim::All)
        .from_reader(text.as_bytes())
}
