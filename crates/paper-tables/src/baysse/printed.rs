//! Printed figures of the second paper: its tables I and II, and those that cannot be correct.
//!
//! A. Baysse, F. J. Carrillo, A. Habbadi, *Algorithme d'identification à erreur de sortie pour systèmes à temps continu en boucle fermée à
//! partir de données échantillonnées*, section III.

use crate::Printed;

const fn p(value: f64, decimals: usize) -> Option<Printed> {
    Some(Printed::new(value, decimals))
}

/// Printed figures of a column of table I.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Simulated {
    /// Means of K and tau (s) over the runs.
    pub mean: [Option<Printed>; 2],
    /// Variances of the estimates; of tau in s^2.
    pub variance: [Option<Printed>; 2],
    /// The distance D of equation (34).
    pub distance: Option<Printed>,
    /// Mean number of iterations; from the text.
    pub iterations: Option<Printed>,
}

const NOT_PRINTED: Simulated = Simulated {
    mean: [None; 2],
    variance: [None; 2],
    distance: None,
    iterations: None,
};

/// Table I: instruments.
pub const INSTRUMENTS: Simulated = Simulated {
    mean: [p(5.91416, 5), p(90.3202, 4)],
    variance: [p(4.84e-4, 6), p(2.08, 2)],
    distance: p(196.89, 2),
    ..NOT_PRINTED
};

/// Table I: the method without normalisation.
pub const PLAIN: Simulated = Simulated {
    mean: [p(6.0044, 4), p(110.0262, 4)],
    variance: [p(2.33e-4, 6), p(0.869, 3)],
    distance: p(9.30, 2),
    iterations: p(4.6, 1),
};

/// Table I: the method with normalisation.
pub const NORMALISED: Simulated = Simulated {
    mean: [p(6.0010, 4), p(110.0067, 4)],
    variance: [p(1.57e-4, 6), p(0.482, 3)],
    distance: p(8.23, 2),
    iterations: p(2.8, 1),
};

/// A column of table II: K (cm/V), tau (s) and their variances.
pub type Measured = [Option<Printed>; 4];

/// Table II: instruments.
pub const RIG_INSTRUMENTS: Measured = [p(2.60, 2), p(23.5, 1), p(2.11e-3, 5), p(0.143, 3)];
/// Table II: the method without normalisation.
pub const RIG_PLAIN: Measured = [p(6.90, 2), p(107.73, 2), p(1.84e-4, 6), p(0.0508, 4)];
/// Table II: the method with normalisation.
pub const RIG_NORMALISED: Measured = [p(6.93, 2), p(108.12, 2), p(1.80e-4, 6), p(0.0470, 4)];

/// Figures that cannot be correct as printed, and their replacement.
pub const MISPRINTS: [&str; 10] = [
    "Table II's controller, Ki = 0.074: very probably 0.0074, which 40/tau = lambda = 0.5372 and Kp/Ki = tau give. With 0.074 the fit does not come near the printed gain and time constant.",
    "Table II's filter, zeta = 0.6618 = 1.2 lambda: it is 1.2 times Kp = 0.5515, not 1.2 times 0.5372; the two may be swapped.",
    "(26) has phi^ phi^' in the inverse, which is biased even in open loop; instruments have phi^ phi'. Both are in the table.",
    "(19) and (20): with u = K1 q the gain would be K0 K2/K1; q = K1 u is right.",
    "(8) has stray transposes; (31) is right.",
    "(6), first line: the gradient step has no length; a unit step sends K to -0.4.",
    "\"A larger mu converges faster\": it is slower, and safer.",
    "Normalisation and mu diag(J''): with the diagonal, the iterations in theta and in delta are the same to rounding. That 4.6 iterations become 2.8 can only come from mu I.",
    "The two columns of the method minimise the same criterion; converged, they are equal. The paper's differ because their noise did.",
    "D of the table does not follow from its own means and variances: 8.23 would need a variance of tau of 0.68. In (34), N is the number of runs.",
];
