//! Comparison of the diagnosis of a record with the truth.

use ct_model::effects::{Candidate, Role, apply, candidates, own_candidate, own_candidates};
use ct_model::{Expression, Given};
use ct_signals::{ArModel, noise};
use ctid_examples::model_records::DrivenModel;
use effect_search::{Options, Problem, Verdict, diagnose};
use estimation::Noise;
use greybox::PriorValue;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

use super::drive::{Drive, side_measurements, visited};
use super::{
    CORRELATION, Hidden, Job, Judge, Outcome, bic_of, drawn, outside, own, seed_of, structural,
    values_of,
};

/// The truth has to lower the criterion by this against what lacks (a part of) it, under the noise that made the record.
const DETECTABLE: f64 = 14.0;

/// Models whose criterion differs by less cannot be distinguished.
const SAME: f64 = 6.0;

/// A disturbance from outside can resemble an effect: the record counts if the truth is better than the result by this.
const BEYOND: f64 = 40.0;

/// Generates a record and diagnoses it.
///
/// # Errors
/// Why it does not count: it cannot be made so, it does not show what is hidden, or what was named imitates it.
pub fn outcome(
    job: &Job,
    models: &[DrivenModel],
    seed: u64,
    options: &Options,
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

    // The hidden effect and its size.
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

    // The believed model.
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
        gaps: None,
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
        left_out: std::collections::BTreeSet::default(),
        controllers: drive.controllers(),
        time_unit: driven.time_unit.0,
        time_unit_name: driven.time_unit.1.to_string(),
    };

    // Results of the true noise model for the truth and for incomplete truths.
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

    let (begun, processor) = (Instant::now(), processor_time());
    let found = diagnose(&problem, options, &|progress| {
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
        "{:?} {:?}, share {:.2}, left {:?}, noise order {:?}, BIC over the truth's: found {:.0}, base {:.0}; {:.1} s{}{}",
        found.verdict,
        found.groups,
        found.share.unwrap_or(f64::NAN),
        found.not_noise,
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
                "\n    loop {:?}\n    believed {:?}, {} of {} starts agree\n    singles {:?}\n    weights {:?}\n    truth {:?}",
                found.control_loop,
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
        elapsed: found.seconds,
        cut_short: !found.left_out.is_empty(),
        told,
    })
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
