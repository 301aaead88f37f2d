//! Records of the model library with a hidden effect, and their diagnoses.

mod drive;
mod jobs;
mod outcome;
mod outside;
mod own;

use std::collections::BTreeMap;

use ct_model::effects::{Candidate, Role, Visited, apply};
use ct_model::{Model, ModelSpec};
use ct_signals::Record;
use ctid_examples::model_records::DrivenModel;
use effect_search::{Diagnosis, Problem, Verdict};
use estimation::{Fit, Noise, Stopping, fit_from};
use greybox::ModelSetup;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use self::drive::{Drive, range, side_measurements};
pub use self::jobs::jobs;
pub use self::outcome::outcome;

/// One simulated record: a series for each input and output, and for the reference of its controller.
struct Series {
    inputs: Vec<Vec<f64>>,
    outputs: Vec<Vec<f64>>,
    reference: Vec<f64>,
}

/// Correlation of coloured noise from row to row.
const CORRELATION: f64 = 0.8;
const FINE: Stopping = Stopping {
    evaluations: 150,
    cost: 1e-10,
};

/// The hidden effect.
#[derive(Debug, Clone, PartialEq)]
pub enum Hidden {
    /// Nothing.
    Nothing,
    /// Effects and candidates of the user's own, by their identifiers.
    Effects(Vec<String>),
    /// A disturbance outside the catalogue and the candidates, by the position of its kind.
    Outside(usize),
}

/// A record to be made.
#[derive(Debug, Clone)]
pub struct Job {
    /// Position of the model among the models of the library.
    pub model: usize,
    /// `single`, `own`, `pair`, `clean` or `outside`.
    pub kind: &'static str,
    /// The hidden effect of the record.
    pub hidden: Hidden,
    /// Structural error over the noise.
    pub ratio: f64,
    /// Whether the noise is coloured.
    pub coloured: bool,
    /// Whether a controller makes the command.
    pub closed: bool,
    /// Makes its name unique.
    pub number: u64,
}

impl Job {
    /// A name for people, from which its random numbers follow.
    #[must_use]
    pub fn name(&self, models: &[DrivenModel]) -> String {
        let hidden = match &self.hidden {
            Hidden::Nothing => "nothing".to_string(),
            Hidden::Effects(ids) => ids.join(" and "),
            Hidden::Outside(kind) => outside::KINDS[*kind].to_string(),
        };
        format!(
            "{}: {hidden}, {}x, {}, {}, {}",
            models[self.model].name,
            self.ratio,
            if self.coloured { "coloured" } else { "white" },
            if self.closed { "closed" } else { "open" },
            self.number
        )
    }

    /// The record of a name, whichever others a study makes; `None` if the name is not that of a record of this kind.
    #[must_use]
    pub fn of_name(kind: &'static str, name: &str, models: &[DrivenModel]) -> Option<Self> {
        let (model, rest) = name.split_once(": ")?;
        let parts: Vec<&str> = rest.rsplitn(5, ", ").collect();
        let &[number, drive, noise, ratio, hidden] = &parts[..] else {
            return None;
        };
        let job = Self {
            model: models.iter().position(|of| of.name == model)?,
            kind,
            hidden: match kind {
                "clean" => Hidden::Nothing,
                "outside" => Hidden::Outside(outside::KINDS.iter().position(|&of| of == hidden)?),
                _ => Hidden::Effects(hidden.split(" and ").map(String::from).collect()),
            },
            ratio: ratio.strip_suffix('x')?.parse().ok()?,
            coloured: noise == "coloured",
            closed: drive == "closed",
            number: number.parse().ok()?,
        };
        (job.name(models) == name).then_some(job)
    }
}

/// Diagnosis of a record.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Whether all hidden effects are in the groups.
    pub in_group: bool,
    /// Whether all hidden effects were named first.
    pub first: bool,
    /// Size of the largest group.
    pub group: usize,
    /// The verdict.
    pub verdict: Verdict,
    /// Whether the hidden effects are in the groups, or the named ones fit as well with the true noise model.
    pub right: bool,
    /// Processor time of the program during the diagnosis, where the system says it \[s\].
    pub seconds: f64,
    /// Time that passed during the diagnosis \[s\].
    pub elapsed: f64,
    /// The time limit left something out.
    pub cut_short: bool,
    /// A line about it.
    pub told: String,
}

/// A seed from a name.
fn seed_of(name: &str) -> u64 {
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    name.bytes().fold(0xcbf2_9ce4_8422_2325, step)
}

/// A value for each parameter of a candidate.
fn drawn(candidate: &Candidate, visited: &Visited, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let upper = rng.random::<f64>() < 0.75;
    let mut values = Vec::new();
    for parameter in &candidate.parameters {
        let starts = &parameter.starts;
        let one = starts[rng.random_range(0..starts.len())];
        let (least, most) = range(starts);
        let (low, high) = parameter.bounds;
        let value = match parameter.role {
            Role::Choice if parameter.short == "side" => {
                if upper {
                    1.0
                } else {
                    -1.0
                }
            }
            Role::Choice => one,
            Role::Begin => rng.random_range(-0.9..0.9),
            Role::Size => one * rng.random_range(-0.5_f64..1.0).exp(),
            Role::Threshold if parameter.short == "limit" || parameter.short == "bound" => {
                let share = rng.random_range(0.05..0.35);
                most - (if upper { share } else { 1.0 - share }) * (most - least)
            }
            Role::Threshold => one * rng.random_range(-0.3_f64..0.5).exp(),
            Role::Shape if parameter.short == "since" => {
                visited.begin + visited.duration * rng.random_range(0.2..0.8)
            }
            Role::Shape if least > 0.0 => {
                (least.ln() + (most / least).ln() * rng.random_range(0.15..0.85)).exp()
            }
            Role::Shape => one,
        };
        values.push(value.clamp(low, high));
    }
    values
}

/// Comparison of fits with the true noise model.
struct Judge<'a> {
    problem: &'a Problem,
    sigma: Vec<f64>,
    noise: Noise,
}

impl Judge<'_> {
    fn fit(&self, spec: &ModelSpec, known: &BTreeMap<String, f64>) -> Option<Fit> {
        let model = Model::new(spec.clone());
        let problem = self.problem;
        let setup =
            ModelSetup::new(&model, &problem.records, &problem.known, problem.time_unit).ok()?;
        let setup = setup.with_priors(&problem.priors).ok()?;
        let setup = setup.with_scales(self.sigma.clone());
        let mut x = setup.start().to_vec();
        for (value, name) in x.iter_mut().zip(setup.names()) {
            if let Some(known) = known.get(name) {
                *value = *known;
            }
        }
        fit_from(&setup, vec![x.into()], &self.noise, FINE).ok()
    }
}

/// Names of the vector's entries with the values that made the record.
fn values_of(spec: &ModelSpec, initial: &[Vec<f64>]) -> BTreeMap<String, f64> {
    let parameters = spec.parameters.iter();
    let mut all: BTreeMap<String, f64> = parameters
        .map(|p| (p.about.name.clone(), p.value))
        .collect();
    for (r, own) in initial.iter().enumerate() {
        for (state, value) in spec.states.iter().zip(own) {
            let name = &state.about.name;
            let name = if initial.len() > 1 {
                format!("{name}(0), record {}", r + 1)
            } else {
                format!("{name}(0)")
            };
            all.insert(name, *value);
        }
    }
    all
}

/// Root mean square of a residual, outputs in units of a noise.
fn weighted(rmse: &[f64], sigma: &[f64]) -> f64 {
    let squares: f64 = rmse.iter().zip(sigma).map(|(e, s)| (e / s).powi(2)).sum();
    (squares / sigma.len() as f64).sqrt()
}

/// The criterion of what was found, under the noise that made the record.
fn bic_of(judge: &Judge, spec: &ModelSpec, all: &[Candidate], found: &Diagnosis) -> Option<f64> {
    let effects: Vec<&Candidate> = found
        .effects
        .iter()
        .filter_map(|id| all.iter().find(|c| c.id == *id))
        .collect();
    let mut model = apply(spec, &effects).ok()?;
    let last = found.steps.last()?;
    let values: BTreeMap<String, f64> = last
        .parameters
        .iter()
        .map(|p| (p.name.clone(), p.value))
        .collect();
    for parameter in &mut model.parameters {
        if let Some(value) = values.get(&parameter.about.name) {
            parameter.value = *value;
        }
    }
    Some(judge.fit(&model, &values)?.bic())
}

/// Root mean square of what the believed structure leaves of a record without noise, outputs in units of their usual noise.
fn structural(
    driven: &DrivenModel,
    spec: &ModelSpec,
    drive: &Drive,
    records: &[Record],
) -> Option<f64> {
    let model = Model::new(spec.clone());
    let (known, _) = side_measurements(driven.name);
    let value = |name: &str| {
        let at = spec.parameters.iter().find(|p| p.about.name == name);
        at.map_or(1.0, |p| p.value)
    };
    let known = known
        .iter()
        .map(|name| (name.to_string(), value(name)))
        .collect();
    let setup = ModelSetup::new(&model, records, &known, driven.time_unit.0).ok()?;
    let setup = setup.with_scales(driven.noise.clone());
    let mut x = setup.start().to_vec();
    let values = values_of(spec, &drive.initial);
    for (entry, name) in x.iter_mut().zip(setup.names()) {
        if let Some(value) = values.get(name) {
            *entry = *value;
        }
    }
    let white = Noise::white(driven.noise.len());
    let fit = fit_from(&setup, vec![x.into()], &white, FINE).ok()?;
    Some(weighted(&fit.rmse, &driven.noise))
}
