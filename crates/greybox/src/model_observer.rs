//! Start values from observer fits: the readings correct the measured states.
//!
//! The simulation error of a model that oscillates, or that a loop drives, has many local minima: a slightly wrong frequency is out of
//! phase after a few periods. Where each state that is read follows its reading at a rate, errors do not add up, and the criterion is
//! nearly that of equation errors: it has few minima, and its bias does not matter for a start. The rate is lowered in steps, until the
//! model runs freely.
//!
//! **Reference**: L. Ljung, System Identification, 2nd ed. (1999), sections 4.3 (predictors with an observer) and 10.5 (initial values);
//! H. G. Bock, in: Modelling of Chemical Reaction Systems, Springer (1981), 102-125 (shooting that is tied to the readings).

use ct_model::{About, Expression, Input, Model, ModelSpec, Operator, Output, Variable};
use ct_signals::{Channel, Hold, Record};
use estimation::{Noise, Residuals, Stopping, fit_from, within};

use crate::ModelSetup;

/// Gains with which states follow their readings, one after the other, per interval between rows.
const RATES: [f64; 3] = [0.5, 0.1, 0.02];
/// Stopping criteria of the fit with a gain: its result is only a start.
const STOPPING: Stopping = Stopping {
    evaluations: 30,
    cost: 1e-4,
};

fn product(a: Expression, b: Expression) -> Expression {
    Expression::Binary(Operator::Multiply, Box::new(a), Box::new(b))
}

/// Outputs that equal a state, each with its state.
fn shown(spec: &ModelSpec) -> Vec<(usize, usize)> {
    let outputs = spec.outputs.iter().enumerate();
    let state = |(o, output): (usize, &Output)| {
        let read = Expression::Variable(output.variable);
        match spec.behind(&read) {
            Expression::Variable(Variable::State(i)) => Some((o, *i)),
            _ => None,
        }
    };
    outputs.filter_map(state).collect()
}

/// The model in which these states follow the readings of their outputs, which are additional inputs in this order.
fn observed(spec: &ModelSpec, shown: &[(usize, usize)], rate: f64) -> ModelSpec {
    let mut observed = spec.clone();
    for &(o, i) in shown {
        let mut name = format!("{}_reading", spec.about(spec.outputs[o].variable).name);
        while observed.find(&name).is_some() {
            name.push('_');
        }
        let reading = Expression::Variable(Variable::Input(observed.inputs.len()));
        observed.inputs.push(Input {
            about: About {
                name,
                ..About::default()
            },
        });
        let state = &mut observed.states[i];
        let apart = Expression::Binary(
            Operator::Subtract,
            Box::new(reading),
            Box::new(Expression::Variable(Variable::State(i))),
        );
        let mut pull = product(Expression::Number(rate), apart);
        if let Some(coefficient) = &state.coefficient {
            pull = product(coefficient.clone(), pull);
        }
        state.right =
            Expression::Binary(Operator::Add, Box::new(state.right.clone()), Box::new(pull));
    }
    observed
}

impl ModelSetup<'_> {
    /// Result of observer fits with decreasing gain from a start; `None` if no output depends on a state.
    pub(crate) fn observed_from(&self, start: &[f64]) -> Option<Vec<f64>> {
        let rows: usize = self.records().iter().map(|record| record.len() - 1).sum();
        let duration: f64 = self.records().iter().map(Record::duration).sum();
        let interval = duration / rows.max(1) as f64 / self.time_unit();
        let shown = shown(self.model().spec());
        if interval <= 0.0 || shown.is_empty() {
            return None;
        }
        let with_readings = |record: &Record| {
            let mut record = record.clone();
            for &(o, _) in &shown {
                let output = &record.outputs[o];
                let reading = Channel::new(output.name.clone(), "", output.interpolated());
                record.inputs.push(reading.with_hold(Hold::First));
            }
            record
        };
        let records: Vec<Record> = self.records().iter().map(with_readings).collect();
        let (known, white) = (self.known(), Noise::white(self.outputs()));
        let mut x = start.to_vec();
        for rate in RATES {
            let model = Model::new(observed(self.model().spec(), &shown, rate / interval));
            let setup = ModelSetup::new(&model, &records, &known, self.time_unit()).ok()?;
            let setup = setup.limited_as(self);
            if setup.out_of_time() {
                break;
            }
            if let Ok(fit) = fit_from(&setup, vec![x.clone().into()], &white, STOPPING) {
                x = fit.x;
            }
        }
        for (i, value) in x.iter_mut().enumerate() {
            *value = within(*value, self.bound(i));
        }
        Some(x)
    }
}
