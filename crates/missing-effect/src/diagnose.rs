//! The algorithm, from records to a verdict.

use std::time::Instant;

use ct_signals::{ArModel, Record};
use greybox::coloured;
use plants::EffectInfo;
use rayon::prelude::*;

use crate::{
    ControlLoop, Diagnosis, Error, NoiseFloor, Options, Problem, Progress, Score, Shown, Step,
    Verdict,
    confirm::{BIC_MARGIN, beyond_chance, confirm, improve, least_useful},
    exhausted::exhausted,
    jump::jump,
    noise_floor::{NOISE_ORDER, bic_in_colour, colour, residual_colour, slowness, wanders},
    problem::{STOPPING, base},
    remains::remains,
    scores::{price_of_colour, scores},
    search::{Breadth, Node, exchanges, grow, refine, singles, without_clock},
    sentences, step,
    trail::trail,
    unknown::unknown,
};

/// What stands in for another lies within this of its criterion.
pub(crate) const GROUP_MARGIN: f64 = 6.0;
/// Sets grown side by side, and refits of a size.
const BEAM: usize = 3;
const REFITS: usize = 12;
/// Sets are grown to so many effects where they pay.
const RICHEST: usize = 6;

/// In the metric of a noise that wanders they are grown to so many.
const PAIR: usize = 2;

/// Where something remains that is not noise, effects are the answer if they explain this part at least of the mean
/// square above the noise floor.
///
/// The tests that confirm an effect take what remains for noise. Against a disturbance from outside, which is none, their
/// probabilities do not hold: whatever effect happens to resemble it is "beyond chance". Over records of nine
/// simulated disturbances such effects imitate up to six sevenths of one as a rule; a true effect beside which something small
/// remains explains nineteen twentieths and more.
const FAIR_PART: f64 = 0.9;

/// Fits the believed model and says where it fails: a diagnosis of one step without a search of sets.
///
/// # Errors
/// Where the records, the plant or the fit do not allow it.
pub fn compare(problem: &Problem, options: &Options) -> Result<Diagnosis, Error> {
    let begun = Instant::now();
    let (base, control_loop) = base(problem, options)?;
    let own = coloured(&base.setup, base.fit.clone(), NOISE_ORDER, STOPPING)?;
    // The model lacks something where its residual is not noise, or where some effect would lower the error by more than
    // chance does: the one needs no catalogue, the other sees what is small.
    let in_noise = Node {
        fit: own.clone(),
        ..base.clone()
    };
    let tempted = singles(&in_noise, &own.noise)
        .first()
        .is_some_and(|single| {
            single.gain_over(&in_noise) > BIC_MARGIN && {
                beyond_chance(own.deviance - single.fit.deviance, &in_noise, single)
            }
        });
    let left = remains(&base, &own)?;
    let lacking = tempted || left.is_some();
    let verdict = if lacking {
        Verdict::Unexplained
    } else {
        Verdict::Adequate
    };
    let floor = floor(&own.noise, "the residual of the believed model");
    // In the metric of a noise that wanders a simulation may drift off.
    let shown = if lacking || wanders(&base, &own.noise) {
        base
    } else {
        Node {
            fit: own.clone().continuing(&base.fit),
            ..base
        }
    };
    let floor = if lacking {
        floor.of_what_is_new()
    } else {
        floor
    };
    let widen = ControlLoop::widens(control_loop.as_ref());
    let step = step::report(&shown, own.bic(), &floor.model()?, &problem.test, widen)?;
    let mut diagnosis = assemble(problem, verdict, vec![step], floor);
    diagnosis.sentences = sentences::of_comparison(&diagnosis, left);
    diagnosis
        .sentences
        .extend(sentences::of_a_minimum(&diagnosis));
    diagnosis.speak_of_the_loop(control_loop);
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
    let (base, control_loop) = base(problem, options)?;
    let breadth = Breadth {
        beam: BEAM,
        refits: REFITS,
        // What may be added does not bound what is tried: only the richest model shows what is noise.
        most: options.max_effects.max(RICHEST),
    };
    let pays = |before: &Node, after: &Node| after.gain_over(before) > BIC_MARGIN;

    // The richest model in play, by simulation error; its residual gives the noise.
    let white = ArModel::white(1.0);
    // While the colour is not known, a coloured noise would pay for one effect after the other: what counts is what remains of
    // the gain where each model has the colour of its own residual.
    let pays_in_colour = |before: &Node, after: &Node| {
        let fall = || Ok::<_, Error>(bic_in_colour(before)? - bic_in_colour(after)?);
        pays(before, after) && fall().is_ok_and(|fall| fall > BIC_MARGIN)
    };
    let mut grown = grow(
        &base,
        &white,
        breadth,
        pays_in_colour,
        exhausted,
        &|done, total| tell("searching sets of effects", done, total),
    )?;
    let richest = chosen(&grown.sizes, &base);
    let richest = refine(&richest, &white, &[])?;
    let noise = colour(&richest)?;

    // Confirm in the metric of the noise.
    tell("confirming", 0, 3);
    let base_noise = refine(&base, &noise, &[])?;
    let richest_noise = refine(&richest, &noise, &[])?;
    let mut confirmed = confirm(richest_noise, &noise)?;
    let wandering = wanders(&richest, &noise);
    let by_simulation = wandering && !confirmed.added.is_empty();
    if noise.order() > 0 {
        // The noise's colour is known now: the search is repeated in its metric. Where the residual wanders this is no less
        // called for: to the simulation error a slow noise looks like many effects, and the true one may not be among the
        // sets that were grown there. But then such a metric may let the simulation drift off, which is not taken; and of many
        // effects it tells little.
        let breadth = Breadth {
            most: if by_simulation { PAIR } else { breadth.most },
            ..breadth
        };
        let coloured = grow(
            &base_noise,
            &noise,
            breadth,
            pays,
            // It was exhausted in this colour, which is that of its own residual.
            |node| Ok(grown.exhausted_by(node) || exhausted(node)?),
            &|done, total| tell("searching in the noise's metric", done, total),
        )?;
        let best = chosen(&coloured.sizes, &base_noise);
        let other = confirm(refine(&best, &noise, &[])?, &noise)?;
        if other.fit.bic() < confirmed.fit.bic()
            && !(by_simulation && drifts_off(&confirmed, &other)?)
        {
            confirmed = other;
        }
        if !by_simulation {
            grown = coloured.with_sizes_of(grown);
        }
    }
    if !by_simulation {
        confirmed = improve(confirmed, &noise)?;
    }
    // Each model with the colour of its own residual: what a coloured noise explains needs no effect. The richest model has
    // taken a part of a slow noise for effects, and the colour that it leaves is too fast: chance is counted here too.
    let own_base = coloured(&base.setup, base.fit.clone(), NOISE_ORDER, STOPPING)?;
    let own_last = coloured(
        &confirmed.setup,
        confirmed.fit.clone(),
        NOISE_ORDER,
        STOPPING,
    )?;
    let needed_in_colour = own_base.bic() - own_last.bic() >= BIC_MARGIN
        && beyond_chance(own_base.deviance - own_last.deviance, &base, &confirmed);
    if !confirmed.added.is_empty() && !needed_in_colour {
        confirmed = base_noise.clone();
    }
    // What is claimed has to be better than the simplest course of which no effect is the cause.
    let jumped = if confirmed.added.is_empty() {
        None
    } else {
        jump(&base_noise, &noise)?.filter(|jump| jump.bic < confirmed.fit.bic())
    };
    if jumped.is_some() {
        confirmed = base_noise.clone();
    }
    // Drifts, swings and steps fit courses of any origin: they are believed where they leave noise, and where the other
    // effects of the set are called for without them. What is there to mend an imitation is not.
    if confirmed.added.iter().any(|placed| placed.effect.by_clock) {
        let others = without_clock(&confirmed, &noise)?;
        let count = others.added.len();
        let others = confirm(others, &noise)?;
        if others.added.len() < count || remains(&confirmed, &own_last)?.is_some() {
            confirmed = others;
        }
    }
    let needed = confirmed.added.len();
    let stopped = needed > options.max_effects;
    if stopped {
        confirmed = shortened(confirmed, &grown.sizes, options.max_effects, &noise)?;
    }

    tell("telling apart", 1, 3);
    let mut trail = trail(&base, &confirmed, &white)?;
    let (mut left, mut own_of_last) = (None, None);
    if let Some(last) = trail.last_mut() {
        let in_noise = if by_simulation || stopped {
            last.clone()
        } else {
            refine(&confirmed, &noise, std::slice::from_ref(&last.fit.x))?
        };
        let own = coloured(&in_noise.setup, in_noise.fit, NOISE_ORDER, STOPPING)?;
        left = remains(last, &own)?.or(jumped.map(|jump| jump.left(&problem.records)));
        // The last model is shown in the noise's metric, where its parameters are best known; a model that lacks
        // something is not: a metric that takes what it lacks for noise would let its simulation drift off.
        if !wandering && !stopped && left.is_none() {
            last.fit = own.clone().continuing(&last.fit);
        }
        own_of_last = Some(own);
    }
    let mut floor = floor(
        &noise,
        if needed == richest.added.len() && !stopped {
            "the residual of the final model"
        } else {
            "the residual of the richest model that was tried"
        },
    );
    if left.is_some() && !stopped {
        floor = floor.of_what_is_new();
    }
    let mut last = trail.last().cloned().unwrap_or_else(|| base.clone());
    // What leaves the greater part of the error to something else is a remark, and not the answer.
    let beside = left.filter(|_| !stopped && !last.added.is_empty());
    let fair = match beside {
        Some(found) => explained(&base, &last, found.above(&noise))? >= FAIR_PART,
        None => true,
    };
    // The metric in which single effects were refitted last: a noise that is white has the same one whatever its size.
    let (metric, believed) = if by_simulation || noise.order() == 0 {
        (&white, &base)
    } else {
        (&noise, &base_noise)
    };
    let single = grown.singles(metric);
    let mut groups = Vec::new();
    if fair {
        let (metric, per_sample) = if by_simulation || stopped {
            (&white, slowness(&residual_colour(&last)?))
        } else {
            (&noise, 1.0)
        };
        let same_metric = by_simulation || !stopped || noise.order() == 0;
        let single = same_metric.then_some(single.as_slice());
        groups = self::groups(&refine(&last, metric, &[])?, metric, per_sample, single)?;
    }
    // Nor is, beside something else, what an effect of the clock explains as well: that is some course of time, and
    // whatever is left may have made it.
    let by_clock = |id: &String| EffectInfo::find(id).is_some_and(|effect| effect.by_clock);
    let mut remark = None;
    if !fair || beside.is_some() && groups.iter().flatten().any(by_clock) {
        remark = Some(sentences::of_a_part(&last, &problem.records[0].output.unit));
        left = remains(&base, &own_base)?;
        own_of_last = Some(own_base);
        trail.truncate(1);
        last = trail.last().cloned().unwrap_or_else(|| base.clone());
        groups.clear();
    }
    tell("telling apart", 2, 3);
    let scores = scores(believed, &single, metric);
    let price = price_of_colour(&base_noise, &single, &noise);

    let judge = floor.model()?;
    let widen = ControlLoop::widens(control_loop.as_ref());
    let steps = trail
        .par_iter()
        .enumerate()
        .map(|(k, node)| {
            let bic = match &own_of_last {
                Some(own) if k + 1 == trail.len() => own.bic(),
                _ => coloured(&node.setup, node.fit.clone(), NOISE_ORDER, STOPPING)?.bic(),
            };
            step::report(node, bic, &judge, &problem.test, widen)
        })
        .collect::<Result<Vec<Step>, Error>>()?;
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
    diagnosis.groups = groups;
    diagnosis.ranked = ranked(&scores, verdict);
    diagnosis.scores = scores;
    let doubtful: Vec<bool> = last
        .added
        .iter()
        .map(|placed| last.at_the_edge(*placed))
        .collect();
    if left.is_some() && !stopped {
        tell("shaping the unknown", 2, 3);
        diagnosis.unknown = unknown(&last)?;
    }
    diagnosis.sentences = sentences::of_diagnosis(&diagnosis, left, &doubtful);
    diagnosis.sentences.extend(remark);
    diagnosis
        .sentences
        .extend(sentences::of_a_minimum(&diagnosis));
    if stopped {
        diagnosis
            .sentences
            .push(sentences::of_a_stop(options.max_effects, needed));
    }
    diagnosis
        .sentences
        .extend(price.and_then(sentences::of_the_colour));
    diagnosis.speak_of_the_loop(control_loop);
    diagnosis.seconds = begun.elapsed().as_secs_f64();
    tell("done", 3, 3);
    Ok(diagnosis)
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

/// Whether a set simulates clearly worse than another, by the criterion.
fn drifts_off(before: &Node, after: &Node) -> Result<bool, Error> {
    let white = ArModel::white(1.0);
    Ok(refine(before, &white, &[])?.gain_over(&refine(after, &white, &[])?) > BIC_MARGIN)
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

/// The best set of at most so many effects: of a set that is too large, or of those that were grown.
fn shortened<'a>(
    mut node: Node<'a>,
    sizes: &[Vec<Node<'a>>],
    most: usize,
    noise: &ArModel,
) -> Result<Node<'a>, Error> {
    while node.added.len() > most {
        let Some(lacking) = least_useful(&node, noise)? else {
            break;
        };
        node = lacking;
    }
    if let Some(grown) = sizes.get(most).and_then(|nodes| nodes.first()) {
        let grown = refine(grown, noise, &[])?;
        if grown.fit.bic() < node.fit.bic() {
            node = grown;
        }
    }
    Ok(node)
}

/// For every added effect, itself and all that fit as well in its place.
fn groups<'a>(
    last: &Node<'a>,
    metric: &ArModel,
    per_sample: f64,
    singles: Option<&[Node<'a>]>,
) -> Result<Vec<Vec<String>>, Error> {
    (0..last.added.len())
        .into_par_iter()
        .map(|position| {
            let mut group = vec![last.added[position].effect.id.to_string()];
            for node in exchanges(last, position, metric, singles)? {
                let stand_in = node.added.last().map_or("", |placed| placed.effect.id);
                // In the white metric a coloured residual counts each sample for less than one.
                let behind = (node.fit.bic() - last.fit.bic()) / per_sample;
                // A size at its edge speaks against a stand-in, but where the final model has it too.
                let plausible = node.added.iter().all(|placed| {
                    !node.at_the_edge(*placed)
                        || last.added.contains(placed) && last.at_the_edge(*placed)
                });
                if plausible && behind < GROUP_MARGIN && !group.iter().any(|g| g == stand_in) {
                    group.push(stand_in.to_string());
                }
            }
            Ok(group)
        })
        .collect()
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
