//! Derivatives by the parameters of effects, against differences.

use ct_model::effects::{Candidate, Role, apply};
use ct_model::{Dual, Model, Scalar};

use super::driven::{Driven, active, range};

/// Derivatives by the parameters of the effect at a point against differences: central ones, or to one side at a bound.
fn check_derivatives(driven: &Driven, candidate: &Candidate, at: &[f64], tolerance: f64) {
    const LANES: usize = 4;
    let model = Model::new(apply(&driven.spec, &[candidate]).unwrap());
    let first = driven.spec.parameters.len();
    let mut parameters = model.parameters();
    parameters[first..first + at.len()].copy_from_slice(at);
    let plain = driven.run(&model, &parameters);
    let scale = range(&plain);
    let mut corners = 0;
    for (i, own) in candidate.parameters.iter().enumerate() {
        // The staircase has no derivatives; those of a smooth one are compared in another test.
        if own.role == Role::Choice || candidate.id.starts_with("quantisation") {
            continue;
        }
        let duals: Vec<Dual<LANES>> = parameters
            .iter()
            .enumerate()
            .map(|(k, value)| {
                if k == first + i {
                    Dual::variable(*value, 0)
                } else {
                    Dual::constant(*value)
                }
            })
            .collect();
        let exact = driven.run(&model, &duals);
        let typical = own.starts.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        // The one start may be zero.
        let typical = if typical > 0.0 { typical } else { own.bounds.1 };
        // Near a limit a short step, and where the flow has a root of the height: there the error of a difference falls slowly with the step.
        let has_root = candidate
            .effect
            .is_some_and(|effect| effect.id == "leak_at_height");
        let share = if own.role == Role::Threshold || has_root {
            1e-5
        } else {
            1e-4
        };
        let step = share * typical.max(at[i].abs());
        let moved = |by: f64| {
            let mut parameters = parameters.clone();
            parameters[first + i] += by;
            driven.run(&model, &parameters)
        };
        let one_sided = at[i] - 2.0 * step < own.bounds.0;
        let near = [moved(step), moved(2.0 * step)];
        let far = (!one_sided).then(|| [moved(-step), moved(-2.0 * step)]);
        for (k, row) in exact.iter().enumerate() {
            for (y, own_value) in row.iter().enumerate() {
                let of = |rows: &Vec<Vec<f64>>| rows[k][y];
                let difference = match &far {
                    None => (4.0 * of(&near[0]) - of(&near[1]) - 3.0 * of(&plain)) / (2.0 * step),
                    Some(far) => {
                        let one = of(&near[0]) - of(&far[0]);
                        let two = of(&near[1]) - of(&far[1]);
                        (8.0 * one - two) / (12.0 * step)
                    }
                };
                let error = (own_value.eps[0] - difference).abs() * typical;
                // At a corner the derivative is that of one of its sides.
                let slopes = far.iter().flat_map(|far| {
                    let slope = |a: &Vec<Vec<f64>>, b: &Vec<Vec<f64>>, h: f64| (of(a) - of(b)) / h;
                    [
                        slope(&near[0], &plain, step),
                        slope(&near[1], &near[0], step),
                        slope(&plain, &far[0], step),
                        slope(&far[0], &far[1], step),
                    ]
                });
                let slopes: Vec<f64> = slopes.collect();
                let (low, high) = slopes
                    .iter()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| {
                        (l.min(*s), h.max(*s))
                    });
                if error >= tolerance * scale && !slopes.is_empty() {
                    corners += 1;
                    let reach = tolerance * scale / typical;
                    let slope = own_value.eps[0];
                    assert!(
                        slope > low - reach && slope < high + reach,
                        "{} by {} at {at:?}, row {k}: {slope} is none of {slopes:?}",
                        candidate.id,
                        own.short
                    );
                    continue;
                }
                assert!(
                    error < tolerance * scale,
                    "{} by {} at {at:?}, row {k}: {} against {difference}",
                    candidate.id,
                    own.short,
                    own_value.eps[0]
                );
            }
        }
    }
    let rows = plain.len() * plain[0].len() * candidate.parameters.len();
    assert!(
        50 * corners <= rows,
        "{}: {corners} of {rows}",
        candidate.id
    );
}

#[test]
fn derivatives_are_those_of_differences() {
    for driven in Driven::all() {
        for candidate in driven.with_shapes() {
            check_derivatives(&driven, &candidate, &active(&candidate), 1e-5);
        }
    }
}

#[test]
fn derivatives_where_the_effect_is_absent_are_those_of_differences() {
    for driven in Driven::all() {
        for candidate in driven.with_shapes().iter().filter(|c| c.is_smooth()) {
            let absent: Vec<f64> = candidate.parameters.iter().map(|p| p.absent).collect();
            // A step does not end at the knots of a function of zeros, where the slope of its derivatives jumps.
            let tolerance = if candidate.is_shape() { 2e-4 } else { 1e-5 };
            check_derivatives(&driven, candidate, &absent, tolerance);
        }
    }
}
