//! Pairs that may be drawn, readings that are rounded, stamps with jitter.

use super::*;

fn paired(one: &str, other: &str) -> bool {
    let find = |id| EffectInfo::find(id).unwrap();
    may_pair(find(one), find(other))
}

#[test]
fn twins_and_two_that_follow_the_clock_make_no_pair() {
    assert!(paired("pump_deadzone", "overflow"));
    assert!(paired("sensor_drift", "overflow"));
    assert!(!paired("pump_lag", "sensor_lag"));
    assert!(!paired("const_leak", "sensor_offset"));
    assert!(!paired("valve_step", "sensor_drift"));
    assert!(!paired("overflow", "const_leak"));
}

#[test]
fn a_converter_rounds_the_reading_with_its_noise() {
    let effect = EffectInfo::find("coarse_quantisation").unwrap();
    let rig = with_effect(effect, Levels::Last, 1.0, Drive::Open, 0.0, 300, 1).unwrap();
    assert!((rig.converter / rig.noise - 12.0_f64.sqrt()).abs() < 1e-12);
    let record = rig.run(&mut ChaCha8Rng::seed_from_u64(1));
    for y in &record.outputs[0].values {
        let steps = y / rig.converter;
        assert!((steps - steps.round()).abs() < 1e-9);
    }
}

#[test]
fn stamps_jitter_and_increase() {
    let rig = Rig {
        jitter: 0.03,
        walk: 0.05,
        ..Rig::single_tank()
    };
    let record = rig.run(&mut ChaCha8Rng::seed_from_u64(1));
    record.validate().unwrap();
    let most = record
        .time
        .iter()
        .enumerate()
        .map(|(k, t)| (t / rig.interval - k as f64).abs())
        .fold(0.0, f64::max);
    assert!(most > 0.02 && most <= 0.03 + 1e-9);
}
