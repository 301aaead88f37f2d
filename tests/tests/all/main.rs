//! Tests across crates, in one program: one link, and slow tests of different files run at the same time.

mod as_recorded;
mod closed_loop;
mod coverage;
mod design;
mod docs;
mod hard_nonlinearity_in_loop;
mod honest_verdicts;
mod library_records;
mod modelica;
mod monitor;
mod no_false_claims;
mod plants_as_text;
mod real_data;
mod results;
mod several_levels;
mod stabilized_oe;
mod three_tank;
mod traps;
mod unknown;
mod unstable_in_loop;
