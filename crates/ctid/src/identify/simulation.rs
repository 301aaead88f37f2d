//! What the final model says from the input alone.

use ct_lti::{Simulator, StateSpace, TransferFunction};
use nalgebra::{DMatrix, DVector};

use super::Order;
use super::scaled::Scaled;
use crate::Error;

/// A free response that still counts for this part of itself at the end of the record.
const LASTING: f64 = 0.2;

/// The simulated output in its unit, from an initial state that is fitted; a warning where that state explains what it should not.
pub(super) fn simulate(
    scaled: &Scaled,
    order: Order,
    theta: &DVector<f64>,
) -> Result<(Vec<f64>, Option<String>), Error> {
    let (a, rest) = theta.as_slice().split_at(order.n);
    let (b, offset) = rest.split_at(order.m + 1);
    let denominator: Vec<f64> = std::iter::once(1.0).chain(a.iter().copied()).collect();
    let model = StateSpace::controllable(&TransferFunction::from_coefficients(b, &denominator)?)?;
    let first = scaled.u.first().copied().unwrap_or(0.0);
    let rest = b[0] * first + offset.first().copied().unwrap_or(0.0);
    let forced = response(scaled, &model, |k| scaled.u[k] - first, None)?;
    let free: Vec<Vec<f64>> = (0..order.n)
        .map(|state| response(scaled, &model, |_| 0.0, Some(state)))
        .collect::<Result<_, _>>()?;
    let count = scaled.y.len();
    // each of size 1, so that none is lost beside another
    let sizes: Vec<f64> = free
        .iter()
        .map(|f| {
            f.iter()
                .map(|x| x * x)
                .sum::<f64>()
                .sqrt()
                .max(f64::MIN_POSITIVE)
        })
        .collect();
    let columns = DMatrix::from_fn(count, order.n, |k, state| free[state][k] / sizes[state]);
    let left = DVector::from_fn(count, |k, _| scaled.y[k] - rest - forced[k]);
    let normal = columns.tr_mul(&columns);
    let initial = normal
        .pseudo_inverse(1e-9)
        .map(|inverse| inverse * columns.tr_mul(&left))
        .unwrap_or_else(|_| DVector::zeros(order.n));
    let fading = &columns * initial;
    let lasting = fading.iter().rev().take(count.div_ceil(10));
    let at_end = lasting.fold(0.0_f64, |most, x| most.max(x.abs()));
    let warning = (at_end > LASTING).then(|| {
        "the model is so slow that its initial state is still seen at the end of the record: record longer".to_owned()
    });
    let simulated = (0..count).map(|k| scaled.output(rest + forced[k] + fading[k]));
    Ok((simulated.collect(), warning))
}

/// Output of the model, from rest or from one state.
fn response(
    scaled: &Scaled,
    model: &StateSpace,
    input: impl Fn(usize) -> f64,
    state: Option<usize>,
) -> Result<Vec<f64>, Error> {
    let mut simulator = Simulator::new(model.clone(), scaled.hold);
    if let Some(state) = state {
        let mut start = vec![0.0; model.order()];
        start[state] = 1.0;
        simulator.set_state(&start)?;
    }
    let mut output = Vec::with_capacity(scaled.time.len());
    for (k, step) in scaled.steps().enumerate() {
        output.push(simulator.update(input(k), step)?);
    }
    Ok(output)
}
