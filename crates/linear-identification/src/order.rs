//! Orders of a model, and ranges of them.

use serde::Serialize;

/// The largest n.
pub const MAX_ORDER: usize = 4;

/// n and m, `m <= n`, n from 1 to [`MAX_ORDER`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Order {
    /// Degree of A.
    pub n: usize,
    /// Degree of B.
    pub m: usize,
}

impl std::str::FromStr for Order {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "an order is n,m with n from 1 to {MAX_ORDER} and m from 0 to n, as in 2,1; found {text}"
            )
        };
        let (n, m) = text.split_once(',').ok_or_else(wrong)?;
        let number = |part: &str| part.trim().parse::<usize>().map_err(|_| wrong());
        let (n, m) = (number(n)?, number(m)?);
        if !(1..=MAX_ORDER).contains(&n) || m > n {
            return Err(wrong());
        }
        Ok(Self { n, m })
    }
}

impl std::fmt::Display for Order {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{},{}", self.n, self.m)
    }
}

impl Order {
    /// Number of parameters, including the offset.
    pub fn parameters(self) -> usize {
        self.n + self.m + 2
    }

    /// The order with one pole less; `None` for the first order.
    #[must_use]
    pub fn lower(self) -> Option<Self> {
        let n = self.n.checked_sub(1).filter(|n| *n > 0)?;
        Some(Self {
            n,
            m: self.m.min(n),
        })
    }
}

/// One order, or a range of n with m below n.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Orders(pub Vec<Order>);

impl std::str::FromStr for Orders {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((first, last)) = text.split_once("..") else {
            return Ok(Self(vec![text.parse()?]));
        };
        let number = |part: &str| part.trim().parse::<usize>().ok();
        match (number(first), number(last)) {
            (Some(first), Some(last)) if 1 <= first && first <= last && last <= MAX_ORDER => {
                let all = (first..=last).flat_map(|n| (0..n).map(move |m| Order { n, m }));
                Ok(Self(all.collect()))
            }
            _ => Err(format!(
                "a range of orders is n..n with both from 1 to {MAX_ORDER}, as in 1..3; found {text}"
            )),
        }
    }
}
