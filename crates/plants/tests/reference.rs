//! The simulator against the written equations, integrated by other means.

mod support;

use plants::Plant;
use support::{DRIVES, base, difference, input, label, placements, reference};

fn overflows(placed: &[plants::Placed]) -> bool {
    placed.iter().any(|p| p.effect.id == "overflow")
}

#[test]
fn every_effect_agrees_with_its_equation() {
    let mut failures = Vec::new();
    for plant in Plant::ALL {
        let base = base(plant);
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            let input = input(drive, 150, base.h, 40 + seed as u64);
            for placed in placements(plant) {
                let case = base.with_interior(&[placed]);
                let reference = reference::run(&case, &input);
                for substeps in [1, 3] {
                    let error = difference(&case.run(&input, substeps), &reference);
                    let most = if overflows(&[placed]) { 1e-5 } else { 1e-7 };
                    println!(
                        "{error:8.1e} {} {drive:?} {substeps}",
                        label(&[placed], plant)
                    );
                    if error.is_nan() || error > most {
                        failures.push(format!(
                            "{error:e}: {} {drive:?} {substeps}",
                            label(&[placed], plant)
                        ));
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
