//! The controller around the simulator.
#![allow(clippy::expect_used)]

use crate::support::{base, effect};
use plants::{Command, Plant, Simulator, controller::Pi};

/// Gain \[input/output\] and integral time \[s\] that suit the plants of `support`.
fn controller() -> Pi {
    Pi::new(0.4, 60.0, (0.0, 10.0), 4.7).expect("settings that can work")
}

#[test]
fn the_loop_reaches_its_set_point() {
    for plant in Plant::ALL {
        for effects in [
            vec![],
            vec!["pump_lag", "sensor_lag"],
            vec!["transport_delay", "pump_deadzone"],
        ] {
            let placed: Vec<_> = effects
                .iter()
                .map(|id| plants::Placed {
                    effect: effect(id),
                    vessel: 0,
                })
                .collect();
            let case = base(plant).with_interior(&placed);
            let mut simulator =
                Simulator::<f64>::new(&case.structure, &case.theta, &case.levels, case.at_rest)
                    .expect("counts");
            let mut pi = controller();
            for reference in [12.0, 9.0] {
                let mut overshoot = 0.0_f64;
                let mut y = f64::NAN;
                // Joined tanks are slow for their sampling interval.
                let samples = if plant.joined() { 12_000 } else { 3000 };
                for _ in 0..samples {
                    y = simulator.read(0);
                    overshoot = overshoot.max((y - reference) * (reference - 10.5).signum());
                    let u = pi.command(reference, y, case.h);
                    assert!((0.0..=10.0).contains(&u));
                    simulator.advance(Command::held(u), case.h);
                }
                assert!(
                    (y - reference).abs() < 1e-6,
                    "{} {effects:?}: {y} instead of {reference}",
                    plant.id()
                );
                assert!(
                    overshoot < 3.0,
                    "{} {effects:?}: overshoot {overshoot}",
                    plant.id()
                );
            }
        }
    }
}

#[test]
fn out_of_reach_the_command_stays_at_its_limit_and_comes_back_at_once() {
    let case = base(Plant::SingleTank);
    let mut simulator =
        Simulator::<f64>::new(&case.structure, &case.theta, &case.levels, case.at_rest)
            .expect("counts");
    let mut pi = controller();
    let mut last = 0.0;
    for _ in 0..2000 {
        last = pi.command(100.0, simulator.read(0), case.h);
        simulator.advance(Command::held(last), case.h);
    }
    assert_eq!(last, 10.0);
    // After saturation, the command leaves its limit within one sample.
    let y = simulator.read(0);
    assert!(pi.command(y - 2.0, y, case.h) < 10.0);
}
