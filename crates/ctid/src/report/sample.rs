//! A diagnosis for tests of the report: two tanks with an overflow of the upper one and a dead zone of the pump, with the base model, the
//! overflow, and both. The simulations are real, the scores are invented.

mod signals;
mod variants;

use effect_search::failures::SignalBins;
use effect_search::{Bin, Failure, FailureKind, Failures, OutputStep, ResidualTests};
use missing_effect::{
    Diagnosis, Effort, NoiseFloor, NoiseSource, Parameter, PerOutput, Rankings, Score, Shown,
    ShownInput, Step, Verdict,
};

use self::signals::{NOISE, PERIOD, input, noise, simulate};
pub(crate) use self::variants::{
    awkward, comparison, comparison_of, partial, partial_of, rename_outputs,
};
use linear_identification::rms;

fn bins(by: &[f64], residual: &[f64], edges: &[f64]) -> Vec<Bin> {
    edges
        .windows(2)
        .map(|edge| {
            let inside: Vec<f64> = by
                .iter()
                .zip(residual)
                .filter(|(b, _)| (edge[0]..edge[1]).contains(*b))
                .map(|(_, r)| *r)
                .collect();
            let count = inside.len();
            let rms = rms(inside.iter().copied());
            Bin {
                record: None,
                from: edge[0],
                to: edge[1],
                count,
                mean: inside.iter().sum::<f64>() / count.max(1) as f64,
                rms,
                fails: count > 5 && rms > 2.0 * NOISE,
            }
        })
        .collect()
}

fn even_edges(values: &[f64], count: usize) -> Vec<f64> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max) + 1e-9;
    (0..=count)
        .map(|i| low + (high - low) * i as f64 / count as f64)
        .collect()
}

/// The numbers of the outputs of a sample by their names.
fn named(outputs: &[String], values: impl IntoIterator<Item = f64>) -> PerOutput {
    PerOutput(outputs.iter().cloned().zip(values).collect())
}

/// Root mean square of errors of outputs, each divided by its noise.
fn weighted(errors: &PerOutput) -> f64 {
    rms(errors.values().map(|rmse| rmse / NOISE))
}

fn failures(record: &Shown, simulated: &[f64], residual: &[f64]) -> Failures {
    let rate: Vec<f64> = (0..simulated.len())
        .map(|k| (simulated[k] - simulated[k.saturating_sub(1)]) / PERIOD)
        .collect();
    let mut by_time = bins(&record.time, residual, &even_edges(&record.time, 24));
    for bin in &mut by_time {
        bin.record = Some(0);
    }
    let level = rms(residual.iter().copied());
    let by_frequency = (0..8)
        .map(|octave| {
            let from = 0.000_25 * f64::from(1 << octave);
            let rms = (level - NOISE).max(0.0) / f64::from(1 << octave).powf(0.9) + 0.3 * NOISE;
            Bin {
                record: None,
                from,
                to: 2.0 * from,
                count: 1 << octave,
                mean: 0.0,
                rms,
                fails: rms > NOISE,
            }
        })
        .collect();
    let worst = by_time.iter().filter(|bin| bin.fails).take(3);
    let worst = worst
        .map(|bin| Failure {
            by: FailureKind::Time,
            signal: String::new(),
            unit: String::new(),
            bin: bin.clone(),
            error_share: 0.3,
            sample_share: 1.0 / 24.0,
        })
        .collect();
    Failures {
        by_time,
        by_output: bins(simulated, residual, &even_edges(simulated, 10)),
        by_input: record
            .inputs
            .iter()
            .map(|input| SignalBins {
                name: input.name.clone(),
                unit: input.unit.clone(),
                bins: bins(&input.values, residual, &even_edges(&input.values, 10)),
            })
            .collect(),
        by_state: Vec::new(),
        by_direction: bins(&rate, residual, &[-1.0, -0.003, 0.003, 1.0]),
        by_frequency,
        worst,
    }
}

fn correlation(a: &[f64], b: &[f64], lags: usize) -> Vec<f64> {
    let scale = a.len() as f64 * rms(a.iter().copied()) * rms(b.iter().copied());
    (0..lags)
        .map(|lag| {
            let sum: f64 = a.iter().zip(&b[lag..]).map(|(a, b)| a * b).sum();
            sum / scale
        })
        .collect()
}

fn tests(input: &[f64], residual: &[f64]) -> ResidualTests {
    let mean = input.iter().sum::<f64>() / input.len() as f64;
    let centred: Vec<f64> = input.iter().map(|u| u - mean).collect();
    let autocorrelation = correlation(residual, residual, 31);
    let white = autocorrelation[1].abs() < 0.1;
    let bound = 1.96 / (residual.len() as f64).sqrt();
    ResidualTests {
        cross_correlation: correlation(&centred, residual, 31),
        autocorrelation,
        autocorrelation_bound: bound,
        cross_correlation_bound: bound,
        whiteness_p: if white { 0.31 } else { 1e-9 },
        input_p: if white { 0.02 } else { 1e-12 },
    }
}

fn parameter(name: &str, value: f64, std_error: Option<f64>, unit: &str) -> Parameter {
    Parameter {
        prior: None,
        name: name.to_owned(),
        value,
        std_error,
        unit: unit.to_owned(),
    }
}

fn step(
    effects: &[(&str, Parameter)],
    (outputs, records): (&[String], &[Shown]),
    model: (f64, f64, f64),
) -> Step {
    let runs: Vec<[Vec<f64>; 2]> = records
        .iter()
        .map(|r| simulate(&r.inputs[0].values, model.0, model.1, model.2))
        .collect();
    let of_output = |output: usize| {
        let residuals: Vec<Vec<f64>> = records
            .iter()
            .zip(&runs)
            .map(|(r, run)| {
                let pairs = r.outputs[output].iter().zip(&run[output]);
                pairs.map(|(y, s)| y - s).collect()
            })
            .collect();
        OutputStep {
            name: outputs[output].clone(),
            rmse: rms(residuals[0].iter().copied()),
            rmse_test: Some(rms(residuals[1].iter().copied())),
            rmse_test_50: None,
            held_out_error: None,
            tests: tests(&records[0].inputs[0].values, &residuals[0]),
            failures: failures(&records[0], &runs[0][output], &residuals[0]),
        }
    };
    let of_outputs: Vec<OutputStep> = (0..outputs.len()).map(of_output).collect();
    let mut parameters = vec![
        parameter("pump_gain", model.2, Some(0.000_31), "V^0.5/s"),
        parameter("alpha_upper", 0.085, Some(0.000_42), "V^0.5/s"),
        parameter("alpha_lower", 0.075, Some(0.000_38), "V^0.5/s"),
    ];
    parameters.extend(effects.iter().map(|(_, p)| p.clone()));
    parameters.push(parameter("level_upper(0)", 2.0, None, "V"));
    parameters.push(parameter("level_lower(0)", 3.0, Some(0.021), "V"));
    let added = effects.last().map(|(effect, _)| (*effect).to_owned());
    let errors = named(outputs, of_outputs.iter().map(|output| output.rmse));
    let tested = named(
        outputs,
        of_outputs.iter().filter_map(|output| output.rmse_test),
    );
    let single = |values: &PerOutput| match values.0[..] {
        [(_, value)] => value,
        _ => f64::NAN,
    };
    Step {
        place: (added.as_deref() == Some("overflow")).then(|| "upper".to_owned()),
        added,
        rmse: single(&errors),
        rmse_test: Some(single(&tested)).filter(|rmse| !rmse.is_nan()),
        weighted_rmse: weighted(&errors),
        weighted_rmse_test: Some(weighted(&tested)),
        bic: 2.0 * 600.0 * weighted(&errors).ln(),
        rmse_per_output: errors,
        rmse_test_per_output: Some(tested),
        parameters,
        starts: 12,
        starts_agree: 12 - 2 * effects.len(),
        outputs: of_outputs,
        simulated: runs
            .into_iter()
            .flat_map(|run| run.into_iter().take(outputs.len()))
            .collect(),
    }
}

fn score(effect: &str, bic_gain: f64, rmse: f64, size: Option<Parameter>) -> Score {
    Score {
        effect: effect.to_owned(),
        place: (effect == "overflow").then(|| "upper".to_owned()),
        bic_gain,
        rmse,
        weighted_rmse: rmse / NOISE,
        visibility: 0.02 + (bic_gain.abs() / 700.0).min(0.9),
        smallest_visible: size.as_ref().map(|p| 0.08 * p.value.abs()),
        size,
    }
}

/// Two tanks, an overflow and a dead zone found.
pub(crate) fn two_tanks() -> Diagnosis {
    diagnosis(&["y"])
}

/// Sample diagnosis of a record with both levels.
pub(crate) fn two_outputs() -> Diagnosis {
    let mut diagnosis = diagnosis(&["lower", "upper"]);
    for score in &mut diagnosis.scores {
        score.rmse = f64::NAN;
    }
    diagnosis
}

fn diagnosis(outputs: &[&str]) -> Diagnosis {
    let outputs: Vec<String> = outputs.iter().map(|name| (*name).to_owned()).collect();
    let records: Vec<Shown> = [
        (600, 0.0, "tanks-estimation.csv"),
        (500, 700.0, "tanks-validation.csv"),
    ]
    .into_iter()
    .zip([1, 2])
    .map(|((n, shift, name), seed)| {
        let input = input(n, shift);
        let truth = simulate(&input, 7.5, 0.55, 0.062);
        let readings = truth.iter().take(outputs.len()).zip([seed, seed + 2]);
        Shown {
            name: name.to_owned(),
            held_out: seed == 2,
            time: (0..n).map(|k| k as f64 * PERIOD).collect(),
            outputs: readings
                .map(|(truth, seed)| {
                    let noisy = truth.iter().zip(noise(seed, n));
                    noisy.map(|(y, e)| y + e).collect()
                })
                .collect(),
            inputs: vec![ShownInput {
                name: "input".into(),
                unit: "V".into(),
                values: input,
            }],
        }
    })
    .collect();
    let data = (&outputs[..], &records[..]);
    let rim = parameter("overflow.rim", 7.5, Some(0.034), "V");
    let zone = parameter("pump_deadzone.u_dz", 0.55, Some(0.027), "V");
    let overflow = ("overflow", rim.clone());
    let deadzone = ("pump_deadzone", zone.clone());
    let volt = |value: f64| Some(parameter("size", value, Some(0.06 * value.abs()), "V"));
    Diagnosis {
        gaps: None,
        clock: ct_signals::Clock::of([]),
        schema: 4,
        verdict: Verdict::Undecided,
        effects: vec!["overflow".into(), "pump_deadzone".into()],
        groups: vec![
            vec!["overflow".into()],
            vec!["pump_deadzone".into(), "pump_nonlinearity".into()],
        ],
        in_doubt: vec![false, false],
        places: Vec::new(),
        acceptance: None,
        rankings: Rankings::default(),
        effort: Effort::default(),
        residual_unexplained: false,
        not_noise: None,
        ranked: [
            "overflow",
            "sensor_saturation",
            "pump_deadzone",
            "pump_nonlinearity",
        ]
        .map(String::from)
        .to_vec(),
        steps: vec![
            step(&[], data, (1e3, 0.0, 0.049)),
            step(std::slice::from_ref(&overflow), data, (7.5, 0.0, 0.052)),
            step(&[overflow, deadzone], data, (7.5, 0.55, 0.062)),
        ],
        noise_floor: if outputs.len() > 1 { f64::NAN } else { NOISE },
        noise: outputs
            .iter()
            .map(|output| NoiseFloor {
                output: output.clone(),
                level: NOISE,
                innovation: NOISE,
                coefficients: vec![],
                source: NoiseSource::FinalModel,
                of_innovation: false,
            })
            .collect(),
        scores: vec![
            score("overflow", 512.4, 0.31, Some(rim)),
            score("sensor_saturation", 401.8, 0.36, volt(6.1)),
            score("pump_saturation", 288.0, 0.42, volt(4.4)),
            score("pump_deadzone", 156.1, 0.49, Some(zone)),
            score("pump_nonlinearity", 149.7, 0.50, volt(0.21)),
            score(
                "laminar_outflow",
                80.2,
                0.53,
                Some(parameter("a", 0.0021, Some(0.0004), "1/s")),
            ),
            score(
                "const_leak",
                33.1,
                0.55,
                Some(parameter("q0", 0.004, Some(0.0009), "V/s")),
            ),
            score("sensor_offset", 12.0, 0.56, volt(-0.12)),
            score(
                "pump_lag",
                3.5,
                0.57,
                Some(parameter("T_p", 4.1, Some(2.0), "s")),
            ),
            score("none", 0.0, 0.58, None),
            score("sensor_drift", -6.2, 0.58, volt(0.01)),
            score("coupled_tank", -6.4, 0.58, None),
        ],
        unknown: None,
        control_loop: None,
        remarks: Vec::new(),
        plant: "cascaded-tanks".into(),
        known_effects: vec!["sqrt_outflow".into()],
        input_unit: "V".into(),
        output_unit: "V".into(),
        output_units: Vec::new(),
        outputs,
        records,
        seconds: 0.4,
    }
}
