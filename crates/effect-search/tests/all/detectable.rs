//! Visibility and minimum detectable size of single effects.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use ct_model::effects::{Visited, candidates};
use ct_model::{Model, ModelSpec};
use ct_signals::{Record, noise};
use effect_search::{Diagnosis, Problem, Single, Verdict};
use greybox::{FitOptions, ModelSetup};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::records::{BLOCK, PAIR, ROWS, found, problem, record};

/// Linear in its size: a drift of the reading over the record.
const EFFECT: &str = "drift(y)";

/// A record of the block with white noise, whose reading drifts.
fn drifting(change: f64, sigma: f64, seed: u64) -> Record {
    let mut record = record(BLOCK, 0.0, sigma, seed);
    let last = record.len() as f64 - 1.0;
    let values = record.outputs[0].values.iter_mut().enumerate();
    values.for_each(|(k, y)| *y += change * k as f64 / last);
    record
}

/// The diagnosis of the block with noise of 0.2 degC and nothing missing.
static ADEQUATE: LazyLock<Diagnosis> =
    LazyLock::new(|| found(&problem(BLOCK, drifting(0.0, 0.2, 3))));

fn single<'a>(found: &'a Diagnosis, effect: &str) -> &'a Single {
    let mut singles = found.singles.iter();
    singles.find(|single| single.effect == effect).unwrap()
}

/// The minimum detectable size, which is 3.858 standard errors of the fitted size.
fn smallest_by_error(single: &Single) -> f64 {
    let smallest = single.smallest_visible.unwrap();
    let by_error = 3.858 * single.sizes[0].std_error.unwrap();
    assert!(
        (smallest / by_error - 1.0).abs() < 0.15,
        "{smallest} {by_error}"
    );
    smallest
}

#[test]
fn the_minimum_detectable_size_is_that_of_a_test_with_the_standard_error() {
    let noisy = found(&problem(BLOCK, drifting(0.0, 0.4, 3)));
    let [once, twice] = [&*ADEQUATE, &noisy].map(|found| {
        assert_eq!(found.verdict, Verdict::Adequate);
        let single = single(found, EFFECT);
        let visibility = single.visibility.unwrap();
        assert!(visibility > 0.05 && visibility < 1.0, "{visibility}");
        smallest_by_error(single)
    });
    assert!((twice / once - 2.0).abs() < 0.05, "{once} {twice}");

    // In 16 records with a drift of this size, and of a tenth of it, a test of the fitted size with a false alarm rate of 1 %.
    let significant = |size: f64| {
        let is_significant = |seed: &u64| {
            let text = BLOCK
                .replace("= T;", "= T + d*time/2495;")
                .replace("  input Real u", "  parameter Real d = 0;\n  input Real u");
            let model = Model::new(ModelSpec::parse(&text).unwrap());
            let records = [drifting(size, 0.2, *seed)];
            let setup = ModelSetup::new(&model, &records, &BTreeMap::new(), 1.0).unwrap();
            let fit = setup.fit(&FitOptions::default()).unwrap();
            let at = setup.names().iter().position(|name| name == "d").unwrap();
            fit.x[at].abs() > 2.576 * fit.std_errors()[at].unwrap()
        };
        (100..116).filter(is_significant).count()
    };
    assert!(significant(once) >= 12, "{}", significant(once));
    assert!(significant(0.1 * once) <= 2, "{}", significant(0.1 * once));
}

/// The noise of the last model counts, not the error of the model without an effect.
#[test]
fn effects_that_are_missing_do_not_raise_the_minimum_detectable_size() {
    let drifting = found(&problem(BLOCK, drifting(5.0, 0.2, 3)));
    assert!(matches!(
        drifting.verdict,
        Verdict::Effect | Verdict::Undecided
    ));
    let [bare, drifted] =
        [&*ADEQUATE, &drifting].map(|found| single(found, EFFECT).smallest_visible.unwrap());
    assert!((drifted / bare - 1.0).abs() < 0.1, "{bare} {drifted}");
}

/// Outputs are weighted by their noise, which has a memory.
#[test]
fn of_two_outputs_it_is_that_of_the_standard_error_in_coloured_noise() {
    let mut record = record(PAIR, 0.6, 0.1, 5);
    let noise = noise::ar1(ROWS, 0.5, 0.6, &mut ChaCha8Rng::seed_from_u64(6));
    let values = record.outputs[1].values.iter_mut();
    values.zip(noise).for_each(|(y, e)| *y += e);
    let drifts = ["drift(y1)", "drift(y2)"];
    let spec = ModelSpec::parse(PAIR).unwrap();
    let others = candidates(&spec, &Visited::nominal(&spec)).into_iter();
    let others = others.map(|candidate| candidate.id);
    let problem = Problem::builder(spec, [record])
        .left_out(others.filter(|id| !drifts.contains(&id.as_str())))
        .build()
        .unwrap();
    let found = found(&problem);
    assert_eq!(found.verdict, Verdict::Adequate);
    assert!(
        found
            .noise
            .iter()
            .all(|noise| !noise.coefficients.is_empty())
    );
    let [first, second] = drifts.map(|effect| {
        let single = single(&found, effect);
        smallest_by_error(single)
    });
    assert!(second > 3.0 * first, "{first} {second}");
}

#[test]
fn an_effect_without_a_derivative_where_it_is_absent_has_none() {
    let found = &*ADEQUATE;
    for one in &found.singles {
        let is_threshold = [
            "limit",
            "dead_zone",
            "backlash",
            "saturation",
            "quantisation",
        ]
        .iter()
        .any(|name| one.effect.starts_with(&format!("{name}(")))
            || one.effect == "delay(y)";
        assert_eq!(one.visibility.is_none(), is_threshold, "{}", one.effect);
        assert!(one.smallest_visible.is_none_or(|size| size > 0.0));
    }
    assert!(found.singles.iter().any(|one| one.visibility.is_none()));
    let mut old = serde_json::to_value(single(found, EFFECT)).unwrap();
    for key in ["visibility", "smallest_visible"] {
        assert!(old.as_object_mut().unwrap().remove(key).is_some());
    }
    let read: Single = serde_json::from_value(old).unwrap();
    assert_eq!((read.visibility, read.smallest_visible), (None, None));
}
