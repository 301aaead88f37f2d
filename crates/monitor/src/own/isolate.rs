//! Isolation at the ports of a user's own model: the effect of the catalogue, or the user's own candidate, and its onset, that explains the
//! latest rows.
//!
//! An effect that begins at row `j` is fitted to the rows from `j` on, prewhitened by the learned noise model. The parameters of the learned
//! model and its states at row `j` are fixed; only the effect's parameters and the initial values of the states that it adds are fitted.
//! With `S` the sum of squares of the whitened residual over the noise variance, from row `j` on, without the effect and with it,
//! ```text
//! evidence = S_without - S_with - (parameters + 1) ln n
//! ```
//! is the fall of the Bayesian information criterion. The onset counts as a parameter; `n` is the number of stored rows times that of the
//! outputs. The onsets that are tried lie around the one that was estimated without an assumption about the effect ([`super::onset`]).
//!
//! **Cost**, for each effect, port and onset, in simulations of the rows from the onset on: one for each start (2 to 18, with backlash
//! 24), and at most 8 evaluations in each fit from the best [`STARTS`] starts; at most 40 in each fit of a candidate of the user's own.

use std::collections::BTreeMap;

use ct_model::effects::{Candidate, Place, Role, Visited, apply, best_of_each_choice, candidates};
use ct_model::{Model, ModelSpec, State};
use ct_signals::{Hold, Record};
use estimation::{Noise, Start, fit_from, squares, within};
use greybox::ModelSetup;
use rayon::prelude::*;

use super::{CandidateModel, OwnModel};
use crate::isolate::{FEWEST, FINE, Left, ROUGH};
use crate::{Each, isolate::Kept, learn::Learned, learn::record};

/// Effects that can begin while a plant runs. The model's shape, a wrong law or a lag are not among them.
const BEGIN: [&str; 11] = [
    "dead_zone",
    "saturation",
    "backlash",
    "gain_drift",
    "offset",
    "drift",
    "constant",
    "loss",
    "limit",
    "coupling",
    "leak_at_height",
];
/// A step of a parameter has the same property.
const STEP: &str = "step";
/// Onsets that are tried, in rows after the one that is found first.
const AROUND: [f64; 5] = [1.0, 0.6, 0.8, 1.25, 1.6];
/// Number of starts that are fitted for an effect, those with the least sum of squares, and the best one of each other choice (an upper or a
/// lower limit).
const STARTS: usize = 3;
/// Number of the user's own candidates that are tried at every onset. The candidates with the largest improvement at the first onset are
/// chosen: a file may contain hundreds, and computing time per row is limited.
const OWN: usize = 16;

/// An effect that explains the latest rows, as well as it can.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Suspect {
    pub effect: String,
    pub evidence: f64,
    /// \[s\]
    pub since: f64,
    /// Size of the effect: name, value, unit.
    pub size: (String, f64, String),
    /// Whether the size is inside its bounds.
    pub plausible: bool,
    pub left: Left,
}

/// Whether an effect may begin at an instant.
fn begins(candidate: &Candidate) -> bool {
    let Some(effect) = candidate.effect else {
        return false;
    };
    BEGIN.contains(&effect.id) || effect.id == STEP && effect.place == Place::Parameter
}

/// Every effect that may have begun, best first: implausible sizes come last. `since`: the onset that was found first \[s\]; the noise of
/// each output is `growth` times the learned noise.
pub(super) fn isolate(
    own: &OwnModel,
    learned: &Learned,
    hold: Hold,
    rows: &[Kept],
    growth: &Each<f64>,
    since: f64,
) -> Vec<Suspect> {
    let Some(noise) = learned.noise() else {
        return Vec::new();
    };
    let behind = rows.len() - rows.partition_point(|kept| kept.sample.time < since);
    let lengths = AROUND.map(|share| ((share * behind as f64).round() as usize).max(FEWEST));
    let mut lengths: Vec<usize> = lengths.into_iter().map(|n| n.min(rows.len())).collect();
    lengths.sort_unstable();
    lengths.dedup();
    let sigmas = learned.outputs.iter().zip(growth);
    let search = Search {
        own,
        spec: own.model.spec(),
        theta: own.parameters_with(&learned.theta),
        noise,
        sigmas: sigmas
            .map(|(output, growth)| output.sigma * growth)
            .collect(),
        samples: (rows.len() * learned.outputs.len()) as f64,
    };
    let windows: Vec<Window> = lengths
        .into_iter()
        .filter(|length| *length >= FEWEST)
        .filter_map(|length| search.window(&rows[rows.len() - length..], hold))
        .collect();
    let mut suspects: Vec<Suspect> = windows
        .par_iter()
        .flat_map_iter(|window| window.candidates.iter().map(move |c| (window, c)))
        .filter_map(|(window, candidate)| {
            let model = Model::new(apply(search.spec, &[candidate]).ok()?);
            search.suspect(window, candidate, &model)
        })
        .collect();
    suspects.extend(search.of_own(&windows, since));
    suspects.sort_by(|a, b| {
        let keys = (b.plausible, b.evidence).partial_cmp(&(a.plausible, a.evidence));
        keys.unwrap_or(std::cmp::Ordering::Equal)
    });
    // Of several onsets, the one that explains most.
    let mut best: Vec<Suspect> = Vec::with_capacity(suspects.len());
    for suspect in suspects {
        if best.iter().all(|known| known.effect != suspect.effect) {
            best.push(suspect);
        }
    }
    best
}

/// The rows after an onset.
struct Window {
    /// Onset \[s\].
    since: f64,
    records: [Record; 1],
    states: Vec<f64>,
    /// Sum of squares of the learned model.
    without: f64,
    candidates: Vec<Candidate>,
}

struct Search<'s> {
    own: &'s OwnModel,
    spec: &'s ModelSpec,
    /// All parameters of the learned model.
    theta: Vec<f64>,
    pub(super) noise: Noise,
    /// Standard deviation of each output's innovations.
    pub(super) sigmas: Vec<f64>,
    /// Number of stored rows times outputs.
    samples: f64,
}

impl Search<'_> {
    fn window(&self, rows: &[Kept], hold: Hold) -> Option<Window> {
        let first = rows.first()?;
        let reading = |output: usize| {
            let readings = rows.iter().map(|kept| kept.sample.outputs[output]);
            readings
                .map(|reading| reading.unwrap_or(f64::NAN))
                .collect()
        };
        let readings = (0..self.spec.outputs.len()).map(reading).collect();
        let inputs = self.spec.inputs.len();
        let records = [record(
            rows.iter().map(|kept| &kept.sample),
            inputs,
            readings,
            hold,
        )];
        let states = first.states.to_vec();
        let setup = self.setup(&self.own.model, &records, &BTreeMap::new())?;
        let x = self.vector(&setup, &states);
        let without = squares(&setup, &x, &self.noise)?.cost() / self.sigmas.first()?.powi(2);
        let by_row = |k: usize| records[0].inputs.iter().map(|u| u.values[k]).collect();
        let by_row: Vec<Vec<f64>> = (0..rows.len()).map(by_row).collect();
        let time = setup.model_time(0);
        let visited =
            Visited::of_simulation(self.spec, (&self.theta, &states), &time, &by_row, "s").ok()?;
        let mut candidates = candidates(self.spec, &visited);
        candidates.retain(begins);
        Some(Window {
            since: first.sample.time,
            states,
            without,
            candidates,
            records,
        })
    }

    /// A model in which only the entries that the learned model lacks are fitted, except those that are `known`.
    fn setup<'b>(
        &self,
        model: &'b Model,
        records: &'b [Record],
        known: &BTreeMap<String, f64>,
    ) -> Option<ModelSetup<'b>> {
        let names = self.spec.parameters.iter().map(|p| p.about.name.clone());
        let mut all: BTreeMap<String, f64> = names.zip(self.theta.iter().copied()).collect();
        all.extend(known.clone());
        let setup = ModelSetup::new(model, records, &all, self.own.time_unit).ok()?;
        let first = setup.parameter_count();
        let brought = model.spec().states.iter().enumerate();
        let brought = brought.filter(|(_, state)| self.learned_state(state).is_none());
        let mut free: Vec<usize> = (0..first).collect();
        free.extend(brought.map(|(i, _)| first + i));
        Some(setup.with_free(&free).with_scales(self.sigmas.clone()))
    }

    /// Index of this state in the learned model; `None` for a state of an effect.
    fn learned_state(&self, state: &State) -> Option<usize> {
        let mut learned = self.spec.states.iter();
        learned.position(|own| own.about.name == state.about.name)
    }

    /// Start of a fit: states of the learned model; parameters and states of an effect have their start values.
    fn vector(&self, setup: &ModelSetup, states: &[f64]) -> Vec<f64> {
        let mut x = setup.start().to_vec();
        let first = setup.parameter_count();
        // An effect inserts its states in the order of the chains.
        for (i, state) in setup.model().spec().states.iter().enumerate() {
            if let Some(learned) = self.learned_state(state) {
                x[first + i] = states[learned];
            }
        }
        x
    }

    /// Candidates of the user's own. `since`: the onset that was found first \[s\].
    fn of_own(&self, windows: &[Window], since: f64) -> Vec<Suspect> {
        let first = windows
            .iter()
            .min_by(|a, b| (a.since - since).abs().total_cmp(&(b.since - since).abs()));
        let Some(first) = first else {
            return Vec::new();
        };
        let at = |window: &Window, own: &CandidateModel| {
            self.suspect(window, &own.candidate, &own.model)
        };
        let own = self.own.candidates.par_iter();
        let mut found: Vec<(&CandidateModel, Suspect)> =
            own.filter_map(|own| Some((own, at(first, own)?))).collect();
        found.sort_by(|(_, a), (_, b)| b.evidence.total_cmp(&a.evidence));
        found.truncate(OWN);
        let others: Vec<Suspect> = windows
            .par_iter()
            .filter(|window| window.since != first.since)
            .flat_map_iter(|window| found.iter().filter_map(move |(own, _)| at(window, own)))
            .collect();
        let found = found.into_iter().map(|(_, suspect)| suspect);
        found.chain(others).collect()
    }

    /// A candidate fitted after an onset; `model`: the learned model with the candidate inserted.
    fn suspect(&self, window: &Window, candidate: &Candidate, model: &Model) -> Option<Suspect> {
        let is_step = candidate.effect.is_some_and(|effect| effect.id == STEP);
        // The onset of this candidate is the first row.
        let begin = candidate.record_numbers.get("begin");
        let since = candidate
            .parameters
            .iter()
            .find(|p| is_step && p.role == Role::Shape);
        let known = since
            .zip(begin)
            .map(|(since, begin)| (since.name.clone(), *begin));
        // Until the onset the actuator followed its command.
        let begins = candidate.parameters.iter();
        let begins = begins.filter(|p| p.role == Role::Begin);
        let begins = begins.map(|p| (p.name.clone(), 0.0));
        let known: BTreeMap<String, f64> = known.into_iter().chain(begins).collect();
        let setup = self.setup(model, &window.records, &known)?;
        let own: Vec<(usize, &ct_model::effects::EffectParameter)> = candidate
            .parameters
            .iter()
            .filter_map(|p| {
                let at = setup.names().iter().position(|name| *name == p.name)?;
                Some((at, p))
            })
            .collect();
        let begin = self.vector(&setup, &window.states);
        let of = |x: &[f64]| {
            let squares = squares(&setup, x, &self.noise);
            let cost = squares.map_or(f64::INFINITY, |squares| squares.cost());
            if cost.is_nan() { f64::INFINITY } else { cost }
        };
        let mut starts: Vec<(f64, Vec<f64>)> = Vec::new();
        for values in candidate.starts() {
            let mut x = begin.clone();
            for ((at, parameter), value) in own.iter().zip(values) {
                if !known.contains_key(&parameter.name) {
                    x[*at] = value;
                }
            }
            if starts.iter().all(|(_, known)| *known != x) {
                starts.push((of(&x), x));
            }
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.retain(|(cost, _)| cost.is_finite());
        let choice = |(_, x): &(f64, Vec<f64>)| -> Vec<f64> {
            let choices = own.iter().filter(|(_, p)| p.role == Role::Choice);
            choices.map(|(at, _)| x[*at]).collect()
        };
        let starts = best_of_each_choice(starts, choice, STARTS);
        let starts: Vec<Start> = starts.into_iter().map(|(_, x)| Start::from(x)).collect();
        // The catalogue's starts are shares of the range of the rows; those of the user's own candidates may be far from the actual size.
        let stopping = match candidate.effect {
            Some(_) => ROUGH,
            None => FINE,
        };
        let fit = fit_from(&setup, starts, &self.noise, stopping).ok()?;
        let with = fit.cost / self.sigmas.first()?.powi(2);
        let free = setup.free().len();
        let leading = |(at, p): &&(usize, &ct_model::effects::EffectParameter)| {
            p.role != Role::Choice && setup.free().contains(at)
        };
        // For a candidate of the user's own, the parameter that is zero if the effect is absent, if there is one.
        let is_size = |(_, p): &&(usize, &ct_model::effects::EffectParameter)| {
            candidate.effect.is_none() && matches!(p.role, Role::Size | Role::Threshold)
        };
        let mut sized = own.iter().filter(leading);
        let (at, parameter) = sized.find(is_size).or_else(|| own.iter().find(leading))?;
        let (low, high) = parameter.bounds;
        // A candidate of the user's own may have a bound on one side alone.
        let width = Some(high - low).filter(|width| width.is_finite());
        let start = parameter.starts.first().map(|start| start.abs());
        let room = 1e-6 * width.or(start).unwrap_or(1.0);
        let value = fit.x[*at];
        let inside = |bound: f64, other: f64| {
            !bound.is_finite() || (value - bound).abs() > room || bound == other
        };
        Some(Suspect {
            effect: candidate.id.clone(),
            evidence: window.without - with - (free + 1) as f64 * self.samples.ln(),
            since: window.since,
            size: (
                parameter.short.clone(),
                within(value, (low, high)),
                parameter.unit.clone(),
            ),
            plausible: inside(low, high) && inside(high, low),
            left: Left {
                before: window.without,
                left: with,
                samples: window.records[0].len() * self.sigmas.len(),
            },
        })
    }
}
