//! Where zero of the signals is.

use fcloe::{LoopRecord, Offsets};
use serde::Serialize;

use super::Task;
use crate::Error;
use crate::identify::Method;

/// A loop rests in the first rows if there are so many in which the drive stands still, and the output's means over their two halves
/// are no further apart than this share of its range.
const ROWS_AT_REST: usize = 6;
const MOVES: f64 = 0.03;

/// Where zero of reference, input and output is. The loop has to rest there when the record begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LevelChoice {
    /// Estimated by fcloe; else the rows before the reference moves first, or the means
    #[default]
    Auto,
    /// Estimated with the parameters, by fcloe alone
    Estimated,
    /// Means of the first rows, in which the reference stands still
    Rest,
    /// Means of the record
    Mean,
    /// The signals are deviations already
    Zero,
}

impl Task<'_> {
    /// Where zero is for what cannot estimate it.
    pub(super) fn offsets_at_rest(&self) -> Result<Offsets, Error> {
        let zero = self.centred(Offsets::Deviations)?;
        let (drive, _) = zero.drive(&self.controller)?;
        let still = drive
            .iter()
            .take_while(|v| Some(*v) == drive.first())
            .count();
        Ok(match self.request.levels {
            LevelChoice::Zero => Offsets::Deviations,
            LevelChoice::Mean => Offsets::Means,
            LevelChoice::Rest => Offsets::FirstRows(still),
            LevelChoice::Estimated if self.request.method != Method::Fcloe => {
                return Err(Error::Usage(format!(
                    "--levels estimated is of --method fcloe; {} takes them from the record: rest, mean or zero",
                    self.request.method.id()
                )));
            }
            _ if rests(&zero.y, still) => Offsets::FirstRows(still),
            _ => Offsets::Means,
        })
    }

    /// The levels of drive and output that are subtracted.
    pub(super) fn levels_of(&self, record: &LoopRecord) -> [f64; 2] {
        let point = record.operating_point();
        if self.controller.is_open_loop() {
            [point.u, point.y]
        } else {
            [point.r, point.y]
        }
    }
}

/// Whether the output stands still too while the drive does.
fn rests(y: &[f64], still: usize) -> bool {
    let (first, second) = y[..still].split_at(still / 2);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let (low, high) = crate::plot::limits([y]);
    still >= ROWS_AT_REST
        && still < y.len()
        && (mean(second) - mean(first)).abs() <= MOVES * (high - low)
}

/// Where the levels of a record come from.
pub(super) fn chosen(record: &LoopRecord) -> LevelChoice {
    match record.offsets {
        Offsets::Estimated => LevelChoice::Estimated,
        Offsets::FirstRows(_) => LevelChoice::Rest,
        Offsets::Means => LevelChoice::Mean,
        _ => LevelChoice::Zero,
    }
}
