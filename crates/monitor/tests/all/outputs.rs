//! Two tanks, one above the other, with both levels measured.

use ct_signals::{excitation, noise};
use monitor::{
    Alarm, Error, Model, Monitor, Notice, Progress, Row, RowResult, ScatterAlarm, Settings, Stage,
    State, Verdict,
};
use plants::{Known, Plant};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::support::{alarms, all, new};

const INTERVAL: f64 = 2.0;
/// Standard deviations of the noise at the upper and at the lower sensor, and their correlations from row to row.
const NOISE: [f64; 2] = [0.05, 0.12];
const COLOUR: [f64; 2] = [0.0, 0.5];

/// Quantities that change with time.
struct Tanks {
    rows: usize,
    seed: u64,
    /// Outflow coefficient of the upper tank.
    alpha_upper: fn(f64) -> f64,
    /// Leak of the lower tank.
    leak_lower: fn(f64) -> f64,
    /// Offset of each sensor.
    offset: fn(f64) -> [f64; 2],
}

impl Default for Tanks {
    fn default() -> Self {
        Self {
            rows: 3000,
            seed: 1,
            alpha_upper: |_| 12.5,
            leak_lower: |_| 0.0,
            offset: |_| [0.0; 2],
        }
    }
}

impl Tanks {
    fn run(&self) -> Vec<Row> {
        let rng = &mut ChaCha8Rng::seed_from_u64(self.seed);
        let command = excitation::steps(self.rows, 20..=100, 4.0, 6.0, rng).unwrap();
        let noise = [0, 1].map(|o| noise::ar1(self.rows, NOISE[o], COLOUR[o], rng));
        let (mut upper, mut lower) = (16.0_f64, 20.0_f64);
        (0..self.rows)
            .map(|k| {
                let time = k as f64 * INTERVAL;
                let offset = (self.offset)(time);
                let readings = [
                    upper + offset[0] + noise[0][k],
                    lower + offset[1] + noise[1][k],
                ];
                let h = INTERVAL / 40.0;
                for i in 0..40 {
                    let t = time + h * f64::from(i);
                    let between = (self.alpha_upper)(t) * upper.sqrt();
                    upper += h * (10.0 * command[k] - between) / 154.0;
                    lower += h * (between - 11.0 * lower.sqrt() - (self.leak_lower)(t)) / 120.0;
                }
                Row::new(time, command[k], &readings)
            })
            .collect()
    }
}

fn model() -> Model {
    let known = Known {
        area: [Some(154.0), Some(120.0), None],
        measured: vec![0, 1],
        ..Known::default()
    };
    Model::new(Plant::CascadedTanks, known)
}

/// The alarms of tanks in which something begins at 4000 s: the first is raised soon after, the last look is given.
fn last_look(steps: &[RowResult]) -> Alarm {
    let alarms = alarms(steps);
    let first = alarms.first().unwrap();
    // The time constants are 100 and 90 s.
    assert!((4000.0..4300.0).contains(&first.time), "{first:?}");
    let last = alarms.iter().find(|alarm| alarm.event == Stage::Final);
    (*last.unwrap()).clone()
}

#[test]
fn healthy_tanks_raise_no_alarm() {
    for seed in [1, 2, 3] {
        let tanks = Tanks {
            rows: 12_000,
            seed,
            ..Tanks::default()
        };
        let mut monitor = new(model());
        let steps = all(&mut monitor, &tanks.run());
        assert_eq!(alarms(&steps), Vec::<&Alarm>::new());
        assert!(steps.iter().all(|s| s.scatter.is_empty()));
        let learned = steps.iter().flat_map(|step| &step.notices).flatten();
        let noise = learned.clone().find_map(|notice| match notice {
            Notice::Learned { noise, .. } => Some(noise.clone()),
            _ => None,
        });
        for (learned, truth) in noise.unwrap().iter().zip(NOISE) {
            assert!((learned / truth - 1.0).abs() < 0.15, "{learned} {truth}");
        }
        // Innovations are white, of the size that was learned, and independent from output to output.
        let of_output = |output: usize| -> Vec<f64> {
            let said = steps.iter().filter_map(|step| step.innovations[output]);
            said.map(|said| said.standardised).collect()
        };
        let (upper, lower) = (of_output(0), of_output(1));
        let n = upper.len() as f64;
        assert!(upper.len() > 9000 && lower.len() == upper.len());
        for e in [&upper, &lower] {
            let rms = (e.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
            assert!((rms - 1.0).abs() < 0.05, "{rms}");
            let neighbours = e.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n;
            assert!(neighbours.abs() < 0.06, "{neighbours}");
        }
        let both = upper.iter().zip(&lower).map(|(a, b)| a * b).sum::<f64>() / n;
        assert!(both.abs() < 0.05, "{both}");
        assert!(steps.iter().all(|step| step.innovations.len() == 2));
        assert!(matches!(monitor.progress(), Progress::Watching { .. }));
    }
}

#[test]
fn a_leak_of_the_lower_tank_is_named_with_its_tank() {
    let tanks = Tanks {
        leak_lower: |t| if t < 4000.0 { 0.0 } else { 1.5 },
        ..Tanks::default()
    };
    let last = last_look(&all(&mut new(model()), &tanks.run()));
    assert!(last.effects.iter().any(|e| e == "const_leak"), "{last:?}");
    assert!((last.since.unwrap() - 4000.0).abs() < 60.0, "{last:?}");
    assert_eq!(last.output.as_deref(), Some("lower"));
    let size = last.size.unwrap();
    assert_eq!(size.vessel.as_deref(), Some("lower"));
    assert!(!size.at_sensor);
}

#[test]
fn a_valve_of_the_upper_tank_that_opens_is_named_with_its_tank() {
    let tanks = Tanks {
        alpha_upper: |t| if t < 4000.0 { 12.5 } else { 13.0 },
        ..Tanks::default()
    };
    let last = last_look(&all(&mut new(model()), &tanks.run()));
    assert!(last.effects.iter().any(|e| e == "valve_step"), "{last:?}");
    assert!((last.since.unwrap() - 4000.0).abs() < 60.0, "{last:?}");
    assert_eq!(last.size.unwrap().vessel.as_deref(), Some("upper"));
}

/// An offset shows at one output alone, and nothing in a tank does.
#[test]
fn an_offset_of_one_sensor_is_named_with_its_sensor() {
    let offsets: [fn(f64) -> [f64; 2]; 2] = [
        |t| [if t < 4000.0 { 0.0 } else { 0.15 }, 0.0],
        |t| [0.0, if t < 4000.0 { 0.0 } else { -0.3 }],
    ];
    for (offset, place) in offsets.into_iter().zip(["upper", "lower"]) {
        let tanks = Tanks {
            offset,
            ..Tanks::default()
        };
        let steps = all(&mut new(model()), &tanks.run());
        let last = last_look(&steps);
        assert_eq!(last.effects[0], "sensor_offset", "{last:?}");
        assert!((last.since.unwrap() - 4000.0).abs() < 60.0, "{last:?}");
        let size = last.size.unwrap();
        assert_eq!(size.vessel.as_deref(), Some(place));
        let offset = offset(5000.0);
        assert!((size.value - offset[0] - offset[1]).abs() < 0.04);
        assert_eq!(last.output.as_deref(), Some(place));
        assert!(size.at_sensor);
    }
}

/// An error that no effect has: the reading of the upper level oscillates.
#[test]
fn an_unexplained_alarm_says_at_which_output_it_shows_most() {
    let tanks = Tanks {
        offset: |t| {
            if t < 4000.0 {
                return [0.0; 2];
            }
            [0.5 * (t / 150.0).sin() + 0.5 * (t / 91.0).cos(), 0.0]
        },
        ..Tanks::default()
    };
    let steps = all(&mut new(model()), &tanks.run());
    let alarms = alarms(&steps);
    let unexplained = alarms
        .iter()
        .find(|alarm| alarm.verdict == Verdict::Unexplained);
    let unexplained = unexplained.unwrap_or_else(|| panic!("{alarms:?}"));
    assert_eq!(unexplained.output.as_deref(), Some("upper"));
}

#[test]
fn a_scatter_that_grows_is_that_of_its_output() {
    let mut rows = Tanks::default().run();
    let extra = noise::white(rows.len(), 0.36, &mut ChaCha8Rng::seed_from_u64(7));
    for (row, extra) in rows[2000..].iter_mut().zip(extra) {
        row.outputs[1] += extra;
    }
    let steps = all(&mut new(model()), &rows);
    let said: Vec<&ScatterAlarm> = steps.iter().flat_map(|s| s.scatter.iter()).collect();
    let [grown] = said[..] else {
        panic!("{said:?}");
    };
    assert_eq!(grown.output.as_deref(), Some("lower"));
    assert!((4000.0..4400.0).contains(&grown.time), "{grown:?}");
    assert!((grown.learned / NOISE[1] - 1.0).abs() < 0.15, "{grown:?}");
    assert_eq!(alarms(&steps), Vec::<&Alarm>::new());
}

/// Readings of either output are missing independently, sometimes several in a row.
fn with_lost_readings(mut rows: Vec<Row>) -> Vec<Row> {
    for (k, row) in rows.iter_mut().enumerate() {
        if k % 5 == 1 || (k / 30) % 20 == 3 {
            row.outputs[0] = f64::NAN;
        }
        if k % 7 == 1 || (k / 30) % 25 == 8 {
            row.outputs[1] = f64::NAN;
        }
    }
    rows
}

#[test]
fn outputs_lose_readings_for_themselves() {
    let healthy = with_lost_readings(
        Tanks {
            rows: 8000,
            ..Tanks::default()
        }
        .run(),
    );
    let steps = all(&mut new(model()), &healthy);
    assert_eq!(alarms(&steps), Vec::<&Alarm>::new());
    for (row, step) in healthy.iter().zip(&steps).skip(4000) {
        for output in 0..2 {
            let lost = row.outputs[output].is_nan();
            assert_eq!(step.lost[output].is_some(), lost);
            assert_eq!(step.innovations[output].is_none(), lost);
        }
        assert!(step.lost.len() == 2);
    }
    let tanks = Tanks {
        offset: |t| [if t < 4000.0 { 0.0 } else { 0.15 }, 0.0],
        ..Tanks::default()
    };
    let last = last_look(&all(&mut new(model()), &with_lost_readings(tanks.run())));
    assert_eq!(last.effects[0], "sensor_offset", "{last:?}");
    assert_eq!(last.size.unwrap().vessel.as_deref(), Some("upper"));
}

/// One sensor fails permanently: the other one is still monitored, also if no reading of the first is left among the rows.
#[test]
fn an_output_without_any_reading_leaves_the_other_one_watched() {
    let mut rows = Tanks {
        rows: 5500,
        leak_lower: |t| if t < 8000.0 { 0.0 } else { 2.0 },
        ..Tanks::default()
    }
    .run();
    for row in &mut rows[1500..] {
        row.outputs[0] = f64::NAN;
    }
    let mut monitor = new(model());
    let steps = all(&mut monitor, &rows);
    let alarms = alarms(&steps);
    let first = alarms.first().unwrap();
    assert!((8000.0..8400.0).contains(&first.time), "{first:?}");
    let last = alarms.last().unwrap();
    assert_eq!(last.event, Stage::Final);
    assert!(last.effects.iter().any(|e| e == "const_leak"), "{last:?}");
}

#[test]
fn an_output_that_is_not_read_is_named_where_nothing_can_be_learned() {
    let mut rows = Tanks::default().run();
    for row in &mut rows {
        row.outputs[1] = f64::NAN;
    }
    let steps = all(&mut new(model()), &rows[..1100]);
    let why = steps
        .iter()
        .flat_map(|step| step.notices.iter().flatten())
        .find_map(|notice| match notice {
            Notice::NotLearned { why } => Some(why.as_str()),
            _ => None,
        });
    let said = "1000 of 1000 rows have no reading of level_lower: check the sensor";
    assert_eq!(why, Some(said));
}

#[test]
fn a_restored_monitor_of_two_outputs_goes_on_where_it_was() {
    let tanks = Tanks {
        leak_lower: |t| if t < 4000.0 { 0.0 } else { 1.5 },
        ..Tanks::default()
    };
    let rows = with_lost_readings(tanks.run());
    let steps = all(&mut new(model()), &rows);
    for at in [600, 1700, 2300] {
        let mut before = new(model());
        all(&mut before, &rows[..at]);
        let text = serde_json::to_string(&before.state()).unwrap();
        let state: State = serde_json::from_str(&text).unwrap();
        let mut restored = Monitor::restore(model(), Settings::default(), state).unwrap();
        // A NaN in what is said is unlike itself: in words.
        let words = |steps: &[RowResult]| format!("{steps:?}");
        assert_eq!(words(&all(&mut restored, &rows[at..])), words(&steps[at..]));
    }
    // Another choice of outputs makes another model.
    let mut monitor = new(model());
    all(&mut monitor, &rows[..50]);
    let mut other = model();
    other.known.measured = vec![1];
    let refused = Monitor::restore(other, Settings::default(), monitor.state());
    let Err(error @ Error::OtherModel { .. }) = refused else {
        panic!("a state of two outputs is none of one");
    };
    let said = "measured: upper, lower then, lower now";
    assert!(error.to_string().contains(said), "{error}");
}

/// With one output, naming the default output changes nothing.
#[test]
fn one_output_is_watched_as_ever() {
    let rows: Vec<Row> = Tanks {
        leak_lower: |t| if t < 4000.0 { 0.0 } else { 2.0 },
        ..Tanks::default()
    }
    .run()
    .iter()
    .map(|row| Row::new(row.time, row.inputs[0], &row.outputs[1..2]))
    .collect();
    let run = |measured: &[usize]| {
        let mut model = model();
        model.known.measured = measured.to_vec();
        let mut monitor = new(model);
        assert_eq!(monitor.outputs(), 1);
        all(&mut monitor, &rows)
    };
    let usual = run(&[]);
    assert_eq!(usual, run(&[1]));
    // Its JSON lines do not mention outputs.
    let line = serde_json::to_value(alarms(&usual)[0]).unwrap();
    assert!(line.get("output").is_none() && line.get("schema").is_some());
}
