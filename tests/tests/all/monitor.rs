//! The monitor on loops drawn at random: a part of `cargo run --release -p ctid-tests --example monitor_study`.
#![allow(clippy::unwrap_used)]

use ctid_tests::Drive;
use ctid_tests::onset::{Lost, Onset};
use monitor::Settings;
use rayon::prelude::*;

/// An effect that begins half-way, of each kind, as large as the noise, in white and coloured noise in turn: detected within three time
/// constants of reaching the size of the noise, and in the named group.
#[test]
fn what_begins_is_seen_and_named() {
    let found: Vec<(bool, bool)> = (30..35)
        .into_par_iter()
        .map(|number| {
            let colour = if number % 2 == 0 { 0.0 } else { 0.5 };
            let onset = Onset::drawn(number, 3000, 1.0, colour).unwrap();
            let alarms = onset.watched(Settings::default(), number).unwrap();
            let at = |row: usize| row as f64 * onset.rig.interval;
            let visible = at(onset.visible_from().unwrap());
            let first = alarms.iter().find(|alarm| alarm.time >= at(onset.row));
            let seen = first.is_some_and(|a| a.time <= visible + 3.0 * onset.time_constant());
            let (placed, _) = onset.effect.as_ref().unwrap();
            let last = alarms.iter().rfind(|alarm| alarm.time >= at(onset.row));
            let named = last.is_some_and(|a| a.effects.iter().any(|e| e == placed.effect.id));
            (seen, named)
        })
        .collect();
    let count = |of: fn(&(bool, bool)) -> bool| found.iter().filter(|f| of(f)).count();
    assert!(count(|f| f.0) >= 4, "{found:?}");
    assert!(count(|f| f.1) >= 4, "{found:?}");
}

#[test]
fn nothing_is_seen_where_nothing_begins() {
    let alarms: Vec<usize> = (40..44)
        .into_par_iter()
        .map(|number| {
            let colour = if number % 2 == 0 { 0.0 } else { 0.5 };
            let onset = Onset::nothing(8000, colour, number);
            let alarms = onset.watched(Settings::default(), number).unwrap();
            alarms.len()
        })
        .collect();
    assert_eq!(alarms, [0; 4]);
}

/// Readings that are lost at random and at steps, in loops that are open and closed, in white and coloured noise.
#[test]
fn nothing_is_seen_where_readings_are_lost() {
    let alarms: Vec<usize> = (50..58)
        .into_par_iter()
        .map(|number| {
            let colour = if number % 2 == 0 { 0.0 } else { 0.5 };
            let mut onset = Onset::nothing(6000, colour, number);
            if number % 4 < 2 {
                onset.rig.drive = Drive::Open;
            }
            onset.lost = Some(Lost {
                share: 0.05,
                at_steps: number < 54,
            });
            let alarms = onset.watched(Settings::default(), number).unwrap();
            alarms.len()
        })
        .collect();
    assert_eq!(alarms, [0; 8]);
}
