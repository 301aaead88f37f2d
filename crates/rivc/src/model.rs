//! A plant in the monic form, with what belongs to each record.

use ct_lti::Polynomial;

use crate::{Error, Structure};

/// `A = p^n + .. + alpha_0`; with an integrator `alpha_0` is 0.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Model {
    pub(crate) alpha: Vec<f64>,
    /// Coefficients of all inputs, one after the other.
    pub(crate) beta: Vec<f64>,
    /// Delays of all inputs \[time\].
    pub(crate) delays: Vec<f64>,
    /// For each record: the offset, then `c_0 .. c_{n-1}`, if they are estimated.
    pub(crate) of_records: Vec<Vec<f64>>,
}

impl Model {
    /// From `[alpha, beta, change of each estimated delay, ..]` and each record's own unknowns.
    pub(crate) fn from_solution(
        structure: &Structure,
        x: &[f64],
        (delays, estimate_delays): (&[f64], bool),
        of_records: Vec<Vec<f64>>,
    ) -> Self {
        let lowest = structure.lowest();
        let mut alpha = vec![0.0; lowest];
        let (own, x) = x.split_at(structure.n - lowest);
        alpha.extend_from_slice(own);
        let (beta, mut x) = x.split_at(structure.numerators());
        let mut delays = delays.to_vec();
        if estimate_delays {
            for (j, most) in structure.estimated_delays() {
                // Exactly within its limits.
                delays[j] = (delays[j] + x[0]).clamp(0.0, most);
                x = &x[1..];
            }
        }
        Self {
            alpha,
            beta: beta.to_vec(),
            delays,
            of_records,
        }
    }

    /// alpha and beta that are estimated, then delays that are.
    pub(crate) fn core(&self, structure: &Structure) -> Vec<f64> {
        let mut core = self.alpha[structure.lowest()..].to_vec();
        core.extend_from_slice(&self.beta);
        core.extend(structure.estimated_delays().map(|(j, _)| self.delays[j]));
        core
    }

    /// Whether A is Hurwitz, except for the integrator.
    pub(crate) fn is_stable(&self, structure: &Structure) -> bool {
        let mut a = self.alpha[structure.lowest()..].to_vec();
        a.push(1.0);
        a.iter().all(|a| a.is_finite()) && ct_lti::is_hurwitz(&a)
    }

    /// The model with all poles in the left half plane: poles in the right half plane are reflected.
    pub(crate) fn stabilised(mut self, structure: &Structure) -> Result<Self, Error> {
        if self.is_stable(structure) {
            return Ok(self);
        }
        let lowest = structure.lowest();
        let mut a = self.alpha[lowest..].to_vec();
        a.push(1.0);
        let mut roots = Polynomial::new(a)?.roots()?;
        for root in &mut roots {
            root.re = -root.re.abs().max(1e-6 * root.im.abs());
        }
        let mirrored = Polynomial::from_roots(&roots, 1.0)?;
        for (i, alpha) in self.alpha[lowest..].iter_mut().enumerate() {
            *alpha = mirrored.coefficient(i);
        }
        Ok(self)
    }

    /// The mean of this model and another one.
    pub(crate) fn half_way_from(&self, other: &Self) -> Self {
        let half = |new: &[f64], old: &[f64]| -> Vec<f64> {
            new.iter().zip(old).map(|(a, b)| 0.5 * (a + b)).collect()
        };
        Self {
            alpha: half(&self.alpha, &other.alpha),
            beta: half(&self.beta, &other.beta),
            delays: half(&self.delays, &other.delays),
            of_records: self
                .of_records
                .iter()
                .zip(&other.of_records)
                .map(|(new, old)| half(new, old))
                .collect(),
        }
    }

    /// The plant with one more pole, at `-rate`, for a structure whose order is larger by one: the output is nearly the same if the pole is
    /// fast. `lower` is the structure of this model.
    pub(crate) fn with_pole(&self, rate: f64, lower: &Structure, structure: &Structure) -> Self {
        // (p + rate) times a polynomial whose leading coefficient may be left out.
        let times = |c: &[f64], leading: Option<f64>| -> Vec<f64> {
            let all: Vec<f64> = c.iter().copied().chain(leading).collect();
            let of_p = std::iter::once(0.0).chain(all.iter().copied());
            let of_rate = all.iter().map(|c| c * rate).chain([0.0]);
            of_p.zip(of_rate).map(|(a, b)| a + b).collect()
        };
        let mut alpha = times(&self.alpha, Some(1.0));
        alpha.pop();
        let mut beta = Vec::with_capacity(structure.numerators());
        let mut own = self.beta.iter();
        for (m, fewer) in structure.m.iter().zip(&lower.m) {
            beta.extend(own.by_ref().take(fewer + 1).map(|b| b * rate));
            beta.resize(beta.len() + m - fewer, 0.0);
        }
        let of_records = self.of_records.iter().map(|own| {
            let (offset, states) = own.split_at(usize::from(structure.offset));
            let mut own: Vec<f64> = offset.iter().map(|d| d * rate).collect();
            if structure.initial_states {
                own.extend(times(states, None));
            }
            own
        });
        Self {
            alpha,
            beta,
            delays: self.delays.clone(),
            of_records: of_records.collect(),
        }
    }
}
