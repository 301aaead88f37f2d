//! Square matrices in rows, as slices: only what sampling needs.

/// `product = a b`, all n x n and not one of them the same.
pub(crate) fn multiply(n: usize, a: &[f64], b: &[f64], product: &mut [f64]) {
    for (row, a) in product
        .chunks_exact_mut(n.max(1))
        .zip(a.chunks_exact(n.max(1)))
    {
        row.fill(0.0);
        for (a, b) in a.iter().zip(b.chunks_exact(n.max(1))) {
            for (sum, b) in row.iter_mut().zip(b) {
                *sum += a * b;
            }
        }
    }
}

/// `sum_i a[i] b[i]`.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `product = a x`, a with as many columns as x has entries.
pub(crate) fn apply(a: &[f64], x: &[f64], product: &mut [f64]) {
    for (y, row) in product.iter_mut().zip(a.chunks_exact(x.len().max(1))) {
        *y = dot(row, x);
    }
}

/// The largest sum of moduli along a column.
pub(crate) fn norm(n: usize, a: &[f64]) -> f64 {
    let sum = |column: usize| {
        a.iter()
            .skip(column)
            .step_by(n.max(1))
            .map(|a| a.abs())
            .sum()
    };
    (0..n).map(sum).fold(0.0, f64::max)
}
