//! Whether the model is stable, without an allocator: Routh's scheme on an array.
//!
//! Unlike [`ct_lti::Polynomial::is_hurwitz`], which decides exactly and is for what is given once, this runs in every step and has to
//! be right only on one side: what lies within rounding of the border is refused.

/// An entry of the scheme counts as positive above this share of the terms whose difference it is.
const MARGIN: f64 = 1e-12;

/// Whether `1 + a_1 s + .. + a_N s^N`, with `a` in front of `theta`, has all roots left of the imaginary axis.
#[inline]
pub(crate) fn is_hurwitz<const N: usize>(theta: &[f64]) -> bool {
    let a = &theta[..N];
    // necessary, and enough up to the second order
    if !a.iter().all(|a| *a > 0.0 && a.is_finite()) {
        return false;
    }
    N < 3 || routh::<N>(a)
}

/// Routh's reduction from the highest coefficient down: with `q = p_0/p_1` of the leading two, the odd-numbered coefficients are taken from
/// the even-numbered ones, until a line is left; every leading one has to be positive.
fn routh<const N: usize>(a: &[f64]) -> bool {
    // scaled by the roots' geometric mean, highest power first, so that p[0] = 1 and the last one is 1
    let unit = libm::pow(a[N - 1], 1.0 / N as f64);
    let mut p = [0.0; N];
    // p[k] is the coefficient of s^(N - 1 - k); s^N has 1
    let mut power = 1.0;
    for (p, lower) in p.iter_mut().zip((0..N).rev()) {
        power *= unit;
        let coefficient = if lower == 0 { 1.0 } else { a[lower - 1] };
        *p = coefficient * power / a[N - 1];
    }
    let mut leading = 1.0;
    for k in 0..N {
        let next = p[k];
        if next <= 0.0 {
            return false;
        }
        let q = leading / next;
        // s^(N-k) - q s times the row of s^(N-k-1)
        for j in (k + 1..N.saturating_sub(1)).step_by(2) {
            let (old, taken) = (p[j], q * p[j + 1]);
            p[j] = old - taken;
            if p[j] <= MARGIN * old.abs() {
                return false;
            }
        }
        leading = next;
    }
    true
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    #![allow(clippy::unwrap_used)]

    use ct_lti::Polynomial;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn agrees<const N: usize>(rng: &mut ChaCha8Rng) -> usize {
        let mut stable = 0;
        for _ in 0..2000 {
            // around (1 + s T)^N, of any unit of time
            let unit = 10f64.powf(rng.random_range(-4.0..4.0));
            let mut a = [0.0; N];
            let mut binomial = 1.0;
            for (i, a) in a.iter_mut().enumerate() {
                binomial *= unit * (N - i) as f64 / (i + 1) as f64;
                *a = binomial * 10f64.powf(rng.random_range(-1.0..0.4));
            }
            let whole: alloc::vec::Vec<f64> = core::iter::once(1.0).chain(a).collect();
            let exact = Polynomial::new(whole).unwrap().is_hurwitz();
            assert_eq!(is_hurwitz::<N>(&a), exact, "{a:?}");
            stable += usize::from(exact);
        }
        stable
    }

    #[test]
    fn agrees_with_the_exact_decision() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        assert_eq!(agrees::<1>(&mut rng), 2000);
        assert_eq!(agrees::<2>(&mut rng), 2000);
        for stable in [
            agrees::<3>(&mut rng),
            agrees::<4>(&mut rng),
            agrees::<5>(&mut rng),
            agrees::<6>(&mut rng),
        ] {
            assert!((50..1950).contains(&stable), "{stable}");
        }
    }

    #[test]
    fn the_border_and_worse_are_refused() {
        // s^2 + 1 times (s + 1)
        assert!(!is_hurwitz::<3>(&[1.0, 1.0, 1.0]));
        assert!(!is_hurwitz::<1>(&[0.0]));
        assert!(!is_hurwitz::<2>(&[1.0, f64::NAN]));
        assert!(!is_hurwitz::<2>(&[1.0, f64::INFINITY]));
    }
}
