//! A drifting tank with an inlet that stays closed for ten million samples: comparison of forgetting methods.
#![allow(missing_docs)]

#[path = "../tests/all/support/mod.rs"]
mod support;

use std::time::Instant;

use ct_rls::{ContinuousRls, Directional, Error, ExactHold, Integrator, RandomWalk, Weights};
use nalgebra::{SMatrix, SVector, vector};
use support::drifting_tank::run;

const SAMPLES: u64 = 10_000_000;

fn estimator<I: Integrator>(eta: f64) -> Result<ContinuousRls<3, I>, Error> {
    let p0 = SMatrix::identity() * 1e3;
    ContinuousRls::with_integrator(SVector::zeros(), p0, Weights::least_squares(eta)?)
}

fn print<I: Integrator>(name: &str, rls: ContinuousRls<3, I>) -> Result<(), Error> {
    let start = Instant::now();
    let run = run(rls, SAMPLES)?;
    let worst = run.drifting.map(|x| format!("{:.1}", 100.0 * x)).join(" ");
    println!(
        "| {name} | {worst} | {:.1} | {:.2e} | {:.2e} | {} | {:.1} |",
        100.0 * run.constant,
        run.largest,
        run.smallest_pivot,
        run.capped,
        start.elapsed().as_secs_f64()
    );
    Ok(())
}

fn main() -> Result<(), Error> {
    println!(
        "{SAMPLES} samples; errors in percent, the largest of a and b in each tenth of the run"
    );
    println!(
        "| forgetting | a and b, which drift | the silent g | largest entry of P | smallest pivot | capped steps | s |"
    );
    println!("|---|---|---|---|---|---|---|");
    print("directional, eta = 1", estimator::<Directional>(1.0)?)?;
    print(
        "random walk, q = 0.3, 0.3, 0",
        estimator::<RandomWalk>(0.0)?.with_intensity(vector![0.3, 0.3, 0.0])?,
    )?;
    print(
        "random walk, q = 0.3, 0.3, 0.3",
        estimator::<RandomWalk>(0.0)?.with_intensity(vector![0.3, 0.3, 0.3])?,
    )?;
    print(
        "exponential, eta = 0.5, guarded",
        estimator::<ExactHold>(0.5)?,
    )
}
