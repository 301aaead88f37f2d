//! Records with missing rows or samples of an input: the longest time for which an input may be held depends on the plant, so a first fit
//! determines it.
//!
//! Through a gap that is short beside the fastest time constant of the plant the input is held; at a longer one the record is cut, and the
//! simulation starts again after it with states of its own ([`ct_signals::Gaps`]). The parts keep their time stamps and so their clock: a
//! drift runs through them. What is reported is joined again to the records that were given.

use ct_signals::{Gaps, Record};

use super::{believed::base, control_loop::fastest_time_constant};
use crate::{Diagnosis, Error, LONGEST_HOLD, MendedGaps, Options, Problem, Shown};

/// For the first fit, the input is held for this number of sampling intervals.
const FIRST_HOLD: f64 = 20.0;
/// Share of the time limit for the first fit.
const FITTED: f64 = 0.1;

/// A problem whose records have no gaps.
pub(crate) struct Mended {
    pub problem: Problem,
    pub gaps: MendedGaps,
    /// Parts of each record, fitted ones first.
    parts: Vec<usize>,
    /// Number of fitted records.
    fitted: usize,
}

/// All records, cut into their parts.
fn cut(records: &[Record], longest: f64) -> (Vec<Record>, Vec<usize>, Gaps) {
    let (mut all, mut counts, mut gaps) = (Vec::new(), Vec::new(), Gaps::default());
    for record in records {
        let (parts, own) = record.without_gaps(longest);
        gaps = gaps.and(own);
        counts.push(parts.len());
        all.extend(parts);
    }
    (all, counts, gaps)
}

/// Checks that every record keeps a part if inputs are held for at most `limit` \[s\].
fn check_parts<'a>(
    mut records: impl Iterator<Item = &'a Record>,
    parts: &[usize],
    limit: f64,
) -> Result<(), Error> {
    let mut parts = parts.iter();
    match records.find(|_| parts.next() == Some(&0)) {
        Some(record) => Err(Error::NoStretch {
            record: record.name.clone(),
            limit,
        }),
        None => Ok(()),
    }
}

impl Mended {
    /// `None` if no record has a gap.
    pub fn of(problem: &Problem, options: &Options) -> Result<Option<Self>, Error> {
        let mut records = problem.records.iter().chain(&problem.test);
        let in_loop = problem.controller.is_some();
        let lacks_reference = |record: &Record| record.references.iter().any(|r| r.missing() > 0);
        if !records.any(|record| record.has_gaps() || in_loop && lacks_reference(record)) {
            return Ok(None);
        }
        let interval = problem.records.iter().map(Record::sample_interval);
        let first = FIRST_HOLD * interval.fold(0.0, f64::max);
        let (records, parts, _) = cut(&problem.records, first);
        check_parts(problem.records.iter(), &parts, first)?;
        let trial = Problem {
            records,
            test: Vec::new(),
            ..problem.clone()
        };
        let (node, _) = base(&trial, options, FITTED)?;
        let time_constant = fastest_time_constant(&node)?;
        let limit = LONGEST_HOLD * time_constant;
        let (fitted, mut parts, gaps) = cut(&problem.records, limit);
        let (test, of_test, of_tests) = cut(&problem.test, limit);
        parts.extend(of_test);
        check_parts(problem.records.iter().chain(&problem.test), &parts, limit)?;
        Ok(Some(Self {
            problem: Problem {
                records: fitted,
                test,
                ..problem.clone()
            },
            gaps: MendedGaps {
                gaps: gaps.and(of_tests),
                time_constant,
                limit,
            },
            parts,
            fitted: problem.records.len(),
        }))
    }

    /// Joins the results of the parts of a record, and reports the handling of gaps.
    pub fn report(&self, diagnosis: &mut Diagnosis) {
        diagnosis.records = self.joined(&diagnosis.records, |whole: &mut Shown, part| {
            whole.time.extend(part.time);
            for (whole, part) in whole.inputs.iter_mut().zip(part.inputs) {
                whole.values.extend(part.values);
            }
            for (whole, part) in whole.outputs.iter_mut().zip(part.outputs) {
                whole.extend(part);
            }
        });
        let outputs = diagnosis.outputs.len();
        for step in &mut diagnosis.steps {
            let parts: Vec<&[Vec<f64>]> = step.simulated.chunks(outputs).collect();
            let parts: Vec<Vec<Vec<f64>>> = parts.into_iter().map(<[_]>::to_vec).collect();
            let whole = self.joined(&parts, |whole: &mut Vec<Vec<f64>>, part| {
                for (whole, part) in whole.iter_mut().zip(part) {
                    whole.extend(part);
                }
            });
            step.simulated = whole.concat();
            for output in &mut step.outputs {
                for bin in &mut output.failures.by_time {
                    bin.record = bin.record.map(|part| self.record_of(part));
                }
            }
            for parameter in &mut step.parameters {
                parameter.name = self.named(&parameter.name);
            }
        }
        diagnosis.gaps = Some(self.gaps);
    }

    fn joined<T: Clone>(&self, parts: &[T], join: impl Fn(&mut T, T)) -> Vec<T> {
        let mut parts = parts.iter().cloned();
        let of_one = |count: &usize| {
            let mut own = parts.by_ref().take(*count);
            let mut whole = own.next()?;
            own.for_each(|part| join(&mut whole, part));
            Some(whole)
        };
        self.parts.iter().filter_map(of_one).collect()
    }

    /// The name of an initial state, `level(0), record 3`, with the record and, for a cut record, the part.
    fn named(&self, name: &str) -> String {
        let Some((state, number)) = name.rsplit_once(", record ") else {
            return name.to_string();
        };
        let Some(part) = number.parse::<usize>().ok().and_then(|n| n.checked_sub(1)) else {
            return name.to_string();
        };
        let record = self.record_of(part);
        let before: usize = self.parts[..record].iter().sum();
        let mut named = state.to_string();
        if self.fitted > 1 {
            named += &format!(", record {}", record + 1);
        }
        if self.parts[record] > 1 {
            named += &format!(", part {}", part - before + 1);
        }
        named
    }

    /// The record that a part is of.
    fn record_of(&self, part: usize) -> usize {
        let ends = self.parts.iter().scan(0, |end, count| {
            *end += count;
            Some(*end)
        });
        ends.take_while(|end| *end <= part).count()
    }
}
