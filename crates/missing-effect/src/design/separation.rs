//! Separation of two models by an experiment: the least misfit of one model to the response of the other.
//!
//! [`effect_search::design`] has the noncentrality and its linear form.
//!
//! **The local form** of the literature is `c^2 |p_A|^2 (1 - rho^2) / sigma^2`, `p` the signature of an effect at its absent value,
//! orthogonal to the derivatives by the base's parameters, `rho` the cosine of the angle between the two signatures. It follows from the
//! above where the size `c` is small (then `y_A` less the base is `c j_A`, and B's own derivative is `j_B`) and where no record is there
//! before (`R = 0`): projecting `c j_A` off the base's columns leaves `c p_A`, and off `p_B` as well `c^2 |p_A|^2 (1 - rho^2)`.
//!
//! **In a loop** the command is the one that the controller gives to A without noise, and B answers to it. Simulating B's loop from the
//! reference and filtering by `1 + P C`, as the fits do, comes to the same: `(1 + P_B C)(y_A - y_B) = y_A - P_B u_A` for
//! `y_B = P_B C (r - y_B)` and `u_A = C (r - y_A)`.
//!
//! **The refit** does not linearise: B is fitted to A's simulation of the existing records and of the experiment, both free of
//! noise; from its misfit the one to the existing records alone is taken off. A side measurement (a prior) is there in both, as A would
//! have it read.

use std::collections::BTreeMap;

use ct_signals::Record;
use greybox::{Noise, PriorValue, Setup, Triangle, fit_from, starts_around};

use super::simulated::SimulatedExperiment;
use crate::{
    Error,
    fit::node::{FINE, Node},
};

/// Starts around B's fit, in addition to the fit itself.
const STARTS_AROUND: usize = 4;

/// The noise model for the comparison of both.
#[derive(Debug, Clone)]
pub(crate) struct Metric {
    /// The noise.
    pub noise: Noise,
    /// Standard deviation of the innovations at each output \[output unit\].
    pub scales: Vec<f64>,
}

impl Metric {
    /// Divisor of costs: the innovation variance of the first output, with the scaling of the outputs \[output unit squared\].
    pub fn variance(&self) -> f64 {
        self.scales[0].powi(2)
    }

    /// Standard deviation of the first output's noise \[output unit\].
    pub fn noise_floor(&self) -> f64 {
        let noise = self.noise.output(0);
        noise.stationary_std() / noise.sigma() * self.scales[0]
    }

    /// A setup with other records, in which outputs are weighted by this noise and not by their residuals (a noise-free simulation has
    /// none).
    pub fn with_records<'a, 'b>(
        &self,
        setup: &Setup<'a>,
        records: &'b [Record],
    ) -> Result<Setup<'b>, Error>
    where
        'a: 'b,
    {
        let mut setup = setup.with_records(records)?;
        setup.known_scales = Some(self.scales.clone());
        Ok(setup)
    }
}

/// A model's information on its free parameters from the existing records: rows `[R | 0]`, the initial states eliminated.
pub(crate) fn information(node: &Node, metric: &Metric) -> Triangle {
    let setup = &node.setup;
    // A fit weights its outputs by their own residuals; here the weights are those of the noise model.
    let weighed = || {
        let mut setup = setup.clone();
        setup.known_scales = Some(metric.scales.clone());
        setup.linearise(&node.fit.x, &metric.noise)
    };
    let several = (setup.outputs() > 1).then(weighed).flatten();
    let rows = several.as_ref().unwrap_or(&node.fit.triangle);
    effect_search::design::information(rows, setup.free(), setup.parameter_count())
}

/// A model's vector for an experiment: its parameters, its initial levels, lags at rest.
pub(crate) fn vector(node: &Node, setup: &Setup, simulated: &SimulatedExperiment) -> Vec<f64> {
    let mut x = node.fit.x[..node.setup.parameter_count()].to_vec();
    x.extend(&simulated.initial);
    x.resize(setup.names().len(), 0.0);
    x
}

/// The linear form: the part of an experiment, simulated with one model, that the other model cannot fit.
pub(crate) fn linear(
    simulated: &SimulatedExperiment,
    stand_in: &Node,
    known: &Triangle,
    metric: &Metric,
) -> Option<f64> {
    let records = std::slice::from_ref(&simulated.record);
    let setup = metric.with_records(&stand_in.setup, records).ok()?;
    let x = vector(stand_in, &setup, simulated);
    let rows = setup.linearise(&x, &metric.noise)?;
    Some(effect_search::design::least(&rows, known) / metric.variance())
}

/// Simulation of the existing records by one model.
pub(crate) fn noise_free(truth: &Node) -> Result<Vec<Record>, Error> {
    let mut series = truth.setup.simulate(&truth.fit.x)?.output.into_iter();
    let mut records = truth.setup.records.to_vec();
    for output in records.iter_mut().flat_map(|record| &mut record.outputs) {
        output.values = series.next().unwrap_or_default();
    }
    Ok(records)
}

/// The parameters and the plant's initial states of a model, in the order of a setup without a loop.
pub(crate) fn unlooped(node: &Node) -> Vec<f64> {
    let mut x = node.fit.x[..node.setup.parameter_count()].to_vec();
    for r in 0..node.setup.records.len() {
        x.extend(&node.fit.x[node.setup.plant_states_of(r)]);
    }
    x
}

/// Priors of a model's parameters with the values of another model, without noise like that model's simulation.
pub(crate) fn priors_of_truth(truth: &Node, stand_in: &Node) -> BTreeMap<String, PriorValue> {
    let mut priors = stand_in.setup.prior_values();
    let names = truth.setup.names()[..truth.setup.parameter_count()].iter();
    for (name, value) in names.zip(&truth.fit.x) {
        if let Some(prior) = priors.get_mut(name) {
            prior.value = *value;
        }
    }
    priors
}

/// The misfit of a model to another's simulation of the existing records, refitted \[output unit squared\].
pub(crate) fn misfit_before(
    existing: &[Record],
    truth: &Node,
    stand_in: &Node,
    metric: &Metric,
) -> Result<f64, Error> {
    let setup = metric
        .with_records(&stand_in.setup, existing)?
        .with_priors(&priors_of_truth(truth, stand_in))?;
    Ok(fit_from(&setup, &[unlooped(stand_in)], &metric.noise, FINE)?.cost)
}

/// Separation with the experiment among the records and the parameters refitted, in units of the noise and in excess of the separation
/// `before`.
pub(crate) fn refitted(
    existing: &[Record],
    simulated: &SimulatedExperiment,
    (truth, stand_in): (&Node, &Node),
    before: f64,
    metric: &Metric,
) -> Result<f64, Error> {
    let mut records = existing.to_vec();
    records.push(simulated.record.clone());
    let setup = metric
        .with_records(&stand_in.setup, &records)?
        .with_priors(&priors_of_truth(truth, stand_in))?;
    let mut own = unlooped(stand_in);
    own.extend(&simulated.initial);
    own.resize(setup.names().len(), 0.0);
    let mut starts = starts_around(&setup, &own, STARTS_AROUND, 1);
    starts.push(own);
    let fit = fit_from(&setup, &starts, &metric.noise, FINE)?;
    Ok(((fit.cost - before) / metric.variance()).max(0.0))
}
