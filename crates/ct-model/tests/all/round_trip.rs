//! Random models are written and read back as the same models.

use ct_model::{
    About, Comparison, Condition, Expression, Flow, Function, Given, Input, ModelSpec, Operator,
    Output, Parameter, State, Variable,
};
use proptest::prelude::*;

/// Number of variables of each kind, and the flows that an expression may contain.
#[derive(Debug, Clone, Copy)]
struct Site {
    parameters: usize,
    inputs: usize,
    states: usize,
    flows: usize,
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        0.0..10.0,
        Just(0.0),
        Just(1e-300),
        Just(1e300),
        Just(0.1 + 0.2),
        Just(123_456_789_012.0)
    ]
}

fn variable(site: Site) -> BoxedStrategy<Expression> {
    let mut kinds = vec![(0..site.parameters).prop_map(Variable::Parameter).boxed()];
    if site.inputs > 0 {
        kinds.push((0..site.inputs).prop_map(Variable::Input).boxed());
    }
    if site.states > 0 {
        kinds.push((0..site.states).prop_map(Variable::State).boxed());
    }
    if site.flows > 0 {
        kinds.push((0..site.flows).prop_map(Variable::Flow).boxed());
    }
    proptest::strategy::Union::new(kinds)
        .prop_map(Expression::Variable)
        .boxed()
}

fn condition(inner: BoxedStrategy<Expression>) -> impl Strategy<Value = Condition> {
    let comparison = prop_oneof![
        Just(Comparison::Less),
        Just(Comparison::LessOrEqual),
        Just(Comparison::Greater),
        Just(Comparison::GreaterOrEqual),
        Just(Comparison::Equal),
        Just(Comparison::NotEqual),
    ];
    let compare = (comparison, inner.clone(), inner)
        .prop_map(|(c, a, b)| Condition::Compare(c, a.into(), b.into()));
    let leaf = prop_oneof![any::<bool>().prop_map(Condition::Constant), compare];
    leaf.prop_recursive(3, 8, 2, |inner| {
        prop_oneof![
            inner.clone().prop_map(|a| Condition::Not(a.into())),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| Condition::And(a.into(), b.into())),
            (inner.clone(), inner).prop_map(|(a, b)| Condition::Or(a.into(), b.into())),
        ]
    })
}

fn expression(site: Site, of_time: bool) -> BoxedStrategy<Expression> {
    let leaf = if of_time {
        prop_oneof![
            4 => variable(site),
            2 => number().prop_map(Expression::Number),
            1 => Just(Expression::Time)
        ]
        .boxed()
    } else {
        prop_oneof![variable(site), number().prop_map(Expression::Number)].boxed()
    };
    leaf.prop_recursive(5, 24, 3, move |inner| {
        let operator = prop_oneof![
            Just(Operator::Add),
            Just(Operator::Subtract),
            Just(Operator::Multiply),
            Just(Operator::Divide),
            Just(Operator::Power),
        ];
        let two = (operator, inner.clone(), inner.clone())
            .prop_map(|(o, a, b)| Expression::Binary(o, a.into(), b.into()));
        let function = (
            proptest::sample::select(Function::ALL.to_vec()),
            proptest::collection::vec(inner.clone(), 4),
        );
        let call = function.prop_map(|(function, mut arguments)| {
            arguments.truncate(function.arguments());
            Expression::Call(function, arguments)
        });
        let negative = inner.clone().prop_map(|a| Expression::Negative(a.into()));
        let choice = (
            condition(inner.clone().boxed()),
            inner.clone(),
            inner.clone(),
        )
            .prop_map(|(c, a, b)| Expression::If(c.into(), a.into(), b.into()));
        if of_time {
            let delay = (inner, number())
                .prop_map(|(a, by)| Expression::Delay(a.into(), Expression::Number(by).into()));
            prop_oneof![4 => two, 2 => call, 1 => negative, 1 => choice, 1 => delay].boxed()
        } else {
            prop_oneof![4 => two, 2 => call, 1 => negative, 1 => choice].boxed()
        }
    })
    .boxed()
}

fn about(name: String) -> impl Strategy<Value = About> {
    let unit = prop_oneof![Just(""), Just("W/K"), Just("degC"), Just("a \"b\" \\")];
    let text = prop_oneof![
        Just(String::new()),
        Just("what it is".to_string()),
        Just("it's \"µ\"\n\t\\".to_string())
    ];
    (unit, text, any::<(bool, bool)>()).prop_map(move |(unit, description, (low, high))| About {
        quantity: if low {
            String::new()
        } else {
            "Level".to_string()
        },
        name: name.clone(),
        unit: unit.to_string(),
        description,
        min: if low { -1e6 } else { f64::NEG_INFINITY },
        max: if high { 1e301 } else { f64::INFINITY },
    })
}

fn model() -> impl Strategy<Value = ModelSpec> {
    (0..3_usize, 0..=4_usize, 0..4_usize, 0..3_usize).prop_flat_map(
        |(inputs, states, flows, tied)| {
            let parameters = 3;
            let of_parameters = Site {
                parameters,
                inputs: 0,
                states: 0,
                flows: 0,
            };
            let all = Site {
                parameters,
                inputs,
                states,
                flows: tied + flows,
            };
            let given = prop_oneof![
                Just(Given::Fitted),
                Just(Given::Measured),
                Just(Given::Constant)
            ];
            let parameter = move |i: usize| {
                (about(format!("p{i}")), number(), given.clone()).prop_map(
                    move |(about, value, given)| {
                        Parameter {
                            about,
                            value,
                            definition: None,
                            // Parameters on which flows of parameters depend are fitted.
                            given: if i == 0 { Given::Fitted } else { given },
                        }
                    },
                )
            };
            let state = move |i: usize| {
                (
                    about(format!("x{i}")),
                    proptest::option::of(expression(all, true)),
                    expression(all, true),
                    expression(of_parameters, false),
                    any::<bool>(),
                )
                    .prop_map(|(about, coefficient, right, start, fixed)| State {
                        about,
                        coefficient,
                        right,
                        start,
                        fixed,
                    })
            };
            // Each flow contains the earlier ones.
            let flow = move |i: usize| {
                let of_parameters = i < tied;
                let value = if of_parameters {
                    expression(
                        Site {
                            parameters: 1,
                            ..of_parameters_site(parameters)
                        },
                        false,
                    )
                } else {
                    expression(Site { flows: i, ..all }, true)
                };
                (about(format!("q{i}")), value).prop_map(move |(about, value)| Flow {
                    about,
                    value: if of_parameters {
                        // The expression depends on a fitted parameter, whatever else it contains.
                        let own = Expression::Variable(Variable::Parameter(0));
                        Expression::Binary(Operator::Add, own.into(), value.into())
                    } else {
                        value
                    },
                    of_parameters,
                })
            };
            let last = about("y".to_string());
            (
                (0..parameters).map(parameter).collect::<Vec<_>>(),
                (0..inputs)
                    .map(|i| about(format!("u{i}")).prop_map(|about| Input { about }))
                    .collect::<Vec<_>>(),
                (0..states).map(state).collect::<Vec<_>>(),
                (0..tied + flows).map(flow).collect::<Vec<_>>(),
                last,
            )
                .prop_map(move |(parameters, inputs, states, mut flows, last)| {
                    // The output contains everything, so that nothing is unused.
                    let count = flows.len();
                    let all = (0..parameters.len())
                        .map(Variable::Parameter)
                        .chain((0..inputs.len()).map(Variable::Input));
                    let value = all.fold(Expression::Number(0.5), |sum, variable| {
                        let own = Expression::Variable(variable);
                        Expression::Binary(Operator::Add, sum.into(), own.into())
                    });
                    flows.push(Flow {
                        about: last,
                        value,
                        of_parameters: false,
                    });
                    let mut outputs: Vec<Output> = (0..states.len())
                        .step_by(2)
                        .map(|i| Output {
                            variable: Variable::State(i),
                        })
                        .collect();
                    outputs.push(Output {
                        variable: Variable::Flow(count),
                    });
                    ModelSpec {
                        name: "Random".to_string(),
                        description: String::new(),
                        parameters,
                        inputs,
                        states,
                        order: (0..flows.len()).collect(),
                        flows,
                        outputs,
                    }
                })
        },
    )
}

fn of_parameters_site(parameters: usize) -> Site {
    Site {
        parameters,
        inputs: 0,
        states: 0,
        flows: 0,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_model_that_is_written_reads_back_as_the_same(model in model()) {
        let text = model.to_string();
        let back = ModelSpec::parse(&text);
        let back = back.unwrap_or_else(|error| panic!("{error}\n{}\n{text}", error.excerpt()));
        prop_assert_eq!(&back, &model, "{}", text);
        prop_assert_eq!(back.to_string(), text);
    }
}
