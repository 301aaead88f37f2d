//! Signature of valve stiction in a loop: the output is constant while the command changes, then it jumps.
//!
//! An integrating controller drives the command across the band of the valve, which follows in one slip: a triangle of the command beside a
//! rectangle of the output. The instants of the slips depend on the noise, so no simulation from the command predicts all of them, and the
//! error falls by a part only, even for a clearly sticking valve. The shape is detected without any model.
//!
//! **Reference**: M. Kano, H. Maruta, H. Kugemoto, K. Shimizu, Practical model and detection algorithm for valve stiction, Proc. IFAC
//! DYCOPS 2004, 859-864.

use crate::fit::series::series;
use ct_signals::Record;
use statrs::statistics::{Data, OrderStatistics};

/// A jump is a change of the output by more than this share of its range (95 %) within this number of samples.
const JUMP: (f64, usize) = (0.4, 4);
/// Between two jumps the output is constant if its spread (80 %) is below this share of its range ...
const STILL: f64 = 0.35;
/// ... while the command moves over more than this share of its own range, and relatively more than the output by this factor.
const MOVED: (f64, f64) = (0.25, 1.2);
/// Fewest samples of a plateau.
const SHORTEST: usize = 6;
/// The valve sticks if there are this many plateaus, this share of the jumps leads to plateaus, and the plateaus cover this share of the
/// record.
const PLATEAUS: usize = 3;
const OF_JUMPS: f64 = 0.5;
const OF_RECORD: f64 = 0.35;

/// Plateaus of the output while the command changes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shape {
    jumps: usize,
    plateaus: usize,
    /// The share of the record that plateaus cover.
    share: f64,
}

/// Whether some record has the signature of valve stiction.
pub(crate) fn sticks(records: &[Record]) -> bool {
    series(records).any(|(record, output)| {
        let shape = shape(&record.inputs[0].values, &output.interpolated());
        shape.plateaus >= PLATEAUS
            && shape.plateaus as f64 >= OF_JUMPS * shape.jumps as f64
            && shape.share >= OF_RECORD
    })
}

/// The width of the central interval that contains this share of the values.
fn spread(values: &[f64], share: f64) -> f64 {
    let mut data = Data::new(values.to_vec());
    data.quantile(0.5 + 0.5 * share) - data.quantile(0.5 - 0.5 * share)
}

fn shape(command: &[f64], output: &[f64]) -> Shape {
    let none = Shape {
        jumps: 0,
        plateaus: 0,
        share: 0.0,
    };
    let n = command.len().min(output.len());
    let (part, within) = JUMP;
    if n < 4 * SHORTEST {
        return none;
    }
    let (moves, range) = (spread(command, 1.0), spread(output, 0.95));
    if !(moves > 0.0 && range > 0.0) {
        return none;
    }
    // Instants of the jumps, each at its steepest change.
    let change = |k: usize| (output[k + within] - output[k]).abs();
    let mut edges = vec![0];
    let mut k = 0;
    while k + within < n {
        let mut steepest = None;
        while k + within < n && change(k) > part * range {
            if steepest.is_none_or(|at| change(k) > change(at)) {
                steepest = Some(k);
            }
            k += 1;
        }
        match steepest {
            Some(at) => {
                edges.push(at + within / 2);
                k += within;
            }
            None => k += 1,
        }
    }
    let jumps = edges.len() - 1;
    edges.push(n);
    let (mut plateaus, mut samples) = (0, 0);
    for edge in edges.windows(2) {
        let (from, to) = (edge[0] + within, edge[1].saturating_sub(within));
        if to < from + SHORTEST {
            continue;
        }
        let still = spread(&output[from..to], 0.8) / range;
        let moved = spread(&command[from..to], 1.0) / moves;
        if still < STILL && moved > MOVED.0 && moved > MOVED.1 * still {
            plateaus += 1;
            samples += to - from;
        }
    }
    Shape {
        jumps,
        plateaus,
        share: samples as f64 / n as f64,
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    /// A flow loop under an integrating controller; the valve stays until the command is farther from it than half the band.
    fn loop_shape(band: f64, noise: f64, seed: u64) -> Shape {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut u, mut valve, mut flow, mut slow) = (0.0, 0.0, 0.0, 0.0);
        let (mut command, mut output) = (Vec::new(), Vec::new());
        for _ in 0..750 {
            let [white, step]: [f64; 2] = std::array::from_fn(|_| rng.sample(StandardNormal));
            slow = 0.95 * slow + 0.1 * step;
            let y: f64 = flow + noise * (white + slow);
            u += 0.05 * (0.3 - y);
            let gap: f64 = u - valve;
            if gap.abs() > band {
                valve = u;
            }
            flow += 0.6 * (valve - flow);
            command.push(u);
            output.push(y);
        }
        shape(&command, &output)
    }

    fn is_seen(shape: Shape) -> bool {
        shape.plateaus >= PLATEAUS
            && shape.plateaus as f64 >= OF_JUMPS * shape.jumps as f64
            && shape.share >= OF_RECORD
    }

    #[test]
    fn a_valve_that_sticks_is_seen_and_one_that_follows_is_not() {
        let seen = |band: f64| {
            (0..40)
                .filter(|&seed| is_seen(loop_shape(band, 0.05, seed)))
                .count()
        };
        assert!(seen(0.5) >= 38, "{}", seen(0.5));
        assert_eq!(seen(0.0), 0);
    }
}
