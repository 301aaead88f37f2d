//! Separation of two models by an experiment: the least misfit of one model to the response of the other.
//!
//! Let A be true. The experiment shows `y_A + v`. Model B answers with the parameters that imitate `y_A` best, but it still has to fit the
//! existing record, and its initial states are free. In the weighting by the noise model, linearised at B's fit:
//! ```text
//! lambda_A = min over d, l of  ( |y_A - y_B - J d - L l|^2 + |R d|^2 ) / sigma^2
//! ```
//! `J` the derivatives with respect to B's parameters, `L` to its initial states in the experiment, `R'R` the information of
//! the existing record on the parameters, its own initial states eliminated. `lambda` is a noncentrality: by so much the deviance of
//! B is above that of A on average, and its standard deviation is `2 sqrt(lambda)`, as twice the logarithm of a likelihood ratio
//! of two fixed means has it.

use estimation::Triangle;

/// A model's information on its free parameters from records: rows `[R | 0]`, the initial states eliminated. `rows`: its fit to them,
/// linearised, a column for each of `free` and the residual; the first `parameters` entries of its vector are parameters.
#[must_use]
pub fn information(rows: &Triangle, free: &[usize], parameters: usize) -> Triangle {
    let (parameters, states): (Vec<usize>, Vec<usize>) =
        (0..free.len()).partition(|&column| free[column] < parameters);
    let order: Vec<usize> = states.iter().chain(&parameters).copied().collect();
    let all = rows.select(&order);
    let mut own = Triangle::new(parameters.len());
    for i in states.len()..order.len() {
        let row: Vec<f64> = (states.len()..order.len()).map(|j| all.at(i, j)).collect();
        own.push(&row);
    }
    own.finish();
    own
}

/// The least of `|rows|^2` over the first columns, with the information on the leading ones added; the last column is the residual.
#[must_use]
pub fn least(rows: &Triangle, known: &Triangle) -> f64 {
    let columns = rows.columns();
    let mut all = Triangle::new(columns);
    let mut row = vec![0.0; columns];
    for i in 0..columns {
        for (j, value) in row.iter_mut().enumerate() {
            *value = rows.at(i, j);
        }
        all.push(&row);
    }
    for i in 0..known.columns() {
        row.fill(0.0);
        for (j, value) in row[..known.columns()].iter_mut().enumerate() {
            *value = known.at(i, j);
        }
        all.push(&row);
    }
    all.finish();
    let free: Vec<usize> = (0..columns - 1).collect();
    let step = all.solve(&free, &[], 0.0);
    all.predicted(&step)
}
