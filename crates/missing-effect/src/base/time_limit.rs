//! Time limit of a search: the share of each phase, and the steps that were left out.

use std::sync::atomic::Ordering;

use crate::{Effort, Options, fit::node::Node};

/// Allows the fits of a search until this share of its time has passed.
pub(crate) fn allow(node: &Node, share: f64) {
    if let Some(limit) = &node.setup.time_limit {
        limit.allow(share);
    }
}

/// Steps that the time limit left out of a search.
pub(crate) fn effort(node: &Node, options: &Options) -> Effort {
    let limit = node.setup.time_limit.as_ref();
    let interrupted = options
        .interrupt
        .is_some_and(|interrupt| interrupt.load(Ordering::Relaxed));
    Effort {
        limit: options.time_limit.map(|limit| limit.as_secs_f64()),
        left_out: limit.map_or_else(Vec::new, |limit| limit.left_out()),
        interrupted,
    }
}
