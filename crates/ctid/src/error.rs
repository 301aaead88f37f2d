//! Errors of the program: every message is one line that names the place and the correction.

use std::path::Path;

use ct_signals::escaped;

use crate::MessageNames;

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
    /// A setting; the message begins with its name, which is that of the option.
    #[error("{}", self.worded(&MessageNames::PROGRAM))]
    Setting(String),
    /// A record.
    #[error("{}", self.worded(&MessageNames::PROGRAM))]
    Record(#[from] ct_signals::Error),
    /// A plant and its effects.
    #[error("{}", self.worded(&MessageNames::PROGRAM))]
    Plant(#[from] plants::Error),
    /// The computation.
    #[error("{}", self.worded(&MessageNames::PROGRAM))]
    Diagnosis(#[from] missing_effect::Error),
    /// A fit or a search with the records of a file, or of several.
    #[error("{}", self.worded(&MessageNames::PROGRAM))]
    Fit {
        /// The names of the records.
        file: String,
        /// What is wrong and the correction.
        source: Box<effect_search::Error>,
    },
    /// A search, without the names of records.
    #[error("{}", self.worded(&MessageNames::PROGRAM))]
    Search(Box<effect_search::Error>),
    /// An experiment with a model of the user's own.
    #[error("{}", self.worded(&MessageNames::PROGRAM))]
    Experiment(#[from] effect_search::design::NoExperiment),
    /// An experiment with a plant.
    #[error("{}", self.worded(&MessageNames::PROGRAM))]
    PlantExperiment(#[from] missing_effect::design::NoExperiment),
    /// An identification, with the name of its record.
    #[error("{}", self.worded(&MessageNames::PROGRAM))]
    Identification(Box<linear_identification::Error>),
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
                Self::Setting(error.to_string())
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
            error @ (E::StabilityBorder { .. }
            | E::MissingReadings { .. }
            | E::InRecord { .. }
            | E::ControllerMismatch { .. }
            | E::FirstFit { .. }) => Self::Identification(Box::new(error)),
            // The message begins with the setting's name, which is the name of the option.
            E::NotPositive { .. } | E::Bandwidth { .. } | E::LevelsEstimated { .. } => {
                Self::Setting(message)
            }
            _ => Self::Usage(message),
        }
    }
}

impl Error {
    /// The message with these names for what the user gave.
    #[must_use]
    pub fn worded(&self, names: &MessageNames) -> String {
        match self {
            Self::Setting(message) => format!("{}{message}", names.setting),
            Self::Record(error) => error.worded(&names.fit.records),
            Self::Plant(error) => error.worded(&names.fit.plants),
            Self::Diagnosis(error) => error.worded(&names.fit),
            Self::Fit { file, source } => format!("{file}: {}", source.worded(&names.fit)),
            Self::Search(error) => error.worded(&names.fit),
            Self::Experiment(refused) => (names.experiment)(refused),
            Self::PlantExperiment(refused) => (names.plant_experiment)(refused),
            Self::Identification(error) => match &**error {
                linear_identification::Error::FirstFit { .. } => {
                    format!("{error}{}", names.part_or_grid)
                }
                _ => error.worded(names.controller),
            },
            Self::AtLine { .. }
            | Self::Text { .. }
            | Self::File { .. }
            | Self::Changed { .. }
            | Self::UnknownEffect(_)
            | Self::Usage(_)
            | Self::Columns(_)
            | Self::Estimator(_)
            | Self::Linear(_)
            | Self::Loop(_)
            | Self::Output(_) => self.to_string(),
        }
    }

    /// An error of a fit with the record of a file.
    pub(crate) fn fit(path: &Path, error: impl Into<effect_search::Error>) -> Self {
        Self::Fit {
            file: path.display().to_string(),
            source: Box::new(error.into()),
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
