//! Rows that are refused and change nothing.

use monitor::{Model, NotUsed, Row};

use super::{Tank, model};
use crate::support::{all, new};

#[test]
fn bad_rows_change_nothing() {
    let rows = Tank::default().run();
    let mut clean = new(model());
    let steps = all(&mut clean, &rows[..1500]);
    let mut monitor = new(model());
    for (k, row) in rows[..1500].iter().enumerate() {
        if k % 7 == 3 {
            let time = row.time;
            let refusals = [
                Row {
                    inputs: [f64::INFINITY].into_iter().collect(),
                    ..row.clone()
                },
                Row {
                    time: f64::NAN,
                    ..row.clone()
                },
                Row {
                    time: time - 2.0,
                    ..row.clone()
                },
                Row {
                    time: time - 100.0,
                    ..row.clone()
                },
            ];
            let columns = refusals.map(|row| monitor.update(&row).unwrap_err().column());
            assert_eq!(columns, ["input", "time", "time", "time"]);
        }
        assert_eq!(monitor.update(row).unwrap(), steps[k]);
    }
    let repeated = monitor.update(&rows[1499]).unwrap_err();
    assert_eq!(
        repeated,
        NotUsed::Repeated {
            time: rows[1499].time
        }
    );
    assert_eq!(monitor.state(), clean.state());
}

/// Reason why a first row of input and output is rejected, next to an accepted one.
pub(super) fn refused(model: Model, row: [f64; 2], taken: [f64; 2]) -> NotUsed {
    let mut monitor = new(model);
    let row_of = |[input, output]: [f64; 2]| Row::new(0.0, input, &[output]);
    let refused = monitor.update(&row_of(row)).unwrap_err();
    assert_eq!(monitor.rows(), 0);
    monitor.update(&row_of(taken)).unwrap();
    refused
}

#[test]
fn a_command_that_no_pump_gets_is_refused() {
    let mut model = model();
    model.known.input_range = Some(10.0);
    let refused = refused(model, [65535.0, 16.0], [10.0, 16.0]);
    assert!(matches!(refused, NotUsed::BeyondRange { .. }));
    assert_eq!(refused.column(), "input");
}

/// A reading a little above the tank is a sensor that is off, and to be seen; one far above it is none.
#[test]
fn a_reading_that_no_tank_of_this_height_gives_is_lost() {
    let mut model = model();
    model.known.tank_height = Some(30.0);
    let mut monitor = new(model);
    let mut lost = |time, output| {
        let row = Row::new(time, 5.0, &[output]);
        monitor.update(&row).unwrap().lost[0].clone()
    };
    assert!(matches!(lost(0.0, 160.0), Some(NotUsed::AboveTank { .. })));
    assert_eq!(lost(1.0, 33.0), None);
}
