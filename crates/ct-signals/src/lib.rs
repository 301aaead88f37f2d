//! ct-signals
