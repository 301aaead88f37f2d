//! A measured disturbance: its gain is found with the plant's own parameters.

use std::collections::BTreeMap;

use crate::support::Rig;
use ct_signals::{Channel, Hold, Record, excitation, noise};
use greybox::{FitOptions, Setup, fit};
use plants::{Command, Known, Plant, Scales, Simulator, Structure};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A rig with a disturbance into a vessel, and its gain.
struct Disturbed {
    rig: Rig,
    vessel: usize,
    gain: f64,
    hold: Hold,
}

impl Disturbed {
    fn known(&self) -> Known {
        Known {
            disturbance: Some(self.vessel),
            ..self.rig.known()
        }
    }

    /// Parameters, then the initial levels.
    fn truth(&self) -> Vec<f64> {
        let own = self.rig.theta.iter().copied();
        let all = own.chain([self.gain]);
        all.chain(self.rig.levels.iter().copied()).collect()
    }

    /// Under random steps of the command, and a disturbance in l/min that steps, or drifts with a straight course between samples.
    fn record(&self, seed: u64) -> Record {
        let rig = &self.rig;
        let (n, h) = (rig.samples, rig.interval);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (low, high) = rig.command;
        let u = excitation::steps(n, 10..=40, low, high, &mut rng).unwrap();
        let d = match self.hold {
            Hold::Zero => excitation::steps(n, 15..=50, 1.0, 4.0, &mut rng).unwrap(),
            Hold::First => {
                let noise = noise::ar1(n, 0.8, 0.95, &mut rng);
                noise.iter().map(|e| 2.5 + e).collect()
            }
        };
        let mut scales = Scales::from_ranges(rig.command, (5.0, 25.0), h, h * n as f64);
        scales.input_2 = Some((1.0, 4.0));
        let structure = Structure::new(rig.plant, self.known(), scales);
        let theta = &self.truth()[..rig.theta.len() + 1];
        let mut simulator =
            Simulator::with_inputs(&structure, theta, &rig.levels, [u[0], d[0]]).unwrap();
        let mut y = noise::white(n, rig.noise, &mut rng);
        for k in 0..n {
            y[k] += simulator.read(0);
            if k + 1 < n {
                let disturbance = match self.hold {
                    Hold::Zero => Command::held(d[k]),
                    Hold::First => Command::ramp(d[k], d[k + 1]),
                };
                simulator.advance_both([Command::held(u[k]), disturbance], h);
            }
        }
        Record {
            name: "disturbed".into(),
            time: (0..n).map(|k| k as f64 * h).collect(),
            inputs: vec![
                Channel::new("u", "V", u),
                Channel::new("d", "l/min", d).with_hold(self.hold),
            ],
            outputs: vec![Channel::new("y", "cm", y)],
            ..Record::default()
        }
    }

    /// Fits from random starts and compares all parameters and initial levels with the truth.
    fn check(&self) {
        for seed in [3, 4] {
            let records = [self.record(seed)];
            let setup =
                Setup::from_records(self.rig.plant, self.known(), &[], &records, BTreeMap::new())
                    .unwrap();
            let own = self.rig.theta.len();
            assert_eq!(setup.names()[own], "disturbance_gain");
            let fit = fit(&setup, &FitOptions::default()).unwrap();
            println!("{} of {} starts agree", fit.agree, fit.starts);
            assert!(fit.agree >= 2, "{} of {}", fit.agree, fit.starts);
            let half = fit.half_widths(0.9999);
            for (i, (x, truth)) in fit.x.iter().zip(self.truth()).enumerate() {
                let half = half[i].unwrap();
                println!("{} {x:.4} +- {half:.4}, is {truth}", setup.names()[i]);
                assert!((x - truth).abs() < half, "{}", setup.names()[i]);
            }
            let gain = half[own].unwrap();
            assert!(gain < 0.2 * self.gain.abs(), "the gain is known: {gain}");
            // The throughput consists of both inflows.
            let scales = setup.scales_at(&fit.x).unwrap();
            let mean = |input: usize| {
                let values = &records[0].inputs[input].values;
                values.iter().sum::<f64>() / values.len() as f64
            };
            let flow = fit.x[0].abs() * mean(0) + fit.x[own].abs() * mean(1);
            assert!((scales.flow - flow).abs() < 1e-9 * flow);
            assert_eq!(scales.input_range, 10.0);
        }
    }
}

#[test]
fn a_single_tank_with_a_disturbance_is_found() {
    // The disturbance flows in, or out.
    for (gain, hold) in [(8.0, Hold::Zero), (-6.0, Hold::First)] {
        let rig = Rig::single_tank();
        Disturbed {
            rig,
            vessel: 0,
            gain,
            hold,
        }
        .check();
    }
}

#[test]
fn cascaded_tanks_with_a_disturbance_are_found() {
    for (vessel, hold) in [(0, Hold::First), (1, Hold::Zero)] {
        let rig = Rig::cascaded_tanks();
        Disturbed {
            rig,
            vessel,
            gain: 8.0,
            hold,
        }
        .check();
    }
}

#[test]
fn linear_plants_with_a_disturbance_are_found() {
    for rig in Rig::all() {
        if !matches!(rig.plant, Plant::SingleTankLinear | Plant::FirstOrder) {
            continue;
        }
        Disturbed {
            rig,
            vessel: 0,
            gain: -1.5,
            hold: Hold::Zero,
        }
        .check();
    }
}
