//! Readings that are lost.

use monitor::{Alarm, Monitor, Notice, Progress, Row, RowResult, Settings, State};

use super::{Tank, first_and_last, model};
use crate::support::{alarms, all, new, notices};

/// The rows without the readings at steps of the command, and a number after each.
fn without_steps(rows: &[Row], behind: usize) -> Vec<Row> {
    let mut lost = rows.to_vec();
    for k in 1..rows.len() {
        if rows[k].inputs != rows[k - 1].inputs {
            for row in &mut lost[k..(k + 1 + behind).min(rows.len())] {
                row.outputs[0] = f64::NAN;
            }
        }
    }
    lost
}

#[test]
fn the_command_of_a_row_counts_where_its_reading_is_lost() {
    for seed in 0..6 {
        let tank = Tank {
            seed,
            colour: if seed % 2 == 0 { 0.0 } else { 0.5 },
            ..Tank::default()
        };
        let rows = tank.run();
        let steps = all(&mut new(model()), &without_steps(&rows, 2));
        assert_eq!(alarms(&steps), Vec::<&Alarm>::new());
        let lost = steps.iter().filter(|step| step.lost[0].is_some()).count();
        assert!(lost > 100, "{lost}");
        // The learned model and the messages about the other readings are the same as with all readings.
        let whole = all(&mut new(model()), &rows);
        for (step, whole) in steps.iter().zip(&whole).skip(2000) {
            let (Some(said), Some(of_all)) = (step.innovations[0], whole.innovations[0]) else {
                assert!(step.lost[0].is_some());
                continue;
            };
            assert!((said.residual - of_all.residual).abs() < 0.5 * tank.noise);
        }
    }
}

#[test]
fn a_reading_that_cannot_be_used_is_lost_and_said() {
    let row = Row::new(0.0, 5.0, &[16.0]);
    for output in [f64::NAN, f64::INFINITY, 1e200] {
        let step = new(model()).update(&Row::new(0.0, 5.0, &[output])).unwrap();
        assert_eq!(step.lost[0].as_ref().unwrap().column(), "output");
    }
    assert_eq!(new(model()).update(&row).unwrap().lost[0], None);
}

#[test]
fn what_begins_is_seen_and_named_where_readings_are_lost() {
    let tank = Tank {
        leak: |t| if t < 4000.0 { 0.0 } else { 1.5 },
        ..Tank::default()
    };
    let steps = all(&mut new(model()), &without_steps(&tank.run(), 2));
    let alarms = alarms(&steps);
    first_and_last(&alarms);
}

/// A plant that moves slowly is watched in means of several rows: one lost reading does not lose the others.
#[test]
fn lost_readings_are_no_alarm_in_means_of_rows() {
    let mut rows = Tank {
        rows: 30_000,
        interval: 0.2,
        ..Tank::default()
    }
    .run();
    for (k, row) in rows.iter_mut().enumerate() {
        if k % 11 == 3 || (k / 50) % 40 == 7 {
            row.outputs[0] = f64::NAN;
        }
    }
    let steps = all(&mut new(model()), &rows);
    let every = notices(&steps).into_iter().find_map(|notice| match notice {
        Notice::Learned { every, .. } => Some(*every),
        _ => None,
    });
    let every = every.unwrap_or_else(|| panic!("{:?}", notices(&steps)));
    assert!(every > 1);
    assert_eq!(alarms(&steps), Vec::<&Alarm>::new());
    let said = steps[25_000..]
        .iter()
        .filter(|s| s.innovations[0].is_some());
    assert!(said.count() > 3000 / every);
}

#[test]
fn a_state_with_lost_readings_goes_on_where_it_was() {
    let rows = without_steps(&Tank::default().run(), 2);
    let mut monitor = new(model());
    let steps = all(&mut monitor, &rows);
    for at in [700, 1900, 2500] {
        let mut before = new(model());
        all(&mut before, &rows[..at]);
        let text = serde_json::to_string(&before.state()).unwrap();
        let state: State = serde_json::from_str(&text).unwrap();
        let mut restored = Monitor::restore(model(), Settings::default(), state).unwrap();
        // A NaN differs from itself, so the comparison uses text.
        let words = |steps: &[RowResult]| format!("{steps:?}");
        assert_eq!(words(&all(&mut restored, &rows[at..])), words(&steps[at..]));
    }
}

#[test]
fn too_few_readings_are_not_learned_from() {
    let mut rows = Tank::default().run();
    for (k, row) in rows.iter_mut().enumerate() {
        if k % 3 > 0 {
            row.outputs[0] = f64::NAN;
        }
    }
    let mut monitor = new(model());
    let steps = all(&mut monitor, &rows);
    assert!(matches!(monitor.progress(), Progress::Learning(_)));
    let why = notices(&steps).into_iter().find_map(|notice| match notice {
        Notice::NotLearned { why } => Some(why),
        _ => None,
    });
    assert!(why.unwrap().contains("rows have no reading"));
}
