//! Joint scores of all pairs of effects, from the sensitivities of single ones.
//!
//! Two effects together may explain the data although neither does alone. Then neither is among the best single effects, from which larger
//! sets are built. Each candidate is linearised once at its single refit, and at its starts with the largest predicted reduction; `d_i` is
//! the change of the residual there, `E_i` the Jacobian of its parameters. The residual of a pair is then, to first order,
//! ```text
//! r_ij = r_0 + d_i + d_j - [J_0, E_i, E_j] s,
//! ```
//! and its least-squares step `s`, within the bounds of the effects' parameters, costs one small solve: all inner products are computed
//! once.
//!
//! **Cost**: `O(N m^2)` for `m` columns of all candidates together, `O(p^3)` for a pair.

use greybox::{Noise, Setup};
use nalgebra::{DMatrix, DVector};
use plants::Placed;
use rayon::prelude::*;

use crate::fit::{
    node::{Node, position_of, transfer},
    proposal::Proposal,
};

/// Largest number of points of linearisation of a candidate.
const POINTS: usize = 3;
/// For sets with more samples times columns than this, the inner products are not computed.
const LARGEST: usize = 40_000_000;
/// Ridge of the normal equations, against collinear columns.
const RIDGE: f64 = 1e-9;

/// A candidate at a point.
struct Linearised<'a> {
    placed: Placed,
    /// The effect's parameters at the point, and the complete vector.
    x: Vec<f64>,
    setup: Setup<'a>,
    /// Whitened: the effect's columns, then the effect's change of the residual.
    columns: Vec<Vec<f64>>,
    /// Range of each parameter of the effect, down and up.
    room: Vec<(f64, f64)>,
}

/// The pairs with the least predicted cost, each once, as proposals; `taken` are not proposed again.
pub(crate) fn joint_pairs<'a>(
    base: &Node<'a>,
    singles: &[Node<'a>],
    others: &[Proposal<'a>],
    noise: &Noise,
    count: usize,
    taken: impl Fn(&[Placed]) -> bool,
) -> Vec<Proposal<'a>> {
    // Outputs have the weights of the base.
    let metric = (noise, &base.fit.weights[..], base.fit.prior_weight());
    let Some((own, residual)) = whitened(&base.setup, &base.fit.x, metric, |_| true) else {
        return Vec::new();
    };
    let points = singles
        .iter()
        .filter_map(|node| Some((*node.added.last()?, &node.setup, node.fit.x.clone())));
    let starts = others.iter().flat_map(|proposal| {
        let placed = proposal.added.last().copied();
        let starts = proposal.starts.iter().take(POINTS - 1);
        starts.filter_map(move |start| Some((placed?, &proposal.setup, start.x.clone())))
    });
    let linearised: Vec<Linearised> = points
        .chain(starts)
        .collect::<Vec<_>>()
        .into_par_iter()
        .filter_map(|(placed, setup, x)| linearise(placed, setup, x, &residual, metric))
        .collect();
    let width: usize = linearised.iter().map(|one| one.columns.len()).sum();
    if (own.len() + width + 1) * residual.len() > LARGEST {
        return Vec::new();
    }
    let all: Vec<&[f64]> = own
        .iter()
        .chain(linearised.iter().flat_map(|one| &one.columns))
        .chain(std::iter::once(&residual))
        .map(Vec::as_slice)
        .collect();
    let gram = inner_products(&all);
    let mut at = own.len();
    let places: Vec<usize> = linearised
        .iter()
        .map(|one| {
            let here = at;
            at += one.columns.len();
            here
        })
        .collect();
    let mut scored: Vec<(f64, usize, usize)> = (0..linearised.len())
        .into_par_iter()
        .flat_map_iter(|i| (0..i).map(move |j| (i, j)))
        .filter(|&(i, j)| {
            let (a, b) = (linearised[i].placed, linearised[j].placed);
            a.effect.id != b.effect.id && !(a.effect.by_clock && b.effect.by_clock)
        })
        .filter_map(|(i, j)| {
            let cost = predicted(
                &gram,
                own.len(),
                [(places[i], &linearised[i]), (places[j], &linearised[j])],
            )?;
            Some((cost, i, j))
        })
        .collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut proposals: Vec<Proposal> = Vec::new();
    for (cost, i, j) in scored {
        if proposals.len() == count {
            break;
        }
        let (first, second) = (&linearised[i], &linearised[j]);
        let added = [base.added.clone(), vec![first.placed, second.placed]].concat();
        let same = |proposal: &Proposal| {
            proposal.added.contains(&first.placed) && proposal.added.contains(&second.placed)
        };
        if taken(&added) || proposals.iter().any(same) {
            continue;
        }
        proposals.extend(joined(base, first, second, added, cost));
    }
    proposals
}

/// Whitened columns of the selected rows of a setup, and the residual; `None` if the simulation is not finite.
fn whitened(
    setup: &Setup,
    x: &[f64],
    (noise, weights, of_priors): (&Noise, &[f64], f64),
    wanted: impl Fn(usize) -> bool,
) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
    let rows = setup.rows(x)?;
    let chosen: Vec<usize> = (0..rows.columns - 1)
        .filter(|&column| wanted(setup.free()[column]))
        .chain(std::iter::once(rows.columns - 1))
        .collect();
    let mut columns = vec![Vec::with_capacity(setup.samples()); chosen.len()];
    rows.each_whitened(&chosen, noise, weights, |row| {
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(*value);
        }
    });
    rows.each_prior(&chosen, of_priors, |row| {
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(*value);
        }
    });
    let residual = columns.pop()?;
    Some((columns, residual))
}

fn linearise<'a>(
    placed: Placed,
    setup: &Setup<'a>,
    x: Vec<f64>,
    residual: &[f64],
    metric: (&Noise, &[f64], f64),
) -> Option<Linearised<'a>> {
    let parameters = setup.structure.effect_parameters(placed);
    let own: Vec<usize> = parameters
        .iter()
        .filter_map(|info| position_of(setup, placed, info.name))
        .filter(|at| setup.free().contains(at))
        .collect();
    let (mut columns, with) = whitened(setup, &x, metric, |at| own.contains(&at))?;
    columns.push(with.iter().zip(residual).map(|(a, b)| a - b).collect());
    let finite = columns.iter().flatten().all(|value| value.is_finite());
    let room = own
        .iter()
        .map(|&at| {
            let (lower, upper) = setup.bounds()[at];
            (lower - x[at], upper - x[at])
        })
        .collect();
    finite.then(|| Linearised {
        placed,
        x,
        setup: setup.clone(),
        columns,
        room,
    })
}

fn inner_products(columns: &[&[f64]]) -> DMatrix<f64> {
    let n = columns.len();
    let rows: Vec<Vec<f64>> = (0..n)
        .into_par_iter()
        .map(|i| {
            let product = |j: usize| columns[i].iter().zip(columns[j]).map(|(a, b)| a * b).sum();
            (0..=i).map(product).collect()
        })
        .collect();
    DMatrix::from_fn(n, n, |i, j| if j <= i { rows[i][j] } else { rows[j][i] })
}

/// The predicted cost of a pair; the base has `own` columns, which come first, and the base's residual is last.
fn predicted(gram: &DMatrix<f64>, own: usize, pair: [(usize, &Linearised); 2]) -> Option<f64> {
    let last = gram.ncols() - 1;
    // The target is r_0 + d_i + d_j.
    let changes = pair.map(|(at, one)| at + one.columns.len() - 1);
    let target = [last, changes[0], changes[1]];
    let mut chosen: Vec<usize> = (0..own).collect();
    let mut room: Vec<Option<(f64, f64)>> = vec![None; own];
    for (at, one) in pair {
        chosen.extend(at..at + one.room.len());
        room.extend(one.room.iter().copied().map(Some));
    }
    let size = chosen.len();
    let scale: Vec<f64> = chosen
        .iter()
        .map(|&i| gram[(i, i)].max(f64::MIN_POSITIVE).sqrt())
        .collect();
    let normal = DMatrix::from_fn(size, size, |i, j| {
        let ridge = if i == j { RIDGE } else { 0.0 };
        gram[(chosen[i], chosen[j])] / (scale[i] * scale[j]) + ridge
    });
    let moment = DVector::from_fn(size, |i, _| {
        target.iter().map(|&t| gram[(chosen[i], t)]).sum::<f64>() / scale[i]
    });
    let mut step = normal.clone().cholesky()?.solve(&moment);
    for (i, room) in room.iter().enumerate() {
        if let Some((lower, upper)) = *room {
            step[i] = step[i].clamp(lower.min(0.0) * scale[i], upper.max(0.0) * scale[i]);
        }
    }
    let whole: f64 = target
        .iter()
        .flat_map(|&a| target.iter().map(move |&b| (a, b)))
        .map(|index| gram[index])
        .sum();
    let cost = whole - 2.0 * step.dot(&moment) + step.dot(&(&normal * &step));
    cost.is_finite().then_some(cost)
}

/// The pair's proposal: each effect at its point of linearisation, the other parameters as with either of them.
fn joined<'a>(
    base: &Node<'a>,
    first: &Linearised<'a>,
    second: &Linearised<'a>,
    added: Vec<Placed>,
    predicted: f64,
) -> Option<Proposal<'a>> {
    let mut structure = first.setup.structure.with(second.placed).ok()?;
    // The first has no period or quantisation step of its own: those of the second are used.
    let picked = &second.setup.structure.scales;
    if structure.scales.period == 0.0 {
        structure.scales.period = picked.period;
    }
    for (own, other) in structure.scales.outputs.iter_mut().zip(&picked.outputs) {
        own.hidden_step = own.hidden_step.or(other.hidden_step);
    }
    let setup = base.setup.with_structure(structure).ok()?;
    let start = |own: &Linearised<'a>, other: &Linearised<'a>| {
        let from = |one: &Linearised<'a>| {
            let mut node = base.clone();
            node.setup = one.setup.clone();
            node.fit.x.clone_from(&one.x);
            node
        };
        let mut x = transfer(&from(own), &setup);
        for parameter in setup.structure.effect_parameters(other.placed) {
            if let (Some(at), Some(there)) = (
                position_of(&setup, other.placed, parameter.name),
                position_of(&other.setup, other.placed, parameter.name),
            ) {
                x[at] = other.x[there];
            }
        }
        x
    };
    let starts = vec![start(first, second).into(), start(second, first).into()];
    Some(Proposal {
        setup,
        added,
        starts,
        predicted,
    })
}
