//! Simulation of a linear model from the input alone.

use ct_lti::{Hold, Simulator, StateSpace, TransferFunction};
use nalgebra::{DMatrix, DVector};

use super::scaled::Scaled;
use crate::{Error, Order, Warning};

/// A free response is significant if this share of it is present at the end of the record.
const LASTING: f64 = 0.2;

/// The simulated output in its unit, from a fitted initial state; with a warning if this state explains too much.
pub(super) fn simulate(
    scaled: &Scaled,
    order: Order,
    theta: &DVector<f64>,
) -> Result<(Vec<f64>, Option<Warning>), Error> {
    let (a, rest) = theta.as_slice().split_at(order.n);
    let (b, offset) = rest.split_at(order.m + 1);
    let driven = Driven {
        time: scaled.time.clone(),
        hold: scaled.hold,
        u: &scaled.u,
        y: &scaled.y,
    };
    let offset = offset.first().copied().unwrap_or(0.0);
    let Response { forced, fading } = driven.respond(a, b, offset)?;
    let lasting = fading.iter().rev().take(fading.len().div_ceil(10));
    let at_end = lasting.fold(0.0_f64, |most, x| most.max(x.abs()));
    let warning = (at_end > LASTING).then_some(Warning::InitialStateLasts { share: at_end });
    let simulated = forced
        .iter()
        .zip(&fading)
        .map(|(a, b)| scaled.output(a + b));
    Ok((simulated.collect(), warning))
}

/// A record of one input and one output.
struct Driven<'a> {
    time: Vec<f64>,
    hold: Hold,
    u: &'a [f64],
    /// NaN where its reading is missing.
    y: &'a [f64],
}

/// A simulated output: the response to the input, and that to the initial state.
struct Response {
    forced: Vec<f64>,
    fading: Vec<f64>,
}

impl Driven<'_> {
    fn respond(&self, a: &[f64], b: &[f64], offset: f64) -> Result<Response, Error> {
        let denominator: Vec<f64> = std::iter::once(1.0).chain(a.iter().copied()).collect();
        let model =
            StateSpace::controllable(&TransferFunction::from_coefficients(b, &denominator)?)?;
        let first = self.u.first().copied().unwrap_or(0.0);
        let rest = b[0] * first + offset;
        let mut forced = self.response(&model, |k| self.u[k] - first, None)?;
        forced.iter_mut().for_each(|y| *y += rest);
        let free: Vec<Vec<f64>> = (0..a.len())
            .map(|state| self.response(&model, |_| 0.0, Some(state)))
            .collect::<Result<_, _>>()?;
        let count = self.y.len();
        // each is scaled to 1, so that none is lost by rounding
        let sizes: Vec<f64> = free
            .iter()
            .map(|f| f.iter().map(|x| x * x).sum::<f64>().sqrt())
            .map(|size| size.max(f64::MIN_POSITIVE))
            .collect();
        let columns = DMatrix::from_fn(count, free.len(), |k, i| free[i][k] / sizes[i]);
        let left = DVector::from_fn(count, |k, _| self.y[k] - forced[k]);
        let fit = |columns: &DMatrix<f64>, left: &DVector<f64>| {
            let normal = columns.tr_mul(columns);
            normal
                .pseudo_inverse(1e-9)
                .map(|inverse| inverse * columns.tr_mul(left))
                .unwrap_or_else(|_| DVector::zeros(free.len()))
        };
        let there: Vec<usize> = (0..count).filter(|k| !self.y[*k].is_nan()).collect();
        let initial = match there.len() == count {
            true => fit(&columns, &left),
            false => fit(&columns.select_rows(&there), &left.select_rows(&there)),
        };
        let fading = (&columns * initial).as_slice().to_vec();
        Ok(Response { forced, fading })
    }

    /// Output of the model, from rest or from one state.
    fn response(
        &self,
        model: &StateSpace,
        input: impl Fn(usize) -> f64,
        state: Option<usize>,
    ) -> Result<Vec<f64>, Error> {
        let mut simulator = Simulator::new(model.clone(), self.hold);
        if let Some(state) = state {
            let mut start = vec![0.0; model.order()];
            start[state] = 1.0;
            simulator.set_state(&start)?;
        }
        let mut output = Vec::with_capacity(self.time.len());
        let mut before = self.time.first().copied().unwrap_or(0.0);
        for (k, &t) in self.time.iter().enumerate() {
            output.push(simulator.update(input(k), t - before)?);
            before = t;
        }
        Ok(output)
    }
}
