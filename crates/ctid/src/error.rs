//! Errors of the program: every message is one line that names the place and the correction.

use std::path::Path;

use ct_signals::escaped;

/// All errors that end the program with exit code 2.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An error at a line of a file.
    #[error("{file}:{line}: {what}")]
    AtLine {
        /// The path as it was given.
        file: String,
        /// Line number, from 1.
        line: usize,
        /// The error and the correction.
        what: String,
    },
    /// A model's text.
    #[error("{file}:{source}")]
    Text {
        /// The path as it was given.
        file: String,
        /// Line, column, what is wrong and the correction.
        source: ct_model::TextError,
    },
    /// An error about a file as a whole.
    #[error("{file}: {what}")]
    File {
        /// The path as it was given.
        file: String,
        /// The error and the correction.
        what: String,
    },
    /// Another program changed the file between reading and writing.
    #[error("{file}: {what}")]
    Changed {
        /// The path as it was given.
        file: String,
        /// The change and the correction.
        what: String,
    },
    /// No effect has this name.
    #[error("{0}")]
    UnknownEffect(String),
    /// The command line combines options that exclude each other.
    #[error("{0}")]
    Usage(String),
    /// The columns of a record that an option names.
    #[error("{0}")]
    Columns(String),
    /// A record.
    #[error(transparent)]
    Record(#[from] ct_signals::Error),
    /// A plant and its effects.
    #[error(transparent)]
    Plant(#[from] plants::Error),
    /// The computation.
    #[error(transparent)]
    Diagnosis(#[from] missing_effect::Error),
    /// A recursive estimator.
    #[error(transparent)]
    Estimator(#[from] stabilized_oe::Error),
    /// A linear model.
    #[error(transparent)]
    Linear(#[from] ct_lti::Error),
    /// A linear model in a loop.
    #[error(transparent)]
    Loop(#[from] fcloe::Error),
    /// Standard output cannot be written.
    #[error("cannot write to standard output: {0}")]
    Output(#[from] std::io::Error),
}

impl From<ct_rls::Error> for Error {
    fn from(error: ct_rls::Error) -> Self {
        Self::Estimator(error.into())
    }
}

impl From<paper_tables::Error> for Error {
    fn from(error: paper_tables::Error) -> Self {
        use paper_tables::Error as E;
        match error {
            E::Signals(error) => Self::Record(error),
            E::Plant(error) => Self::Plant(error),
            E::Estimator(error) => Self::Estimator(error),
            E::Linear(error) => Self::Linear(error),
            E::Loop(error) => Self::Loop(error),
            // The message begins with the argument's name, which is the name of the option.
            E::TooFewRunsForRange { .. } | E::TooFewRunsForVariance { .. } => {
                Self::Usage(format!("--{error}"))
            }
            error => Self::Usage(error.to_string()),
        }
    }
}

impl From<linear_identification::Error> for Error {
    fn from(error: linear_identification::Error) -> Self {
        use linear_identification::Error as E;
        let message = error.to_string();
        match error {
            E::Signals(error) => Self::Record(error),
            E::Estimator(error) => Self::Estimator(error),
            E::Linear(error) => Self::Linear(error),
            E::Loop(error) => Self::Loop(error),
            E::StabilityBorder { record }
            | E::ControllerMismatch { record, .. }
            | E::MissingReadings { record, .. }
            | E::InRecord { record, .. } => Self::of_record(record, &message, ""),
            E::FirstFit { record, .. } => {
                Self::of_record(record, &message, ": --from and --to, or --resample")
            }
            // The message begins with the setting's name, which is the name of the option.
            E::NotPositive { .. } | E::Bandwidth { .. } | E::LevelsEstimated { .. } => {
                Self::Usage(format!("--{message}"))
            }
            _ => Self::Usage(message),
        }
    }
}

/// Where more time may help.
const MORE_TIME: &str = "--effort thorough searches longer";

impl From<missing_effect::design::NoExperiment> for Error {
    fn from(refused: missing_effect::design::NoExperiment) -> Self {
        use missing_effect::design::NoExperiment as No;
        Self::Usage(match &refused {
            // The message begins with the argument's name, which is the name of the option.
            No::SameEffect { .. }
            | No::Range { .. }
            | No::TooWide { .. }
            | No::Beyond { .. }
            | No::Duration { .. }
            | No::TooLong { .. }
            | No::Slew { .. } => format!("--{refused}"),
            No::NoRange { .. } | No::Overfull { .. } => format!("{refused} with --range"),
            No::NoFit { effect } => needs(&refused.to_string(), effect),
            No::OutOfTime => format!("{refused}: {MORE_TIME}"),
            _ => refused.to_string(),
        })
    }
}

impl From<effect_search::design::NoExperiment> for Error {
    fn from(refused: effect_search::design::NoExperiment) -> Self {
        use effect_search::design::NoExperiment as No;
        Self::Usage(match &refused {
            // The message begins with the argument's name, which is the name of the option.
            No::SameEffect { .. }
            | No::UnknownInput { .. }
            | No::Range { .. }
            | No::Duration { .. }
            | No::Slew { .. } => format!("--{refused}"),
            No::NoRange { input, .. } => format!("{refused} with --input {input}=LOW..HIGH"),
            No::InModel { effect } => {
                format!("{refused}: `ctid remove '{effect}' --model M.toml`")
            }
            No::NoFit { effect } => needs(&refused.to_string(), effect),
            No::OutOfTime => format!("{refused}: {MORE_TIME}"),
            _ => refused.to_string(),
        })
    }
}

/// A message about an effect, with the command that says more of it.
fn needs(message: &str, effect: &str) -> String {
    format!("{message}; `ctid effects '{effect}'` says what it needs")
}

impl Error {
    /// A message that begins with the name of a record, and what the program adds to it.
    fn of_record(record: String, message: &str, options: &str) -> Self {
        let what = message.strip_prefix(&format!("{record}: "));
        Self::File {
            what: format!("{}{options}", what.unwrap_or(message)),
            file: record,
        }
    }

    /// An error about a file as a whole.
    pub(crate) fn file(path: &Path, what: impl Into<String>) -> Self {
        Self::File {
            file: path.display().to_string(),
            what: what.into(),
        }
    }
}

/// A message on one line, without what would steer the terminal or turn the direction of the text: files and their names are quoted
/// in messages, whatever they hold.
#[must_use]
pub fn one_line(message: &str) -> String {
    let mut line = String::with_capacity(message.len());
    for part in message.lines().map(str::trim).filter(|l| !l.is_empty()) {
        if !line.is_empty() {
            line += if line.ends_with([':', ';', ',']) {
                " "
            } else {
                "; "
            };
        }
        line += &escaped(part);
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_of_printable_text() {
        let usage = "error: no such option\n\n  tip: another one\n\nUsage: ctid\n";
        assert_eq!(
            one_line(usage),
            "error: no such option; tip: another one; Usage: ctid"
        );
        assert_eq!(
            one_line("these are missing:\n  --model <M>\n"),
            "these are missing: --model <M>"
        );
        assert_eq!(
            one_line("a \u{1b}[31mred\r cell \u{202e}"),
            "a \\u{1b}[31mred\\r cell \\u{202e}"
        );
    }
}
