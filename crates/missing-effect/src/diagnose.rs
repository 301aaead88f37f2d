//! The diagnosis, from records to a verdict.

use std::time::Instant;

use plants::Placed;

use crate::{
    Acceptance, ControlLoop, Diagnosis, Error, NoiseSource, Options, PerOutput, Problem, Progress,
    Remark, Verdict,
    accept::{
        acceptance::{AcceptanceTest, Course, Grade, PART, WHOLE},
        ambiguity::remove_ambiguous,
        partial::largest_part,
        rounding::rounded,
        sticking::sticks,
    },
    base::{
        believed::base,
        gaps::Mended,
        time_limit::{allow, effort},
    },
    diagnostics::{
        assemble::{assemble, floors},
        held_out::share_on_held_out,
        remarks::of_terms,
        residual_tests::not_noise,
        unknown::{self, unknown},
    },
    fit::criterion::BIC_MARGIN,
    search::{
        find::{find, shortened},
        rankings::{ranked, rankings},
        scores::{detectable_size_ratio, scores},
    },
};

/// Shares of the time limit after which the phases end: further starts of the believed model, the search of sets, all later steps except
/// the report, the fits of the report, and the unexplained error. Each phase finishes the step that it has begun.
pub(crate) const FITTED: f64 = 0.2;
const SEARCHED: f64 = 0.65;
const CONFIRMED: f64 = 0.82;
const REPORTED: f64 = 0.88;
const SHAPED: f64 = 0.95;

/// A loss of detectability by coloured noise is reported from this ratio of sizes on.
const CLEAR_LOSS: f64 = 1.2;

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

/// Diagnosis of records without gaps.
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
    // The weighting for the ranking of single effects: white if the residual drifts, because a noise model absorbs slow effects.
    let white = base.setup.white_noise();
    let (metric, believed, grown) = match &found.prewhitened {
        Some(grown) if !found.by_simulation && !found.slow_noise => {
            (&found.noise, &found.base, grown)
        }
        _ => (&white, &base, &found.grown),
    };
    let widen = ControlLoop::widens(control_loop.as_ref());
    let (unambiguous, single) = rayon::join(
        || remove_ambiguous(&base, &found, widen),
        || grown.singles(metric),
    );
    let unambiguous = unambiguous?;
    let mut confirmed = unambiguous.confirmed;
    let needed = confirmed.added.len();
    let stopped = needed > options.max_effects;
    if stopped {
        let most = options.max_effects;
        confirmed = shortened(confirmed, &found.grown.sizes, most, &found.noise)?;
    }

    tell("telling apart", 1, 3);
    let shifted = unambiguous
        .shifted
        .map(|shift| shift.left(&problem.records[0]));
    let searched = found.sets();
    let test = AcceptanceTest {
        base: &base,
        noise: &found.noise,
        slow_noise: found.slow_noise,
        in_loop: widen,
        by_simulation: found.by_simulation,
        stopped,
        shifted: shifted.as_ref(),
        singles: &single,
        searched: &searched,
    };
    let (accepted, (scores, loss)) = rayon::join(
        || test.run(confirmed),
        || {
            rayon::join(
                || scores(believed, &single, metric, &found.noise.sigmas()),
                || detectable_size_ratio(&found.base, &single, &found.noise),
            )
        },
    );
    let accepted = accepted?;
    let (mut course, mut groups) = (accepted.course, accepted.groups);
    // Why better effects are not among the accepted ones.
    let mut refused = (!accepted.dropped.is_empty()).then(|| Remark::ReplacedByTime {
        effects: ids(&accepted.dropped),
    });
    let mut acceptance = Acceptance {
        effects: ids(&course.last().added),
        share: (!course.last().added.is_empty()).then_some(accepted.share),
        share_test: None,
        required: WHOLE,
        required_partial: PART,
        floor: PerOutput::of(&problem.records[0].outputs, &found.noise.sigmas()),
        bic_fall: None,
        required_bic_fall: BIC_MARGIN,
        rejections: Vec::new(),
    };
    let mut partial = false;
    // Noise whose memory had to be limited may contain slow physics; a sticking valve in a loop causes a limit cycle, which noise with a
    // memory describes.
    let sticking = widen && sticks(&problem.records);
    let unexplained = course.left.is_some() || found.limited || sticking;
    if accepted.grade != Grade::Whole || (course.last().added.is_empty() && unexplained) {
        let by_error = found.grown.best_singles();
        let tested = largest_part(&base, &found, &by_error, &found.noise.sigmas(), widen)?;
        if let Some(tested) = &tested {
            acceptance.effects = ids(&tested.node.added);
            acceptance.share = Some(tested.share);
            acceptance.bic_fall = Some(tested.bic_fall);
            acceptance.rejections.clone_from(&tested.rejections);
        }
        match tested.filter(|tested| {
            tested.rejections.is_empty() && tested.node.added.len() <= options.max_effects
        }) {
            Some(tested) => {
                let test = AcceptanceTest {
                    slow_noise: true,
                    by_simulation: true,
                    singles: &by_error,
                    ..test
                };
                course = test.course(&tested.node)?;
                groups = test.groups(course.last())?;
                // In the order of the error ladder.
                acceptance.effects = ids(&course.last().added);
                refused = None;
                partial = true;
            }
            None if accepted.grade != Grade::Whole => {
                let last = course.last();
                refused = Some(Remark::BestPart {
                    effects: ids(&last.added),
                    rmse_per_output: PerOutput::of(&last.setup.records[0].outputs, &last.fit.rmse),
                });
                course = Course {
                    left: not_noise(&base, &unambiguous.own_base)?,
                    own: unambiguous.own_base,
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
            NoiseSource::FinalModel
        } else {
            NoiseSource::RichestModel
        },
    );
    let mut remarks = Vec::new();
    if !partial
        && course.last().added.len() < options.max_effects
        && let Some(rounded) = rounded(course.last())?
    {
        remarks.extend(rounded.outputs.iter().map(|rounded| Remark::Quantisation {
            output: problem.records[0].outputs[rounded.output].name.clone(),
            step: rounded.step,
            share: rounded.share,
        }));
        let longer = test.longer(course.nodes.clone(), rounded.node)?;
        // If rounding leaves structure in the residual, the error stays unexplained.
        if longer.left.is_none() || !course.last().added.is_empty() {
            course = longer;
            groups.push(rounded.group);
            acceptance.effects = ids(&course.last().added);
            (acceptance.share, acceptance.bic_fall) = (None, None);
            acceptance.rejections.clear();
            refused = refused.filter(|_| course.left.is_some());
        }
    }
    if (course.left.is_some() || partial) && !stopped {
        floor = floor.of_what_is_new();
    }
    let floor = floor.at_most(&course.last().fit.rmse);

    tell("telling apart", 2, 3);
    allow(&base, REPORTED);
    let steps = course.steps(&floor, problem, widen)?;
    let left = course.left.clone();
    let last = course.last();
    let verdict = match (last.added.is_empty(), &left) {
        (true, Some(_)) => Verdict::Unexplained,
        (true, None) if refused.is_some() => Verdict::Unexplained,
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
    diagnosis.not_noise = left;
    remarks.extend(refused);
    remarks.extend(stopped.then_some(Remark::EffectLimit {
        most: options.max_effects,
        needed,
    }));
    remarks.extend(of_terms(problem));
    let loss = loss.filter(|ratio| *ratio >= CLEAR_LOSS);
    remarks.extend(loss.map(|ratio| Remark::ColouredNoise { ratio }));
    diagnosis.remarks = remarks;
    diagnosis.control_loop = control_loop;
    diagnosis.effort = effort(&base, options);
    tell("done", 3, 3);
    Ok(diagnosis)
}

fn ids(added: &[Placed]) -> Vec<String> {
    let ids = added.iter().map(|placed| placed.effect.id.to_string());
    ids.collect()
}
