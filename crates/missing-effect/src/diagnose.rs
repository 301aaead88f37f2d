//! The algorithm, from records to a verdict.

use std::collections::BTreeMap;
use std::time::Instant;

use ct_signals::{ArModel, Record};
use greybox::{Setup, Stopping, coloured, fit_from, random_starts, starts_around};
use plants::{Known, Placed, Plant};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{
    Diagnosis, Error, NoiseFloor, Score, Shown, Step, Verdict,
    noise_floor::{NOISE_ORDER, colour, input_shows, slowness, wanders},
    search::{Breadth, Node, exchanges, grow, place, refine, singles, without},
    sentences::sentences,
    step,
};

/// What is to be diagnosed.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The believed plant.
    pub plant: Plant,
    /// What is known of it.
    pub known: Known,
    /// The effects that are on already.
    pub effects: Vec<Placed>,
    /// First guesses, by name: `alpha`, `overflow.rim`.
    pub start: BTreeMap<String, f64>,
    /// Names in `start` that are not fitted.
    pub fixed: Vec<String>,
    /// The records that are fitted together.
    pub records: Vec<Record>,
    /// Records that take no part in any fit or choice and are only scored.
    pub test: Vec<Record>,
}

/// How to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Largest number of effects to add.
    pub max_effects: usize,
    /// Random starts of the base fit, at least ten; more are drawn until the best minimum is found twice.
    pub starts: usize,
    /// Seed of the starts.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            max_effects: 6,
            starts: 12,
            seed: 1,
        }
    }
}

/// How far the computation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub phase: &'static str,
    /// Steps done.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
}

const STOPPING: Stopping = Stopping {
    evaluations: 120,
    cost: 1e-9,
};
/// An effect is accepted where its criterion falls by more than this ...
const BIC_MARGIN: f64 = 6.0;
/// ... and where chance would let so large a fall happen less often than this, counted over all candidates.
const FALSE_CLAIM: f64 = 0.001;
/// What stands in for another lies within this of its criterion.
const GROUP_MARGIN: f64 = 6.0;
/// Probability-weighted sizes: shown at 1 % false alarm with 90 % power.
const VISIBLE: f64 = 2.576 + 1.282;
/// Further starts of every step of the trail: its minimum must not hang on where the search came from.
const STARTS_AROUND: usize = 11;
/// Rounds of further starts where the last model's minimum was found once only.
const MORE_ROUNDS: u64 = 3;
const BREADTH: Breadth = Breadth {
    beam: 3,
    refits: 12,
    most: 6,
};

/// Fits the believed model and says where it fails: a diagnosis of one step without a search.
///
/// # Errors
/// Where the records, the plant or the fit do not allow it.
pub fn compare(problem: &Problem, options: &Options) -> Result<Diagnosis, Error> {
    let begun = Instant::now();
    let base = base(problem, options)?;
    let own = coloured(&base.setup, base.fit.clone(), NOISE_ORDER, STOPPING)?;
    let remains = input_shows(&base)?;
    let base = if remains {
        base
    } else {
        Node {
            fit: own.clone(),
            ..base
        }
    };
    let floor = floor(&own.noise, "the residual of the believed model");
    let step = step::report(&base, &own, floor.level, &problem.test)?;
    let verdict = if remains {
        Verdict::Unexplained
    } else {
        Verdict::Adequate
    };
    let mut diagnosis = assemble(problem, verdict, vec![step], floor);
    diagnosis.sentences = vec![if remains {
        format!(
            "The model does not explain the data: the input still shows in its simulation error of {:.3} {} rms.",
            diagnosis.steps[0].rmse, diagnosis.output_unit
        )
    } else {
        format!(
            "The input does not show in the simulation error of {:.3} {} rms.",
            diagnosis.steps[0].rmse, diagnosis.output_unit
        )
    }];
    diagnosis.seconds = begun.elapsed().as_secs_f64();
    Ok(diagnosis)
}

/// Searches the catalogue for what the believed model is missing.
///
/// # Errors
/// Where the records, the plant or the fit do not allow it.
pub fn diagnose(
    problem: &Problem,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Diagnosis, Error> {
    let begun = Instant::now();
    let tell = |phase, done, total| progress(Progress { phase, done, total });
    tell("fitting the model", 0, 1);
    let base = base(problem, options)?;
    let breadth = Breadth {
        most: options.max_effects.min(BREADTH.most),
        ..BREADTH
    };
    let pays = |before: &Node, after: &Node| after.gain_over(before) > BIC_MARGIN;

    // The richest model in play, by simulation error; its residual gives the noise.
    let white = ArModel::white(1.0);
    let sizes = grow(&base, &white, breadth, pays, &|done, total| {
        tell("searching sets of effects", done, total)
    });
    let richest = chosen(&sizes, &base);
    let richest = refine(&richest, &white, &[])?;
    let noise = colour(&richest)?;

    // Confirm in the metric of the noise.
    tell("confirming", 0, 3);
    let base_noise = in_metric(&base, &noise)?;
    let richest_noise = in_metric(&richest, &noise)?;
    let mut confirmed = confirm(richest_noise, &noise)?;
    let by_simulation = wanders(&richest, &noise) && !confirmed.added.is_empty();
    if noise.order() > 0 && !by_simulation {
        // The noise's colour is known now: the search is repeated in its metric.
        let sizes = grow(&base_noise, &noise, breadth, pays, &|done, total| {
            tell("searching in the noise's metric", done, total);
        });
        let other = confirm(refine(&chosen(&sizes, &base_noise), &noise, &[])?, &noise)?;
        if other.fit.bic() < confirmed.fit.bic() {
            confirmed = other;
        }
    }
    // Each model with the colour of its own residual: what a coloured noise explains needs no effect.
    let own_base = coloured(&base.setup, base.fit.clone(), NOISE_ORDER, STOPPING)?;
    let own_last = coloured(
        &confirmed.setup,
        confirmed.fit.clone(),
        NOISE_ORDER,
        STOPPING,
    )?;
    if !confirmed.added.is_empty() && own_base.bic() - own_last.bic() < BIC_MARGIN {
        confirmed = base_noise.clone();
    }

    tell("telling apart", 1, 3);
    let (metric, per_sample) = if by_simulation {
        (&white, slowness(&noise))
    } else {
        (&noise, 1.0)
    };
    let trail = trail(&base, &confirmed, metric)?;
    let last = trail.last().cloned().unwrap_or_else(|| base.clone());
    let groups = (0..last.added.len())
        .into_par_iter()
        .map(|position| {
            let mut group = vec![last.added[position].effect.id.to_string()];
            for node in exchanges(&last, position, metric)? {
                let stand_in = node.added.last().map_or("", |placed| placed.effect.id);
                // In the white metric a coloured residual counts each sample for less than one.
                let behind = (node.fit.bic() - last.fit.bic()) / per_sample;
                if node.plausible() && behind < GROUP_MARGIN && !group.iter().any(|g| g == stand_in)
                {
                    group.push(stand_in.to_string());
                }
            }
            Ok(group)
        })
        .collect::<Result<Vec<_>, Error>>()?;
    tell("telling apart", 2, 3);
    let single = singles(&trail[0], metric);
    let scores = scores(&trail[0], &single, metric);

    let floor = floor(
        &noise,
        if last.added.len() == richest.added.len() {
            "the residual of the final model"
        } else {
            "the residual of the richest model that was tried"
        },
    );
    let mut steps: Vec<Step> = Vec::new();
    for node in &trail {
        let own = coloured(&node.setup, node.fit.clone(), NOISE_ORDER, STOPPING)?;
        let node = if by_simulation {
            node.clone()
        } else {
            Node {
                fit: own.clone().continuing(&node.fit),
                ..node.clone()
            }
        };
        steps.push(step::report(&node, &own, floor.level, &problem.test)?);
    }
    let last_remains = by_simulation || input_shows(&last)?;
    let verdict = match (last.added.is_empty(), last_remains) {
        (true, true) => Verdict::Unexplained,
        (true, false) => Verdict::Adequate,
        (false, _) if groups.iter().any(|group| group.len() > 1) => Verdict::Undecided,
        (false, _) => Verdict::Effect,
    };
    let mut diagnosis = assemble(problem, verdict, steps, floor);
    diagnosis.effects = last
        .added
        .iter()
        .map(|placed| placed.effect.id.to_string())
        .collect();
    diagnosis.groups = groups;
    let mut ranked: Vec<String> = Vec::new();
    if verdict == Verdict::Adequate {
        ranked.push("none".to_string());
    }
    for score in &scores {
        if !ranked.contains(&score.effect) {
            ranked.push(score.effect.clone());
        }
    }
    diagnosis.ranked = ranked;
    diagnosis.scores = scores;
    diagnosis.sentences = sentences(&diagnosis, last_remains);
    diagnosis.seconds = begun.elapsed().as_secs_f64();
    tell("done", 3, 3);
    Ok(diagnosis)
}

/// The believed model, fitted to simulation error; its best minimum is found at least twice, or 96 starts were tried.
fn base<'a>(problem: &'a Problem, options: &Options) -> Result<Node<'a>, Error> {
    let fixed: BTreeMap<String, f64> = problem
        .fixed
        .iter()
        .filter_map(|name| problem.start.get(name).map(|value| (name.clone(), *value)))
        .collect();
    let mut setup = Setup::from_records(
        problem.plant,
        problem.known.clone(),
        &problem.effects,
        &problem.records,
        fixed,
    )?;
    for record in &problem.records {
        record.require_rows(setup.free().len())?;
    }
    let white = ArModel::white(1.0);
    let mut starts = options.starts.max(10);
    let fit = loop {
        let mut all = random_starts(&setup, starts, options.seed);
        if !problem.start.is_empty() {
            let mut guessed = all[0].clone();
            for (name, value) in setup.names().iter().zip(&mut guessed) {
                *value = problem.start.get(name).copied().unwrap_or(*value);
            }
            all.push(guessed);
        }
        let fit = fit_from(&setup, &all, &white, STOPPING)?;
        if fit.agree >= 2 || starts >= 96 {
            break fit;
        }
        starts *= 2;
    };
    setup.choose_substeps(&fit.x)?;
    // Levels that are not measured are known now: ranges and operating levels follow them.
    setup.structure.scales = setup.scales_at(&fit.x)?;
    let setup = setup.with_structure(setup.structure.clone())?;
    let fit = fit_from(&setup, std::slice::from_ref(&fit.x), &white, STOPPING)?.continuing(&fit);
    Ok(Node {
        setup,
        fit,
        added: Vec::new(),
    })
}

/// The best of all sizes: a larger set must pay for itself against every smaller one.
fn chosen<'a>(sizes: &[Vec<Node<'a>>], base: &Node<'a>) -> Node<'a> {
    sizes
        .iter()
        .skip(1)
        .filter_map(|nodes| nodes.first())
        .fold(base.clone(), |best, node| {
            if node.gain_over(&best) > BIC_MARGIN {
                node.clone()
            } else {
                best
            }
        })
}

/// The same structure refitted in another metric.
fn in_metric<'a>(node: &Node<'a>, noise: &ArModel) -> Result<Node<'a>, Error> {
    refine(node, noise, &[])
}

/// Takes out, one by one, what the noise explains as well.
fn confirm<'a>(mut node: Node<'a>, noise: &ArModel) -> Result<Node<'a>, Error> {
    while !node.added.is_empty() {
        let lacking: Vec<Node<'a>> = (0..node.added.len())
            .into_par_iter()
            .map(|position| without(&node, position, noise))
            .collect::<Result<_, _>>()?;
        let least = lacking
            .into_iter()
            .map(|lacking| (lacking.fit.bic() - node.fit.bic(), lacking))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((loss, lacking)) = least else { break };
        let freedom = (node.fit.parameters - lacking.fit.parameters).max(1) as f64;
        let fall = lacking.fit.deviance - node.fit.deviance;
        let chance = ChiSquared::new(freedom).map_or(1.0, |chi| chi.sf(fall.max(0.0)));
        if loss > BIC_MARGIN && chance * candidates(&lacking) < FALSE_CLAIM {
            break;
        }
        node = lacking;
    }
    Ok(node)
}

/// How many ways the search had to find something where there is nothing: every start of every candidate is one.
fn candidates(node: &Node) -> f64 {
    node.setup
        .structure
        .candidates()
        .into_iter()
        .map(|placed| {
            let site = node.setup.structure.site(placed);
            (placed.effect.parameters)(&site)
                .iter()
                .map(|p| p.starts.len() as f64)
                .product::<f64>()
        })
        .sum()
}

/// The believed model, then one effect after the other, the most telling first.
fn trail<'a>(base: &Node<'a>, last: &Node<'a>, noise: &ArModel) -> Result<Vec<Node<'a>>, Error> {
    let mut trail = vec![in_metric(base, noise)?];
    trail[0].fit = trail[0].fit.clone().continuing(&base.fit);
    let mut left = last.added.clone();
    while !left.is_empty() {
        let parent = &trail[trail.len() - 1];
        let best = left
            .par_iter()
            .filter_map(|&placed| place(parent, placed, last, noise))
            .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        let Some(node) = best else { break };
        left.retain(|placed| Some(placed) != node.added.last());
        let mut node = around(&node, noise, trail.len() as u64)?;
        // The model that names the effects is held to the same as the believed one: its minimum is found twice.
        let mut rounds = 0;
        while left.is_empty() && node.fit.agree < 2 && rounds < MORE_ROUNDS {
            rounds += 1;
            node = around(&node, noise, 100 + rounds)?;
        }
        trail.push(node);
    }
    Ok(trail)
}

/// The node's minimum against those that starts around it reach.
fn around<'a>(node: &Node<'a>, noise: &ArModel, seed: u64) -> Result<Node<'a>, Error> {
    refine(
        node,
        noise,
        &starts_around(&node.setup, &node.fit.x, STARTS_AROUND, seed),
    )
}

/// What each single effect does to the believed model.
fn scores(base: &Node, single: &[Node], noise: &ArModel) -> Vec<Score> {
    single
        .iter()
        .filter_map(|node| {
            let placed = *node.added.last()?;
            let leading = node
                .setup
                .structure
                .effect_parameters(placed)
                .into_iter()
                .next()?;
            let name = format!("{}.{}", placed.effect.id, leading.name);
            let parameters = step::parameters(&node.setup, &node.fit);
            let at = node.setup.names().iter().position(|known| *known == name)?;
            // What the data would show of it: at "absent", where that has a derivative.
            let mut x = node.fit.x.clone();
            let visible = leading.absent.is_finite().then(|| {
                for (name, value) in node.setup.names().iter().zip(&mut x) {
                    if let Some(known) = base.setup.names().iter().position(|known| known == name) {
                        *value = base.fit.x[known];
                    }
                }
                x[at] = leading.absent;
                node.setup.linearise(&x, noise)
            });
            let triangle = visible.flatten();
            let column = node.setup.free().iter().position(|&i| i == at)?;
            let projected = triangle.as_ref().map(|triangle| {
                let mut order: Vec<usize> = (0..node.setup.free().len())
                    .filter(|&j| {
                        j != column
                            && base
                                .setup
                                .names()
                                .contains(&node.setup.names()[node.setup.free()[j]])
                    })
                    .collect();
                order.push(column);
                let chosen = triangle.select(&order);
                let last = order.len() - 1;
                (chosen.at(last, last).abs(), chosen.column_norm(last))
            });
            Some(Score {
                effect: placed.effect.id.to_string(),
                place: step::place_name(node, placed),
                bic_gain: node.gain_over(base),
                rmse: node.fit.rmse,
                visibility: projected.map_or(f64::NAN, |(p, j)| if j > 0.0 { p / j } else { 0.0 }),
                size: parameters.get(at).cloned(),
                smallest_visible: projected
                    .filter(|(p, j)| *p > 1e-6 * j)
                    .map(|(p, _)| VISIBLE * node.fit.variance().sqrt() / p),
            })
        })
        .collect()
}

fn floor(noise: &ArModel, source: &str) -> NoiseFloor {
    NoiseFloor {
        level: noise.stationary_std(),
        innovation: noise.sigma(),
        coefficients: noise.coefficients().to_vec(),
        source: source.to_string(),
    }
}

/// Everything but the findings.
fn assemble(problem: &Problem, verdict: Verdict, steps: Vec<Step>, noise: NoiseFloor) -> Diagnosis {
    let shown = |held_out: bool| {
        move |record: &Record| Shown {
            name: record.name.clone(),
            held_out,
            time: record.time.clone(),
            input: record.input.values.clone(),
            output: record.output.values.clone(),
        }
    };
    Diagnosis {
        schema: 1,
        verdict,
        effects: Vec::new(),
        groups: Vec::new(),
        ranked: Vec::new(),
        steps,
        noise_floor: noise.level,
        noise,
        scores: Vec::new(),
        sentences: Vec::new(),
        plant: problem.plant.id().to_string(),
        known_effects: problem
            .effects
            .iter()
            .map(|placed| placed.effect.id.to_string())
            .collect(),
        input_unit: problem.records[0].input.unit.clone(),
        output_unit: problem.records[0].output.unit.clone(),
        records: problem
            .records
            .iter()
            .map(shown(false))
            .chain(problem.test.iter().map(shown(true)))
            .collect(),
        seconds: 0.0,
    }
}
