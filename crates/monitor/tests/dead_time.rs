//! A believed model that remembers: what came before the onset that is looked for is on its way yet.
#![allow(clippy::unwrap_used)]

use ct_signals::{Hold, excitation, noise};
use monitor::{Alarm, Model, Monitor, Row, Settings, Stage, Units};
use plants::{Command, EffectInfo, Known, Placed, Plant, Scales, Simulator, Structure};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

/// Pump gain, outflow coefficient, dead time \[s\].
const THETA: [f64; 3] = [10.0, 12.5, 30.0];

/// A jump of the command is on its way through the dead time while the leak begins.
#[test]
fn a_leak_behind_a_dead_time_is_named_and_measured() {
    let known = Known {
        area: [Some(154.0), None, None],
        input_range: Some(10.0),
        ..Known::default()
    };
    let placed = |id| Placed {
        effect: EffectInfo::find(id).unwrap(),
        vessel: 0,
    };
    let rng = &mut ChaCha8Rng::seed_from_u64(9);
    let (count, onset, leak) = (1900, 1500, 1.5);
    let mut command = excitation::steps(count, 15..=60, 3.5, 6.5, rng).unwrap();
    for (k, u) in command[onset - 400..].iter_mut().enumerate() {
        *u = if (k / 20).is_multiple_of(2) { 3.5 } else { 6.5 };
    }
    let noise = noise::white(count, 0.05, rng);
    let scales = Scales::from_ranges((3.5, 6.5), (8.0, 27.0), 2.0, 2.0 * count as f64);
    let structure = Structure::new(Plant::SingleTank, known.clone(), scales)
        .with(placed("transport_delay"))
        .unwrap();
    let mut tank = Simulator::<f64>::new(&structure, &THETA, &[16.0], 5.0).unwrap();
    let model = Model {
        plant: Plant::SingleTank,
        known,
        effects: vec![placed("transport_delay")],
        terms: Vec::new(),
        start: Default::default(),
        fixed: Vec::new(),
        hold: Hold::Zero,
    };
    let mut monitor = Monitor::new(model, Settings::default(), Units::default()).unwrap();
    let mut alarms: Vec<Alarm> = Vec::new();
    let mut lost = 0.0;
    for k in 0..count {
        let row = Row {
            time: 2.0 * k as f64,
            input: command[k],
            output: tank.read() - lost + noise[k],
        };
        alarms.extend(monitor.update(&row).unwrap().alarm);
        tank.advance(Command::held(command[k]), 2.0);
        // By how much the leak has lowered the level: about the operating point its time constant is 100 s.
        if k >= onset {
            lost += 2.0 * (leak / 154.0 - lost / 100.0);
        }
    }
    let first = alarms.first().unwrap();
    assert!((3000.0..3200.0).contains(&first.time), "{first:?}");
    for alarm in &alarms {
        assert!(alarm.effects.iter().any(|e| e == "const_leak"), "{alarm:?}");
        assert!((alarm.since.unwrap() - 3000.0).abs() < 100.0, "{alarm:?}");
        assert_ne!(alarm.event, Stage::Final);
    }
}
