//! `ctid serve` from outside: its page in a browser, driven by real clicks, and its server against hostile input.
#![allow(clippy::unwrap_used, clippy::panic)]

mod asked;
mod browser;
mod cancelled;
mod choices;
mod click_path;
mod held_up;
mod hostile;
mod other_users;
mod overtaken;
mod own_model;
mod server;
mod three_tanks;
mod two_levels;
