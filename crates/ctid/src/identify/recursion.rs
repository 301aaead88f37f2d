//! The two recursions over a scaled record.

use ct_constrained::Bounds;
use ct_rls::{ContinuousRls, DynamicRls, RecursiveEstimator, Weights};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use stabilized_oe::{
    BlockDiagonal, FilterBounds, IoSample, StabilizedOe, StateVariableFilters, check_filter_bounds,
};

use super::Order;
use super::scaled::Scaled;
use crate::Error;

/// Points of the way that are kept.
const POINTS: usize = 500;

/// P(0): all parameters are about 1.
const P_EQUATION_ERROR: f64 = 100.0;
const P_OUTPUT_ERROR: f64 = 10.0;

/// How far the plausible plants reach about the start, and the bounds on c: factors, the widest that are sure come first.
const PLAUSIBLE: [f64; 4] = [2.0, 1.5, 1.25, 1.1];
const BOUNDS: [f64; 4] = [2.0, 1.5, 1.2, 1.05];

/// The share of the readings that has to be left for the equation error where readings are missing.
const LEAST_LEFT: f64 = 0.3;

/// The output error keeps every lag above this part of the sampling interval, where the others are those of the start. Less cannot be
/// seen, and `y_m^(n)`, which is divided by `a_n`, would be so large that the recursion takes itself for sure.
const SHORTEST_LAG: f64 = 0.05;

/// Where the recursion was.
#[derive(Debug, Clone)]
pub(super) struct Point {
    /// Which sample.
    pub sample: usize,
    /// In which there were readings, scaled.
    pub time: f64,
    pub theta: DVector<f64>,
    /// `P^-1`
    pub information: DMatrix<f64>,
}

/// Its way over the record.
#[derive(Debug, Clone)]
pub(super) struct Path {
    pub order: Order,
    pub points: Vec<Point>,
    /// Bounds on the parameters have acted in the second half: the scatter of the estimates says nothing of their errors then.
    pub held: bool,
    pub warnings: Vec<String>,
}

impl Path {
    fn new(order: Order) -> Self {
        Self {
            order,
            points: Vec::new(),
            held: false,
            warnings: Vec::new(),
        }
    }

    pub fn last(&self) -> Result<&Point, Error> {
        self.points.last().ok_or_else(|| {
            Error::Usage("no sample could be used; check the record for gaps".to_owned())
        })
    }

    fn keep(
        &mut self,
        (sample, time): (usize, f64),
        theta: &[f64],
        covariance: DMatrix<f64>,
    ) -> Result<(), Error> {
        let information = covariance
            .try_inverse()
            .filter(|information| information.iter().all(|x| x.is_finite()))
            .ok_or_else(|| untold(self.order))?;
        self.points.push(Point {
            sample,
            time,
            theta: DVector::from_column_slice(theta),
            information,
        });
        Ok(())
    }
}

fn untold(order: Order) -> Error {
    Error::Usage(format!(
        "the record does not tell the parameters of order {order} apart; try {}a record with more movement in its input",
        or_lower(order)
    ))
}

/// The first of what to try: `--order 2,0, or `; nothing where there is no lower order.
pub(super) fn or_lower(order: Order) -> String {
    order
        .lower()
        .map_or_else(String::new, |lower| format!("--order {lower}, or "))
}

/// Whether the k-th of `count` samples is kept.
fn is_kept(k: usize, count: usize) -> bool {
    k + 1 == count || k.is_multiple_of(count.div_ceil(POINTS))
}

/// The start: as many equal lags as n, which sum up to the time constant of first order, its gain and its offset.
fn start(scaled: &Scaled, order: Order) -> Vec<f64> {
    let mut theta = lags(order.n);
    theta.push(scaled.first_order[0]);
    theta.resize(order.n + order.m + 1, 0.0);
    theta.push(scaled.first_order[1]);
    theta
}

/// `a_1` to `a_n` of `(1 + s/n)^n`.
fn lags(n: usize) -> Vec<f64> {
    let mut a = vec![0.0; n + 1];
    a[0] = 1.0;
    for degree in 1..=n {
        for i in (1..=degree).rev() {
            a[i] += a[i - 1] / n as f64;
        }
    }
    a.remove(0);
    a
}

/// Least squares on `y_f = -a_1 y_f' - .. + b_0 u_f + .. + d`. Rows count where the reading is there and the filter of y has forgotten what long gaps were
/// bridged with; in the others nothing is learnt and nothing forgotten.
pub(super) fn equation_error(scaled: &Scaled, order: Order) -> Result<Path, Error> {
    let p = order.parameters();
    let start = DVector::from_vec(start(scaled, order));
    let weights = Weights::least_squares(scaled.eta)?;
    let mut rls = DynamicRls::new(
        start,
        &(DMatrix::identity(p, p) * P_EQUATION_ERROR),
        weights,
    )?;
    let (mut of_u, mut of_y) = scaled.filters(order.n)?;
    let mut phi = vec![1.0; p];
    let mut path = Path::new(order);
    let count = scaled.time.len();
    let following = scaled.steps().skip(1).chain([0.0]);
    let mut learnt = Learnt::of(scaled);
    for (k, (step, next)) in scaled.steps().zip(following).enumerate() {
        let y = of_y.update(scaled.y[k], step)?;
        let u = of_u.update(scaled.u[k], step)?;
        // the last sample is not held
        if let Some(y) = y {
            for (phi, slope) in phi.iter_mut().zip(&y[1..]) {
                *phi = -slope;
            }
            phi[order.n..=order.n + order.m].copy_from_slice(&u[..=order.m]);
            if next > 0.0 {
                rls.update_with(&phi, y[0], next, &weights);
            }
        }
        if is_kept(k, count) {
            path.keep(
                (k, learnt.time(k, scaled)),
                rls.theta().as_slice(),
                rls.covariance(),
            )?;
        }
        learnt.after(y.is_some(), next);
    }
    let readings = scaled.y.iter().filter(|y| !y.is_nan()).count();
    if (learnt.rows as f64) < LEAST_LEFT * readings as f64 {
        return Err(Error::Usage(format!(
            "{:.0} % of the readings are missing, and only {} of {count} rows are far enough behind long gaps for the filters of --method ct-rls; --method srivc and fcloe leave single readings out",
            100.0 * (1.0 - readings as f64 / count as f64),
            learnt.rows
        )));
    }
    rls.health()?;
    let end = path.last()?;
    let mut a = vec![1.0];
    a.extend(end.theta.iter().take(order.n));
    if !ct_lti::Polynomial::new(a)?.is_hurwitz() {
        return Err(Error::Usage(format!(
            "the estimates at the end are those of an unstable model; try {}--method stabilized-oe, whose model is kept stable",
            or_lower(order)
        )));
    }
    Ok(path)
}

/// The time of the rows that were learnt from, and how many these are.
struct Learnt {
    time: f64,
    rows: usize,
    /// Whether all readings are there: then the time is the record's own, to the last digit.
    whole: bool,
}

impl Learnt {
    fn of(scaled: &Scaled) -> Self {
        Self {
            time: 0.0,
            rows: 0,
            whole: scaled.y.iter().all(|y| !y.is_nan()),
        }
    }

    /// At a sample.
    fn time(&self, k: usize, scaled: &Scaled) -> f64 {
        if self.whole {
            scaled.time[k]
        } else {
            self.time
        }
    }

    /// A row that was held for a time, and whether it was learnt from.
    fn after(&mut self, learnt: bool, held: f64) {
        if learnt {
            self.time += held;
            self.rows += 1;
        }
    }
}

/// Output error of a model in parallel.
pub(super) fn output_error(scaled: &Scaled, order: Order) -> Result<Path, Error> {
    // The crate's sizes are known when it is built: one for each order.
    macro_rules! sizes {
        ($($n:literal, $m:literal => $p:literal;)*) => {
            match (order.n, order.m) {
                $(($n, $m) => parallel::<$n, $p>(scaled, order),)*
                _ => Err(untold(order)),
            }
        };
    }
    sizes! {
        1, 0 => 3; 1, 1 => 4;
        2, 0 => 4; 2, 1 => 5; 2, 2 => 6;
        3, 0 => 5; 3, 1 => 6; 3, 2 => 7; 3, 3 => 8;
        4, 0 => 6; 4, 1 => 7; 4, 2 => 8; 4, 3 => 9; 4, 4 => 10;
    }
}

fn parallel<const N: usize, const P: usize>(scaled: &Scaled, order: Order) -> Result<Path, Error> {
    let start = SVector::<f64, P>::from_column_slice(&start(scaled, order));
    let a: [f64; N] = core::array::from_fn(|i| start[i]);
    let theta = ContinuousRls::with_integrator(
        start,
        SMatrix::identity() * P_OUTPUT_ERROR,
        Weights::least_squares(scaled.eta)?,
    )?;
    // Nothing is forgotten: the regressor of c vanishes where the model is right.
    let filter = ContinuousRls::with_integrator(
        SVector::from(a),
        SMatrix::identity(),
        Weights::least_squares(0.0)?,
    )?;
    let gain: BlockDiagonal<N, P> = BlockDiagonal::new(theta, filter);
    let mut path = Path::new(order);
    let (bounds, plausible) = filter_bounds(&a)?;
    if plausible.is_none() {
        path.warnings.push(format!(
            "no bounds on the error filter make convergence sure for any plants around the start, for n = {N}; compare with --method ct-rls"
        ));
    }
    let filters = StateVariableFilters::<N>::with_input(scaled.bandwidth, scaled.hold)?;
    let mut estimator = StabilizedOe::new(gain, filters)?
        .with_offset()
        .with_theta_bounds(theta_bounds(scaled, N)?)?
        .with_filter_bounds(bounds)?
        .with_model_state(at_rest(scaled))?;
    let count = scaled.time.len();
    let mut held_early = 0;
    let mut learnt = Learnt::of(scaled);
    let following = scaled.steps().skip(1).chain([0.0]);
    for (k, next) in following.enumerate() {
        if 2 * k <= count {
            held_early = estimator.bounded().theta;
        }
        // the last sample is not held
        if next > 0.0 {
            let sample = IoSample {
                u: scaled.u[k],
                y: scaled.y[k],
            };
            estimator.update(&sample, next);
        }
        if is_kept(k, count) {
            let covariance = estimator.covariance();
            path.keep(
                (k, learnt.time(k, scaled)),
                estimator.theta().as_slice(),
                DMatrix::from_column_slice(P, P, covariance.as_slice()),
            )?;
        }
        learnt.after(!scaled.y[k].is_nan(), next);
    }
    estimator.health()?;
    let held = estimator.bounded().theta - held_early;
    if held > 0 {
        path.held = true;
        path.warnings.push(format!(
            "a time constant is too short to be seen: in the second half a bound held a coefficient of A above 0 (steps: {held}), and standard errors \
             are not known; {}",
            lower_or_faster(order)
        ));
    }
    let unstable = estimator.bounded().unstable;
    if unstable > 0 {
        path.warnings.push(format!(
            "{unstable} of {count} steps would have made the model unstable, and were shortened"
        ));
    }
    path.warnings.extend(left_plausible(&path, plausible, &a)?);
    Ok(path)
}

/// What to try where the model is too fast for the record.
pub(super) fn lower_or_faster(order: Order) -> String {
    match order.lower() {
        None => "sample faster".to_owned(),
        Some(lower) => format!("try --order {lower}"),
    }
}

fn theta_bounds<const P: usize>(scaled: &Scaled, n: usize) -> Result<Bounds<P>, Error> {
    let mut lower = [f64::NEG_INFINITY; P];
    let slower = std::iter::once(1.0).chain(lags(n));
    for (lower, slower) in lower.iter_mut().zip(slower).take(n) {
        *lower = SHORTEST_LAG * scaled.interval * slower;
    }
    let bounds = Bounds::new(lower, [f64::INFINITY; P]);
    Ok(bounds.map_err(stabilized_oe::Error::from)?)
}

/// `y` and its derivatives at rest on the first sample.
fn at_rest<const N: usize>(scaled: &Scaled) -> [f64; N] {
    let mut state = [0.0; N];
    let first = scaled.y.iter().find(|y| !y.is_nan());
    if let (Some(state), Some(y)) = (state.first_mut(), first) {
        *state = *y;
    }
    state
}

/// The widest bounds on c about the start with which C/A0 - 1/2 is strictly positive real for the plants about it, and how far those reach.
fn filter_bounds<const N: usize>(a: &[f64; N]) -> Result<(Bounds<N>, Option<f64>), Error> {
    for reach in PLAUSIBLE {
        let plausible = about(a, reach)?;
        for spread in BOUNDS {
            let bounds = about(a, spread)?;
            if check_filter_bounds(&bounds, &plausible, 0.5)?.hold() {
                return Ok((bounds, Some(reach)));
            }
        }
    }
    let [.., narrowest] = BOUNDS;
    Ok((about(a, narrowest)?, None))
}

fn about<const N: usize>(a: &[f64; N], factor: f64) -> Result<Bounds<N>, Error> {
    let bounds = Bounds::new(a.map(|a| a / factor), a.map(|a| a * factor));
    Ok(bounds.map_err(stabilized_oe::Error::from)?)
}

/// The plant that was found is none of those for which convergence is sure.
fn left_plausible<const N: usize>(
    path: &Path,
    reach: Option<f64>,
    a: &[f64; N],
) -> Result<Option<String>, Error> {
    let Some(reach) = reach else { return Ok(None) };
    let found = &path.last()?.theta;
    let found: [f64; N] = core::array::from_fn(|i| found[i]);
    if about(a, reach)?.contains(&SVector::from(found)) {
        return Ok(None);
    }
    // Outside the box the bounds may hold all the same.
    let [.., here] = PLAUSIBLE;
    let (bounds, _) = filter_bounds(a)?;
    Ok(match check_filter_bounds(&bounds, &about(&found, here)?, 0.5)? {
        FilterBounds::PositiveReal => None,
        _ => Some(
            "the error filter's bounds do not make convergence sure for the plant that was found (C/A - 1/2 is not strictly positive real): \
             compare with --method ct-rls"
                .to_owned(),
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lags_are_those_of_the_binomial() {
        assert_eq!(lags(1), [1.0]);
        assert_eq!(lags(2), [1.0, 0.25]);
        let third = lags(3);
        for (a, b) in third.iter().zip([1.0, 1.0 / 3.0, 1.0 / 27.0]) {
            assert!((a - b).abs() < 1e-15);
        }
    }

    #[test]
    fn a_lower_order_is_advised_where_there_is_one() {
        let order = |n, m| Order { n, m };
        assert_eq!(or_lower(order(3, 3)), "--order 2,2, or ");
        assert_eq!(or_lower(order(1, 0)), "");
        assert_eq!(lower_or_faster(order(2, 0)), "try --order 1,0");
        assert_eq!(lower_or_faster(order(1, 1)), "sample faster");
    }

    #[test]
    fn bounds_that_make_convergence_sure_are_found_up_to_the_third_order() {
        assert!(filter_bounds(&[1.0]).unwrap().1.unwrap() >= 1.5);
        assert!(filter_bounds(&[1.0, 0.25]).unwrap().1.is_some());
        assert!(
            filter_bounds(&[1.0, 1.0 / 3.0, 1.0 / 27.0])
                .unwrap()
                .1
                .is_some()
        );
    }
}
