//! A model with effects in it.

use std::collections::{BTreeMap, BTreeSet};

use super::all_effects;
use super::candidate::Candidate;
use super::fragment::{Action, Counts, Target, sum};
use super::port::Port;
use crate::expression::{Expression, Variable};
use crate::spec::{About, Flow, ModelSpec, Output, State};

/// Reasons why effects cannot be added to a model.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ApplyError {
    /// An effect is given twice.
    #[error("{id} is given twice: add it once")]
    Twice {
        /// The effect.
        id: String,
    },
    /// Flows would form an algebraic loop.
    #[error("with {effects} these form an algebraic loop: {}", names.join(" -> "))]
    Circle {
        /// The effects.
        effects: String,
        /// The flows.
        names: Vec<String>,
    },
    /// A candidate belongs to another model.
    #[error("{id} belongs to another model: use the candidates of this model")]
    OtherModel {
        /// The effect.
        id: String,
    },
}

/// The model with these effects in it, in the order of their chains whatever order they are given in: terms of equations, parameters and
/// flows, limits, inputs (delay, nonlinearity, dead zone, saturation, drift of the gain, backlash, lag), outputs (lag, nonlinearity,
/// saturation, hysteresis, drift, offset, quantisation).
///
/// The candidates are those of this model. Their parameters follow its own, at their absent values, with their bounds; a
/// [`super::Role::Choice`] is not fitted. What was an output keeps its name and its unit, and is the reading; what is measured is called
/// `y_true`.
///
/// # Errors
/// Where an effect is given twice, belongs to another model, or closes a circle.
pub fn apply(spec: &ModelSpec, candidates: &[&Candidate]) -> Result<ModelSpec, ApplyError> {
    let mut ordered = candidates.to_vec();
    ordered.sort_by_key(|candidate| (rank(candidate), candidate.port, &candidate.id));
    let mut seen = BTreeSet::new();
    for candidate in &ordered {
        if !seen.insert(candidate.id.as_str()) {
            return Err(ApplyError::Twice {
                id: candidate.id.clone(),
            });
        }
    }
    let mut mended = Mended {
        base: Counts::of(spec),
        spec: spec.clone(),
        reads: spec.outputs.iter().map(|output| output.variable).collect(),
        ends: BTreeMap::new(),
    };
    for candidate in &ordered {
        if !mended.has(candidate.port) {
            return Err(ApplyError::OtherModel {
                id: candidate.id.clone(),
            });
        }
        mended.add(candidate);
    }
    mended.name_readings(spec);
    let mut spec = mended.spec;
    outputs_in_order(&mut spec);
    if let Err(circle) = spec.sort_flows() {
        let of = |i: &usize| spec.flows[*i].about.name.clone();
        let ids: Vec<&str> = candidates.iter().map(|c| c.id.as_str()).collect();
        return Err(ApplyError::Circle {
            effects: ids.join(" and "),
            names: circle.iter().chain(circle.first()).map(of).collect(),
        });
    }
    of_parameters_still(&mut spec);
    Ok(spec)
}

/// Position of an effect in the order of all effects.
fn rank(candidate: &Candidate) -> (u8, usize) {
    let group = match (&candidate.fragment.action, candidate.port) {
        (Action::Add(terms), _) => {
            let reads = |(target, _): &(Target, Expression)| matches!(target, Target::Output(_));
            if terms.iter().any(reads) { 4 } else { 0 }
        }
        (Action::Stand(_), Port::Value(_) | Port::Dependence(..)) => 1,
        (Action::Govern { .. }, _) => 2,
        (Action::Stand(_), Port::Input(_)) => 3,
        (Action::Stand(_), _) => 5,
    };
    let place = all_effects().position(|effect| candidate.effect.is_some_and(|own| own == effect));
    (group, place.unwrap_or(0))
}

struct Mended {
    base: Counts,
    spec: ModelSpec,
    /// Variables that the outputs read before the effects are added.
    reads: Vec<Variable>,
    /// Current end of the chain of effects of each port.
    ends: BTreeMap<Port, Variable>,
}

impl Mended {
    fn has(&self, port: Port) -> bool {
        let value = |variable: Variable| match variable {
            Variable::Parameter(i) => i < self.base.parameters,
            Variable::Input(i) => i < self.spec.inputs.len(),
            Variable::State(i) => i < self.base.states,
            Variable::Flow(i) => i < self.base.flows,
        };
        let state = |i: usize| i < self.base.states;
        match port {
            Port::Input(i) => i < self.spec.inputs.len(),
            Port::Output(i) => i < self.spec.outputs.len(),
            Port::Balance(i) => state(i),
            Port::Value(p) => value(p),
            Port::Dependence(p, x) => value(p) && value(x),
            Port::Between(a, b) => state(a) && state(b),
            Port::InputAndBalance(u, x) => u < self.spec.inputs.len() && state(x),
            Port::BalanceAnd(x, a) => state(x) && value(a),
            Port::OutputAnd(y, a) => y < self.spec.outputs.len() && value(a),
            Port::Own => true,
        }
    }

    fn add(&mut self, candidate: &Candidate) {
        let fragment = &candidate.fragment;
        let (base, now) = (self.base, Counts::of(&self.spec));
        // Predecessor of the effect: its port, or the effect before it in the chain.
        let (chain, port) = match candidate.port {
            Port::Input(u) => (Some(candidate.port), Some(Variable::Input(u))),
            Port::Output(y) | Port::OutputAnd(y, _) => {
                (Some(Port::Output(y)), Some(self.spec.outputs[y].variable))
            }
            Port::Value(p) | Port::Dependence(p, _) => (Some(Port::Value(p)), Some(p)),
            _ => (None, None),
        };
        let original = match chain {
            Some(Port::Output(y)) => Some(self.reads[y]),
            _ => port,
        };
        let end = chain
            .and_then(|chain| self.ends.get(&chain).copied())
            .or(port);
        let moved = |variable: Variable| {
            if Some(variable) == original {
                return end.unwrap_or(variable);
            }
            match variable {
                Variable::Parameter(i) if i >= base.parameters => {
                    Variable::Parameter(i - base.parameters + now.parameters)
                }
                Variable::State(i) if i >= base.states => {
                    Variable::State(i - base.states + now.states)
                }
                Variable::Flow(i) if i >= base.flows => Variable::Flow(i - base.flows + now.flows),
                other => other,
            }
        };
        let of = |variable: Variable| Expression::Variable(moved(variable));
        let parameters = fragment.parameters.iter().cloned();
        self.spec.parameters.extend(parameters);
        for state in &fragment.states {
            self.spec.states.push(State {
                about: state.about.clone(),
                coefficient: state.coefficient.as_ref().map(|c| c.with(&of)),
                right: state.right.with(&of),
                start: state.start.with(&of),
                fixed: state.fixed,
            });
        }
        for flow in &fragment.flows {
            self.spec.flows.push(Flow {
                about: flow.about.clone(),
                value: flow.value.with(&of),
                of_parameters: false,
            });
        }
        match &fragment.action {
            Action::Stand(result) => {
                let result = moved(*result);
                if let (Some(chain), Some(end)) = (chain, end) {
                    if let Port::Output(y) = chain {
                        self.spec.outputs[y].variable = result;
                    } else {
                        self.replace(end, result, now);
                    }
                    self.ends.insert(chain, result);
                }
            }
            Action::Add(terms) => {
                for (target, term) in terms {
                    self.add_term(*target, term.with(&of), &candidate.stem);
                }
            }
            Action::Govern { result, rate: _ } => {
                let Port::Balance(x) = candidate.port else {
                    return;
                };
                let result = Expression::Variable(moved(*result));
                let right = std::mem::replace(&mut self.spec.states[x].right, result);
                self.spec.flows.push(Flow {
                    about: About {
                        name: format!("{}_rate", candidate.stem),
                        ..unbounded()
                    },
                    value: right,
                    of_parameters: false,
                });
            }
        }
    }

    fn add_term(&mut self, target: Target, term: Expression, stem: &str) {
        match target {
            Target::State(i) => {
                let right = &mut self.spec.states[i].right;
                *right = sum(std::mem::replace(right, Expression::Time), term);
            }
            Target::Flow(i) => {
                let value = &mut self.spec.flows[i].value;
                *value = sum(std::mem::replace(value, Expression::Time), term);
            }
            Target::Output(y) => {
                let before = self.spec.outputs[y].variable;
                let result = Variable::Flow(self.spec.flows.len());
                let name = &self.spec.about(self.reads[y]).name;
                self.spec.flows.push(Flow {
                    about: About {
                        name: format!("{stem}_{name}"),
                        ..unbounded()
                    },
                    value: sum(Expression::Variable(before), term),
                    of_parameters: false,
                });
                self.spec.outputs[y].variable = result;
                self.ends.insert(Port::Output(y), result);
            }
        }
    }

    /// Replaces one variable by another in all expressions that were there before the last effect.
    fn replace(&mut self, old: Variable, new: Variable, before: Counts) {
        let of =
            |variable: Variable| Expression::Variable(if variable == old { new } else { variable });
        for flow in &mut self.spec.flows[..before.flows] {
            flow.value = flow.value.with(&of);
        }
        for i in 0..before.states {
            let settled = self.spec.is_settled(i);
            let state = &mut self.spec.states[i];
            state.coefficient = state.coefficient.as_ref().map(|c| c.with(&of));
            state.right = state.right.with(&of);
            if settled {
                state.start = state.start.with(&of);
            }
        }
    }

    /// The reading keeps the name of the output, and the measured quantity gets another one.
    fn name_readings(&mut self, spec: &ModelSpec) {
        for (y, &measured) in self.reads.iter().enumerate() {
            let Variable::Flow(reading) = self.spec.outputs[y].variable else {
                continue;
            };
            if reading < self.base.flows {
                continue;
            }
            let about = spec.about(measured).clone();
            let mut name = format!("{}_true", about.name);
            while self.spec.find(&name).is_some() {
                name.push('_');
            }
            let own = match measured {
                Variable::State(i) => &mut self.spec.states[i].about,
                Variable::Flow(i) => &mut self.spec.flows[i].about,
                // An output is one of these.
                Variable::Parameter(_) | Variable::Input(_) => continue,
            };
            own.name = name;
            self.spec.flows[reading].about = about;
        }
    }
}

fn unbounded() -> About {
    About {
        min: f64::NEG_INFINITY,
        max: f64::INFINITY,
        ..About::default()
    }
}

/// Sorts the flows that are outputs in the order of the outputs: a text has a single order.
fn outputs_in_order(spec: &mut ModelSpec) {
    let flow = |output: &Output| match output.variable {
        Variable::Flow(i) => Some(i),
        _ => None,
    };
    let wanted: Vec<usize> = spec.outputs.iter().filter_map(flow).collect();
    let mut places = wanted.clone();
    places.sort_unstable();
    places.dedup();
    if places.len() != wanted.len() {
        return;
    }
    let mut moved: Vec<usize> = (0..spec.flows.len()).collect();
    for (from, to) in wanted.iter().zip(&places) {
        moved[*from] = *to;
    }
    let variable = |variable: Variable| match variable {
        Variable::Flow(i) => Variable::Flow(moved[i]),
        other => other,
    };
    let of = |old: Variable| Expression::Variable(variable(old));
    let mut flows = spec.flows.clone();
    for (old, flow) in spec.flows.iter().enumerate() {
        flows[moved[old]] = Flow {
            value: flow.value.with(&of),
            ..flow.clone()
        };
    }
    spec.flows = flows;
    for state in &mut spec.states {
        state.coefficient = state.coefficient.as_ref().map(|c| c.with(&of));
        state.right = state.right.with(&of);
        state.start = state.start.with(&of);
    }
    for output in &mut spec.outputs {
        output.variable = variable(output.variable);
    }
}

/// A parameter that depends on others stays a parameter only if none of them changes with time.
fn of_parameters_still(spec: &mut ModelSpec) {
    for i in spec.order.clone() {
        let mut still = spec.flows[i].of_parameters;
        spec.flows[i]
            .value
            .each_variable(&mut |variable| match variable {
                Variable::Parameter(_) => {}
                Variable::Flow(k) => still &= spec.flows[k].of_parameters,
                Variable::Input(_) | Variable::State(_) => still = false,
            });
        spec.flows[i].of_parameters = still;
    }
}
