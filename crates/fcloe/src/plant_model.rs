//! The estimated plant.
//!
//! Model: `A(p) y = B(p) u`, `A = 1 + a1 p + .. + an p^n`, `B = b0 + b1 p + .. + bm p^m`, `m <= n` (Baysse, Carrillo,
//! Habbadi, (1)). Parameters, in this order everywhere: `theta = [a1, .., an, b0, .., bm]`. A starts with 1, so a
//! plant that integrates is not of this form.

use ct_lti::{Polynomial, TransferFunction};
use serde::{Deserialize, Serialize};

use crate::Error;

/// Orders of A and B.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Orders {
    /// Degree of A, at least 1.
    pub n: usize,
    /// Degree of B, at most n.
    pub m: usize,
}

impl Orders {
    /// `n + m + 1`.
    pub fn parameters(self) -> usize {
        self.n + self.m + 1
    }

    pub(crate) fn check(self) -> Result<(), Error> {
        let Self { n, m } = self;
        match n {
            0 => Err(Error::OrderZero),
            _ if m > n => Err(Error::Improper { n, m }),
            _ => Ok(()),
        }
    }
}

/// A plant with numerical coefficients.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlantModel {
    orders: Orders,
    theta: Vec<f64>,
}

impl PlantModel {
    /// From `a = [a1, .., an]` \[time^i\] and `b = [b0, .., bm]` \[unit of y / unit of u * time^i\].
    ///
    /// # Errors
    /// [`Error::OrderZero`], [`Error::Improper`], [`Error::LeadingZero`] for `a_n = 0`, [`Error::Lti`] for numbers
    /// that are not finite.
    pub fn new(a: &[f64], b: &[f64]) -> Result<Self, Error> {
        let what = "b";
        let m = b.len().checked_sub(1).ok_or(Error::Length {
            what,
            expected: 1,
            found: 0,
        })?;
        Self::from_theta(Orders { n: a.len(), m }, &[a, b].concat())
    }

    /// `K/(1 + tau p)`, tau in \[time\].
    ///
    /// # Errors
    /// As [`PlantModel::new`].
    pub fn first_order(gain: f64, tau: f64) -> Result<Self, Error> {
        Self::new(&[tau], &[gain])
    }

    /// From the vector of parameters, `[a1, .., an, b0, .., bm]`.
    ///
    /// # Errors
    /// As [`PlantModel::new`], and [`Error::Length`].
    pub fn from_theta(orders: Orders, theta: &[f64]) -> Result<Self, Error> {
        orders.check()?;
        let (expected, found) = (orders.parameters(), theta.len());
        if expected != found {
            return Err(Error::Length {
                what: "theta",
                expected,
                found,
            });
        }
        Polynomial::new(theta)?;
        if theta[orders.n - 1] == 0.0 {
            return Err(Error::LeadingZero { n: orders.n });
        }
        Ok(Self {
            orders,
            theta: theta.to_vec(),
        })
    }

    /// n and m.
    pub fn orders(&self) -> Orders {
        self.orders
    }

    /// `[a1, .., an, b0, .., bm]`.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// `[a1, .., an]`.
    pub fn a(&self) -> &[f64] {
        &self.theta[..self.orders.n]
    }

    /// `[b0, .., bm]`.
    pub fn b(&self) -> &[f64] {
        &self.theta[self.orders.n..]
    }

    /// `A(p) = 1 + a1 p + ..`.
    pub fn a_polynomial(&self) -> Polynomial {
        polynomial([&[1.0], self.a()].concat())
    }

    /// `B(p) = b0 + b1 p + ..`.
    pub fn b_polynomial(&self) -> Polynomial {
        polynomial(self.b().to_vec())
    }

    /// `B/A`.
    ///
    /// # Errors
    /// None for a model that was made here; the type is that of [`TransferFunction::new`].
    pub fn transfer_function(&self) -> Result<TransferFunction, Error> {
        Ok(TransferFunction::new(
            self.b_polynomial(),
            self.a_polynomial(),
        )?)
    }
}

/// A polynomial of coefficients that were checked when the model was built.
fn polynomial(c: Vec<f64>) -> Polynomial {
    Polynomial::new(c).unwrap_or_default()
}
