//! An integration of the loop that is independent of the crate's, and a drive that excites the loop.
#![allow(dead_code)]

use ct_lti::StateSpace;
use fcloe::{Controller, PlantModel};
use ode_solvers::dop_shared::OutputType;
use ode_solvers::dopri5::Dopri5;
use ode_solvers::{DVector, System};

/// An input with steps to several levels.
pub fn drive(n: usize) -> Vec<f64> {
    (0..n)
        .map(|k| {
            let bits = (k / 7) * (k / 7) % 11 + k / 23;
            [1.0, -0.6, 0.3, -1.0, 0.8][bits % 5]
        })
        .collect()
}

/// Plant, controller and sensor's filter, the drive held.
struct Loop {
    plant: StateSpace,
    law: StateSpace,
    filter: Option<f64>,
    open: bool,
    drive: f64,
}

impl Loop {
    /// `(u, y as recorded)` with all direct terms solved.
    fn signals(&self, x: &[f64]) -> (f64, f64) {
        let (n, s) = (self.plant.order(), self.law.order());
        let (free_y, d) = (self.plant.output(&x[..n], 0.0), self.plant.d());
        if self.open {
            return (self.drive, free_y + d * self.drive);
        }
        let (free_u, k) = (self.law.output(&x[n..n + s], 0.0), self.law.d());
        if self.filter.is_some() {
            let y = x[n + s];
            return (free_u + k * (self.drive - y), y);
        }
        // u = free_u + k (r - free_y - d u).
        let u = (free_u + k * (self.drive - free_y)) / (1.0 + k * d);
        (u, free_y + d * u)
    }
}

impl System<f64, DVector<f64>> for &Loop {
    fn system(&self, _: f64, x: &DVector<f64>, dx: &mut DVector<f64>) {
        let x = x.as_slice();
        let (n, s) = (self.plant.order(), self.law.order());
        let (u, y) = self.signals(x);
        let mut slope = |from: usize, system: &StateSpace, input: f64| {
            let order = system.order();
            for i in 0..order {
                let row = &system.a()[i * order..(i + 1) * order];
                let own: f64 = row.iter().zip(&x[from..]).map(|(a, x)| a * x).sum();
                dx[from + i] = own + system.b()[i] * input;
            }
        };
        slope(0, &self.plant, u);
        slope(n, &self.law, self.drive - y);
        if let Some(zeta) = self.filter {
            dx[n + s] = zeta * (self.plant.output(&x[..n], u) - y);
        }
    }
}

/// y and u at the samples, integrated from each sample to the next.
pub fn integrate(
    plant: &PlantModel,
    controller: &Controller,
    step: f64,
    drive: &[f64],
) -> (Vec<f64>, Vec<f64>) {
    let law = controller.law().unwrap();
    // S' = S (p + zeta): a filter shows in the degree.
    let filtered = controller.s().degree() != law.denominator().degree();
    let filter = filtered.then(|| controller.r().leading() / law.numerator().leading());
    let mut this = Loop {
        plant: StateSpace::controllable(&plant.transfer_function().unwrap()).unwrap(),
        law: StateSpace::controllable(&law).unwrap(),
        filter,
        open: controller.is_open_loop(),
        drive: 0.0,
    };
    let order = this.plant.order() + this.law.order() + usize::from(this.filter.is_some());
    let mut x = DVector::from_element(order, 0.0);
    let (mut ys, mut us) = (Vec::new(), Vec::new());
    for &r in drive {
        this.drive = r;
        let (u, y) = this.signals(x.as_slice());
        ys.push(y);
        us.push(u);
        let mut solver = Dopri5::from_param(
            &this,
            0.0,
            step,
            step,
            x.clone(),
            1e-13,
            1e-15,
            0.9,
            0.04,
            0.2,
            10.0,
            step,
            0.0,
            100_000,
            1000,
            OutputType::Sparse,
        );
        solver.integrate().unwrap();
        x = solver.y_out().last().unwrap().clone();
    }
    (ys, us)
}
