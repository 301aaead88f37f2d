//! One pass over a record: regressors and instruments of every sample, from parallel filters.
//!
//! Equations: with all signals through the same `1/E(p)`, E monic of degree n, and `c` the initial states,
//! ```text
//! p^n y_f = phi' x + e
//! phi = [-p^i y_f, p^i u_f(t - d), change of the delays, 1_f, p^i pulse_f]
//! ```
//! The column of a delay is `-sum_i beta_i p^{i+1} u_f(t - d)`, the derivative of the equation. y is interpolated linearly between samples.
//! A missing reading is replaced in `y_f` by the model's output on the measured inputs, or by linear interpolation in a first regression
//! without a model; the row is not used. At `E = A` the residual of every other row is `y - y^` for any replacement, so that the
//! estimates solve the equations of the available readings: those of output error (for white noise) or of generalised least squares.
//!
//! The instruments z are the regressors of the simulated output, in a loop with an input that is simulated from the reference. If E is the A
//! of that simulation, `p^n y_f - phi' x = y - y^` for any course of y between samples, so that the linear interpolation causes no bias once
//! the estimates have converged.

use crate::bank::Bank;
use crate::grid::{Path, Stretch};
use crate::model::Model;
use crate::prepared::{Paths, Prepared};
use crate::{Error, Structure};

/// Source of the instruments.
#[derive(Clone, Copy)]
pub(crate) enum Instruments<'a> {
    /// The regressors themselves: least squares.
    Regressors,
    /// A simulated output, one value for each sample from the first one on.
    Simulated(&'a [f64]),
    /// The output of the model, whose A is the denominator of the filter.
    Model,
}

/// Data at a sample.
pub(crate) struct Row<'a> {
    pub(crate) z: &'a [f64],
    pub(crate) phi: &'a [f64],
    /// `p^n y_f`.
    pub(crate) target: f64,
    /// Simulated output for [`Instruments::Model`].
    pub(crate) simulated: f64,
    /// The measured output, or its replacement.
    pub(crate) y: f64,
    /// The reading is missing: the row is not used.
    pub(crate) missing: bool,
}

/// A record with everything that a pass needs.
#[derive(Clone, Copy)]
pub(crate) struct Pass<'a> {
    pub(crate) structure: &'a Structure,
    pub(crate) record: &'a Prepared,
    pub(crate) paths: &'a Paths,
    /// Index of the record.
    pub(crate) index: usize,
    /// First sample that is used: the filters begin there.
    pub(crate) first: usize,
    pub(crate) model: &'a Model,
    /// Whether there are columns of the estimated delays.
    pub(crate) with_delays: bool,
}

impl Pass<'_> {
    /// Entries of a row.
    pub(crate) fn columns(&self) -> usize {
        let structure = self.structure;
        let delays = structure.estimated_delays().count();
        structure.parameters() - if self.with_delays { 0 } else { delays } + structure.of_record()
    }

    /// A filter `1/E` for this record.
    pub(crate) fn bank(&self, e: &[f64]) -> Result<Bank, Error> {
        Bank::new(e, self.paths.lengths.values())
    }

    /// The output of the model, simulated from the instruments' inputs.
    pub(crate) fn simulated(&self) -> Result<Vec<f64>, Error> {
        let bank = self.bank(&self.model.alpha)?;
        let mut simulated = Vec::with_capacity(self.record.len());
        self.rows(&bank, Instruments::Model, |row| {
            simulated.push(row.simulated);
        });
        Ok(simulated)
    }

    /// Passes every row to a function.
    pub(crate) fn rows(&self, bank: &Bank, instruments: Instruments, mut see: impl FnMut(&Row)) {
        let see: &mut dyn FnMut(&Row) = &mut see;
        match self.structure.n {
            1 => self.rows_of::<1>(bank, instruments, see),
            2 => self.rows_of::<2>(bank, instruments, see),
            3 => self.rows_of::<3>(bank, instruments, see),
            4 => self.rows_of::<4>(bank, instruments, see),
            5 => self.rows_of::<5>(bank, instruments, see),
            6 => self.rows_of::<6>(bank, instruments, see),
            7 => self.rows_of::<7>(bank, instruments, see),
            // A structure has no larger order than 8.
            _ => self.rows_of::<8>(bank, instruments, see),
        }
    }

    fn rows_of<const N: usize>(
        &self,
        bank: &Bank,
        instruments: Instruments,
        see: &mut dyn FnMut(&Row),
    ) {
        let structure = self.structure;
        let paths = self.paths;
        let columns = self.columns();
        let (mut phi, mut z) = (vec![0.0; columns], vec![0.0; columns]);
        let zero = [0.0; N];
        let (mut of_y, mut of_simulated, mut of_one) = (zero, zero, zero);
        let mut of_inputs = vec![zero; paths.inputs.len()];
        let mut of_instrument = zero;
        let mut pulse = zero;
        pulse[N - 1] = 1.0;
        let (mut last_simulated, mut last_y) = (0.0, 0.0);
        for k in self.first..self.record.len() {
            let line = |state: &mut [f64; N], from: f64, to: f64| {
                if k > self.first {
                    let length = paths.steps[k - 1];
                    bank.advance(state, &Stretch { length, from, to });
                }
            };
            if k > self.first {
                if structure.offset {
                    line(&mut of_one, 1.0, 1.0);
                }
                if structure.initial_states {
                    line(&mut pulse, 0.0, 0.0);
                }
                let over = |state: &mut [f64; N], path: &Path| {
                    for stretch in path.step(k - 1) {
                        bank.advance(state, stretch);
                    }
                };
                for (state, path) in of_inputs.iter_mut().zip(&paths.inputs) {
                    over(state, path);
                }
                if let Some(path) = &paths.instrument {
                    over(&mut of_instrument, path);
                }
            }
            let used = |j: usize| match &paths.instrument {
                Some(path) if j == 0 => (&of_instrument, path),
                _ => (&of_inputs[j], &paths.inputs[j]),
            };
            let measured = |j: usize| (&of_inputs[j], &paths.inputs[j]);
            let missing = self.record.is_missing(k);
            let y = match instruments {
                Instruments::Model if missing => {
                    self.fill(&mut z, bank, (&zero, measured, &of_one, &pulse), k);
                    self.output(&z)
                }
                _ => self.record.y[k],
            };
            line(&mut of_y, last_y, y);
            last_y = y;
            self.fill(&mut phi, bank, (&of_y, measured, &of_one, &pulse), k);
            let mut simulated = f64::NAN;
            match instruments {
                Instruments::Regressors => z.copy_from_slice(&phi),
                Instruments::Simulated(_) | Instruments::Model => {
                    self.fill(&mut z, bank, (&zero, used, &of_one, &pulse), k);
                    simulated = match instruments {
                        Instruments::Simulated(values) => values[k - self.first],
                        // Without terms of y, and with zero change of the delays.
                        _ => self.output(&z),
                    };
                    if k > self.first {
                        let stretch = Stretch {
                            length: paths.steps[k - 1],
                            from: last_simulated,
                            to: simulated,
                        };
                        bank.advance(&mut of_simulated, &stretch);
                    }
                    last_simulated = simulated;
                    let lowest = structure.lowest();
                    for (z, state) in z.iter_mut().zip(&of_simulated[lowest..]) {
                        *z = -state;
                    }
                }
            }
            see(&Row {
                z: &z,
                phi: &phi,
                target: bank.highest(&of_y, y),
                simulated,
                y,
                missing,
            });
        }
    }

    fn fill<'s, const N: usize>(
        &self,
        row: &mut [f64],
        bank: &Bank,
        (y, input, one, pulse): (
            &[f64; N],
            impl Fn(usize) -> (&'s [f64; N], &'s Path),
            &[f64; N],
            &[f64; N],
        ),
        k: usize,
    ) {
        let structure = self.structure;
        let mut at = 0;
        let mut put = |value: f64| {
            row[at] = value;
            at += 1;
        };
        for state in &y[structure.lowest()..] {
            put(-state);
        }
        for (j, &m) in structure.m.iter().enumerate() {
            let (state, path) = input(j);
            state[..N.min(m + 1)].iter().for_each(|state| put(*state));
            if m == N {
                put(bank.highest(state, path.after(k)));
            }
        }
        if self.with_delays {
            for (j, _) in structure.estimated_delays() {
                let (state, path) = input(j);
                let from: usize = structure.m[..j].iter().map(|m| m + 1).sum();
                let beta = &self.model.beta[from..=from + structure.m[j]];
                let change: f64 = beta
                    .iter()
                    .enumerate()
                    .map(|(i, beta)| {
                        beta * if i + 1 < N {
                            state[i + 1]
                        } else {
                            bank.highest(state, path.before(k))
                        }
                    })
                    .sum();
                put(-change);
            }
        }
        if structure.offset {
            put(one[0]);
        }
        if structure.initial_states {
            pulse.iter().for_each(|state| put(*state));
        }
    }

    /// The output that a row without terms of y gives: the filter's E is the model's A.
    fn output(&self, row: &[f64]) -> f64 {
        let structure = self.structure;
        let skipped = structure.n - structure.lowest();
        let beta = row[skipped..].iter().zip(&self.model.beta);
        let of_record = self.model.of_records.get(self.index);
        let own = row[row.len() - structure.of_record()..].iter();
        let own = own.zip(of_record.into_iter().flatten());
        beta.map(|(s, b)| s * b).sum::<f64>() + own.map(|(s, c)| s * c).sum::<f64>()
    }

    /// The parameters in the order of a row, with no change of the delays.
    pub(crate) fn x(&self) -> Vec<f64> {
        let structure = self.structure;
        let mut x = self.model.alpha[structure.lowest()..].to_vec();
        x.extend_from_slice(&self.model.beta);
        if self.with_delays {
            x.extend(structure.estimated_delays().map(|_| 0.0));
        }
        if let Some(own) = self.model.of_records.get(self.index) {
            x.extend_from_slice(own);
        }
        x
    }
}
