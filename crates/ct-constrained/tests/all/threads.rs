//! Public types cross threads: where one no longer does, this does not compile.

use ct_constrained::{Bounds, ConstrainedRls, Error, FilteredRow, Row};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<ConstrainedRls<3, 1>>();
    crosses::<FilteredRow<3>>();
    crosses::<Row<3>>();
    crosses::<Bounds<3>>();
    crosses::<Error>();
};
