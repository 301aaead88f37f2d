//! Public types cross threads: where one no longer does, this does not compile.

use ctid::{
    Error,
    own_model::{Comparison, FittedModel, OwnModelFile, Records},
};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<OwnModelFile>();
    crosses::<Records>();
    crosses::<FittedModel>();
    crosses::<Comparison>();
    crosses::<Error>();
};
