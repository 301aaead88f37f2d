//! The monitor from outside: a tank with noise, rows one at a time.

use ct_signals::{Hold, excitation, noise};
use monitor::{
    Alarm, Error, Model, Monitor, Notice, Progress, Refused, Row, ScatterAlarm, ScatterEvent,
    Settings, Stage, State, Step, Verdict,
};
use plants::{EffectInfo, Known, Placed, Plant};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::support::{alarms, all, new, notices, units};

/// A single tank under random steps of the command, read with noise.
struct Tank {
    rows: usize,
    interval: f64,
    noise: f64,
    colour: f64,
    /// Outflow coefficient and leak at a time.
    alpha: fn(f64) -> f64,
    leak: fn(f64) -> f64,
    seed: u64,
}

impl Default for Tank {
    fn default() -> Self {
        Self {
            rows: 3000,
            interval: 2.0,
            noise: 0.05,
            colour: 0.0,
            alpha: |_| 12.5,
            leak: |_| 0.0,
            seed: 1,
        }
    }
}

impl Tank {
    fn run(&self) -> Vec<Row> {
        let rng = &mut ChaCha8Rng::seed_from_u64(self.seed);
        let steps = (40.0 / self.interval) as usize..=(200.0 / self.interval) as usize;
        let command = excitation::steps(self.rows, steps, 4.0, 6.0, rng).unwrap();
        let noise = noise::ar1(self.rows, self.noise, self.colour, rng);
        let mut level = 16.0_f64;
        let parts = 20;
        (0..self.rows)
            .map(|k| {
                let time = k as f64 * self.interval;
                let row = Row::new(time, command[k], &[level + noise[k]]);
                let h = self.interval / f64::from(parts);
                for i in 0..parts {
                    let t = time + h * f64::from(i);
                    let rate = |level: f64| {
                        (10.0 * command[k] - (self.alpha)(t) * level.sqrt() - (self.leak)(t))
                            / 154.0
                    };
                    let middle = level + 0.5 * h * rate(level);
                    level += h * rate(middle);
                }
                row
            })
            .collect()
    }
}

fn model() -> Model {
    let known = Known {
        area: [Some(154.0), None, None],
        ..Known::default()
    };
    Model::new(Plant::SingleTank, known)
}

/// The first and the last alarm of a leak that begins at 4000 s, which was seen, named and dated.
fn first_and_last<'a>(alarms: &[&'a Alarm]) -> (&'a Alarm, &'a Alarm) {
    let first = alarms.first().unwrap();
    // A time constant is 100 s.
    assert!((4000.0..4200.0).contains(&first.time), "{first:?}");
    let last = alarms
        .iter()
        .find(|alarm| alarm.event == Stage::Final)
        .unwrap();
    assert!(last.effects.iter().any(|e| e == "const_leak"), "{last:?}");
    assert!((last.since.unwrap() - 4000.0).abs() < 60.0, "{last:?}");
    (first, last)
}

#[test]
fn a_leak_is_seen_named_and_dated() {
    let tank = Tank {
        leak: |t| if t < 4000.0 { 0.0 } else { 1.5 },
        ..Tank::default()
    };
    let steps = all(&mut new(model()), &tank.run());
    let alarms = alarms(&steps);
    let (first, last) = first_and_last(&alarms);
    assert_eq!(first.event, Stage::Alarm);
    assert!(first.score > first.threshold);
    assert!(last.evidence.unwrap() > first.evidence.unwrap());
    assert!(last.sentence.contains(" since t = ") && last.sentence.contains(" against "));
    // The group is what cannot be told apart: a member is within six of the best.
    if last.effects.len() > 1 {
        assert_eq!(last.verdict, Verdict::Undecided);
        let next = last.next.as_ref().unwrap();
        assert!(last.evidence.unwrap() - next.evidence < 6.0);
    }
}

/// What was believed is not given up for what is now: it goes on being said that it does not fit, until it does.
#[test]
fn the_learned_model_stays_until_it_fits_again() {
    let tank = Tank {
        rows: 6000,
        leak: |t| {
            if (4000.0..8000.0).contains(&t) {
                1.5
            } else {
                0.0
            }
        },
        ..Tank::default()
    };
    let rows = tank.run();
    let mut monitor = new(model());
    // The last look is 1200 s after the alarm; a long gap on the way back changes nothing.
    let mut steps = all(&mut monitor, &rows[..3500]);
    let learned = monitor.estimates()[1].learned;
    assert!(matches!(monitor.progress(), Progress::Alarmed { .. }));
    steps.extend(all(&mut monitor, &rows[3560..3990]));
    assert!(matches!(monitor.progress(), Progress::Alarmed { .. }));
    steps.extend(all(&mut monitor, &rows[3990..]));
    assert!(matches!(monitor.progress(), Progress::Watching { .. }));
    assert_eq!(monitor.estimates()[1].learned, learned);
    let stages: Vec<Stage> = alarms(&steps).iter().map(|alarm| alarm.event).collect();
    use Stage::{Final, Update};
    assert_eq!(
        stages,
        [Stage::Alarm, Update, Update, Update, Update, Final]
    );
    let again: Vec<f64> = notices(&steps)
        .into_iter()
        .filter_map(|notice| match notice {
            Notice::FitsAgain { time, since } => {
                assert_eq!(*since, alarms(&steps)[0].time);
                Some(*time)
            }
            _ => None,
        })
        .collect();
    assert!(
        again.len() == 1 && (8600.0..10_500.0).contains(&again[0]),
        "{again:?}"
    );
}

/// Innovations that grow have no structure that an effect has, and are said all the same.
#[test]
fn a_scatter_that_grows_is_said_in_words_and_is_no_effect() {
    for grown in [2.0, 5.0] {
        let mut rows = Tank {
            rows: 5000,
            ..Tank::default()
        }
        .run();
        let extra = noise::white(
            rows.len(),
            0.05 * f64::sqrt(grown * grown - 1.0),
            &mut ChaCha8Rng::seed_from_u64(77),
        );
        for (row, extra) in rows[2000..3500].iter_mut().zip(extra) {
            row.outputs[0] += extra;
        }
        let steps = all(&mut new(model()), &rows);
        let said: Vec<&ScatterAlarm> = steps.iter().filter_map(|s| s.scatter.first()).collect();
        let [up, down] = said[..] else {
            panic!("{said:?}");
        };
        assert_eq!(up.event, ScatterEvent::ScatterGrown);
        assert!((4000.0..4600.0).contains(&up.time), "{up:?}");
        assert!((up.learned / 0.05 - 1.0).abs() < 0.1, "{up:?}");
        assert!((up.now / (0.05 * grown) - 1.0).abs() < 0.4, "{up:?}");
        assert!(up.sentence.contains("has grown from 0.0"), "{up:?}");
        assert!(up.sentence.contains("sensor and its cable"), "{up:?}");
        assert_eq!(down.event, ScatterEvent::ScatterBack);
        assert!((7000.0..9500.0).contains(&down.time), "{down:?}");
        assert!(alarms(&steps).is_empty(), "{:?}", alarms(&steps));
    }
}

/// Innovations of five standard deviations that alternate.
#[test]
fn readings_that_alternate_are_no_fit() {
    let mut rows = Tank::default().run();
    for (k, row) in rows[2000..].iter_mut().enumerate() {
        row.outputs[0] += [0.25, -0.25][k % 2];
    }
    let steps = all(&mut new(model()), &rows);
    let first = steps.iter().find_map(|step| step.scatter.first()).unwrap();
    assert!(
        first.time <= rows[2040].time && first.now > 4.0 * first.learned,
        "{first:?}"
    );
}

#[test]
fn a_leak_grows_no_scatter() {
    let tank = Tank {
        rows: 5000,
        leak: |t| if t < 4000.0 { 0.0 } else { 12.0 },
        ..Tank::default()
    };
    let steps = all(&mut new(model()), &tank.run());
    assert!(!alarms(&steps).is_empty());
    assert!(steps.iter().all(|step| step.scatter.is_empty()));
}

#[test]
fn nothing_is_seen_where_nothing_is() {
    for (seed, colour) in [(3, 0.0), (4, 0.7)] {
        let tank = Tank {
            rows: 12_000,
            colour,
            seed,
            ..Tank::default()
        };
        let mut monitor = new(model());
        let steps = all(&mut monitor, &tank.run());
        assert!(alarms(&steps).is_empty(), "{:?}", alarms(&steps));
        // The innovations are white and of the size that was learned.
        let e: Vec<f64> = steps
            .iter()
            .filter_map(|step| Some(step.innovations[0]?.standardised))
            .collect();
        let n = e.len() as f64;
        let rms = (e.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
        assert!((rms - 1.0).abs() < 0.05, "{rms}");
        let neighbours = e.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n;
        assert!(neighbours.abs() < 0.06, "{neighbours}");
        let Progress::Watching { score, threshold } = monitor.progress() else {
            panic!("{:?}", monitor.progress());
        };
        assert!(score < threshold && threshold > 5.0);
    }
}

/// The band holds a parameter that stays, and follows one that moves too slowly to alarm at once.
#[test]
fn the_estimates_follow_and_their_band_holds() {
    let (mut held, mut looked) = (0, 0);
    for seed in 10..16 {
        let tank = Tank {
            rows: 6000,
            seed,
            ..Tank::default()
        };
        let mut monitor = new(model());
        for row in tank.run() {
            monitor.update(&row).unwrap();
            if monitor.rows() > 3000 && monitor.rows().is_multiple_of(1500) {
                for (estimate, truth) in monitor.estimates().iter().zip([10.0, 12.5]) {
                    looked += 1;
                    held +=
                        usize::from((estimate.value - truth).abs() < estimate.half_width.unwrap());
                }
            }
        }
    }
    assert!(
        looked >= 24 && 100 * held >= 85 * looked,
        "{held} of {looked}"
    );

    let tank = Tank {
        alpha: |t| if t < 4000.0 { 12.5 } else { 12.75 },
        ..Tank::default()
    };
    let mut monitor = new(model());
    let rows = tank.run();
    let changed = rows.iter().position(|row| row.time >= 4000.0).unwrap();
    // Before it is learned anew: the alarm has let the tracker go.
    all(&mut monitor, &rows[..changed + 500]);
    let estimates = monitor.estimates();
    assert_eq!(estimates[1].name, "alpha");
    assert_eq!(estimates[1].unit, "cm^2.5/s");
    assert!((estimates[1].learned - 12.5).abs() < 0.1, "{estimates:?}");
    assert!((estimates[1].value - 12.75).abs() < 0.1, "{estimates:?}");
    assert!((estimates[0].value - 10.0).abs() < 0.1, "{estimates:?}");
}

/// Saved and restored in every phase, by way of text, it goes on bit for bit.
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
    // Each number that counts something, spoilt.
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
        Refused::Repeated {
            time: rows[1499].time
        }
    );
    assert_eq!(monitor.state(), clean.state());
}

/// The rows without the readings in which the command steps, and so many behind each.
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
        // What was learned and what is said of the readings that are left is what it was with all of them.
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
        // A NaN in what is said is unlike itself: in words.
        let words = |steps: &[Step]| format!("{steps:?}");
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

/// Why a first row of input and output is refused, beside one that is taken.
fn refused(model: Model, row: [f64; 2], taken: [f64; 2]) -> Refused {
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
    assert!(matches!(refused, Refused::BeyondRange { .. }));
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
    assert!(matches!(lost(0.0, 160.0), Some(Refused::AboveTank { .. })));
    assert_eq!(lost(1.0, 33.0), None);
}

/// A row whose time lies far ahead, or a clock that begins anew, makes the monitor deaf for a hundred rows and no longer.
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
            assert!(matches!(refused, Refused::Backward { .. }), "{refused}");
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
    // From row 2000 on every third row only.
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

/// The promise is in rows: that of a block of rows is as many blocks.
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

/// Nothing can be learned while the command stands still; it waits, and does not fill the memory.
#[test]
fn a_command_that_stands_still_teaches_nothing() {
    let mut rows = Tank {
        rows: 4000,
        ..Tank::default()
    }
    .run();
    let moved = rows.split_off(2500);
    let mut monitor = new(model());
    for (k, row) in rows.iter().enumerate() {
        let output = 16.0 + 0.01 * ((k * 7919) % 13) as f64;
        let still = Row::new(row.time, 5.0, &[output]);
        monitor.update(&still).unwrap();
        let state = serde_json::to_string(&monitor.state());
        if k % 500 == 499 {
            assert!(state.unwrap().len() < 2_000_000);
        }
    }
    let steps = all(&mut monitor, &moved);
    assert!(steps.len() == 1500);
}

#[test]
fn what_follows_the_clock_of_a_record_is_refused() {
    let mut model = model();
    model.effects.push(Placed {
        effect: EffectInfo::find("sensor_drift").unwrap(),
        vessel: 0,
    });
    let refused = Monitor::new(model, Settings::default(), units());
    assert!(matches!(refused, Err(Error::ByClock { .. })));
    let settings = Settings {
        rows_between_false_alarms: 1.0,
        ..Settings::default()
    };
    assert!(matches!(
        Monitor::new(self::model(), settings, units()),
        Err(Error::Setting { .. })
    ));
}
