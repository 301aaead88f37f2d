//! Number of finished runs, and parallel runs that report it.
//!
//! Progress is reported to a trait object: functions that are generic in it would be compiled in each crate that calls them.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::Error;

/// Number of finished runs of a stage. Reports come from several threads, so a smaller count may follow a larger one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Name of the stage.
    pub stage: Stage,
    /// Runs that are done, 1 to `total`.
    pub done: usize,
    /// Runs of the stage.
    pub total: usize,
}

/// What is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Tables 1 to 4 of Udink ten Cate.
    UdinkTables,
    /// The tables with one setting changed.
    UdinkOtherSettings,
    /// Table 1 of Udink ten Cate with larger `P(0)`.
    UdinkLargerP,
    /// The three gains of the stabilized output error.
    UdinkGains,
    /// Table I of Baysse, Carrillo and Habbadi.
    BaysseTableOne,
    /// Table II of Baysse, Carrillo and Habbadi.
    BaysseTableTwo,
}

/// Runs 0 to `total - 1` in parallel, the results in their order; every run that ends is reported.
pub(crate) fn in_parallel<T: Send>(
    total: usize,
    stage: Stage,
    progress: &(dyn Fn(Progress) + Sync),
    run: impl Fn(usize) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let counter = Counter::new(total, stage, progress);
    let run = |index| {
        let found = run(index)?;
        counter.one_more();
        Ok(found)
    };
    (0..total).into_par_iter().map(run).collect()
}

/// Counts finished runs and reports the count.
pub(crate) struct Counter<'a> {
    stage: Stage,
    total: usize,
    done: AtomicUsize,
    progress: &'a (dyn Fn(Progress) + Sync),
}

impl<'a> Counter<'a> {
    pub(crate) fn new(total: usize, stage: Stage, progress: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self {
            stage,
            total,
            done: AtomicUsize::new(0),
            progress,
        }
    }

    /// Counts one more run.
    pub(crate) fn one_more(&self) {
        (self.progress)(Progress {
            stage: self.stage,
            done: self.done.fetch_add(1, Ordering::Relaxed) + 1,
            total: self.total,
        });
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn every_run_is_reported_once_and_results_keep_their_order() {
        let counts = Mutex::new(Vec::new());
        let report = |progress: Progress| {
            assert_eq!((progress.stage, progress.total), (Stage::UdinkGains, 40));
            counts.lock().unwrap().push(progress.done);
        };
        let found = in_parallel(40, Stage::UdinkGains, &report, |index| Ok(2 * index)).unwrap();
        assert_eq!(found, (0..40).map(|index| 2 * index).collect::<Vec<_>>());
        let mut counts = counts.into_inner().unwrap();
        counts.sort_unstable();
        assert_eq!(counts, (1..=40).collect::<Vec<_>>());
    }
}
