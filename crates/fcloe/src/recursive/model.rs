//! The model's loop and the filters of the sensitivities for time-varying parameters.
//!
//! Equations, for monic `A`, `S` (coefficients over the leading one: alpha, beta, s, r), observer forms, so that the
//! states stay continuous in meaning when theta moves: they are kept as they are.
//! ```text
//! plant        x_i' = x_{i-1} - alpha_i y^ + beta_i u^        y^ = x_{n-1} + beta_n u^
//! controller   c_i' = c_{i-1} - s_i u^ + r_i (r - y^)         u^ = c_{ns-1} + r_ns (r - y^)
//! chains       P_f z_y = y^,   P_f z_u = u^                   states p^i z, i < N = n + ns
//! sensitivity  sigma_a_i = -S p^i z_y,   sigma_b_i = S p^i z_u        (9) to (12), with P_f for P^
//! ```
//! u^ is never differentiated: `p^N z` follows from the chain's own equation.
//!
//! Over a step theta and r are constant, and the states go along the exponential of their matrix, which is applied as
//! its series, in steps h/k short enough for `rho h/k <= 1`, rho a bound of all roots of P^ and P_f (Fujiwara). The
//! matrix is used once, so this costs a fraction of computing its exponential. Exact to rounding for a held r.
//!
//! Cost: about `10 N` products for each term, and 8 to 22 terms.
//!
//! Reference: M. Fujiwara, Tohoku Mathematical Journal 10 (1916) 167-171, for the bound.

use crate::{Controller, Orders};

/// Limit of substeps: a root that is 10 000 times faster than the sampling needs more.
const MAX_SUBSTEPS: f64 = 1e4;

/// A loop whose parameters may change between samples. Allocates when it is made.
#[derive(Debug, Clone)]
pub(super) struct MovingLoop {
    orders: Orders,
    open: bool,
    /// R and S as given, ascending, of the length of S.
    r: Vec<f64>,
    s: Vec<f64>,
    /// A and B over a_n, n + 1 entries each.
    alpha: Vec<f64>,
    beta: Vec<f64>,
    /// P^ of the present parameters, N + 1 entries.
    p: Vec<f64>,
    /// P_f.
    filter: Vec<f64>,
    /// Plant, controller, z_y, z_u.
    state: Vec<f64>,
    term: Vec<f64>,
    slope: Vec<f64>,
}

impl MovingLoop {
    pub(super) fn new(orders: Orders, controller: &Controller) -> Self {
        let s = controller.s().coefficients().to_vec();
        let r = (0..s.len())
            .map(|i| controller.r().coefficient(i))
            .collect();
        let (n, ns) = (orders.n, s.len() - 1);
        let states = 3 * (n + ns);
        Self {
            orders,
            open: controller.is_open_loop(),
            r,
            s,
            alpha: vec![0.0; n + 1],
            beta: vec![0.0; n + 1],
            p: vec![0.0; n + ns + 1],
            filter: vec![0.0; n + ns + 1],
            state: vec![0.0; states],
            term: vec![0.0; states],
            slope: vec![0.0; states],
        }
    }

    /// Sets other parameters; the states do not change.
    pub(super) fn set(&mut self, theta: &[f64], renew_filter: bool) {
        let n = self.orders.n;
        let leading = theta[n - 1];
        self.alpha[0] = 1.0 / leading;
        for (alpha, a) in self.alpha[1..].iter_mut().zip(theta) {
            *alpha = a / leading;
        }
        for (beta, b) in self.beta.iter_mut().zip(&theta[n..]) {
            *beta = b / leading;
        }
        characteristic(&mut self.p, theta, n, &self.r, &self.s);
        if renew_filter {
            self.filter.copy_from_slice(&self.p);
        }
    }

    /// `P^` at other parameters, into `p`, N + 1 entries.
    pub(super) fn characteristic_at(&self, theta: &[f64], p: &mut [f64]) {
        characteristic(p, theta, self.orders.n, &self.r, &self.s);
    }

    pub(super) fn filter(&self) -> &[f64] {
        &self.filter
    }

    /// Back to rest.
    pub(super) fn reset(&mut self) {
        self.state.fill(0.0);
    }

    /// `(y^, u^)` under the drive.
    pub(super) fn signals(&self, drive: f64) -> (f64, f64) {
        self.signals_at(&self.state, drive)
    }

    fn signals_at(&self, x: &[f64], drive: f64) -> (f64, f64) {
        let (n, ns) = (self.orders.n, self.s.len() - 1);
        let (free_y, d) = (x[n - 1], self.beta[n]);
        if self.open {
            return (free_y + d * drive, drive);
        }
        let free_u = if ns > 0 { x[n + ns - 1] } else { 0.0 };
        let k = self.r[ns] / self.s[ns];
        // u = free_u + k (r - free_y - d u).
        let u = (free_u + k * (drive - free_y)) / (1.0 + k * d);
        (free_y + d * u, u)
    }

    /// The sensitivities of y^ under the drive, `n + m + 1`, each times its scale.
    pub(super) fn sensitivities(&self, drive: f64, scale: &[f64], sigma: &mut [f64]) {
        let (y, u) = self.signals(drive);
        let n = self.orders.n;
        let order = self.p.len() - 1;
        let top = |z: &[f64], input: f64| {
            let known: f64 = self.filter.iter().zip(z).map(|(c, z)| c * z).sum();
            (input - known) / self.filter[order]
        };
        let (z_y, z_u) = self.state[order..].split_at(order);
        let (top_y, top_u) = (top(z_y, y), top(z_u, u));
        let filtered = |z: &[f64], top: f64, i: usize| -> f64 {
            let at = |k: usize| if k == order { top } else { z[k] };
            self.s.iter().enumerate().map(|(j, s)| s * at(i + j)).sum()
        };
        let (sigma_a, sigma_b) = sigma.split_at_mut(n);
        let (scale_a, scale_b) = scale.split_at(n);
        for (i, (sigma, scale)) in (1..).zip(sigma_a.iter_mut().zip(scale_a)) {
            *sigma = -scale * filtered(z_y, top_y, i);
        }
        for (i, (sigma, scale)) in sigma_b.iter_mut().zip(scale_b).enumerate() {
            *sigma = scale * filtered(z_u, top_u, i);
        }
    }

    /// Substeps for a step of dt; none where there would be too many.
    pub(super) fn substeps(&self, dt: f64) -> Option<f64> {
        let rho = root_bound(&self.p).max(root_bound(&self.filter));
        let substeps = (rho * dt).ceil().max(1.0);
        (substeps <= MAX_SUBSTEPS).then_some(substeps)
    }

    /// Advances all states over dt with a constant drive. Returns false if there are too many substeps, or if the states overflow: then
    /// they are set to rest.
    pub(super) fn advance(&mut self, drive: f64, dt: f64) -> bool {
        let Some(substeps) = self.substeps(dt) else {
            return false;
        };
        let h = dt / substeps;
        let reach = h * root_bound(&self.p).max(root_bound(&self.filter));
        for _ in 0..substeps as usize {
            self.term.copy_from_slice(&self.state);
            let (mut input, mut size) = (drive, 1.0);
            // Blocks of equal roots make the terms grow with k^2 in addition to the power.
            let mut k = 1.0;
            while size * k * k > 1e-18 {
                self.slope(input);
                for ((term, slope), state) in
                    self.term.iter_mut().zip(&self.slope).zip(&mut self.state)
                {
                    *term = slope * h / k;
                    *state += *term;
                }
                input = 0.0;
                size *= reach / k;
                k += 1.0;
            }
        }
        let finite = self.state.iter().all(|x| x.is_finite());
        if !finite {
            self.reset();
        }
        finite
    }

    /// The derivative of `term` as a state.
    fn slope(&mut self, drive: f64) {
        let (y, u) = self.signals_at(&self.term, drive);
        let (n, ns) = (self.orders.n, self.s.len() - 1);
        let order = n + ns;
        let x = &self.term;
        for i in 0..n {
            let below = if i > 0 { x[i - 1] } else { 0.0 };
            self.slope[i] = below - self.alpha[i] * y + self.beta[i] * u;
        }
        let e = drive - y;
        for i in 0..ns {
            let below = if i > 0 { x[n + i - 1] } else { 0.0 };
            self.slope[n + i] = below + (self.r[i] * e - self.s[i] * u) / self.s[ns];
        }
        for (from, input) in [(order, y), (2 * order, u)] {
            let z = &x[from..from + order];
            let slope = &mut self.slope[from..from + order];
            let (last, inner) = match slope.split_last_mut() {
                Some(parts) => parts,
                None => return,
            };
            inner.copy_from_slice(&z[1..]);
            let known: f64 = self.filter.iter().zip(z).map(|(c, z)| c * z).sum();
            *last = (input - known) / self.filter[order];
        }
    }
}

/// `A S + B R`.
fn characteristic(p: &mut [f64], theta: &[f64], n: usize, r: &[f64], s: &[f64]) {
    p.fill(0.0);
    let (a, b) = theta.split_at(n);
    for (i, a) in std::iter::once(&1.0).chain(a).enumerate() {
        for (p, s) in p[i..].iter_mut().zip(s) {
            *p += a * s;
        }
    }
    for (i, b) in b.iter().enumerate() {
        for (p, r) in p[i..].iter_mut().zip(r) {
            *p += b * r;
        }
    }
}

/// An upper bound of the modulus of all roots.
fn root_bound(p: &[f64]) -> f64 {
    let (Some(leading), n) = (p.last(), p.len() - 1) else {
        return 0.0;
    };
    let at = |(i, c): (usize, &f64)| {
        let half = if i == 0 { 0.5 } else { 1.0 };
        let ratio = (half * c / leading).abs();
        match n - i {
            1 => ratio,
            2 => ratio.sqrt(),
            k => ratio.powf(1.0 / k as f64),
        }
    };
    let bound = p[..n].iter().enumerate().map(at).fold(0.0, f64::max);
    2.0 * bound
}

#[cfg(test)]
mod tests {
    use ct_lti::Hold;

    use super::*;
    use crate::{LoopSimulator, PlantModel};

    /// With constant parameters the recursion equals the simulation of the batch fit, to rounding: y^ and all sensitivities, for any step.
    #[test]
    fn as_the_exact_simulation() {
        let pid = Controller::pid(0.3, 0.004, 4.0, 10.0).unwrap();
        let loops = [
            (
                vec![110.0],
                vec![6.0],
                Controller::pi(0.2292, 0.0021).unwrap(),
            ),
            (vec![210.0, 9000.0], vec![5.0, 40.0], pid.clone()),
            (
                vec![210.0, 9000.0],
                vec![5.0, 40.0, 300.0],
                pid.with_sensor_filter(0.2).unwrap(),
            ),
            (
                vec![230.0, 13_000.0, 180_000.0],
                vec![5.0, 40.0],
                Controller::pi(0.3, 0.004).unwrap(),
            ),
            (vec![210.0, 9000.0], vec![5.0, 40.0], Controller::none()),
            (
                vec![20.0],
                vec![2.0, 3.0],
                Controller::new(1.5.into(), 1.0.into()).unwrap(),
            ),
        ];
        for (a, b, controller) in loops {
            let plant = PlantModel::new(&a, &b).unwrap();
            // 300 is many times the fastest time constant.
            for step in [0.5, 4.0, 300.0] {
                let mut exact = LoopSimulator::new(&plant, &controller, Hold::Zero, step).unwrap();
                let mut moving = MovingLoop::new(plant.orders(), &controller);
                moving.set(plant.theta(), true);
                let drive: Vec<f64> = (0..60).map(|k| f64::from(k * k % 11) - 5.0).collect();
                let block = exact.sensitivities(&drive);
                let p = plant.theta().len();
                let (ones, mut sigma) = (vec![1.0; p], vec![0.0; p]);
                let size = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
                for (k, &r) in drive.iter().enumerate() {
                    let (y, _) = moving.signals(r);
                    assert!(
                        (y - block.y()[k]).abs() < 1e-11 * size(block.y()),
                        "{plant:?} {step}"
                    );
                    moving.sensitivities(r, &ones, &mut sigma);
                    for (j, sigma) in sigma.iter().enumerate() {
                        let exact = block.sigma(j);
                        assert!(
                            (sigma - exact[k]).abs() < 1e-10 * size(exact),
                            "{plant:?} {step}: sigma {j} at {k}: {sigma} {}",
                            exact[k]
                        );
                    }
                    assert!(moving.advance(r, step));
                }
            }
        }
    }

    #[test]
    fn bound_of_the_roots() {
        assert_eq!(root_bound(&[3.0]), 0.0);
        // (p + 1)(p + 10)
        assert!((10.0..40.0).contains(&root_bound(&[10.0, 11.0, 1.0])));
        assert!(root_bound(&[0.0, 0.0, 1.0]) == 0.0);
    }
}
