//! Largest numbers of vessels, which set the sizes of arrays.

/// Largest number of vessels of a plant.
pub const MAX_VESSELS: usize = 3;
/// Largest number of vessels in series, each above the next one. A plant with three vessels has them connected by valves.
pub(crate) const SERIES: usize = 2;
