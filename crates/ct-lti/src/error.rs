//! Errors of systems, settings and samples: each message names the object, the numbers that disagree and the correction, in one line.

/// Errors of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// NaN or an infinity where a number is needed.
    #[error("{what}: entry {index} is {value}; give finite numbers")]
    NotFinite {
        /// The object that was given.
        what: &'static str,
        /// Index of the entry, from 0.
        index: usize,
        /// Value of the entry.
        value: f64,
    },
    /// A polynomial without a coefficient other than zero, where one is needed.
    #[error("{what} is zero; give at least one coefficient that is not")]
    ZeroPolynomial {
        /// The polynomial or list in question.
        what: &'static str,
    },
    /// A transfer function with more zeros than poles.
    #[error(
        "the numerator has degree {numerator}, above the denominator's {denominator}: such a transfer function cannot be sampled; add poles"
    )]
    Improper {
        /// Degree of the numerator.
        numerator: usize,
        /// Degree of the denominator.
        denominator: usize,
    },
    /// A loop whose direct terms cancel the output's own coefficient.
    #[error(
        "the loop has no solution at infinite frequency: 1 + d1*d2 is {determinant}, with direct terms {forward} and {backward}; remove the direct term of one of the two systems"
    )]
    AlgebraicLoop {
        /// Direct term of the forward path.
        forward: f64,
        /// Direct term of the path back.
        backward: f64,
        /// `1 + forward*backward`.
        determinant: f64,
    },
    /// A length that does not fit the rest.
    #[error("{what} has {found} entries, but {expected} are needed")]
    Length {
        /// The quantity in question.
        what: &'static str,
        /// Entries that are needed.
        expected: usize,
        /// Entries that were given.
        found: usize,
    },
    /// A step of time that is no step.
    #[error("the step is {step}; give one that is finite and above 0")]
    Step {
        /// The step as given \[time\].
        step: f64,
    },
    /// A setting that has to be positive.
    #[error("{what} is {value}; give a finite number above 0")]
    NotPositive {
        /// The setting.
        what: &'static str,
        /// Value of the entry.
        value: f64,
    },
    /// A filter that is not asymptotically stable.
    #[error(
        "{what} has a root with real part {real_part}, but all of them have to be below 0; give another polynomial"
    )]
    NotHurwitz {
        /// The polynomial.
        what: &'static str,
        /// Real part of its rightmost root, to rounding \[1/time\].
        real_part: f64,
    },
    /// An order that is too small for what is asked.
    #[error("{what} has order {found}, but at least {needed} is needed")]
    Order {
        /// What was given.
        what: &'static str,
        /// Order that is needed.
        needed: usize,
        /// Order that was given.
        found: usize,
    },
    /// A root that would make a polynomial complex.
    #[error(
        "the root {re} + {im}j has no conjugate among the others; give both, or the coefficients would be complex"
    )]
    UnpairedRoot {
        /// Real part \[1/time\].
        re: f64,
        /// Imaginary part \[1/time\].
        im: f64,
    },
    /// Numbers that overflow.
    #[error("{what} overflows f64 (largest finite number 1.8e308); {mend}")]
    Overflow {
        /// The quantity in question.
        what: &'static str,
        /// The correction, in words.
        mend: &'static str,
    },
    /// The roots were not found.
    #[error(
        "the roots of a polynomial of degree {degree} were not found in {iterations} iterations; scale the time so that the roots are near 1"
    )]
    NoConvergence {
        /// Degree of the polynomial.
        degree: usize,
        /// Iterations spent.
        iterations: usize,
    },
}

/// Refuses the first entry that is not finite.
pub(crate) fn finite(what: &'static str, values: &[f64]) -> Result<(), Error> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(Error::NotFinite {
            what,
            index,
            value: values[index],
        }),
        None => Ok(()),
    }
}
