//! The diagnosis: from a model and records to a verdict.
//!
//! 1. The believed model is fitted with white noise, from many starts; the candidates follow from the ranges that it simulates.
//! 2. A search with white noise adds many effects; the noise model is estimated from the residual of the best set. If this noise
//!    model is not white, the search is repeated with it (prewhitened fits).
//! 3. The effects of the best set that pass the acceptance test are kept: with one common noise model first, then with a noise model from
//!    each model's own residual.
//! 4. Residual tests check whether the residual is noise. If it is not, or if many effects were needed, sets of effects that do not depend
//!    on time are searched once more; if the residual is still not noise, or several of the effects depend on time only, a set that explains
//!    a large part of the error is selected from all sets.
//! 5. The result of the residual tests determines the verdict; effects that the data cannot distinguish form groups. Rounding that the
//!    readings show is added without a test: the criterion hardly falls.

use ct_signals::ArModel;
use estimation::Noise;
use greybox::weighted_rms;

use crate::Error;
use crate::accept::partial::explained;
use crate::base::problem::{Limit, Options, Phase, Problem};
use crate::fit::believed::begin;
use crate::fit::node::{Context, FINE, Node};
use crate::residual_tests::NotNoise;
use crate::result::assemble::{Finding, assemble};
use crate::result::diagnosis::{Diagnosis, Verdict};
use crate::search::grow::Grown;

/// The progress of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// The present phase.
    pub phase: &'static str,
}

/// Searches the candidates for effects that the believed model lacks.
///
/// # Errors
/// If the records, the model or the fit do not allow a diagnosis.
pub fn diagnose(
    problem: &Problem,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Diagnosis, Error> {
    let tell = |phase| progress(Progress { phase });
    tell("fitting the model");
    let limit = Limit::new(options);
    limit.begin(Phase::Believed);
    let (context, base) = begin(problem, options, limit)?;
    context.limit.leaves_out("starts of the model's fit");
    tell("searching the effects");
    context.limit.begin(Phase::White);
    let white = Noise::white(problem.spec.outputs.len());
    let all: Vec<usize> = (0..context.candidates.len()).collect();
    let most = options.max_effects.min(options.thresholds.beam_effects);
    let few = most.min(options.thresholds.effects_before_noise);
    let mut by_error = context.grow(base.clone(), (&all, &[]), &white, few)?;
    let (mut noise, slow) = context.noise_of(&by_error.best)?;
    let full = by_error.best.added.len() >= base.added.len() + few;
    if noise.order() == 0 && full && few < most {
        by_error = context.grow_on(by_error, &white, most)?;
        (noise, _) = context.noise_of(&by_error.best)?;
    }
    let mut by_error_sets = by_error.fitted.clone();
    by_error_sets.push(by_error.best.clone());
    if slow {
        let timeless = context.timeless();
        let grown = context.grow(base.clone(), (&timeless, &by_error.singles), &white, few)?;
        by_error_sets.extend(grown.fitted);
        by_error_sets.push(grown.best);
    }
    let by_error_singles = (by_error.singles.clone(), by_error.base.clone());
    let (mut grown, mut noise) = with_noise_model(&context, by_error, noise, options)?;
    tell("confirming");
    context.limit.begin(Phase::Confirm);
    let mut confirmed = context.confirm(grown.best.clone(), &grown.base, &noise)?;
    if grown.cut_short && confirmed.added.len() == grown.base.added.len() {
        // After a search that was cut short, the noise model also describes effects that were not tried; the test below decides without it.
        confirmed = grown.best.clone();
    }
    if confirmed.added.len() > grown.base.added.len() {
        // Each model has the noise model of its own residual: what autocorrelated noise explains needs no effect.
        let own = context.in_own_noise(&confirmed)?;
        let bare = context.in_own_noise(&grown.base)?;
        let floors: Vec<f64> = own.noise.iter().map(ArModel::sigma).collect();
        let error =
            |node: &Node| weighted_rms(&node.fit.rmse, &floors, &node.fit.samples_per_output);
        // The simulation error must decrease too: in a prewhitened fit, a single reading can be a reason to add an effect.
        let needed = bare.bic() - own.bic() > options.thresholds.bic_margin
            && context.beyond_chance((&confirmed, &own), (&grown.base, &bare))
            && error(&confirmed) < error(&grown.base);
        if !needed {
            confirmed = grown.base.clone();
        }
    }
    let mut own = context.in_own_noise(&confirmed)?;
    let mut not_noise = context.not_noise(&confirmed, &own)?;
    let mut slowness = 1.0;
    let many = |set: &Node| set.added.len() >= base.added.len() + options.thresholds.many_effects;
    // Several functions of time compensate for any slow disturbance.
    let flexible = many(&confirmed) && context.in_time(&confirmed.added[base.added.len()..]) > 1;
    let mut reduced = false;
    if not_noise.is_some() || many(&confirmed) {
        context.limit.begin(Phase::Floating);
        let mut sets = by_error_sets;
        sets.extend(grown.fitted.iter().cloned());
        sets.extend([grown.best.clone(), confirmed.clone()]);
        let timeless = context.floating(&base, &sets, options.max_effects);
        context.limit.begin(Phase::Part);
        let better = if not_noise.is_none() {
            context.better_in_own_noise(timeless.clone(), &own)
        } else {
            None
        };
        if let Some(better) = better {
            // So many effects may imitate other effects, and the noise model may describe the rest of the error.
            noise = better.fit.noise.clone();
            if let Ok(bare) = context.refitted(&grown.base, &noise, FINE) {
                grown.base = bare;
            }
            let refitted = context.refitted(&better, &noise, FINE);
            confirmed = refitted.unwrap_or_else(|_| better.clone());
            let size = confirmed.added.len();
            confirmed = context.confirm(confirmed, &grown.base, &noise)?;
            // The deviance of a fit with its own noise model is lower than that of a fit with the same model given.
            own = if confirmed.added.len() == size {
                better.fit
            } else {
                context.in_own_noise(&confirmed)?
            };
            not_noise = context.not_noise(&confirmed, &own)?;
        } else if not_noise.is_some() || flexible {
            // The noise model describes unmodelled physics as noise, and if that physics is slow, simulations of prewhitened fits drift.
            // The sets are therefore compared by their simulation error.
            sets.extend(timeless);
            let part = context.largest_part(&base, &sets)?;
            if let Some(part) =
                part.and_then(|(part, _)| context.without_small_effects(part, &base))
            {
                confirmed = part;
                own = context.in_own_noise(&confirmed)?;
                noise = white.clone();
                slowness = context.slowness(&own.noise);
                (grown.singles, grown.base) = by_error_singles;
                grown.of_singles = grown.base.clone();
                reduced = not_noise.is_none();
                not_noise = context.not_noise(&confirmed, &own)?;
            } else if flexible && !context.limit.passed() {
                let bare = context.in_own_noise(&grown.base)?;
                let reason = context.not_noise(&grown.base, &bare)?;
                if reason.is_some() {
                    (confirmed, own, not_noise) = (grown.base.clone(), bare, reason);
                }
            }
        }
    }
    let some = confirmed.added.len() > grown.base.added.len();
    if some || matches!(not_noise, Some(NotNoise::Instant { .. })) {
        let margin = if some {
            0.0
        } else {
            options.thresholds.bic_margin
        };
        let shift = context.level_shift(&grown.base, &noise)?;
        if let Some(shift) = shift.filter(|shift| shift.bic < confirmed.fit.bic() - margin) {
            not_noise = Some(shift.found);
            confirmed = grown.base.clone();
            own = context.in_own_noise(&confirmed)?;
        }
    }
    grown.cut_short |= context.limit.leaves_out("tests of the effects one by one");
    tell("telling apart");
    context.limit.begin(Phase::Groups);
    let found = confirmed.added.len() > grown.base.added.len();
    // After a search that was cut short, the noise model describes what was not tried; the effects are then at most a part of the answer.
    let open = grown.cut_short && own.noise.order() > 0;
    let whole = not_noise.is_none() && !open;
    let many = many(&confirmed);
    // The noise level: the standard deviation of the whole residual if it is noise, otherwise that of its innovations.
    let floors: Vec<f64> = if whole {
        context.noise_levels(&own)
    } else {
        own.noise.iter().map(ArModel::sigma).collect()
    };
    let share = found.then(|| explained(&base.fit, &confirmed.fit, &floors));
    let verdict_of = |groups: &[Vec<usize>]| match (found, &not_noise, share) {
        (true, None, _) if open || many || reduced => Verdict::Partial,
        (false, None, _) => Verdict::Adequate,
        (false, Some(_), _) => Verdict::Unexplained,
        (true, Some(_), Some(share)) if share >= options.thresholds.partial_share => {
            Verdict::Partial
        }
        (true, Some(_), _) => Verdict::Unexplained,
        (true, None, _) if groups.iter().any(|group| group.len() > 1) => Verdict::Undecided,
        (true, None, _) => Verdict::Effect,
    };
    if verdict_of(&[]) == Verdict::Unexplained {
        confirmed = grown.base.clone();
    }
    let (mut confirmed, mut groups) = context.groups(confirmed, &grown.base, &noise, slowness)?;
    let mut verdict = verdict_of(&groups);
    let is_answer = matches!(
        verdict,
        Verdict::Adequate | Verdict::Effect | Verdict::Undecided
    );
    let before = confirmed.added.len();
    if is_answer {
        // No acceptance test: rounding is shown by the readings.
        let most = (base.added.len() + options.max_effects).saturating_sub(before);
        (confirmed, own) = context.with_rounding(confirmed, own, most);
        groups.extend(
            confirmed.added[before..]
                .iter()
                .map(|&rounded| vec![rounded]),
        );
        if verdict == Verdict::Adequate && confirmed.added.len() > before {
            verdict = Verdict::Effect;
        }
    }
    let rounded = confirmed.added[before..].to_vec();
    let (last_set, last_fit) = if verdict == Verdict::Unexplained {
        (&base, context.in_own_noise(&base)?)
    } else {
        (&confirmed, own)
    };
    let unknown = match verdict {
        Verdict::Unexplained | Verdict::Partial => {
            tell("the shape of what is missing");
            let context = Context {
                limit: context.limit.afterwards(),
                ..context.clone()
            };
            let floors: Vec<f64> = last_fit.noise.iter().map(ArModel::sigma).collect();
            context.unknown(last_set, &floors)?
        }
        _ => None,
    };
    let (seconds, left_out) = (context.limit.seconds(), context.limit.left_out());
    let report = |tolerance: f64, finding: Finding| {
        let context = Context {
            limit: context.limit.of_report(),
            tolerance,
            ..context.clone()
        };
        assemble(&context, &grown, finding)
    };
    let finding = Finding {
        base: &base,
        last: &confirmed,
        rounded,
        own: &last_fit,
        unknown,
        verdict,
        groups,
        not_noise,
        share,
        seconds,
        left_out,
    };
    // With this tolerance a state that grows may need more steps than a simulation may take.
    report(ct_model::TOLERANCE, finding.clone()).or_else(|_| report(context.tolerance, finding))
}

/// The search with prewhitened fits, if the noise model is not white.
fn with_noise_model(
    context: &Context,
    by_error: Grown,
    noise: Noise,
    options: &Options,
) -> Result<(Grown, Noise), Error> {
    if noise.order() == 0 {
        return Ok((by_error, noise));
    }
    let late = by_error.cut_short || context.limit.passed();
    context.limit.begin(Phase::Coloured);
    let begin = context.refitted(&by_error.base, &noise, FINE);
    let Ok(begin) = begin else {
        return Ok((by_error, Noise::white(noise.outputs())));
    };
    if late {
        // Sets are compared with one noise model, even if no time is left.
        let mut grown = by_error;
        if let Ok(best) = context.refitted(&grown.best, &noise, FINE) {
            (grown.base, grown.best) = (begin, best);
            grown.cut_short = true;
            return Ok((grown, noise));
        }
        return Ok((grown, Noise::white(noise.outputs())));
    }
    let all: Vec<usize> = (0..context.candidates.len()).collect();
    let most = options.max_effects.min(options.thresholds.beam_effects);
    let grown = context.grow(begin, (&all, &by_error.singles), &noise, most)?;
    // The best set of the search with white noise may also be better with this noise model.
    let other = context.refitted(&by_error.best, &noise, FINE);
    let mut grown = grown;
    if let Ok(other) = other
        && other.fit.bic() < grown.best.fit.bic()
    {
        grown.best = other;
    }
    let (own, _) = context.noise_of(&grown.best)?;
    if own.order() > 0
        && own.difference(&noise) > options.thresholds.same_noise
        && !context.limit.passed()
    {
        let base = context.refitted(&grown.base, &own, FINE);
        let best = context.refitted(&grown.best, &own, FINE);
        if let (Ok(base), Ok(best)) = (base, best) {
            (grown.base, grown.best) = (base, best);
            return Ok((grown, own));
        }
    }
    Ok((grown, noise))
}
