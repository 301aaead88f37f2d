//! Public types cross threads: where one no longer does, this does not compile.

use monitor::{Alarm, Error, Model, Monitor, OwnModel, State, Step};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<Monitor>();
    crosses::<Model>();
    crosses::<OwnModel>();
    crosses::<Step>();
    crosses::<State>();
    crosses::<Alarm>();
    crosses::<Error>();
};
