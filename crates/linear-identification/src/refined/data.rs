//! Records in the form of the crate `rivc`.

use ct_signals::Record;
use rivc::{Data, Structure};

use crate::Mended;

/// A record for the crate `rivc`; its reference only if it changes.
pub(crate) fn data(record: &Record) -> Data {
    let moves = record.references.first().is_some_and(|reference| {
        let (low, high) = reference.range();
        high > low
    });
    part(record, moves, false)
}

/// The parts of records that are long enough, and how many rows the others have.
pub(crate) fn parts(records: &[Mended], structure: &Structure) -> (Vec<(Record, Data)>, usize) {
    let (mut all, mut unused) = (Vec::new(), 0);
    for mended in records {
        let in_loop = data(&mended.whole).reference.is_some();
        let mut first = true;
        for record in &mended.parts {
            let data = part(record, in_loop, !first);
            // A record that is not cut is rejected with the reason.
            if mended.parts.len() == 1 || data.is_long_enough(structure) {
                all.push((record.clone(), data));
                first = false;
            } else {
                unused += record.len();
            }
        }
        if let (true, Some(record)) = (first, mended.parts.first()) {
            all.push((record.clone(), part(record, in_loop, false)));
        }
    }
    (all, unused)
}

pub(crate) fn part(record: &Record, in_loop: bool, continues: bool) -> Data {
    let hold = match record.hold() {
        ct_signals::Hold::Zero => ct_lti::Hold::Zero,
        ct_signals::Hold::First => ct_lti::Hold::First,
    };
    let inputs = record.inputs.iter();
    let reference = record.references.first().filter(|_| in_loop);
    Data {
        name: record.name.clone(),
        time: record.time.clone(),
        inputs: inputs
            .map(|input| rivc::Input {
                values: input.values.clone(),
                hold,
            })
            .collect(),
        output: record.outputs[0].values.clone(),
        reference: reference.map(|reference| reference.values.clone()),
        continues,
    }
}
