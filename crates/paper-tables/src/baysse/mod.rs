//! Tables I and II and figure 3 of the second paper: a tank level in a loop, by least squares, instruments and closed-loop output error.
//!
//! Table I is a simulation of the linear loop, table II a rig, which is emulated here. What the paper leaves open was found by a search
//! against its own tables.
//!
//! Reference: [`paper_baysse`](super::paper_baysse).

mod linear;
mod rig;

use std::sync::atomic::{AtomicUsize, Ordering};

use ct_signals::{Channel, Record};
use fcloe::{Coordinates, Damping, Fit, Method, Settings};
use missing_effect::Progress;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rayon::prelude::*;
use serde::Serialize;

use super::Printed;
use super::paper_baysse::MISPRINTS;
use crate::Error;

pub use linear::{Counts, FirstTable, TRUTH};
pub use rig::{Figure, Fits, Rig, SecondTable};

/// The fewest runs of which variances can be told.
pub const FEWEST: usize = 10;

/// The runs that the bands are for.
const BAND_RUNS: f64 = 100.0;

/// The paper's iterations are counted to the first step that changes no parameter by more than this share.
const COUNTED_TO: f64 = 1e-2;

/// A statistic of many runs beside what is printed, and the band it has to be in.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// Number of the table in the paper.
    pub table: usize,
    /// How it was estimated.
    pub method: &'static str,
    /// Method and what it is of.
    pub cell: String,
    /// What it is of.
    #[serde(skip)]
    pub of: &'static str,
    /// The figure that is printed, if any.
    pub paper: Option<f64>,
    /// Decimals of it.
    #[serde(skip)]
    pub decimals: usize,
    /// The statistic of the runs; NaN (`null`) where none came to its end.
    pub mean: f64,
    /// Its standard deviation from one set of so many runs to another, by the jackknife.
    pub sd: f64,
    /// Where it has to be, for a reproduction; an end that is `null` is open.
    pub band: Option<[f64; 2]>,
    /// Whether it is; nothing without a band.
    pub inside: Option<bool>,
    /// By how much of the band's width the printed figure lies outside the same band, 0 where it is inside; nothing where it or a band with
    /// two ends is missing. What is printed may be off by half of its last digit.
    pub paper_outside: Option<f64>,
}

/// What is asked of a cell.
#[derive(Debug, Clone, Copy)]
struct Asked {
    table: usize,
    method: &'static str,
    of: &'static str,
    paper: Option<Printed>,
    band: Option<[f64; 2]>,
}

impl Cell {
    /// A statistic of what is finite.
    fn new<T: Copy>(asked: Asked, runs: &[T], statistic: impl Fn(&[T]) -> f64) -> Self {
        let mean = statistic(runs);
        let inside = asked.band.map(|[low, high]| low <= mean && mean <= high);
        Self {
            table: asked.table,
            method: asked.method,
            cell: format!("{} {}", asked.method, asked.of),
            of: asked.of,
            paper: asked.paper.map(|paper| paper.value),
            decimals: asked.paper.map_or(0, |paper| paper.decimals),
            mean,
            sd: jackknife(runs, statistic),
            band: asked.band,
            inside,
            paper_outside: asked
                .paper
                .zip(asked.band)
                .and_then(|(paper, band)| beyond(paper, band)),
        }
    }
}

/// By how much of its width a printed figure lies outside a band.
fn beyond(paper: Printed, [low, high]: [f64; 2]) -> Option<f64> {
    let off = (low - paper.value).max(paper.value - high) - paper.rounding;
    let width = high - low;
    width.is_finite().then(|| off.max(0.0) / width)
}

/// Standard deviation of a statistic: each run is left out once.
fn jackknife<T: Copy>(runs: &[T], statistic: impl Fn(&[T]) -> f64) -> f64 {
    let n = runs.len() as f64;
    let mut others = Vec::with_capacity(runs.len());
    let without = (0..runs.len()).map(|left_out| {
        others.clear();
        others.extend_from_slice(&runs[..left_out]);
        others.extend_from_slice(&runs[left_out + 1..]);
        statistic(&others)
    });
    let without: Vec<f64> = without.collect();
    (n - 1.0) * variance(&without).max(0.0).sqrt() / n.sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// With n - 1.
fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0)
}

/// A band for 100 runs, made wider for fewer.
fn band_for(runs: usize, [low, high]: [f64; 2]) -> [f64; 2] {
    let wider = (BAND_RUNS / runs as f64).sqrt().max(1.0);
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    [middle - wider * half, middle + wider * half]
}

/// A fit, and the iterations that the paper would have counted.
fn settings(mu: f64, damping: Damping, coordinates: Coordinates) -> Settings {
    Settings {
        method: Method::LevenbergMarquardt { mu, damping },
        coordinates,
        ..Settings::default()
    }
}

/// Steps to the first that is small, of a fit that went on to the minimum.
fn iterations(fit: &Fit) -> usize {
    let small = fit.way.windows(2).position(|pair| {
        let mut parameters = pair[0].theta.iter().zip(&pair[1].theta);
        parameters.all(|(old, new)| (new - old).abs() <= COUNTED_TO * old.abs())
    });
    small.map_or(fit.iterations, |step| step + 1)
}

/// Gain and time constant of a plant of first order.
fn gain_and_time(plant: &fcloe::PlantModel) -> [f64; 2] {
    match plant.theta() {
        &[tau, gain] => [gain, tau],
        _ => [f64::NAN; 2],
    }
}

/// What `ctid tables baysse` finds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Study {
    /// Version of this record.
    pub schema: u32,
    /// `baysse`
    pub paper: &'static str,
    /// Runs of each table, each with a noise of its own.
    pub runs: usize,
    /// What the noises were drawn from.
    pub seed: u64,
    /// What the paper leaves open, in words.
    pub assumptions: Vec<String>,
    /// What cannot be as it is printed.
    pub misprints: Vec<&'static str>,
    /// All cells, in the paper's order.
    pub tables: Vec<Cell>,
    /// How many cells with a band lie inside.
    pub inside: usize,
    /// How many have one.
    pub of: usize,
    /// Table I.
    pub first: FirstTable,
    /// Table II.
    pub second: SecondTable,
}

impl Study {
    /// Cells whose printed figure can be held against a band.
    pub fn printed(&self) -> impl Iterator<Item = (&Cell, f64)> {
        let cells = self.tables.iter();
        cells.filter_map(|cell| Some((cell, cell.paper_outside?)))
    }

    /// Cells that have a band and lie outside.
    pub fn outside(&self) -> impl Iterator<Item = &Cell> {
        self.tables.iter().filter(|cell| cell.inside == Some(false))
    }
}

/// Runs both tables.
///
/// # Errors
/// [`Error::Usage`] for fewer than 10 runs; otherwise none that a user could cause.
pub fn study(
    runs: usize,
    seed: u64,
    progress: &(impl Fn(Progress) + Sync),
) -> Result<Study, Error> {
    if runs < FEWEST {
        return Err(Error::Usage(format!(
            "--runs is {runs}, but variances need {FEWEST} or more"
        )));
    }
    let first = FirstTable::new(runs, seed, progress)?;
    let second = SecondTable::new(runs, seed, progress)?;
    let tables = [first.cells(), second.cells()].concat();
    let banded = || tables.iter().filter_map(|cell| cell.inside);
    Ok(Study {
        schema: 1,
        paper: "baysse",
        runs,
        seed,
        assumptions: [linear::assumptions(), rig::assumptions()].concat(),
        misprints: MISPRINTS.to_vec(),
        inside: banded().filter(|inside| *inside).count(),
        of: banded().count(),
        tables,
        first,
        second,
    })
}

/// All runs of a table, in parallel.
fn all<T: Send>(
    runs: usize,
    phase: &'static str,
    progress: &(impl Fn(Progress) + Sync),
    run: impl Fn(usize) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let done = AtomicUsize::new(0);
    let run = |index| {
        let found = run(index)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress(Progress {
            phase,
            done,
            total: runs,
        });
        Ok(found)
    };
    (0..runs).into_par_iter().map(run).collect()
}

/// Random numbers of a run: a stream of its own for each table.
fn generator(seed: u64, table: u64, run: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(2 * run as u64 + table);
    rng
}

/// A record as text that [`ct_signals::read_csv`] reads.
pub fn csv(record: &Record) -> String {
    let column = |name: &str, unit: &str| format!("{name} [{unit}]");
    let signals: Vec<&Channel> = record.channels().collect();
    let mut header = vec![column("t", "s")];
    header.extend(
        signals
            .iter()
            .map(|signal| column(&signal.name, &signal.unit)),
    );
    let mut text = header.join(",") + "\n";
    for (k, time) in record.time.iter().enumerate() {
        let values = signals.iter().filter_map(|signal| signal.values.get(k));
        let mut row = vec![time.to_string()];
        row.extend(values.map(|value| format!("{value:.4}")));
        text += &(row.join(",") + "\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jackknife_of_a_mean_is_its_standard_error() {
        let values = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0];
        let error = (variance(&values) / 8.0).sqrt();
        assert!((jackknife(&values, mean) / error - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_printed_figure_is_outside_by_a_share_of_the_band() {
        let outside = |value, decimals, band| beyond(Printed::new(value, decimals), band);
        assert_eq!(outside(5.9, 2, [5.8, 6.0]), Some(0.0));
        let above = outside(6.1, 2, [5.8, 6.0]).unwrap();
        assert!((above - 0.095 / 0.2).abs() < 1e-9, "{above}");
        // Its last digit reaches the band.
        assert_eq!(outside(6.004, 2, [5.8, 6.0]), Some(0.0));
        assert_eq!(outside(3.0, 1, [7.5, f64::INFINITY]), None);
    }

    #[test]
    fn bands_grow_for_fewer_runs_only() {
        let near = |found: [f64; 2], low: f64, high: f64| {
            assert!((found[0] - low).abs() < 1e-12 && (found[1] - high).abs() < 1e-12);
        };
        near(band_for(400, [1.0, 3.0]), 1.0, 3.0);
        near(band_for(25, [1.0, 3.0]), 0.0, 4.0);
    }

    /// The loop rests where it is said to, and what is written is what was recorded.
    #[test]
    fn the_rig_rests_and_its_record_can_be_read() {
        let quiet = Rig {
            noise: 0.0,
            amplitude: 1e-9,
            ..Rig::default()
        };
        let record = quiet.record(1, 0).unwrap();
        let moved = |signal: &Channel| signal.range().1 - signal.range().0;
        assert!(moved(&record.outputs[0]) < 2e-3 && moved(&record.inputs[0]) < 2e-3);

        let record = Rig::default().record(1, 0).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rig.csv");
        std::fs::write(&path, csv(&record)).unwrap();
        let columns = ct_signals::Columns::default();
        let read = ct_signals::read_csv(&path, &columns, &record.hold().into())
            .unwrap()
            .record;
        assert_eq!(
            (&read.time, &read.outputs[0].unit),
            (&record.time, &record.outputs[0].unit)
        );
        let pairs = |a: &Channel, b: &Channel| -> f64 {
            let off = a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs());
            off.fold(0.0, f64::max)
        };
        assert!(pairs(&read.outputs[0], &record.outputs[0]) < 6e-5);
        assert!(pairs(&read.inputs[0], &record.inputs[0]) < 6e-5);
        let [there, here] = [&read, &record].map(|r| r.references[0].clone());
        assert!(pairs(&there, &here) < 6e-5);
    }
}
