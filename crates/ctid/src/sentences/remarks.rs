//! Remarks in addition to the verdict.

use effect_search::Absorbed;
use missing_effect::{Diagnosis, Rankings, Remark};

use super::{list, rms};
use crate::numbers::significant;

/// A remark in a sentence; `None` for quantisation, whose remarks make one text ([`of_quantisation`]).
pub(super) fn of(remark: &Remark, diagnosis: &Diagnosis) -> Option<String> {
    Some(match remark {
        Remark::Quantisation { .. } => return None,
        Remark::ReplacedByTime { effects } => format!(
            "{} would explain more, but so would a function of time, and the residual is not noise: not accepted.",
            list(effects, "and")
        ),
        Remark::BestPart {
            effects,
            rmse_per_output,
        } => format!(
            "The best significant effect, apart from functions of time, is {}, with a residual of {}: this residual is not noise, so the effect is not accepted.",
            list(effects, "and"),
            rms(rmse_per_output, &diagnosis.output_unit)
        ),
        Remark::EffectLimit { most, needed } => format!(
            "The search was stopped at {most} {}: the data require {needed}.",
            if *most == 1 { "effect" } else { "effects" }
        ),
        Remark::Terms { names } => format!(
            "With {} in the model the standard errors are too small: the shape of a term is assumed known, but it may contain part of the influence of the plant's parameters.",
            list(names, "and")
        ),
        Remark::ColouredNoise { ratio } => format!(
            "The noise is coloured: an effect has to be about {} times larger to be detected than in white noise of the same variance. Effects smaller than the sizes under \"detectable\" may be present.",
            significant(*ratio, 2)
        ),
    })
}

/// One text on quantisation, a sentence for each output with rounded readings; `None` without such an output.
pub(super) fn of_quantisation(diagnosis: &Diagnosis) -> Option<String> {
    let remarks = diagnosis.remarks.iter();
    let all = remarks.filter_map(|remark| match remark {
        Remark::Quantisation {
            output,
            step,
            share,
        } => {
            let names = &mut diagnosis.outputs.iter();
            let unit = diagnosis.unit_of(names.position(|name| name == output).unwrap_or(0));
            let of = if diagnosis.outputs.len() > 1 {
                format!(" of {output}")
            } else {
                String::new()
            };
            Some(rounding(&of, *step, unit, *share))
        }
        _ => None,
    });
    let all: Vec<String> = all.collect();
    (!all.is_empty()).then(|| all.join(" "))
}

/// Readings that are multiples of a step: `of` names the output, or is empty.
pub(crate) fn rounding(of: &str, step: f64, unit: &str, share: f64) -> String {
    let with_unit = |value: f64, digits: i32| {
        let text = format!("{} {unit}", significant(value, digits));
        text.trim_end().to_string()
    };
    format!(
        "Nearly all readings{of} are multiples of {}: rounding alone makes an error of {} rms, {:.0} % of the mean squared error of the model without it.",
        with_unit(step, 3),
        with_unit(step / 12.0_f64.sqrt(), 2),
        100.0 * share.min(1.0)
    )
}

/// Note: a candidate of the model file that no search can find.
pub(crate) fn absorbed(own: &Absorbed) -> String {
    let effect = &own.effect;
    match &own.parameter {
        Some(parameter) => format!(
            "Note: {effect} cannot be found: its term changes the outputs as the model's parameter {parameter} does, which is fitted. Give {parameter} under [known], or delete [candidates.{effect}]."
        ),
        None => format!(
            "Note: {effect} cannot be found: its term changes the outputs as the model's fitted parameters together do. Give one of them under [known], or delete [candidates.{effect}]."
        ),
    }
}

/// Remark: the two weightings of the residual rank different effects first.
pub(super) fn of_rankings(rankings: &Rankings) -> Option<String> {
    let (white, prewhitened) = (rankings.white.first()?, rankings.prewhitened.first()?);
    rankings.disagree.then(|| {
        format!(
            "The weightings disagree: by the simulation error {white} is the best single effect, prewhitened by the noise model {prewhitened}; the prewhitened fit gives more weight to fast changes."
        )
    })
}

/// Remark: the minimum of the last model was not found twice.
pub(super) fn of_a_minimum(diagnosis: &Diagnosis) -> Option<String> {
    let step = diagnosis.steps.last()?;
    single_minimum(step.starts, step.starts_agree, "the minimum that is shown")
}

/// Remark: fewer than two starts of a fit ended in `minimum`.
pub(crate) fn single_minimum(starts: usize, agree: usize, minimum: &str) -> Option<String> {
    (agree < 2 && starts > 1).then(|| {
        format!(
            "Of {starts} starts {} {minimum}: there may be a better one with other parameter values.",
            if agree == 0 {
                "none reached"
            } else {
                "only one reached"
            }
        )
    })
}

/// Ratio of the held-out error to the fitted one above which the fitted model does not hold for another record.
const CARRIES_OVER: f64 = 2.0;

/// Remark: whether the fitted model holds for another record.
pub(super) fn of_held_out(diagnosis: &Diagnosis) -> Option<String> {
    let step = diagnosis.steps.last()?;
    let times = step.weighted_rmse_test? / step.weighted_rmse;
    (times > CARRIES_OVER).then(|| {
        format!(
            "On held-out data the simulation error is {} times as large: the fitted model does not hold for that record.",
            significant(times, 2)
        )
    })
}
