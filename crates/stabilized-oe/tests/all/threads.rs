//! Public types cross threads: where one no longer does, this does not compile.

use stabilized_oe::{BlockDiagonal, CoupledRow, Error, Full, StabilizedOe, StateVariableFilters};

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<StabilizedOe<2, 3, BlockDiagonal<2, 3>, StateVariableFilters<2>>>();
    crosses::<Full<2, 3, 5>>();
    crosses::<CoupledRow<2, 3>>();
    crosses::<Error>();
};
