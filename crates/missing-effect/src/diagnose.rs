//! The algorithm, from records to a verdict.

use std::{sync::atomic::Ordering, time::Instant};

use ct_signals::{ArModel, Clock};
use greybox::Noise;
use plants::Placed;

use crate::{
    Acceptance, ControlLoop, Diagnosis, Effort, Error, GROUP_MARGIN, NoiseFloor, Options,
    PerOutput, Problem, Progress, Rankings, Score, Shown, Step, Verdict,
    confirm::BIC_MARGIN,
    diagnosis::Floors,
    doubt::doubt,
    find::{Found, find, shortened},
    gaps::Mended,
    judge::{Course, Grade, Judge, PART, WHOLE},
    node::Node,
    partial::largest_part,
    problem::base,
    remains::remains,
    rounding::rounded,
    scores::{price_of_colour, scores},
    sentences,
    sticking::sticks,
    unknown::{self, unknown},
};

/// Shares of the time limit after which the phases end: further starts of the believed model, the search of sets, then all that follows
/// but the report, the fits of the report, and the shape of what is not explained. What each has begun it brings to its end.
pub(crate) const FITTED: f64 = 0.2;
const SEARCHED: f64 = 0.65;
const CONFIRMED: f64 = 0.82;
const REPORTED: f64 = 0.88;
const SHAPED: f64 = 0.95;

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
    problem.check()?;
    let mut diagnosis = match Mended::of(problem, options)? {
        None => diagnose_whole(problem, options, progress)?,
        Some(mended) => {
            let mut diagnosis = diagnose_whole(&mended.problem, options, progress)?;
            mended.report(&mut diagnosis);
            diagnosis
        }
    };
    diagnosis.seconds = begun.elapsed().as_secs_f64();
    Ok(diagnosis)
}

/// The same of records without gaps.
fn diagnose_whole(
    problem: &Problem,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Diagnosis, Error> {
    let tell = |phase, done, total| progress(Progress { phase, done, total });
    tell("fitting the model", 0, 1);
    let (base, control_loop) = base(problem, options, FITTED)?;
    allow(&base, SEARCHED);
    let found = find(&base, options.max_effects, &tell)?;
    allow(&base, CONFIRMED);
    // The weighting in which single effects are ranked: white where the residual wanders, since a noise model takes slow effects for
    // noise.
    let white = base.setup.white_noise();
    let (metric, believed, grown) = match &found.prewhitened {
        Some(grown) if !found.by_simulation && !found.wandering => {
            (&found.noise, &found.base, grown)
        }
        _ => (&white, &base, &found.grown),
    };
    let widen = ControlLoop::widens(control_loop.as_ref());
    let (doubted, single) = rayon::join(|| doubt(&base, &found, widen), || grown.singles(metric));
    let doubted = doubted?;
    let mut confirmed = doubted.confirmed;
    let needed = confirmed.added.len();
    let stopped = needed > options.max_effects;
    if stopped {
        let most = options.max_effects;
        confirmed = shortened(confirmed, &found.grown.sizes, most, &found.noise)?;
    }

    tell("telling apart", 1, 3);
    let jumped = doubted.jumped.map(|jump| jump.left(&problem.records[0]));
    let searched = found.sets();
    let judge = Judge {
        base: &base,
        noise: &found.noise,
        wandering: found.wandering,
        in_loop: widen,
        by_simulation: found.by_simulation,
        stopped,
        jumped,
        singles: &single,
        searched: &searched,
    };
    let (judged, (scores, price)) = rayon::join(
        || judge.judge(confirmed),
        || {
            rayon::join(
                || scores(believed, &single, metric, &innovations(&found.noise)),
                || price_of_colour(&found.base, &single, &found.noise),
            )
        },
    );
    let judged = judged?;
    let (mut course, mut groups) = (judged.course, judged.groups);
    let mut remark = sentences::of_courses(&judged.dropped);
    let mut acceptance = Acceptance {
        effects: ids(&course.last().added),
        share: (!course.last().added.is_empty()).then_some(judged.share),
        share_test: None,
        required: WHOLE,
        required_partial: PART,
        floor: PerOutput::of(&problem.records[0].outputs, &innovations(&found.noise)),
        bic_fall: None,
        required_bic_fall: BIC_MARGIN,
        reasons: Vec::new(),
    };
    let mut partial = false;
    // Noise whose memory had to be limited may hold slow physics; a valve that sticks in a loop makes a limit cycle, which noise with a
    // memory describes.
    let sticking = widen && sticks(&problem.records);
    let unexplained = course.left.is_some() || found.limited || sticking;
    if judged.grade != Grade::Whole || (course.last().added.is_empty() && unexplained) {
        let by_error = found.grown.promising_singles();
        let tested = largest_part(&base, &found, &by_error, &innovations(&found.noise), widen)?;
        if let Some(tested) = &tested {
            acceptance.effects = ids(&tested.node.added);
            acceptance.share = Some(tested.share);
            acceptance.bic_fall = Some(tested.bic_fall);
            acceptance.reasons.clone_from(&tested.reasons);
        }
        match tested.filter(|tested| {
            tested.reasons.is_empty() && tested.node.added.len() <= options.max_effects
        }) {
            Some(tested) => {
                let judge = Judge {
                    wandering: true,
                    by_simulation: true,
                    singles: &by_error,
                    ..judge
                };
                course = judge.course(&tested.node)?;
                groups = judge.groups(course.last())?;
                remark = None;
                partial = true;
            }
            None if judged.grade != Grade::Whole => {
                remark = Some(sentences::of_a_part(course.last()));
                course = Course {
                    left: remains(&base, &doubted.own_base)?,
                    own: doubted.own_base,
                    nodes: vec![course.nodes.swap_remove(0)],
                };
                groups.clear();
            }
            None => {}
        }
    }
    let mut floor = floors(
        problem,
        &found.noise,
        if course.last().added.len() == found.richest.added.len() && !stopped {
            "the residual of the final model"
        } else {
            "the residual of the richest model that was tried"
        },
    );
    let mut rounding = None;
    if !partial
        && course.last().added.len() < options.max_effects
        && let Some(rounded) = rounded(course.last())?
    {
        rounding = Some(sentences::of_rounding(
            &rounded.outputs,
            &problem.records[0].outputs,
        ));
        let longer = judge.longer(course.nodes.clone(), rounded.node)?;
        // What nothing explains stays unexplained where rounding leaves something that is not noise.
        if longer.left.is_none() || !course.last().added.is_empty() {
            course = longer;
            groups.push(rounded.group);
            acceptance.effects = ids(&course.last().added);
            (acceptance.share, acceptance.bic_fall) = (None, None);
            acceptance.reasons.clear();
            remark = remark.filter(|_| course.left.is_some());
        }
    }
    if (course.left.is_some() || partial) && !stopped {
        floor = floor.of_what_is_new();
    }
    let floor = floor.at_most(&course.last().fit.rmse);

    tell("telling apart", 2, 3);
    allow(&base, REPORTED);
    let steps = course.steps(&floor, problem, widen)?;
    let Course { left, .. } = course;
    let last = course.last();
    let verdict = match (last.added.is_empty(), left) {
        (true, Some(_)) => Verdict::Unexplained,
        (true, None) if remark.is_some() => Verdict::Unexplained,
        (true, None) => Verdict::Adequate,
        (false, _) if partial => Verdict::Partial,
        (false, _) if groups.iter().any(|group| group.members.len() > 1) => Verdict::Undecided,
        (false, _) => Verdict::Effect,
    };
    let mut diagnosis = assemble(problem, verdict, steps, floor);
    diagnosis.effects = ids(&last.added);
    diagnosis.in_doubt = last
        .added
        .iter()
        .map(|placed| last.at_the_edge(*placed))
        .collect();
    diagnosis.residual_unexplained = left.is_some() || verdict == Verdict::Unexplained;
    (diagnosis.groups, diagnosis.places) = groups
        .into_iter()
        .map(|group| (group.members, group.places))
        .unzip();
    if verdict != Verdict::Adequate {
        acceptance.share_test = share_on_held_out(&diagnosis.steps, &acceptance.floor);
        acceptance.bic_fall = acceptance.bic_fall.or_else(|| {
            let (first, last) = (diagnosis.steps.first()?, diagnosis.steps.last()?);
            (diagnosis.steps.len() > 1).then_some(first.bic - last.bic)
        });
        diagnosis.acceptance = Some(acceptance);
    }
    diagnosis.rankings = rankings(&found, &base);
    diagnosis.ranked = ranked(&scores, verdict);
    diagnosis.scores = scores;
    allow(&base, SHAPED);
    if left.is_some() && !stopped && !base.setup.leaves_out(unknown::PART) {
        tell("shaping the unknown", 2, 3);
        diagnosis.unknown = unknown(last)?;
    }
    diagnosis.sentences = sentences::of_diagnosis(&diagnosis, left);
    let held_out = sentences::of_held_out(&diagnosis);
    let minimum = sentences::of_a_minimum(&diagnosis);
    let terms = sentences::of_terms(problem);
    let stop = stopped.then(|| sentences::of_a_stop(options.max_effects, needed));
    let colour = price.and_then(sentences::of_the_colour);
    let disagree = sentences::of_rankings(&diagnosis.rankings);
    let more = [
        rounding, remark, held_out, minimum, stop, terms, colour, disagree,
    ];
    diagnosis.sentences.extend(more.into_iter().flatten());
    diagnosis.speak_of_the_loop(control_loop);
    diagnosis.effort = effort(&base, options);
    tell("done", 3, 3);
    Ok(diagnosis)
}

fn ids(added: &[Placed]) -> Vec<String> {
    let ids = added.iter().map(|placed| placed.effect.id.to_string());
    ids.collect()
}

/// Lets the fits of a search go on until this share of its time has passed.
pub(crate) fn allow(node: &Node, share: f64) {
    if let Some(limit) = &node.setup.time_limit {
        limit.allow(share);
    }
}

/// What the time limit left out of a search.
pub(crate) fn effort(node: &Node, options: &Options) -> Effort {
    let limit = node.setup.time_limit.as_ref();
    let interrupted = options
        .interrupt
        .is_some_and(|interrupt| interrupt.load(Ordering::Relaxed));
    Effort {
        limit: options.time_limit.map(|limit| limit.as_secs_f64()),
        left_out: limit.map_or_else(Vec::new, |limit| limit.left_out()),
        interrupted,
    }
}

/// The share of the excess error on held-out records that the last model explains of the first one's.
fn share_on_held_out(steps: &[Step], floor: &PerOutput) -> Option<f64> {
    let [first, .., last] = steps else {
        return None;
    };
    // Over the floor of each output, in their mean.
    let mean_square = |step: &Step| -> Option<f64> {
        let errors = step.rmse_test_per_output.as_ref()?.values();
        let squares = errors.zip(floor.values());
        let sum: f64 = squares.map(|(rmse, floor)| (rmse / floor).powi(2)).sum();
        Some(sum / floor.0.len() as f64)
    };
    let (before, after) = (mean_square(first)?, mean_square(last)?);
    // An error that is noise has no share to explain.
    (before > 1.0).then(|| (before - after) / (before - after.min(1.0)))
}

/// The single effects under both weightings, those that were promising enough for a refit.
fn rankings(found: &Found, base: &Node) -> Rankings {
    let first_of_each = |nodes: &[Node]| {
        let mut ranked: Vec<String> = Vec::new();
        for placed in nodes.iter().filter_map(|node| node.added.last()) {
            if !ranked.iter().any(|known| known == placed.effect.id) {
                ranked.push(placed.effect.id.to_string());
            }
        }
        ranked
    };
    let white = found.grown.promising_singles();
    let Some(grown) = &found.prewhitened else {
        return Rankings {
            white: first_of_each(&white),
            ..Rankings::default()
        };
    };
    let prewhitened = grown.promising_singles();
    // A best effect of the one weighting that is far behind in the other, or does not pay there.
    let behind = |best: &[Node], others: &[Node], base: &Node| {
        let (Some(best), Some(first)) = (best.first(), others.first()) else {
            return false;
        };
        let own = others.iter().find(|other| other.added == best.added);
        first.gain_over(base) > BIC_MARGIN
            && own.is_none_or(|own| first.gain_over(own) > GROUP_MARGIN)
    };
    Rankings {
        disagree: behind(&white, &prewhitened, &found.base) && behind(&prewhitened, &white, base),
        white: first_of_each(&white),
        prewhitened: first_of_each(&prewhitened),
    }
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

/// The noise floors that a noise model stands for.
pub(crate) fn floors(problem: &Problem, noise: &Noise, source: &str) -> Floors {
    let outputs = problem.records[0].outputs.iter().zip(noise.iter());
    let floors = outputs.map(|(output, noise)| NoiseFloor {
        output: output.name.clone(),
        level: noise.stationary_std(),
        innovation: noise.sigma(),
        coefficients: noise.coefficients().to_vec(),
        source: source.to_string(),
    });
    Floors(floors.collect())
}

/// Standard deviation of the innovations at each output.
fn innovations(noise: &Noise) -> Vec<f64> {
    noise.iter().map(ArModel::sigma).collect()
}

/// Everything but the findings.
pub(crate) fn assemble(
    problem: &Problem,
    verdict: Verdict,
    steps: Vec<Step>,
    noise: Floors,
) -> Diagnosis {
    let noise = noise.0;
    let outputs = &problem.records[0].outputs;
    Diagnosis {
        schema: 2,
        verdict,
        effects: Vec::new(),
        groups: Vec::new(),
        in_doubt: Vec::new(),
        places: Vec::new(),
        acceptance: None,
        rankings: Rankings::default(),
        effort: Effort::default(),
        residual_unexplained: false,
        ranked: Vec::new(),
        steps,
        noise_floor: match &noise[..] {
            [only] => only.level,
            _ => f64::NAN,
        },
        noise,
        scores: Vec::new(),
        unknown: None,
        control_loop: None,
        sentences: Vec::new(),
        gaps: None,
        clock: Clock::of(problem.records.iter().chain(&problem.test)),
        plant: problem.plant.id().to_string(),
        known_effects: problem
            .effects
            .iter()
            .map(|placed| placed.effect.id.to_string())
            .chain(problem.terms.iter().map(|term| term.name.clone()))
            .collect(),
        input_unit: problem.records[0].inputs[0].unit.clone(),
        outputs: outputs.iter().map(|output| output.name.clone()).collect(),
        output_unit: outputs[0].unit.clone(),
        output_units: Vec::new(),
        records: problem
            .records
            .iter()
            .map(|record| Shown::of(record, false))
            .chain(problem.test.iter().map(|record| Shown::of(record, true)))
            .collect(),
        seconds: 0.0,
    }
}
