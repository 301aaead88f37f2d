//! Errors of a fit.

use ct_signals::Names;

/// Error of a fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A series cannot be used.
    #[error(transparent)]
    Series(#[from] ct_signals::Error),
    /// No start gave a finite simulation.
    #[error(
        "none of {starts} starts gave a finite simulation: check the units of the data and the constants"
    )]
    NoFiniteStart {
        /// Number of starts.
        starts: usize,
    },
}

impl Error {
    /// The message with the caller's names for what it has to change; `known`: where the constants of a model are given, with a blank before
    /// it, or empty.
    #[must_use]
    pub fn worded(&self, records: &Names, known: &str) -> String {
        match self {
            Self::Series(error) => error.worded(records),
            // Its message ends with the constants.
            Self::NoFiniteStart { .. } => format!("{self}{known}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A caller of the library has neither options nor a model file; it may add where the constants are.
    #[test]
    fn a_message_names_nothing_of_the_program() {
        let said = Error::NoFiniteStart { starts: 12 }.to_string();
        assert!(said.ends_with("the constants"), "{said}");
    }

    #[test]
    fn a_message_has_the_names_of_the_caller() {
        let said = Error::NoFiniteStart { starts: 12 }.worded(&Names::LIBRARY, " <known>");
        assert!(said.ends_with("the constants <known>"), "{said}");
        let names = Names {
            in_columns: "<in columns>",
            ..Names::LIBRARY
        };
        let series = Error::from(ct_signals::Error::ConstantOutput {
            file: "a.csv".into(),
            column: "y".into(),
            value: 1.0,
            rows: 9,
        });
        let said = series.worded(&names, "");
        assert!(said.contains("<in columns>"), "{said}");
    }
}
