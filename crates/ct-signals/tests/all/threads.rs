//! Public types cross threads: where one no longer does, this does not compile.

use ct_signals::{
    ArModel, Calendar, Clock, Error, Gaps, ReadSummary, Record, StationaryNoise,
    StationaryWhitener, Whitener,
};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<Record>();
    crosses::<ReadSummary>();
    crosses::<Gaps>();
    crosses::<Calendar>();
    crosses::<Clock>();
    crosses::<ArModel>();
    crosses::<Whitener>();
    crosses::<StationaryNoise>();
    crosses::<StationaryWhitener>();
    crosses::<Error>();
};
