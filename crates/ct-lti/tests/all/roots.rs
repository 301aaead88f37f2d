//! Roots: backward error, known roots, and the documented properties.

use ct_lti::{Complex64, Polynomial};
use proptest::prelude::*;

fn poly(c: &[f64]) -> Polynomial {
    Polynomial::new(c).unwrap()
}

/// `|P(z)|` over the sum of the moduli of its terms, the largest over the roots: of the order of the rounding of one
/// coefficient where a root is as good as it can be.
fn backward_error(p: &Polynomial) -> f64 {
    let error = |z: &Complex64| {
        let c = p.coefficients();
        let n = c.len() as i32 - 1;
        // Over |z|^n above 1, so that nothing overflows.
        let power = |i: i32| {
            if z.norm() > 1.0 {
                z.powi(i - n)
            } else {
                z.powi(i)
            }
        };
        let terms = || c.iter().enumerate().map(|(i, c)| power(i as i32) * c);
        terms().sum::<Complex64>().norm() / terms().map(|t| t.norm()).sum::<f64>()
    };
    p.roots().unwrap().iter().map(error).fold(0.0, f64::max)
}

/// Largest relative distance of a root to the nearest one expected, and of one expected to the nearest root.
fn distance(found: &[Complex64], expected: &[Complex64]) -> f64 {
    let to = |from: &[Complex64], to: &[Complex64]| {
        from.iter()
            .map(|z| {
                let nearest = to
                    .iter()
                    .map(|w| (z - w).norm())
                    .fold(f64::INFINITY, f64::min);
                nearest / z.norm().max(1e-300)
            })
            .fold(0.0, f64::max)
    };
    assert_eq!(found.len(), expected.len());
    to(found, expected).max(to(expected, found))
}

fn real(roots: &[f64]) -> Vec<Complex64> {
    roots.iter().map(|r| Complex64::new(*r, 0.0)).collect()
}

#[test]
fn of_one_and_two() {
    assert_eq!(poly(&[3.0]).roots().unwrap(), []);
    assert!(Polynomial::zero().roots().is_err());
    assert_eq!(poly(&[1.0, 4.0]).roots().unwrap(), real(&[-0.25]));
    assert_eq!(poly(&[0.0, 0.0, 2.0]).roots().unwrap(), real(&[0.0, 0.0]));
    // The small root would be lost to cancellation.
    let roots = poly(&[1.0, 1e8, 1.0]).roots().unwrap();
    assert!(distance(&roots, &real(&[-1e8, -1e-8])) < 1e-15);
    // The discriminant would be rounded to 0.
    let e = f64::EPSILON;
    let roots = poly(&[1.0 - e * e, -2.0, 1.0]).roots().unwrap();
    assert_eq!(roots, real(&[1.0, 1.0]));
    let near = poly(&[(1.0 + e) * (1.0 - 2.0 * e), -2.0 + e, 1.0])
        .roots()
        .unwrap();
    assert!(distance(&near, &real(&[1.0 + e, 1.0 - 2.0 * e])) < 2e-8);
}

#[test]
fn over_many_decades() {
    let expected: Vec<f64> = (-6..7).map(|k| -(10.0_f64.powi(2 * k))).collect();
    let p = Polynomial::from_roots(&real(&expected), 3.0).unwrap();
    let found = p.roots().unwrap();
    assert!(found.iter().all(|z| z.im == 0.0));
    let off = distance(&found, &real(&expected));
    println!("24 decades: {off:.1e}");
    assert!(off < 1e-14);
    // Far beyond the range of the powers of the roots themselves.
    let wide = poly(&[1e-300, 1.0, 1e-300, 1.0, 1e-300, 1e200]);
    assert!(backward_error(&wide) < 1e-14);
}

#[test]
fn of_unity() {
    for n in [3, 7, 16, 40, 101] {
        let mut c = vec![0.0; n + 1];
        (c[0], c[n]) = (-1.0, 1.0);
        let expected: Vec<Complex64> = (0..n)
            .map(|k| Complex64::from_polar(1.0, std::f64::consts::TAU * k as f64 / n as f64))
            .collect();
        assert!(
            distance(&poly(&c).roots().unwrap(), &expected) < 1e-14,
            "{n}"
        );
    }
}

/// Wilkinson's polynomial: each root is as good as the coefficients allow.
#[test]
fn of_wilkinson() {
    let expected: Vec<f64> = (1..=20).map(f64::from).collect();
    let p = Polynomial::from_roots(&real(&expected), 1.0).unwrap();
    assert!(backward_error(&p) < 1e-14);
    let ten = Polynomial::from_roots(&real(&expected[..10]), 1.0).unwrap();
    assert!(distance(&ten.roots().unwrap(), &real(&expected[..10])) < 1e-9);
}

/// A root of multiplicity m is accurate to about 1e-16^(1/m), and the mean of the m roots to rounding.
#[test]
fn with_multiplicity() {
    for m in [2_usize, 3, 4, 6] {
        let lag = poly(&[0.3, 1.0]).pow(m);
        let roots = (&lag * &poly(&[5.0, 1.0])).roots().unwrap();
        let near: Vec<_> = roots.iter().filter(|z| (**z + 0.3).norm() < 0.2).collect();
        assert_eq!(near.len(), m);
        let spread = near.iter().map(|z| (**z + 0.3).norm()).fold(0.0, f64::max);
        let mean = near.iter().map(|z| z.re).sum::<f64>() / m as f64;
        println!(
            "multiplicity {m}: off by {spread:.1e}, mean by {:.1e}",
            (mean + 0.3).abs()
        );
        assert!(spread < 5.0 * 1e-16_f64.powf(1.0 / m as f64));
        assert!((mean + 0.3).abs() < 1e-13);
    }
}

fn any_roots() -> impl Strategy<Value = Vec<Complex64>> {
    let size = || (-4.0..4.0_f64).prop_map(|e| 10.0_f64.powf(e));
    let real = (size(), any::<bool>())
        .prop_map(|(r, sign)| vec![Complex64::new(if sign { r } else { -r }, 0.0)]);
    let pair = (size(), 0.05..3.09_f64).prop_map(|(r, angle)| {
        let z = Complex64::from_polar(r, angle);
        vec![z, z.conj()]
    });
    prop::collection::vec(prop_oneof![real, pair], 1..7).prop_map(|groups| groups.concat())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn are_as_good_as_the_coefficients(c in prop::collection::vec(-1.0..1.0_f64, 2..25), e in prop::collection::vec(-30..30_i32, 25)) {
        let c: Vec<f64> = c.iter().zip(e).map(|(c, e)| c * 2.0_f64.powi(e)).collect();
        let p = poly(&c);
        prop_assume!(!p.is_zero());
        prop_assert_eq!(Some(p.roots().unwrap().len()), p.degree());
        prop_assert!(backward_error(&p) < 1e-13, "{}", backward_error(&p));
    }

    /// Real, or a pair of exact conjugates, sorted; and simple roots come back.
    #[test]
    fn come_back(expected in any_roots()) {
        let found = Polynomial::from_roots(&expected, 1.5).unwrap().roots().unwrap();
        for z in &found {
            prop_assert!(z.im == 0.0 || found.contains(&z.conj()));
        }
        prop_assert!(found.is_sorted_by(|a, b| a.re <= b.re));
        // Sensitivity of a root to rounding of a coefficient: the product of relative distances to the others.
        let apart = (0..expected.len()).flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| (expected[i] - expected[j]).norm() / expected[i].norm().max(expected[j].norm()))
            .fold(1.0, f64::min);
        prop_assume!(apart > 0.1);
        let off = distance(&found, &expected);
        prop_assert!(off < 1e-9, "{off}");
    }

    /// The exact answer and the roots agree wherever the roots are not within their own accuracy of the axis.
    #[test]
    fn agree_with_routh(c in prop::collection::vec(0.01..2.0_f64, 4..9)) {
        let p = poly(&c);
        let rightmost = p.roots().unwrap().last().map_or(-1.0, |z| z.re);
        prop_assume!(rightmost.abs() > 1e-7);
        prop_assert_eq!(p.is_hurwitz(), rightmost < 0.0);
        prop_assert_eq!(p.decays_faster_than(0.5 * rightmost.abs()), rightmost < -0.5 * rightmost.abs());
    }

    #[test]
    fn division_undoes_multiplication(a in prop::collection::vec(-5..6_i32, 1..6), b in prop::collection::vec(-5..6_i32, 1..6), r in prop::collection::vec(-5..6_i32, 0..3)) {
        let of = |c: &[i32]| poly(&c.iter().map(|c| f64::from(*c)).collect::<Vec<_>>());
        let (a, r) = (of(&a), of(&r));
        // A leading coefficient that divides exactly.
        let b = &of(&b) + &Polynomial::p().pow(6);
        let (q, rest) = (&(&a * &b) + &r).div_rem(&b).unwrap();
        prop_assert_eq!(q, a);
        prop_assert_eq!(rest, r);
    }
}
