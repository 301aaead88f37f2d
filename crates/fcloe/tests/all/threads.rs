//! Public types cross threads: where one no longer does, this does not compile.

use fcloe::{
    Controller, Error, Fit, LoopRecord, LoopSimulator, PlantModel, Problem, RecursiveFcloe,
    Uncertainty,
};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<PlantModel>();
    crosses::<Controller>();
    crosses::<LoopRecord>();
    crosses::<Problem>();
    crosses::<Fit>();
    crosses::<Uncertainty>();
    crosses::<RecursiveFcloe>();
    crosses::<LoopSimulator>();
    crosses::<Error>();
};
