//! The record of the emulated rig as CSV, for `ctid diagnose` and `ctid identify`.

use ct_signals::{Channel, Record};

/// A record as text that [`ct_signals::read_csv`] reads, values to 1e-4.
pub(super) fn text(record: &Record) -> String {
    let column = |name: &str, unit: &str| format!("{name} [{unit}]");
    let signals: Vec<&Channel> = record.channels().collect();
    let mut header = vec![column("t", "s")];
    header.extend(
        signals
            .iter()
            .map(|signal| column(&signal.name, &signal.unit)),
    );
    let mut text = header.join(",") + "\n";
    for (k, time) in record.time.iter().enumerate() {
        let values = signals.iter().filter_map(|signal| signal.values.get(k));
        let mut row = vec![time.to_string()];
        row.extend(values.map(|value| format!("{value:.4}")));
        text += &(row.join(",") + "\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use paper_tables::baysse::Rig;

    use super::*;

    #[test]
    fn what_is_read_is_what_was_recorded() {
        let record = Rig::default().record(1, 0).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rig.csv");
        std::fs::write(&path, text(&record)).unwrap();
        let columns = ct_signals::Columns::default();
        let read = ct_signals::read_csv(&path, &columns, &record.hold().into())
            .unwrap()
            .record;
        assert_eq!(
            (&read.time, &read.outputs[0].unit),
            (&record.time, &record.outputs[0].unit)
        );
        let largest_difference = |a: &Channel, b: &Channel| -> f64 {
            let off = a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs());
            off.fold(0.0, f64::max)
        };
        assert!(largest_difference(&read.outputs[0], &record.outputs[0]) < 6e-5);
        assert!(largest_difference(&read.inputs[0], &record.inputs[0]) < 6e-5);
        assert!(largest_difference(&read.references[0], &record.references[0]) < 6e-5);
    }
}
