//! Errors of a fit.

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

#[cfg(test)]
mod tests {
    use super::*;

    /// A caller of the library has neither options nor a model file; it may add where the constants are.
    #[test]
    fn a_message_names_nothing_of_the_program() {
        let said = Error::NoFiniteStart { starts: 12 }.to_string();
        assert!(said.ends_with("the constants"), "{said}");
    }
}
