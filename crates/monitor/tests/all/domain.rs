//! Effects at a plant that is no tank do not have the names of tank effects.

use ct_signals::{excitation, noise};
use monitor::{Model, Monitor, Row, Settings, Units};
use plants::{Domain, EffectInfo, Known, Plant};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

/// A heated block whose heater cuts out at 60 from 4000 s on: `tau dT/dt = K u - T`.
fn heated_block() -> Vec<Row> {
    const ROWS: usize = 3000;
    let rng = &mut ChaCha8Rng::seed_from_u64(3);
    let power = excitation::steps(ROWS, 20..=100, 20.0, 40.0, rng).unwrap();
    let noise = noise::white(ROWS, 0.1, rng);
    let mut temperature = 60.0;
    (0..ROWS)
        .map(|k| {
            let time = 2.0 * k as f64;
            let row = Row::new(time, power[k], &[temperature + noise[k]]);
            for _ in 0..200 {
                let on = time < 4000.0 || temperature < 60.0;
                let heater = if on { power[k] } else { 0.0 };
                temperature += 0.01 * (2.0 * heater - temperature) / 60.0;
            }
            row
        })
        .collect()
}

/// The effects that the alarms of a monitor name, in an output of this unit.
fn named(unit: &str) -> Vec<String> {
    let units = Units {
        output: unit.into(),
        input: "%".into(),
    };
    let model = Model::new(Plant::FirstOrder, Known::default());
    let mut monitor = Monitor::new(model, Settings::default(), units).unwrap();
    let rows = heated_block();
    let alarms = rows
        .iter()
        .filter_map(|row| monitor.update(row).unwrap().alarm);
    alarms
        .flat_map(|alarm| {
            let next = alarm.next.map(|next| next.effect);
            alarm.effects.into_iter().chain(next)
        })
        .collect()
}

#[test]
fn effects_of_tanks_are_named_in_the_domain_of_tanks_alone() {
    let general = named("degC");
    assert!(!general.is_empty());
    for id in &general {
        assert!(
            Domain::General.offers(EffectInfo::find(id).unwrap()),
            "{id}"
        );
    }
    assert!(named("cm").iter().any(|id| id == "overflow"));
}
