//! Closed-loop data: fed-back noise, sampled controllers, converters.

use crate::support::drive;
use ct_lti::Hold;
use fcloe::{
    Controller, Noise, PlantModel, Quantiser, continuous_loop, noise_at_snr, sampled_loop,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn plant() -> PlantModel {
    PlantModel::new(&[210.0, 9000.0], &[5.0, 40.0]).unwrap()
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

/// In the loop a disturbance of the reading acts like the negative reference, except on the reading itself.
#[test]
fn noise_in_the_loop_circulates() {
    let controller = Controller::pid(0.3, 0.004, 4.0, 10.0).unwrap();
    let (r, w) = (drive(400), drive(700)[300..].to_vec());
    let run = |r: &[f64], noise| {
        continuous_loop(&plant(), &controller, 2.0, r, Hold::Zero, noise).unwrap()
    };
    let noisy = run(&r, Noise::InLoop(&w));
    let less: Vec<f64> = r.iter().zip(&w).map(|(r, w)| r - w).collect();
    let moved = run(&less, Noise::None);
    let y: Vec<f64> = moved.y.iter().zip(&w).map(|(y, w)| y + w).collect();
    assert!(largest(&noisy.y, &y) < 1e-12);
    assert!(largest(&noisy.u, &moved.u) < 1e-12);
    // With output noise alone, u does not depend on the noise.
    assert_eq!(run(&r, Noise::OnRecord(&w)).u, run(&r, Noise::None).u);
    assert!(
        continuous_loop(
            &plant(),
            &controller,
            2.0,
            &r,
            Hold::Zero,
            Noise::InLoop(&w[1..])
        )
        .is_err()
    );
}

/// The faster the controller runs, the nearer its loop is to the continuous one, in the first order of its period.
#[test]
fn a_fast_sampled_controller_is_the_continuous_one() {
    let r = drive(200);
    for controller in [
        Controller::pi(0.3, 0.004).unwrap(),
        Controller::pid(0.3, 0.004, 4.0, 10.0).unwrap(),
        Controller::pi(0.3, 0.004)
            .unwrap()
            .with_sensor_filter(0.2)
            .unwrap(),
    ] {
        let exact =
            continuous_loop(&plant(), &controller, 4.0, &r, Hold::Zero, Noise::None).unwrap();
        let error = |periods| {
            let data =
                sampled_loop(&plant(), &controller, 4.0, periods, &r, Noise::None, None).unwrap();
            largest(&data.y, &exact.y)
        };
        let (slow, fast) = (error(40), error(160));
        assert!(
            fast < 1e-3 && (3.5..4.5).contains(&(slow / fast)),
            "{slow:.1e} {fast:.1e}"
        );
    }
}

#[test]
fn a_sampled_loop_may_be_unstable() {
    let hot = Controller::pi(60.0, 1.0).unwrap();
    let fast = PlantModel::new(&[2.0], &[1.0]).unwrap();
    continuous_loop(&fast, &hot, 1.0, &drive(3000), Hold::Zero, Noise::None).unwrap();
    let error = sampled_loop(&fast, &hot, 1.0, 1, &drive(3000), Noise::None, None).unwrap_err();
    assert!(error.to_string().contains("every 1"), "{error}");
    let unstable = Controller::pi(-0.3, -0.01).unwrap();
    assert!(continuous_loop(&plant(), &unstable, 1.0, &drive(9), Hold::Zero, Noise::None).is_err());
}

#[test]
fn noise_has_the_power_asked_for() {
    let signal: Vec<f64> = drive(50_000).iter().map(|r| 20.0 + r).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let w = noise_at_snr(&signal, 20.0, &mut rng).unwrap();
    let power = |v: &[f64]| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        v.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
    };
    assert!((power(&w) / power(&signal) / 0.01 - 1.0).abs() < 0.03);
    assert!(noise_at_snr(&signal, f64::NAN, &mut rng).is_err());
}

#[test]
fn converters_round_and_saturate() {
    let converter = Quantiser::new(-10.0, 10.0, 3).unwrap();
    for (value, level) in [
        (-99.0, -10.0),
        (99.0, 10.0),
        (0.1, 10.0 / 7.0),
        (-1.4, -10.0 / 7.0),
    ] {
        assert!((converter.value(value) - level).abs() < 1e-14);
    }
    assert!(Quantiser::new(1.0, 1.0, 8).is_err() && Quantiser::new(0.0, 1.0, 0).is_err());
    let r = drive(300);
    let controller = Controller::pi(0.3, 0.004).unwrap();
    let converter = Quantiser::new(-10.0, 10.0, 16).unwrap();
    let run = |quantiser| {
        sampled_loop(&plant(), &controller, 2.0, 2, &r, Noise::None, quantiser).unwrap()
    };
    let (coarse, fine) = (run(Some(&converter)), run(None));
    let level = 20.0 / 65535.0;
    let error = largest(&coarse.y, &fine.y);
    assert!(error > 0.0 && error < 5.0 * level, "{error:.1e}");
    assert!(
        coarse
            .y
            .iter()
            .all(|y| (converter.value(*y) - y).abs() < 1e-12)
    );
}
