//! The filters `1/E(p)` of all signals, sampled exactly over every length that occurs.
//!
//! States in controllable canonical form: `p^i s/E`, i = 0 to n - 1, of each signal s; `p^n s/E = s - sum e_i p^i s/E`.

use ct_lti::{Hold, Polynomial, StateSpace, TransferFunction};

use crate::Error;
use crate::grid::Stretch;

pub(crate) struct Bank {
    n: usize,
    /// `e_0 .. e_{n-1}` of the monic E.
    e: Vec<f64>,
    /// For each length: Phi row by row, then the effects of the input at both ends.
    tables: Vec<f64>,
}

impl Bank {
    pub(crate) fn new(e: &[f64], lengths: &[f64]) -> Result<Self, Error> {
        let n = e.len();
        let mut monic = e.to_vec();
        monic.push(1.0);
        let filter = TransferFunction::new(Polynomial::one(), Polynomial::new(monic)?)?;
        let system = StateSpace::controllable(&filter)?;
        let mut tables = Vec::with_capacity(lengths.len() * n * (n + 2));
        for length in lengths {
            let sampled = system.sampled(Hold::First, *length)?;
            tables.extend_from_slice(&sampled.phi);
            tables.extend_from_slice(&sampled.g0);
            tables.extend_from_slice(&sampled.g1);
        }
        Ok(Self {
            n,
            e: e.to_vec(),
            tables,
        })
    }

    /// Moves the states of a signal over one stretch.
    pub(crate) fn advance(&self, state: &mut [f64], stretch: &Stretch) {
        let n = self.n;
        let table = &self.tables[stretch.length * n * (n + 2)..][..n * (n + 2)];
        let (phi, effects) = table.split_at(n * n);
        let (g0, g1) = effects.split_at(n);
        // n is at most a handful.
        let mut next = [0.0; MOST];
        for (i, next) in next[..n].iter_mut().enumerate() {
            let row = &phi[i * n..(i + 1) * n];
            let free: f64 = row.iter().zip(&*state).map(|(phi, x)| phi * x).sum();
            *next = free + g0[i] * stretch.from + g1[i] * stretch.to;
        }
        state.copy_from_slice(&next[..n]);
    }

    /// `p^n s/E` where the signal is at `value`.
    pub(crate) fn highest(&self, state: &[f64], value: f64) -> f64 {
        let rest: f64 = self.e.iter().zip(state).map(|(e, x)| e * x).sum();
        value - rest
    }
}

/// The largest n.
pub(crate) const MOST: usize = 12;
