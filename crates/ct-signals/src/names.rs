//! How messages name what a caller gave.

/// Names, in messages, of the settings and the columns that a caller may change.
///
/// [`Display`](std::fmt::Display) of an error has [`Names::LIBRARY`]: the fields of [`ReadOptions`](crate::ReadOptions) and
/// [`Columns`](crate::Columns). A program whose users give options and write a file, or a binding with arguments of its own, hands its names to
/// [`Error::worded`](crate::Error::worded).
///
/// ```
/// use ct_signals::{Columns, Names, ReadOptions, parse_csv};
///
/// let names = Names { strict: "--strict", ..Names::LIBRARY };
/// let options = ReadOptions { strict: true, ..ReadOptions::default() };
/// let error = parse_csv("a.csv", b"t,u,y\n0,,1\n", &Columns::default(), &options).unwrap_err();
/// assert!(error.to_string().contains("leave out `strict`"));
/// assert!(error.worded(&names).contains("leave out --strict"));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Names {
    /// What refuses missing samples and missing rows.
    pub strict: &'static str,
    /// The beginning of the part of a file that is wanted.
    pub from: &'static str,
    /// Its end.
    pub to: &'static str,
    /// How another part is chosen, after "choose another part".
    pub part: &'static str,
    /// What asks for an even grid.
    pub resample: &'static str,
    /// What says which column is what, and which words mark a missing sample.
    pub columns: &'static str,
    /// The same with a preposition, after "name another column".
    pub in_columns: &'static str,
    /// What the column of a role is given by, after "set"; the role is `time`, `input`, `output` or `reference`.
    pub column: fn(role: &str) -> String,
    /// What gives a column another unit than the file.
    pub namer: &'static str,
}

impl Names {
    /// Names of this crate.
    pub const LIBRARY: Self = Self {
        strict: "`strict`",
        from: "`from`",
        to: "`to`",
        part: "with `from` and `to`",
        resample: "`resample`",
        columns: "`Columns`",
        in_columns: "in `Columns`",
        column: field,
        namer: "`Columns`",
    };
}

/// The field of [`Columns`](crate::Columns) for a role.
fn field(role: &str) -> String {
    // There is one time, and there may be several of the others.
    let plural = if role == "time" { "" } else { "s" };
    format!("`Columns::{role}{plural}`")
}
