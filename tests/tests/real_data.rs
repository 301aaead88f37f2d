//! The measured Cascaded Tanks benchmark, where it is present beside the checkout.

use std::path::PathBuf;

use ct_signals::{Columns, Hold, read_csv};
use missing_effect::{Options, Problem, Verdict, diagnose};
use plants::{Known, Plant};

/// `None`, with the reason printed, where the data are not there.
fn data() -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/cascaded_tanks");
    if folder.join("estimation.csv").exists() {
        return Some(folder);
    }
    println!(
        "skipped: the measured Cascaded Tanks data are not at {}",
        folder.display()
    );
    None
}

/// From the plain square-root model, with nothing told, the tool finds a chain of effects on the estimation record that
/// halves the error on the test record, overflow and the pump's dead zone among them.
#[test]
fn the_cascaded_tanks_give_up_their_effects() {
    let Some(folder) = data() else { return };
    let read = |name: &str| read_csv(&folder.join(name), &Columns::default(), Hold::Zero).unwrap();
    let problem = Problem {
        plant: Plant::CascadedTanks,
        known: Known::default(),
        effects: Vec::new(),
        terms: Vec::new(),
        start: Default::default(),
        fixed: Vec::new(),
        controller: None,
        records: vec![read("estimation.csv")],
        test: vec![read("test.csv")],
    };
    let found = diagnose(&problem, &Options::default(), &|_| {}).unwrap();
    for step in &found.steps {
        println!(
            "{:?} {:.4} V, held out {:.4} V",
            step.added,
            step.rmse,
            step.rmse_test.unwrap()
        );
    }
    println!("{:.2} s", found.seconds);
    assert!(matches!(
        found.verdict,
        Verdict::Effect | Verdict::Undecided
    ));
    for effect in ["overflow", "pump_deadzone"] {
        assert!(
            found.effects.iter().any(|name| name == effect),
            "{effect} is not in {:?}",
            found.effects
        );
    }
    let held_out: Vec<f64> = found
        .steps
        .iter()
        .map(|step| step.rmse_test.unwrap())
        .collect();
    // The plain square root scores 0.67 V; a neural state space model 0.33 V.
    assert!((held_out[0] - 0.67).abs() < 0.01, "{held_out:?}");
    assert!(*held_out.last().unwrap() <= 0.33, "{held_out:?}");

    // The test record decides nothing: without it the same effects are found.
    let alone = diagnose(
        &Problem {
            test: Vec::new(),
            ..problem
        },
        &Options::default(),
        &|_| {},
    )
    .unwrap();
    assert_eq!(alone.effects, found.effects);
    assert_eq!(
        alone.steps.last().unwrap().rmse.to_bits(),
        found.steps.last().unwrap().rmse.to_bits()
    );
}
