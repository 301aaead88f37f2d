//! The check of bounds on `c^`: against the closed forms, and against plants drawn from inside the box.

use ct_constrained::Bounds;
use ct_lti::TransferFunction;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stabilized_oe::{FilterBounds, check_filter_bounds};

fn point<const N: usize>(x: [f64; N]) -> Bounds<N> {
    Bounds::new(x, x).unwrap()
}

#[test]
fn order_one_is_a_sign() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for case in 0..5000 {
        let a: f64 = 10f64.powf(rng.random_range(-3.0..3.0));
        let c = if case % 50 == 0 {
            0.0
        } else {
            rng.random_range(-1.0..1.0) * a
        };
        let found = check_filter_bounds(&point([c]), &point([a]), 0.0).unwrap();
        assert_eq!(found.hold(), c >= 0.0, "a = {a}, c = {c}: {found}");
        // for the least-squares gain: c_1/a_1 > 1/2
        let found = check_filter_bounds(&point([c]), &point([a]), 0.5).unwrap();
        assert_eq!(found.hold(), c >= 0.5 * a, "a = {a}, c = {c}: {found}");
    }
}

#[test]
fn order_two_is_a_parabola() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut holds = 0;
    for _ in 0..5000 {
        let [a1, a2] = [0.0; 2].map(|_: f64| 10f64.powf(rng.random_range(-1.0..1.0)));
        let [c1, c2] = [0.0; 2].map(|_: f64| rng.random_range(-0.3..3.0));
        let found = check_filter_bounds(&point([c1, c2]), &point([a1, a2]), 0.0).unwrap();
        let expected = c2 >= 0.0 && a1 * c1 > (a2.sqrt() - c2.sqrt()).powi(2);
        assert_eq!(
            found.hold(),
            expected,
            "a = {a1}, {a2}, c = {c1}, {c2}: {found}"
        );
        holds += usize::from(expected);
    }
    assert!((1000..4000).contains(&holds), "{holds}");
}

/// If the condition is satisfied at the corners, it is at every point of the boxes; if it fails, it fails at a corner.
fn corners_decide<const N: usize>(seed: u64, cases: usize, spread: f64) -> [usize; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut found = [0; 3];
    for _ in 0..cases {
        let above = *[0.0, 0.2, 0.5].get(rng.random_range(0..3)).unwrap();
        // (1 + s)^N, roughly, and C near it
        let mut a = [0.0; N];
        let mut binomial = 1.0;
        for (i, a) in a.iter_mut().enumerate() {
            binomial *= (N - i) as f64 / (i + 1) as f64;
            *a = binomial * rng.random_range(0.8..1.25);
        }
        let lower = a.map(|a| a * (1.0 - spread * rng.random_range(0.0..1.0)));
        let upper = a.map(|a| a * (1.0 + spread * rng.random_range(0.0..1.0)));
        let plausible = Bounds::new(lower, upper).unwrap();
        let slack = [0.97, 0.8, 0.5, 0.2, 0.15][N - 1];
        let c_lower = lower.map(|a| a * rng.random_range(1.0 - slack..1.0));
        let c_upper = upper.map(|a| a * rng.random_range(1.0..1.0 + slack));
        let filter = Bounds::new(c_lower, c_upper).unwrap();
        let real = |c: [f64; N], a: [f64; N]| {
            let numbers = |x: [f64; N]| -> Vec<f64> { std::iter::once(1.0).chain(x).collect() };
            TransferFunction::from_coefficients(&numbers(c), &numbers(a)).unwrap()
        };
        match check_filter_bounds(&filter, &plausible, above).unwrap() {
            FilterBounds::PositiveReal => {
                found[0] += 1;
                for _ in 0..50 {
                    let a = core::array::from_fn(|i| rng.random_range(lower[i]..=upper[i]));
                    let c = core::array::from_fn(|i| rng.random_range(c_lower[i]..=c_upper[i]));
                    assert!(real(c, a).exceeds(above).unwrap().holds());
                }
                // the boxes' own corners, where it is nearest to fail
                for _ in 0..50 {
                    let mut one = |low: f64, high: f64| if rng.random() { low } else { high };
                    let a = core::array::from_fn(|i| one(lower[i], upper[i]));
                    let c = core::array::from_fn(|i| one(c_lower[i], c_upper[i]));
                    assert!(real(c, a).exceeds(above).unwrap().holds());
                }
            }
            FilterBounds::NotPositiveReal {
                c, a, frequency, ..
            } => {
                found[1] += 1;
                assert!(filter.contains(&c.into()) && plausible.contains(&a.into()));
                if frequency.is_finite() {
                    assert!(real(c, a).at_frequency(frequency).re <= above + 1e-12);
                }
            }
            FilterBounds::PlantUnstable { a } => {
                found[2] += 1;
                assert!(plausible.contains(&a.into()));
                assert!(!real(a, a).is_stable());
            }
        }
    }
    found
}

#[test]
fn corners_decide_for_the_whole_box() {
    let all = [
        corners_decide::<1>(3, 300, 0.5),
        corners_decide::<2>(4, 300, 0.3),
        corners_decide::<3>(5, 300, 0.15),
        corners_decide::<4>(6, 300, 0.08),
        corners_decide::<5>(7, 200, 0.04),
    ];
    for found in all {
        assert!(found[0] > 10 && found[1] > 10, "{all:?}");
    }
    // (1 + s)^3 is stable up to a1 a2 = a3; this box reaches beyond
    assert!(corners_decide::<3>(8, 300, 0.9)[2] > 10);
}

#[test]
fn the_papers_set_is_no_such_set() {
    let plausible = Bounds::new([5.0], [20.0]).unwrap();
    let paper = Bounds::new([-20.0], [20.0]).unwrap();
    let found = check_filter_bounds(&paper, &plausible, 0.0).unwrap();
    assert!(!found.hold());
    assert!(
        found.to_string().contains("narrow the bounds on c"),
        "{found}"
    );
    let positive = Bounds::new([0.0], [20.0]).unwrap();
    assert!(
        check_filter_bounds(&positive, &plausible, 0.0)
            .unwrap()
            .hold()
    );
    // the least-squares gain asks for more: c_1 above half of every a_1
    assert!(
        !check_filter_bounds(&positive, &plausible, 0.5)
            .unwrap()
            .hold()
    );
    let half = Bounds::new([10.0], [40.0]).unwrap();
    assert!(check_filter_bounds(&half, &plausible, 0.5).unwrap().hold());
    assert!(
        !check_filter_bounds(&Bounds::<1>::none(), &plausible, 0.0)
            .unwrap()
            .hold()
    );
}

#[test]
fn a_plausible_plant_has_positive_coefficients() {
    let plausible = Bounds::new([-1.0], [20.0]).unwrap();
    assert!(check_filter_bounds(&point([1.0]), &plausible, 0.0).is_err());
}
