//! The methods.

use serde::Serialize;

/// Estimation method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Recursive output error, stabilised by an adaptive error filter with bounds
    StabilizedOe,
    /// Recursive least squares on the filtered equation
    CtRls,
    /// Least squares on filtered signals, of the whole record: biased by noise, useful as a start for the others
    Ls,
    /// Instruments simulated in the loop, of the whole record
    Iv,
    /// Closed-loop output error of the whole record: the loop is simulated from the reference; without a controller output error
    Fcloe,
    /// Closed-loop output error, recursive
    RecursiveFcloe,
    /// Refined instrumental variables for white noise; in a loop with a reference the instruments come from the reference, and no
    /// controller is needed (CLSRIVC)
    Srivc,
    /// Refined instruments with an autoregressive model of the noise (CLRIVC in a loop)
    Rivc,
}

impl Method {
    /// Name as typed.
    pub fn id(self) -> &'static str {
        match self {
            Self::StabilizedOe => "stabilized-oe",
            Self::CtRls => "ct-rls",
            Self::Ls => "ls",
            Self::Iv => "iv",
            Self::Fcloe => "fcloe",
            Self::RecursiveFcloe => "recursive-fcloe",
            Self::Srivc => "srivc",
            Self::Rivc => "rivc",
        }
    }

    /// Whether the method uses the loop's controller.
    pub fn is_of_loop(self) -> bool {
        !matches!(self, Self::StabilizedOe | Self::CtRls) && !self.is_refined()
    }

    /// Whether the method is SRIVC or RIVC: with delays, integrators, a second input, several records.
    pub fn is_refined(self) -> bool {
        matches!(self, Self::Srivc | Self::Rivc)
    }
}
