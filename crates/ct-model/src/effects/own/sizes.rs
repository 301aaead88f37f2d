//! The parameters of a candidate that are zero when it is absent.

use super::{Counts, Target};
use crate::expression::{Expression, Variable};
use crate::spec::{ModelSpec, State};

/// Parameters that are zero when the effect is absent: one parameter that alone makes all terms vanish, else all parameters that do so
/// together. The states of the candidate may stay at their start, if the terms vanish there too.
pub(super) fn sizes(
    scope: &ModelSpec,
    counts: Counts,
    states: &[State],
    terms: &[(Target, Expression)],
) -> Option<Vec<bool>> {
    let first = counts.parameters;
    let count = scope.parameters.len() - first;
    let value =
        |expression: &Expression, trial: u32, at_rest: bool, zero: &dyn Fn(usize) -> bool| {
            let of = |variable: Variable| {
                let (kind, i) = match variable {
                    Variable::Parameter(i) if i >= first && zero(i - first) => return 0.0,
                    Variable::State(i) if at_rest && i >= counts.states => {
                        return scope.states[i].start.value(0.0, &|_| f64::NAN);
                    }
                    Variable::Parameter(i) => (0, i),
                    Variable::Input(i) => (1, i),
                    Variable::State(i) => (2, i),
                    Variable::Flow(i) => (3, i),
                };
                // Unrelated numbers of either sign.
                let turn = 1.7 + f64::from(trial) * 2.39 + f64::from(kind) * 1.13 + i as f64 * 0.71;
                let size = 1.5 + turn.sin();
                if kind > 0 && trial.is_multiple_of(2) {
                    -7.0 * size
                } else {
                    11.0 * size
                }
            };
            expression.value(3.7 * f64::from(trial), &of)
        };
    let all_zero = |part: &Expression, at_rest: bool, zero: &dyn Fn(usize) -> bool| {
        let values = (1..=6).map(|trial| value(part, trial, at_rest, zero));
        let finite: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
        !finite.is_empty() && finite.iter().all(|value| *value == 0.0)
    };
    let vanish = |zero: &dyn Fn(usize) -> bool| {
        let terms = |at_rest| terms.iter().all(|(_, term)| all_zero(term, at_rest, zero));
        let rests = || {
            states
                .iter()
                .all(|state| all_zero(&state.right, true, zero))
        };
        terms(false) || (terms(true) && rests())
    };
    let alone: Vec<bool> = (0..count).map(|i| vanish(&|own| own == i)).collect();
    if alone.iter().any(|is| *is) {
        // One such parameter is enough; with several factors, the first one is used.
        let first = alone.iter().position(|is| *is);
        return Some((0..count).map(|i| Some(i) == first).collect());
    }
    if !vanish(&|_| true) {
        return None;
    }
    // Start from all parameters, and drop each one that is not needed.
    let mut zero = vec![true; count];
    for i in 0..count {
        zero[i] = false;
        let kept = zero.clone();
        if !vanish(&|own| kept[own]) {
            zero[i] = true;
        }
    }
    Some(zero)
}
