//! Projections against every choice of active bounds, tried one by one.
//!
//! `PROBLEMS=100000 cargo test --release -p ct-constrained --test all oracle::` tries as many feasible problems of each kind, and a fifth
//! as many that contradict themselves; without it, 4000.

use ct_constrained::{Error, Row, project, project_box};
use ct_rls::{ContinuousRls, RecursiveEstimator, Weights};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal, Uniform};

fn problems() -> usize {
    std::env::var("PROBLEMS").map_or(4000, |n| n.parse().unwrap())
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).unwrap().sample(rng)
}

fn one_of(rng: &mut ChaCha8Rng, n: u32) -> u32 {
    rng.next_u32() % n
}

/// Whole numbers meet at corners, others do not.
fn number(rng: &mut ChaCha8Rng, whole: bool) -> f64 {
    let x = uniform(rng, -9.0, 9.0);
    if whole { x.round() } else { x }
}

fn covariance<const P: usize>(rng: &mut ChaCha8Rng) -> SMatrix<f64, P, P> {
    let spread = SVector::<f64, P>::from_fn(|_, _| 10_f64.powf(uniform(rng, -1.0, 1.5)));
    let a = SMatrix::<f64, P, P>::from_fn(|_, _| normal(rng));
    let a = a * a.transpose() + SMatrix::identity() * 0.05;
    SMatrix::from_diagonal(&spread) * a * SMatrix::from_diagonal(&spread)
}

fn estimator<const P: usize>(theta: SVector<f64, P>, p: SMatrix<f64, P, P>) -> ContinuousRls<P> {
    ContinuousRls::new(theta, p, Weights::least_squares(0.0).unwrap()).unwrap()
}

/// `low <= f' theta <= high`
type Interval<const P: usize> = (SVector<f64, P>, f64, f64);

/// The nearest point that holds these bounds with equality, where they are independent: `theta - P F (F'P F)^-1 (F'theta - bound)`.
fn nearest_on<const P: usize>(
    theta: &SVector<f64, P>,
    root: &SMatrix<f64, P, P>,
    bounds: &[(SVector<f64, P>, f64)],
) -> Option<SVector<f64, P>> {
    let q = bounds.len();
    if q == 0 {
        return Some(*theta);
    }
    // rows of length 1 in the metric, so that singular values say how independent they are
    let g: Vec<_> = bounds.iter().map(|(f, _)| root.tr_mul(f)).collect();
    let rows = DMatrix::from_fn(q, P, |i, j| g[i][j] / g[i].norm());
    let svd = rows.svd(true, true);
    if svd.singular_values.min() < 1e-9 {
        return None;
    }
    let mut nearest = *theta;
    for _ in 0..3 {
        let left = DVector::from_fn(q, |i, _| {
            let (f, bound) = &bounds[i];
            (bound - f.dot(&nearest)) / g[i].norm()
        });
        let x = svd.solve(&left, 0.0).unwrap();
        nearest += root * SVector::from_fn(|i, _| x[i]);
    }
    Some(nearest)
}

/// Among the nearest points for all sets of active bounds, the nearest one that satisfies every row.
fn oracle<const P: usize>(
    theta: &SVector<f64, P>,
    p: &SMatrix<f64, P, P>,
    rows: &[Interval<P>],
) -> Option<SVector<f64, P>> {
    let root = p.cholesky().unwrap().l();
    let spread = p.diagonal().map(f64::sqrt);
    let obeys = |point: &SVector<f64, P>, distance: f64| {
        // the start, the end and the rounding of the way
        let sizes = point.abs() + theta.abs() + spread * (1e-4 * distance);
        rows.iter().all(|(f, low, high)| {
            let value = f.dot(point);
            let terms = f.abs().dot(&sizes);
            let beyond = |bound: f64| {
                bound.is_finite() && (value - bound).abs() > 1e-11 * (bound.abs() + terms)
            };
            !(value < *low && beyond(*low) || value > *high && beyond(*high))
        })
    };
    let mut best: Option<(f64, SVector<f64, P>)> = None;
    let mut chosen = Vec::new();
    choose(rows, &mut chosen, &mut |bounds| {
        let Some(point) = nearest_on(theta, &root, bounds) else {
            return;
        };
        let way = root.solve_lower_triangular(&(point - theta)).unwrap();
        let distance = way.norm();
        if obeys(&point, distance) && best.as_ref().is_none_or(|(least, _)| distance < *least) {
            best = Some((distance, point));
        }
    });
    best.map(|(_, point)| point)
}

/// Every choice of at most `P` bounds, one for a row.
fn choose<const P: usize>(
    rows: &[Interval<P>],
    chosen: &mut Vec<(SVector<f64, P>, f64)>,
    visit: &mut impl FnMut(&[(SVector<f64, P>, f64)]),
) {
    let Some(((f, low, high), rest)) = rows.split_first() else {
        return visit(chosen);
    };
    choose(rest, chosen, visit);
    let bounds: &[f64] = if low == high { &[*low] } else { &[*low, *high] };
    for &bound in bounds {
        if bound.is_finite() && chosen.len() < P {
            chosen.push((*f, bound));
            choose(rest, chosen, visit);
            chosen.pop();
        }
    }
}

fn vector<const P: usize>(rng: &mut ChaCha8Rng, whole: bool) -> SVector<f64, P> {
    loop {
        let f: SVector<f64, P> = SVector::from_fn(|_, _| number(rng, whole));
        if f.norm() > 0.0 {
            return f;
        }
    }
}

fn row<const P: usize>((f, low, high): &Interval<P>, turned: bool) -> Row<P> {
    let (f, opposite) = ((*f).into(), (-f).into());
    match (low == high, turned) {
        (true, _) => Row::equal(f, *high, 0.0),
        (false, false) => Row::at_most(f, *high, 0.0),
        (false, true) => Row::at_least(opposite, -high, 0.0),
    }
    .unwrap()
}

/// Rows that `inside` obeys: equalities, inequalities that hold with equality or not, multiples and sums of rows before.
fn rows_around<const P: usize, const R: usize>(
    rng: &mut ChaCha8Rng,
    inside: &SVector<f64, P>,
    whole: bool,
) -> [Interval<P>; R] {
    let mut rows: Vec<Interval<P>> = Vec::new();
    while rows.len() < R {
        let kind = one_of(rng, 10);
        let earlier = |rng: &mut ChaCha8Rng| {
            let index = one_of(rng, u32::try_from(rows.len()).unwrap());
            rows[usize::try_from(index).unwrap()]
        };
        let next = match kind {
            0 | 1 => {
                let f: SVector<f64, P> = vector(rng, whole);
                (f, f.dot(inside), f.dot(inside))
            }
            2 if !rows.is_empty() => {
                let (f, low, high) = earlier(rng);
                let by = 10_f64.powf(uniform(rng, -2.0, 2.0));
                (f * by, low * by, high * by)
            }
            3 if !rows.is_empty() => {
                let ((f, low, high), (g, lower, higher)) = (earlier(rng), earlier(rng));
                // excludes rows of rounding errors only
                if (f + g).norm() < 1e-3 * f.norm() {
                    continue;
                }
                (f + g, low + lower, high + higher)
            }
            _ => {
                let f: SVector<f64, P> = vector(rng, whole);
                let slack = if kind < 6 {
                    0.0
                } else {
                    number(rng, whole).abs()
                };
                (f, f64::NEG_INFINITY, f.dot(inside) + slack)
            }
        };
        rows.push(next);
    }
    rows.try_into().unwrap()
}

fn agrees<const P: usize>(
    found: &SVector<f64, P>,
    start: &SVector<f64, P>,
    wanted: &SVector<f64, P>,
) -> bool {
    (found - wanted).norm() <= 1e-9 * (1.0 + start.norm() + wanted.norm())
}

/// Number of feasible problems that were rejected, and number of those with another result.
fn with_rows<const P: usize>(problems: usize) -> (usize, usize) {
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let (mut refused, mut other) = (0, 0);
    for k in 0..problems {
        let whole = k % 2 == 0;
        let rng = &mut rng;
        let (start, inside) = (vector(rng, whole), vector(rng, whole));
        let p = covariance(rng);
        let rows: [Interval<P>; 6] = rows_around(rng, &inside, whole);
        let mut rls = estimator(start, p);
        match project(&mut rls, &rows.map(|r| row(&r, one_of(rng, 2) == 0))) {
            Err(error) => {
                refused += 1;
                println!("{k}: {error}");
            }
            Ok(_) => {
                let wanted = oracle(&start, &p, &rows).unwrap();
                if !agrees(rls.theta(), &start, &wanted) {
                    other += 1;
                    println!("{k}: {} instead of {wanted} from {start}", rls.theta());
                }
            }
        }
    }
    (refused, other)
}

#[test]
fn rows_that_a_point_obeys_lead_to_the_nearest_one() {
    let each = problems() / 4;
    assert_eq!(with_rows::<1>(each), (0, 0));
    assert_eq!(with_rows::<2>(each), (0, 0));
    assert_eq!(with_rows::<3>(each), (0, 0));
    assert_eq!(with_rows::<4>(each), (0, 0));
}

fn with_boxes<const P: usize>(problems: usize) -> (usize, usize) {
    let mut rng = ChaCha8Rng::seed_from_u64(18);
    let (mut refused, mut other) = (0, 0);
    for k in 0..problems {
        let rng = &mut rng;
        let whole = k % 2 == 0;
        let start: SVector<f64, P> = vector(rng, whole);
        let p = covariance(rng);
        let mut lower: SVector<f64, P> = SVector::from_fn(|_, _| number(rng, whole));
        let mut upper = lower.map(|low| low + number(rng, whole).abs());
        for i in 0..P {
            match one_of(rng, 8) {
                0 => lower[i] = f64::NEG_INFINITY,
                1 => upper[i] = f64::INFINITY,
                2 | 3 => upper[i] = lower[i],
                _ => {}
            }
        }
        let entry = |i| SVector::from_fn(|j, _| f64::from(u8::from(i == j)));
        let rows: [Interval<P>; P] = std::array::from_fn(|i| (entry(i), lower[i], upper[i]));
        let mut rls = estimator(start, p);
        match project_box(&mut rls, &lower, &upper) {
            Err(error) => {
                refused += 1;
                println!("{k}: {error}");
            }
            Ok(_) => {
                let wanted = oracle(&start, &p, &rows).unwrap();
                other += usize::from(!agrees(rls.theta(), &start, &wanted));
            }
        }
    }
    (refused, other)
}

#[test]
fn boxes_with_fixed_entries_lead_to_their_nearest_point() {
    let each = problems() / 4;
    assert_eq!(with_boxes::<1>(each), (0, 0));
    assert_eq!(with_boxes::<2>(each), (0, 0));
    assert_eq!(with_boxes::<3>(each), (0, 0));
    assert_eq!(with_boxes::<4>(each), (0, 0));
}

/// Rows of which two, or three, leave no point: their sum is bounded from the other side.
fn with_contradictions<const P: usize>(problems: usize) -> usize {
    let mut rng = ChaCha8Rng::seed_from_u64(19);
    let mut taken = 0;
    for k in 0..problems {
        let rng = &mut rng;
        let whole = k % 2 == 0;
        let (start, inside) = (vector(rng, whole), vector(rng, whole));
        let mut rows: [Interval<P>; 6] = rows_around(rng, &inside, whole);
        let ((f, _, high), (g, _, higher)) = if one_of(rng, 2) == 0 {
            (rows[0], rows[1])
        } else {
            (rows[0], (SVector::zeros(), 0.0, 0.0))
        };
        let above = high
            + higher
            + 10_f64.powf(uniform(rng, -6.0, 3.0)) * (1.0 + high.abs() + higher.abs());
        rows[5] = (-(f + g), f64::NEG_INFINITY, -above);
        let mut rls = estimator(start, covariance(rng));
        let result = project(&mut rls, &rows.map(|r| row(&r, one_of(rng, 2) == 0)));
        let refused = matches!(result, Err(Error::NoCommonPoint { .. }));
        if !refused || *rls.theta() != start {
            taken += 1;
            println!("{k}: {rows:?}");
        }
    }
    taken
}

#[test]
fn rows_that_no_point_obeys_are_refused() {
    let each = problems() / 20;
    assert_eq!(with_contradictions::<1>(each), 0);
    assert_eq!(with_contradictions::<2>(each), 0);
    assert_eq!(with_contradictions::<3>(each), 0);
    assert_eq!(with_contradictions::<4>(each), 0);
}
