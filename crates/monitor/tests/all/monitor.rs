//! The monitor through its interface: a tank with noise, one row at a time.

mod clock;
mod lost;
mod refused;
mod state;

use ct_signals::{excitation, noise};
use monitor::{
    Alarm, Error, Model, Monitor, Notice, Progress, Row, ScatterAlarm, ScatterEvent, Settings,
    Stage, Verdict,
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

/// The first and the last alarm for a leak that begins at 4000 s: it is detected in time, and named with its onset.
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
    assert!(first.raised == first.time && last.raised == first.time);
    assert!(last.since.is_some() && last.next.is_some(), "{last:?}");
    // The group contains the effects that cannot be distinguished: a member is within six of the best.
    if last.effects.len() > 1 {
        assert_eq!(last.verdict, Verdict::Undecided);
        let next = last.next.as_ref().unwrap();
        assert!(last.evidence.unwrap() - next.evidence < 6.0);
    }
}

/// The learned model does not change after an alarm: the monitor reports a mismatch until the model fits again.
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
        // The innovations are white and have the learned standard deviation.
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

/// The band contains a constant parameter, and follows one that changes too slowly for an immediate alarm.
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
    // Before the model is fitted again: the alarm has increased the covariance of the tracker.
    all(&mut monitor, &rows[..changed + 500]);
    let estimates = monitor.estimates();
    assert_eq!(estimates[1].name, "alpha");
    assert_eq!(estimates[1].unit, "cm^2.5/s");
    assert!((estimates[1].learned - 12.5).abs() < 0.1, "{estimates:?}");
    assert!((estimates[1].value - 12.75).abs() < 0.1, "{estimates:?}");
    assert!((estimates[0].value - 10.0).abs() < 0.1, "{estimates:?}");
}

/// Learning is not possible while the command is constant; the monitor waits with constant memory.
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
