//! Errors of models, controllers, records and fits: each message names the object, the numbers that disagree and the correction, in one
//! line.

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An invalid polynomial, transfer function or sampling step.
    #[error(transparent)]
    Lti(#[from] ct_lti::Error),
    /// Error of the recursive least squares.
    #[error(transparent)]
    Rls(#[from] ct_rls::Error),
    /// A series or a setting that `ct-signals` refuses.
    #[error(transparent)]
    Signals(#[from] ct_signals::Error),
    /// A plant with more zeros than poles.
    #[error("the plant has B of degree {m} over A of degree {n}; choose m of at most {n}")]
    Improper {
        /// Degree of A.
        n: usize,
        /// Degree of B.
        m: usize,
    },
    /// A plant without dynamics (order 0).
    #[error("the plant has order n = 0; a plant needs at least one pole, n >= 1")]
    OrderZero,
    /// A vector that does not fit the orders.
    #[error("{what} has {found} entries, but {expected} are needed; give a1..an, then b0..bm")]
    Length {
        /// What was given.
        what: &'static str,
        /// Entries that are needed.
        expected: usize,
        /// Entries that were given.
        found: usize,
    },
    /// `a_n = 0`.
    #[error("a{n} is 0, so the plant is not of order {n}; give another value, or a lower order")]
    LeadingZero {
        /// The order asked for.
        n: usize,
    },
    /// A controller with more zeros than poles.
    #[error(
        "the controller has R of degree {r} over S of degree {s}; filter its derivative, so that R's degree is at most {s}"
    )]
    ImproperController {
        /// Degree of R.
        r: usize,
        /// Degree of S.
        s: usize,
    },
    /// A sensor's filter without a loop around it.
    #[error(
        "a sensor filter of {zeta} belongs to a loop, but there is no controller; apply the same filter to u and leave it out here"
    )]
    FilterWithoutLoop {
        /// Bandwidth of the filter \[1/time\].
        zeta: f64,
    },
    /// The loop's polynomial is not Hurwitz.
    #[error(
        "the loop is unstable: P = A S + B R has a root with real part {real_part:.3e}, but all have to be below 0; \
         check the controller's signs and units, or start from another plant"
    )]
    UnstableLoop {
        /// Real part of the rightmost root \[1/time\].
        real_part: f64,
    },
    /// A setting outside its range.
    #[error("{what} is {value}; it has to be {range}")]
    Setting {
        /// The setting.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Allowed range.
        range: &'static str,
    },
    /// No record is given.
    #[error("there is no record; give at least one")]
    NoRecord,
    /// A record of a loop without its reference.
    #[error(
        "{record}: there is no reference r, which drives the model in closed loop; give it, or fit in open loop from u, \
         in open loop, coloured noise fed back by the controller biases the estimates"
    )]
    MissingReference {
        /// The record's name.
        record: String,
    },
    /// A record of a plant alone without its input.
    #[error("{record}: there is no input u, which drives the model in open loop; give it")]
    MissingInput {
        /// The record's name.
        record: String,
    },
    /// A record without u for a regression.
    #[error(
        "{record}: there is no input u, which the regression for the initial model needs in closed loop too; add it, or give an initial model"
    )]
    RegressionWithoutInput {
        /// The record's name.
        record: String,
    },
    /// Signals of one record with different lengths.
    #[error(
        "{record}: {signal} has {found} samples but y has {expected}; give one for each instant"
    )]
    SignalLength {
        /// The record's name.
        record: String,
        /// `r` or `u`.
        signal: &'static str,
        /// Samples of y.
        expected: usize,
        /// Samples of the signal.
        found: usize,
    },
    /// NaN or an infinity in a record.
    #[error("{record}: {signal}[{index}] is {value}; replace it, or split the record there")]
    NotFinite {
        /// The record's name.
        record: String,
        /// `r`, `u` or `y`.
        signal: &'static str,
        /// Index from 0.
        index: usize,
        /// The value.
        value: f64,
    },
    /// Times that are not evenly spaced.
    #[error(
        "{record}: the step to time[{index}] is {step} s, elsewhere it is {expected} s; resample the record, or split it there"
    )]
    UnevenGrid {
        /// The record's name.
        record: String,
        /// Index of the later time.
        index: usize,
        /// The irregular step \[s\].
        step: f64,
        /// The median step \[s\].
        expected: f64,
    },
    /// An output without readings, or without readings that determine its level.
    #[error(
        "{record}: y has no readings{}; give a part of the record that has some",
        match all {
            true => String::new(),
            false => format!(" in the first {rows} rows, which determine its level"),
        }
    )]
    NoReading {
        /// The record's name.
        record: String,
        /// Rows without readings.
        rows: usize,
        /// Whether these are all.
        all: bool,
    },
    /// Gaps in y that are too long for the filters of a regression.
    #[error(
        "{record}: {:.0} % of the readings of y are missing, and only {left} of the {rows} rows are far enough after long gaps for filters on y; output error needs no such filters",
        100.0 * missing
    )]
    Gaps {
        /// The record's name.
        record: String,
        /// The share of y that is missing, 0 to 1.
        missing: f64,
        /// Rows that are left.
        left: usize,
        /// Rows in the record.
        rows: usize,
    },
    /// Instruments with a filter that is not the plant's own denominator, and missing readings.
    #[error(
        "readings of y are missing, and the filter of the instruments did not converge to A^: the standard errors cannot be computed"
    )]
    ErrorsOfOtherFilter,
    /// Too few samples for the parameters.
    #[error(
        "{samples} samples in all{}, but {needed} are needed for {parameters} parameters; give a longer record",
        match missing {
            0 => String::new(),
            missing => format!(", besides {missing} whose reading is missing"),
        }
    )]
    TooShort {
        /// Samples in all records, missing readings aside.
        samples: usize,
        /// Readings that are missing.
        missing: usize,
        /// Samples that are needed.
        needed: usize,
        /// Parameters, estimated offsets included.
        parameters: usize,
    },
    /// The signal that drives the model is constant.
    #[error(
        "{signal} is {value} throughout, in all records, so nothing can be learnt about the dynamics; record an experiment in which it moves"
    )]
    ConstantDrive {
        /// `r` or `u`.
        signal: &'static str,
        /// Value in the first record.
        value: f64,
    },
    /// The measured u is not the controller's output for r - y.
    #[error(
        "{record}: the measured u is not R/S (r - y): they differ by {mismatch:.3} rms where u moves by {size:.3} rms ({percent:.0} %); \
         check the controller's coefficients, their units of time, the sign, and that u is the command as it was recorded",
        percent = 100.0 * mismatch / size
    )]
    ControllerMismatch {
        /// The record's name.
        record: String,
        /// Root mean square of what the controller does not explain, unit of u.
        mismatch: f64,
        /// Standard deviation of u, unit of u.
        size: f64,
    },
    /// A parameter to be scaled that starts at 0.
    #[error(
        "theta[{index}] starts at 0, so theta0 (1 + delta) cannot move it; start it elsewhere, or iterate in theta"
    )]
    ZeroStart {
        /// Index of the parameter.
        index: usize,
    },
    /// The data do not determine all parameters.
    #[error(
        "{samples} samples do not determine {parameters} parameters: the output does not depend on some combination of them; lower the orders, or excite the loop more"
    )]
    NotDetermined {
        /// Parameters, estimated levels included.
        parameters: usize,
        /// Samples in all records.
        samples: usize,
    },
    /// Noise of another length than r.
    #[error("the noise has {found} samples but r has {expected}; give one for each")]
    NoiseLength {
        /// Samples of r.
        expected: usize,
        /// Samples of the noise.
        found: usize,
    },
    /// A loop with a sampled controller that is not stable.
    #[error(
        "the loop with a controller sampled every {period} has left the range of numbers; sample it faster, or lower its gain"
    )]
    Diverged {
        /// The controller's period \[time\].
        period: f64,
    },
    /// No regression gave a plant with a stable loop.
    #[error(
        "none of the plants from {tried} filter bandwidths has a stable loop; check the controller's sign and units, or give bandwidths lambda of 2 to 10 times the loop's poles"
    )]
    NoStart {
        /// Bandwidths that were tried.
        tried: usize,
    },
    /// The simulation overflowed.
    #[error(
        "the loop simulated at the start is not finite; check the units of the signals and the start"
    )]
    NotFiniteSimulation,
}
