//! The catalogue, one effect at a time, for the width of the terminal.

use missing_effect::{Diagnosis, Parameter, Score, Verdict};

use super::with_unit;
use crate::look::{Look, Side, table};
use crate::sentences::placed;
use crate::{findings, numbers};

/// Number of effects in the ranking.
const RANKED: usize = 8;

/// The columns of the ranking, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ranked {
    Place,
    Effect,
    Gain,
    Error,
    Size,
    SizeAlone,
    Detectable,
}

/// The single effects at the first step, best first.
pub(crate) fn ranking(diagnosis: &Diagnosis, look: Look) -> String {
    use Ranked::{Detectable, Effect, Error, Gain, Place, Size, SizeAlone};
    if diagnosis.scores.is_empty() {
        return String::new();
    }
    // As many columns as the width allows. The minimum detectable sizes come first, because the verdict refers to them. The change of the
    // error comes last.
    let variants: [&[Ranked]; 7] = [
        &[Place, Effect, Gain, Error, Size, Detectable],
        &[Place, Effect, Gain, Error, SizeAlone, Detectable],
        &[Place, Effect, Error, SizeAlone, Detectable],
        &[Place, Effect, Gain, Error, Detectable],
        &[Place, Effect, Error, Detectable],
        &[Place, Effect, Error],
        &[Effect, Error],
    ];
    let fits = |lines: &Vec<String>| {
        lines
            .iter()
            .all(|line| console::measure_text_width(line) + 2 <= look.width)
    };
    let tables = variants.map(|columns| ranking_table(diagnosis, columns, look));
    let lines = tables
        .iter()
        .find(|lines| fits(lines))
        .unwrap_or(&tables[6]);

    let title = match diagnosis.verdict {
        Verdict::Adequate => "The catalogue, one effect at a time: none is needed",
        _ => "The catalogue, one effect at a time, refitted: simulation error on fitted data",
    };
    let mut text = format!("{}\n", look.heading(title));
    for line in lines {
        text += &format!("  {line}\n");
    }
    if diagnosis.scores.len() > RANKED {
        let more = format!("and {} more", diagnosis.scores.len() - RANKED);
        text += &format!("  {}\n", look.faint(more));
    }
    text.push('\n');
    text
}

fn ranking_table(diagnosis: &Diagnosis, columns: &[Ranked], look: Look) -> Vec<String> {
    let scores: Vec<&Score> = diagnosis.scores.iter().take(RANKED).collect();
    let errors = scores
        .iter()
        .map(|score| Some(findings::score_error(diagnosis, score).0));
    let errors = numbers::column(&errors.collect::<Vec<_>>());
    let (error_heading, unit) = if findings::several(diagnosis) {
        ("error/noise", "")
    } else {
        ("error after", diagnosis.output_unit.as_str())
    };
    let heading = |column: &Ranked| match column {
        Ranked::Place => String::new(),
        Ranked::Effect => look.faint("effect"),
        Ranked::Gain => look.faint("BIC falls"),
        Ranked::Error => look.faint(error_heading),
        Ranked::Size | Ranked::SizeAlone => look.faint("size found"),
        Ranked::Detectable => look.faint("detectable"),
    };
    let mut rows = vec![columns.iter().map(heading).collect::<Vec<_>>()];
    for (index, score) in scores.iter().enumerate() {
        let size = |with_error: bool| {
            score
                .size
                .as_ref()
                .map_or(String::new(), |found| size(found, with_error))
        };
        let cell = |column: &Ranked| match column {
            Ranked::Place => (index + 1).to_string(),
            Ranked::Effect => {
                let name = placed(&score.effect, score.place.as_deref());
                if findings::is_added(diagnosis, score) {
                    look.good(name)
                } else {
                    name
                }
            }
            Ranked::Gain => numbers::whole(score.bic_gain),
            Ranked::Error => with_unit(&errors[index], unit),
            Ranked::Size => size(true),
            Ranked::SizeAlone => size(false),
            Ranked::Detectable => detectable_from(score),
        };
        rows.push(columns.iter().map(cell).collect());
    }
    let sides: Vec<Side> = columns
        .iter()
        .map(|column| match column {
            Ranked::Place | Ranked::Gain | Ranked::Error => Side::Right,
            _ => Side::Left,
        })
        .collect();
    table(&sides, &rows)
}

/// `rim 21.30 ± 0.12 cm`, or without the error, with the significant digits.
fn size(parameter: &Parameter, with_error: bool) -> String {
    let name = parameter.name.rsplit('.').next().unwrap_or_default();
    let (value, error) = (parameter.value, parameter.std_error);
    let value = match with_error {
        true => numbers::with_error(value, error),
        false => numbers::value_and_error(value, error).0,
    };
    format!("{name} {}", with_unit(&value, &parameter.unit))
}

/// The minimum detectable size.
fn detectable_from(score: &Score) -> String {
    match (score.smallest_visible, &score.size) {
        (Some(smallest), Some(size)) => with_unit(&numbers::significant(smallest, 2), &size.unit),
        (Some(smallest), None) => numbers::significant(smallest, 2),
        (None, _) => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn a_narrow_ranking_keeps_what_would_have_been_visible() {
        let mut diagnosis = sample::two_tanks();
        diagnosis.scores[0].effect = "an_effect_whose_name_is_rather_long".to_owned();
        let seen = |width: usize| {
            let text = ranking(
                &diagnosis,
                Look {
                    width,
                    ..Look::plain()
                },
            );
            let widest = text.lines().skip(1).map(|line| line.chars().count()).max();
            assert!(widest <= Some(width), "{text}");
            ["size found", "detectable", "error after"].map(|column| text.contains(column))
        };
        assert_eq!(seen(200), [true, true, true]);
        assert_eq!(seen(80), [false, true, true]);
        assert_eq!(seen(65), [false, false, true]);
    }
}
