//! Printed figures of the paper: its tables 1 to 4, for a plant `K/(1 + tau s)` with K = 1 and tau = 10 s.
//!
//! A. J. Udink ten Cate, *Continuous-time constrained least-squares algorithms for recursive parameter estimation of stochastic linear
//! systems by a stabilized output error method*, WP-85-54, IIASA, Laxenburg, 1985, section 6.

use crate::Printed;

/// One of the tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    /// Number of the table, 1 to 4.
    pub number: usize,
    /// Forgetting rate eta, 1/s; 0 where the gain is constant.
    pub eta: f64,
    /// `P1(0)`: entries (tau, tau), (tau, K) and (K, K).
    pub p1: [f64; 3],
    /// `P2(0)`, of the error filter's coefficient c.
    pub p2: f64,
    /// Whether P1 and P2 keep their initial values.
    pub constant: bool,
    /// Rows K, tau (s), c (s); columns average, relative variance and, for K and tau, relative error.
    pub estimates: [[Printed; 3]; 3],
    /// The criterion (6.2) at 250, 500, 750 and 1000 s, s.
    pub criterion: [Printed; 4],
    /// At 1000 s: P1 as in `p1`, then P2.
    pub p: [Printed; 4],
}

const fn p(value: f64, decimals: usize) -> Printed {
    Printed::new(value, decimals)
}

/// The paper prints no error of c.
const NONE: Printed = p(f64::NAN, 0);

/// Tables 1 to 4.
pub const TABLES: [Table; 4] = [
    Table {
        number: 1,
        eta: 0.01,
        p1: [0.1, 0.0, 0.001],
        p2: 0.1,
        constant: false,
        estimates: [
            [p(1.079, 3), p(0.0057, 4), p(0.0795, 4)],
            [p(11.49, 2), p(0.023, 3), p(0.149, 3)],
            [p(-0.038, 3), p(0.336, 3), NONE],
        ],
        criterion: [p(402.8, 1), p(593.6, 1), p(614.6, 1), p(625.0, 1)],
        p: [p(5.03, 2), p(0.31, 2), p(0.029, 3), p(0.30, 2)],
    },
    Table {
        number: 2,
        eta: 0.02,
        p1: [0.1, 0.0, 0.001],
        p2: 0.1,
        constant: false,
        estimates: [
            [p(0.987, 3), p(0.0096, 4), p(0.013, 3)],
            [p(9.81, 2), p(0.022, 3), p(0.019, 3)],
            [p(-0.029, 3), p(1.099, 3), NONE],
        ],
        criterion: [p(343.2, 1), p(369.8, 1), p(371.18, 2), p(371.80, 2)],
        p: [p(8.86, 2), p(0.48, 2), p(0.048, 3), p(0.50, 2)],
    },
    Table {
        number: 3,
        eta: 0.02,
        p1: [0.3, 0.0, 0.003],
        p2: 0.3,
        constant: false,
        estimates: [
            [p(0.986, 3), p(0.009, 3), p(0.014, 3)],
            [p(9.80, 2), p(0.049, 3), p(0.020, 3)],
            [p(-0.029, 3), p(1.099, 3), NONE],
        ],
        criterion: [p(268.4, 1), p(277.2, 1), p(278.76, 2), p(279.37, 2)],
        p: [p(8.62, 2), p(0.48, 2), p(0.048, 3), p(0.50, 2)],
    },
    Table {
        number: 4,
        eta: 0.0,
        p1: [8.7, 0.48, 0.048],
        p2: 0.50,
        constant: true,
        estimates: [
            [p(0.985, 3), p(0.0082, 4), p(0.015, 3)],
            [p(9.76, 2), p(0.015, 3), p(0.024, 3)],
            [p(-0.030, 3), p(1.138, 3), NONE],
        ],
        criterion: [p(32.56, 2), p(32.72, 2), p(33.58, 2), p(33.99, 2)],
        p: [p(8.7, 1), p(0.48, 2), p(0.048, 3), p(0.50, 2)],
    },
];

/// Names of the cells of a table, in the order of [`Table::cells`]: `E250` is the criterion at 250 s, `P11`, `P12` and `P22` are entries of
/// P1.
pub const CELLS: [&str; 19] = [
    "K avg",
    "K rel.var",
    "K rel.err",
    "tau avg",
    "tau rel.var",
    "tau rel.err",
    "c avg",
    "c rel.var",
    "E250",
    "E500",
    "E750",
    "E1000",
    "E500-E250",
    "E750-E500",
    "E1000-E750",
    "P11",
    "P12",
    "P22",
    "P2",
];

impl Table {
    /// The printed figures and the differences of the criterion, 19; 15 without P where the gain is constant.
    pub fn cells(&self) -> Vec<Printed> {
        let [k, tau, [average, variance, _]] = self.estimates;
        let mut cells: Vec<Printed> = [k, tau].concat();
        cells.extend([average, variance]);
        cells.extend(self.criterion);
        cells.extend(self.criterion.windows(2).map(|pair| pair[1].minus(pair[0])));
        if !self.constant {
            cells.extend(self.p);
        }
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_a_figure_and_a_name() {
        let lengths = TABLES.map(|table| table.cells().len());
        assert_eq!(lengths, [19, 19, 19, 15]);
        assert!(
            TABLES
                .iter()
                .flat_map(Table::cells)
                .all(|cell| cell.value.is_finite())
        );
    }
}
