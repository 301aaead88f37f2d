//! Which effects of the best set stay, whether the rest is noise, how much they explain, and which ones the data cannot distinguish.

pub(crate) mod eliminate;
pub(crate) mod groups;
pub(crate) mod lacking;
pub(crate) mod level_shift;
pub(crate) mod noise_test;
pub(crate) mod partial;
pub(crate) mod quantisation;
