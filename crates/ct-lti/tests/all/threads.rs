//! Public types cross threads: where one no longer does, this does not compile.

use ct_lti::{
    Error, Polynomial, ReadingFilter, Sampled, Simulator, StateSpace, StateVariableFilter,
    TransferFunction,
};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<Polynomial>();
    crosses::<TransferFunction>();
    crosses::<StateSpace>();
    crosses::<Sampled>();
    crosses::<Simulator>();
    crosses::<StateVariableFilter>();
    crosses::<ReadingFilter>();
    crosses::<Error>();
};
