//! The algorithm, from records to a verdict.

use std::time::Instant;

use ct_signals::{ArModel, Record};
use greybox::{Fit, coloured};
use plants::EffectInfo;
use rayon::prelude::*;

use crate::{
    ControlLoop, Diagnosis, Error, NoiseFloor, Options, Problem, Progress, Score, Shown, Step,
    Verdict,
    doubt::doubt,
    find::{Found, find, shortened},
    groups::groups,
    node::{Node, refine},
    noise_floor::{NOISE_ORDER, residual_colour, slowness},
    problem::{STOPPING, base},
    remains::{Left, Remains, remains},
    scores::{price_of_colour, scores},
    sentences, step,
    trail::trail,
    unknown::unknown,
};

/// Where something remains that is not noise, effects are the answer if they explain this part at least of the mean
/// square above the noise floor.
///
/// The tests that confirm an effect take what remains for noise. Against a disturbance from outside, which is none, their
/// probabilities do not hold: whatever effect happens to resemble it is "beyond chance". Over records of nine
/// simulated disturbances such effects imitate up to six sevenths of one as a rule; a true effect beside which something small
/// remains explains nineteen twentieths and more.
const FAIR_PART: f64 = 0.9;

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
    let (base, control_loop) = base(problem, options)?;
    let found = find(&base, options.max_effects, &tell)?;
    let doubted = doubt(&base, &found)?;
    let mut confirmed = doubted.confirmed;
    let needed = confirmed.added.len();
    let stopped = needed > options.max_effects;
    if stopped {
        let most = options.max_effects;
        confirmed = shortened(confirmed, &found.grown.sizes, most, &found.noise)?;
    }

    tell("telling apart", 1, 3);
    let jumped = doubted.jumped.map(|jump| jump.left(&problem.records[0]));
    let mut course = course(&base, &confirmed, &found, jumped, stopped)?;
    let mut floor = floor(
        &found.noise,
        if needed == found.richest.added.len() && !stopped {
            "the residual of the final model"
        } else {
            "the residual of the richest model that was tried"
        },
    );
    if course.left.is_some() && !stopped {
        floor = floor.of_what_is_new();
    }
    // The metric in which single effects were refitted last: a noise that is white has the same one whatever its size.
    let white = ArModel::white(1.0);
    let (metric, believed) = if found.by_simulation || found.noise.order() == 0 {
        (&white, &base)
    } else {
        (&found.noise, &found.base)
    };
    let single = found.grown.singles(metric);
    // What leaves the greater part of the error to something else is a remark, and not the answer.
    let beside = course
        .left
        .filter(|_| !stopped && !course.last().added.is_empty());
    let fair = match beside {
        Some(left) => explained(&base, course.last(), left.above(&found.noise))? >= FAIR_PART,
        None => true,
    };
    let mut groups = Vec::new();
    if fair {
        let (metric, per_sample) = if found.by_simulation || stopped {
            let last = course.last();
            let residuals = last.setup.disturbance(&last.fit.x)?;
            (&white, slowness(&residual_colour(&residuals)?))
        } else {
            (&found.noise, 1.0)
        };
        let same_metric = found.by_simulation || !stopped || found.noise.order() == 0;
        let single = same_metric.then_some(single.as_slice());
        let last = refine(course.last(), metric, &[])?;
        groups = self::groups(&last, metric, per_sample, single)?;
    }
    // Nor is, beside something else, what an effect of the clock explains as well: that is some course of time, and
    // whatever is left may have made it.
    let by_clock = |id: &String| EffectInfo::find(id).is_some_and(|effect| effect.by_clock);
    let mut remark = None;
    if !fair || beside.is_some() && groups.iter().flatten().any(by_clock) {
        remark = Some(sentences::of_a_part(
            course.last(),
            &problem.records[0].output.unit,
        ));
        course = Course {
            left: remains(&base, &doubted.own_base)?,
            own: doubted.own_base,
            nodes: vec![course.nodes.swap_remove(0)],
        };
        groups.clear();
    }

    tell("telling apart", 2, 3);
    let scores = scores(believed, &single, metric);
    let price = price_of_colour(&found.base, &single, &found.noise);
    let widen = ControlLoop::widens(control_loop.as_ref());
    let steps = course.steps(&floor, problem, widen)?;
    let Course { left, .. } = course;
    let last = course.last();
    let verdict = match (last.added.is_empty(), left) {
        (true, Some(_)) => Verdict::Unexplained,
        (true, None) if remark.is_some() => Verdict::Unexplained,
        (true, None) => Verdict::Adequate,
        (false, _) if groups.iter().any(|group| group.len() > 1) => Verdict::Undecided,
        (false, _) => Verdict::Effect,
    };
    let mut diagnosis = assemble(problem, verdict, steps, floor);
    diagnosis.effects = last
        .added
        .iter()
        .map(|placed| placed.effect.id.to_string())
        .collect();
    diagnosis.in_doubt = last
        .added
        .iter()
        .map(|placed| last.at_the_edge(*placed))
        .collect();
    diagnosis.residual_unexplained = left.is_some() || verdict == Verdict::Unexplained;
    diagnosis.groups = groups;
    diagnosis.ranked = ranked(&scores, verdict);
    diagnosis.scores = scores;
    if left.is_some() && !stopped {
        tell("shaping the unknown", 2, 3);
        diagnosis.unknown = unknown(last)?;
    }
    diagnosis.sentences = sentences::of_diagnosis(&diagnosis, left);
    let held_out = sentences::of_held_out(&diagnosis);
    let minimum = sentences::of_a_minimum(&diagnosis);
    let terms = sentences::of_terms(problem);
    let stop = stopped.then(|| sentences::of_a_stop(options.max_effects, needed));
    let colour = price.and_then(sentences::of_the_colour);
    let more = [remark, held_out, minimum, stop, terms, colour];
    diagnosis.sentences.extend(more.into_iter().flatten());
    diagnosis.speak_of_the_loop(control_loop);
    diagnosis.seconds = begun.elapsed().as_secs_f64();
    tell("done", 3, 3);
    Ok(diagnosis)
}

/// The models from the believed one to the last, and what the last one leaves.
struct Course<'a> {
    /// At least the believed one.
    nodes: Vec<Node<'a>>,
    /// The last one with the colour of its own residual.
    own: Fit,
    left: Option<Left>,
}

impl<'a> Course<'a> {
    fn last(&self) -> &Node<'a> {
        &self.nodes[self.nodes.len() - 1]
    }

    /// What is reported of each model.
    fn steps(
        &self,
        floor: &NoiseFloor,
        problem: &Problem,
        widen: bool,
    ) -> Result<Vec<Step>, Error> {
        let judge = floor.model()?;
        self.nodes
            .par_iter()
            .enumerate()
            .map(|(k, node)| {
                let bic = if k + 1 == self.nodes.len() {
                    self.own.bic()
                } else {
                    coloured(&node.setup, node.fit.clone(), NOISE_ORDER, STOPPING)?.bic()
                };
                step::report(node, bic, &judge, &problem.test, widen)
            })
            .collect()
    }
}

/// The trail to what is confirmed; `jumped`: what a jump of the reading leaves, where that is what there is.
fn course<'a>(
    base: &Node<'a>,
    confirmed: &Node<'a>,
    found: &Found<'a>,
    jumped: Option<Left>,
    stopped: bool,
) -> Result<Course<'a>, Error> {
    let mut nodes = trail(base, confirmed, &ArModel::white(1.0))?;
    let mut last = nodes.pop().unwrap_or_else(|| base.clone());
    let in_noise = if found.by_simulation || stopped {
        last.clone()
    } else {
        // The trail is shorter where an effect could not be simulated beside the others.
        let whole = last.added.len() == confirmed.added.len();
        let ends: Vec<_> = whole.then(|| last.fit.x.clone()).into_iter().collect();
        refine(confirmed, &found.noise, &ends)?
    };
    let own = coloured(&in_noise.setup, in_noise.fit, NOISE_ORDER, STOPPING)?;
    // That the residual wanders says less than that it jumps.
    let left = match remains(&last, &own)? {
        Some(left) if !matches!(left.what, Remains::Slow(..)) => Some(left),
        left => jumped.or(left),
    };
    // The last model is shown in the noise's metric, where its parameters are best known; a model that lacks
    // something is not: a metric that takes what it lacks for noise would let its simulation drift off.
    if !found.wandering && !stopped && left.is_none() {
        last.fit = own.clone().continuing(&last.fit);
    }
    nodes.push(last);
    Ok(Course { nodes, own, left })
}

/// The part of what stands above the noise floor, in mean square, that a model explains of its base.
fn explained(base: &Node, last: &Node, floor: f64) -> Result<f64, Error> {
    let mean_square = |node: &Node| -> Result<f64, Error> {
        let series = node.setup.disturbance(&node.fit.x)?.concat();
        Ok(series.iter().map(|e| e * e).sum::<f64>() / series.len().max(1) as f64)
    };
    let (before, after) = (mean_square(base)?, mean_square(last)?);
    // A slow noise may be larger in the long run than it was in the record.
    let floor = after.min(floor * floor);
    Ok((before - after) / (before - floor).max(f64::MIN_POSITIVE))
}

/// The single effects best first, each once; `none` first where nothing is missing.
fn ranked(scores: &[Score], verdict: Verdict) -> Vec<String> {
    let mut ranked: Vec<String> = Vec::new();
    if verdict == Verdict::Adequate {
        ranked.push("none".to_string());
    }
    for score in scores {
        if !ranked.contains(&score.effect) {
            ranked.push(score.effect.clone());
        }
    }
    ranked
}

pub(crate) fn floor(noise: &ArModel, source: &str) -> NoiseFloor {
    NoiseFloor {
        level: noise.stationary_std(),
        innovation: noise.sigma(),
        coefficients: noise.coefficients().to_vec(),
        source: source.to_string(),
    }
}

/// Everything but the findings.
pub(crate) fn assemble(
    problem: &Problem,
    verdict: Verdict,
    steps: Vec<Step>,
    noise: NoiseFloor,
) -> Diagnosis {
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
        in_doubt: Vec::new(),
        residual_unexplained: false,
        ranked: Vec::new(),
        steps,
        noise_floor: noise.level,
        noise,
        scores: Vec::new(),
        unknown: None,
        control_loop: None,
        sentences: Vec::new(),
        plant: problem.plant.id().to_string(),
        known_effects: problem
            .effects
            .iter()
            .map(|placed| placed.effect.id.to_string())
            .chain(problem.terms.iter().map(|term| term.name.clone()))
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
