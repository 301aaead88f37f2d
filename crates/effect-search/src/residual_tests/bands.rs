//! Bands of a spectrum.

use std::ops::Range;

/// Divides a number of spectral lines into bands. The lowest has `lowest` lines, each higher one as many as all below it; lines that do not
/// fill another band belong to the last one.
pub fn bands(lines: usize, lowest: usize) -> impl Iterator<Item = Range<usize>> {
    let (mut from, mut to) = (0, lowest);
    std::iter::from_fn(move || {
        let end = if 2 * to > lines { lines } else { to };
        let band = from..end;
        (from, to) = (end, 2 * end);
        (!band.is_empty()).then_some(band)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_double_and_contain_every_line_once() {
        let found: Vec<_> = bands(29, 3).collect();
        assert_eq!(found, [0..3, 3..6, 6..12, 12..29]);
        assert_eq!(
            bands(24, 3).collect::<Vec<_>>(),
            [0..3, 3..6, 6..12, 12..24]
        );
        let few: Vec<usize> = bands(2, 3).flatten().collect();
        assert_eq!(few, [0, 1]);
        assert_eq!(bands(0, 3).count(), 0);
    }
}
