//! Comparison: the fitted believed model, and where it fails.

use std::time::Instant;

use greybox::{Fit, coloured};

use crate::{
    ControlLoop, Diagnosis, Error, NoiseSource, NotNoise, Options, Problem, Verdict,
    base::{
        believed::base,
        gaps::Mended,
        time_limit::{allow, effort},
    },
    diagnostics::{
        assemble::{assemble, floors},
        remarks::of_terms,
        residual_tests::not_noise,
        step,
    },
    fit::{
        criterion::{BIC_MARGIN, beyond_chance},
        node::{Node, STOPPING},
        noise_model::{NOISE_ORDER, is_slow},
        proposal::singles,
    },
    result::Floors,
};

/// Share of a diagnosis' time limit for a comparison, and the shares of this after which its phases end: further starts, single effects.
const SHARE: f64 = 0.2;
const FITTED: f64 = 0.6;
const TRIED: f64 = 0.8;

/// Fits the believed model and locates its errors: a diagnosis of one step without a search of sets.
///
/// # Errors
/// Where the records, the plant or the fit do not allow it.
pub fn compare(problem: &Problem, options: &Options) -> Result<Diagnosis, Error> {
    let begun = Instant::now();
    problem.check()?;
    let mut diagnosis = match Mended::of(problem, options)? {
        None => compare_whole(problem, options)?,
        Some(mended) => {
            let mut diagnosis = compare_whole(&mended.problem, options)?;
            mended.report(&mut diagnosis);
            diagnosis
        }
    };
    diagnosis.seconds = begun.elapsed().as_secs_f64();
    Ok(diagnosis)
}

/// Only one model is fitted, and no sets of effects are searched.
fn of_one_model<'a>(options: &Options<'a>) -> Options<'a> {
    Options {
        time_limit: options.time_limit.map(|limit| limit.mul_f64(SHARE)),
        ..*options
    }
}

/// The believed model for a comparison.
pub(crate) struct Believed<'a> {
    /// The displayed fit.
    pub shown: Node<'a>,
    /// The fit with the noise model of its residual.
    own: Fit,
    left: Option<NotNoise>,
    pub lacking: bool,
    floor: Floors,
    pub control_loop: Option<ControlLoop>,
}

/// Fits the believed model to records without gaps.
pub(crate) fn believed<'a>(
    problem: &'a Problem,
    options: &Options<'a>,
) -> Result<Believed<'a>, Error> {
    let options = &of_one_model(options);
    let (base, control_loop) = base(problem, options, FITTED)?;
    allow(&base, TRIED);
    let own = coloured(&base.setup, base.fit.clone(), NOISE_ORDER, STOPPING)?;
    // The model is incomplete if its residual is not noise, or if some effect lowers the error significantly: the first test needs no
    // catalogue, the second one detects small effects.
    let in_noise = Node {
        fit: own.clone(),
        ..base.clone()
    };
    let tempted = singles(&in_noise, &own.noise)
        .iter()
        .any(|single| single.gain_over(&in_noise) > BIC_MARGIN && beyond_chance(single, &in_noise));
    let left = not_noise(&base, &own)?;
    let lacking = tempted || left.is_some();
    let floor = floors(problem, &own.noise, NoiseSource::BelievedModel);
    // With a noise model that drifts, the simulation of the prewhitened fit may drift.
    let shown = if lacking || is_slow(&base, &own.noise) {
        base
    } else {
        Node {
            fit: own.clone().continuing(&base.fit),
            ..base
        }
    };
    let floor = if lacking {
        floor.of_what_is_new()
    } else {
        floor
    };
    Ok(Believed {
        shown,
        own,
        left,
        lacking,
        floor,
        control_loop,
    })
}

/// Comparison of records without gaps.
fn compare_whole(problem: &Problem, options: &Options) -> Result<Diagnosis, Error> {
    let Believed {
        shown,
        own,
        left,
        lacking,
        floor,
        control_loop,
    } = believed(problem, options)?;
    let verdict = if lacking {
        Verdict::Unexplained
    } else {
        Verdict::Adequate
    };
    let widen = ControlLoop::widens(control_loop.as_ref());
    let step = step::report(&shown, own.bic(), &floor.noise()?, &problem.test, widen)?;
    let mut diagnosis = assemble(problem, verdict, vec![step], floor);
    diagnosis.residual_unexplained = lacking;
    diagnosis.not_noise = left;
    diagnosis.remarks = of_terms(problem).into_iter().collect();
    diagnosis.control_loop = control_loop;
    diagnosis.effort = effort(&shown, &of_one_model(options));
    Ok(diagnosis)
}
