//! The findings in words.

use ct_signals::{Channel, Gaps, duration};
use plants::{Domain, EffectInfo, Placed};

use crate::{
    Acceptance, Diagnosis, LONGEST_HOLD, MendedGaps, Parameter, PerOutput, Problem, Rankings, Step,
    Verdict,
    node::Node,
    numbers::{significant, value_and_error},
    remains::{Left, Remains},
    rounding::RoundedOutput,
    unknown::of_unknown,
};

/// A value with its standard error to two significant digits of the latter.
pub(crate) fn with_error(parameter: &Parameter) -> String {
    let (value, error) = value_and_error(parameter.value, parameter.std_error);
    let error = error.map_or(String::new(), |error| format!(" ± {error}"));
    with_unit(&format!("{value}{error}"), &parameter.unit)
}

fn with_unit(number: &str, unit: &str) -> String {
    format!("{number} {unit}").trim_end().to_string()
}

/// Root mean squares in words: `0.300 cm rms`, of several outputs `0.300 cm rms (upper) and 0.100 cm rms (lower)`.
fn rms(per_output: &PerOutput, unit: &str) -> String {
    let words = |(name, rms): &(String, f64)| {
        let of = if per_output.0.len() > 1 {
            format!(" ({name})")
        } else {
            String::new()
        };
        format!("{rms:.3} {unit} rms{of}")
    };
    let all: Vec<String> = per_output.0.iter().map(words).collect();
    list(&all, "and")
}

pub(crate) fn list(names: &[String], last_word: &str) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} {last_word} {last}", most.join(", ")),
    }
}

/// What an effect is outside hydraulics; `None` within, where its name says it, and for a term of the user's own.
fn in_general(effect: &str, domain: Domain) -> Option<&'static str> {
    let effect = EffectInfo::find(effect).filter(|_| domain == Domain::General)?;
    effect.general
}

/// What is left in the residual of a step, as the end of a sentence.
fn left_over(left: Left, step: &Step, diagnosis: &Diagnosis) -> String {
    // A comparison has not looked into the catalogue.
    let effect = if diagnosis.scores.is_empty() {
        "an effect that the model lacks"
    } else {
        "an effect outside the catalogue"
    };
    // Of several outputs the one that shows it.
    let shown = step.rmse_per_output.0.get(left.output);
    let shown = PerOutput(shown.cloned().into_iter().collect());
    let residual = rms(&shown, &diagnosis.output_unit);
    let at = if step.rmse_per_output.0.len() > 1 {
        format!(" of {}", shown.0.first().map_or("", |(name, _)| name))
    } else {
        String::new()
    };
    let record = diagnosis
        .records
        .iter()
        .filter_map(|record| Some(record.time.last()? - record.time.first()?))
        .fold(0.0, f64::max);
    let several = diagnosis
        .records
        .iter()
        .filter(|record| !record.held_out)
        .count()
        > 1;
    let name = left
        .record
        .filter(|_| several)
        .and_then(|k| diagnosis.records.get(k));
    let residual = format!(
        "the residual{at} of {residual}{}",
        name.map_or(String::new(), |record| format!(" (in {})", record.name))
    );
    match left.what {
        Remains::Input => format!("the input still shows in {residual}"),
        Remains::Period(period) => format!(
            "{residual} swings with a period of about {}, which noise does not: it may be a disturbance or {effect}",
            about(period)
        ),
        Remains::Instant(at, length) => format!(
            "{residual} holds something sudden, {}, which noise does not: it may be a disturbance, a fault of the sensor or {effect}",
            if length > 0.0 {
                diagnosis.clock.span(at, at + length)
            } else {
                format!("at {}", diagnosis.clock.at(at))
            }
        ),
        Remains::Level => format!(
            "{residual} follows the {}, which noise does not: the balance lacks {effect}",
            diagnosis.domain().level_words("level")
        ),
        Remains::Slow(wander, process) => format!(
            "{residual} wanders as slowly as the process, or more: its correlation lasts {}, the slowest time constant is {}; it may be a disturbance or {effect}",
            if wander < record {
                about(wander)
            } else {
                "longer than the record".to_string()
            },
            about(process)
        ),
    }
}

/// What a comparison alone can say.
pub(crate) fn of_comparison(diagnosis: &Diagnosis, left: Option<Left>) -> Vec<String> {
    let Some(step) = diagnosis.steps.first() else {
        return Vec::new();
    };
    let unit = &diagnosis.output_unit;
    vec![match (diagnosis.verdict, left) {
        (Verdict::Adequate, _) => format!(
            "The model explains the data: its simulation error of {} looks like noise.",
            rms(&step.rmse_per_output, unit)
        ),
        (_, None) => format!(
            "The model does not explain the data: its simulation error of {} holds more than noise.",
            rms(&step.rmse_per_output, unit)
        ),
        (_, Some(left)) => format!(
            "The model does not explain the data: {}.",
            left_over(left, step, diagnosis)
        ),
    }]
}

/// That more effects were found than may be added.
pub(crate) fn of_a_stop(most: usize, needed: usize) -> String {
    format!(
        "The search was stopped at {most} {}: the data call for {needed}.",
        if most == 1 { "effect" } else { "effects" }
    )
}

/// The best that the catalogue has where it is not the answer.
pub(crate) fn of_a_part(last: &Node) -> String {
    let outputs = &last.setup.records[0].outputs;
    let names: Vec<String> = last
        .added
        .iter()
        .map(|placed| placed.effect.id.to_string())
        .collect();
    format!(
        "What comes nearest by more than chance, a course of time aside, is {}, which leaves {}: too much would be left that is not noise, so it is not taken for the answer.",
        list(&names, "and"),
        rms(&PerOutput::of(outputs, &last.fit.rmse), &outputs[0].unit)
    )
}

/// What readings say of their converters, a sentence for each output whose readings are rounded.
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

/// That the two weightings of the residual rank different effects first.
pub(crate) fn of_rankings(rankings: &Rankings) -> Option<String> {
    let (white, prewhitened) = (rankings.white.first()?, rankings.prewhitened.first()?);
    rankings.disagree.then(|| {
        format!(
            "The weightings disagree: by the simulation error {white} is the best single effect, prewhitened by the noise model {prewhitened}; the second one looks at fast changes more."
        )
    })
}

/// The effects that were taken out because any course of time would do in their place; `None` where there are none.
pub(crate) fn of_courses(dropped: &[Placed]) -> Option<String> {
    let names: Vec<String> = dropped
        .iter()
        .map(|placed| placed.effect.id.to_string())
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} would explain more, but so would some course of time, and something is left that is not noise: not taken for an answer.",
            list(&names, "and")
        )
    })
}

/// That the minimum of the last model was not found twice.
pub(crate) fn of_a_minimum(diagnosis: &Diagnosis) -> Option<String> {
    let step = diagnosis.steps.last()?;
    (step.starts_agree < 2 && step.starts > 0).then(|| {
        format!(
            "Of {} starts {} the minimum that is shown: there may be a better one, and other values of the parameters.",
            step.starts,
            if step.starts_agree == 0 {
                "around it none came as low as"
            } else {
                "one alone ended in"
            }
        )
    })
}

/// The held-out error is this many times the fitted one where what was fitted does not carry over.
const CARRIES_OVER: f64 = 2.0;

/// Whether what was fitted holds on another record.
pub(crate) fn of_held_out(diagnosis: &Diagnosis) -> Option<String> {
    let step = diagnosis.steps.last()?;
    let times = step.weighted_rmse_test? / step.weighted_rmse;
    (times > CARRIES_OVER).then(|| {
        format!(
            "On held-out data the simulation error is {} times as large: what was fitted does not carry over to that record.",
            significant(times, 2)
        )
    })
}

/// What the standard errors do not hold beside a term of the user's own.
pub(crate) fn of_terms(problem: &Problem) -> Option<String> {
    let names: Vec<_> = problem.terms.iter().map(|term| term.name.clone()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "Beside {} the standard errors are too small: the shape of a term is taken as known, and may hold a part of what the plant's own parameters explain.",
            list(&names, "and")
        )
    })
}

/// What the colour of the noise costs, where it costs something.
pub(crate) fn of_the_colour(price: f64) -> Option<String> {
    (price >= 1.2).then(|| format!(
        "The noise is coloured, and hides what white noise of the same size would show: an effect has to be about {} times larger to be seen. Smaller ones than the sizes under \"visible from\" may be there.",
        significant(price, 2)
    ))
}

/// The sizes from which on the likeliest effects would have been seen.
fn visible(diagnosis: &Diagnosis) -> String {
    let sizes: Vec<String> = diagnosis
        .scores
        .iter()
        .filter_map(|score| {
            let size = score.size.as_ref()?;
            let smallest = significant(score.smallest_visible?, 2);
            Some(format!(
                "{} {}",
                score.effect,
                with_unit(&smallest, &size.unit)
            ))
        })
        .take(4)
        .collect();
    sizes.join(", ")
}

/// What there is to say, the verdict first.
pub(crate) fn of_diagnosis(diagnosis: &Diagnosis, left: Option<Left>) -> Vec<String> {
    let unit = &diagnosis.output_unit;
    let (Some(first), Some(last)) = (diagnosis.steps.first(), diagnosis.steps.last()) else {
        return Vec::new();
    };
    let mut said = Vec::new();
    let unknown = diagnosis.unknown.as_ref();
    let shaped = unknown.map(|unknown| of_unknown(unknown, &diagnosis.clock, diagnosis.domain()));
    let held_out = |step: &Step| {
        step.rmse_test_per_output
            .as_ref()
            .map_or(String::new(), |errors| {
                let errors = rms(errors, unit).replace(" rms", "");
                format!(", {errors} on held-out data")
            })
    };
    match diagnosis.verdict {
        Verdict::Adequate => {
            said.push(format!(
                "The model is adequate: its simulation error of {} is noise{}.",
                rms(&first.rmse_per_output, unit),
                held_out(first)
            ));
            let visible = visible(diagnosis);
            if !visible.is_empty() {
                said.push(format!("These data would have shown {visible}."));
            }
        }
        Verdict::Unexplained => match left {
            // A right model under a slow disturbance leaves this too.
            Some(left) if matches!(left.what, Remains::Slow(..)) => {
                said.push(format!(
                    "Nothing in the catalogue is called for, but what is left is not noise: {}.",
                    left_over(left, first, diagnosis)
                ));
                let visible = visible(diagnosis);
                if !visible.is_empty() {
                    said.push(format!("It hides what is smaller than {visible}."));
                }
            }
            _ => said.push(format!(
                "Something is missing, and nothing in the catalogue explains it: {}.",
                left.map_or_else(
                    || format!(
                        "the residual of {} holds more than noise",
                        rms(&first.rmse_per_output, unit)
                    ),
                    |left| left_over(left, first, diagnosis)
                )
            )),
        },
        Verdict::Effect | Verdict::Undecided | Verdict::Partial => {
            said.extend(of_effects(diagnosis, last));
            said.push(format!(
                "The simulation error falls {}{}.",
                falls(
                    &first.rmse_per_output,
                    &last.rmse_per_output,
                    &format!("{unit} rms")
                ),
                match (&first.rmse_test_per_output, &last.rmse_test_per_output) {
                    (Some(before), Some(after)) =>
                        format!(", on held-out data {}", falls(before, after, unit)),
                    _ => String::new(),
                }
            ));
            if diagnosis.verdict == Verdict::Partial {
                said.extend(diagnosis.acceptance.as_ref().and_then(of_acceptance));
            }
            if let Some(left) = left {
                said.push(format!(
                    "Something remains: {}.",
                    left_over(left, last, diagnosis)
                ));
            }
        }
    }
    said.extend(shaped);
    said
}

/// From what errors fall to what: `from 0.900 to 0.300 cm`, of several outputs each with its name.
fn falls(before: &PerOutput, after: &PerOutput, unit: &str) -> String {
    let several = before.0.len() > 1;
    let pairs = before.0.iter().zip(after.values());
    let words = pairs.map(|((name, before), after)| {
        let of = if several {
            format!(" ({name})")
        } else {
            String::new()
        };
        format!("from {before:.3} to {after:.3} {unit}{of}")
    });
    list(&words.collect::<Vec<_>>(), "and")
}

/// A sentence for each effect of the answer: its group, its place and its size.
fn of_effects(diagnosis: &Diagnosis, last: &Step) -> Vec<String> {
    let domain = diagnosis.domain();
    let added = diagnosis.effects.iter().zip(&diagnosis.groups);
    added
        .zip(diagnosis.steps.iter().skip(1))
        .enumerate()
        .map(|(k, ((effect, group), step))| {
            let it_is = if diagnosis.verdict == Verdict::Partial && k == 0 {
                "It is mostly"
            } else {
                "It is"
            };
            let size = size_of(effect, last);
            let place = match diagnosis.places.get(k).map(Vec::as_slice) {
                Some([best, other, ..]) if other.relative_likelihood > SAME_PLACE_LIKELIHOOD => {
                    format!(
                        " ({} or the {} one: the place cannot be told)",
                        domain.place_words(effect, &best.place),
                        domain.vessel_words(&other.place).0
                    )
                }
                _ => step
                    .place
                    .as_ref()
                    .map_or(String::new(), |place| {
                        format!(" {}", domain.place_words(effect, place))
                    }),
            };
            let doubt = if diagnosis.in_doubt.get(k) == Some(&true) {
                " In doubt: its size stands at a bound of what is plausible, so it describes the data rather than explains them."
            } else {
                ""
            };
            let named = |effect: &String| match in_general(effect, domain) {
                Some(clause) => format!("{effect} ({clause})"),
                None => effect.clone(),
            };
            if group.len() > 1 {
                let group_named: Vec<String> = group.iter().map(named).collect();
                format!(
                    "{it_is} {}: these data cannot tell them apart; {effect}{place}{size} fits best.{doubt}{}",
                    list(&group_named, "or"),
                    next_experiment(group, diagnosis.effects.len())
                )
            } else {
                let clause = in_general(effect, domain);
                let clause = clause.map_or(String::new(), |clause| format!(": {clause}"));
                format!("{it_is} {effect}{place}{size}{clause}.{doubt}")
            }
        })
        .collect()
}

/// Another place is said to be possible from this relative likelihood on.
const SAME_PLACE_LIKELIHOOD: f64 = 0.05;

/// The parameters of an effect with their standard errors, in brackets.
fn size_of(effect: &str, step: &Step) -> String {
    let prefix = format!("{effect}.");
    let sizes: Vec<String> = step
        .parameters
        .iter()
        .filter_map(|p| Some((p, p.name.strip_prefix(&prefix)?)))
        // Where a lag stood before the record says nothing of the effect.
        .filter(|(_, name)| !name.starts_with("before"))
        .enumerate()
        .filter(|(k, (p, _))| *k == 0 || p.std_error.is_some())
        .map(|(_, (p, name))| format!("{name} = {}", with_error(p)))
        .collect();
    if sizes.is_empty() {
        String::new()
    } else {
        format!(" ({})", sizes.join(", "))
    }
}

/// How much of the excess error the effects of a partial answer explain.
fn of_acceptance(acceptance: &Acceptance) -> Option<String> {
    let share = acceptance.share?;
    let held_out = acceptance.share_test.map_or(String::new(), |share| {
        format!(", {:.0} % on held-out data", 100.0 * share)
    });
    Some(format!(
        "That is {:.0} % of the squared error above the noise floor{held_out}; {:.0} % would make it the whole answer.",
        100.0 * share,
        100.0 * acceptance.required
    ))
}

/// The command that proposes what would tell the first two of a group apart.
fn next_experiment(group: &[String], added: usize) -> String {
    let [a, b, ..] = group else {
        return String::new();
    };
    let others = if added > 1 {
        ", once the other effects are in the model file,"
    } else {
        ""
    };
    format!(
        " `ctid design ... --between {a} {b}`{others} says whether an experiment would, and which."
    )
}

/// A time of which two digits are known: in seconds below two hours.
fn about(seconds: f64) -> String {
    if seconds.abs() < 7200.0 {
        format!("{} s", significant(seconds, 2))
    } else {
        duration(seconds)
    }
}

/// What was done about rows and samples of inputs that are missing.
pub(crate) fn of_gaps(mended: &MendedGaps) -> Option<String> {
    let Gaps {
        rows,
        places,
        held,
        cut,
        unused,
        longest_hold,
    } = mended.gaps;
    let count = |count: usize, one: &str, several: &str| match count {
        1 => format!("1 {one}"),
        count => format!("{count} {several}"),
    };
    if places == 0 {
        return (unused > 0).then(|| {
            format!(
                "{} not used: an input is not known there.",
                count(unused, "row is", "rows are")
            )
        });
    }
    let mut text = match rows {
        0 => format!(
            "Samples of an input are missing in {}",
            count(places, "place", "places")
        ),
        rows => format!(
            "{} missing in {}",
            count(rows, "row is", "rows are"),
            count(places, "place", "places")
        ),
    };
    if held > 0 {
        text += &format!(
            "; the input is held through {held} of them, for at most {}",
            duration(longest_hold)
        );
    }
    if cut > 0 {
        text += &format!(
            "; the simulation begins anew behind {cut}, where holding would take longer than {:.0} % of the fastest time constant ({})",
            100.0 * LONGEST_HOLD,
            duration(mended.time_constant)
        );
    }
    if unused > 0 {
        text += &format!("; {} not used", count(unused, "row is", "rows are"));
    }
    Some(text + ".")
}
