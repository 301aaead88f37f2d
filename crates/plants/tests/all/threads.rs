//! Public types cross threads: where one no longer does, this does not compile.

use plants::{Error, Simulator, Structure, Term, controller::Controller};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<Structure>();
    crosses::<Simulator<f64>>();
    crosses::<Term>();
    crosses::<Controller>();
    crosses::<Error>();
};
