//! missing-effect
