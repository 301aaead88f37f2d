//! An effect at its absent value is the base model, bit for bit, and smooth there.

use crate::support::{DRIVES, base, begins_with_a_root, input, interior, label, placements};
use plants::{Place, Plant};

#[test]
fn an_absent_effect_leaves_the_output_bit_for_bit() {
    for plant in Plant::ALL {
        let base = base(plant);
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            let input = input(drive, 300, base.h, seed as u64);
            for substeps in [1, 3] {
                let without = base.run(&input, substeps);
                for placed in placements(plant) {
                    let with = base.with_absent(&[placed]).run(&input, substeps);
                    for (k, (a, b)) in with.iter().zip(&without).enumerate() {
                        assert_eq!(
                            a.to_bits(),
                            b.to_bits(),
                            "{}, {drive:?}, {substeps} substeps, sample {k}: {a} against {b}",
                            label(&[placed], plant)
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn all_effects_at_once_absent_leave_the_output_bit_for_bit() {
    for plant in Plant::ALL {
        let base = base(plant);
        for vessel in 0..plant.vessels() {
            let all: Vec<_> = placements(plant)
                .into_iter()
                .filter(|p| match p.effect.place {
                    Place::Vessel => p.vessel == vessel,
                    Place::Actuator => p.vessel == vessel.min(plant.pumps() - 1),
                    Place::Sensor => true,
                })
                .collect();
            for (seed, drive) in DRIVES.into_iter().enumerate() {
                let input = input(drive, 300, base.h, 10 + seed as u64);
                let with = base.with_absent(&all).run(&input, 1);
                assert_eq!(with, base.run(&input, 1), "{}, {drive:?}", plant.id());
            }
        }
    }
}

#[test]
fn the_derivative_at_absent_is_that_of_the_limit() {
    for plant in Plant::ALL {
        let base = base(plant);
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            let input = input(drive, 200, base.h, 20 + seed as u64);
            for substeps in [1, 3] {
                for placed in placements(plant) {
                    if placed.effect.id == "coarse_quantisation" {
                        // Finer and finer steps have no slope in the limit; derivatives.rs tests the derivative that is used instead.
                        continue;
                    }
                    let info = &base.structure.effect_parameters(placed)[0];
                    if !info.absent.is_finite() {
                        // A threshold that is never reached has no derivative there; derivatives.rs tests it in use.
                        continue;
                    }
                    let case = base.with_absent(&[placed]);
                    let own = base.theta.len();
                    let at = |x: f64| {
                        let mut moved = case.clone();
                        moved.theta[own] = x;
                        moved.run(&input, substeps)
                    };
                    // Towards the inside of the bounds, of second order, if only one side exists: below the absent value a delay or a lag
                    // has no meaning, and a leak or a dead zone has a corner there. Otherwise the central difference.
                    let step = 1e-4 * (interior(&base, placed, info) - info.absent);
                    let (up, down) = (at(info.absent + step), at(info.absent - step));
                    let (here, beyond) = (at(info.absent), at(info.absent + 2.0 * step));
                    let one_sided = info.lower >= info.absent;
                    let exact = case.run_dual(&input, substeps);
                    let largest = exact.iter().fold(0.0_f64, |m, y| m.max(y.eps[own].abs()));
                    let mut worst = 0.0_f64;
                    for (k, y) in exact.iter().enumerate() {
                        let rise = if one_sided {
                            4.0 * up[k] - beyond[k] - 3.0 * here[k]
                        } else {
                            up[k] - down[k]
                        };
                        worst = worst.max((rise / (2.0 * step) - y.eps[own]).abs() / largest);
                    }
                    // A leak that begins between two samples, as in derivatives.rs; of T2 up to 5.5e-6.
                    let most = if plant.joined() && begins_with_a_root(&[placed]) {
                        1e-5
                    } else {
                        2e-6
                    };
                    assert!(
                        worst < most,
                        "{}, {drive:?}, {substeps} substeps: derivative at absent off by {worst:e} of {largest:e}",
                        label(&[placed], plant)
                    );
                }
            }
        }
    }
}
