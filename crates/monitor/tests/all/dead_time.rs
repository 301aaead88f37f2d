//! A believed model with dead time: commands from before the onset still have an effect after it.

use ct_signals::{excitation, noise};
use monitor::{Alarm, Model, Monitor, Row, Settings, Units};
use plants::{EffectInfo, Known, Placed, Plant};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

/// Dead time \[rows\].
const DELAY: usize = 15;

/// A step of the command is delayed by the dead time while the leak begins.
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
    let (count, onset, leak) = (1900, 1500, 0.5);
    let mut command = excitation::steps(count, 15..=60, 3.5, 6.5, rng).unwrap();
    for (k, u) in command[onset - 400..].iter_mut().enumerate() {
        *u = if (k / 20).is_multiple_of(2) { 3.5 } else { 6.5 };
    }
    let noise = noise::white(count, 0.05, rng);
    let model = Model {
        effects: vec![placed("transport_delay")],
        ..Model::new(Plant::SingleTank, known)
    };
    let mut monitor = Monitor::new(model, Settings::default(), Units::default()).unwrap();
    let mut alarms: Vec<Alarm> = Vec::new();
    let mut level = 16.0_f64;
    for k in 0..count {
        let row = Row::new(2.0 * k as f64, command[k], &[level + noise[k]]);
        alarms.extend(monitor.update(&row).unwrap().alarm);
        let (u, lost) = (
            command[k.saturating_sub(DELAY)],
            if k < onset { 0.0 } else { leak },
        );
        for _ in 0..20 {
            let rate = |level: f64| (10.0 * u - 12.5 * level.sqrt() - lost) / 154.0;
            level += 0.1 * rate(level + 0.05 * rate(level));
        }
    }
    let first = alarms.first().unwrap();
    assert!((3000.0..3200.0).contains(&first.time), "{first:?}");
    // With the first rows the onset is uncertain; with more rows it is accurate.
    let last = alarms.last().unwrap();
    assert!(alarms.len() > 3);
    assert!(last.effects.iter().any(|e| e == "const_leak"), "{last:?}");
    assert!((last.since.unwrap() - 3000.0).abs() < 60.0, "{last:?}");
}
