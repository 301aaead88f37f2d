//! The clock that drifts, steps and periods follow, where there are several records.
//!
//! Records whose time stamps continue (each begins after the one before it has ended) are parts of one experiment: the clock
//! runs through them, from the beginning of the first. Records that each begin at a zero of their own have nothing in common, and
//! the clock starts again in each of them. A held-out record that begins after the fitted ones have ended continues their clock.

use ct_signals::Record;

/// Common clock of the records.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Clock {
    /// Time stamp at which it begins \[s\].
    origin: f64,
    /// Time stamp at which the fitted records end \[s\]; infinite where they share no clock.
    end: f64,
    /// Start of each record \[s\].
    pub begins: Vec<f64>,
}

/// Start of each record on the common clock \[s\], the first at zero; `None` without a common clock, and for a single record.
#[must_use]
pub fn common_clock(records: &[Record]) -> Option<Vec<f64>> {
    let continues = |pair: &[Record]| match (pair[0].time.last(), pair[1].time.first()) {
        (Some(end), Some(begin)) => begin > end,
        _ => false,
    };
    let origin = *records.first()?.time.first()?;
    let shared = records.len() > 1 && records.windows(2).all(continues);
    shared.then(|| {
        records
            .iter()
            .map(|record| begin(record) - origin)
            .collect()
    })
}

/// Start of each record on its own clock \[s\]: zero, except for parts of a cut record, which keep its name and its clock.
fn of_each(records: &[Record]) -> Vec<f64> {
    let mut begins: Vec<f64> = Vec::with_capacity(records.len());
    for (k, record) in records.iter().enumerate() {
        let continued = k.checked_sub(1).and_then(|before| {
            let part = &records[before];
            let goes_on = part.name == record.name && part.time.last() < record.time.first();
            goes_on.then(|| begins[before] + begin(record) - begin(part))
        });
        begins.push(continued.unwrap_or(0.0));
    }
    begins
}

/// Total time span of the records \[s\]: from the first start to the last end on a common clock, or the longest record.
pub(crate) fn span(records: &[Record]) -> f64 {
    let begins = common_clock(records).unwrap_or_else(|| of_each(records));
    let ends = begins.iter().zip(records);
    ends.map(|(begin, record)| begin + record.duration())
        .fold(0.0, f64::max)
}

fn begin(record: &Record) -> f64 {
    record.time.first().copied().unwrap_or(0.0)
}

impl Clock {
    /// The clock of fitted records.
    pub fn of(records: &[Record]) -> Self {
        let shared = common_clock(records);
        let last = records.last().and_then(|record| record.time.last());
        let end = match last {
            Some(end) if shared.is_some() || records.len() == 1 => *end,
            _ => f64::INFINITY,
        };
        Self {
            origin: records.first().map_or(0.0, begin),
            end,
            begins: shared.unwrap_or_else(|| of_each(records)),
        }
    }

    /// The same clock for other records: records that begin after its end continue it.
    pub fn with_records(&self, records: &[Record]) -> Self {
        let own = Self::of(records).begins;
        let begins = records.iter().zip(own).map(|(record, own)| {
            let begin = begin(record);
            if begin > self.end {
                begin - self.origin
            } else {
                own
            }
        });
        Self {
            begins: begins.collect(),
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use ct_signals::Channel;

    use super::*;

    fn record(from: f64, to: f64) -> Record {
        let signal = || Channel::new("", "", vec![0.0; 2]);
        Record {
            name: format!("{from} {to}"),
            time: vec![from, to],
            inputs: vec![signal()],
            outputs: vec![signal()],
            ..Record::default()
        }
    }

    #[test]
    fn records_whose_stamps_continue_share_a_clock() {
        let parts = [
            record(100.0, 200.0),
            record(210.0, 300.0),
            record(500.0, 600.0),
        ];
        assert_eq!(common_clock(&parts), Some(vec![0.0, 110.0, 400.0]));
        assert_eq!(span(&parts), 500.0);
        let clock = Clock::of(&parts);
        // Held-out records: a later one, one in between, one with its own zero.
        let test = [
            record(700.0, 800.0),
            record(400.0, 450.0),
            record(0.0, 90.0),
        ];
        assert_eq!(clock.with_records(&test).begins, [600.0, 0.0, 0.0]);
        assert_eq!(clock.with_records(&parts), clock);
        // A single record has a separate clock, which a later record continues.
        let alone = Clock::of(&parts[..1]);
        assert_eq!(alone.begins, [0.0]);
        assert_eq!(alone.with_records(&parts[1..2]).begins, [110.0]);
    }

    #[test]
    fn records_from_their_own_zero_share_none() {
        for records in [
            vec![record(0.0, 100.0), record(0.0, 300.0)],
            // Out of order, overlapping, and with the same instant as end and start.
            vec![record(200.0, 300.0), record(0.0, 100.0)],
            vec![record(0.0, 100.0), record(50.0, 350.0)],
            vec![record(0.0, 100.0), record(100.0, 300.0)],
            vec![record(0.0, 100.0), record(200.0, 300.0), record(0.0, 100.0)],
        ] {
            assert_eq!(common_clock(&records), None);
            let clock = Clock::of(&records);
            assert!(clock.begins.iter().all(|begin| *begin == 0.0));
            let later = clock.with_records(&[record(900.0, 950.0)]);
            assert_eq!(later.begins, [0.0]);
            let longest = records.iter().map(Record::duration).fold(0.0, f64::max);
            assert_eq!(span(&records), longest);
        }
        assert_eq!(common_clock(&[]), None);
    }

    #[test]
    fn parts_of_one_record_share_its_clock_beside_others() {
        let part = |from: f64, to: f64| Record {
            name: "a".into(),
            ..record(from, to)
        };
        let records = [part(10.0, 100.0), part(150.0, 300.0), record(0.0, 90.0)];
        assert_eq!(common_clock(&records), None);
        assert_eq!(Clock::of(&records).begins, [0.0, 140.0, 0.0]);
        assert_eq!(span(&records), 290.0);
    }
}
