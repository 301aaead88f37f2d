//! Response of one lag, and of two lags in series, to a polynomial input over one step, with derivatives by the rates.
//!
//! Let `r` be the step length divided by the time constant. The input `s^k`, `s` from 0 to 1 over the step, contributes to the lag output
//! at the end of the step
//! ```text
//! w_k(r) = int_0^1 r exp(-r (1 - s)) s^k ds
//! ```
//! The second lag has the rate `r2`. The initial output of the first lag contributes `C` to the output of the second one, and the input
//! `s^k` of the first lag contributes `W_k`:
//! ```text
//! C = -r2 E[r1, r2],  E(r) = exp(-r)
//! W_k = w_k(r1) - r1 w_k[r1, r2] = -r1 r2 v_k[r1, r2],  v_k(r) = w_k(r)/r
//! ```
//! `f[a, b] = (f(b) - f(a))/(b - a)` is the divided difference, the mean of `f'` between `a` and `b`. For rates that are close to each
//! other it is computed as that mean, by quadrature, or as a power series, so that equal time constants are no special case.
//!
//! These functions depend on one or two numbers only. Their derivatives by these numbers are therefore computed in `f64` and combined with
//! the derivatives of the rates by the chain rule: a dual with many derivatives is multiplied only a few times.

/// Below this rate, power series are summed, because the closed forms divide by the rate.
const SLOW: f64 = 1.0;
/// Number of terms with which a power series is exact to rounding for any rate below [`SLOW`].
const TERMS: usize = 22;

/// A value and its derivatives by the two rates.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Partial {
    pub value: f64,
    pub by: [f64; 2],
}

/// One lag: the factor of its initial output and those of the inflow's three coefficients, each with its derivative by the rate.
pub(crate) struct OneLag {
    pub decay: [f64; 2],
    pub inflow: [[f64; 2]; 3],
}

/// A function of the rate and its first two derivatives.
type Jet = [f64; 3];

/// Response of one lag of rate `r`.
pub(crate) fn one_lag(r: f64) -> OneLag {
    if r >= SLOW {
        let decay = (-r).exp();
        return OneLag {
            decay: [decay, -decay],
            inflow: jets(r, decay).map(|[value, slope, _]| [value, slope]),
        };
    }
    // v_(k-1) = (1 - r v_k)/k and v_k' = v_(k+1) - v_k.
    let v3 = series(r).iter().rev().fold(0.0, |sum, c| sum * r + c);
    let v2 = (1.0 - r * v3) / 3.0;
    let v1 = (1.0 - r * v2) / 2.0;
    let v0 = 1.0 - r * v1;
    let decay = 1.0 - r * v0;
    let of = |v: f64, next: f64| [r * v, v + r * (next - v)];
    OneLag {
        decay: [decay, -decay],
        inflow: [of(v0, v1), of(v1, v2), of(v2, v3)],
    }
}

/// The terms of `v_3(r) = sum_n (-r)^n 3!/(n + 4)!` that are needed for a slope exact to rounding.
fn series(r: f64) -> &'static [f64] {
    let terms = if r < 0.04 {
        8
    } else if r < 0.3 {
        12
    } else {
        SERIES.len()
    };
    &SERIES[..terms]
}

/// `(-1)^n 3!/(n + 4)!`
const SERIES: [f64; 18] = {
    let mut terms = [0.25; 18];
    let mut n = 1;
    while n < terms.len() {
        terms[n] = -terms[n - 1] / (n + 4) as f64;
        n += 1;
    }
    terms
};

/// `w_0, w_1, w_2` and their first two derivatives, for rates that are not small; `decay = exp(-r)`.
fn jets(r: f64, decay: f64) -> [Jet; 3] {
    let i = 1.0 / r;
    let w0 = [-(-r).exp_m1(), decay, -decay];
    // w_(k+1) = 1 - (k + 1) w_k/r
    let next = |w: Jet, k: f64| {
        let quotient = w[0] * i;
        let slope = (w[1] - quotient) * i;
        let bend = (w[2] - 2.0 * slope) * i;
        [1.0 - k * quotient, -k * slope, -k * bend]
    };
    let w1 = next(w0, 1.0);
    [w0, w1, next(w1, 2.0)]
}

/// `v_0, v_1, v_2` and their first two derivatives; `decay = exp(-r)`.
fn quotient_jets(r: f64, decay: f64) -> [Jet; 3] {
    if r >= SLOW {
        let i = 1.0 / r;
        return jets(r, decay).map(|[value, slope, bend]| {
            let quotient = value * i;
            let its_slope = (slope - quotient) * i;
            [quotient, its_slope, (bend - 2.0 * its_slope) * i]
        });
    }
    // v_k = sum_n (-r)^n k!/(n + k + 1)!
    let mut jets = [[0.0; 3]; 3];
    // The term (-r)^n/(n + 1)! and its derivatives.
    let mut power = [1.0, 0.0, 0.0];
    for n in 0..TERMS {
        let n = n as f64;
        let second = 1.0 / (n + 2.0);
        let shares = [1.0, second, 2.0 * second / (n + 3.0)];
        for (jet, share) in jets.iter_mut().zip(shares) {
            for (sum, term) in jet.iter_mut().zip(power) {
                *sum += term * share;
            }
        }
        if power[2].abs() < 1e-18 && n > 2.0 {
            break;
        }
        let [value, slope, bend] = power;
        power = [
            -value * r * second,
            -(slope * r + value) * second,
            -(bend * r + 2.0 * slope) * second,
        ];
    }
    jets
}

/// Two lags of rates `a` and `b` in series: the factor `C` of the first lag's initial output and the factors `W_k` of the inflow's three
/// coefficients.
pub(crate) fn two_lags(a: f64, b: f64) -> [Partial; 4] {
    if a.max(b) < SLOW {
        return slow_lags(a, b);
    }
    // If one rate is small, W_k is small, and the form with v_k avoids a difference of large terms; if both are large, the form with w_k is
    // accurate.
    let one_slow = a.min(b) < SLOW;
    let gap = b - a;
    let near = gap.abs() < f64::max(1.0, 0.4 * a.min(b));
    // Divided differences of E and of w_0, w_1, w_2 or v_0, v_1, v_2, each with its derivatives by a and b.
    let mut differences = [Partial::default(); 4];
    let at = |r: f64| {
        let decay = (-r).exp();
        let [f0, f1, f2] = if one_slow {
            quotient_jets(r, decay)
        } else {
            jets(r, decay)
        };
        [[decay, -decay, decay], f0, f1, f2]
    };
    let first = at(a);
    if near {
        for (node, weight) in NODES {
            for (node, weight) in [(node, weight), (1.0 - node, weight)] {
                for (difference, [_, slope, bend]) in differences.iter_mut().zip(at(a + node * gap))
                {
                    difference.value += weight * slope;
                    difference.by[0] += weight * (1.0 - node) * bend;
                    difference.by[1] += weight * node * bend;
                }
            }
        }
    } else {
        let last = at(b);
        let i = 1.0 / gap;
        for (difference, (from, to)) in differences.iter_mut().zip(first.iter().zip(last)) {
            let value = (to[0] - from[0]) * i;
            *difference = Partial {
                value,
                by: [(value - from[1]) * i, (to[1] - value) * i],
            };
        }
    }
    let [e, f @ ..] = differences;
    let of = |k: usize| {
        let (own, difference) = (first[k + 1], f[k]);
        if one_slow {
            return Partial {
                value: -a * b * difference.value,
                by: [
                    -b * (difference.value + a * difference.by[0]),
                    -a * (difference.value + b * difference.by[1]),
                ],
            };
        }
        Partial {
            value: own[0] - a * difference.value,
            by: [
                own[1] - difference.value - a * difference.by[0],
                -a * difference.by[1],
            ],
        }
    };
    let level = Partial {
        value: -b * e.value,
        by: [-b * e.by[0], -e.value - b * e.by[1]],
    };
    [level, of(0), of(1), of(2)]
}

/// [`two_lags`] for rates below [`SLOW`]: Horner's scheme gives `v_3` at `b` and its divided difference, and the recursion gives the other
/// `v_k`: `(r v)[a, b] = v(b) + a v[a, b]`.
fn slow_lags(a: f64, b: f64) -> [Partial; 4] {
    let mut at_b = [0.0; 2];
    let mut between = Partial::default();
    for c in series(a.max(b)).iter().rev() {
        between = Partial {
            value: between.value * a + at_b[0],
            by: [
                between.by[0] * a + between.value,
                between.by[1] * a + at_b[1],
            ],
        };
        at_b = [at_b[0] * b + c, at_b[1] * b + at_b[0]];
    }
    // For r v: value and slope at b, and the divided difference.
    let times_rate = |at_b: [f64; 2], between: Partial| {
        let at = [b * at_b[0], at_b[0] + b * at_b[1]];
        let divided = Partial {
            value: at_b[0] + a * between.value,
            by: [
                between.value + a * between.by[0],
                at_b[1] + a * between.by[1],
            ],
        };
        (at, divided)
    };
    // v_(k-1) = (1 - r v_k)/k
    let before = |k: f64, at_b: [f64; 2], between: Partial| {
        let (at, divided) = times_rate(at_b, between);
        let i = -1.0 / k;
        let divided = Partial {
            value: divided.value * i,
            by: divided.by.map(|slope| slope * i),
        };
        ([(1.0 - at[0]) / k, at[1] * i], divided)
    };
    let (at_2, v2) = before(3.0, at_b, between);
    let (at_1, v1) = before(2.0, at_2, v2);
    let (at_0, v0) = before(1.0, at_1, v1);
    // E = 1 - r v_0
    let (_, minus_e) = times_rate(at_0, v0);
    let level = Partial {
        value: b * minus_e.value,
        by: [b * minus_e.by[0], minus_e.value + b * minus_e.by[1]],
    };
    let [w0, w1, w2] = [v0, v1, v2].map(|v| Partial {
        value: -a * b * v.value,
        by: [-b * (v.value + a * v.by[0]), -a * (v.value + b * v.by[1])],
    });
    [level, w0, w1, w2]
}

/// Gauss-Legendre quadrature with sixteen nodes on the unit interval: the nodes below one half, and the weights.
const NODES: [(f64, f64); 8] = [
    (0.4524937450811813, 0.09472530522753432),
    (0.35919822461037054, 0.09130170752246182),
    (0.2709916111713863, 0.08457825969750132),
    (0.19106187779867811, 0.07479799440828835),
    (0.1222977958224985, 0.062314485627767036),
    (0.06718439880608412, 0.0475792558412463),
    (0.0277124884633837, 0.031126761969323728),
    (0.005299532504175031, 0.013576229705877088),
];
