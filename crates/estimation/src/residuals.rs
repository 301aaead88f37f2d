//! Least-squares problem: residuals with their Jacobian, and the R factor that a fit computes from them.

use ct_signals::Whitener;

use crate::{Noise, Prior, Rows, Squares, Triangle, prior::prior_rows};

/// Larger than the differences of sums of squares over a record in another order of summation.
const ROUNDING: f64 = 1e-9;
/// With several outputs, the cost is checked after this number of samples.
const LOOK: usize = 64;

/// Properties of a sample that are known before the simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// Number of the output, from zero.
    pub output: usize,
    /// The sample is the first one of its series.
    pub first: bool,
    /// The sample is missing: the row has no residual.
    pub missing: bool,
}

/// A model against measurements: residuals, measured minus model, with their Jacobian.
///
/// The vector holds free entries, which are fitted, and fixed ones. Samples of several outputs may come in any order, as long as those of
/// one output come in that of time, record by record.
pub trait Residuals: Sync {
    /// Positions of the entries that are fitted.
    fn free(&self) -> &[usize];

    /// Bounds of all entries.
    fn bounds(&self) -> &[(f64, f64)];

    /// Number of samples of each output without missing ones.
    fn samples(&self) -> &[usize];

    /// Passes every row `[d model/d x_free, measured - model]` with the properties of its sample to `each`, until `each` returns false;
    /// then the result is `None`, as for a model that is not finite.
    fn each_row(&self, x: &[f64], each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()>;

    /// Rows of the residual alone. The default computes the derivatives too; a model that is faster without them replaces it.
    fn each_residual(
        &self,
        x: &[f64],
        mut each: impl FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        let last = self.free().len();
        self.each_row(x, |sample, row| each(sample, &mut row[last..]))
    }

    /// BIC penalty of the fitted parameters, with this number of noise coefficients: the logarithm of the number of samples for each
    /// parameter, including the scales of the outputs' noise.
    fn bic_penalty(&self, noise_order: usize) -> f64 {
        let samples: usize = self.samples().iter().sum();
        let fitted = self.free().len() + self.samples().len() + noise_order;
        fitted as f64 * (samples as f64).ln()
    }

    /// Lower bound for the noise standard deviation of this output if there are several outputs \[output unit\].
    fn floor(&self, _output: usize) -> f64 {
        0.0
    }

    /// Standard deviations of the outputs' noise, if known: outputs are weighted by these, and not by their residuals.
    fn known_scales(&self) -> Option<&[f64]> {
        None
    }

    /// Priors of parameters. Priors of parameters that are not fitted have no influence.
    fn priors(&self) -> &[Prior] {
        &[]
    }

    /// The time limit is reached: no further step is taken.
    fn out_of_time(&self) -> bool {
        false
    }
}

/// Whitens rows as they come and adds up the squares of their residuals, until these cost more than a limit.
struct Filter {
    whiteners: Vec<Whitener>,
    squares: Squares,
    limit: f64,
    seen: usize,
}

impl Filter {
    fn new(model: &impl Residuals, x: &[f64], noise: &Noise, columns: usize, limit: f64) -> Self {
        Self {
            whiteners: noise.whiteners(columns),
            squares: Squares::of(model, x),
            // The cost of the R factor is a sum in another order.
            limit: limit * (1.0 + ROUNDING),
            seen: 0,
        }
    }

    /// Whitens a row in place; `false` where it is missing.
    fn push(&mut self, sample: Sample, row: &mut [f64]) -> bool {
        let whitener = &mut self.whiteners[sample.output];
        if sample.first {
            whitener.reset();
        }
        if sample.missing {
            whitener.skip();
            return false;
        }
        whitener.push(row);
        if let Some(residual) = row.last() {
            self.squares.sums[sample.output] += residual * residual;
        }
        self.seen += 1;
        true
    }

    /// The cost may still be within the limit.
    fn within(&self) -> bool {
        let several = self.squares.sums.len() > 1;
        (several && !self.seen.is_multiple_of(LOOK)) || self.squares.cost() <= self.limit
    }
}

/// The R factor of the rows, whitened by the noise model and weighted by outputs according to their residuals ([`Squares::weights`]), so
/// that its cost is [`Squares::cost`]; `None` if the model is not finite.
#[must_use]
pub fn linearise(model: &impl Residuals, x: &[f64], noise: &Noise) -> Option<Triangle> {
    linearise_below(model, x, noise, f64::INFINITY)
}

/// As `linearise`; also `None` if the cost exceeds a limit, which is usually known long before the last sample.
#[must_use]
pub fn linearise_below(
    model: &impl Residuals,
    x: &[f64],
    noise: &Noise,
    limit: f64,
) -> Option<Triangle> {
    let columns = model.free().len() + 1;
    let mut triangles = vec![Triangle::new(columns); model.samples().len()];
    let mut filter = Filter::new(model, x, noise, columns, limit);
    model.each_row(x, |sample, row| {
        if filter.push(sample, row) {
            triangles[sample.output].push(row);
            return filter.within();
        }
        true
    })?;
    for triangle in &mut triangles {
        triangle.finish();
    }
    let priors = prior_rows(model, x);
    let cost = filter.squares.cost();
    (cost <= filter.limit && cost.is_finite())
        .then(|| Triangle::of_outputs(triangles, &priors, filter.squares))
}

/// Whether the cost is above a limit, or not finite.
#[must_use]
pub fn costs_more(model: &impl Residuals, x: &[f64], noise: &Noise, limit: f64) -> bool {
    let mut filter = Filter::new(model, x, noise, 1, limit);
    let within = model.each_residual(x, |sample, row| {
        !filter.push(sample, row) || filter.within()
    });
    // A NaN cost is above every limit.
    let cost = filter.squares.cost();
    within.is_none() || cost.is_nan() || cost > filter.limit
}

/// The sums of squares of the whitened residuals of each output; `None` where the model is not finite.
#[must_use]
pub fn squares(model: &impl Residuals, x: &[f64], noise: &Noise) -> Option<Squares> {
    let mut filter = Filter::new(model, x, noise, 1, f64::INFINITY);
    model.each_residual(x, |sample, row| {
        filter.push(sample, row);
        true
    })?;
    Some(filter.squares)
}

/// The rows of all samples without weighting, for one output of a record after the other; `None` if the model is not finite.
#[must_use]
pub fn rows(model: &impl Residuals, x: &[f64]) -> Option<Rows> {
    let columns = model.free().len() + 1;
    let mut collected = Collected::new(model, columns);
    model.each_row(x, |sample, row| collected.push(sample, row))?;
    let mut rows = collected.rows();
    rows.priors = prior_rows(model, x);
    Some(rows)
}

/// The residuals, measured minus model, series by series, NaN if the sample is missing; `None` if the model is not finite.
#[must_use]
pub fn residuals(model: &impl Residuals, x: &[f64]) -> Option<Vec<Vec<f64>>> {
    let mut collected = Collected::new(model, 1);
    model.each_residual(x, |sample, row| collected.push(sample, row))?;
    Some(collected.rows().residuals())
}

/// Rows that come in any order of outputs, sorted by series.
struct Collected {
    rows: Rows,
    /// Results of the present record for each output.
    own: Vec<Vec<f64>>,
}

impl Collected {
    fn new(model: &impl Residuals, columns: usize) -> Self {
        let outputs = model.samples().len();
        let samples: usize = model.samples().iter().sum();
        Self {
            rows: Rows {
                columns,
                outputs,
                lengths: Vec::new(),
                priors: Vec::new(),
                values: Vec::with_capacity(samples * columns),
            },
            own: vec![Vec::new(); outputs],
        }
    }

    fn push(&mut self, sample: Sample, row: &[f64]) -> bool {
        if sample.first && !self.own[sample.output].is_empty() {
            self.end_record();
        }
        self.own[sample.output].extend_from_slice(row);
        true
    }

    fn end_record(&mut self) {
        for series in &mut self.own {
            self.rows.lengths.push(series.len() / self.rows.columns);
            self.rows.values.append(series);
        }
    }

    fn rows(mut self) -> Rows {
        self.end_record();
        self.rows
    }
}
