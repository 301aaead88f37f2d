//! Text output of a comparison.

use ct_signals::Clock;
use effect_search::Step;

use super::compare::{Comparison, Curves};
use super::estimates::{estimates, state_rows};
use super::file::OwnModelFile;
use super::fitted::cut_short;
use crate::MessageNames;
use crate::csv_text::header;
use crate::look::{Look, Side, table_text};
use crate::numbers;
use crate::plot::{self, Axis, Curve, plot};
use crate::sentences::{FailureWords, of_gaps};
use crate::terminal::{FAILURES, residual_tests, without_50};

/// The complete comparison, with a plot of the first record.
pub(crate) fn said(file: &OwnModelFile, comparison: &Comparison, look: Look) -> String {
    let [step] = &comparison.steps;
    let name = [std::slice::from_ref(&comparison.model), &comparison.effects].concat();
    let mut text = format!("{}\n\n", look.heading(&name.join(" + ")));
    // What the records cannot determine comes before anything that is concluded from them.
    text += &undetermined(&step.not_determined, look);
    let first = comparison.curves.first().map(|curves| &curves.record);
    for curves in comparison
        .curves
        .iter()
        .filter(|curves| Some(&curves.record) == first)
    {
        text += &drawn(curves, look);
    }
    let fitted: Vec<&str> = first_names(comparison);
    text += &failures(
        &comparison.model,
        step,
        (&comparison.clock, &fitted),
        |name| comparison.unit_of(name),
        look,
    );
    let held_out = step.rmse_test_per_output.as_ref();
    let mut rows = vec![vec![String::new(), "fitted data".to_string()]];
    if held_out.is_some() {
        rows[0].push("held-out data".to_string());
    }
    for (name, rmse) in &step.rmse_per_output {
        let unit = comparison.unit_of(name);
        let number = |value: f64| format!("{} {unit}", numbers::significant(value, 3));
        let mut row = vec![name.clone(), number(*rmse)];
        row.extend(
            held_out
                .and_then(|test| test.get(name))
                .map(|value| number(*value)),
        );
        rows.push(row);
    }
    text += &format!("{}\n", look.heading("Simulation error, root mean square"));
    text += &table_text(&[Side::Left, Side::Right, Side::Right], &rows);
    text += &state_rows(step);
    let outputs = std::iter::once(step.outputs.as_slice());
    text += &without_50(outputs, |name| comparison.unit_of(name), look);
    if step.rmse_per_output.len() > 1 {
        text += &format!(
            "  together {} times the noise, the error of a linear prediction from the past\n",
            numbers::significant(step.weighted_rmse, 3)
        );
    }
    text += &estimates(step, look);
    if let Some(cut) = cut_short(&comparison.effort) {
        text += &look.warning(format!("warning: {cut}"));
        text.push('\n');
    }
    if let Some(gaps) = comparison.gaps.as_ref().and_then(of_gaps) {
        text += &look.paragraph("  ", &gaps);
    }
    if let Some(known) = &comparison.control_loop {
        text += &look.paragraph("  ", &file.loop_sentence(known, &MessageNames::PROGRAM));
    }
    let agree = format!(
        "{} of {} starts ended in this minimum",
        step.starts_agree, step.starts
    );
    text += &format!("  {}\n", look.faint(agree));
    text
}

impl Comparison {
    /// Unit of an output.
    fn unit_of(&self, output: &str) -> &str {
        let own = self.curves.iter().find(|curves| curves.output == output);
        own.map_or("", |curves| curves.unit.as_str())
    }
}

/// Names of the fitted records, in order.
fn first_names(comparison: &Comparison) -> Vec<&str> {
    let mut names: Vec<&str> = comparison
        .curves
        .iter()
        .map(|curves| curves.record.as_str())
        .collect();
    names.dedup();
    names
}

/// Where a model fails, output by output, and the tests of its residual.
pub(super) fn failures<'a>(
    model: &str,
    step: &'a Step,
    (clock, fitted): (&'a Clock, &[&'a str]),
    unit_of: impl Fn(&'a str) -> &'a str,
    look: Look,
) -> String {
    let mut text = String::new();
    for output in &step.outputs {
        let of_output = if step.outputs.len() > 1 {
            format!(": {}", output.name)
        } else {
            String::new()
        };
        let title = if output.failures.worst.is_empty() {
            format!("Tests of the residual of {model}{of_output}")
        } else {
            format!("Where {model} fails{of_output}")
        };
        text += &format!("{}\n", look.heading(&title));
        let words = FailureWords {
            clock,
            fitted: fitted.to_vec(),
            output: &output.name,
            outputs: &output.name,
            unit: unit_of(&output.name),
            input: None,
        };
        for sentence in words.sentences(output).iter().take(FAILURES) {
            text += &look.paragraph("  - ", sentence);
        }
        text += &look.paragraph("  - ", &residual_tests(&output.tests));
        text.push('\n');
    }
    text
}

/// Warnings of the parameters that the records do not determine ([`greybox::not_determined`]).
pub(super) fn undetermined(found: &[Vec<String>], look: Look) -> String {
    let mut text = String::new();
    for together in found {
        let what = match together.as_slice() {
            [one] => format!(
                "{one} has no effect on the readings of these records: fix it under [known], or measure more"
            ),
            [a, b] => format!(
                "these records determine only a combination of {a} and {b}: fix one of them under [known], give a [prior], or excite the plant more"
            ),
            all => format!(
                "these records do not determine {}: fix some of them under [known], or give a [prior]",
                all.join(", ")
            ),
        };
        text += &look.warning_paragraph(what);
    }
    text
}

fn drawn(curves: &Curves, look: Look) -> String {
    let Curves {
        record,
        output,
        unit,
        time,
        measured,
        model,
    } = curves;
    let residual: Vec<f64> = measured.iter().zip(model).map(|(y, m)| y - m).collect();
    let one = [Curve {
        values: &residual,
        colour: plot::RESIDUAL,
    }];
    let own = plot::limits([residual.as_slice()]);
    let title = look.heading(&format!("{record}, {output}:"));
    format!(
        "{title} {}\n{}\n{}\n{}\n",
        header("measured and model", unit),
        plot::overlay(measured, model, Axis::Times(time), look),
        header("Measured minus model", unit),
        plot(&one, Axis::Times(time), own, 5, look)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_records_do_not_determine_is_named_with_its_mend() {
        let group = |names: &[&str]| names.iter().map(|name| name.to_string()).collect();
        let text = undetermined(
            &[
                group(&["limit"]),
                group(&["gain", "size"]),
                group(&["a", "b", "c"]),
            ],
            Look::plain(),
        );
        let lines: Vec<&str> = text.split("warning: ").skip(1).collect();
        assert!(lines[0].starts_with("limit has no effect on the readings"));
        assert!(lines[1].contains("only a combination of gain and size"));
        assert!(lines[2].contains("do not determine a, b, c"));
        assert_eq!(undetermined(&[], Look::plain()), "");
    }
}
