//! A reading that changes by a constant from one row to the next.

use effect_search::{NotNoise, Verdict};

use crate::records::{BLOCK, PAIR, ROWS, STEP, found, problem, record};

#[test]
fn a_level_shift_is_told_and_nothing_else_is_blamed() {
    for (text, correlation, by) in [
        (BLOCK, 0.0, 2.0),
        (BLOCK, 0.8, -3.0),
        (PAIR, 0.0, 1.0),
        (BLOCK, 0.0, 0.5),
    ] {
        let mut record = record(text, correlation, 0.2, 7);
        let row = ROWS * 3 / 5;
        let last = record.outputs.len() - 1;
        let shifted = record.outputs[last].values[row..].iter_mut();
        shifted.for_each(|y| *y += by);
        let name = record.outputs[last].name.clone();
        let found = found(&problem(text, record));
        assert_eq!(
            found.verdict,
            Verdict::Unexplained,
            "{by}: {:?}",
            found.groups
        );
        assert!(found.effects.is_empty());
        let Some(NotNoise::LevelShift {
            output, at, size, ..
        }) = &found.not_noise
        else {
            panic!("{by}: {:?}", found.not_noise);
        };
        assert_eq!(*output, name);
        assert_eq!(*at, STEP * row as f64);
        assert!((size - by).abs() < 0.25 * by.abs(), "{size}");
    }
}

/// A step in the physics is no level shift: the block takes time to warm up.
#[test]
fn a_step_of_the_plant_is_no_level_shift() {
    let text = BLOCK.replace(
        "g*u - k*(T - Ta)",
        "g*u - k*(T - Ta) + (if time >= 1300 then 6 else 0)",
    );
    let found = found(&problem(BLOCK, record(&text, 0.0, 0.2, 3)));
    let named = found.groups.iter().flatten().any(|id| id == "step(T)");
    assert!(named, "{:?} {:?}", found.groups, found.not_noise);
}
