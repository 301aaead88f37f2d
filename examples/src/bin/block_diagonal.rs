//! The example against the claim that the stabilized output error converges with the block-diagonal gain: no noise, three
//! frequencies, a model of the right order, and it ends elsewhere. The full and the constant gain, which have a proof, converge.
//!
//! With `V = delta' P^-1 delta` over the parameters and the error filter the proof would need `V` to fall. For the full gain it falls at
//! least by `eta`; for the block-diagonal gain it rises.
//!
//! `cargo run --release -p ctid-examples --bin block_diagonal` prints the ends and writes `block_diagonal.svg`; it is the picture
//! in `docs`.

use std::error::Error;
use std::path::Path;

use ctid_examples::picture::{self, Curve, Panel};
use paper_tables::udink::gains::{Counterexample, TRUTH, counterexample};

fn main() -> Result<(), Box<dyn Error>> {
    let found = counterexample()?;
    println!("truth           {TRUTH:.3?}");
    for Counterexample {
        gain,
        end,
        lyapunov,
        ..
    } in &found
    {
        let lowest = lyapunov.iter().copied().fold(f64::INFINITY, f64::min);
        let last = lyapunov.last().copied().unwrap_or(f64::NAN);
        println!(
            "{:<15} {end:.3?}  V at the end {:.1e}, {:.1} times its lowest",
            gain.name(),
            last,
            last / lowest
        );
    }
    let parameters = [("a1 [s], true value 1", 0), ("a2 [s^2], true value 1", 1)];
    let mut panels: Vec<Panel> = parameters
        .into_iter()
        .map(|(title, i)| panel(title, &found, |run| run.theta[i].clone()))
        .collect();
    panels.push(panel("V, which the proof needs to fall", &found, |run| {
        run.lyapunov.clone()
    }));
    let title = "Without noise: three gains, one record".to_owned();
    let file = Path::new("block_diagonal.svg");
    picture::write(file, &[(title, panels)])?;
    println!("wrote {}", file.display());
    Ok(())
}

fn panel(
    title: &str,
    found: &[Counterexample],
    values: impl Fn(&Counterexample) -> Vec<f64>,
) -> Panel {
    let curves = found
        .iter()
        .map(|run| Curve {
            name: run.gain.name(),
            points: run.time.iter().copied().zip(values(run)).collect(),
        })
        .collect();
    Panel {
        title: title.to_owned(),
        curves,
    }
}
