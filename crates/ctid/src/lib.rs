//! ctid
