//! Tables 1 to 4 with 200 noises: against the paper, against an independent program, and what the paper says beside its tables.

use std::path::Path;

use paper_tables::udink::{Settings, Verdict, study};

#[test]
fn two_hundred_noises_agree_with_the_paper_and_with_another_program() {
    let study = study(&Settings::default(), 200, 1, &|_| {}).unwrap();
    // One cell in ten is outside by chance; differences caused by the rule are listed.
    assert!(study.euler.inside >= 66, "{:?}", study.euler.outside);
    assert!(study.exact.inside >= 62, "{:?}", study.exact.outside);
    assert_eq!(study.euler.failed + study.exact.failed, 0);
    assert_eq!(study.verdict(), Verdict::Consistent);

    // Tables 2 and 3 have the same noise, and the paper's differences between them are not explained by the settings.
    let [shared, ..] = &study.contrasts[..] else {
        panic!("no contrasts")
    };
    assert_eq!(shared.between, [2, 3]);
    for cell in ["K avg", "tau avg", "P11"] {
        let found = shared.cells.iter().find(|found| found.cell == cell);
        assert!(!found.unwrap().inside, "{cell}");
    }
    assert_eq!((shared.inside, shared.cells.len()), (10, 14));
    assert_eq!(study.power.iter().filter(|it| !it.noticed).count(), 7);
    // Settings that are far off are detected; some near ones are not, which the tables report.
    let noticed = |name: &str| {
        let mut found = study.power.iter().filter(|it| it.setting.contains(name));
        found.next().unwrap().noticed
    };
    assert!(noticed("42 s") && noticed("gamma = 2") && noticed("K^(0) = 0.5"));
    assert!(!noticed("tau^(0) = 1 s"));
    // "A diagonal matrix was found to exhibit slow convergence."
    for [of_table, slow] in [[0, 2], [1, 3]].map(|rows| rows.map(|row| &study.constant_gains[row]))
    {
        assert_eq!(of_table.rule, slow.rule);
        assert!(slow.criterion[3] > 10.0 * of_table.criterion[3], "{slow:?}");
        assert_eq!(slow.failed, 0);
    }

    // "Larger values lead to numerical difficulties", of P(0): by Euler's rule they do, by the exact step they do not.
    for row in &study.larger_p {
        assert_eq!(row.exact_failed, 0, "{row:?}");
        match row.factor {
            ..=15.0 => assert_eq!(row.euler_failed, 0, "{row:?}"),
            20.0.. => assert_eq!(row.euler_failed, row.runs, "{row:?}"),
            _ => {}
        }
    }

    // If it is next to the checkout: the range of the median of 200 noises from another program, cell by cell.
    let bands =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reproduction/udink-accept.md");
    let Ok(bands) = std::fs::read_to_string(&bands) else {
        eprintln!("skipped: {} is not there", bands.display());
        return;
    };
    let mut seen = 0;
    for row in bands.lines() {
        let columns: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let Some(table) = columns.first().and_then(|n| n.parse::<usize>().ok()) else {
            continue;
        };
        for (comparison, column) in [(&study.euler, 3), (&study.exact, 5)] {
            let (low, high) = columns[column].split_once("..").unwrap();
            let [low, high] = [low, high].map(|end| end.trim().parse::<f64>().unwrap());
            let mut cells = comparison.tables.iter();
            let cell = cells.find(|cell| (cell.table, cell.cell) == (table, columns[1]));
            let median = cell.unwrap().median;
            assert!(
                (low..=high).contains(&median),
                "table {table}, {}: {median} instead of {low} to {high}",
                columns[1]
            );
            seen += 1;
        }
    }
    assert_eq!(seen, 144);
}
