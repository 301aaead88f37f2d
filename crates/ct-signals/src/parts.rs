//! Parts of records that were cut at gaps: the record of a part, and the parts joined again for a result.

use crate::gaps::SHORTEST;
use crate::{Error, Gaps, LongestHold, Record};

/// The parts of records, and the handling of all gaps. `longest`: for a record the longest time for which its inputs are held
/// ([`Record::without_gaps`]).
///
/// # Errors
/// [`Error::NoStretch`] if no part of a record is left.
pub fn without_gaps(
    records: &[Record],
    longest: impl Fn(&Record) -> LongestHold,
) -> Result<(Vec<Record>, Gaps), Error> {
    let (mut all, mut gaps) = (Vec::new(), Gaps::default());
    for record in records {
        let limit = longest(record);
        let (parts, own) = record.without_gaps(limit);
        if parts.is_empty() {
            return Err(Error::NoStretch {
                record: record.name.clone(),
                readings: SHORTEST,
                limit: limit.unchanged,
            });
        }
        gaps = gaps.and(own);
        all.extend(parts);
    }
    Ok((all, gaps))
}

/// The position of the record that each part belongs to: parts of one record follow each other, with consecutive numbers
/// ([`Record::part`]).
#[must_use]
pub fn records_of_parts(parts: &[Record]) -> Vec<usize> {
    let mut record = 0;
    let of_part = parts.iter().enumerate().map(|(i, part)| {
        let before = i.checked_sub(1).map(|before| parts[before].part);
        let follows = before.is_some_and(|number| number > 0 && part.part == number + 1);
        record += usize::from(i > 0 && !follows);
        record
    });
    of_part.collect()
}

/// What follows the name of an entry that each part has, such as an initial state: `, record 2, part 1`. Records are numbered if there are
/// several, parts if the record was cut; empty for a single record.
#[must_use]
pub fn suffixes(parts: &[Record]) -> Vec<String> {
    let records = records_of_parts(parts);
    let several = records.last().is_some_and(|last| *last > 0);
    let suffix = |(part, record): (&Record, &usize)| {
        let mut suffix = String::new();
        if several {
            suffix += &format!(", record {}", record + 1);
        }
        if part.part > 0 {
            suffix += &format!(", part {}", part.part);
        }
        suffix
    };
    parts.iter().zip(&records).map(suffix).collect()
}

/// The records that the parts belong to: times and samples of the parts of each one after the other.
#[must_use]
pub fn joined(parts: &[Record]) -> Vec<Record> {
    let mut whole: Vec<Record> = Vec::new();
    for (part, record) in parts.iter().zip(records_of_parts(parts)) {
        match whole.get_mut(record) {
            Some(record) => {
                record.time.extend(&part.time);
                let of_record = record.inputs.iter_mut().chain(&mut record.outputs);
                for (channel, more) in of_record.chain(&mut record.references).zip(part.channels())
                {
                    channel.values.extend(&more.values);
                }
            }
            None => whole.push(Record {
                part: 0,
                ..part.clone()
            }),
        }
    }
    whole
}

/// Series of the parts, `of_each` of every part, joined as [`joined`] joins the parts.
#[must_use]
pub fn joined_series(parts: &[Record], of_each: usize, series: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut whole: Vec<Vec<f64>> = Vec::new();
    let records = records_of_parts(parts);
    for (record, own) in records.into_iter().zip(series.chunks(of_each.max(1))) {
        whole.resize((record + 1) * own.len(), Vec::new());
        for (joined, more) in whole[record * own.len()..].iter_mut().zip(own) {
            joined.extend(more);
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;

    fn record(name: &str, rows: impl Iterator<Item = usize>) -> Record {
        let time: Vec<f64> = rows.map(|k| k as f64).collect();
        Record {
            name: name.into(),
            inputs: vec![Channel::new("u", "", time.clone())],
            outputs: vec![Channel::new("y", "", time.clone())],
            time,
            ..Record::default()
        }
    }

    #[test]
    fn parts_are_numbered_named_and_joined() {
        let cut = record("a", (0..20).chain(40..60).chain(90..130));
        let (mut parts, _) = cut.without_gaps(5.0);
        assert_eq!(parts.iter().map(|p| p.part).collect::<Vec<_>>(), [1, 2, 3]);
        assert_eq!(suffixes(&parts), [", part 1", ", part 2", ", part 3"]);
        parts.extend(record("b", 0..30).without_gaps(5.0).0);
        assert_eq!(records_of_parts(&parts), [0, 0, 0, 1]);
        assert_eq!(suffixes(&parts)[2..], [", record 1, part 3", ", record 2"]);
        let whole = joined(&parts);
        // The row after each part, which depends on the last known input, is a part of it; here all rows are known.
        assert_eq!(whole, [cut, record("b", 0..30)]);
        let states: Vec<Vec<f64>> = parts
            .iter()
            .flat_map(|part| [part.time.clone(), part.outputs[0].values.clone()])
            .collect();
        let series = joined_series(&parts, 2, &states);
        assert_eq!(series.len(), 4);
        assert_eq!(series[0], whole[0].time);
        assert_eq!(series[3], whole[1].outputs[0].values);
    }

    #[test]
    fn parts_that_do_not_follow_each_other_are_of_several_records() {
        let parts = record("a", (0..20).chain(40..60)).without_gaps(5.0).0;
        let of = |order: &[usize]| -> Vec<usize> {
            let chosen: Vec<Record> = order.iter().map(|&i| parts[i].clone()).collect();
            records_of_parts(&chosen)
        };
        assert_eq!(of(&[1]), [0]);
        assert_eq!(of(&[1, 1]), [0, 1]);
        assert_eq!(of(&[0, 0, 1, 1]), [0, 1, 1, 2]);
    }

    #[test]
    fn a_single_record_has_no_number() {
        assert_eq!(suffixes(&[record("a", 0..30)]), [""]);
        let two = [record("a", 0..30), record("a", 0..30)];
        assert_eq!(suffixes(&two), [", record 1", ", record 2"]);
    }
}
