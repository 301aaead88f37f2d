//! The tables of the study.

mod sections;

use std::{collections::BTreeMap, fmt::Write};

use ctid_tests::Drive;
use missing_effect::Verdict;

use self::sections::{Nulls, counted, pairs, times, unknowns};
use crate::outcome::{Answer, Outcome};
use crate::record::{Job, condition};

/// Open or closed loop, white or coloured noise.
const CONDITIONS: [(Drive, bool); 4] = [
    (Drive::Open, false),
    (Drive::Open, true),
    (Drive::Closed, false),
    (Drive::Closed, true),
];

/// A criterion that falls by more than this (BIC) distinguishes two models.
const MARGIN: f64 = 6.0;
/// Upper edges of the histogram of seconds.
const BELOW: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 30.0];

/// The counts of some records with a hidden effect.
#[derive(Debug, Clone, Default)]
struct Count {
    records: usize,
    /// The verdict is not that the model is adequate.
    seen: usize,
    /// Something of the catalogue is named.
    named: usize,
    /// Number of records with the hidden effect in a named group.
    in_group: usize,
    /// Number of records with the hidden effect first in its group.
    first: usize,
    undecided: usize,
    partial: usize,
    sizes: Vec<usize>,
    seconds: Vec<f64>,
}

impl Count {
    fn add(&mut self, effect: &str, answer: &Answer) {
        self.records += 1;
        self.seen += usize::from(answer.verdict != Verdict::Adequate);
        self.named += usize::from(answer.named());
        self.undecided += usize::from(answer.verdict == Verdict::Undecided);
        self.partial += usize::from(answer.verdict == Verdict::Partial);
        self.first += usize::from(answer.effects.iter().any(|named| named == effect));
        if let Some(group) = answer.group(effect).filter(|_| answer.named()) {
            self.in_group += 1;
            self.sizes.push(group.len());
        }
        self.seconds.push(answer.seconds);
    }

    fn percent(&self, part: usize) -> String {
        if self.records == 0 {
            "-".to_string()
        } else {
            format!("{:.0}", 100.0 * part as f64 / self.records as f64)
        }
    }
}

/// A column of counts.
struct Column {
    /// Column name in a terminal, and the column's width.
    short: &'static str,
    width: usize,
    /// Column name on a page, and the text after its figures.
    long: &'static str,
    unit: &'static str,
    figure: fn(&Count) -> String,
}

const COLUMNS: [Column; 9] = [
    Column {
        short: "records",
        width: 7,
        long: "records",
        unit: "",
        figure: |c| c.records.to_string(),
    },
    Column {
        short: "seen",
        width: 6,
        long: "seen",
        unit: " %",
        figure: |c| c.percent(c.seen),
    },
    Column {
        short: "named",
        width: 6,
        long: "named",
        unit: " %",
        figure: |c| c.percent(c.named),
    },
    Column {
        short: "in group",
        width: 8,
        long: "in the named group",
        unit: " %",
        figure: |c| c.percent(c.in_group),
    },
    Column {
        short: "first",
        width: 5,
        long: "named itself",
        unit: " %",
        figure: |c| c.percent(c.first),
    },
    Column {
        short: "undecided",
        width: 9,
        long: "undecided",
        unit: " %",
        figure: |c| c.percent(c.undecided),
    },
    Column {
        short: "partial",
        width: 7,
        long: "partial",
        unit: " %",
        figure: |c| c.percent(c.partial),
    },
    Column {
        short: "size",
        width: 5,
        long: "group size, median",
        unit: "",
        figure: |c| shown(median(&c.sizes)),
    },
    Column {
        short: "seconds",
        width: 7,
        long: "seconds, median",
        unit: "",
        figure: |c| shown(median(&c.seconds)),
    },
];

fn median<T: Copy + PartialOrd>(values: &[T]) -> Option<T> {
    let mut values = values.to_vec();
    values.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    values.get(values.len() / 2).copied()
}

fn shown<T: std::fmt::Display>(value: Option<T>) -> String {
    value.map_or("-".to_string(), |value| format!("{value:.1}"))
}

/// A cell: the effect's place in the catalogue's order, its name, 100 times the ratio, and the condition.
type Cell = (usize, &'static str, u64, usize);

fn cells(jobs: &[Job], outcomes: &[Outcome]) -> BTreeMap<Cell, Count> {
    let mut cells: BTreeMap<Cell, Count> = BTreeMap::new();
    for (job, outcome) in jobs.iter().zip(outcomes) {
        let Job::Effect {
            effect,
            ratio,
            drive,
            coloured,
            ..
        } = job
        else {
            continue;
        };
        let order = plants::CATALOGUE
            .iter()
            .position(|known| known.id == effect.id);
        let at = CONDITIONS
            .iter()
            .position(|known| *known == (*drive, *coloured));
        let key = (
            order.unwrap_or(0),
            effect.id,
            (100.0 * ratio).round() as u64,
            at.unwrap_or(0),
        );
        let cell = cells.entry(key).or_default();
        if let Some(answer) = &outcome.answer {
            cell.add(effect.id, answer);
        }
    }
    cells
}

/// Sums of the counts of all cells that a rule combines.
fn together<K: Ord>(cells: &BTreeMap<Cell, Count>, key: impl Fn(&Cell) -> K) -> BTreeMap<K, Count> {
    let mut sums: BTreeMap<K, Count> = BTreeMap::new();
    for (cell, count) in cells {
        let sum = sums.entry(key(cell)).or_default();
        sum.records += count.records;
        sum.seen += count.seen;
        sum.named += count.named;
        sum.in_group += count.in_group;
        sum.first += count.first;
        sum.undecided += count.undecided;
        sum.partial += count.partial;
        sum.sizes.extend(&count.sizes);
        sum.seconds.extend(&count.seconds);
    }
    sums
}

fn ratio(hundredths: u64) -> String {
    format!("{}", hundredths as f64 / 100.0)
}

fn named_condition(at: usize) -> &'static str {
    let (drive, coloured) = CONDITIONS[at];
    condition(drive, coloured)
}

/// Every cell, then what misses nothing and what is unknown, for a terminal.
pub fn text(jobs: &[Job], outcomes: &[Outcome]) -> String {
    let mut out = String::new();
    let cells = cells(jobs, outcomes);
    if !cells.is_empty() {
        let _ = write!(out, "{:<21} {:>5} {:<16}", "effect", "ratio", "loop, noise");
        for Column { short, width, .. } in &COLUMNS {
            let _ = write!(out, " {short:>width$}");
        }
        out.push('\n');
    }
    for ((_, effect, hundredths, at), count) in &cells {
        let (ratio, condition) = (ratio(*hundredths), named_condition(*at));
        let _ = write!(out, "{effect:<21} {ratio:>5} {condition:<16}");
        for Column { width, figure, .. } in &COLUMNS {
            let _ = write!(out, " {:>width$}", figure(count), width = *width);
        }
        out.push('\n');
    }
    for (job, outcome) in jobs.iter().zip(outcomes) {
        if let Some(mark) = outcome.answer.as_ref().and_then(|a| a.mark.as_ref()) {
            let answer = outcome.answer.as_ref();
            let _ = writeln!(
                out,
                "{} ({}): {:?} {:?}; a refit that knows the colour: truth {:.1}, best {} {:.1}, named {}",
                job.name(),
                answer.map_or("", |a| a.plant),
                answer.map(|a| a.verdict),
                answer.map(|a| &a.groups),
                mark.truth,
                mark.best.0,
                mark.best.1,
                shown(mark.named)
            );
        }
        if let (Job::Pair { .. }, Some(answer)) = (job, &outcome.answer)
            && answer.found() < answer.hidden.len()
        {
            let _ = writeln!(
                out,
                "{} ({}): hidden {}, said {:?} {:?}; the pair lowers the criterion by {} against that; {:.1} s",
                job.name(),
                answer.plant,
                answer.hidden.join(" + "),
                answer.verdict,
                answer.groups,
                shown(answer.pair_falls),
                answer.seconds
            );
        }
        if let Some(why) = &outcome.refused {
            let _ = writeln!(out, "{}: {why}", job.name());
        }
    }
    out + &summary(jobs, outcomes, &cells)
}

/// Tables for a page: all effects together, each effect, what misses nothing, what is unknown.
pub fn markdown(jobs: &[Job], outcomes: &[Outcome]) -> String {
    let cells = cells(jobs, outcomes);
    let mut out = summary(jobs, outcomes, &cells);
    let columns: std::collections::BTreeSet<(usize, u64)> = cells
        .keys()
        .map(|(_, _, ratio, at)| (*at, *ratio))
        .collect();
    if columns.is_empty() {
        return out;
    }
    out += "\nNamed / in the named group \\[% of the records\\], and the median size of that group, for each effect:\n\n| effect |";
    for (at, hundredths) in &columns {
        let _ = write!(out, " {}, {} |", named_condition(*at), ratio(*hundredths));
    }
    out += "\n|---|";
    out += &"---|".repeat(columns.len());
    let rows = together(&cells, |(order, effect, _, _)| (*order, *effect));
    for (order, effect) in rows.into_keys() {
        let _ = write!(out, "\n| `{effect}` |");
        for (at, hundredths) in &columns {
            let entry = cells.get(&(order, effect, *hundredths, *at));
            let entry = entry
                .filter(|c| c.records > 0)
                .map_or("-".to_string(), |c| {
                    format!(
                        "{} / {} ({})",
                        c.percent(c.named),
                        c.percent(c.in_group),
                        shown(median(&c.sizes))
                    )
                });
            let _ = write!(out, " {entry} |");
        }
    }
    out + "\n"
}

fn summary(jobs: &[Job], outcomes: &[Outcome], cells: &BTreeMap<Cell, Count>) -> String {
    let mut out = String::new();
    if !cells.is_empty() {
        out += "\n| structural error / noise | loop, noise |";
        for Column { long, .. } in &COLUMNS {
            let _ = write!(out, " {long} |");
        }
        let _ = writeln!(out, "\n|{}", "---|".repeat(2 + COLUMNS.len()));
    }
    let rows = together(cells, |(_, _, hundredths, at)| (*hundredths, *at));
    for ((hundredths, at), count) in rows {
        let _ = write!(out, "| {} | {} |", ratio(hundredths), named_condition(at));
        for Column { unit, figure, .. } in &COLUMNS {
            let _ = write!(out, " {}{unit} |", figure(&count));
        }
        out.push('\n');
    }
    out += &pairs(jobs, outcomes);
    out += &Nulls::of(jobs, outcomes, |job| matches!(job, Job::Nothing { .. })).said("");
    out += &Nulls::of(jobs, outcomes, |job| matches!(job, Job::Integrated(_)))
        .said(" whose noise is white beside a random walk and whose time stamps jitter");
    let unknowns = unknowns(jobs, outcomes);
    if !unknowns.is_empty() {
        out +=
            "\n| outside the catalogue | records | unexplained | the others |\n|---|---|---|---|\n";
        let (mut all, mut right) = (0, 0);
        for (name, records, unexplained, others) in unknowns {
            (all, right) = (all + records, right + unexplained);
            let _ = writeln!(
                out,
                "| {name} | {records} | {unexplained} | {} |",
                counted(&others)
            );
        }
        let percent = 100.0 * right as f64 / all.max(1) as f64;
        let _ = writeln!(out, "| all | {all} | {right} ({percent:.1} %) | |");
    }
    out + &times(jobs, outcomes)
}

fn listed(records: &[String]) -> String {
    if records.is_empty() {
        String::new()
    } else {
        format!(" ({})", records.join("; "))
    }
}
