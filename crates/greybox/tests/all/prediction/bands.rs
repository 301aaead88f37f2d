//! Coverage of the band of a prediction for the output without noise.

use greybox::{
    FitOptions, FitUncertainty, InitialStates, Setup, coloured, fit, levels_from_readings,
    output_errors, steady_state,
};
use rayon::prelude::*;

use super::{BLOCK, LEVEL, TANK, TIGHT, first, inputs, measured, model, predicted, setup};
use crate::support::Rig;

/// Fits of the tests; `RECORDS=200` takes so many.
const RECORDS: u64 = 60;

pub(super) fn records() -> u64 {
    std::env::var("RECORDS").map_or(RECORDS, |records| records.parse().unwrap())
}

/// The pooled share of covered rows is near 95 %: within 93 to 97 % for 200 fits or more, and a wider range for fewer fits.
fn check(name: &str, shares: &[f64]) {
    let n = shares.len() as f64;
    let mean = shares.iter().sum::<f64>() / n;
    let wide = 0.02 * (200.0 / n).sqrt().max(1.0);
    println!("{name}: {mean:.4} of {n} fits");
    assert!((mean - LEVEL).abs() <= wide, "{name}: {mean} of {n} fits");
}

/// The share of rows of an output in which the band covers the output without noise.
fn covered(mean: &[f64], errors: &[f64], clean: &[f64], quantile: f64) -> f64 {
    let rows = mean.iter().zip(errors).zip(clean);
    let inside = rows.filter(|((mean, error), clean)| (*mean - *clean).abs() <= quantile * *error);
    inside.count() as f64 / mean.len() as f64
}

/// Fits a record of a text's model, predicts on other inputs; the share of covered rows by output. `first_rows`: to which initial states
/// are fitted; none where they are those of the text.
fn share(
    text: &str,
    truth: &[f64],
    of_noise: &[(f64, f64)],
    first_rows: Option<usize>,
    seed: u64,
) -> Vec<f64> {
    let model = model(text);
    let count = model.parameters().len();
    let outputs = model.spec().outputs.len();
    let options = FitOptions {
        starts: 4,
        ..FitOptions::default()
    };
    let fitted = measured(
        &model,
        &inputs(300, 2.0, outputs, 2 * seed),
        truth,
        of_noise,
        seed,
    );
    let fitted = [fitted];
    let own = setup(&model, &fitted);
    let fit = own.fit(&options).unwrap();
    let known = FitUncertainty::of(&own, &fit, count, 6).unwrap().unwrap();
    let other = inputs(150, 2.0, outputs, 2 * seed + 1);
    let states = first_rows.map_or_else(
        || model.starts(&truth[..count]),
        |_| truth[count..].to_vec(),
    );
    let true_x = [&truth[..count], &states].concat();
    let others = [other.clone()];
    let clean = setup(&model, &others).simulate(&true_x).unwrap();
    let other = match first_rows {
        None => other,
        Some(_) => measured(&model, &other, &true_x, of_noise, seed + 10_000),
    };
    let others = [other.clone()];
    let on_others = own.with_records(&others).unwrap();
    let parameters = &fit.x[..count];
    let (x, errors) = match first_rows {
        Some(rows) => predicted(&on_others, parameters, &known, rows, &other),
        None => {
            let states = InitialStates::of_text(&model, parameters, &known.entries);
            let x = [parameters, &states.values].concat();
            let errors = output_errors(&on_others, &x, count, &known, &states).unwrap();
            (x, errors)
        }
    };
    let mean = on_others.simulate(&x).unwrap();
    let each = mean.iter().zip(&errors).zip(&clean);
    let q = known.quantile(LEVEL);
    // With a known initial state the first value is exact.
    let from = usize::from(first_rows.is_none());
    each.map(|((m, e), c)| covered(&m[from..], &e[from..], &c[from..], q))
        .collect()
}

#[test]
fn the_band_covers_the_output_without_noise() {
    let tank = [1.0, 0.5, 4.0];
    let block = [50.0, 1.0, 22.0, 5.0, 24.0, 22.5];
    type Setting<'s> = (&'s str, &'s str, &'s [f64], &'s [(f64, f64)], Option<usize>);
    let settings: [Setting; 3] = [
        (
            "tank, white noise, start of the text",
            TANK,
            &tank,
            &[(0.05, 0.0)],
            None,
        ),
        (
            "tank, coloured noise, first readings",
            TANK,
            &tank,
            &[(0.05, 0.7)],
            Some(5),
        ),
        (
            "block, two outputs, first readings",
            BLOCK,
            &block,
            &[(0.05, 0.0), (0.1, 0.5)],
            Some(5),
        ),
    ];
    for (name, text, truth, of_noise, rows) in settings {
        let shares: Vec<Vec<f64>> = (0..records())
            .into_par_iter()
            .map(|seed| share(text, truth, of_noise, rows, seed))
            .collect();
        for o in 0..of_noise.len() {
            let own: Vec<f64> = shares.iter().map(|share| share[o]).collect();
            check(&format!("{name}, output {o}"), &own);
        }
    }
}

/// A plant at rest under the first inputs, and from readings.
fn share_of_plant(rig: &Rig, readings: bool, seed: u64) -> f64 {
    let records = [rig.record(seed)];
    let own = rig.setup(&records);
    let options = FitOptions::default();
    let fit = fit(&own, &options).unwrap();
    let fit = coloured(&own, fit, 6, options.stopping).unwrap();
    let count = own.parameter_count();
    let known = FitUncertainty::of(&own, &fit, count, 6).unwrap().unwrap();
    let mut other = rig.record(seed + 10_000);
    if !readings {
        other.outputs[0].values.fill(f64::NAN);
    }
    let others = [other.clone()];
    let on_others = own.with_records(&others).unwrap();
    let truth = rig.truth(1);
    let parameters = &fit.x[..count];
    let rest = |p: &[f64]| steady_state(&on_others, p);
    let (states, true_states) = if readings {
        let begun = first(&other, 5);
        let free = own.with_records(&begun).unwrap();
        let mut frozen = free.clone();
        frozen.freeze_parameters();
        let x = [parameters, &levels_from_readings(&free, parameters)].concat();
        let states = InitialStates::of_readings(&frozen, &free, &x, count, &known, TIGHT);
        (states.unwrap().unwrap(), truth[count..].to_vec())
    } else {
        let states = InitialStates::of_parameters(rest, parameters, Some(&known)).unwrap();
        (states, rest(&truth[..count]).unwrap())
    };
    let simulate = |setup: &Setup, p: &[f64], states: &[f64]| {
        setup
            .simulate(&[p, states].concat())
            .unwrap()
            .output
            .swap_remove(0)
    };
    let clean = simulate(&on_others, &truth[..count], &true_states);
    let mean = simulate(&on_others, parameters, &states.values);
    let x = [parameters, &states.values].concat();
    let errors = output_errors(&on_others, &x, count, &known, &states).unwrap();
    covered(&mean, &errors[0], &clean, known.quantile(LEVEL))
}

#[test]
fn the_band_of_a_plant_covers_the_output_without_noise() {
    for (readings, rho) in [(true, 0.0), (true, 0.6), (false, 0.6)] {
        let rig = Rig {
            rho,
            ..Rig::cascaded_tanks()
        };
        let shares: Vec<f64> = (0..records())
            .into_par_iter()
            .map(|seed| share_of_plant(&rig, readings, seed))
            .collect();
        check(
            &format!("two tanks, readings {readings}, rho {rho}"),
            &shares,
        );
    }
}
