//! The filters `1/E(p)` of all signals, sampled exactly over every length that occurs.
//!
//! States in controllable canonical form: `p^i s/E`, i = 0 to n - 1, of each signal s; `p^n s/E = s - sum e_i p^i s/E`.

use ct_lti::{Hold, Polynomial, StateSpace, TransferFunction};

use crate::Error;
use crate::grid::Stretch;

pub(crate) struct Bank {
    /// `e_0 .. e_{n-1}` of the monic E.
    e: Vec<f64>,
    /// For each length: Phi row by row, then the input matrices for both ends.
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
            e: e.to_vec(),
            tables,
        })
    }

    /// Advances the states of a signal over one interval. N is n.
    #[inline]
    pub(crate) fn advance<const N: usize>(&self, state: &mut [f64; N], stretch: &Stretch) {
        let table = &self.tables[stretch.length * N * (N + 2)..][..N * (N + 2)];
        let (phi, effects) = table.split_at(N * N);
        let (g0, g1) = effects.split_at(N);
        let mut next = [0.0; N];
        for (i, next) in next.iter_mut().enumerate() {
            let row = &phi[i * N..(i + 1) * N];
            let free: f64 = row.iter().zip(&*state).map(|(phi, x)| phi * x).sum();
            *next = free + g0[i] * stretch.from + g1[i] * stretch.to;
        }
        *state = next;
    }

    /// `p^n s/E` where the signal is at `value`.
    #[inline]
    pub(crate) fn highest(&self, state: &[f64], value: f64) -> f64 {
        let rest: f64 = self.e.iter().zip(state).map(|(e, x)| e * x).sum();
        value - rest
    }
}

/// The largest n: passes are compiled for each.
pub(crate) const MOST: usize = 8;
