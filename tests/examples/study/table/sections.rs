//! Sections of the table beside the shares: records without an effect, pairs, times, what nothing explained.

use ctid_tests::Drive;
use missing_effect::Verdict;
use std::collections::BTreeMap;
use std::fmt::Write;

use super::{BELOW, CONDITIONS, MARGIN, listed, median, named_condition, ratio, shown};
use crate::outcome::{Answer, Outcome};
use crate::record::{Job, unknown_name};

/// Results of records without a missing effect.
#[derive(Default)]
pub(super) struct Nulls {
    records: usize,
    /// Records with a named effect of the catalogue.
    claims: Vec<String>,
    /// Records with the verdict unexplained.
    doubted: Vec<String>,
    open: usize,
    /// Open-loop records with detected feedback.
    feedback: Vec<String>,
}

impl Nulls {
    pub(super) fn of(jobs: &[Job], outcomes: &[Outcome], kind: fn(&Job) -> bool) -> Self {
        let mut all = Self::default();
        for (job, outcome) in jobs.iter().zip(outcomes).filter(|(job, _)| kind(job)) {
            let Some(answer) = &outcome.answer else {
                continue;
            };
            all.records += 1;
            if answer.named() {
                let effects = answer.effects.join(", ");
                all.claims
                    .push(format!("{}: {:?}, {effects}", job.name(), answer.verdict));
            } else if answer.verdict != Verdict::Adequate {
                all.doubted.push(job.name());
            }
            if answer.drive == Drive::Open {
                all.open += 1;
                if answer.feedback {
                    all.feedback.push(job.name());
                }
            }
        }
        all
    }

    pub(super) fn said(&self, what: &str) -> String {
        if self.records == 0 {
            return String::new();
        }
        let verb = if self.doubted.len() == 1 { "is" } else { "are" };
        format!(
            "\nNothing is missing in {} records{what}: an effect is named in {}{}, and {} more {verb} called unexplained{}. Feedback is claimed in {} of the {} in open loop{}.\n",
            self.records,
            self.claims.len(),
            listed(&self.claims),
            self.doubted.len(),
            listed(&self.doubted),
            self.feedback.len(),
            self.open,
            listed(&self.feedback)
        )
    }
}

/// The counts of records with a hidden pair.
#[derive(Debug, Default)]
struct Pairs {
    records: usize,
    named: usize,
    both: usize,
    one: usize,
    /// More is named than the pair.
    more: usize,
    undecided: usize,
    partial: usize,
    unexplained: usize,
    adequate: usize,
    /// Among those with neither effect: the criterion is lower with the pair by more than the margin.
    search: usize,
    /// The criterion is not lower.
    record: usize,
    seconds: Vec<f64>,
}

impl Pairs {
    fn add(&mut self, answer: &Answer) {
        let said = |verdict| usize::from(answer.verdict == verdict);
        self.records += 1;
        self.named += usize::from(answer.named());
        self.both += usize::from(answer.found() == 2);
        self.one += usize::from(answer.found() == 1);
        self.more += usize::from(answer.named() && answer.groups.len() > 2);
        self.undecided += said(Verdict::Undecided);
        self.partial += said(Verdict::Partial);
        self.unexplained += said(Verdict::Unexplained);
        self.adequate += said(Verdict::Adequate);
        if let Some(falls) = answer.pair_falls {
            self.search += usize::from(falls > MARGIN);
            self.record += usize::from(falls <= MARGIN);
        }
        self.seconds.push(answer.seconds);
    }
}

/// The table of the pairs, for a page.
pub(super) fn pairs(jobs: &[Job], outcomes: &[Outcome]) -> String {
    let mut rows: BTreeMap<(u64, usize), Pairs> = BTreeMap::new();
    for (job, outcome) in jobs.iter().zip(outcomes) {
        let (
            Job::Pair {
                ratio,
                drive,
                coloured,
                ..
            },
            Some(answer),
        ) = (job, &outcome.answer)
        else {
            continue;
        };
        let at = CONDITIONS
            .iter()
            .position(|known| *known == (*drive, *coloured));
        let key = ((100.0 * ratio).round() as u64, at.unwrap_or(0));
        rows.entry(key).or_default().add(answer);
    }
    if rows.is_empty() {
        return String::new();
    }
    let mut out = "\n| pair: structural error of each / noise | loop, noise | records | named | both in named groups | one of them | more than two named | undecided | partial | unexplained | adequate | missed by the search | not in the record | seconds, median |\n".to_string();
    let _ = writeln!(out, "|{}", "---|".repeat(14));
    for ((hundredths, at), row) in rows {
        let part = |count: usize| 100.0 * count as f64 / row.records as f64;
        let _ = write!(
            out,
            "| {} | {} | {} |",
            ratio(hundredths),
            named_condition(at),
            row.records
        );
        for count in [
            row.named,
            row.both,
            row.one,
            row.more,
            row.undecided,
            row.partial,
            row.unexplained,
            row.adequate,
        ] {
            let _ = write!(out, " {:.0} % |", part(count));
        }
        let _ = writeln!(
            out,
            " {} | {} | {} |",
            row.search,
            row.record,
            shown(median(&row.seconds))
        );
    }
    out
}

/// Distribution of the computing time over the records, and the longest one.
pub(super) fn times(jobs: &[Job], outcomes: &[Outcome]) -> String {
    let taken: Vec<(f64, String)> = jobs
        .iter()
        .zip(outcomes)
        .filter_map(|(job, outcome)| Some((outcome.answer.as_ref()?.seconds, job.name())))
        .collect();
    let Some((slowest, name)) = taken.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return String::new();
    };
    let mut out = "\n| seconds of a record on one core | records |\n|---|---|\n".to_string();
    let mut from = 0.0;
    for to in BELOW.into_iter().chain([f64::INFINITY]) {
        let within = |(seconds, _): &&(f64, String)| (from..to).contains(seconds);
        let count = taken.iter().filter(within).count();
        let range = if to.is_finite() {
            format!("below {to}")
        } else {
            format!("{from} and above")
        };
        let _ = writeln!(out, "| {range} | {count} |");
        from = to;
    }
    let _ = writeln!(out, "\nThe slowest, {name}, took {slowest:.1} s.");
    out
}

/// For each kind of unknown disturbance: its name, records, those declared unexplained, and the verdicts of the others.
pub(super) fn unknowns(
    jobs: &[Job],
    outcomes: &[Outcome],
) -> Vec<(String, usize, usize, Vec<String>)> {
    let mut kinds: BTreeMap<usize, (usize, usize, Vec<String>)> = BTreeMap::new();
    for (job, outcome) in jobs.iter().zip(outcomes) {
        let (Job::Unknown { kind, .. }, Some(answer)) = (job, &outcome.answer) else {
            continue;
        };
        let entry = kinds.entry(*kind).or_default();
        entry.0 += 1;
        match answer.verdict {
            Verdict::Unexplained => entry.1 += 1,
            Verdict::Adequate => entry.2.push("adequate".to_string()),
            _ => entry.2.push(answer.effects.join(" + ")),
        }
    }
    kinds
        .into_iter()
        .map(|(kind, (records, right, others))| (unknown_name(kind), records, right, others))
        .collect()
}

/// Counts of the other verdicts.
pub(super) fn counted(others: &[String]) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for other in others {
        *counts.entry(other).or_default() += 1;
    }
    let counts: Vec<String> = counts
        .iter()
        .map(|(what, count)| format!("{what} {count}"))
        .collect();
    counts.join(", ")
}
