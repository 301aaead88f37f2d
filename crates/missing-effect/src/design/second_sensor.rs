//! Benefit of a sensor in a tank whose level is not measured: the level is measured too, with the noise of the first output.

use ct_signals::Record;
use effect_search::design::least;
use greybox::{Noise, Setup, Triangle};
use plants::{Outlet, OutputScales, Structure};

use super::{
    separation::{Metric, noise_free, priors_of_truth, unlooped, vector},
    simulated::SimulatedExperiment,
};
use crate::{Error, fit::node::Node};

/// The vessel of the additional sensor: the first one that is not measured; `None` if all are measured.
pub(crate) fn place(structure: &Structure) -> Option<usize> {
    let measured = |vessel| {
        let mut outputs = structure.scales.outputs.iter();
        outputs.any(|output| output.vessel == vessel)
    };
    (0..structure.plant.vessels()).find(|vessel| !measured(*vessel))
}

/// The structure with the additional sensor as its last output.
fn with_sensor(structure: &Structure) -> Option<Structure> {
    let vessel = place(structure)?;
    let mut with = structure.clone();
    with.known.measured = structure.known.outputs(structure.plant);
    with.known.measured.push(vessel);
    with.scales.outputs.push(OutputScales {
        vessel,
        ..OutputScales::default()
    });
    Some(with)
}

/// Records with a further output, which has no samples yet.
fn with_output(records: &[Record]) -> Vec<Record> {
    let mut records = records.to_vec();
    for record in &mut records {
        let mut further = record.outputs[0].with_values(vec![0.0; record.len()]);
        further.name = "second sensor".to_string();
        record.outputs.push(further);
    }
    records
}

/// The setup of a model's structure with the additional sensor on records that have it.
fn setup<'a>(node: &Node, records: &'a [Record]) -> Option<Setup<'a>> {
    let structure = with_sensor(&node.setup.structure)?;
    let mut setup = Setup::new(structure, records, node.setup.fixed.clone()).ok()?;
    setup.substeps = node.setup.substeps;
    Some(setup)
}

/// Records simulated by one model, with the additional sensor; `x`: the model's parameter vector for these records.
fn shown(truth: &Node, records: &[Record], x: &[f64]) -> Option<Vec<Record>> {
    let mut records = with_output(records);
    let mut series = setup(truth, &records)?.simulate(x).ok()?.output.into_iter();
    for output in records.iter_mut().flat_map(|record| &mut record.outputs) {
        output.values = series.next()?;
    }
    Some(records)
}

/// The R factor of a model compared with the other's simulation, with the additional sensor among the outputs.
///
/// Where the areas are not known, a level of the other tank is known in units of its own alone: then its sensor's scale and zero are
/// fitted too.
fn rows(stand_in: &Node, x: &[f64], records: &[Record], metric: &Metric) -> Option<Triangle> {
    let setup = setup(stand_in, records)?;
    let structure = &setup.structure;
    let known = structure.plant.outlet() == Outlet::Torricelli && structure.known.area[0].is_some();
    let own = setup.free().len();
    let columns = own + if known { 0 } else { 2 } + 1;
    let last = setup.outputs() - 1;
    let mut rows = setup.rows(x)?;
    if !known {
        let mut series = setup.simulate(x).ok()?.output.into_iter();
        let mut values = Vec::with_capacity(rows.values.len() / rows.columns * columns);
        for (output, own_rows) in rows.series() {
            let levels = series.next()?;
            for (row, level) in own_rows.chunks_exact(own + 1).zip(levels) {
                values.extend_from_slice(&row[..own]);
                let scale_and_zero = [level, 1.0];
                values.extend(scale_and_zero.map(|v| if output == last { v } else { 0.0 }));
                values.push(row[own]);
            }
        }
        (rows.columns, rows.values) = (columns, values);
    }
    let mut models: Vec<_> = metric.noise.iter().cloned().collect();
    models.push(models[0].clone());
    let mut scales = metric.scales.clone();
    scales.push(scales[0]);
    let weights: Vec<f64> = scales.iter().map(|scale| scales[0] / scale).collect();
    let all: Vec<usize> = (0..columns).collect();
    Some(rows.fold(&all, &Noise::of(models), &weights))
}

/// The separation in records like the existing ones, with the level measured too.
pub(crate) fn in_existing(truth: &Node, stand_in: &Node, metric: &Metric) -> Option<f64> {
    let records = noise_free(truth).ok()?;
    let records = shown(truth, &records, &unlooped(truth))?;
    let mut rows = rows(stand_in, &unlooped(stand_in), &records, metric)?;
    let last = rows.columns() - 1;
    for (name, prior) in priors_of_truth(truth, stand_in) {
        let setup = &stand_in.setup;
        let column = |free: &usize| setup.names()[*free] == name;
        // The fitted parameters come first in both vectors.
        if let Some(column) = setup.free().iter().position(column) {
            let scale = metric.scales[0] / prior.std_error;
            let mut row = vec![0.0; last + 1];
            row[column] = scale;
            row[last] = scale * (prior.value - stand_in.fit.x[setup.free()[column]]);
            rows.push(&row);
        }
    }
    rows.finish();
    Some(least(&rows, &Triangle::new(0)) / metric.variance())
}

/// The separation in an experiment simulated with the true model, with the level measured too.
pub(crate) fn in_experiment(
    simulated: &SimulatedExperiment,
    truth: &Node,
    stand_in: &Node,
    known: &Triangle,
    metric: &Metric,
) -> Option<f64> {
    let records = std::slice::from_ref(&simulated.record);
    let begun = |node: &Node| -> Result<Vec<f64>, Error> {
        Ok(vector(node, &node.setup.with_records(records)?, simulated))
    };
    let records = shown(truth, records, &begun(truth).ok()?)?;
    let rows = rows(stand_in, &begun(stand_in).ok()?, &records, metric)?;
    Some(least(&rows, known) / metric.variance())
}
