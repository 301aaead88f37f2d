//! Capabilities of the terminal (colours, width), and layout of text for it.

use std::fmt::Display;

use console::{Style, Term};

/// Largest width of a line: longer lines are hard to read.
const WIDEST: usize = 100;
const NARROWEST: usize = 48;
/// Default width for a pipe or a file.
const USUAL: usize = 80;

/// Layout of text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Look {
    /// Whether colours may be used.
    pub colour: bool,
    /// Columns to fill.
    pub width: usize,
}

impl Look {
    /// Layout for standard output: no colours into a pipe or if `NO_COLOR` is set.
    #[must_use]
    pub fn of_stdout() -> Self {
        Self::of(&Term::stdout(), console::colors_enabled())
    }

    /// Layout for standard error.
    #[must_use]
    pub fn of_stderr() -> Self {
        Self::of(&Term::stderr(), console::colors_enabled_stderr())
    }

    fn of(term: &Term, colours: bool) -> Self {
        let width = term
            .size_checked()
            .map_or(USUAL, |(_, columns)| usize::from(columns));
        Self {
            colour: term.is_term() && colours,
            width: width.clamp(NARROWEST, WIDEST),
        }
    }

    /// Plain text, 80 columns wide.
    #[must_use]
    pub fn plain() -> Self {
        Self {
            colour: false,
            width: USUAL,
        }
    }

    /// A heading, on as many lines as it needs.
    pub(crate) fn heading(self, text: &str) -> String {
        let lines = self.paragraph("", text);
        self.paint(Style::new().bold().cyan(), lines.trim_end())
    }

    /// Emphasised text.
    pub(crate) fn strong(self, text: impl Display) -> String {
        self.paint(Style::new().bold(), text)
    }

    /// Text of lesser importance.
    pub(crate) fn faint(self, text: impl Display) -> String {
        self.paint(Style::new().dim(), text)
    }

    /// Text of a positive result.
    pub(crate) fn good(self, text: impl Display) -> String {
        self.paint(Style::new().bold().green(), text)
    }

    /// Text of a warning.
    pub(crate) fn warning(self, text: impl Display) -> String {
        self.paint(Style::new().bold().yellow(), text)
    }

    /// A warning on as many lines as it needs.
    pub(crate) fn warning_paragraph(self, what: impl Display) -> String {
        let lines = self.paragraph("", &format!("warning: {what}"));
        self.warning(lines.trim_end()) + "\n"
    }

    /// Text in a style.
    pub(crate) fn paint(self, style: Style, text: impl Display) -> String {
        style.force_styling(self.colour).apply_to(text).to_string()
    }

    /// Text broken into lines: the first begins with `first`, the others with as many blanks.
    pub(crate) fn paragraph(self, first: &str, text: &str) -> String {
        let indent = console::measure_text_width(first);
        let mut lines = String::from(first);
        let mut column = indent;
        for word in text.split_whitespace() {
            let width = console::measure_text_width(word);
            if column > indent && column + 1 + width > self.width {
                lines.push('\n');
                lines.push_str(&" ".repeat(indent));
                column = indent;
            }
            if column > indent {
                lines.push(' ');
                column += 1;
            }
            lines.push_str(word);
            column += width;
        }
        lines.push('\n');
        lines
    }
}

/// Alignment of a table's column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Left,
    Right,
}

/// A table without rules: columns separated by two blanks, as wide as necessary.
pub(crate) fn table(sides: &[Side], rows: &[Vec<String>]) -> Vec<String> {
    let widths: Vec<usize> = (0..sides.len())
        .map(|column| {
            rows.iter()
                .filter_map(|row| row.get(column))
                .map(|cell| console::measure_text_width(cell))
                .max()
                .unwrap_or(0)
        })
        .collect();
    rows.iter()
        .map(|row| {
            let cells: Vec<String> = row
                .iter()
                .zip(sides)
                .zip(&widths)
                .map(|((cell, side), &width)| {
                    let blanks =
                        " ".repeat(width.saturating_sub(console::measure_text_width(cell)));
                    match side {
                        Side::Left => format!("{cell}{blanks}"),
                        Side::Right => format!("{blanks}{cell}"),
                    }
                })
                .collect();
            cells.join("  ").trim_end().to_string()
        })
        .collect()
}

/// A [`table`] as text, indented by two blanks.
pub(crate) fn table_text(sides: &[Side], rows: &[Vec<String>]) -> String {
    let lines = table(sides, rows).into_iter();
    lines.map(|line| format!("  {line}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paragraph_hangs_and_stays_inside_the_width() {
        let look = Look {
            colour: false,
            width: 20,
        };
        let text = look.paragraph("  - ", "the level stays constant at the rim");
        assert_eq!(text, "  - the level stays\n    constant at the\n    rim\n");
    }

    #[test]
    fn columns_line_up_with_colour_too() {
        let look = Look {
            colour: true,
            width: 80,
        };
        let rows = [
            vec![look.strong("a"), "10.5".to_string()],
            vec!["abc".to_string(), "9".to_string()],
        ];
        let lines = table(&[Side::Left, Side::Right], &rows);
        assert_eq!(console::strip_ansi_codes(&lines[0]), "a    10.5");
        assert_eq!(lines[1], "abc     9");
    }
}
