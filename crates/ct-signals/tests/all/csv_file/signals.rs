//! Times and signals that no record can hold: repeated and backward times, gaps, too few rows, constant and saturated signals.

use ct_signals::{Columns, Error, ReadError, require_samples};

use super::{HEADER, read, read_bytes, rows, says, text, with_line};

#[test]
fn repeated_and_backward_time() {
    let error = read(&with_line(6, "6,3,10")).unwrap_err();
    assert!(matches!(
        error,
        Error::Read(ReadError::RepeatedTime { row: 6, .. })
    ));
    says(
        &error,
        &["tank.csv", "row 6", "\"t [s]\"", "repeated", "remove"],
    );

    let error = read(&with_line(6, "5,3,10")).unwrap_err();
    assert!(matches!(
        error,
        Error::Read(ReadError::BackwardTime { row: 6, .. })
    ));
    says(&error, &["from 6 to 5", "sort"]);
}

#[test]
fn one_missing_sample_is_a_gap() {
    let mut rows = rows();
    rows.remove(10);
    let error = read(&text(HEADER, &rows)).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Gap {
                row: 12,
                missing: 1,
                ..
            }
        ),
        "{error}"
    );
    says(
        &error,
        &[
            "row 12",
            "1 sample is missing",
            "from 18 to 22",
            "split the file there",
        ],
    );

    rows.drain(10..13);
    let error = read(&text(HEADER, &rows)).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Gap {
                row: 12,
                missing: 4,
                ..
            }
        ),
        "{error}"
    );
    says(&error, &["4 samples are missing", "leave out `strict`"]);
}

/// Steps of 1 to 3 s are uneven, not full of gaps; 9 s among them are a gap.
#[test]
fn uneven_steps_are_no_gaps() {
    let mut rows = rows();
    let mut time = 0.0;
    for (k, row) in rows.iter_mut().enumerate() {
        row[0] = time;
        time += [1.0, 1.0, 2.0, 3.0][k % 4];
    }
    assert_eq!(read(&text(HEADER, &rows)).unwrap().len(), 40);
    for row in &mut rows[20..] {
        row[0] += 6.0;
    }
    let error = read(&text(HEADER, &rows)).unwrap_err();
    assert!(matches!(error, Error::Gap { row: 22, .. }), "{error}");
}

#[test]
fn a_missing_sample_is_found_in_jitter() {
    let mut rows = rows();
    for (k, row) in rows.iter_mut().enumerate() {
        row[0] += if k % 3 == 0 { 0.2 } else { -0.2 };
    }
    rows.remove(20);
    let error = read(&text(HEADER, &rows)).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Gap {
                row: 22,
                missing: 1,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn constant_signals() {
    let mut still = rows();
    still.iter_mut().for_each(|row| row[1] = 4.5);
    // Whether an input may be constant depends on the purpose of the record.
    let record = read(&text(HEADER, &still)).unwrap();
    let error = record.require_moving_input().unwrap_err();
    assert!(matches!(error, Error::ConstantInput { rows: 40, .. }));
    says(&error, &["tank.csv", "\"u [V]\"", "4.5", "input"]);

    let mut still = rows();
    still.iter_mut().for_each(|row| row[2] = 0.0);
    let error = read(&text(HEADER, &still)).unwrap_err();
    assert!(matches!(error, Error::ConstantOutput { .. }));
}

#[test]
fn too_few_rows() {
    let error = read(&text(HEADER, &rows()[..19])).unwrap_err();
    assert!(matches!(
        error,
        Error::TooFewRows {
            rows: 19,
            needed: 20,
            ..
        }
    ));
    says(&error, &["tank.csv", "19 rows", "20 are needed"]);
    let record = read(&text(HEADER, &rows()[..20])).unwrap();
    require_samples(std::slice::from_ref(&record), 4).unwrap();
    let error = require_samples(&[record], 5).unwrap_err();
    says(
        &error,
        &["tank.csv", "20 rows", "25 are needed", "5 parameters"],
    );
}

#[test]
fn saturated_record() {
    // 14 of 40 at the limit is above a third, 13 is not.
    for (count, refused) in [(14, true), (13, false)] {
        for limit in [12.0, 0.0] {
            let mut rows = rows();
            rows[5..5 + count].iter_mut().for_each(|row| row[2] = limit);
            let result = read(&text(HEADER, &rows));
            assert_eq!(result.is_err(), refused, "{count} at {limit}");
            if let Err(error) = result {
                assert!(matches!(error, Error::Saturated { .. }), "{error}");
                says(
                    &error,
                    &[
                        "tank.csv",
                        "\"y [cm]\"",
                        &format!("14 at {limit} cm"),
                        "range",
                    ],
                );
            }
        }
    }
}

#[test]
fn a_coarsely_quantised_output_is_not_saturated() {
    let mut rows = rows();
    // Three levels, the highest of them with more than a third of the samples.
    rows.iter_mut()
        .for_each(|row| row[2] = (row[2] + 0.3).round());
    let highest = rows.iter().filter(|row| row[2] == 11.0).count();
    assert!(
        3 * highest > rows.len(),
        "{highest} samples at the highest level"
    );
    read(&text(HEADER, &rows)).unwrap();
}

#[test]
fn one_of_several_inputs_may_be_zero() {
    let mut text = String::from("t [s],u [V],vent [%],y [cm]\n");
    for [t, u, y] in rows() {
        text += &format!("{t},{u},0,{y}\n");
    }
    let columns = |inputs: &[&str]| Columns {
        inputs: inputs.iter().map(ToString::to_string).collect(),
        outputs: vec!["y".into()],
        ..Columns::default()
    };
    let record = read_bytes(text.as_bytes(), &columns(&["u", "vent"])).unwrap();
    assert!(record.inputs[1].values.iter().all(|v| *v == 0.0));
    // Alone it moves nothing.
    assert!(read_bytes(text.as_bytes(), &columns(&["vent"])).is_err());
}
