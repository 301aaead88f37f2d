//! A record that begins away from rest: a lag remembers what came before, and only a fit that asks for its state
//! names the right lag.

use std::collections::BTreeMap;

use crate::support::{PRECISE, Rig};
use ct_signals::{Record, noise};
use greybox::{Fit, Noise, Setup, fit_from};
use plants::{EffectInfo, Placed};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Samples before the record begins.
const BEFORE: usize = 90;
const LAGS: [&str; 2] = ["pump_lag", "sensor_lag"];

/// A record whose beginning was not kept.
fn cut(mut record: Record) -> Record {
    record.time.drain(..BEFORE);
    record.inputs[0].values.drain(..BEFORE);
    record.outputs[0].values.drain(..BEFORE);
    record
}

/// The best fit with one of the lags, its state free or at rest.
fn with_lag(rig: &Rig, record: &Record, lag: &str, free: bool) -> Fit {
    let effect = EffectInfo::find(lag).unwrap();
    let fixed = if free {
        BTreeMap::new()
    } else {
        BTreeMap::from([(format!("{lag}.before"), 0.0)])
    };
    let records = std::slice::from_ref(record);
    let placed = [Placed { effect, vessel: 0 }];
    let setup = Setup::from_records(rig.plant, rig.known(), &placed, records, fixed).unwrap();
    let starts: Vec<Vec<f64>> = [1.0, 3.0]
        .into_iter()
        .flat_map(|upper| [4.0, 20.0].map(|lag| (upper, lag)))
        .map(|(upper, lag)| {
            let mut start = rig.theta.clone();
            start.push(lag);
            start.extend(&rig.levels[..rig.levels.len() - 1]);
            let last = start.len() - 1;
            if rig.levels.len() > 1 {
                start[last] *= upper;
            }
            start.extend([record.outputs[0].values[0], 0.0]);
            start
        })
        .collect();
    fit_from(&setup, &starts, &Noise::white(1), PRECISE).unwrap()
}

/// How often the true lag fits better than the other one, and how often it fits so much worse that the other one is named alone (criterion
/// higher by 6).
fn right_and_wrong(rig: &Rig, lag: usize, time_constant: f64, free: bool) -> (usize, usize) {
    let mut rig = rig.clone();
    rig.effects = vec![(LAGS[lag], 0, vec![time_constant])];
    rig.interval = 2.0;
    rig.samples += BEFORE;
    let behind: Vec<f64> = (0..SEEDS)
        .into_par_iter()
        .map(|seed| {
            let record = cut(rig.record(seed));
            let [own, other] = [lag, 1 - lag].map(|i| with_lag(&rig, &record, LAGS[i], free));
            own.bic() - other.bic()
        })
        .collect();
    let count = |holds: &dyn Fn(f64) -> bool| behind.iter().filter(|&&b| holds(b)).count();
    (count(&|b| b < 0.0), count(&|b| b > 6.0))
}

const SEEDS: u64 = 30;

#[test]
fn the_lag_that_is_there_fits_better_than_the_other() {
    for rig in [Rig::single_tank(), Rig::cascaded_tanks()] {
        let two = rig.plant.vessels() > 1;
        for (lag, id) in LAGS.iter().enumerate() {
            for time_constant in [8.0, 15.0] {
                let [rest, free] =
                    [false, true].map(|free| right_and_wrong(&rig, lag, time_constant, free));
                println!(
                    "{} {id} {time_constant} s: right and decidedly wrong of {SEEDS}: {rest:?} at rest, {free:?} free",
                    rig.plant.id()
                );
                // With one tank, the nonlinearity is too small to distinguish the order of the two lags in most records; a decided error
                // must not occur. By chance 25 successes occur once in five thousand.
                assert!(free.1 <= 1, "{id} {time_constant}: {free:?}");
                assert!(!two || free.0 >= 25, "{id} {time_constant}: {free:?}");
                // With the lag at rest, one of the two fits the unknown past better.
                assert!(lag == 0 || rest.1 > 5, "{id} {time_constant}: {rest:?}");
            }
        }
    }
}

/// The state after the lag is then that of a pump at rest, which no command of the record is.
#[test]
fn a_pump_that_starts_with_the_record_is_a_lag() {
    for rig in [Rig::single_tank(), Rig::cascaded_tanks()] {
        for time_constant in [6.0, 15.0] {
            let rig = Rig {
                effects: vec![(LAGS[0], 0, vec![time_constant])],
                interval: 2.0,
                samples: rig.samples + BEFORE,
                ..rig.clone()
            };
            let found: Vec<(f64, f64)> = (0..SEEDS)
                .into_par_iter()
                .map(|seed| {
                    let mut rng = ChaCha8Rng::seed_from_u64(seed);
                    let mut u = rig.record(seed).inputs.swap_remove(0).values;
                    u[BEFORE - 45..BEFORE].fill(0.0);
                    let record = cut(rig.run(&u, &noise::white(rig.samples, rig.noise, &mut rng)));
                    let [own, other] = LAGS.map(|lag| with_lag(&rig, &record, lag, true));
                    let at = rig.theta.len();
                    let error = own.std_errors()[at].unwrap();
                    ((own.x[at] - time_constant) / error, own.bic() - other.bic())
                })
                .collect();
            let wrong = found.iter().filter(|(_, behind)| *behind > 6.0).count();
            let off = found.iter().filter(|(off, _)| off.abs() > 2.0).count();
            println!(
                "{} {time_constant} s: decidedly wrong {wrong}, off by two standard errors {off} of {SEEDS}",
                rig.plant.id()
            );
            assert!(wrong <= 1 && off <= 5, "{time_constant} s: {found:?}");
        }
    }
}
