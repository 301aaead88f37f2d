//! Description of an effect for its user: its equations, constants and parameters, as its text has them.

use super::effect::{Effect, Place, RECORD_NUMBERS, Role};

/// A parameter of an effect, without a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DescribedParameter {
    /// Name of the parameter in the effect: `tau`.
    pub name: &'static str,
    /// Unit as in the text: `port`, `balance/port`; empty for a number.
    pub unit: &'static str,
    /// Expression of the value at which the effect is absent: `high + width`. Empty for a [`Role::Shape`], a [`Role::Begin`]
    /// and a [`Role::Choice`], whose values do not matter then.
    pub absent: &'static str,
    /// Description; may be empty.
    pub meaning: &'static str,
}

/// A line of the text that declares a variable.
struct Declaration {
    kind: &'static str,
    name: &'static str,
    unit: &'static str,
    value: &'static str,
    meaning: &'static str,
}

const KINDS: [&str; 6] = [
    "input Real ",
    "constant Real ",
    "final parameter Real ",
    "parameter Real ",
    "output Real ",
    "Real ",
];

fn declaration(line: &'static str) -> Option<Declaration> {
    let line = line.trim().trim_end_matches(';');
    let (kind, rest) = KINDS
        .into_iter()
        .find_map(|kind| Some((kind, line.strip_prefix(kind)?)))?;
    let name_end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    let (name, rest) = rest.split_at(name_end.unwrap_or(rest.len()));
    let (rest, meaning) = match rest.strip_suffix('"') {
        Some(rest) => rest.rsplit_once(" \"").unwrap_or((rest, "")),
        None => (rest, ""),
    };
    let mut depth = 0;
    let closes = |c: char| {
        depth += match c {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        depth == 0
    };
    let (attributes, rest) = if rest.starts_with('(') {
        let end = rest.find(closes).map_or(rest.len(), |at| at + 1);
        rest.split_at(end)
    } else {
        ("", rest)
    };
    let unit = attributes
        .split_once("unit=\"")
        .map_or("", |(_, rest)| rest.split('"').next().unwrap_or_default());
    Some(Declaration {
        kind,
        name,
        unit,
        value: rest.trim().strip_prefix("= ").unwrap_or_default(),
        meaning,
    })
}

impl Effect {
    /// The names of the port in the identifiers of the catalogue: `u` of `lag(u)`, `p,x` of `varies_with(p,x)`.
    #[must_use]
    pub fn port_names(&self) -> &'static str {
        match self.place {
            Place::Input => "u",
            Place::Output | Place::LevelReading => "y",
            Place::Balance => "x",
            Place::Parameter => "p",
            Place::ParameterAndSignal => "p,x",
            Place::States => "x1,x2",
            Place::InputAndBalance => "u,x",
            Place::BalanceAndSurrounding => "T,Ta",
            Place::BalanceAndSignal => "x,u",
            Place::Motion => "v",
            Place::MotionAndPosition | Place::Spring => "v,x",
            Place::Level => "h",
            Place::TankAndTankBelow => "h1,h2",
            Place::Terminal => "y,i",
        }
    }

    /// The equations, one a line: `v = y + error`.
    #[must_use]
    pub fn equations(&self) -> Vec<String> {
        let mut all = Vec::new();
        let mut at_start = false;
        for line in self.text.lines().map(str::trim) {
            match (line, declaration(line)) {
                ("equation" | "initial equation", _) => at_start = line.starts_with("initial"),
                (_, Some(own)) if !["output Real ", "Real "].contains(&own.kind) => {}
                (_, Some(own)) if own.value.is_empty() => {}
                (_, Some(own)) => all.push(format!("{} = {}", own.name, own.value)),
                _ if line.contains(" = ") => {
                    let when = if at_start { " at the start" } else { "" };
                    all.push(format!("{}{when}", line.trim_end_matches(';')));
                }
                _ => {}
            }
        }
        all
    }

    /// The parameters, in the order of the text.
    #[must_use]
    pub fn described_parameters(&self) -> Vec<DescribedParameter> {
        let declared = self.text.lines().filter_map(declaration);
        let own = declared.filter(|own| own.kind.ends_with("parameter Real "));
        own.map(|own| {
            let mut roles = self.parameters.iter();
            let role = roles.find_map(|(name, role, _)| (*name == own.name).then_some(*role));
            DescribedParameter {
                name: own.name,
                unit: own.unit,
                absent: match role {
                    Some(Role::Shape | Role::Begin | Role::Choice) => "",
                    _ => own.value,
                },
                meaning: own.meaning,
            }
        })
        .collect()
    }

    /// Constants with a value of their own, and those without whose values come from the data: `slow = 0.02*width`, `width`.
    #[must_use]
    pub fn constants(&self) -> Vec<String> {
        let declared = self.text.lines().filter_map(declaration);
        let own = declared.filter(|own| own.kind == "constant Real ");
        own.map(|own| match RECORD_NUMBERS.contains(&own.name) {
            true => own.name.to_string(),
            false => format!("{} = {}", own.name, own.value),
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::effects::all_effects;

    #[test]
    fn every_text_gives_its_equations_and_parameters() {
        for effect in all_effects() {
            let equations = effect.equations();
            assert!(
                equations.iter().any(|line| line.starts_with("v = ")),
                "{}: {equations:?}",
                effect.id
            );
            let described = effect.described_parameters();
            let declared = effect.text.matches("parameter Real ").count();
            assert_eq!(described.len(), declared, "{}", effect.id);
            for (name, ..) in effect.parameters {
                assert!(described.iter().any(|own| own.name == *name), "{name}");
            }
        }
    }

    #[test]
    fn a_declaration_is_read_with_its_unit_value_and_meaning() {
        let limit = all_effects().find(|effect| effect.id == "limit").unwrap();
        let bound = limit.described_parameters()[1];
        assert_eq!(
            (bound.name, bound.unit, bound.absent, bound.meaning),
            ("bound", "port", "high + width", "where it stops")
        );
        let lag = all_effects().find(|effect| effect.id == "lag").unwrap();
        assert_eq!(
            lag.equations(),
            [
                "v = u + min(tau/shortest, 1)*(x - u)",
                "x = u at the start",
                "max(tau, shortest)*der(x) = u - x"
            ]
        );
    }
}
