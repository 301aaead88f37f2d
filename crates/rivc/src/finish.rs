//! Final step: covariance, and parameters scaled so that the lowest coefficient of A is 1.

use ct_signals::{ArModel, StationaryNoise};
use nalgebra::DMatrix;

use crate::equations::Equations;
use crate::iterate::Refined;
use crate::model::Model;
use crate::pass::Instruments;
use crate::plant::Plant;
use crate::prepared::Prepared;
use crate::problem::{Delayed, Problem};
use crate::result::{Estimate, Kind, Parameter};
use crate::settings::{Noise, Settings};
use crate::{Data, Error};

pub(crate) fn finish(
    problem: &Problem,
    found: Refined,
    settings: &Settings,
    records: &[Data],
) -> Result<Estimate, Error> {
    let structure = problem.structure;
    let model = &found.model;
    let with_delays = structure.estimated_delays().next().is_some();
    let (equations, delayed) = (found.equations, found.delayed);
    let noise = equations.residual_noise(settings.noise_order)?;
    let middle = match settings.noise {
        Noise::Autoregressive => None,
        Noise::White if noise.iter().all(|noise| noise.order() == 0) => None,
        Noise::White => {
            let p = equations.unknowns();
            let mut middle = DMatrix::zeros(p, p);
            for (index, noise) in noise.iter().enumerate() {
                let process = StationaryNoise::of_ar(noise);
                let pass = problem.pass(&delayed, model, index, with_delays);
                let bank = pass.bank(&model.alpha)?;
                let mut sum = process.sum(pass.columns());
                let nothing = vec![0.0; pass.columns()];
                pass.rows(&bank, Instruments::Model, |row| match row.missing {
                    true => sum.push(&nothing),
                    false => sum.push(row.z),
                });
                // The equations' rows are over the record's standard deviation, both factors of them.
                let weight = found
                    .noise
                    .as_ref()
                    .map_or(1.0, |weights| 1.0 / weights[index].sigma());
                let mut block = sum.finish();
                let scale = noise.sigma().powi(2) * weight.powi(4);
                block.iter_mut().for_each(|value| *value *= scale);
                equations.add_block(&block, index, &mut middle);
            }
            // The innovations' variances are over the samples less their orders.
            let orders: usize = noise_of_groups(&equations, &noise)
                .iter()
                .map(ArModel::order)
                .sum();
            let samples = (equations.samples - orders.min(equations.samples)) as f64;
            Some(middle * (samples / (samples - p as f64).max(1.0)))
        }
    };
    let zeros = vec![0.0; found.at_limit.len()];
    let reduced = equations.with_fixed(&found.at_limit, &zeros);
    let middle = middle.map(|middle| {
        middle
            .remove_rows_at(&found.at_limit)
            .remove_columns_at(&found.at_limit)
    });
    let mut covariance = reduced.covariance(middle)?;
    for place in &found.at_limit {
        covariance = covariance
            .insert_row(*place, 0.0)
            .insert_column(*place, 0.0);
    }
    let (parameters, covariance) = normalised(problem, model, &covariance, &found.at_limit);
    let mut errors = parameters.iter().filter_map(|p| p.std_error);
    if errors.any(|error| !error.is_finite()) {
        return Err(Error::NotDetermined {
            parameters: equations.unknowns(),
            samples: equations.samples,
        });
    }
    let lowest = structure.lowest();
    let mut a = model.alpha.clone();
    a.push(1.0);
    let scale = a[lowest];
    a.iter_mut().for_each(|a| *a /= scale);
    let mut beta = model.beta.iter().map(|b| b / scale);
    let b = structure
        .m
        .iter()
        .map(|m| beta.by_ref().take(m + 1).collect())
        .collect();
    Ok(Estimate {
        method: match (settings.noise, records[0].reference.is_some()) {
            (Noise::White, false) => "SRIVC",
            (Noise::Autoregressive, false) => "RIVC",
            (Noise::White, true) => "CLSRIVC",
            (Noise::Autoregressive, true) => "CLRIVC",
        },
        simulated: simulated(problem, &equations, (&delayed, model), records)?,
        residual_rms: rms(&equations),
        samples: equations.samples,
        parameters,
        covariance,
        plant: Plant {
            a,
            b,
            delays: model.delays.clone(),
        },
        explained: problem
            .records
            .iter()
            .filter_map(Prepared::explained)
            .min_by(f64::total_cmp),
        noise: noise_of_groups(&equations, &noise),
        iterations: found.iterations,
        converged: found.converged,
        first: delayed.first.clone(),
    })
}

/// One noise model for all parts of a record.
fn noise_of_groups(equations: &Equations, noise: &[ArModel]) -> Vec<ArModel> {
    let groups = equations.layout.groups().into_iter();
    groups.map(|group| noise[group.start].clone()).collect()
}

fn rms(equations: &Equations) -> f64 {
    let all = equations.residuals.iter().flatten();
    let squares: f64 = all.filter(|e| !e.is_nan()).map(|e| e * e).sum();
    (squares / equations.samples as f64).sqrt()
}

/// Measured outputs minus residuals; the model's output where a reading is missing.
fn simulated(
    problem: &Problem,
    equations: &Equations,
    (delayed, model): (&Delayed, &Model),
    records: &[Data],
) -> Result<Vec<Vec<f64>>, Error> {
    let of_record = |(i, record): (usize, &Data)| {
        let mut said = Vec::new();
        if problem.records[i].lacks_readings() {
            let pass = problem.pass(delayed, model, i, false);
            let bank = pass.bank(&model.alpha)?;
            pass.rows(&bank, Instruments::Model, |row| {
                said.push(row.y + problem.records[i].y_mean);
            });
        }
        let measured = record.output[delayed.first[i]..].iter();
        let residuals = measured.zip(&equations.residuals[i]).enumerate();
        Ok(residuals
            .map(|(k, (y, e))| if y.is_nan() { said[k] } else { y - e })
            .collect())
    };
    records.iter().enumerate().map(of_record).collect()
}

/// Parameters with the lowest coefficient of A at 1, from those of the monic form about the means, with their covariance.
fn normalised(
    problem: &Problem,
    model: &Model,
    covariance: &DMatrix<f64>,
    at_limit: &[usize],
) -> (Vec<Parameter>, Vec<f64>) {
    let structure = problem.structure;
    let (n, lowest) = (structure.n, structure.lowest());
    // For a first-order integrator the coefficient is 1 and is not estimated.
    let scale = if lowest < n { model.alpha[lowest] } else { 1.0 };
    let of_scale = (lowest < n).then_some(0);
    let columns = covariance.nrows();
    let mut kinds = Vec::new();
    let mut values = Vec::new();
    let mut rows: Vec<Vec<f64>> = Vec::new();
    // numerator/scale, with the numerator's derivatives.
    let mut put = |kind: Kind, numerator: f64, terms: &[(usize, f64)]| {
        let mut row = vec![0.0; columns];
        for (column, derivative) in terms {
            row[*column] += derivative / scale;
        }
        if let Some(column) = of_scale {
            row[column] -= numerator / (scale * scale);
        }
        kinds.push(kind);
        values.push(numerator / scale);
        rows.push(row);
    };
    for power in lowest + 1..=n {
        match power {
            power if power == n => put(Kind::A { power }, 1.0, &[]),
            power => put(
                Kind::A { power },
                model.alpha[power],
                &[(power - lowest, 1.0)],
            ),
        }
    }
    let first_beta = n - lowest;
    let mut at = 0;
    let mut statics = Vec::new();
    for (input, m) in structure.m.iter().enumerate() {
        statics.push(at);
        for power in 0..=*m {
            let kind = Kind::B { input, power };
            put(kind, model.beta[at], &[(first_beta + at, 1.0)]);
            at += 1;
        }
    }
    let mut column = first_beta + at;
    let delays_at = column;
    column += structure.estimated_delays().count();
    if structure.offset {
        let layout = problem.layout(true);
        for (record, parts) in layout.groups().into_iter().enumerate() {
            let first = parts.start;
            let prepared = &problem.records[first];
            let mut offset = model.of_records[first][0] + model.alpha[0] * prepared.y_mean;
            let mut terms = vec![(layout.place(first, column), 1.0)];
            if lowest == 0 {
                terms.push((0, prepared.y_mean));
            }
            for (j, mean) in statics.iter().zip(&prepared.u_means) {
                offset -= model.beta[*j] * mean;
                terms.push((first_beta + j, -mean));
            }
            put(Kind::Offset { record }, offset, &terms);
        }
    }
    // Delays do not depend on the scale; they come before the offsets.
    let offsets = |kind: &&Kind| matches!(kind, Kind::Offset { .. });
    let before = kinds.len() - kinds.iter().filter(offsets).count();
    for (i, (input, _)) in structure.estimated_delays().enumerate() {
        let mut row = vec![0.0; columns];
        row[delays_at + i] = 1.0;
        kinds.insert(before + i, Kind::Delay { input });
        values.insert(before + i, model.delays[input]);
        rows.insert(before + i, row);
    }
    let of_x = DMatrix::from_fn(rows.len(), columns, |i, j| rows[i][j]);
    let covariance = &of_x * covariance * of_x.transpose();
    let parameters = kinds.into_iter().zip(values).enumerate();
    let parameters = parameters.map(|(i, (kind, value))| Parameter {
        kind,
        value,
        std_error: match kind {
            Kind::Delay { .. } if at_limit.contains(&(delays_at + i - before)) => None,
            _ => Some(covariance[(i, i)].sqrt()),
        },
    });
    (
        parameters.collect(),
        covariance.transpose().iter().copied().collect(),
    )
}
