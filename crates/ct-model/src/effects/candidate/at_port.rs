//! An effect at a port: its text with the names, units and start values for this port.

use std::collections::BTreeMap;

use super::{Candidate, EffectParameter};
use crate::effects::effect::{Effect, Place, Role, Starts};
use crate::effects::fragment::{Counts, instance};
use crate::effects::port::Port;
use crate::effects::scale::{Scales, balance_unit};
use crate::effects::unit_text::quotient;
use crate::effects::visited::{Span, Visited};
use crate::expression::Variable;
use crate::spec::{Given, ModelSpec};

/// The variables of an effect's inputs, by their names there, the signal first; states to whose equations it is added, and whether it is
/// subtracted there.
type Wiring = (Vec<(&'static str, Variable)>, Vec<(usize, bool)>);

/// An effect at a port; `None` where its text cannot be read, which a test excludes.
pub(super) fn candidate(
    spec: &ModelSpec,
    visited: &Visited,
    effect: &'static Effect,
    port: Port,
    kept: &BTreeMap<String, BTreeMap<String, f64>>,
) -> Option<Candidate> {
    let id = format!("{}({})", effect.id, port.names(spec));
    let state = Variable::State;
    let (inputs, targets): Wiring = match port {
        Port::Input(u) => (vec![("u", Variable::Input(u))], Vec::new()),
        Port::Output(y) => (
            vec![
                ("y", spec.outputs[y].variable),
                ("u", spec.outputs[y].variable),
            ],
            Vec::new(),
        ),
        Port::Balance(x) => (vec![("x", state(x))], vec![(x, false)]),
        Port::Value(p) => (vec![("p", p)], Vec::new()),
        Port::Dependence(p, x) => (vec![("x", x), ("p", p)], Vec::new()),
        Port::Between(a, b) => (
            vec![("x1", state(a)), ("x2", state(b))],
            vec![(a, true), (b, false)],
        ),
        Port::InputAndBalance(u, x) => (vec![("u", Variable::Input(u))], vec![(x, false)]),
        Port::BalanceAnd(x, a) if effect.place == Place::BalanceAndSignal => {
            (vec![("x", a)], vec![(x, false)])
        }
        Port::BalanceAnd(v, x)
            if matches!(effect.place, Place::MotionAndPosition | Place::Spring) =>
        {
            (vec![("x", x), ("a", state(v))], vec![(v, false)])
        }
        Port::BalanceAnd(x, a) => (vec![("x", state(x)), ("a", a)], vec![(x, false)]),
        Port::OutputAnd(y, a) => (vec![("a", a), ("y", spec.outputs[y].variable)], Vec::new()),
        Port::Own => return None,
    };
    let signal = inputs[0].1;
    let mut span = visited.span(signal);
    if let Port::Between(_, b) = port {
        span = span.joined(&visited.span(state(b)));
    }
    if let Port::BalanceAnd(_, a) = port
        && effect.place == Place::BalanceAndSurrounding
    {
        span = span.joined(&visited.span(a));
    }
    let scales = Scales::of(spec, visited);
    let balance = targets.iter().map(|&(x, _)| scales.balance(x));
    let balance = balance.fold(0.0, f64::max);
    let balance = if balance > 0.0 {
        balance
    } else {
        scales.reading(port)
    };
    // For a temperature: the zero of its unit above absolute zero.
    let zero = if spec.about(signal).unit == "K" {
        0.0
    } else {
        273.15
    };
    let mut constants = BTreeMap::from([
        ("low", span.low),
        ("high", span.high),
        ("middle", 0.5 * (span.low + span.high)),
        ("width", span.width()),
        ("first", span.first),
        ("begin", visited.begin),
        ("zero", zero),
        ("duration", visited.duration),
        ("interval", visited.interval),
        ("balance", balance),
    ]);
    if let Some(kept) = kept.get(&id) {
        for (name, value) in &mut constants {
            *value = kept.get(*name).copied().unwrap_or(*value);
        }
    }
    let numbers = effect.record_numbers().into_iter();
    let numbers = numbers.filter_map(|name| Some((name, *constants.get(name)?)));
    let record_numbers = numbers.collect();
    let mut fragment = instance(effect, &inputs, &constants, Counts::of(spec), &targets).ok()?;
    let port_unit = spec.about(signal).unit.clone();
    let balance_unit = match (targets.first(), port) {
        (Some(&(x, _)), _) => balance_unit(spec, x, &visited.time_unit),
        (None, Port::OutputAnd(y, _)) => spec.about(spec.outputs[y].variable).unit.clone(),
        _ => String::new(),
    };
    let value_unit = match port {
        Port::Value(p) | Port::Dependence(p, _) => spec.about(p).unit.clone(),
        _ => String::new(),
    };
    let unit = |symbol: &str| match symbol {
        "port" | "signal" => port_unit.clone(),
        "value" => value_unit.clone(),
        "time" => visited.time_unit.clone(),
        "balance" => balance_unit.clone(),
        "balance/port" => quotient(&balance_unit, &port_unit),
        other => other.to_string(),
    };
    let states = fragment.states.iter_mut().map(|state| &mut state.about);
    let flows = fragment.flows.iter_mut().map(|flow| &mut flow.about);
    let parameters = fragment.parameters.iter_mut();
    for about in states.chain(flows).chain(parameters.map(|p| &mut p.about)) {
        about.unit = unit(&about.unit);
    }
    let parameters = fragment.parameters.iter();
    let parameters = parameters.filter(|parameter| parameter.given != Given::Constant);
    let parameters = parameters.map(|parameter| {
        let about = &parameter.about;
        let known = effect
            .parameters
            .iter()
            .find(|(name, ..)| *name == about.name);
        let (role, starts) = known
            .map_or((Role::Size, Starts::Values(&[])), |(_, role, starts)| {
                (*role, *starts)
            });
        // Even the smallest delay of a direct feedthrough shifts the reading by one row. A reading is always read directly: its delay has a
        // grid of starts too.
        let jumps = effect.id == "delay" && spec.is_read_directly(signal);
        let role = if jumps { Role::Threshold } else { role };
        EffectParameter {
            name: String::new(),
            short: about.name.clone(),
            unit: about.unit.clone(),
            description: about.description.clone(),
            role,
            absent: parameter.value,
            bounds: (about.min, about.max),
            starts: values(starts, &span, visited, balance)
                .into_iter()
                .map(|start| start.clamp(about.min, about.max))
                .collect(),
        }
    });
    let mut candidate = Candidate {
        id,
        port,
        effect: Some(effect),
        parameters: parameters.collect(),
        record_numbers,
        repeats: None,
        fragment,
        stem: String::new(),
    };
    candidate.name_variables(spec);
    Some(candidate)
}

/// A signal has two ends if the smaller of its largest magnitudes on either side of zero is at least this share of the other.
const TWO_SIDED: f64 = 0.5;

fn is_two_sided(span: &Span) -> bool {
    let (below, above) = (-span.low, span.high);
    below.min(above) >= TWO_SIDED * below.max(above)
}

pub(super) fn values(starts: Starts, span: &Span, visited: &Visited, balance: f64) -> Vec<f64> {
    let (shares, of): (&[f64], Box<dyn Fn(f64) -> f64 + '_>) = match starts {
        Starts::Quantiles(all) => return span.thresholds(all),
        Starts::Magnitudes(all) => {
            let magnitudes = span.magnitudes();
            let mut places = vec![0.0, 0.5 * magnitudes.low];
            places.extend(magnitudes.thresholds(all));
            return places;
        }
        Starts::Values(all) => (all, Box::new(|share| share)),
        Starts::Sides if is_two_sided(span) => (&[1.0, -1.0, 0.0], Box::new(|side| side)),
        Starts::Sides => (&[1.0, -1.0], Box::new(|side| side)),
        Starts::Range(all) => (all, Box::new(|share| span.low + share * span.width())),
        Starts::Widths(all) => (all, Box::new(|share| share * span.width())),
        Starts::Times(all) => {
            let time = |share: f64| visited.begin + share * visited.duration;
            (all, Box::new(time))
        }
        Starts::Durations(all) => (all, Box::new(|share| share * visited.duration)),
        Starts::Intervals(all) => (all, Box::new(|share| share * visited.interval)),
        Starts::Balances(all) => (all, Box::new(move |share| share * balance)),
        Starts::BalancesPerWidth(all) => {
            (all, Box::new(move |share| share * balance / span.width()))
        }
    };
    shares.iter().map(|share| of(*share)).collect()
}
