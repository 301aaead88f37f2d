//! Text output of a design; it is derived from the struct that `--json` writes.

use missing_effect::design::{Alternative, Candidate, Design, Power};

use crate::findings::{self, Reader};
use crate::look::{Look, Side, table_text};
use crate::numbers;
use crate::sentences::{self, interval, placed, with_unit};

/// Number of experiments in the table.
pub(crate) const SHOWN: usize = 10;
/// Meaning of the table's columns.
const NOTE: &str = "(power: the expected rise of the criterion of the wrong model; decides: the probability that it ends more than 6 above the right one; ~: not confirmed by a refit; among experiments with ample power the first stays closest to the range of the records)";

fn named(alternative: &Alternative) -> String {
    placed(&alternative.effect, alternative.place.as_deref())
}

/// What `ctid design` prints.
#[must_use]
pub fn design(design: &Design, look: Look) -> String {
    alternatives(design, look) + &experiments(design, look) + &findings(design, look)
}

/// The two effects on the existing records.
fn alternatives(design: &Design, look: Look) -> String {
    let [a, b] = &design.between;
    let title = format!(
        "{} or {}, on the existing records, weighted by their noise",
        named(a),
        named(b)
    );
    let heading = ["effect", "BIC falls", "size found"];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    for alternative in [a, b] {
        let size = alternative.size.as_ref().map_or(String::new(), |size| {
            let name = size.name.rsplit('.').next().unwrap_or_default();
            let value = numbers::with_error(size.value, size.std_error);
            with_unit(&format!("{name} {value}"), &size.unit)
        });
        rows.push(vec![
            named(alternative),
            numbers::whole(alternative.bic_gain),
            size,
        ]);
    }
    let sides = [Side::Left, Side::Right, Side::Left];
    lines(&look.heading(&title), &sides, &rows)
}

/// The experiments, the best first, and the repetition of the previous one.
fn experiments(design: &Design, look: Look) -> String {
    let (unit, limits) = (&design.experiment.unit, &design.limits);
    let what = if design.in_loop {
        "reference"
    } else {
        "command"
    };
    let slew = limits.slew.map_or(String::new(), |slew| {
        format!(
            ", at most {} a second",
            with_unit(&numbers::significant(slew, 3), unit)
        )
    });
    let title = format!(
        "Experiments with the {what} between {} ({}{slew}), {}",
        interval((limits.low, limits.high), " and ", unit),
        limits.range_from,
        numbers::duration(limits.duration)
    );
    let heading = [
        "",
        "experiment",
        "range",
        "held for",
        design.domain().level_words("level"),
        "power",
        "decides",
    ];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    for (k, candidate) in design.candidates.iter().take(SHOWN).enumerate() {
        rows.push(row(&(k + 1).to_string(), candidate, design));
    }
    rows.extend(design.again.iter().map(|again| row("", again, design)));
    let sides = [
        Side::Right,
        Side::Left,
        Side::Left,
        Side::Right,
        Side::Left,
        Side::Right,
        Side::Right,
    ];
    listed(&title, (&sides, &rows), design.candidates.len(), look)
}

fn row(number: &str, candidate: &Candidate, design: &Design) -> Vec<String> {
    let range = |low: f64, high: f64, unit: &str| interval((low, high), " .. ", unit);
    let mut kind = candidate.kind.name().to_string();
    if let Some(levels) = candidate.levels {
        kind += &format!(", {levels} levels");
    }
    let again = candidate.kind == missing_effect::design::Kind::Again;
    vec![
        number.to_string(),
        kind,
        range(candidate.low, candidate.high, &design.experiment.unit),
        if again {
            String::new()
        } else {
            format!("{} s", numbers::significant(candidate.clock, 3))
        },
        // The last level is the measured one.
        candidate.reaches.last().map_or(String::new(), |reach| {
            range(reach.low, reach.high, &design.output_unit)
        }),
        power(&candidate.power, candidate.refitted),
        format!("{:.2}", candidate.power.decides),
    ]
}

/// Values below a hundredth are shown as zero.
pub(crate) fn power(power: &Power, refitted: bool) -> String {
    let mark = if refitted { "" } else { "~" };
    if power.power < 0.01 {
        return format!("{mark}nothing");
    }
    format!("{mark}{}", numbers::significant(power.power, 2))
}

fn findings(design: &Design, look: Look) -> String {
    let mut text = format!("{}\n", look.heading("The next experiment"));
    let effort = findings::effort(&design.effort, Reader::Commands);
    for sentence in sentences::of_design(design).iter().chain(&effort) {
        text += &look.paragraph("  ", sentence);
    }
    text
}

/// A table under a heading.
pub(crate) fn lines(heading: &str, sides: &[Side], rows: &[Vec<String>]) -> String {
    format!("{heading}\n{}\n", table_text(sides, rows))
}

/// The table of the experiments, of which the first [`SHOWN`] of `count` are in the rows, and the meaning of its columns.
pub(crate) fn listed(
    title: &str,
    (sides, rows): (&[Side], &[Vec<String>]),
    count: usize,
    look: Look,
) -> String {
    let mut text = format!("{}\n{}", look.heading(title), table_text(sides, rows));
    let more = count.saturating_sub(SHOWN);
    if more > 0 {
        text += &format!("  {}\n", look.faint(format!("and {more} more")));
    }
    text += &look.faint(look.paragraph("  ", NOTE).trim_end());
    text + "\n\n"
}
