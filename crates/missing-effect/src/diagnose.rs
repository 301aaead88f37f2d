//! The algorithm, from records to a verdict.

use std::time::Instant;

use ct_signals::{ArModel, Record};

use crate::{
    ControlLoop, Diagnosis, Effort, Error, NoiseFloor, Options, Problem, Progress, Rankings, Score,
    Shown, Step, Verdict,
    doubt::doubt,
    find::{find, shortened},
    judge::{Course, Judge},
    problem::base,
    remains::remains,
    scores::{price_of_colour, scores},
    sentences,
    unknown::unknown,
};

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
    // The metric in which single effects were refitted last: a noise that is white has the same one whatever its size.
    let white = ArModel::white(1.0);
    let (metric, believed) = if found.by_simulation || found.noise.order() == 0 {
        (&white, &base)
    } else {
        (&found.noise, &found.base)
    };
    let (doubted, single) = rayon::join(|| doubt(&base, &found), || found.grown.singles(metric));
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
    let judge = Judge {
        base: &base,
        noise: &found.noise,
        wandering: found.wandering,
        by_simulation: found.by_simulation,
        stopped,
        jumped,
        singles: &single,
    };
    let (judged, (scores, price)) = rayon::join(
        || judge.judge(confirmed),
        || {
            rayon::join(
                || scores(believed, &single, metric),
                || price_of_colour(&found.base, &single, &found.noise),
            )
        },
    );
    let judged = judged?;
    let (mut course, mut groups) = (judged.course, judged.groups);
    let mut floor = floor(
        &found.noise,
        if course.last().added.len() == found.richest.added.len() && !stopped {
            "the residual of the final model"
        } else {
            "the residual of the richest model that was tried"
        },
    );
    if course.left.is_some() && !stopped {
        floor = floor.of_what_is_new();
    }
    let unit = &problem.records[0].output.unit;
    let mut remark = sentences::of_courses(&judged.dropped);
    if !judged.fair {
        remark = Some(sentences::of_a_part(course.last(), unit));
        course = Course {
            left: remains(&base, &doubted.own_base)?,
            own: doubted.own_base,
            nodes: vec![course.nodes.swap_remove(0)],
        };
        groups.clear();
    }

    tell("telling apart", 2, 3);
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
            input_2: record.input_2.as_ref().map(|second| second.values.clone()),
            output: record.output.values.clone(),
        }
    };
    Diagnosis {
        schema: 1,
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
