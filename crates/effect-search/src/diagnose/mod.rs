//! The diagnosis: from a model and records to a verdict.
//!
//! 1. The believed model is fitted with white noise, from many starts; the candidates follow from the ranges that it simulates.
//! 2. A search with white noise adds many effects; the noise model is estimated from the residual of the best set. If this noise
//!    model is not white, the search is repeated with it (prewhitened fits; [`searched`]).
//! 3. The best set is fitted from other values of its thresholds. Its effects that pass the acceptance test are kept: with one common noise
//!    model first, then with a noise model from each model's own residual ([`answer`]).
//! 4. Residual tests check whether the residual is noise. If it is not, or if many effects were needed, sets of effects that do not depend
//!    on time are searched once more; if the residual is still not noise, or several of the effects depend on time only, a set that explains
//!    a large part of the error is selected from all sets, unless the kept set contains it ([`answer`]).
//! 5. The result of the residual tests determines the verdict ([`verdict`]); effects that the data cannot distinguish form groups. Rounding
//!    that the readings show is added without a test: the criterion hardly falls.

mod answer;
mod searched;
mod verdict;

use crate::Error;
use crate::base::problem::{Limit, Options, Phase, Problem};
use crate::fit::believed::begin;
use crate::fit::node::Context;
use crate::result::assemble::{Finding, assemble};
use crate::result::diagnosis::{Diagnosis, Verdict};

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
    let (mut context, mut base, mut searched) = context.searched(base, options.max_effects)?;

    tell("confirming");
    let mut answer = context.answered(&base, &mut searched, options)?;
    if let Some(why) = context.hard_nonlinearity(&answer.set)? {
        (context, base) = context.not_simulated(&base, why)?;
        (context, base, searched) = context.searched(base, options.max_effects)?;
        answer = context.answered(&base, &mut searched, options)?;
    }
    let grown = &mut searched.grown;
    grown.cut_short |= context.limit.leaves_out("tests of the effects one by one");

    tell("telling apart");
    context.limit.begin(Phase::Groups);
    let mut graded = context.graded(answer, &base, grown)?;
    let rounded = context.add_rounding(&mut graded, &base, options.max_effects);

    if graded.verdict != Verdict::Unexplained {
        context.control_loop = context.retested_feedback(&graded.set)?;
    }
    let (last, own) = match graded.verdict {
        Verdict::Unexplained => (&base, context.in_own_noise(&base)?),
        _ => (&graded.set, graded.own),
    };
    let unknown = match graded.verdict {
        // A function of time would describe the correlated noise.
        Verdict::Partial if graded.rest_is_correlated => None,
        Verdict::Unexplained | Verdict::Partial => {
            tell("the shape of what is missing");
            let context = Context {
                limit: context.limit.afterwards(),
                ..context.clone()
            };
            let floors = own.noise.sigmas();
            context.unknown(last, &floors)?
        }
        _ => None,
    };
    let finding = Finding {
        base: &base,
        last: &graded.set,
        rounded,
        own: &own,
        unknown,
        verdict: graded.verdict,
        groups: graded.groups,
        not_noise: graded.not_noise,
        share: graded.share,
        seconds: context.limit.seconds(),
        left_out: context.limit.left_out(),
    };
    let report = |tolerance: f64, finding: Finding| {
        let context = Context {
            limit: context.limit.of_report(),
            tolerance,
            ..context.clone()
        };
        assemble(&context, grown, finding)
    };
    // With this tolerance a state that grows may need more steps than a simulation may take.
    report(ct_model::TOLERANCE, finding.clone()).or_else(|_| report(context.tolerance, finding))
}
