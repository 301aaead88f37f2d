//! Public types cross threads: where one no longer does, this does not compile.

use ct_model::{
    LinearForm, Model, ModelSpec, NoSolution, SharedSimulation, Simulation, TextError,
    effects::Candidate,
};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<ModelSpec>();
    crosses::<Model>();
    crosses::<Simulation<'static, f64>>();
    crosses::<SharedSimulation<f64>>();
    crosses::<LinearForm>();
    crosses::<Candidate>();
    crosses::<TextError>();
    crosses::<NoSolution>();
};
