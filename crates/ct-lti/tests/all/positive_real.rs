//! Positive realness against a fine grid with roots, the closed forms of orders one and two, and borders that only
//! exact arithmetic can tell.

use ct_lti::{Polynomial, Positivity, TransferFunction};
use rand::RngExt;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

fn tf(b: &[f64], a: &[f64]) -> TransferFunction {
    TransferFunction::from_coefficients(b, a).unwrap()
}

fn random() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(4)
}

/// A Hurwitz polynomial with roots of modulus 0.1 to 10.
fn hurwitz(n: usize, rng: &mut ChaCha8Rng) -> Polynomial {
    let mut p = Polynomial::one();
    while p.degree() < Some(n) {
        let w = 10.0_f64.powf(rng.random_range(-1.0..1.0));
        let factor = if n - p.degree().unwrap() >= 2 && rng.random::<bool>() {
            Polynomial::new([w * w, 2.0 * rng.random_range(0.02..1.5) * w, 1.0])
        } else {
            Polynomial::new([w, 1.0])
        };
        p = &p * &factor.unwrap();
    }
    p
}

/// `Re G - d` on a logarithmic grid, at its ends, and where the roots of N' say that N is lowest: the least of it, over
/// its largest modulus.
fn least(g: &TransferFunction, d: f64) -> f64 {
    let at = |w: f64| g.at_frequency(w).re - d;
    let grid = (0..=1000).map(|k| 10.0_f64.powf(-4.0 + f64::from(k) * 8.0 / 1000.0));
    let mut values: Vec<f64> = grid.map(at).collect();
    values.extend([at(0.0), g.direct_term() - d]);
    let ((e1, o1), (e2, o2)) = (g.numerator().even_odd(), g.denominator().even_odd());
    let x = Polynomial::p();
    let real = &(&e1 * &e2) + &(&x * &(&o1 * &o2));
    let size = &(&e2 * &e2) + &(&x * &(&o2 * &o2));
    // Stationary points of N/|P2|^2.
    let slope = &(&real.derivative() * &size) - &(&size.derivative() * &real);
    let flat = slope.roots().unwrap();
    values.extend(
        flat.iter()
            .filter(|x| x.im == 0.0 && x.re > 0.0)
            .map(|x| at(x.re.sqrt())),
    );
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    least / values.iter().fold(1e-300_f64, |m, v| m.max(v.abs()))
}

/// 6000 random cases of orders 1 to 6, a third of them shifted to just above or below the border.
#[test]
fn against_a_fine_grid() {
    let rng = &mut random();
    let (mut yes, mut no, mut near) = (0, 0, 0);
    for case in 0..6000 {
        let n = 1 + case % 6;
        let p2 = hurwitz(n, rng);
        let changed: Vec<f64> = p2
            .coefficients()
            .iter()
            .map(|c| c * rng.random_range(0.4..2.5))
            .collect();
        let g = TransferFunction::new(Polynomial::new(changed).unwrap(), p2).unwrap();
        let mut d = [0.0, 0.5, rng.random_range(-0.5..1.0)][case % 3];
        if case % 9 == 2 {
            // The least value itself, within 1e-6.
            let size = g.at_frequency(0.0).re.abs();
            let (mut below, mut above) = (-100.0, 100.0);
            for _ in 0..60 {
                let middle = 0.5 * (below + above);
                let holds = g.exceeds(middle).unwrap().holds();
                if holds {
                    below = middle
                } else {
                    above = middle
                }
            }
            assert!(above - below < 1e-12);
            assert!(
                least(&g, below).abs() < 1e-6,
                "{g:?} {below} {}",
                least(&g, below)
            );
            d = below + size * if rng.random() { 1e-6 } else { -1e-6 };
        }
        let least = least(&g, d);
        if least.abs() < 1e-9 {
            near += 1;
            continue;
        }
        match g.exceeds(d).unwrap() {
            Positivity::Strict => {
                yes += 1;
                assert!(least > 0.0, "{g:?} {d}: {least}");
            }
            Positivity::Fails { frequency, excess } => {
                no += 1;
                assert!(least < 0.0, "{g:?} {d}: {least}");
                assert!(
                    frequency >= 0.0 && excess < 0.0,
                    "{g:?} {d}: at {frequency} {excess}"
                );
                let there = g.at_frequency(frequency).re - d;
                assert!(there <= 0.0, "{g:?} {d}: at {frequency} {there}");
            }
            other => panic!("{g:?} {d}: {other:?}"),
        }
    }
    println!("{yes} hold, {no} fail, {near} too near for the grid");
    assert!(yes > 1500 && no > 1500 && near < 60);
}

/// n = 1 with a PI controller, `Re(P^/P) > 1/2`, P = c0 + c1 p + c2 p^2: the closed form of (14).
#[test]
fn closed_loop_of_order_one() {
    let rng = &mut random();
    let (mut yes, mut border) = (0, 0);
    for _ in 0..5000 {
        let (ki, kp) = (rng.random_range(0.001..0.1), rng.random_range(0.001..1.0));
        let mut loop_of = || {
            let (gain, tau) = (rng.random_range(1.0..10.0), rng.random_range(10.0..300.0));
            [ki * gain, 1.0 + gain * kp, tau]
        };
        let ([c0, c1, c2], [h0, h1, h2]) = (loop_of(), loop_of());
        let a0: f64 = c0 * (h0 - c0 / 2.0);
        let a2: f64 = c2 * (h2 - c2 / 2.0);
        let a1: f64 = h1 * c1 - c1 * c1 / 2.0 - h0 * c2 - h2 * c0 + c0 * c2;
        if (a1 * a1 - 4.0 * a0 * a2).abs() < 1e-10 * (a1 * a1)
            || a0.abs() < 1e-12
            || a2.abs() < 1e-10
        {
            border += 1;
            continue;
        }
        let expected = a0 > 0.0 && a2 > 0.0 && (a1 >= 0.0 || a1 * a1 < 4.0 * a0 * a2);
        let found = tf(&[h0, h1, h2], &[c0, c1, c2]).exceeds(0.5).unwrap();
        assert_eq!(found.is_strict(), expected, "{c0} {c1} {c2} {h0} {h1} {h2}");
        yes += usize::from(expected);
    }
    println!("{yes} of 5000 hold");
    assert!((500..4500).contains(&yes) && border < 5);
}

/// n = 2, `C/A` positive real: c2 >= 0 and a1 c1 > (sqrt a2 - sqrt c2)^2.
#[test]
fn output_error_of_order_two() {
    let rng = &mut random();
    let mut yes = 0;
    for case in 0..5000 {
        let (a1, a2) = (rng.random_range(0.05..3.0), rng.random_range(0.05..3.0));
        let c1 = rng.random_range(-0.5..3.0);
        let c2: f64 = match case % 4 {
            0 => 0.0,
            1 => rng.random_range(-1.0..0.0),
            _ => rng.random_range(0.0..3.0),
        };
        let expected = c2 >= 0.0 && a1 * c1 > (f64::sqrt(a2) - c2.sqrt()).powi(2);
        let found = tf(&[1.0, c1, c2], &[1.0, a1, a2]).exceeds(0.0).unwrap();
        assert_eq!(found.holds(), expected, "{a1} {a2} {c1} {c2}: {found:?}");
        assert_eq!(found.is_strict(), expected && c2 > 0.0);
        yes += usize::from(expected);
    }
    println!("{yes} of 5000 hold");
    assert!((500..4500).contains(&yes));
}

#[test]
fn output_error_of_order_one() {
    for (c1, expected) in [
        (0.5, Positivity::Strict),
        (f64::from_bits(1), Positivity::Strict),
        (0.0, Positivity::StrictBelowInfinity),
    ] {
        assert_eq!(
            tf(&[1.0, c1], &[1.0, 2.0]).exceeds(0.0).unwrap(),
            expected,
            "{c1}"
        );
    }
    assert!(
        !tf(&[1.0, -1e-12], &[1.0, 2.0])
            .exceeds(0.0)
            .unwrap()
            .holds()
    );
}

/// N touches 0 without a change of sign: a grid of frequencies does not detect this.
#[test]
fn touching_is_failing() {
    // N = 1 + (a1 c1 - a2 - c2) x + a2 c2 x^2 with a2 = 1, c2 = 4, a1 c1 = 1: (1 - 2x)^2.
    let touching = tf(&[1.0, 2.0, 4.0], &[1.0, 0.5, 1.0]);
    let Positivity::Fails { frequency, excess } = touching.exceeds(0.0).unwrap() else {
        panic!();
    };
    assert!((frequency - 0.5_f64.sqrt()).abs() < 1e-12 && excess <= 0.0);
    let above = tf(&[1.0, 2.0_f64.next_up(), 4.0], &[1.0, 0.5, 1.0]);
    assert_eq!(above.exceeds(0.0).unwrap(), Positivity::Strict);
    assert_eq!(touching.exceeds(-1e-300).unwrap(), Positivity::Strict);
    assert!(!touching.exceeds(1e-300).unwrap().holds());
}

#[test]
fn at_zero_and_at_infinity() {
    let lag = tf(&[1.0], &[1.0, 1.0]);
    assert_eq!(lag.exceeds(0.0).unwrap(), Positivity::StrictBelowInfinity);
    assert_eq!(lag.exceeds(-1e-9).unwrap(), Positivity::Strict);
    // Re = 1/(1 + w^2) is above d only up to some frequency.
    let Positivity::Fails { frequency, excess } = lag.exceeds(0.25).unwrap() else {
        panic!()
    };
    assert!(frequency > 3.0_f64.sqrt() && excess < 0.0);
    // (p + 3)/((p + 1)(p + 2)): Re = 6/|..|^2 falls like 1/w^4.
    let fast = tf(&[3.0, 1.0], &[2.0, 3.0, 1.0]).exceeds(0.0).unwrap();
    assert_eq!(
        fast,
        Positivity::Fails {
            frequency: f64::INFINITY,
            excess: 0.0
        }
    );
    // G = d: nowhere above it. For a constant gain the condition is a comparison of numbers.
    let same = tf(&[2.0, 2.0], &[1.0, 1.0]).exceeds(2.0).unwrap();
    assert_eq!(
        same,
        Positivity::Fails {
            frequency: 0.0,
            excess: 0.0
        }
    );
    assert!(tf(&[2.0], &[1.0]).exceeds(1.9).unwrap().is_strict());
    assert!(!tf(&[2.0], &[1.0]).exceeds(2.0).unwrap().holds());
    assert!(!tf(&[], &[1.0, 1.0]).exceeds(0.0).unwrap().holds());
}

#[test]
fn only_of_stable_ones() {
    for a in [[0.0, 1.0], [-1.0, 1.0]] {
        assert_eq!(
            tf(&[1.0, 1.0], &a).exceeds(0.0).unwrap(),
            Positivity::Unstable
        );
    }
    assert!(tf(&[1.0], &[1.0]).exceeds(f64::NAN).is_err());
}

/// The unit of time and of the signals do not matter.
#[test]
fn in_any_unit() {
    let rng = &mut random();
    for _ in 0..300 {
        let p2 = hurwitz(3, rng);
        let changed: Vec<f64> = p2
            .coefficients()
            .iter()
            .map(|c| c * rng.random_range(0.4..2.5))
            .collect();
        let p1 = Polynomial::new(changed).unwrap();
        let g = TransferFunction::new(p1.clone(), p2.clone()).unwrap();
        let expected = g.exceeds(0.5).unwrap().holds();
        for power in [-90, -20, 20, 90] {
            let unit = 2.0_f64.powi(power);
            let scaled =
                TransferFunction::new(&p1.scaled(unit) * unit, &p2.scaled(unit) * unit).unwrap();
            assert_eq!(scaled.exceeds(0.5).unwrap().holds(), expected);
        }
    }
}
