//! The mark for a diagnosis: a refit of the true structure and of every single effect by the Bayesian information criterion, the noise's
//! spectrum known.

use ct_signals::ArModel;
use ctid_tests::Rig;
use greybox::{Fit, Noise, Setup, Stopping, fit_from, random_starts};
use missing_effect::{Diagnosis, Problem};
use plants::{EffectInfo, ParameterInfo, Placed};
use serde_json::{Value, json};

const STOPPING: Stopping = Stopping {
    evaluations: 80,
    cost: 1e-8,
};

/// Result for a record.
#[derive(Debug, Clone)]
pub struct Mark {
    /// Fall of the criterion with the true structure, from its true values.
    pub truth: f64,
    /// The single effect with which the criterion falls most, and by how much.
    pub best: (&'static str, f64),
    /// Fall of the criterion with the effect that was named first.
    pub named: Option<f64>,
}

impl Mark {
    pub fn as_json(&self) -> Value {
        json!({ "truth": self.truth, "best": self.best.0, "best_falls": self.best.1, "named_falls": self.named })
    }
}

/// The noise's spectrum, of size one.
fn colour(rig: &Rig) -> Option<Noise> {
    let of_one = if rig.colour > 0.0 {
        ArModel::from_coefficients(&[rig.colour], 1.0).ok()?
    } else {
        ArModel::white(1.0)
    };
    Some(Noise::of(vec![of_one; rig.outputs()]))
}

/// The believed model, in its loop where that is known, and its fit.
fn believed<'a>(rig: &Rig, problem: &'a Problem, noise: &Noise) -> Option<(Setup<'a>, Fit)> {
    let white = Noise::white(rig.outputs());
    let records = &problem.records;
    let mut open = Setup::from_records(
        rig.plant,
        rig.known(),
        &[],
        records,
        std::collections::BTreeMap::new(),
    )
    .ok()?;
    let rough = fit_from(&open, &random_starts(&open, 12, 1), &white, STOPPING).ok()?;
    open.structure.scales = open.scales_at(&rough.x).ok()?;
    let open = open.with_structure(open.structure.clone()).ok()?;
    let (setup, x) = match &problem.controller {
        Some(controller) => open.in_loop(controller, &rough.x).ok()?,
        None => (open, rough.x),
    };
    let base = fit_from(&setup, &[x], noise, STOPPING).ok()?;
    Some((setup, base))
}

/// Difference of the criterion between both effects of a pair and the result of the diagnosis, each refitted with the known noise model:
/// the pair from its true values, the result from its estimates. `None` if a fit is not possible.
pub fn pair(rig: &Rig, problem: &Problem, found: &Diagnosis) -> Option<f64> {
    let noise = colour(rig)?;
    let (setup, base) = believed(rig, problem, &noise)?;
    let with_all = |all: &[Placed]| {
        let structure = all
            .iter()
            .try_fold(setup.structure.clone(), |structure, placed| {
                structure.with(*placed)
            });
        setup.with_structure(structure.ok()?).ok()
    };
    let from_base = |name: &String| {
        let at = setup.names().iter().position(|other| other == name);
        at.map_or(0.0, |at| base.x[at])
    };

    let missing = rig.missing();
    let effects = missing.iter().map(|(id, vessel, _)| {
        Some(Placed {
            effect: EffectInfo::find(id)?,
            vessel: *vessel,
        })
    });
    let truth = with_all(&effects.collect::<Option<Vec<_>>>()?)?;
    let mut near: Vec<f64> = truth.names().iter().map(from_base).collect();
    for ((_, _, values), placed) in missing.iter().zip(truth_order(&truth, &missing)) {
        for (parameter, value) in truth.structure.effect_parameters(placed).iter().zip(values) {
            let name = format!("{}.{}", placed.effect.id, parameter.name);
            let at = truth.names().iter().position(|other| *other == name)?;
            near[at] = *value;
        }
    }
    let mut own = near.clone();
    own[..rig.theta.len()].copy_from_slice(&rig.theta);
    let truth = fit_from(&truth, &[near, own], &noise, STOPPING).ok()?;

    let last = found.steps.last()?;
    let added = found.steps.iter().filter_map(|step| {
        let effect = EffectInfo::find(step.added.as_deref()?)?;
        effect
            .sites(rig.plant, &rig.known())
            .map(|vessel| Placed { effect, vessel })
            .find(|placed| placed.place_name(rig.plant, &rig.known()) == step.place.as_deref())
    });
    let answer = with_all(&added.collect::<Vec<_>>())?;
    let start = answer.names().iter().map(|name| {
        let known = last.parameters.iter().find(|own| own.name == *name);
        known.map_or_else(|| from_base(name), |own| own.value)
    });
    let answer = fit_from(&answer, &[start.collect()], &noise, STOPPING).ok()?;
    Some(answer.bic() - truth.bic())
}

/// The effects of a structure in the order of what is missing.
fn truth_order(setup: &Setup, missing: &[(&'static str, usize, Vec<f64>)]) -> Vec<Placed> {
    let of = |id: &str| {
        let effects = setup.structure.effects().iter();
        effects.copied().find(|placed| placed.effect.id == id)
    };
    missing.iter().filter_map(|(id, ..)| of(id)).collect()
}

/// The mark of a record with one effect; `None` where a fit is not possible.
pub fn mark(rig: &Rig, problem: &Problem, named: &[String]) -> Option<Mark> {
    let noise = colour(rig)?;
    let (setup, base) = believed(rig, problem, &noise)?;
    let missing = rig.missing();
    let (id, vessel, values) = missing.first()?;
    let own = Placed {
        effect: EffectInfo::find(id)?,
        vessel: *vessel,
    };
    let mut of_named: Option<f64> = None;
    let (mut truth, mut best) = (f64::NEG_INFINITY, ("", f64::NEG_INFINITY));
    for placed in setup.structure.candidates() {
        let Some(mut fit) = with(&setup, &base, placed, &noise, None) else {
            continue;
        };
        if placed == own
            && let Some(from_truth) = with(&setup, &base, placed, &noise, Some((rig, values)))
        {
            fit = fit.or_better(from_truth);
        }
        let fall = base.bic() - fit.bic();
        if placed == own {
            truth = fall;
        }
        if named.len() == 1 && named[0] == placed.effect.id {
            of_named = Some(of_named.map_or(fall, |other| other.max(fall)));
        }
        if fall > best.1 {
            best = (placed.effect.id, fall);
        }
    }
    Some(Mark {
        truth,
        best,
        named: of_named,
    })
}

/// The base and one effect, from every start of the effect, or from the truth.
fn with(
    base: &Setup,
    fit: &Fit,
    placed: Placed,
    noise: &Noise,
    truth: Option<(&Rig, &[f64])>,
) -> Option<Fit> {
    let setup = base
        .with_structure(base.structure.with(placed).ok()?)
        .ok()?;
    let name = |p: &ParameterInfo| format!("{}.{}", placed.effect.id, p.name);
    let parameters = setup.structure.effect_parameters(placed);
    let carried: Vec<f64> = setup
        .names()
        .iter()
        .map(|known| {
            let at = base.names().iter().position(|other| other == known);
            at.map_or(0.0, |at| fit.x[at])
        })
        .collect();
    let put = |x: &mut Vec<f64>, values: &[f64]| {
        for (parameter, value) in parameters.iter().zip(values) {
            if let Some(at) = setup.names().iter().position(|n| *n == name(parameter)) {
                x[at] = *value;
            }
        }
    };
    let starts: Vec<Vec<f64>> = if let Some((rig, values)) = truth {
        let mut x = carried;
        x[..rig.theta.len()].copy_from_slice(&rig.theta);
        put(&mut x, values);
        vec![x]
    } else {
        let mut grid: Vec<Vec<f64>> = vec![Vec::new()];
        for parameter in &parameters {
            grid = grid
                .iter()
                .flat_map(|begun| {
                    parameter.starts.iter().map(move |start| {
                        let mut longer = begun.clone();
                        longer.push(*start);
                        longer
                    })
                })
                .collect();
        }
        grid.iter()
            .map(|values| {
                let mut x = carried.clone();
                put(&mut x, values);
                x
            })
            .collect()
    };
    fit_from(&setup, &starts, noise, STOPPING).ok()
}
