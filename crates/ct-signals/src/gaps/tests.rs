//! Gaps that are held through, cut, or none at all.

use super::*;

fn record(rows: impl Iterator<Item = usize>) -> Record {
    let rows: Vec<f64> = rows.map(|k| k as f64).collect();
    Record {
        name: "rig".into(),
        time: rows.iter().map(|k| 100.0 + 2.0 * k).collect(),
        inputs: vec![Channel::new("u", "V", rows.clone())],
        outputs: vec![Channel::new(
            "y",
            "cm",
            rows.iter().map(|k| 10.0 * k).collect(),
        )],
        ..Record::default()
    }
}

#[test]
fn a_record_without_gaps_stays_as_it_is() {
    let whole = record(0..50);
    assert_eq!(
        whole.without_gaps(0.0),
        (vec![whole.clone()], Gaps::default())
    );
    // Samples of an output may be missing.
    let mut whole = whole;
    whole.outputs[0].values[7] = f64::NAN;
    let (parts, gaps) = whole.without_gaps(0.0);
    assert_eq!((parts.len(), gaps), (1, Gaps::default()));
    assert_eq!(parts[0].outputs[0].missing(), 1);
}

#[test]
fn short_gaps_are_held_through_and_long_ones_cut() {
    // Two rows are missing in one place and ten in another.
    let gappy = record((0..20).chain(22..40).chain(50..80));
    let (parts, gaps) = gappy.without_gaps(4.0);
    assert_eq!(
        gaps,
        Gaps {
            rows: 12,
            places: 2,
            held: 1,
            cut: 1,
            unused: 0,
            longest_hold: 4.0
        }
    );
    let [first, second] = &parts[..] else {
        panic!("{}", parts.len())
    };
    assert_eq!((first.len(), second.len()), (40, 30));
    assert_eq!(first.time[20..22], [140.0, 142.0]);
    assert_eq!(first.inputs[0].values[19..23], [19.0, 19.0, 19.0, 22.0]);
    assert!(first.outputs[0].values[20].is_nan() && first.outputs[0].values[22] == 220.0);
    assert_eq!(second.time[0], 200.0);
    // Held without limit, and not at all.
    assert_eq!(gappy.without_gaps(f64::INFINITY).0[0].len(), 80);
    assert_eq!(gappy.without_gaps(0.0).0.len(), 3);
}

#[test]
fn a_missing_input_is_held_or_ends_a_part() {
    let mut record = record(0..60);
    record.inputs[0].values[..3].fill(f64::NAN);
    record.inputs[0].values[10..12].fill(f64::NAN);
    record.inputs[0].values[30..40].fill(f64::NAN);
    let (parts, gaps) = record.without_gaps(4.0);
    assert_eq!(
        (gaps.places, gaps.held, gaps.cut, gaps.unused),
        (2, 1, 1, 3)
    );
    assert_eq!(parts[0].inputs[0].values[6..10], [9.0, 9.0, 9.0, 12.0]);
    // The effect of row 29 is read at row 30.
    assert_eq!(
        (parts[0].time[0], parts[0].time.last()),
        (106.0, Some(&160.0))
    );
    assert_eq!((parts[1].time[0], parts[1].len()), (180.0, 20));
    // An input that is linear between samples is not known after its last sample.
    record.inputs[0].hold = Hold::First;
    let (parts, _) = record.without_gaps(4.0);
    assert_eq!(parts[0].time.last(), Some(&158.0));
    assert_eq!(parts[0].inputs[0].values[6..10], [9.0, 10.0, 11.0, 12.0]);
}

#[test]
fn rows_that_are_missing_at_random_leave_the_interval() {
    let some = record((0..300).filter(|k| (k * 7919) % 10 >= 3));
    assert!(some.missing_rows() > 60);
    let (parts, _) = some.without_gaps(f64::INFINITY);
    assert_eq!(parts.len(), 1);
    assert!(
        parts[0]
            .time
            .windows(2)
            .all(|pair| (pair[1] - pair[0] - 2.0).abs() < 1e-9)
    );
    // Uneven steps are not full of gaps.
    let mut uneven = record(0..100);
    for (k, t) in uneven.time.iter_mut().enumerate() {
        *t += 0.9 * (k as f64 * 1.7).sin();
    }
    assert!(!uneven.has_gaps());
}

#[test]
fn a_logger_with_several_rates_loses_nothing() {
    // As a battery tester writes: every 0.1 s during fast changes, then every 1 s and every 10 s.
    let steps = [
        (300, 0.1),
        (11, 10.0),
        (300, 0.1),
        (8, 1.0),
        (60, 0.1),
        (7, 10.0),
    ];
    let mut time = vec![0.0];
    for (count, step) in steps {
        for k in 0..count {
            let last = time[time.len() - 1];
            time.push(last + step + 0.004 * (k as f64 * 1.7).sin());
        }
    }
    let with_time = |time: Vec<f64>| {
        let mut record = record(0..time.len());
        record.time = time;
        record
    };
    assert!(!with_time(time.clone()).has_gaps());
    // After it one minute is missing.
    let last = time[time.len() - 1];
    time.extend((0..20).map(|k| last + 60.0 + 0.1 * k as f64));
    let gappy = with_time(time);
    assert_eq!(gappy.before_missing_row(), Some(last));
    assert_eq!(gappy.without_gaps(1.0).0.len(), 2);
    // Rows are lost one by one: only some of the steps of two intervals are adjacent.
    let lost = record((0..1000).filter(|k| (k * k * 31 + k * 17) % 101 > 10));
    assert!(lost.missing_rows() > 110, "{}", lost.missing_rows());
}

#[test]
fn nothing_is_left_of_a_record_without_inputs() {
    let mut record = record(0..40);
    record.inputs[0].values.fill(f64::NAN);
    let (parts, gaps) = record.without_gaps(f64::INFINITY);
    assert!(parts.is_empty());
    assert_eq!(gaps.unused, 40);
}
