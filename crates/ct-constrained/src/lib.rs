//! Recursive least squares in continuous time with equality constraints, penalties and projections.
#![no_std]
