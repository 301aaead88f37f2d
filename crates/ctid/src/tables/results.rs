//! Files of `ctid tables`: the results of each paper as JSON and as a page, and the record of the emulated rig.

use paper_tables::{baysse, udink};
use serde::Serialize;

use super::rig_csv;
use crate::output::Found;
use crate::report;

impl Found for udink::Study {
    fn page(&self) -> String {
        report::udink(self)
    }
}

impl Found for baysse::Study {
    fn page(&self) -> String {
        report::baysse(self)
    }

    fn record(&self) -> Option<String> {
        Some(rig_csv::text(&self.second.record))
    }
}

/// The tables of both papers.
#[derive(Debug, Serialize)]
pub(crate) struct Studies {
    /// Version of the JSON.
    pub(crate) schema: u32,
    /// Udink ten Cate, tables 1 to 4.
    pub(crate) udink: udink::Study,
    /// Baysse, Carrillo and Habbadi, tables I and II.
    pub(crate) baysse: baysse::Study,
}

/// Each paper has a separate page; the program refuses to write one page for both.
impl Found for Studies {}
