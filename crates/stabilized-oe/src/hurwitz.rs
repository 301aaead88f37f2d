//! Whether the model is stable, without an allocator: Routh's scheme on an array.
//!
//! Unlike [`ct_lti::Polynomial::is_hurwitz`], which decides exactly and is for what is given once, this runs in every step and has to
//! be right only on one side: what lies within rounding of the border is refused.

/// An entry of the scheme counts as positive above this share of the terms it is the difference of.
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
