//! The progress of `ctid tables` for the progress bar.

use missing_effect::Progress;
use paper_tables::Stage;

/// Progress in the units of the bar.
pub(crate) fn for_bar(progress: paper_tables::Progress) -> Progress {
    let paper_tables::Progress { stage, done, total } = progress;
    Progress {
        phase: phase(stage),
        done,
        total,
    }
}

fn phase(stage: Stage) -> &'static str {
    match stage {
        Stage::UdinkTables => "running tables 1 to 4",
        Stage::UdinkOtherSettings => "running tables 1 to 4 with other settings",
        Stage::UdinkLargerP => "running table 1 with larger P(0)",
        Stage::UdinkGains => "comparing the gains",
        Stage::BaysseTableOne => "table I",
        Stage::BaysseTableTwo => "table II, the emulated rig",
        _ => "running",
    }
}
