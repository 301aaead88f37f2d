//! Errors in a model's text, with their position.

/// A place in a text, counted from one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    /// The line.
    pub line: usize,
    /// The character in the line.
    pub column: usize,
}

/// Error in a model's text: one line with the position, the error and the correction.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}:{}: {what}", position.line, position.column)]
pub struct TextError {
    /// Start of the rejected words.
    pub position: Position,
    /// The error, with the words of the source and the correction.
    pub what: String,
    /// The line of the source.
    pub source_line: String,
}

/// Longest quotation of the source in a message \[characters\].
const LONGEST: usize = 60;

impl TextError {
    /// At a byte of a text.
    pub(crate) fn at(text: &str, byte: usize, what: impl Into<String>) -> Self {
        let before = &text[..byte.min(text.len())];
        let begin = before.rfind('\n').map_or(0, |at| at + 1);
        let line = before.bytes().filter(|byte| *byte == b'\n').count() + 1;
        let rest = &text[begin..];
        let source = rest.lines().next().unwrap_or_default();
        Self {
            position: Position {
                line,
                column: before[begin..].chars().count() + 1,
            },
            what: what.into(),
            source_line: printable(source, 4 * LONGEST),
        }
    }

    /// The line of the source with a mark below the column, for a terminal.
    #[must_use]
    pub fn excerpt(&self) -> String {
        let shown = self.source_line.chars().count();
        let mark = (self.position.column - 1).min(shown);
        format!("{}\n{}^", self.source_line, " ".repeat(mark))
    }
}

/// Words of the source in a message: of printable characters, and not too long.
pub(crate) fn shown(words: &str) -> String {
    format!("`{}`", printable(words, LONGEST))
}

fn printable(words: &str, longest: usize) -> String {
    let clean = |c: char| if c.is_control() { ' ' } else { c };
    let mut all: String = words.chars().take(longest).map(clean).collect();
    if words.chars().nth(longest).is_some() {
        all.push_str("...");
    }
    all
}
