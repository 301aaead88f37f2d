//! Public types cross threads: where one no longer does, this does not compile.

use paper_tables::{Error, Printed, Progress, baysse, udink};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<udink::Study>();
    crosses::<baysse::Rig>();
    crosses::<Printed>();
    crosses::<Progress>();
    crosses::<Error>();
};
