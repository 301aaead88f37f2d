//! Prints the number of samples after which the textbook's covariance update fails, for the table in the crate's documentation.
#![allow(missing_docs)]

#[path = "../tests/all/support/mod.rs"]
mod support;

use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};
use support::normals;
use support::textbook::{Form, Textbook};

const SEEDS: u64 = 20;
const LIMIT: u32 = 200_000;

/// Number of updates until the textbook's update fails.
fn textbook<const P: usize>(form: Form, lambda: f64, seed: u64) -> u32 {
    let mut rng = support::rng(seed);
    let theta: SVector<f64, P> = normals(&mut rng);
    let mut textbook = Textbook::<P>::new(form, 1e3, lambda);
    for k in 1..LIMIT {
        let phi: SVector<f64, P> = normals(&mut rng);
        textbook.update(&phi, theta.dot(&phi));
        let off = k > 1000 && (textbook.theta - theta).norm() >= 0.01 * theta.norm();
        if off || !textbook.positive_definite() {
            return k;
        }
    }
    LIMIT
}

/// The relative error of this crate's estimate after `LIMIT` samples.
fn exact<const P: usize>(lambda: f64, seed: u64) -> Result<f64, ct_rls::Error> {
    let mut rng = support::rng(seed);
    let theta: SVector<f64, P> = normals(&mut rng);
    let weights = Weights::from_forgetting_factor(lambda, 1.0)?;
    let mut rls = ContinuousRls::new(SVector::zeros(), SMatrix::identity() * 1e3, weights)?;
    for _ in 0..LIMIT {
        let phi: SVector<f64, P> = normals(&mut rng);
        let y = theta.dot(&phi);
        rls.update(&Sample { phi, y }, 1.0);
    }
    rls.health()?;
    Ok((rls.theta() - theta).norm() / theta.norm())
}

fn column<const P: usize>(form: Form, lambda: f64) -> String {
    let mut died: Vec<u32> = (0..SEEDS)
        .map(|seed| textbook::<P>(form, lambda, seed))
        .collect();
    died.sort_unstable();
    let last = died.len() - 1;
    if died[0] == LIMIT {
        return "alive".into();
    }
    format!("{} ({} to {})", died[died.len() / 2], died[0], died[last])
}

fn main() -> Result<(), ct_rls::Error> {
    println!(
        "| lambda | `k g'`, p = 2 | `k g'`, p = 5 | `k phi'P`, p = 2 | `k phi'P`, p = 5 | this crate: relative error |"
    );
    println!("|---|---|---|---|---|---|");
    for lambda in [0.95, 0.98, 0.99, 0.999] {
        println!(
            "| {lambda} | {} | {} | {} | {} | {:.0e} |",
            column::<2>(Form::Outer, lambda),
            column::<5>(Form::Outer, lambda),
            column::<2>(Form::Product, lambda),
            column::<5>(Form::Product, lambda),
            exact::<2>(lambda, 0)?.max(exact::<5>(lambda, 0)?),
        );
    }
    Ok(())
}
