//! Saved states: read back, and refused.

use monitor::{Error, Monitor, Settings, State};

use super::{Tank, model};
use crate::support::{alarms, all, new};

/// Saved and restored in every phase as text, the monitor continues bit for bit.
#[test]
fn a_restored_monitor_goes_on_as_if_nothing_had_happened() {
    let tank = Tank {
        rows: 7000,
        colour: 0.5,
        leak: |t| if t < 9000.0 { 0.0 } else { 2.0 },
        ..Tank::default()
    };
    let mut rows = tank.run();
    // A short and a long gap, and another interval at the end.
    rows.drain(2600..2602);
    rows.drain(3500..3560);
    let kept = rows.split_off(6200);
    rows.extend(kept.into_iter().step_by(2));
    let mut straight = new(model());
    let steps = all(&mut straight, &rows);
    assert!(!alarms(&steps).is_empty());
    for cuts in [
        vec![10, 700, 1500, 2601, 3505, 3600],
        vec![2048, 4400, 4437, 4460, 4700, 5100, 6221, 6400],
    ] {
        let mut monitor = new(model());
        let mut from = 0;
        for cut in cuts.into_iter().chain([rows.len()]) {
            for (row, expected) in rows[from..cut].iter().zip(&steps[from..cut]) {
                assert_eq!(monitor.update(row).unwrap(), *expected, "at {}", row.time);
            }
            from = cut;
            let text = serde_json::to_string(&monitor.state()).unwrap();
            let state: State = serde_json::from_str(&text).unwrap();
            assert_eq!(state, monitor.state());
            monitor = Monitor::restore(model(), Settings::default(), state).unwrap();
        }
        assert_eq!(monitor.estimates(), straight.estimates());
        assert_eq!(monitor.rows(), straight.rows());
        assert_eq!(monitor.state(), straight.state());
    }
}

#[test]
fn a_state_of_another_model_or_a_damaged_one_is_refused() {
    let mut monitor = new(model());
    all(&mut monitor, &Tank::default().run()[..1800]);
    let state = monitor.state();
    let mut other = model();
    other.known.area = [Some(155.0), None, None];
    let Err(Error::OtherModel { .. }) = Monitor::restore(other, Settings::default(), state.clone())
    else {
        panic!("another area was taken");
    };
    // Each count in the state, corrupted.
    let text = serde_json::to_value(&state).unwrap();
    for (pointer, value) in [
        ("/checkpoint/judged", 1_000_000.into()),
        ("/checkpoint/every", 0.into()),
        ("/checkpoint/learned/theta", serde_json::json!([1.0])),
        ("/checkpoint/learned", serde_json::Value::Null),
        (
            "/checkpoint/learned/outputs/0/coefficients",
            serde_json::json!([3.0]),
        ),
        ("/checkpoint/learned/outputs/0/sigma", 0.0.into()),
        ("/checkpoint/learned/outputs", serde_json::json!([])),
        ("/checkpoint/scatter", serde_json::json!([])),
        ("/intake/outputs", serde_json::json!([])),
        ("/checkpoint/bank/z", serde_json::json!([])),
        ("/checkpoint/kept", serde_json::json!([])),
        ("/intake/every", 0.into()),
        ("/version", 99.into()),
    ] {
        let mut spoilt = text.clone();
        *spoilt.pointer_mut(pointer).unwrap() = value;
        let state: State = serde_json::from_value(spoilt).unwrap();
        let refused = Monitor::restore(model(), Settings::default(), state);
        assert!(refused.is_err(), "{pointer}");
    }
}
