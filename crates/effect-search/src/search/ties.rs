//! Candidates with collinear sensitivities: the drift of an input's gain and the drift of the parameter that the input is multiplied by.
//!
//! Each of two such candidates explains what the other one explains, to first order. Together they explain their second-order difference at
//! most, such as a drift with a curvature, and no record shows which of them is which: a set has one of them, the group of this effect
//! names both. The sensitivities are those of the model without effects, projected off those of its parameters.
//!
//! A candidate of the model file whose sensitivity is a combination of theirs changes nothing that they do not: a term that the model has
//! already. No search can find it, so the result names it ([`Absorbed`]).

use std::sync::Arc;

use ct_model::Model;
use ct_model::effects::Role;
use estimation::{Noise, Residuals, rows, within};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::node::{Context, Node};
use crate::fit::relations::{Absorbed, Tie};
use crate::search::pairs::{basis_of, every_nth, project, whitened};

/// Direction of a candidate's sensitivity.
enum Direction {
    /// The part that is orthogonal to the sensitivities of the believed parameters, of length one, and its length.
    Own(DVector<f64>, f64),
    /// The believed parameters explain it: one of them alone, or several together.
    Dependent(Option<String>),
    Unknown,
}

/// Two columns are collinear if the sine of the angle between them is below this: derivatives are exact up to the tolerance of the simulation.
const SAME_DIRECTION: f64 = 1e-4;
/// A column of which the believed parameters explain all but this share has no direction of its own.
pub(crate) const DEPENDENT: f64 = 1e-3;

impl Context<'_> {
    /// For each candidate, the first one with a collinear sensitivity; and the candidates of the model file that the model's own parameters
    /// absorb. `bare`: the model without effects.
    pub fn ties(&self, bare: &Node) -> (Vec<Tie>, Vec<Absorbed>) {
        let alone = |first| Tie { first, scale: 1.0 };
        let mut ties: Vec<Tie> = (0..self.candidates.len()).map(alone).collect();
        let every = every_nth(self, self.candidates.len());
        let Some(believed) = self.sensitivities(bare, every) else {
            return (ties, Vec::new());
        };
        let basis = basis_of(&believed);
        let directions: Vec<Direction> = (0..ties.len())
            .into_par_iter()
            .map(|i| {
                if self.limit.passed() {
                    return Direction::Unknown;
                }
                let Some(column) = self.direction(bare, i, every) else {
                    return Direction::Unknown;
                };
                // No prior depends on an effect.
                let whole = column.resize_vertically(believed.nrows(), 0.0);
                let mut column = whole.clone();
                let before = column.norm();
                project(&basis, &mut column);
                project(&basis, &mut column);
                let after = column.norm();
                if after > DEPENDENT * before {
                    Direction::Own(column / after, after)
                } else if before > 0.0 {
                    Direction::Dependent(self.parameter_along(bare, &believed, &whole))
                } else {
                    Direction::Unknown
                }
            })
            .collect();
        // The scale of the second one if both have the same direction.
        let scale = |a: usize, b: usize| match (&directions[a], &directions[b]) {
            (Direction::Own(a, of_a), Direction::Own(b, of_b)) => {
                let cosine = a.dot(b);
                (1.0 - cosine.powi(2) < SAME_DIRECTION.powi(2)).then(|| cosine * of_a / of_b)
            }
            _ => None,
        };
        for i in 0..ties.len() {
            let mut earlier = (0..i).filter(|&j| ties[j].first == j);
            let tie = earlier.find_map(|first| {
                Some(Tie {
                    first,
                    scale: scale(first, i)?,
                })
            });
            ties[i] = tie.unwrap_or(ties[i]);
        }
        let absorbed = self.candidates.iter().zip(&directions);
        let absorbed = absorbed.filter_map(|(candidate, direction)| match direction {
            Direction::Dependent(parameter)
                if candidate.effect.is_none() && !self.problem.effects.contains(&candidate.id) =>
            {
                Some(Absorbed {
                    effect: candidate.id.clone(),
                    parameter: parameter.clone(),
                })
            }
            _ => None,
        });
        (ties, absorbed.collect())
    }

    /// The parameter of the model whose sensitivity alone is collinear with a column.
    fn parameter_along(
        &self,
        set: &Node,
        believed: &DMatrix<f64>,
        column: &DVector<f64>,
    ) -> Option<String> {
        let along = |own: &DVector<f64>| {
            let product = own.norm() * column.norm();
            product > 0.0 && 1.0 - (own.dot(column) / product).powi(2) < DEPENDENT.powi(2)
        };
        let mut columns = believed.column_iter();
        let at = columns.position(|own| along(&own.into_owned()))?;
        let setup = self.setup(&set.model).ok()?;
        let entry = setup.free()[set.fit.interior()[at]];
        // An initial state cannot be given under `[known]`.
        (entry < setup.parameter_count()).then(|| setup.names()[entry].clone())
    }

    /// Sensitivities of the outputs to the parameters of a set that are not at a bound, and below them the rows of the priors; `None` if it
    /// has no such parameter.
    fn sensitivities(&self, set: &Node, every: usize) -> Option<DMatrix<f64>> {
        let interior = set.fit.interior().to_vec();
        if interior.is_empty() {
            return None;
        }
        let all = rows(&self.setup(&set.model).ok()?, &set.fit.x)?;
        let mut priors = Vec::new();
        all.each_prior(&interior, set.fit.prior_weight(), |row| {
            priors.extend_from_slice(row);
        });
        let white = Noise::white(set.spec().outputs.len());
        let columns = interior.len();
        let of_samples = whitened(&all, interior, &white, &set.fit.weights, every)?;
        let of_priors = DMatrix::from_row_slice(priors.len() / columns, columns, &priors);
        let rows = of_samples.nrows() + of_priors.nrows();
        let mut both = of_samples.resize_vertically(rows, 0.0);
        let first = rows - of_priors.nrows();
        both.rows_mut(first, of_priors.nrows())
            .copy_from(&of_priors);
        Some(both)
    }

    /// Sensitivity of the outputs to the size of a candidate where it is absent; `None` for a candidate with more than one parameter.
    fn direction(&self, bare: &Node, i: usize, every: usize) -> Option<DVector<f64>> {
        let [own] = &self.candidates[i].parameters[..] else {
            return None;
        };
        if own.role != Role::Size {
            return None;
        }
        let model = Arc::new(self.model(&[i]).ok()?);
        let setup = self.setup(&model).ok()?;
        let mut x = self.transfer(bare, &model, setup.start());
        let mut parameters = model.spec().parameters.iter();
        let at = parameters.position(|p| p.about.name == own.name)?;
        x[at] = own.absent;
        let all = rows(&setup.with_free(&[at]), &x)?;
        let white = Noise::white(bare.spec().outputs.len());
        let matrix = whitened(&all, vec![0], &white, &bare.fit.weights, every)?;
        Some(matrix.column(0).into_owned())
    }

    /// The candidates that may take the place of one in a fitted set: with the same sensitivity, and the size that has its influence within
    /// their bounds. Those of the user come first.
    pub fn tied_to(&self, candidate: usize, set: &Node) -> Vec<usize> {
        let others = set.added.iter().copied().filter(|&i| i != candidate);
        let others: Vec<usize> = others.collect();
        let reaches = |i: usize| {
            let (Some(of), Some(fitted)) = (self.ties.get(i), self.ties.get(candidate)) else {
                return false;
            };
            let ([own], [fitted_own]) = (
                &self.candidates[i].parameters[..],
                &self.candidates[candidate].parameters[..],
            ) else {
                return false;
            };
            set.value(&fitted_own.name).is_some_and(|value| {
                let size = own.absent + (value - fitted_own.absent) * of.scale / fitted.scale;
                (own.bounds.0..=own.bounds.1).contains(&size)
            })
        };
        let all = 0..self.candidates.len();
        let tied = all
            .filter(|i| !set.added.contains(i) && self.is_tied_to_one_of(*i, &[candidate]))
            .filter(|i| !self.repeats_one_of(*i, &others) && reaches(*i));
        let mut tied: Vec<usize> = tied.collect();
        tied.sort_by_key(|&i| self.candidates[i].effect.is_some());
        tied
    }

    /// Whether a set has another candidate with the same sensitivity.
    pub fn is_tied_to_one_of(&self, candidate: usize, added: &[usize]) -> bool {
        let first = |i: usize| self.ties.get(i).map_or(i, |tie| tie.first);
        added
            .iter()
            .any(|&i| i != candidate && first(i) == first(candidate))
    }

    /// The start of a candidate's fit at the influence of a tied one that was fitted in its place; `None` where they are not tied.
    pub fn tied_start(&self, fitted: &Node, model: &Model, candidate: usize) -> Option<Vec<f64>> {
        let last = *fitted.added.last()?;
        let (of, other) = (self.ties.get(candidate)?, self.ties.get(last)?);
        if of.first != other.first {
            return None;
        }
        let [own] = &self.candidates[candidate].parameters[..] else {
            return None;
        };
        let [fitted_own] = &self.candidates[last].parameters[..] else {
            return None;
        };
        let setup = self.setup(model).ok()?;
        let mut x = self.transfer(fitted, model, setup.start());
        let mut parameters = model.spec().parameters.iter();
        let at = parameters.position(|p| p.about.name == own.name)?;
        let moved = fitted.value(&fitted_own.name)? - fitted_own.absent;
        x[at] = within(
            own.absent + moved * of.scale / other.scale,
            setup.bounds()[at],
        );
        Some(x)
    }
}
