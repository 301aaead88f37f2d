//! Errors in the columns of a file. The correction depends on where the columns were named, which the caller knows.

use crate::{Names, unit};

/// An error of a column, without the correction.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ColumnFault {
    /// A column that is needed is not in the file.
    Missing {
        /// `time`, `input`, `output` or `reference`.
        role: &'static str,
        /// The name that was looked for, quoted, or the letter it was to begin with.
        wanted: String,
        /// All columns of the file, quoted.
        columns: String,
        /// The column whose name is close to the one that was looked for.
        closest: Option<String>,
    },
    /// Several columns fit one role.
    Ambiguous {
        /// `time`, `input`, `output` or `reference`.
        role: &'static str,
        /// The columns that fit, quoted.
        candidates: String,
    },
    /// One column has two roles.
    Shared {
        /// The column's header.
        column: String,
        /// The first role.
        first: &'static str,
        /// The second role.
        second: &'static str,
    },
    /// The name and the file give the same column different units.
    Unit {
        /// The column's header.
        column: String,
        /// The unit in the file's header.
        file_unit: String,
        /// The unit in the name.
        named_unit: String,
    },
}

impl ColumnFault {
    /// The fault and its correction in the form that follows the place in a message: `namer` is the source of the column names, `mend`
    /// begins in small letters.
    #[must_use]
    pub fn said(&self, namer: &str, mend: &str) -> String {
        match self {
            Self::Missing {
                role,
                wanted,
                columns,
                closest,
            } => {
                let what = format!(": no column {wanted} for the {role}; the file has {columns}");
                match closest {
                    Some(name) => format!("{what}; did you mean \"{name}\"? {}", capital(mend)),
                    None => format!("{what}; {mend}"),
                }
            }
            Self::Ambiguous { role, candidates } => {
                format!(": {candidates} could each be the {role}; {mend}")
            }
            Self::Shared {
                column,
                first,
                second,
            } if first == second => {
                format!(", column \"{column}\": it is named twice as {first}; {mend}")
            }
            Self::Shared {
                column,
                first,
                second,
            } => format!(
                ", column \"{column}\": it is named both as {first} and as {second}; {mend}"
            ),
            Self::Unit {
                column,
                file_unit,
                named_unit,
            } => format!(
                ", column \"{column}\": the file says {file_unit} but {namer} says {named_unit}; {mend}"
            ),
        }
    }

    /// The message with the correction in the caller's names.
    pub(crate) fn worded(&self, names: &Names) -> String {
        let Names {
            column: of_role,
            in_columns,
            ..
        } = names;
        let mend = match self {
            Self::Missing { role, .. } => format!("set {}", of_role(role)),
            Self::Ambiguous { role, .. } => format!(
                "say which with {}, and rename columns of the same name",
                of_role(role)
            ),
            Self::Shared { .. } => format!("give each its own column {in_columns}"),
            Self::Unit {
                column,
                file_unit,
                named_unit,
            } => {
                // No constant of a model has the unit of the time.
                let of_time = [file_unit, named_unit]
                    .iter()
                    .all(|unit| unit::seconds(unit).is_some());
                let then = if of_time {
                    format!(": {} are understood", unit::TIMES)
                } else {
                    format!(" and give the model's constants in {file_unit}")
                };
                format!("convert the column, or write \"{column}\" {in_columns}{then}")
            }
        };
        self.said(names.namer, &mend)
    }
}

fn capital(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
