//! Quotients of units as texts: `m/s2` over `m/s` is `1/s`.
//!
//! A unit is a product of symbols with whole powers, and what two have in common cancels. Symbols are not converted into each other: `m/s`
//! over `h` is `m/(s.h)`. In a quotient a temperature is a difference, so `degC` is `K`.

/// Symbols with their powers, in the order of their first occurrence.
#[derive(Debug, Clone, Default, PartialEq)]
struct Powers(Vec<(String, i32)>);

/// Quotient of two units in the notation of Modelica: `W` over `degC` is `W/K`, `m/s` over `m/s` is `1`. Empty if a unit is unknown or is
/// not a product of powers.
pub(super) fn quotient(a: &str, b: &str) -> String {
    composed(a, b, -1)
}

/// The product of two units, in the form of [`quotient`].
pub(super) fn product(a: &str, b: &str) -> String {
    composed(a, b, 1)
}

fn composed(a: &str, b: &str, power: i32) -> String {
    let of = |text: &str| Reader { rest: text }.whole();
    match (of(a), of(b)) {
        (Some(mut a), Some(b)) => {
            a.times(b, power);
            a.text()
        }
        _ => String::new(),
    }
}

impl Powers {
    fn times(&mut self, other: Self, power: i32) {
        for (symbol, own) in other.0 {
            match self.0.iter_mut().find(|(known, _)| *known == symbol) {
                Some((_, sum)) => *sum += power * own,
                None => self.0.push((symbol, power * own)),
            }
        }
    }

    fn text(&self) -> String {
        let side = |sign: i32| -> Vec<String> {
            let here = self.0.iter().filter(|(_, power)| power.signum() == sign);
            here.map(|(symbol, power)| match power.abs() {
                1 => symbol.clone(),
                power => format!("{symbol}{power}"),
            })
            .collect()
        };
        let above = match side(1) {
            none if none.is_empty() => "1".to_string(),
            some => some.join("."),
        };
        match side(-1).as_slice() {
            [] => above,
            [one] => format!("{above}/{one}"),
            more => format!("{above}/({})", more.join(".")),
        }
    }
}

/// The part of a unit's text that is not read yet.
struct Reader<'t> {
    rest: &'t str,
}

impl Reader<'_> {
    /// `None` where the text is empty or no product of powers.
    fn whole(mut self) -> Option<Powers> {
        let powers = self.quotient()?;
        self.rest.trim().is_empty().then_some(powers)
    }

    fn quotient(&mut self) -> Option<Powers> {
        let mut powers = self.factor()?;
        loop {
            let blank = self.rest.starts_with(' ');
            if self.eat(&['/']) {
                let below = self.factor()?;
                powers.times(below, -1);
            } else if self.eat(&['.', '*', '·', '⋅'])
                || blank && !self.rest.trim_start().starts_with([')', '/'])
            {
                if self.rest.trim().is_empty() {
                    return Some(powers);
                }
                let other = self.factor()?;
                powers.times(other, 1);
            } else {
                return Some(powers);
            }
        }
    }

    /// A one, a symbol with its power, or a quotient in brackets.
    fn factor(&mut self) -> Option<Powers> {
        if self.eat(&['1']) {
            return Some(Powers::default());
        }
        if self.eat(&['(']) {
            let inner = self.quotient()?;
            return self.eat(&[')']).then_some(inner);
        }
        self.rest = self.rest.trim_start();
        let symbol = self.taken(|c| c.is_alphabetic() || "%‰°_".contains(c));
        if symbol.is_empty() {
            return None;
        }
        let marked = self.rest.starts_with('^') && self.eat(&['^']);
        let minus = self.rest.starts_with('-') && self.eat(&['-']);
        let digits = self.taken(|c| c.is_ascii_digit());
        let power = match (digits.as_str(), marked || minus) {
            ("", true) => return None,
            ("", false) => 1,
            (digits, _) => digits.parse::<i32>().ok()?,
        };
        let symbol = match symbol.as_str() {
            "degC" | "°C" => "K".to_string(),
            _ => symbol,
        };
        Some(Powers(vec![(symbol, if minus { -power } else { power })]))
    }

    fn taken(&mut self, is_part: impl Fn(char) -> bool) -> String {
        let end = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let (taken, rest) = self.rest.split_at(end);
        self.rest = rest;
        taken.to_string()
    }

    /// Whether one of these signs follows, after blanks or not; it is passed over.
    fn eat(&mut self, signs: &[char]) -> bool {
        let rest = self.rest.trim_start().strip_prefix(signs);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }
}

#[cfg(test)]
mod tests {
    use ct_signals::Unit;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn what_two_units_have_in_common_cancels() {
        for (a, b, expected) in [
            ("m/s2", "m/s", "1/s"),
            ("rad/s2", "rad/s", "1/s"),
            ("W", "degC", "W/K"),
            ("K/s", "K", "1/s"),
            ("degC/s", "degC", "1/s"),
            ("m3/s", "m", "m2/s"),
            ("cm^3/s", "cm", "cm2/s"),
            ("N", "m/s", "N.s/m"),
            ("N", "m2/s2", "N.s2/m2"),
            ("W", "m2.K", "W/(m2.K)"),
            ("J/(kg.K)", "K", "J/(kg.K2)"),
            ("J/kg/K", "J", "1/(kg.K)"),
            ("m", "m", "1"),
            ("1", "1/s", "s"),
            ("%", "s", "%/s"),
            ("m s-2", "m s-1", "1/s"),
            ("", "s", ""),
            ("cm^2.5", "s", ""),
        ] {
            assert_eq!(quotient(a, b), expected, "{a} over {b}");
        }
        assert_eq!(product("K/s", "J/K"), "J/s");
    }

    fn unit() -> impl Strategy<Value = String> {
        let symbol = prop::sample::select(vec!["m", "s", "kg", "K", "A", "V", "W", "rad"]);
        let factor = (symbol, prop::sample::select(vec!["", "2", "3", "-1", "^2"]));
        let product = prop::collection::vec(factor, 1..3).prop_map(|all| {
            let all: Vec<String> = all.into_iter().map(|(s, p)| format!("{s}{p}")).collect();
            all.join(".")
        });
        (product.clone(), prop::option::of(product)).prop_map(|(above, below)| match below {
            // A product in the denominator would need nested brackets, which are not supported.
            Some(below) => format!("{above}/{}", below.replace('.', "/")),
            None => above,
        })
    }

    proptest! {
        /// The quotient has the right dimension, contains no symbol twice, and its product with the divisor is the dividend.
        #[test]
        fn a_quotient_is_one_and_is_reduced(a in unit(), b in unit()) {
            let found = quotient(&a, &b);
            let expected = Unit::parse(&format!("({a})/({b})"));
            let conversion = Unit::parse(&found).zip(expected).and_then(|(f, e)| f.conversion_to(&e));
            prop_assume!(expected.is_some());
            prop_assert!(conversion.is_some_and(|c| (c.factor - 1.0).abs() < 1e-9), "{found}");
            let mut symbols: Vec<&str> = found
                .split(|c: char| !c.is_alphabetic())
                .filter(|symbol| !symbol.is_empty())
                .collect();
            let count = symbols.len();
            symbols.sort_unstable();
            symbols.dedup();
            prop_assert_eq!(symbols.len(), count, "{}", found);
            prop_assert_eq!(quotient(&product(&found, &b), &a), "1");
        }
    }
}
