//! Public types cross threads: where one no longer does, this does not compile.

use monitor::{Alarm, Error, Model, Monitor, OwnModel, RowResult, State};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<Monitor>();
    crosses::<Model>();
    crosses::<OwnModel>();
    crosses::<RowResult>();
    crosses::<State>();
    crosses::<Alarm>();
    crosses::<Error>();
};
