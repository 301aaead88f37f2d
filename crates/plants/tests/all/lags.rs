//! Lags and dead times where they vanish, where they are long, and where they meet the samples.

use crate::support::{Case, DRIVES, base, difference, effect, input, reference};
use plants::{Command, Dual, Placed, Plant};

fn with(plant: Plant, effects: &[(&str, f64)]) -> Case {
    let placed: Vec<Placed> = effects
        .iter()
        .map(|&(id, _)| Placed {
            effect: effect(id),
            vessel: 0,
        })
        .collect();
    base(plant).with(&placed, |_, placed, _| {
        let own = effects.iter().find(|(id, _)| *id == placed.effect.id);
        own.map_or(f64::NAN, |(_, value)| *value)
    })
}

/// Values and derivatives by one parameter.
fn derivative(
    case: &Case,
    lane: usize,
    input: &[(Command, f64)],
    substeps: usize,
) -> (Vec<f64>, Vec<f64>) {
    let dual: Vec<Dual<15>> = case.run_dual(input, substeps);
    dual.iter().map(|y| (y.re, y.eps[lane])).unzip()
}

/// Difference of values and derivatives between two sizes of one effect, as shares of the largest.
fn gap(plant: Plant, id: &str, a: f64, b: f64, input: &[(Command, f64)]) -> (f64, f64) {
    let lane = base(plant).theta.len();
    let (ya, da) = derivative(&with(plant, &[(id, a)]), lane, input, 1);
    let (yb, db) = derivative(&with(plant, &[(id, b)]), lane, input, 1);
    (difference(&ya, &yb), difference(&da, &db))
}

#[test]
fn a_lag_vanishes_smoothly() {
    for plant in Plant::ALL {
        for drive in DRIVES {
            let input = input(drive, 120, base(plant).h, 61);
            let h = base(plant).h;
            for id in ["pump_lag", "sensor_lag", "transport_delay"] {
                for t in [1e-9, 1e-6, 1e-4] {
                    let (values, derivatives) = gap(plant, id, t * h, 0.0, &input);
                    // The derivative with respect to the lag, times the lag, is the change; the derivative itself changes in proportion.
                    assert!(
                        values < 0.05 * t && derivatives < 60.0 * t,
                        "{} {id} {t}: {values:e} {derivatives:e}",
                        plant.id()
                    );
                }
            }
        }
    }
}

#[test]
fn a_lag_has_no_seam_where_its_formula_changes() {
    for plant in [Plant::CascadedTanks, Plant::FirstOrder] {
        for drive in DRIVES {
            let h = base(plant).h;
            let input = input(drive, 120, h, 62);
            for id in ["pump_lag", "sensor_lag"] {
                // At the values where the exponential is dropped, and where the series replaces the recursion.
                for t in [h / 700.0, 2.0 * h] {
                    let (values, derivatives) =
                        gap(plant, id, t * (1.0 - 1e-9), t * (1.0 + 1e-9), &input);
                    assert!(
                        values < 1e-9 && derivatives < 1e-7,
                        "{id} {t}: {values:e} {derivatives:e}"
                    );
                }
            }
        }
    }
}

/// Error of a lag near and below the sampling interval: it reaches a vessel as a parabola with the right three moments, of which the
/// Runge-Kutta method uses the third to (h/tau)^2 only. With one step per sample that is up to 5e-7 here.
fn lag_error(plant: Plant, lag_over_h: f64) -> f64 {
    if plant.outlet() == plants::Outlet::Torricelli && lag_over_h < 3.0 {
        6e-7
    } else {
        1e-7
    }
}

#[test]
fn a_lag_agrees_with_its_equation_whatever_its_length() {
    for plant in Plant::ALL {
        for drive in DRIVES {
            let h = base(plant).h;
            let input = input(drive, 150, h, 63);
            for id in ["pump_lag", "sensor_lag"] {
                for t in [0.01, 0.1, 1.0, 30.0, 1e3, 1e5] {
                    let case = with(plant, &[(id, t * h)]);
                    let reference = reference::run(&case, &input);
                    let (one, four) = (
                        difference(&case.run(&input, 1), &reference),
                        difference(&case.run(&input, 4), &reference),
                    );
                    println!("{one:8.1e} {four:8.1e} {} {id} {t} {drive:?}", plant.id());
                    assert!(
                        one < lag_error(plant, t),
                        "{} {id} {t} {drive:?}: {one:e}",
                        plant.id()
                    );
                    assert!(
                        four < 2e-8,
                        "{} {id} {t} {drive:?}: {four:e} in four steps",
                        plant.id()
                    );
                }
            }
        }
    }
}

#[test]
fn a_delay_agrees_with_its_equation_wherever_it_falls() {
    for plant in Plant::ALL {
        for drive in DRIVES {
            let h = base(plant).h;
            let input = input(drive, 150, h, 64);
            for d in [
                0.5,
                0.999_999_9,
                1.0,
                1.0 + 1e-15,
                2.0,
                2.5,
                3.0 - 1e-12,
                3.0 + 1e-9,
                10.7,
                13.0,
            ] {
                for lag in [None, Some(0.3), Some(25.0)] {
                    let mut effects = vec![("transport_delay", d * h)];
                    effects.extend(lag.map(|t| ("pump_lag", t * h)));
                    let case = with(plant, &effects);
                    let error = difference(&case.run(&input, 1), &reference::run(&case, &input));
                    println!("{error:8.1e} {} {d} {lag:?} {drive:?}", plant.id());
                    let most = lag_error(plant, lag.unwrap_or(1e3));
                    assert!(
                        error < most,
                        "{} {d} {lag:?} {drive:?}: {error:e}",
                        plant.id()
                    );
                }
            }
        }
    }
}

#[test]
fn the_derivative_by_a_delay_passes_whole_samples_without_a_jump() {
    // With one vessel the level has a corner where a step arrives, so that only two vessels in series are smooth there; a ramp has no step,
    // and is smooth with one.
    for (plant, drives) in [
        (Plant::CascadedTanks, &DRIVES[..]),
        (Plant::CascadedTanksLinear, &DRIVES[..]),
        (Plant::SingleTank, &DRIVES[2..]),
    ] {
        for &drive in drives {
            let h = base(plant).h;
            let lane = base(plant).theta.len();
            let input = input(drive, 150, h, 65);
            for k in [1.0, 2.0, 7.0] {
                for lag in [None, Some(0.7), Some(4.0)] {
                    let at = |d: f64, substeps: usize| {
                        let mut effects = vec![("transport_delay", d * h)];
                        effects.extend(lag.map(|t| ("pump_lag", t * h)));
                        derivative(&with(plant, &effects), lane, &input, substeps).1
                    };
                    let jump = |substeps: usize| {
                        let on = at(k, substeps);
                        difference(&at(k - 1e-9, substeps), &on)
                            .max(difference(&at(k + 1e-9, substeps), &on))
                    };
                    // The Runge-Kutta method cuts the steps elsewhere on either side, which changes its error: by (h/tau)^4/24 of the rate
                    // with steps, or by (h/tau)^2 for a lag below the sample.
                    let (most, fall) = match (plant.outlet(), lag) {
                        (plants::Outlet::Linear, None) => (1e-8, 1.0),
                        (plants::Outlet::Linear, _) => (1e-6, 0.1),
                        (_, None) => (1e-4, 0.01),
                        _ => (1e-3, 0.1),
                    };
                    let jumps = [jump(1), jump(4)];
                    println!("{jumps:?} {} {k} {lag:?} {drive:?}", plant.id());
                    assert!(
                        jumps[0] < most && jumps[1] < fall * jumps[0] + 1e-9,
                        "{} {k} {lag:?} {drive:?}: {jumps:?}",
                        plant.id()
                    );
                }
            }
        }
    }
}

#[test]
fn a_delay_at_a_whole_sample_has_the_derivative_of_its_output() {
    for plant in [Plant::CascadedTanks, Plant::CascadedTanksLinear] {
        for drive in DRIVES {
            let h = base(plant).h;
            let input = input(drive, 100, h, 66);
            let lane = base(plant).theta.len();
            for lag in [0.0, 0.7, 40.0] {
                let at = |d: f64| with(plant, &[("transport_delay", d), ("pump_lag", lag * h)]);
                // The derivative at an arrival exactly at a sample is the one-sided one that duals compute.
                let (y, exact) = derivative(&at(3.0 * h), lane, &input, 1);
                let step = 1e-4 * h;
                let (one, two) = (
                    at(3.0 * h + step).run(&input, 1),
                    at(3.0 * h + 2.0 * step).run(&input, 1),
                );
                let forward: Vec<f64> = (0..y.len())
                    .map(|k| (4.0 * one[k] - two[k] - 3.0 * y[k]) / (2.0 * step))
                    .collect();
                let error = difference(&forward, &exact);
                println!("{error:8.1e} {} {lag} {drive:?}", plant.id());
                assert!(error < 1e-6, "{} {lag} {drive:?}: {error:e}", plant.id());
            }
        }
    }
}
