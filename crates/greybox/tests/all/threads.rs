//! Public types cross threads: where one no longer does, this does not compile.

use greybox::{Error, FitUncertainty, InitialStates, ModelSetup, Setup, Simulated};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<ModelSetup<'static>>();
    crosses::<Setup<'static>>();
    crosses::<Simulated>();
    crosses::<FitUncertainty>();
    crosses::<InitialStates>();
    crosses::<Error>();
};
