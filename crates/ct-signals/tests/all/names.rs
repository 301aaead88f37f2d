//! What messages call the settings and the columns of a caller.

use ct_signals::{
    BadLine, CellMend, ColumnFault, Columns, Error, Names, PartLimit, ReadError, ReadOptions,
    Shortage, parse_csv,
};

/// Names that no message has by itself.
const OWN: Names = Names {
    strict: "<strict>",
    from: "<from>",
    to: "<to>",
    part: "<part>",
    resample: "<resample>",
    columns: "<columns>",
    in_columns: "<in columns>",
    column: |role| format!("<column {role}>"),
    namer: "<namer>",
};

/// Every message that names something of the caller's, and the names in it.
fn messages() -> Vec<(Error, Vec<&'static str>)> {
    let (file, row, column) = (|| "a.csv".to_string(), 7, || "y".to_string());
    let too_few = |why| Error::TooFewRows {
        record: file(),
        rows: 3,
        needed: 20,
        why,
    };
    let cell = |mend| {
        ReadError::TextInCell {
            file: file(),
            row,
            column: column(),
            text: "Bad".into(),
            mend,
        }
        .into()
    };
    let fault = |fault| {
        ReadError::Column {
            file: file(),
            row,
            fault: Box::new(fault),
        }
        .into()
    };
    let constant = (1.0, 40);
    vec![
        (
            Error::Bound {
                limit: PartLimit::From,
                text: "x".into(),
                mend: "give a number".into(),
            },
            vec!["<from>"],
        ),
        (
            Error::Bound {
                limit: PartLimit::To,
                text: "x".into(),
                mend: "give a number".into(),
            },
            vec!["<to>"],
        ),
        (
            Error::EmptyPart { text: "1".into() },
            vec!["<to>", "<from>"],
        ),
        (
            Error::Resampled {
                record: file(),
                interval: 1e-9,
                rows: 1e12,
                most: 1e7,
            },
            vec!["<resample>"],
        ),
        (
            Error::NoSample {
                file: file(),
                row,
                column: column(),
                rows: 40,
                words: "empty cells".into(),
            },
            vec!["<in columns>", "<part>"],
        ),
        (
            Error::Gap {
                file: file(),
                row,
                column: column(),
                missing: 1,
                previous: "1".into(),
                time: "3".into(),
                interval: 1.0,
            },
            vec!["1 sample is missing", "<strict>"],
        ),
        (
            Error::ConstantInput {
                file: file(),
                column: column(),
                value: constant.0,
                rows: constant.1,
            },
            vec!["<in columns>"],
        ),
        (
            Error::ConstantOutput {
                file: file(),
                column: column(),
                value: constant.0,
                rows: constant.1,
            },
            vec!["<in columns>"],
        ),
        (too_few(Shortage::Short), vec!["20 are needed; give"]),
        (
            too_few(Shortage::Outside { rows: 9 }),
            vec!["<from> and <to> leave out 9"],
        ),
        (too_few(Shortage::Resampled), vec!["<resample>"]),
        (
            ReadError::EmptyCell {
                file: file(),
                row,
                column: column(),
            }
            .into(),
            vec!["<strict>"],
        ),
        (
            ReadError::NotFinite {
                file: file(),
                row,
                column: column(),
                text: "inf".into(),
            }
            .into(),
            vec!["<strict>"],
        ),
        (cell(CellMend::Thousands), vec!["thousands"]),
        (cell(CellMend::Declared), vec!["<columns> says", "<strict>"]),
        (cell(CellMend::Strict), vec!["<strict>"]),
        (cell(CellMend::Declare), vec!["<in columns>"]),
        (
            ReadError::BackwardTime {
                file: file(),
                row,
                column: column(),
                time: "1".into(),
                previous: "2".into(),
                clock: true,
            }
            .into(),
            vec!["time_zone", "<in columns>"],
        ),
        (
            fault(ColumnFault::Missing {
                role: "output",
                wanted: "\"y\"".into(),
                columns: "\"t\", \"u\"".into(),
                closest: None,
            }),
            vec!["<column output>"],
        ),
        (
            fault(ColumnFault::Ambiguous {
                role: "input",
                candidates: "\"u1\", \"u2\"".into(),
            }),
            vec!["<column input>"],
        ),
        (
            fault(ColumnFault::Shared {
                column: column(),
                first: "input",
                second: "output",
            }),
            vec!["<in columns>"],
        ),
        (
            fault(ColumnFault::Unit {
                column: column(),
                file_unit: "kg".into(),
                named_unit: "cm".into(),
            }),
            vec!["<namer> says cm", "<in columns>"],
        ),
    ]
}

#[test]
fn messages_have_the_names_of_the_caller() {
    for (error, names) in messages() {
        let said = error.worded(&OWN);
        for name in names {
            assert!(said.contains(name), "no {name:?} in: {said}");
        }
        assert!(!said.contains('`'), "{said}");
    }
    let bad = BadLine::Text {
        column: "y".into(),
        text: "Bad".into(),
        mend: CellMend::DeclareInStream,
    };
    assert!(bad.worded(&OWN).contains("<in columns>"), "{bad}");
}

/// A caller of the library has neither options nor a model file.
#[test]
fn by_themselves_messages_name_fields_of_the_library() {
    let plain = |said: &str| !["--", "[columns]", "<"].iter().any(|s| said.contains(s));
    for (error, _) in messages() {
        let said = error.to_string();
        assert!(plain(&said), "{said}");
        assert_eq!(said, error.worded(&Names::LIBRARY));
    }
    for mend in [CellMend::Thousands, CellMend::DeclareInStream] {
        let bad = BadLine::Text {
            column: "y".into(),
            text: "Bad".into(),
            mend,
        };
        assert!(plain(&bad.to_string()), "{bad}");
    }
}

#[test]
fn a_summary_has_the_names_of_the_caller() {
    let rows = (0..100).map(|k| format!("{k},{},{}\n", k % 5, k % 7));
    let text = "t,u,y\n".to_string() + &rows.collect::<String>();
    let options = ReadOptions {
        from: Some("10".into()),
        ..ReadOptions::default()
    };
    let reading = parse_csv("a.csv", text.as_bytes(), &Columns::default(), &options).unwrap();
    let summary = reading.summary;
    let said = summary.worded(&OWN);
    assert!(
        said.contains("10 rows outside <from> and <to> left out"),
        "{said}"
    );
    assert!(!summary.to_string().contains("--"), "{summary}");
}
