//! Remarks in addition to the verdict.

use ct_signals::Channel;
use plants::Placed;

use super::{list, rms};
use crate::{
    Diagnosis, PerOutput, Problem, Rankings, accept::rounding::RoundedOutput, fit::node::Node,
    numbers::significant,
};

/// Remark: more effects were found than may be added.
pub(crate) fn of_a_stop(most: usize, needed: usize) -> String {
    format!(
        "The search was stopped at {most} {}: the data call for {needed}.",
        if most == 1 { "effect" } else { "effects" }
    )
}

/// The best effects of the catalogue, if they are not accepted.
pub(crate) fn of_a_part(last: &Node) -> String {
    let outputs = &last.setup.records[0].outputs;
    let names: Vec<String> = last
        .added
        .iter()
        .map(|placed| placed.effect.id.to_string())
        .collect();
    format!(
        "The best significant effect, apart from functions of time, is {}, with a residual of {}: this residual is not noise, so the effect is not accepted.",
        list(&names, "and"),
        rms(&PerOutput::of(outputs, &last.fit.rmse), &outputs[0].unit)
    )
}

/// Remark on quantisation: one sentence for each output with rounded readings.
pub(crate) fn of_rounding(rounded: &[RoundedOutput], outputs: &[Channel]) -> String {
    let of_output = |rounded: &RoundedOutput| {
        let output = &outputs[rounded.output];
        let (step, unit) = (rounded.step, &output.unit);
        let of = if outputs.len() > 1 {
            format!(" of {}", output.name)
        } else {
            String::new()
        };
        format!(
            "Nearly all readings{of} are multiples of {} {unit}: rounding alone makes an error of {} {unit} rms, {:.0} % of the mean squared error of the model without it.",
            significant(step, 3),
            significant(step / 12.0_f64.sqrt(), 2),
            100.0 * rounded.share.min(1.0)
        )
    };
    let all: Vec<String> = rounded.iter().map(of_output).collect();
    all.join(" ")
}

/// Remark: the two weightings of the residual rank different effects first.
pub(crate) fn of_rankings(rankings: &Rankings) -> Option<String> {
    let (white, prewhitened) = (rankings.white.first()?, rankings.prewhitened.first()?);
    rankings.disagree.then(|| {
        format!(
            "The weightings disagree: by the simulation error {white} is the best single effect, prewhitened by the noise model {prewhitened}; the prewhitened fit gives more weight to fast changes."
        )
    })
}

/// The effects that were removed because a function of time explains the same; `None` if there are none.
pub(crate) fn of_courses(dropped: &[Placed]) -> Option<String> {
    let names: Vec<String> = dropped
        .iter()
        .map(|placed| placed.effect.id.to_string())
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} would explain more, but so would a function of time, and the residual is not noise: not accepted.",
            list(&names, "and")
        )
    })
}

/// Remark: the minimum of the last model was not found twice.
pub(crate) fn of_a_minimum(diagnosis: &Diagnosis) -> Option<String> {
    let step = diagnosis.steps.last()?;
    (step.starts_agree < 2 && step.starts > 0).then(|| {
        format!(
            "Of {} starts {} the minimum that is shown: there may be a better one, and other values of the parameters.",
            step.starts,
            if step.starts_agree == 0 {
                "no start around it came as low as"
            } else {
                "one alone ended in"
            }
        )
    })
}

/// Ratio of the held-out error to the fitted one above which the fitted model does not hold for another record.
const CARRIES_OVER: f64 = 2.0;

/// Remark: whether the fitted model holds for another record.
pub(crate) fn of_held_out(diagnosis: &Diagnosis) -> Option<String> {
    let step = diagnosis.steps.last()?;
    let times = step.weighted_rmse_test? / step.weighted_rmse;
    (times > CARRIES_OVER).then(|| {
        format!(
            "On held-out data the simulation error is {} times as large: the fitted model does not hold for that record.",
            significant(times, 2)
        )
    })
}

/// Remark: the standard errors do not include the uncertainty of a user's own term.
pub(crate) fn of_terms(problem: &Problem) -> Option<String> {
    let names: Vec<_> = problem.terms.iter().map(|term| term.name.clone()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "Beside {} the standard errors are too small: the shape of a term is taken as known, and may hold a part of what the plant's own parameters explain.",
            list(&names, "and")
        )
    })
}

/// Remark: the loss of detectability by the coloured noise, if it is large.
pub(crate) fn of_coloured_noise(ratio: f64) -> Option<String> {
    (ratio >= 1.2).then(|| format!(
        "The noise is coloured: an effect has to be about {} times larger to be detected than in white noise of the same variance. Effects smaller than the sizes under \"visible from\" may be present.",
        significant(ratio, 2)
    ))
}
