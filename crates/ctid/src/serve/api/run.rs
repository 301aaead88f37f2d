//! Computations: started, stopped, finished early.

use axum::Json;
use axum::extract::{Query, State};
use missing_effect::design::Limits;
use serde::Deserialize;
use std::num::NonZeroU8;
use std::sync::Arc;

use crate::effort::EffortLevel;
use crate::serve::app::App;
use crate::serve::jobs::{self, Task};
use crate::serve::own_design::AppliedInput;
use crate::serve::session::lock;
use crate::serve::state;
use crate::serve::tab::{Answer, Tab, aside, find, with};

#[derive(Debug, Deserialize)]
#[serde(tag = "what", rename_all = "lowercase")]
pub(super) enum Run {
    Compare,
    Chain {
        effects: Vec<(String, Option<String>)>,
    },
    Diagnose {
        max_effects: Option<NonZeroU8>,
        #[serde(default)]
        effort: EffortLevel,
    },
    Design {
        group: usize,
        between: [String; 2],
        range: Option<(f64, f64)>,
        slew: Option<f64>,
        duration: Option<f64>,
        /// For a user's own model: the permitted changes of each input.
        #[serde(default)]
        inputs: Vec<AppliedInput>,
    },
}

pub(super) async fn run(
    State(app): State<Arc<App>>,
    Query(tab): Query<Tab>,
    Json(run): Json<Run>,
) -> Answer {
    let session = find(&app, &tab.session)?;
    let task = match run {
        Run::Compare => Task::Compare,
        Run::Chain { effects } => Task::Chain(effects),
        Run::Diagnose {
            max_effects,
            effort,
        } => Task::Diagnose {
            max_effects,
            effort,
        },
        Run::Design {
            group,
            between,
            range,
            slew,
            duration,
            inputs,
        } => Task::Design {
            group,
            between,
            limits: Limits {
                range,
                slew,
                duration,
                ..Limits::default()
            },
            inputs,
        },
    };
    aside(move || {
        jobs::begin(&session, task)?;
        Ok(Json(state::state(&mut lock(&session))))
    })
    .await
}

pub(super) async fn cancel(State(app): State<Arc<App>>, Query(tab): Query<Tab>) -> Answer {
    with(&app, &tab.session, |session| {
        session.stop();
        Ok(())
    })
    .await
}

pub(super) async fn finish(State(app): State<Arc<App>>, Query(tab): Query<Tab>) -> Answer {
    with(&app, &tab.session, |session| {
        session.finish();
        Ok(())
    })
    .await
}
