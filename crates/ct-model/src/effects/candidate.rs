//! All effects at all ports of a model.

mod at_port;
mod naming;

use std::collections::{BTreeMap, BTreeSet};

use self::at_port::candidate;
pub use self::naming::check_term_name;
use super::balance::limit;
use super::effect::{Effect, EffectText, Place, Role};
use super::fragment::{Action, Fragment};
use super::port::Port;
use super::scale::balance_unit;
use super::visited::Visited;
use super::{all_effects, domain, level_shift, shape};
use crate::expression::{Expression, Operator, Variable};
use crate::spec::{About, Given, ModelSpec, Parameter};

/// A parameter of an effect at a port.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectParameter {
    /// Name of the parameter in the model that the effect was added to: `lag_u_tau`.
    pub name: String,
    /// Name of the parameter in the effect: `tau`.
    pub short: String,
    /// Unit of the parameter.
    pub unit: String,
    /// Description of the parameter.
    pub description: String,
    /// Role of the parameter in a search.
    pub role: Role,
    /// Value at which the effect is absent. For a [`Role::Shape`] the value does not matter.
    pub absent: f64,
    /// Smallest and largest value.
    pub bounds: (f64, f64),
    /// Start values of fits; with several parameters, every combination is used.
    pub starts: Vec<f64>,
}

/// An effect at a port of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Identifier of the effect: `lag(u)`, `varies_with(k,T)`, or the name of a user's own candidate.
    pub id: String,
    /// Port at which the effect acts.
    pub port: Port,
    /// The effect; `None` for a candidate of the model file.
    pub effect: Option<&'static Effect>,
    /// Parameters of the effect.
    pub parameters: Vec<EffectParameter>,
    /// Numbers of the record that the effect's equations contain, by their names in its text ([`Effect::record_numbers`]). If they are
    /// passed to [`candidates_keeping`], the effect means the same for another record.
    pub record_numbers: BTreeMap<&'static str, f64>,
    /// Identifier of the candidate of the model file that this one repeats with its own states and parameters: a second RC pair. Alone the
    /// two are equal.
    pub repeats: Option<String>,
    pub(super) fragment: Fragment,
    /// Names of its variables begin with this.
    pub(super) stem: String,
}

impl Candidate {
    /// [`Candidate::record_numbers`] in the form of the results.
    #[must_use]
    pub fn numbers_of_record(&self) -> BTreeMap<String, f64> {
        let all = self.record_numbers.iter();
        all.map(|(name, value)| ((*name).to_string(), *value))
            .collect()
    }

    /// Whether the outputs have a derivative with respect to every size at the absent value: then the effect can be scored there, over the
    /// starts of its shape parameters.
    #[must_use]
    pub fn is_smooth(&self) -> bool {
        let mut roles = self.parameters.iter().map(|parameter| parameter.role);
        roles.all(|role| matches!(role, Role::Size | Role::Shape))
    }

    /// The candidate with a common factor on all its terms: zero if the effect is absent, one if it is present. `None` if the parameters of
    /// the candidate themselves have values at which the effect is absent.
    ///
    /// No finite values of resistance and capacitance remove an RC pair from a model: only their limit does. The factor makes the score test
    /// possible; it is not fitted, and is used in the model of the score test only. It is the last parameter, and may be negative if another
    /// one may.
    #[must_use]
    pub fn with_factor(&self, spec: &ModelSpec) -> Option<Self> {
        let mut roles = self.parameters.iter().map(|parameter| parameter.role);
        let Action::Add(terms) = &self.fragment.action else {
            return None;
        };
        if self.effect.is_some() || !roles.all(|role| role == Role::Shape) {
            return None;
        }
        let own = self.parameters.iter();
        let signed = own.clone().any(|parameter| parameter.bounds.0 < 0.0);
        let mut name = format!("{}_factor", self.stem);
        let taken = |name: &str| own.clone().any(|parameter| parameter.name == name);
        while taken(&name) || spec.find(&name).is_some() {
            name.push('_');
        }
        let about = About {
            name: name.clone(),
            min: if signed { f64::NEG_INFINITY } else { 0.0 },
            max: f64::INFINITY,
            ..About::default()
        };
        let factor = Variable::Parameter(spec.parameters.len() + self.fragment.parameters.len());
        let scaled = |term: &Expression| {
            Expression::Binary(
                Operator::Multiply,
                Box::new(Expression::Variable(factor)),
                Box::new(term.clone()),
            )
        };
        let terms = terms.iter().map(|(target, term)| (*target, scaled(term)));
        let mut candidate = self.clone();
        candidate.fragment.action = Action::Add(terms.collect());
        candidate.parameters.push(EffectParameter {
            name,
            short: "factor".to_string(),
            unit: String::new(),
            description: String::new(),
            role: Role::Size,
            absent: 0.0,
            bounds: (about.min, about.max),
            starts: vec![1.0],
        });
        candidate.fragment.parameters.push(Parameter {
            about,
            value: 0.0,
            definition: None,
            given: Given::Fitted,
        });
        Some(candidate)
    }

    /// What the effect is and how to confirm it, in the terms of the port's physical domain; `None` for a candidate of the model file.
    #[must_use]
    pub fn described(&self, spec: &ModelSpec) -> Option<EffectText> {
        let effect = self.effect?;
        Some(match self.port {
            Port::Balance(state) if *effect == limit::EFFECT => {
                limit::text_of(domain::quantity(spec, state))
            }
            _ => EffectText {
                physics: effect.physics,
                confirm: effect.confirm,
            },
        })
    }

    /// Number of fitted parameters.
    #[must_use]
    pub fn fitted(&self) -> usize {
        let roles = self.parameters.iter().map(|parameter| parameter.role);
        roles.filter(|role| *role != Role::Choice).count()
    }

    /// Whether the effect is a function of time alone: a drift, a step, a period. Such an effect can compensate for any slow disturbance.
    #[must_use]
    pub fn follows_time(&self) -> bool {
        // The start of the record is an input of effects that happen at an instant.
        self.record_numbers.contains_key("begin")
    }

    /// Whether the effect is a smooth function without physics. Searches do not use it as a candidate ([`shapes_keeping`]).
    #[must_use]
    pub fn is_shape(&self) -> bool {
        self.effect
            .is_some_and(|effect| shape::EFFECTS.contains(effect))
    }

    /// Every combination of the starts, a value for each parameter.
    #[must_use]
    pub fn starts(&self) -> Vec<Vec<f64>> {
        let mut all = vec![Vec::new()];
        for parameter in &self.parameters {
            let longer = all.iter().flat_map(|begun: &Vec<f64>| {
                parameter.starts.iter().map(|start| {
                    let mut begun = begun.clone();
                    begun.push(*start);
                    begun
                })
            });
            all = longer.collect();
        }
        // A limit at both ends is the same with either sign.
        let own = self.parameters.iter();
        let limit = own.clone().position(|own| own.short == "limit");
        let side = own.clone().position(|own| own.short == "side");
        if let (Some(limit), Some(side)) = (limit, side) {
            all.retain(|values| values[side] != 0.0 || values[limit] > 0.0);
        }
        all
    }
}

/// All effects that can act in a model, at all its ports.
///
/// Left out are: effects, except a limit, in equations that define one state as the derivative of another; an input to a balance that
/// contains it already; the effects of a flow that a fitted parameter scales, because the effects of this parameter are the same.
#[must_use]
pub fn candidates(spec: &ModelSpec, visited: &Visited) -> Vec<Candidate> {
    candidates_keeping(spec, visited, &BTreeMap::new())
}

/// All effects that can act in a model. For the identifiers in `kept`, the numbers of an earlier record ([`Candidate::record_numbers`])
/// replace those from `visited`.
#[must_use]
pub fn candidates_keeping(
    spec: &ModelSpec,
    visited: &Visited,
    kept: &BTreeMap<String, BTreeMap<String, f64>>,
) -> Vec<Candidate> {
    of_effects(all_effects(), spec, visited, kept)
}

/// Smooth functions of a state or an input, `shape(x,u)`, or of time, `course(x)`, at all ports of a model. Searches do not use them.
/// `kept`: as in [`candidates_keeping`].
#[must_use]
pub fn shapes_keeping(
    spec: &ModelSpec,
    visited: &Visited,
    kept: &BTreeMap<String, BTreeMap<String, f64>>,
) -> Vec<Candidate> {
    let mut all = of_effects(shape::EFFECTS.iter(), spec, visited, kept);
    // A state that is read itself has one name as a balance and as an output: the function of time is that of the balance.
    let mut known = BTreeSet::new();
    all.retain(|candidate| known.insert(candidate.id.clone()));
    all
}

/// A level shift of each output, in the order of the outputs: `level_shift(y)`. They are no candidates of a search.
#[must_use]
pub fn level_shifts(spec: &ModelSpec, visited: &Visited) -> Vec<Candidate> {
    let effects = std::iter::once(&level_shift::EFFECT);
    of_effects(effects, spec, visited, &BTreeMap::new())
}

fn of_effects(
    effects: impl Iterator<Item = &'static Effect>,
    spec: &ModelSpec,
    visited: &Visited,
    kept: &BTreeMap<String, BTreeMap<String, f64>>,
) -> Vec<Candidate> {
    let ports = spec.ports();
    let mut all = Vec::new();
    for effect in effects {
        for port in ports_of(spec, visited, effect, &ports) {
            all.extend(candidate(spec, visited, effect, port, kept));
        }
    }
    all
}

fn ports_of(
    spec: &ModelSpec,
    visited: &Visited,
    effect: &Effect,
    ports: &super::Ports,
) -> Vec<Port> {
    let single = || ports.single.iter().copied();
    let states = 0..spec.states.len();
    let signals = || -> Vec<Variable> {
        let inputs = (0..spec.inputs.len()).map(Variable::Input);
        let signals = states.clone().map(Variable::State).chain(inputs);
        let moves = |signal: &Variable| {
            let span = visited.spans.get(signal);
            span.is_none_or(|span| span.high > span.low)
        };
        signals.filter(moves).collect()
    };
    let balances = || states.clone().filter(|&i| spec.speed_of(i).is_none());
    match effect.place {
        Place::Input => single()
            .filter(|port| matches!(port, Port::Input(_)))
            .collect(),
        Place::Output => single()
            .filter(|port| matches!(port, Port::Output(_)))
            .collect(),
        Place::Balance if effect.id == "limit" => states.map(Port::Balance).collect(),
        Place::Balance => balances().map(Port::Balance).collect(),
        Place::Parameter => ports.values.clone(),
        Place::ParameterAndSignal => {
            let signals = signals();
            let of = |port: &Port| match port {
                Port::Value(value) => Some(*value),
                _ => None,
            };
            let values = ports.values.iter().filter_map(of);
            let dependences =
                values.flat_map(|value| signals.iter().map(move |x| Port::Dependence(value, *x)));
            dependences.chain(spec.measured_capacities()).collect()
        }
        Place::BalanceAndSignal => {
            let signals = signals();
            balances()
                .flat_map(|x| signals.iter().map(move |s| Port::BalanceAnd(x, *s)))
                .collect()
        }
        Place::States => {
            let unit = |i: usize| spec.states[i].about.unit.as_str();
            let pairs = balances().flat_map(|a| balances().map(move |b| (a, b)));
            let alike = |&(a, b): &(usize, usize)| {
                let units = [a, b].map(|i| balance_unit(spec, i, &visited.time_unit));
                let same = units[0] == units[1] || units.iter().any(String::is_empty);
                a < b && unit(a) == unit(b) && same
            };
            pairs
                .filter(alike)
                .map(|(a, b)| Port::Between(a, b))
                .collect()
        }
        Place::InputAndBalance => {
            let inputs = 0..spec.inputs.len();
            let pairs = inputs.flat_map(|u| balances().map(move |x| (u, x)));
            pairs
                .filter(|&(u, x)| !spec.depends_on(x, Variable::Input(u)))
                .map(|(u, x)| Port::InputAndBalance(u, x))
                .collect()
        }
        Place::BalanceAndSurrounding
        | Place::Motion
        | Place::MotionAndPosition
        | Place::Spring
        | Place::Level
        | Place::LevelReading
        | Place::TankAndTankBelow
        | Place::Terminal => domain::ports(spec, effect),
    }
}

/// The best starts of a sorted list, and the best start of each value of a choice that these lack: a fit does not change a choice. `choice`:
/// the values of the parameters with [`Role::Choice`].
pub fn best_of_each_choice<T>(
    sorted: Vec<T>,
    choice: impl Fn(&T) -> Vec<f64>,
    most: usize,
) -> Vec<T> {
    let mut seen: Vec<Vec<f64>> = Vec::new();
    let kept = sorted.into_iter().enumerate().filter(|(rank, start)| {
        let choice = choice(start);
        let new = !seen.contains(&choice);
        if new {
            seen.push(choice);
        }
        new || *rank < most
    });
    kept.map(|(_, start)| start).collect()
}

#[cfg(test)]
mod tests {
    use super::best_of_each_choice;

    #[test]
    fn the_best_start_of_each_choice_is_kept() {
        let sorted = vec![(1, -1.0), (2, -1.0), (3, -1.0), (4, 1.0), (5, 1.0)];
        let kept = |choice: fn(&(i32, f64)) -> Vec<f64>, most: usize| -> Vec<i32> {
            let best = best_of_each_choice(sorted.clone(), choice, most);
            best.iter().map(|(start, _)| *start).collect()
        };
        assert_eq!(kept(|_| Vec::new(), 2), [1, 2]);
        assert_eq!(kept(|(_, side)| vec![*side], 2), [1, 2, 4]);
        assert_eq!(kept(|(_, side)| vec![*side], 5), [1, 2, 3, 4, 5]);
    }
}
