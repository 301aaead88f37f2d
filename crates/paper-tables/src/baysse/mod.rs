//! Tables I and II and figure 3 of A. Baysse, F. J. Carrillo, A. Habbadi: a tank level in a loop, identified by least squares, by
//! instruments, and by closed-loop output error.
//!
//! Table I is a simulation of the linear loop. Table II is measured on a rig, which is emulated here. What the paper leaves open was found
//! by a search against its own tables. What it prints is in [`printed`].

mod cell;
pub mod printed;
mod rig;
mod table_one;
mod table_two;

use fcloe::{Coordinates, Damping, Fit, Method};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde::Serialize;

pub use cell::Cell;
pub use rig::Rig;
pub use table_one::{Counts, FirstTable, TRUTH};
pub use table_two::{Figure, Fits, SecondTable};

use self::printed::MISPRINTS;
use crate::{Error, Progress};

/// Least number of runs for which variances are given.
pub const FEWEST: usize = 10;

/// The paper's iterations are counted to the first step that changes no parameter by more than this share.
const COUNTED_TO: f64 = 1e-2;

/// Tables I and II with many noises.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Study {
    /// Version of this record.
    pub schema: u32,
    /// `baysse`
    pub paper: &'static str,
    /// Runs of each table, 10 or more, each with a noise of its own.
    pub runs: usize,
    /// Seed of the noises.
    pub seed: u64,
    /// Assumptions about details that the paper omits, one sentence each.
    pub assumptions: Vec<String>,
    /// Figures that cannot be correct as printed, one sentence each.
    pub misprints: Vec<&'static str>,
    /// All cells, in the paper's order.
    pub tables: Vec<Cell>,
    /// Number of cells inside their band.
    pub inside: usize,
    /// Number of cells with a band.
    pub of: usize,
    /// Table I.
    pub first: FirstTable,
    /// Table II.
    pub second: SecondTable,
}

impl Study {
    /// Cells with a printed figure and a band, and the distance of the figure from the band as a share of its width.
    pub fn printed(&self) -> impl Iterator<Item = (&Cell, f64)> {
        let cells = self.tables.iter();
        cells.filter_map(|cell| Some((cell, cell.paper_outside?)))
    }

    /// Cells that have a band and lie outside.
    pub fn outside(&self) -> impl Iterator<Item = &Cell> {
        self.tables.iter().filter(|cell| cell.inside == Some(false))
    }
}

/// Runs both tables with `runs` noises each, 10 or more, drawn from `seed`.
///
/// The same seed gives the same numbers, whatever the number of threads.
///
/// # Errors
/// [`Error::TooFewRunsForVariance`]; no other in practice, as all settings are fixed and sound.
pub fn study(runs: usize, seed: u64, progress: &(dyn Fn(Progress) + Sync)) -> Result<Study, Error> {
    if runs < FEWEST {
        return Err(Error::TooFewRunsForVariance {
            runs,
            fewest: FEWEST,
        });
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
        assumptions: [table_one::assumptions(), table_two::assumptions()].concat(),
        misprints: MISPRINTS.to_vec(),
        inside: banded().filter(|inside| *inside).count(),
        of: banded().count(),
        tables,
        first,
        second,
    })
}

/// Settings of a fit by Levenberg and Marquardt from the first mu; it converges to 1e-8.
fn settings(mu: f64, damping: Damping, coordinates: Coordinates) -> fcloe::Settings {
    fcloe::Settings {
        method: Method::LevenbergMarquardt { mu, damping },
        coordinates,
        ..fcloe::Settings::default()
    }
}

/// Steps of a converged fit to the first that changes no parameter by more than 1 %: what the paper counts.
fn iterations(fit: &Fit) -> usize {
    let small = fit.way.windows(2).position(|pair| {
        let mut parameters = pair[0].theta.iter().zip(&pair[1].theta);
        parameters.all(|(old, new)| (new - old).abs() <= COUNTED_TO * old.abs())
    });
    small.map_or(fit.iterations, |step| step + 1)
}

/// Gain and time constant (s) of a plant of first order.
fn gain_and_time(plant: &fcloe::PlantModel) -> [f64; 2] {
    match plant.theta() {
        &[tau, gain] => [gain, tau],
        _ => [f64::NAN; 2],
    }
}

/// Random numbers of a run: a stream of the generator for each run of each table.
fn generator(seed: u64, table: u64, run: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(2 * run as u64 + table);
    rng
}
