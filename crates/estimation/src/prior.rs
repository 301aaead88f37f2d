//! Prior knowledge of a parameter: a measured value with a standard error.
//!
//! A prior is one more row of the least squares: it is added to the logarithm of the likelihood as a Gaussian reading of the entry with a
//! known variance, independent of the records ([`crate::Squares`] has the cost).

use crate::Residuals;

/// A measured value of a parameter that does not come from the records.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Position of the entry in the vector.
    pub entry: usize,
    /// Measured value \[unit of the entry\].
    pub value: f64,
    /// Standard error of the value, above zero \[unit of the entry\].
    pub std_error: f64,
}

/// A start further than this number of standard errors from a prior is moved to this distance: the cost of a prior grows exponentially.
const FARTHEST_START: f64 = 5.0;

impl Prior {
    /// The prior less the entry, in standard errors.
    #[must_use]
    pub fn residual(&self, x: &[f64]) -> f64 {
        (self.value - x[self.entry]) / self.std_error
    }

    /// Whether values near the prior are within bounds.
    #[must_use]
    pub fn is_within(&self, bounds: (f64, f64)) -> bool {
        let nearest = crate::within(self.value, bounds);
        (nearest - self.value).abs() <= FARTHEST_START * self.std_error
    }

    /// A start for the entry: `x` where it is near.
    pub(crate) fn near(&self, x: f64) -> f64 {
        let reach = FARTHEST_START * self.std_error;
        crate::within(x, (self.value - reach, self.value + reach))
    }
}

/// Moves fitted entries of a start that are far from their priors to near the priors.
pub fn begin_near_priors(model: &impl Residuals, x: &mut [f64]) {
    for (_, prior) in free_priors(model) {
        x[prior.entry] = prior.near(x[prior.entry]);
    }
}

/// The priors of entries that are fitted, each with the column of its entry.
pub(crate) fn free_priors(model: &impl Residuals) -> impl Iterator<Item = (usize, &Prior)> {
    let column = |entry: usize| model.free().iter().position(|&free| free == entry);
    model
        .priors()
        .iter()
        .filter_map(move |prior| Some((column(prior.entry)?, prior)))
}

/// The rows of the priors at `x` in standard errors, with as many columns as a sample's.
pub(crate) fn prior_rows(model: &impl Residuals, x: &[f64]) -> Vec<Vec<f64>> {
    let columns = model.free().len() + 1;
    let row = |(column, prior): (usize, &Prior)| {
        let mut row = vec![0.0; columns];
        row[column] = 1.0 / prior.std_error;
        row[columns - 1] = prior.residual(x);
        row
    };
    free_priors(model).map(row).collect()
}
