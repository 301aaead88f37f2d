//! Models of their user's own: a heated block with two inputs, and two heaters that are coupled and both measured.

mod plants;

use ct_signals::{excitation, noise};
use monitor::{
    Error, Monitor, Notice, OwnModel, Progress, Row, RowResult, Settings, State, Units, Verdict,
};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

pub(crate) use self::plants::{BLOCK, Plant, alarms, all, model, own};
use self::plants::{HEATERS, HEATERS_TRUE, held, monitor};

#[test]
fn the_parameters_are_found_and_their_bands_hold_them() {
    let truth = [0.15, 0.6, 2e-9];
    let (mut inside, mut of) = (0, 0);
    for seed in 0..8 {
        let plant = Plant::block(3000, seed);
        let mut monitor = monitor(&plant.model);
        let rows = plant.run();
        let steps = all(&mut monitor, &rows);
        assert!(alarms(&steps).is_empty());
        inside += held(&monitor, &truth);
        of += truth.len();
        let estimates = monitor.estimates();
        let (capacity, heater) = (&estimates[0], &estimates[2]);
        assert_eq!(
            (capacity.name.as_str(), capacity.unit.as_str()),
            ("C", "J/K")
        );
        assert_eq!((capacity.value, capacity.half_width), (52.0, None));
        assert!((heater.value / 0.6 - 1.0).abs() < 0.05, "{heater:?}");
    }
    // Bands of 95 % contain 22.8 of 24 on average; fewer than 19 occur by chance once in 200 runs, with the correlation within a run.
    assert!((19..=of).contains(&inside), "{inside} of {of}");
}

#[test]
fn twenty_thousand_quiet_rows_raise_no_alarm() {
    for plant in [Plant::block(20_000, 11), Plant::heaters(20_000, 12)] {
        let mut monitor = monitor(&plant.model);
        let steps = all(&mut monitor, &plant.run());
        assert!(alarms(&steps).is_empty());
        assert!(steps.iter().all(|step| step.scatter.is_empty()));
        assert!(matches!(monitor.progress(), Progress::Watching { .. }));
    }
}

#[test]
fn a_change_is_seen_soon_and_its_onset_is_found() {
    for seed in 0..4 {
        let mut plant = Plant::block(3500, 20 + seed);
        // The loss to the room grows by a third.
        plant.parameters.push((2500, vec![52.0, 0.25, 0.6, 2e-9]));
        let mut monitor = monitor(&plant.model);
        let steps = all(&mut monitor, &plant.run());
        let alarms = alarms(&steps);
        let time_constant = monitor.time_constant().unwrap();
        assert!((60.0..300.0).contains(&time_constant), "{time_constant}");
        let (first, last) = (alarms[0], alarms.last().unwrap());
        let onset = 2500.0 * plant.interval;
        assert!(
            first.time > onset && first.time < onset + 3.0 * time_constant,
            "{} {time_constant}",
            first.time
        );
        // Another loss is what it is, or what a loss of its own does.
        assert_ne!(last.verdict, Verdict::Unexplained, "{last:?}");
        assert!(last.effects.contains(&"step(k)".to_string()), "{last:?}");
        assert!(last.evidence.unwrap() > 10.0);
        let since = last.since.unwrap();
        assert!((since - onset).abs() < 0.25 * time_constant, "{since}");
    }
}

/// Of two sensors, the one with an offset is named, with its size.
#[test]
fn the_sensor_that_is_off_is_named() {
    let mut plant = Plant::heaters(3200, 61);
    for e in &mut plant.noise[1][2500..] {
        *e += 1.2;
    }
    let mut monitor = monitor(&plant.model);
    let steps = all(&mut monitor, &plant.run());
    let alarms = alarms(&steps);
    let last = alarms.last().unwrap();
    assert_eq!(last.effects[0], "offset(y2)", "{last:?}");
    let size = last.size.as_ref().unwrap();
    assert_eq!((size.name.as_str(), size.unit.as_str()), ("error", "degC"));
    assert!((size.value - 1.2).abs() < 0.2, "{size:?}");
    // A reading with occasional positive errors is no effect of the catalogue.
    let mut rows = plant.run();
    for (k, row) in rows.iter_mut().enumerate().skip(2400) {
        row.outputs[0] += if k / 40 % 2 == 0 { 3.0 } else { -3.0 };
    }
    let mut monitor = self::monitor(&plant.model);
    let steps = all(&mut monitor, &rows[..3000]);
    let alarms = self::alarms(&steps);
    let last = alarms.last().unwrap();
    assert_eq!(last.verdict, Verdict::Unexplained, "{last:?}");
}

/// The learned model does not change; the tracker follows the parameter to its new value.
#[test]
fn the_tracker_follows_a_parameter_that_has_changed() {
    let mut plant = Plant::heaters(6000, 31);
    let mut later = HEATERS_TRUE.to_vec();
    later[4] = 0.54;
    plant.parameters.push((2500, later));
    let mut monitor = monitor(&plant.model);
    let steps = all(&mut monitor, &plant.run());
    let alarms = alarms(&steps);
    assert_eq!(alarms[0].output.as_deref(), Some("y1"));
    let heater = &monitor.estimates()[3];
    assert_eq!(heater.name, "g1");
    assert!((heater.learned - 0.6).abs() < 0.01, "{heater:?}");
    assert!((heater.value - 0.54).abs() < 0.01, "{heater:?}");
}

/// Readings of two outputs are missing, at random and in bursts: this causes no alarm, and a change is still detected.
#[test]
fn several_outputs_may_lack_readings() {
    let mut plant = Plant::heaters(5000, 41);
    let mut later = HEATERS_TRUE.to_vec();
    later[3] = 0.6;
    plant.parameters.push((4000, later));
    let mut rows = plant.run();
    for (k, row) in rows.iter_mut().enumerate() {
        if k % 7 == 3 || k % 400 < 20 {
            row.outputs[0] = f64::NAN;
        }
        if k % 5 == 1 {
            row.outputs[1] = f64::NAN;
        }
    }
    let mut monitor = monitor(&plant.model);
    let steps = all(&mut monitor, &rows[..4000]);
    assert!(alarms(&steps).is_empty());
    assert!(steps[403].innovations[0].is_none() && steps[403].lost[0].is_some());
    assert!(held(&monitor, &HEATERS_TRUE[1..]) >= 3);
    let noise = steps.iter().flat_map(|s| s.notices.iter().flatten());
    let learned = noise.into_iter().find_map(|notice| match notice {
        Notice::Learned { noise, .. } => Some(noise.clone()),
        _ => None,
    });
    let noise = learned.unwrap();
    assert!((noise[0] / 0.1 - 1.0).abs() < 0.15 && (noise[1] / 0.8 - 1.0).abs() < 0.15);
    let steps = all(&mut monitor, &rows[4000..]);
    let alarms = alarms(&steps);
    let (onset, time_constant) = (4000.0 * plant.interval, monitor.time_constant().unwrap());
    assert!(
        alarms[0].time < onset + 3.0 * time_constant,
        "{}",
        alarms[0].time
    );
    let since = alarms.last().unwrap().since.unwrap();
    assert!((since - onset).abs() < time_constant, "{since}");
}

#[test]
fn a_saved_state_goes_on_as_if_nothing_had_happened() {
    let mut plant = Plant::heaters(5000, 51);
    let mut later = HEATERS_TRUE.to_vec();
    later[1] = 0.4;
    plant.parameters.push((3000, later));
    let rows = plant.run();
    let words = |steps: &[RowResult]| format!("{steps:?}");
    let whole = all(&mut monitor(&plant.model), &rows);
    for at in [500, 1500, 3020, 4500] {
        let mut first = monitor(&plant.model);
        all(&mut first, &rows[..at]);
        let text = serde_json::to_string(&first.state()).unwrap();
        let state: State = serde_json::from_str(&text).unwrap();
        let own = OwnModel::new(plant.model.clone());
        let mut second = Monitor::restore(own, Settings::default(), state).unwrap();
        assert_eq!(words(&all(&mut second, &rows[at..])), words(&whole[at..]));
    }
    // Another text makes another model.
    let state = monitor(&plant.model).state();
    let other = model(
        &HEATERS
            .replace("20*(T1", "21*(T1")
            .replace("h*(T1", "2*h*(T1"),
    );
    let refused = Monitor::restore(OwnModel::new(other), Settings::default(), state);
    assert!(matches!(refused, Err(Error::OtherModel { .. })));
}

/// The model's time is that of the column: rates per hour, rows in seconds.
#[test]
fn the_models_time_may_be_in_hours() {
    let plant = Plant::block(1500, 61);
    let hours = model(&BLOCK.replace("C*der(T)", "C/3600*der(T)"));
    let run = |own: OwnModel| {
        let mut monitor = Monitor::new(own, Settings::default(), Units::default()).unwrap();
        all(&mut monitor, &plant.run());
        (monitor.time_constant().unwrap(), monitor.estimates())
    };
    let seconds = run(own(&plant.model));
    let own = OwnModel {
        time_unit: 3600.0,
        ..own(&hours)
    };
    let (time_constant, estimates) = run(own);
    assert!((time_constant / seconds.0 - 1.0).abs() < 1e-3);
    for (a, b) in estimates.iter().zip(&seconds.1) {
        assert!((a.value / b.value - 1.0).abs() < 1e-2, "{a:?} {b:?}");
    }
}

/// Delays and branches have a past and events: the simulation is rebuilt every 2048 rows without a visible effect.
#[test]
fn delays_and_branches_are_watched_as_well() {
    let text = r#"
model Delayed
  parameter Real tau(min=0) = 20;
  parameter Real K = 1;
  parameter Real d(min=0, max=30) = 6;
  parameter Real top = 40;
  input Real u;
  output Real y = x;
  Real x(start=0);
  Real pushed = min(delay(u, d), top);
equation
  tau*der(x) = K*pushed - x;
end Delayed;
"#;
    let rng = &mut ChaCha8Rng::seed_from_u64(71);
    let mut plant = Plant {
        model: model(text),
        parameters: vec![(0, vec![30.0, 0.8, 9.0, 45.0])],
        inputs: vec![excitation::steps(7000, 10..=60, 0.0, 60.0, rng).unwrap()],
        noise: vec![noise::white(7000, 0.3, rng)],
        interval: 2.0,
    };
    plant.parameters.push((5500, vec![30.0, 0.8, 13.0, 45.0]));
    let mut monitor = monitor(&plant.model);
    let rows = plant.run();
    let steps = all(&mut monitor, &rows[..5500]);
    assert!(alarms(&steps).is_empty());
    assert!(
        held(&monitor, &[30.0, 0.8, 9.0, 45.0]) >= 3,
        "{:?}",
        monitor.estimates()
    );
    let steps = all(&mut monitor, &rows[5500..]);
    assert!(!alarms(&steps).is_empty());
}

#[test]
fn what_cannot_be_watched_is_said() {
    let of = |text: &str| {
        let model = model(text);
        Monitor::new(OwnModel::new(model), Settings::default(), Units::default()).err()
    };
    let timed = BLOCK.replace("- loss;", "- loss + sin(time);");
    assert!(matches!(of(&timed), Some(Error::Time)));
    let known = BLOCK.replace("  parameter", "  final parameter");
    assert!(matches!(of(&known), Some(Error::NoParameters)));
    // A store without a loss never settles.
    let text = "model Store\n parameter Real g = 1;\n input Real u;\n output Real y = x;\n Real x(start=0);\nequation\n der(x) = g*u;\nend Store;\n";
    let store = model(text);
    let mut monitor = monitor(&store);
    let rng = &mut ChaCha8Rng::seed_from_u64(81);
    let (u, noise) = (
        excitation::steps(1000, 5..=20, -1.0, 1.0, rng).unwrap(),
        noise::white(1000, 0.1, rng),
    );
    let mut x = 0.0;
    let mut said = Vec::new();
    for k in 0..1000 {
        let step = monitor
            .update(&Row::new(k as f64, u[k], &[x + noise[k]]))
            .unwrap();
        said.extend(step.notices.into_iter().flatten());
        x += u[k];
    }
    assert!(
        matches!(&said[..], [Notice::NotLearned { why }] if why.contains("does not settle")),
        "{said:?}"
    );
    // A missing input rejects the row, and the message names the input.
    let block = model(BLOCK);
    let mut of_block = self::monitor(&block);
    let refused = of_block
        .update(&Row::with_inputs(0.0, &[1.0], &[20.0]))
        .unwrap_err();
    assert_eq!((refused.column(), refused.at()), ("input", 1));
    // All four parameters of the block have one scale in common.
    let plant = Plant::block(1000, 91);
    let unknown = OwnModel::new(plant.model.clone());
    let mut monitor = Monitor::new(unknown, Settings::default(), Units::default()).unwrap();
    let steps = all(&mut monitor, &plant.run());
    let mut said = steps.iter().flat_map(|step| step.notices.iter().flatten());
    assert!(
        said.any(|notice| matches!(notice, Notice::NotLearned { why } if why.contains("fix ")))
    );
}
