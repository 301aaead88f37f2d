//! Diagnosis of a user's own model.

use ct_signals::{Clock, record_names};
use effect_search::{Diagnosis, NotNoise, Options, Step, Thresholds, Verdict};

use super::blame::blame;
use super::estimates::{estimates, state_rows};
use super::file::{OwnModelFile, Records};
use super::problem::problem;
use super::text::{failures, undetermined};
use super::unknown;
use super::words::{EffectWords, shown_unit};
use super::{held_out, hints, singles};
use crate::look::{Look, Side, table_text};
use crate::numbers;
use crate::sentences::of_gaps;
use crate::sentences::remarks::{absorbed, rounding, single_minimum};
use crate::sentences::with_unit;
use crate::terminal::without_50;
use crate::{Error, MessageNames};

/// Noise of which this share of the variance follows from the readings before is called correlated.
const CORRELATED: f64 = 0.25;

/// Searches the candidates.
///
/// # Errors
/// If nothing can be fitted; the message names the file that causes it.
pub fn diagnose(
    file: &OwnModelFile,
    records: &Records,
    options: &Options,
    progress: &(dyn Fn(effect_search::Progress) + Sync),
) -> Result<Diagnosis, Error> {
    let problem = problem(file, records)?;
    effect_search::diagnose(&problem, options, progress)
        .map_err(|error| blame(&problem.records, error))
}

/// Text output of a diagnosis.
pub(crate) fn said(
    file: &OwnModelFile,
    records: &Records,
    diagnosis: &Diagnosis,
    look: Look,
) -> String {
    let words = EffectWords::of(file);
    let mut text = format!("{}\n\n", look.heading(&diagnosis.model));
    let fails = |name: &str, step: &Step| {
        let clock = Clock::of(&records.records);
        let fitted = record_names(&records.records);
        failures(name, step, (&clock, &fitted), |y| file.unit_of(y), look)
    };
    let mut not_determined: &[Vec<String>] = &[];
    if let Some(first) = diagnosis.steps.first() {
        // What the records cannot determine comes before anything that is concluded from them.
        not_determined = &first.not_determined;
        text += &undetermined(not_determined, look);
        text += &fails(&diagnosis.model, first);
    }
    text += &singles::table(diagnosis, look);
    text += &errors(file, diagnosis, look);
    if let Some(last) = diagnosis.steps.last() {
        text += &estimates(last, look);
        if last.not_determined != not_determined {
            text += &undetermined(&last.not_determined, look);
        }
        if diagnosis.verdict == Verdict::Partial && last.added.is_some() {
            text.push('\n');
            text += fails("the model with these effects", last).trim_end();
            text.push('\n');
        }
    }
    text += &format!("\n{}\n", look.heading(&heading(diagnosis)));
    for sentence in sentences(file, diagnosis, &words) {
        text += &look.paragraph("  ", &sentence);
    }
    if let Some(unknown) = &diagnosis.unknown {
        text += &unknown::values(unknown, look);
    }
    text
}

/// The finding in a few words.
pub(crate) fn heading(diagnosis: &Diagnosis) -> String {
    let kind = match diagnosis.verdict {
        Verdict::Adequate => {
            return "Nothing is missing that these records would show".to_string();
        }
        Verdict::Unexplained if is_untried(diagnosis) => {
            return "No candidate was fitted within the time limit".to_string();
        }
        Verdict::Unexplained => return "Nothing explains it".to_string(),
        Verdict::Partial if diagnosis.share.is_some_and(|share| share < 0.5) => "In part",
        Verdict::Partial => "Mostly",
        Verdict::Effect | Verdict::Undecided => "Missing",
    };
    let contradicted = if held_out::error_rises(&diagnosis.steps) {
        "; but the error on the held-out records rises"
    } else {
        ""
    };
    format!("{kind}: {}{contradicted}", diagnosis.effects.join(", "))
}

/// Whether the time limit ended the search before a single effect was fitted.
fn is_untried(diagnosis: &Diagnosis) -> bool {
    diagnosis.singles.is_empty() && !diagnosis.left_out.is_empty()
}

/// Most alternatives of an effect that are told with their places.
const MOST_PLACED: usize = 4;

/// Findings in sentences.
pub(super) fn sentences(
    file: &OwnModelFile,
    diagnosis: &Diagnosis,
    words: &EffectWords,
) -> Vec<String> {
    let mut all = Vec::new();
    for group in &diagnosis.groups {
        let [first, others @ ..] = group.as_slice() else {
            continue;
        };
        all.push(format!(
            "It is {}, {}. {}.",
            words.placed(first),
            match sizes(diagnosis, first) {
                sizes if sizes.is_empty() => "see its parameters above".to_string(),
                sizes => sizes.join(", "),
            },
            words.physics(first)
        ));
        if others.len() > MOST_PLACED {
            all.push(format!(
                "Or it is one of {} others, which these records do not distinguish from it: {}.",
                others.len(),
                others.join(", ")
            ));
        } else if !others.is_empty() {
            let others: Vec<String> = others.iter().map(|id| words.placed(id)).collect();
            all.push(format!(
                "Or it is {}: these records do not distinguish them.",
                others.join(", or ")
            ));
        }
    }
    all.extend(remaining(file, diagnosis));
    all.extend(
        diagnosis
            .unknown
            .as_ref()
            .map(|unknown| unknown::said(unknown, words)),
    );
    all
}

/// Share of the error that the effects explain, tests of the residual, and the loop of the records.
pub(crate) fn remaining(file: &OwnModelFile, diagnosis: &Diagnosis) -> Vec<String> {
    let mut all = Vec::new();
    let beside_noise = diagnosis.verdict == Verdict::Partial && diagnosis.not_noise.is_none();
    if let Some(share) = diagnosis.share {
        let above = if beside_noise {
            "what no earlier reading predicts"
        } else {
            "the noise"
        };
        all.push(format!(
            "The effects explain {:.0} % of the squared error above {above}.",
            100.0 * share
        ));
    }
    match (&diagnosis.not_noise, diagnosis.verdict) {
        (Some(left), Verdict::Unexplained) => all.push(format!(
            "The residual of the model is not noise: {}. {}.",
            said_of(left),
            if is_untried(diagnosis) {
                "The time limit ended the search before a candidate was fitted"
            } else {
                "No candidate explains it"
            }
        )),
        (Some(left), _) => all.push(format!(
            "The residual of the model with these effects is not noise: {}.",
            said_of(left)
        )),
        (None, Verdict::Adequate) => {
            all.push("The residual of the model looks like noise.".to_string());
            all.extend(correlated(diagnosis));
            all.extend(singles::would_have_shown(diagnosis));
        }
        (None, _) => {
            all.push("The residual of the model with these effects looks like noise.".to_string());
            all.extend(correlated(diagnosis));
        }
    }
    all.extend(diagnosis.quantisation.iter().map(|rounded| {
        let of = format!(" of {}", rounded.output);
        rounding(&of, rounded.step, shown_unit(&rounded.unit), rounded.share)
    }));
    let many = Thresholds::DEFAULT.many_effects;
    // Rounding, which the readings show, compensates for nothing.
    let effects = diagnosis.effects.iter();
    let searched = effects
        .filter(|id| !id.starts_with("quantisation("))
        .count();
    if searched >= many {
        all.push(format!(
            "{many} effects or more together may compensate for an effect that is not among the candidates: treat them as a description of the records until each is confirmed."
        ));
    }
    if beside_noise && !diagnosis.left_out.is_empty() && searched < many {
        all.push(
            "The search was cut short, so this noise may contain effects that were not tried."
                .to_string(),
        );
    }
    let base = diagnosis.steps.first();
    all.extend(base.and_then(|base| {
        let minimum = "the minimum of the model that the search begins with";
        single_minimum(base.starts, base.starts_agree, minimum)
    }));
    all.extend(held_out::rises(file, &diagnosis.steps));
    all.extend(hints::of_text(file, diagnosis));
    all.extend(diagnosis.absorbed.iter().map(absorbed));
    all.extend(diagnosis.gaps.as_ref().and_then(of_gaps));
    let known = diagnosis.control_loop.iter();
    all.extend(known.map(|known| file.loop_sentence(known, &MessageNames::PROGRAM)));
    let mut known = diagnosis.control_loop.iter();
    if known.any(|known| known.simulated && !known.needed) && diagnosis.not_noise.is_some() {
        all.push("The errors and estimates of the models are those of fits on the measured inputs; the effects were found in the simulated loop.".to_string());
    }
    if !diagnosis.left_out.is_empty() {
        all.push(format!(
            "Left out by the time limit: {}; --effort thorough searches longer.",
            diagnosis.left_out.join(", ")
        ));
    }
    all
}

/// Outputs with a correlated residual, which may not be noise alone.
fn correlated(diagnosis: &Diagnosis) -> Option<String> {
    let correlated = diagnosis.noise.iter().filter_map(|noise| {
        let predictable = noise.predictable();
        let share = format!(
            "{:.0} % of its variance at {}",
            100.0 * predictable,
            noise.output
        );
        // Beside a partial explanation a smaller share may be what the effects leave.
        let least = if diagnosis.verdict == Verdict::Partial {
            f64::MIN_POSITIVE
        } else {
            CORRELATED
        };
        (predictable >= least).then_some(share)
    });
    let correlated: Vec<String> = correlated.collect();
    (!correlated.is_empty()).then(|| {
        format!(
            "The noise is correlated: {} follows from the readings before. A slow disturbance, or an effect of another shape, would look like that too.",
            correlated.join(", ")
        )
    })
}

/// The sizes of an effect in the last model, each with its standard error and unit.
pub(crate) fn sizes(diagnosis: &Diagnosis, effect: &str) -> Vec<String> {
    let last = diagnosis.steps.last().into_iter();
    let own = last
        .flat_map(|last| &last.parameters)
        .filter(|p| p.effect.as_deref() == Some(effect));
    own.map(|p| {
        let value = numbers::with_error(p.value, p.std_error);
        with_unit(&format!("{} = {value}", p.name), shown_unit(&p.unit))
    })
    .collect()
}

fn said_of(left: &NotNoise) -> String {
    match left {
        NotNoise::Input { input, output } => format!("the residual of {output} depends on {input}"),
        NotNoise::Period { output, period } => format!(
            "the residual of {output} has a period of {}",
            ct_signals::duration(*period)
        ),
        NotNoise::Instant {
            output,
            record,
            from,
            to,
        } => format!(
            "abrupt change of {output} in {record} at {} to {} that noise does not explain",
            ct_signals::duration(*from),
            ct_signals::duration(*to)
        ),
        NotNoise::Disturbance {
            output,
            record,
            from,
            to,
        } => format!(
            "the residual of {output} in {record} from {} to {} is larger than noise with its correlation would be: a temporary disturbance",
            ct_signals::duration(*from),
            ct_signals::duration(*to)
        ),
        NotNoise::LevelShift {
            output,
            record,
            at,
            size,
            unit,
        } => format!(
            "a jump of the reading of {output} in {record} by {} {} at {} fits better than the candidates",
            numbers::significant(*size, 3),
            shown_unit(unit),
            ct_signals::duration(*at)
        ),
        NotNoise::Level { output } => {
            format!("the residual of {output} depends on the model's output")
        }
        NotNoise::Spectrum { output, record } => format!(
            "the spectrum of the residual of {output} changes during {record}: one noise model does not explain it"
        ),
        NotNoise::Function { effect, variable } => {
            format!("a function of {variable} lowers the error by more than noise would: {effect}")
        }
        NotNoise::Correlation { output } => format!(
            "first-order noise does not describe the correlation of the residual of {output}: \
             for example a disturbance in a band of frequencies, or an effect that is not among the candidates"
        ),
        NotNoise::Slow { output } => format!(
            "the residual of {output} drifts: its correlation time is too long for the records to show whether it is noise"
        ),
    }
}

/// The error of each step at each output.
fn errors(file: &OwnModelFile, diagnosis: &Diagnosis, look: Look) -> String {
    let mut text = format!("{}\n", look.heading("Simulation error, root mean square"));
    let Some(first) = diagnosis.steps.first() else {
        return text;
    };
    let held_out = first.rmse_test_per_output.is_some();
    let mut head = vec![String::new()];
    for output in first.rmse_per_output.keys() {
        head.push(output.clone());
        if held_out {
            head.push(format!("{output}, held out"));
        }
    }
    let mut rows = vec![head];
    for step in &diagnosis.steps {
        let name = step
            .added
            .as_ref()
            .map_or_else(|| diagnosis.model.clone(), |effect| format!("+ {effect}"));
        let mut row = vec![name];
        for (output, rmse) in &step.rmse_per_output {
            row.push(numbers::significant(*rmse, 3));
            if held_out {
                let test = step.rmse_test_per_output.as_ref();
                let value = test.and_then(|test| test.get(output));
                row.push(value.map_or(String::new(), |v| numbers::significant(*v, 3)));
            }
        }
        rows.push(row);
    }
    let noise = first.rmse_per_output.keys().flat_map(|output| {
        let own = diagnosis.noise.iter().find(|noise| noise.output == *output);
        let own = own.map_or(String::new(), |noise| numbers::significant(noise.level, 3));
        std::iter::once(own).chain(held_out.then(String::new))
    });
    rows.push(std::iter::once("noise".to_string()).chain(noise).collect());
    let sides: Vec<Side> = (0..rows[0].len())
        .map(|i| if i == 0 { Side::Left } else { Side::Right })
        .collect();
    text += &table_text(&sides, &rows);
    let outputs = diagnosis.steps.iter().map(|step| step.outputs.as_slice());
    text + &state_rows(first) + &without_50(outputs, |name| file.unit_of(name), look)
}
