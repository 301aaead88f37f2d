//! Position in a file, computed only if a message needs it.

use super::text::line_number;
use crate::quoted;

/// A cell: its file, its column's header, and where its row ends.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub name: &'a str,
    pub text: &'a str,
    /// Byte at which the reader finished the row.
    pub end: usize,
    pub header: &'a str,
}

impl Place<'_> {
    pub fn file(&self) -> String {
        self.name.to_string()
    }

    pub fn row(&self) -> u64 {
        line_number(self.text, self.end)
    }

    pub fn column(&self) -> String {
        quoted(self.header)
    }
}
