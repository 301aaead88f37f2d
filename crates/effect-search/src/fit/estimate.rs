//! Estimates with their standard errors.

use ct_model::Given;
use ct_model::effects::Candidate;
use serde::{Deserialize, Serialize};

use crate::fit::node::Node;

/// A fitted parameter or initial state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Its name.
    pub name: String,
    /// Value \[unit\].
    pub value: f64,
    /// Standard error; `None` if the value is known, at a bound or not determined.
    pub std_error: Option<f64>,
    /// Unit as in the text.
    pub unit: String,
    /// The value is not fitted.
    pub known: bool,
    /// The effect of the parameter; `None` for the believed model's own parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effect: Option<String>,
}

/// Estimates of an effect's parameters in a set.
pub(crate) fn sizes(node: &Node, candidate: &Candidate) -> Vec<Estimate> {
    let errors = node.fit.std_errors();
    let parameters = node.spec().parameters.iter().enumerate();
    let own =
        parameters.filter(|(_, p)| candidate.parameters.iter().any(|o| o.name == p.about.name));
    own.map(|(i, parameter)| Estimate {
        effect: Some(candidate.id.clone()),
        name: parameter.about.name.clone(),
        value: node.fit.x[i],
        std_error: errors[i],
        unit: parameter.about.unit.clone(),
        known: parameter.given != Given::Fitted,
    })
    .collect()
}
