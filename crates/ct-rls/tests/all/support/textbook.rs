//! Recursive least squares in the usual textbook form, with a full covariance, in two variants that differ only in rounding: `P = (P - k
//! g')/lambda` with `g = P phi`, and `P = (P - k phi' P)/lambda`. Test-only.

use nalgebra::{SMatrix, SVector};

/// Product formula for the update of `P`.
#[derive(Clone, Copy, Debug)]
pub enum Form {
    /// `k g'`, `g = P phi`, needed for the gain anyway.
    Outer,
    /// `k phi' P`.
    Product,
}

pub struct Textbook<const P: usize> {
    pub form: Form,
    pub theta: SVector<f64, P>,
    pub p: SMatrix<f64, P, P>,
    pub lambda: f64,
}

impl<const P: usize> Textbook<P> {
    pub fn new(form: Form, p: f64, lambda: f64) -> Self {
        Self {
            form,
            theta: SVector::zeros(),
            p: SMatrix::identity() * p,
            lambda,
        }
    }

    pub fn update(&mut self, phi: &SVector<f64, P>, y: f64) {
        let g = self.p * phi;
        let k = g / (self.lambda + phi.dot(&g));
        self.theta += k * (y - phi.dot(&self.theta));
        let row = match self.form {
            Form::Outer => g.transpose(),
            Form::Product => phi.transpose() * self.p,
        };
        self.p = (self.p - k * row) / self.lambda;
    }

    /// Positive definite up to rounding: by Cholesky's factorisation of the symmetric part.
    pub fn positive_definite(&self) -> bool {
        let symmetric = 0.5 * (self.p + self.p.transpose());
        symmetric.iter().all(|x| x.is_finite()) && symmetric.cholesky().is_some()
    }
}
