//! `ctid design` of a user's own model: the next experiment, at one of its inputs or at several.

use ct_signals::{Heading, duration};
use effect_search::design::{
    Alternative, Design, Experiment, InputRange, InputSequenceKind, Kind, Limits, Prospect, Reach,
    design as search,
};
use effect_search::{Options, Progress};
use serde::Serialize;

use super::blame::blame;
use super::effects::{every_candidate, find};
use super::file::{OwnModelFile, Records};
use super::problem::problem;
use super::words::{EffectWords, shown_unit};
use crate::csv_text::{cell, csv_text, header};
use crate::design::text::{self, SHOWN, lines, power};
use crate::findings::Reader;
use crate::look::{Look, Side};
use crate::output::Found;
use crate::sentences::{interval, with_unit};
use crate::{Error, MessageNames, numbers};

/// A significant effect lowers the criterion by this much.
const NEEDED: f64 = 6.0;
/// An output that leaves its range in the records by more than this share of it is reported.
const FAR: f64 = 1.0;
/// Records decide between two effects if the criteria of their models differ by more than this.
const DECIDED: f64 = 10.0;

/// Searches the experiments.
///
/// # Errors
/// Where the effects or the limits do not allow one, or nothing can be fitted.
pub fn design(
    file: &OwnModelFile,
    records: &Records,
    between: [&str; 2],
    limits: &Limits,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Design, Error> {
    let all = every_candidate(&file.base, &file.candidates, &file.effects.functions)?;
    let mut ids = Vec::with_capacity(2);
    for name in between {
        let found = find(&file.base, &all, name).map_err(Error::UnknownEffect)?;
        ids.push(found.id.as_str());
    }
    let problem = problem(file, records)?;
    let found = search(&problem, [ids[0], ids[1]], limits, options, progress);
    found.map_err(|error| match error {
        // An error in the options, not in a file.
        effect_search::Error::Design(refused) => refused.into(),
        error => blame(&problem.records, error),
    })
}

/// A design, and the format of its experiment.
#[derive(Debug, Serialize)]
pub(crate) struct OwnProposal {
    #[serde(flatten)]
    pub design: Design,
    /// The experiment as CSV; none if no experiment is worthwhile.
    #[serde(skip)]
    record: Option<String>,
}

impl OwnProposal {
    /// A design whose experiment has the columns of the model file.
    pub fn new(design: Design, file: &OwnModelFile) -> Self {
        let record = (!design.twins()).then(|| csv(&design, file));
        Self { design, record }
    }
}

impl Found for OwnProposal {
    fn record(&self) -> Option<String> {
        self.record.clone()
    }
}

fn csv(design: &Design, file: &OwnModelFile) -> String {
    let (time, time_unit) = file.columns.time_header();
    let names = file
        .columns
        .inputs
        .iter()
        .map(|name| Heading::of(name).name);
    let inputs = &design.experiment.inputs;
    let mut head = vec![time];
    head.extend(
        names
            .zip(inputs)
            .map(|(name, input)| header(&name, &input.unit)),
    );
    let rows = design.experiment.time.iter().enumerate().map(|(k, time)| {
        let values = inputs.iter().map(|input| cell(input.values[k]));
        std::iter::once(cell(time / time_unit))
            .chain(values)
            .collect()
    });
    csv_text(std::iter::once(head).chain(rows))
}

/// What `ctid design` prints.
pub(crate) fn said(file: &OwnModelFile, design: &Design, look: Look) -> String {
    let mut text = alternatives(design, look) + &listed(file, design, look);
    text += &format!("{}\n", look.heading("The next experiment"));
    for sentence in sentences(file, design, Reader::Commands) {
        text += &look.paragraph("  ", &sentence);
    }
    text
}

/// Table of the two effects, fitted to the existing records: sizes and fall of the criterion.
fn alternatives(design: &Design, look: Look) -> String {
    let title = format!(
        "{} or {}, on the existing records, weighted by their noise",
        design.between[0].effect, design.between[1].effect
    );
    let mut rows = vec![
        ["effect", "BIC falls", "sizes"]
            .map(|name| look.faint(name))
            .to_vec(),
    ];
    for Alternative {
        effect,
        sizes,
        bic_gain,
        ..
    } in &design.between
    {
        let sizes = sizes
            .iter()
            .map(|(name, value)| format!("{name} {}", numbers::significant(*value, 3)));
        let sizes: Vec<String> = sizes.collect();
        rows.push(vec![
            effect.clone(),
            numbers::whole(*bic_gain),
            sizes.join(", "),
        ]);
    }
    lines(
        &look.heading(&title),
        &[Side::Left, Side::Right, Side::Left],
        &rows,
    )
}

fn range(low: f64, high: f64, unit: &str) -> String {
    interval((low, high), " .. ", shown_unit(unit))
}

/// Length and inputs with their permitted changes: `33 min, u 0 .. 36 % (visited)`.
pub(crate) fn limits(design: &Design) -> String {
    let of = |limits: &InputRange| {
        let from = if limits.visited { " (visited)" } else { "" };
        let slew = limits.slew.map_or(String::new(), |slew| {
            let slew = with_unit(&numbers::significant(slew, 3), shown_unit(&limits.unit));
            format!(", at most {slew} a second")
        });
        format!(
            "{} {}{from}{slew}",
            limits.input,
            range(limits.low, limits.high, &limits.unit)
        )
    };
    let ranges: Vec<String> = design.ranges.iter().map(of).collect();
    format!(
        "experiments of {} with {}",
        duration(design.duration),
        ranges.join(", ")
    )
}

/// An experiment in words.
pub(crate) struct ShownExperiment {
    /// Course of the inputs.
    pub what: String,
    /// Range of each output.
    pub reaches: Vec<String>,
    pub power: String,
    pub decides: String,
}

/// The best experiments, and the repetition of the previous one.
pub(crate) fn experiments(file: &OwnModelFile, design: &Design) -> Vec<ShownExperiment> {
    let shown = design.experiments.iter().take(SHOWN);
    let all = shown.chain(&design.again);
    all.map(|experiment| in_words(file, design, experiment))
        .collect()
}

fn in_words(file: &OwnModelFile, design: &Design, experiment: &Experiment) -> ShownExperiment {
    let again = |applied: &&InputSequenceKind| applied.kind == Kind::Again;
    let what = match experiment.inputs.iter().find(again) {
        Some(_) => Kind::Again.name().to_string(),
        None => applied(design, experiment),
    };
    let reaches = experiment.reaches.iter().map(|reach| {
        let to = range(reach.low, reach.high, file.unit_of(&reach.output));
        format!("{} {to}", reach.output)
    });
    ShownExperiment {
        what,
        reaches: reaches.collect(),
        power: power(&experiment.power, experiment.refitted),
        decides: format!("{:.2}", experiment.power.decides),
    }
}

/// The experiments, the best first, and the repetition of the previous one, as a table.
fn listed(file: &OwnModelFile, design: &Design, look: Look) -> String {
    let mut title = limits(design);
    title.replace_range(..1, "E");
    let heading = ["", "experiment", "outputs reach", "power", "decides"];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    let count = design.experiments.len().min(SHOWN);
    let shown = experiments(file, design).into_iter().enumerate();
    rows.extend(shown.map(|(k, shown)| {
        let number = if k < count {
            (k + 1).to_string()
        } else {
            String::new()
        };
        let reaches = shown.reaches.join(", ");
        vec![number, shown.what, reaches, shown.power, shown.decides]
    }));
    let sides = [
        Side::Right,
        Side::Left,
        Side::Left,
        Side::Right,
        Side::Right,
    ];
    text::listed(&title, (&sides, &rows), design.experiments.len(), look)
}

/// Sequences of the inputs that change.
fn applied(design: &Design, experiment: &Experiment) -> String {
    let inputs = experiment.inputs.iter();
    let inputs: Vec<String> = inputs.map(|own| sequence_words(design, own)).collect();
    inputs.join("; ")
}

fn sequence_words(design: &Design, applied: &InputSequenceKind) -> String {
    let mut ranges = design.ranges.iter();
    let own = ranges.find(|range| range.input == applied.input);
    let unit = own.map_or("", |range| range.unit.as_str());
    if applied.kind == Kind::Constant {
        let value = numbers::significant(applied.low, 3);
        let value = with_unit(&value, shown_unit(unit));
        return format!("{} constant at {value}", applied.input);
    }
    let levels = applied
        .levels
        .map_or(String::new(), |n| format!(" of {n} levels"));
    format!(
        "{}: {}{levels} {}, held {}",
        applied.input,
        applied.kind.name(),
        range(applied.low, applied.high, unit),
        duration(applied.clock)
    )
}

/// Sentence about which of the two effects the existing records show; `None` if they leave it open.
fn decided(design: &Design) -> Option<String> {
    let [first, second] = &design.between;
    let (better, other) = if design.bic_ahead > 0.0 {
        (first, second)
    } else {
        (second, first)
    };
    let ahead = design.bic_ahead.abs();
    (ahead > DECIDED && better.bic_gain > NEEDED).then(|| {
        format!(
            "These records decide already: {} lowers the criterion by {} more than {} does.",
            better.effect,
            numbers::significant(ahead, 3),
            other.effect
        )
    })
}

/// Warning about an output that goes far beyond its range in the records.
fn outside(file: &OwnModelFile, reach: &Reach) -> Option<String> {
    let unit = file.unit_of(&reach.output);
    (reach.excursion() > FAR).then(|| {
        format!(
            "Neither model is validated far outside the records: {} would reach {}, and was within {} in the records. Give narrower ranges of the inputs if the plant must not reach these values.",
            reach.output,
            range(reach.low, reach.high, unit),
            range(reach.visited_low, reach.visited_high, unit)
        )
    })
}

/// Sentences: the experiment to apply, and the expected result.
pub(crate) fn sentences(file: &OwnModelFile, design: &Design, reader: Reader) -> Vec<String> {
    let words = EffectWords::of(file);
    let [a, b] = design
        .between
        .each_ref()
        .map(|alternative| alternative.effect.as_str());
    let mut all = Vec::new();
    let Some(best) = design.experiments.first() else {
        return all;
    };
    let applied = applied(design, best);
    let (wider, longer, effort) = match reader {
        Reader::Commands => (
            " (--input NAME=LOW..HIGH)",
            " (--duration)",
            "; --effort thorough searches longer",
        ),
        Reader::Page => ("", "", ""),
    };
    let decides = 100.0 * best.power.decides;
    let decided = decided(design);
    let is_decided = decided.is_some();
    all.extend(decided);
    if is_decided && design.twins() {
        return all;
    }
    all.push(match design.prospect {
        Prospect::Twins => format!(
            "{} and {} give the same response in every experiment that was tried within these limits: no experiment of this kind distinguishes them. Another sensor, or an inspection of the plant, may.",
            words.placed(a),
            words.placed(b)
        ),
        Prospect::Decides => format!("Apply {applied}. It decides between {a} and {b} with a probability of {decides:.0} %."),
        Prospect::May => format!("Apply {applied}. It may decide between {a} and {b}: the probability is {decides:.0} %."),
        Prospect::Hardly => format!(
            "Within these limits no experiment is likely to decide between {a} and {b}; the best is {applied}, with a probability of {decides:.0} %. A wider range{wider} or a longer experiment{longer} increases it."
        ),
    });
    if design
        .between
        .iter()
        .all(|alternative| alternative.bic_gain < NEEDED)
    {
        all.push(format!(
            "These records support neither of the two: {a} and {b}, alone, do not lower the criterion by {NEEDED}. The experiments are evaluated with the small sizes above."
        ));
    }
    let held: Vec<String> = design
        .experiment
        .inputs
        .iter()
        .filter(|input| {
            best.inputs
                .iter()
                .all(|applied| applied.input != input.input)
        })
        .filter_map(|input| {
            let value = numbers::significant(*input.values.first()?, 3);
            let value = format!("{} = {value}", input.input);
            Some(with_unit(&value, shown_unit(&input.unit)))
        })
        .collect();
    if !design.twins() && !held.is_empty() {
        all.push(format!("Hold {}.", held.join(", ")));
    }
    if !design.twins() {
        all.extend(best.reaches.iter().filter_map(|reach| outside(file, reach)));
    }
    if let Some(times) = design.times_as_long.filter(|_| !design.twins()) {
        all.push(format!(
            "Applied {times} times, it would decide between them."
        ));
    }
    let known = design.control_loop.iter();
    all.extend(known.map(|known| file.loop_sentence(known, &MessageNames::PROGRAM)));
    if !file.controllers.is_empty() && !design.twins() {
        all.push("The experiment is in open loop: switch the controller to manual.".to_string());
    }
    if !design.left_out.is_empty() {
        all.push(format!(
            "Left out by the time limit: {}{effort}.",
            design.left_out.join(", ")
        ));
    }
    all
}
