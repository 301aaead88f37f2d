//! Simulation of a known plant on another record from the inputs alone.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::model::Model;
use crate::pass::{Instruments, Pass};
use crate::prepared::{Means, Prepared};
use crate::{Data, Delay, Error, Structure};

/// Singular values below this share of the largest belong to directions without influence on the record.
const UNSEEN: f64 = 1e-9;

/// `A(p) y = sum_j B_j(p) u_j(t - d_j)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plant {
    /// A, from p^0; the last coefficient is not 0.
    pub a: Vec<f64>,
    /// B of each input, from p^0.
    pub b: Vec<Vec<f64>>,
    /// Delay of each input \[time\].
    pub delays: Vec<f64>,
}

impl Plant {
    /// A plant with one input and no delay.
    pub fn new(a: Vec<f64>, b: Vec<f64>) -> Self {
        Self {
            a,
            b: vec![b],
            delays: vec![0.0],
        }
    }

    /// The output of a record, simulated from its inputs only; offset and initial states are fitted to the measured output (least squares over
    /// the available readings). The inputs are assumed constant before the first sample.
    ///
    /// # Errors
    /// [`Error::OrderZero`], [`Error::Improper`], [`Error::Length`], [`Error::NotFinite`], [`Error::NoReading`], [`Error::Time`];
    /// [`Error::Diverges`] where the output is not finite.
    pub fn fitted(&self, record: &Data) -> Result<Vec<f64>, Error> {
        let n = self.a.len().saturating_sub(1);
        let mut structure = Structure::new(
            n,
            self.b
                .iter()
                .map(|b| b.len().max(1) - 1)
                .collect::<Vec<_>>(),
        );
        structure.delays = self.delays.iter().map(|d| Delay::Known(*d)).collect();
        structure.validate()?;
        if let Some(j) = self.b.iter().position(Vec::is_empty) {
            return Err(Error::NoNumerator { input: j + 1 });
        }
        record.validate(self.b.len())?;
        let means = Means::of(std::slice::from_ref(record), true);
        let prepared = Prepared::new(record, means, None);
        let leading = self.a[n];
        let model = Model {
            alpha: self.a[..n].iter().map(|a| a / leading).collect(),
            beta: self.b.iter().flatten().map(|b| b / leading).collect(),
            delays: self.delays.clone(),
            of_records: Vec::new(),
        };
        let pass = Pass {
            structure: &structure,
            record: &prepared,
            paths: &prepared.paths(&self.delays),
            index: 0,
            first: 0,
            model: &model,
            with_delays: false,
        };
        let own = structure.of_record();
        let mut forced = Vec::with_capacity(record.len());
        let mut free = Vec::with_capacity(record.len() * own);
        pass.rows(&pass.bank(&model.alpha)?, Instruments::Model, |row| {
            forced.push(row.simulated);
            free.extend_from_slice(&row.z[row.z.len() - own..]);
        });
        let mut free = DMatrix::from_row_slice(forced.len(), own, &free);
        // Each column is scaled to 1, so that none is lost by rounding.
        for mut column in free.column_iter_mut() {
            let size = column.norm();
            if size > 0.0 {
                column /= size;
            }
        }
        let left = DVector::from_iterator(
            forced.len(),
            prepared.y.iter().zip(&forced).map(|(y, forced)| y - forced),
        );
        let diverges = || Error::Diverges {
            record: record.name.clone(),
        };
        if !free.iter().chain(&left).all(|v| v.is_finite()) {
            return Err(diverges());
        }
        let fit = |free: &DMatrix<f64>, left: &DVector<f64>| {
            let inverse = free.tr_mul(free).pseudo_inverse(UNSEEN);
            inverse.map(|inverse| inverse * free.tr_mul(left))
        };
        let own = match prepared.lacks_readings() {
            false => fit(&free, &left),
            true => {
                let there = (0..record.len()).filter(|k| !prepared.is_missing(*k));
                let there: Vec<usize> = there.collect();
                fit(&free.select_rows(&there), &left.select_rows(&there))
            }
        };
        let fitted = &free * own.map_err(|_| diverges())?;
        let pairs = forced.iter().zip(&fitted);
        let simulated: Vec<f64> = pairs.map(|(a, b)| a + b + prepared.y_mean).collect();
        match simulated.iter().all(|y| y.is_finite()) {
            true => Ok(simulated),
            false => Err(diverges()),
        }
    }
}
