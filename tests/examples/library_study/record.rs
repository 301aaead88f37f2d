//! Records with something hidden, and what is said of them.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use ct_model::effects::{
    Candidate, Role, Visited, apply, candidates, own_candidate, own_candidates,
};
use ct_model::{Expression, Given, Model, ModelSpec, Simulation};
use ct_signals::{ArModel, Channel, Hold, Record, noise};
use ctid_examples::model_records::DrivenModel;
use effect_search::{Diagnosis, Options, Problem, Verdict, diagnose};
use estimation::{Fit, Noise, Stopping, fit_from};
use greybox::{ModelSetup, PriorValue};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{outside, own};

/// Of one record, its inputs and its outputs, each a series.
type Series = (Vec<Vec<f64>>, Vec<Vec<f64>>);

/// Correlation of coloured noise from row to row.
const CORRELATION: f64 = 0.8;
/// The truth has to lower the criterion by this against what lacks (a part of) it, under the noise that made the record.
const DETECTABLE: f64 = 14.0;
/// Models whose criterion differs by less cannot be told apart.
pub const SAME: f64 = 6.0;
/// What comes from outside may be imitated: it counts where it is better than what was found by this.
const BEYOND: f64 = 40.0;
const FINE: Stopping = Stopping {
    evaluations: 150,
    cost: 1e-10,
};

/// What is hidden.
#[derive(Debug, Clone, PartialEq)]
pub enum Hidden {
    Nothing,
    Effects(Vec<String>),
    Outside(usize),
}

/// A record to be made.
#[derive(Debug, Clone)]
pub struct Job {
    pub model: usize,
    pub kind: &'static str,
    pub hidden: Hidden,
    pub ratio: f64,
    pub coloured: bool,
    pub closed: bool,
    pub number: u64,
}

impl Job {
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
}

/// What was said of a record.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// What is hidden is in the groups, all of it.
    pub in_group: bool,
    pub first: bool,
    pub group: usize,
    pub verdict: Verdict,
    /// What is hidden is in the groups, or what was named fits as well under the noise that made the record.
    pub right: bool,
    pub seconds: f64,
    pub cut_short: bool,
    pub told: String,
}

/// A loop: which input answers to which output, with the gain \[input unit per output unit\] and the integral time in rows.
fn controller(model: &str) -> (usize, usize, f64, f64) {
    match model {
        "heated-block" => (0, 0, 3.0, 25.0),
        "coupled-heaters" => (0, 0, 3.0, 40.0),
        "dc-motor" => (0, 1, 0.08, 15.0),
        // The delay of a row takes more damping from this oscillator than it has where the gain is above 7.
        "mass-spring" => (0, 0, 4.0, 100.0),
        "house" => (0, 0, 1.5, 20.0),
        "bioreactor" => (0, 0, -0.02, 60.0),
        // What is drawn lowers the voltage.
        "battery" => (0, 0, -1.0, 200.0),
        _ => (0, 0, 0.3, 40.0),
    }
}

/// Parameters that the model's file has as known, or as measured beside the record with a relative error.
fn side_measurements(model: &str) -> (&'static [&'static str], &'static [(&'static str, f64)]) {
    match model {
        "heated-block" => (&["C"], &[]),
        "mass-spring" => (&["m"], &[]),
        "coupled-heaters" => (&[], &[("eA", 0.09)]),
        "battery" => (&[], &[("R0", 0.06)]),
        "dc-motor" => (&[], &[("R", 0.04)]),
        _ => (&[], &[]),
    }
}

struct Drive<'a> {
    driven: &'a DrivenModel,
    inputs: Vec<Vec<Vec<f64>>>,
    initial: Vec<Vec<f64>>,
    closed: bool,
}

impl Drive<'_> {
    /// Inputs as they were given, and outputs without noise, of each record.
    #[allow(clippy::type_complexity)]
    fn simulate(&self, spec: &ModelSpec, noise: &[Vec<Vec<f64>>]) -> Option<Vec<Series>> {
        let model = Model::new(spec.clone());
        let parameters = model.parameters();
        let (u, y, gain, rows) = controller(self.driven.name);
        let mut all = Vec::new();
        for (r, (inputs, own)) in self.inputs.iter().zip(&self.initial).enumerate() {
            let mut initial = model.starts(&parameters);
            initial[..own.len()].copy_from_slice(own);
            let mut inputs = inputs.clone();
            let (low, high) = range(&inputs[u]);
            let begin = r as f64 * 1.02 * inputs[u].len() as f64 * self.driven.interval;
            let mut simulation = Simulation::new(&model, &parameters, &initial, begin);
            let mut outputs = vec![Vec::new(); spec.outputs.len()];
            let mut read = vec![0.0; outputs.len()];
            let (mut integral, mut middle) = (0.0, None);
            // A command answers to the reading of the row before: the terminals of a cell follow its current at once.
            let mut measured: Option<f64> = None;
            let rows_of = inputs[u].len();
            for k in 0..rows_of {
                let now = |inputs: &[Vec<f64>], k: usize| -> Vec<f64> {
                    inputs.iter().map(|input| input[k]).collect()
                };
                if let (true, Some(measured)) = (self.closed, measured) {
                    // The reference moves as the command of the open loop does, around where the output began.
                    let reference = *middle.get_or_insert(measured)
                        + 0.5 * (inputs[u][k] - 0.5 * (low + high)) / gain;
                    let error = reference - measured;
                    let command = 0.5 * (low + high) + gain * error + integral;
                    let within = command.clamp(low, high);
                    if within == command {
                        integral += gain * error / rows;
                    }
                    inputs[u][k] = within;
                }
                let from = now(&inputs, k);
                simulation.read(&from, &mut read);
                measured = Some(read[y] + noise.get(r).map_or(0.0, |n| n[y][k]));
                for (output, value) in outputs.iter_mut().zip(&read) {
                    output.push(*value);
                }
                if k + 1 < rows_of {
                    let to = if self.driven.lines && !self.closed {
                        now(&inputs, k + 1)
                    } else {
                        from.clone()
                    };
                    let until = begin + (k + 1) as f64 * self.driven.interval;
                    simulation.advance(&from, &to, until).ok()?;
                }
            }
            if outputs.iter().flatten().any(|v| !v.is_finite()) {
                return None;
            }
            all.push((inputs, outputs));
        }
        Some(all)
    }

    fn records(
        &self,
        spec: &ModelSpec,
        simulated: &[Series],
        noise: &[Vec<Vec<f64>>],
    ) -> Vec<Record> {
        let unit = self.driven.time_unit.0;
        let hold = if self.driven.lines && !self.closed {
            Hold::First
        } else {
            Hold::Zero
        };
        let one = |(r, (inputs, outputs)): (usize, &Series)| {
            let rows = inputs[0].len();
            let begin = r as f64 * 1.02 * rows as f64 * self.driven.interval;
            let channel = |about: &ct_model::About, values: Vec<f64>| {
                Channel::new(&about.name, &about.unit, values)
            };
            let read = outputs.iter().enumerate().map(|(o, values)| {
                let added = |(k, y): (usize, &f64)| y + noise.get(r).map_or(0.0, |n| n[o][k]);
                let values = values.iter().enumerate().map(added).collect();
                channel(spec.about(spec.outputs[o].variable), values)
            });
            let time = |k: usize| (begin + k as f64 * self.driven.interval) * unit;
            Record {
                name: format!("record {}", r + 1),
                time: (0..rows).map(time).collect(),
                inputs: spec
                    .inputs
                    .iter()
                    .zip(inputs)
                    .map(|(input, values)| channel(&input.about, values.clone()).with_hold(hold))
                    .collect(),
                outputs: read.collect(),
                references: Vec::new(),
                calendar: None,
            }
        };
        simulated.iter().enumerate().map(one).collect()
    }
}

fn range(values: &[f64]) -> (f64, f64) {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (low, high)
}

/// A seed from a name.
pub fn seed_of(name: &str) -> u64 {
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

/// What fits are judged by: the noise that made the record.
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

/// Makes a record and diagnoses it; why not, where it cannot be made so.
pub fn outcome(
    job: &Job,
    models: &[DrivenModel],
    seed: u64,
    limit: Duration,
    verbose: bool,
) -> Result<Outcome, String> {
    let driven = &models[job.model];
    let mut rng = ChaCha8Rng::seed_from_u64(seed_of(&job.name(models)) ^ seed);
    let rows = (driven.rows as f64 * rng.random_range(0.7..1.5)) as usize;
    let count = if rng.random::<f64>() < 0.15 { 2 } else { 1 };
    let mut spec = driven.spec.clone();
    for parameter in &mut spec.parameters {
        if parameter.given == Given::Fitted {
            parameter.value *= rng.random_range(0.9..1.1);
        }
    }
    let inputs = (0..count).map(|_| driven.inputs(rows / count, &mut rng));
    let inputs: Result<Vec<_>, _> = inputs.collect();
    let drive = Drive {
        driven,
        inputs: inputs.map_err(|error| error.to_string())?,
        initial: vec![driven.initial.clone(); count],
        closed: job.closed,
    };
    let bare = drive
        .simulate(&spec, &[])
        .ok_or("the model cannot be simulated")?;
    let visited = visited(&spec, &drive, &bare)?;
    let own = own::candidates(driven.name);
    let mut all = candidates(&spec, &visited);
    all.extend(own_candidates(&spec, &own).map_err(|error| error.to_string())?);

    // What is hidden, and its size.
    let mut hidden: Vec<Candidate> = match &job.hidden {
        Hidden::Nothing => Vec::new(),
        Hidden::Effects(ids) => ids
            .iter()
            .filter_map(|id| all.iter().find(|c| c.id == *id).cloned())
            .collect(),
        Hidden::Outside(kind) => {
            let balances: Vec<(usize, f64)> = all
                .iter()
                .filter(|c| c.effect.is_some_and(|effect| effect.id == "constant"))
                .filter_map(|c| {
                    let state = c.id.trim_start_matches("constant(").trim_end_matches(')');
                    let at = spec.states.iter().position(|s| s.about.name == state)?;
                    Some((at, c.parameters[0].starts[0] / 0.05))
                })
                .collect();
            let outer = outside::candidate(*kind, &spec, &visited, &balances, &mut rng);
            vec![own_candidate(&spec, "outer", &outer).map_err(|error| error.to_string())?]
        }
    };
    let wanted = match &job.hidden {
        Hidden::Nothing => 0,
        Hidden::Effects(ids) => ids.len(),
        Hidden::Outside(_) => 1,
    };
    if hidden.len() < wanted {
        return Err("the model cannot have it here".to_string());
    }
    let mut sigma = driven.noise.clone();
    let mut truth = spec.clone();
    if !hidden.is_empty() {
        let mut factor = 1.0;
        let mut done = false;
        let mut values: Vec<Vec<f64>> = hidden
            .iter()
            .map(|c| drawn(c, &visited, &mut rng))
            .collect();
        for _ in 0..10 {
            truth = apply(&spec, &hidden.iter().collect::<Vec<_>>()).map_err(|e| e.to_string())?;
            for (candidate, values) in hidden.iter().zip(&values) {
                for (own, value) in candidate.parameters.iter().zip(values) {
                    let scaled = if own.role == Role::Size {
                        value * factor
                    } else {
                        *value
                    };
                    let place = truth
                        .parameters
                        .iter_mut()
                        .find(|p| p.about.name == own.name);
                    if let Some(place) = place {
                        place.value = scaled.clamp(own.bounds.0, own.bounds.1);
                    }
                }
            }
            let structural = drive.simulate(&truth, &[]).and_then(|simulated| {
                let records = drive.records(&spec, &simulated, &[]);
                structural(driven, &spec, &drive, &records)
            });
            let has_size = hidden
                .iter()
                .any(|c| c.parameters.iter().any(|p| p.role == Role::Size));
            let noise = structural.unwrap_or(f64::INFINITY) / job.ratio;
            let within = if has_size { 0.3..3.0 } else { 0.03..30.0 };
            if within.contains(&noise) {
                for (sigma, own) in sigma.iter_mut().zip(&driven.noise) {
                    *sigma = own * noise;
                }
                done = true;
                break;
            }
            if has_size {
                factor *= if noise < 1.0 {
                    (1.0 / noise.max(1e-3)).min(4.0)
                } else {
                    0.4
                };
            } else {
                values = hidden
                    .iter()
                    .map(|c| drawn(c, &visited, &mut rng))
                    .collect();
            }
        }
        if !done {
            return Err("no size shows so much".to_string());
        }
    }
    let correlation = if job.coloured { CORRELATION } else { 0.0 };
    let added: Vec<Vec<Vec<f64>>> = (0..count)
        .map(|_| {
            let rows = drive.inputs[0][0].len();
            let one = |sigma: &f64| noise::ar1(rows, *sigma, correlation, &mut rng);
            sigma.iter().map(one).collect()
        })
        .collect();
    let simulated = drive
        .simulate(&truth, &added)
        .ok_or("the truth cannot be simulated")?;
    let mut records = drive.records(&spec, &simulated, &added);
    let (cells, slower) = (rng.random::<f64>(), rng.random::<f64>());
    for record in &mut records {
        for (o, output) in record.outputs.iter_mut().enumerate() {
            for (k, value) in output.values.iter_mut().enumerate() {
                let lost = cells < 0.15 && rng.random::<f64>() < 0.06;
                if lost || slower < 0.1 && o > 0 && k % 4 > 0 {
                    *value = f64::NAN;
                }
            }
        }
    }

    // What is believed.
    let (known, priors) = side_measurements(driven.name);
    let mut believed = spec.clone();
    for parameter in &mut believed.parameters {
        if parameter.given == Given::Fitted {
            parameter.value *= rng.random_range(0.6..1.4);
        }
    }
    for (state, own) in believed.states.iter_mut().zip(&driven.initial) {
        if !state.fixed {
            state.start = Expression::Number(own * rng.random_range(0.9..1.1));
            if *own < 0.0 {
                state.start = Expression::Number(0.0);
            }
        }
    }
    let value = |name: &str| {
        let at = spec.parameters.iter().find(|p| p.about.name == name);
        at.map_or(1.0, |p| p.value)
    };
    let problem = Problem {
        spec: believed.clone(),
        kept: std::collections::BTreeMap::default(),
        effects: Vec::new(),
        records,
        test: Vec::new(),
        known: known
            .iter()
            .map(|name| (name.to_string(), value(name)))
            .collect(),
        priors: priors
            .iter()
            .map(|(name, error)| {
                let off: f64 = noise::white(1, 1.0, &mut rng)[0];
                let prior = PriorValue {
                    value: value(name) * (1.0 + error * off),
                    std_error: value(name) * error,
                };
                (name.to_string(), prior)
            })
            .collect(),
        candidates: own,
        time_unit: driven.time_unit.0,
        time_unit_name: driven.time_unit.1.to_string(),
    };

    // What the noise that made it says of the truth and of what lacks a part of it.
    let models_of_noise = sigma.iter().map(|sigma| {
        let innovation = sigma * (1.0 - correlation * correlation).sqrt();
        if correlation > 0.0 {
            ArModel::from_coefficients(&[correlation], innovation)
        } else {
            Ok(ArModel::white(*sigma))
        }
    });
    let models_of_noise: Result<Vec<_>, _> = models_of_noise.collect();
    let judge = Judge {
        problem: &problem,
        sigma: sigma.clone(),
        noise: Noise::of(models_of_noise.map_err(|error| error.to_string())?),
    };
    let of_truth = values_of(&truth, &drive.initial);
    let base = judge
        .fit(&believed, &of_truth)
        .ok_or("the base cannot be fitted")?;
    let best = judge
        .fit(&truth, &of_truth)
        .ok_or("the truth cannot be fitted")?;
    if !hidden.is_empty() {
        let mut least = base.bic() - best.bic();
        if hidden.len() > 1 {
            for part in &hidden {
                let one = apply(&spec, &[part]).map_err(|error| error.to_string())?;
                let one = judge
                    .fit(&one, &of_truth)
                    .ok_or("a part cannot be fitted")?;
                least = least.min(one.bic() - best.bic());
            }
        }
        if least < DETECTABLE {
            return Err("these data do not show it".to_string());
        }
    }

    let options = Options {
        time_limit: Some(limit),
        ..Options::default()
    };
    let (begun, processor) = (Instant::now(), processor_time());
    let found = diagnose(&problem, &options, &|progress| {
        if verbose {
            println!(
                "    {} at {:.1} s",
                progress.phase,
                begun.elapsed().as_secs_f64()
            );
        }
    })
    .map_err(|error| error.to_string())?;
    let seconds = processor_time()
        .zip(processor)
        .map_or(begun.elapsed().as_secs_f64(), |(after, before)| {
            after - before
        });
    let claims = matches!(
        found.verdict,
        Verdict::Effect | Verdict::Undecided | Verdict::Partial
    );
    let named: Vec<&String> = found.groups.iter().flatten().collect();
    let wanted: Vec<String> = match &job.hidden {
        Hidden::Effects(ids) => ids.clone(),
        _ => Vec::new(),
    };
    let bic = bic_of(&judge, &spec, &all, &found);
    let in_group = claims && wanted.iter().all(|id| named.contains(&id));
    let gap = bic.map(|bic| bic - best.bic());
    let as_good =
        claims && found.effects.len() <= wanted.len() && gap.is_some_and(|gap| gap < SAME);
    let right = match &job.hidden {
        Hidden::Nothing => found.verdict == Verdict::Adequate,
        Hidden::Effects(_) => in_group || as_good,
        Hidden::Outside(_) => {
            matches!(found.verdict, Verdict::Unexplained | Verdict::Partial)
        }
    };
    if let (Hidden::Outside(_), false, Some(gap)) = (&job.hidden, right, gap)
        && gap < BEYOND
        && found.verdict != Verdict::Adequate
    {
        return Err("candidates imitate it".to_string());
    }
    hidden.truncate(2);
    let told = format!(
        "{:?} {:?}, left {:?}, noise order {:?}, BIC over the truth's: found {:.0}, base {:.0}; {:.1} s{}{}",
        found.verdict,
        found.groups,
        found.left,
        found
            .noise
            .iter()
            .map(|n| n.coefficients.len())
            .collect::<Vec<_>>(),
        gap.unwrap_or(f64::NAN),
        base.bic() - best.bic(),
        found.seconds,
        if !found.left_out.is_empty() {
            ", cut short"
        } else {
            ""
        },
        if verbose {
            format!(
                "\n    believed {:?}, {} of {} starts agree\n    singles {:?}\n    weights {:?}\n    truth {:?}",
                found.steps[0]
                    .parameters
                    .iter()
                    .zip(
                        spec.parameters
                            .iter()
                            .map(|p| Some(p.value))
                            .chain(std::iter::repeat(None))
                    )
                    .map(|(e, truth)| format!("{} = {:.4e} (true {truth:?})", e.name, e.value))
                    .collect::<Vec<_>>(),
                found.steps[0].starts_agree,
                found.steps[0].starts,
                found
                    .singles
                    .iter()
                    .take(12)
                    .map(|s| format!("{} {:.0}", s.effect, s.bic_gain))
                    .collect::<Vec<_>>(),
                found
                    .noise
                    .iter()
                    .zip(&sigma)
                    .map(|(n, s)| n.level / s)
                    .collect::<Vec<_>>(),
                truth
                    .parameters
                    .iter()
                    .skip(spec.parameters.len())
                    .map(|p| format!("{} = {:.4e}", p.about.name, p.value))
                    .collect::<Vec<_>>(),
            )
        } else {
            String::new()
        }
    );
    Ok(Outcome {
        in_group,
        first: wanted.iter().all(|id| found.effects.contains(id)),
        group: found.groups.iter().map(Vec::len).max().unwrap_or(0),
        verdict: found.verdict,
        right,
        seconds,
        cut_short: !found.left_out.is_empty(),
        told,
    })
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

#[allow(clippy::type_complexity)]
fn visited(spec: &ModelSpec, drive: &Drive, simulated: &[Series]) -> Result<Visited, String> {
    let model = Model::new(spec.clone());
    let mut all: Option<Visited> = None;
    for ((r, (inputs, _)), initial) in simulated.iter().enumerate().zip(&drive.initial) {
        let rows = inputs[0].len();
        let begin = r as f64 * 1.02 * rows as f64 * drive.driven.interval;
        let time: Vec<f64> = (0..rows)
            .map(|k| begin + k as f64 * drive.driven.interval)
            .collect();
        let by_row: Vec<Vec<f64>> = (0..rows)
            .map(|k| inputs.iter().map(|input| input[k]).collect())
            .collect();
        let parameters = model.parameters();
        let own = Visited::of_simulation(
            spec,
            (&parameters, initial),
            &time,
            &by_row,
            drive.driven.time_unit.1,
        )
        .map_err(|error| error.to_string())?;
        match &mut all {
            None => all = Some(own),
            Some(all) => all.join(&own),
        }
    }
    all.ok_or_else(|| "no record".to_string())
}

/// Seconds of processor time that this program has used, where the system says it.
fn processor_time() -> Option<f64> {
    /// Ticks of the system's clock in a second.
    const TICKS: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let behind = text.rsplit_once(')')?.1;
    let fields: Vec<&str> = behind.split_whitespace().collect();
    let ticks = |i: usize| fields.get(i)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / TICKS)
}
