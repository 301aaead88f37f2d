//! Gaps, clocks that go back, other sampling intervals, and rows in blocks.

use ct_signals::Hold;
use monitor::{Model, Monitor, NotUsed, Notice, Progress, Row, Settings};

use super::{Tank, model};
use crate::support::{alarms, all, new, notices, units};

#[test]
fn gaps_are_said_and_bridged_or_waited_out() {
    let mut rows = Tank {
        rows: 8000,
        ..Tank::default()
    }
    .run();
    rows.drain(6000..6400);
    rows.drain(3000..3003);
    let mut monitor = new(model());
    let steps = all(&mut monitor, &rows);
    let gaps: Vec<_> = notices(&steps)
        .into_iter()
        .filter(|notice| matches!(notice, Notice::Gap { .. }))
        .collect();
    assert_eq!(
        gaps,
        [
            &Notice::Gap {
                from: 5998.0,
                to: 6006.0,
                missing: 3,
                bridged: true
            },
            &Notice::Gap {
                from: 11998.0,
                to: 12800.0,
                missing: 400,
                bridged: false
            },
        ]
    );
    assert!(alarms(&steps).is_empty(), "{:?}", alarms(&steps));
    assert!(matches!(monitor.progress(), Progress::Watching { .. }));
}

/// After a row whose time lies far ahead, or a clock that is reset, the monitor ignores at most a hundred rows.
#[test]
fn a_clock_that_goes_back_is_followed() {
    let rows = Tank {
        leak: |t| if t < 5200.0 { 0.0 } else { 3.0 },
        ..Tank::default()
    }
    .run();
    let mut ahead = rows.clone();
    ahead[2000].time *= 10.0;
    let mut anew = rows.clone();
    for row in &mut anew[2001..] {
        row.time -= 4002.0;
    }
    for rows in [ahead, anew] {
        let mut monitor = new(model());
        all(&mut monitor, &rows[..2001]);
        for row in &rows[2001..2100] {
            let refused = monitor.update(row).unwrap_err();
            assert!(matches!(refused, NotUsed::Backward { .. }), "{refused}");
        }
        let mut monitor = Monitor::restore(model(), Settings::default(), monitor.state()).unwrap();
        let steps = all(&mut monitor, &rows[2100..]);
        let back = Notice::ClockSetBack {
            from: rows[2000].time,
            to: rows[2100].time,
        };
        assert_eq!(steps[0].notices[0], Some(back));
        let alarm = alarms(&steps)[0];
        let late = alarm.time - rows[2600].time;
        assert!((0.0..200.0).contains(&late), "{alarm:?}");
    }
}

#[test]
fn another_sampling_interval_is_learned_anew() {
    let rows = Tank {
        rows: 7000,
        ..Tank::default()
    }
    .run();
    // From row 2000 on, every third row only.
    let kept: Vec<Row> = rows
        .iter()
        .enumerate()
        .filter(|(k, _)| *k < 2000 || k % 3 == 0)
        .map(|(_, row)| row.clone())
        .collect();
    let steps = all(&mut new(model()), &kept);
    let changed = notices(&steps).into_iter().find_map(|notice| match notice {
        Notice::IntervalChanged { from, to, .. } => Some((*from, *to)),
        _ => None,
    });
    assert_eq!(changed, Some((2.0, 6.0)));
    let learned = notices(&steps)
        .iter()
        .filter(|notice| matches!(notice, Notice::Learned { .. }))
        .count();
    assert_eq!(learned, 2);
    assert!(alarms(&steps).is_empty());
}

#[test]
fn a_plant_that_is_sampled_much_faster_than_it_moves_is_watched_in_blocks() {
    let tank = Tank {
        rows: 120_000,
        interval: 0.05,
        noise: 0.3,
        leak: |t| if t < 4500.0 { 0.0 } else { 3.0 },
        ..Tank::default()
    };
    let steps = all(&mut new(model()), &tank.run());
    let every = notices(&steps).into_iter().find_map(|notice| match notice {
        Notice::Learned { every, .. } => Some(*every),
        _ => None,
    });
    assert!(every.unwrap() >= 8, "{every:?}");
    let alarms = alarms(&steps);
    assert!(
        alarms[0].time > 4500.0 && alarms[0].time < 4800.0,
        "{alarms:?}"
    );
}

/// The mean time between false alarms is specified in rows; with blocks of rows it is the same number of blocks.
#[test]
fn false_alarms_are_promised_in_rows_whatever_the_blocks() {
    let rows = Tank {
        rows: 60_000,
        interval: 0.1,
        noise: 0.3,
        ..Tank::default()
    }
    .run();
    let learned = |rows: &[Row], hold, between| {
        let settings = Settings {
            rows_between_false_alarms: between,
            ..Settings::default()
        };
        let model = Model { hold, ..model() };
        let mut monitor = Monitor::new(model, settings, units()).unwrap();
        let steps = all(&mut monitor, rows);
        let found = notices(&steps).into_iter().find_map(|notice| match notice {
            Notice::Learned {
                every, threshold, ..
            } => Some((*every, *threshold)),
            _ => None,
        });
        found.unwrap()
    };
    let (every, threshold) = learned(&rows, Hold::Zero, 1e6);
    assert!(every >= 8, "{every}");
    let mean = |rows: &[Row]| {
        let of = |value: fn(&Row) -> f64| rows.iter().map(value).sum::<f64>() / rows.len() as f64;
        Row::new(
            of(|row| row.time),
            of(|row| row.inputs[0]),
            &[of(|row| row.outputs[0])],
        )
    };
    let means: Vec<Row> = rows.chunks_exact(every).map(mean).collect();
    let (one, same) = learned(&means, Hold::First, 1e6 / every as f64);
    assert_eq!(one, 1);
    assert!(
        (threshold / same - 1.0).abs() < 0.02,
        "{threshold} and {same}"
    );
}
