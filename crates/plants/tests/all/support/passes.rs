//! Sixteen derivatives in two passes: a simulator takes at most twelve.

use plants::{Dual, Scalar};

/// Variables of which eight have derivatives, from the one at `first` on.
pub fn variables(values: &[f64], first: usize) -> Vec<Dual<8>> {
    let variable = |(i, &value): (usize, &f64)| match i.checked_sub(first) {
        Some(lane) => Dual::variable(value, lane),
        None => Dual::constant(value),
    };
    values.iter().enumerate().map(variable).collect()
}

/// What a run gives, with its derivatives by all variables.
pub fn both(values: &[f64], run: impl Fn(&[Dual<8>]) -> Vec<Dual<8>>) -> Vec<Dual<16>> {
    assert!(values.len() <= 16);
    let [low, high] = [0, 8].map(|first| run(&variables(values, first)));
    assert_eq!(low.len(), high.len());
    let join = |(low, high): (&Dual<8>, &Dual<8>)| {
        // Which formula is taken depends on whether derivatives differ: values agree to rounding.
        assert!((low.re - high.re).abs() <= 1e-12 * low.re.abs().max(1.0));
        let mut both = Dual::constant(low.re);
        both.eps[..8].copy_from_slice(&low.eps);
        both.eps[8..].copy_from_slice(&high.eps);
        both
    };
    low.iter().zip(&high).map(join).collect()
}
