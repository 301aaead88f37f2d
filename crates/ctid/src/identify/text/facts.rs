//! Facts about a fit by the methods with instruments and by those for a loop: a name and a sentence each.

use fcloe::{Condition, NoisePath, Verdict};
use linear_identification::{Identification, InLoop, LevelChoice, Refined};

use crate::numbers;

/// Facts about a fit by SRIVC or RIVC.
pub(crate) fn refined_facts(
    found: &Identification,
    refined: &Refined,
) -> Vec<(&'static str, String)> {
    let digits = |value| numbers::significant(value, 4);
    let unit = &found.shown.output.unit;
    let mut facts = Vec::new();
    let from = match refined.explained {
        Some(share) => format!(
            "from the reference, which explains {} % of the input's power",
            numbers::significant(100.0 * share, 3)
        ),
        None => "simulated from the input, open loop".to_owned(),
    };
    let end = match refined.converged {
        true => "converged",
        false => "not converged",
    };
    facts.push((
        refined.name,
        format!(
            "instruments {from}; {} iteration{}, {end}",
            refined.iterations,
            if refined.iterations == 1 { "" } else { "s" }
        ),
    ));
    if let [_, _, ..] = &refined.records[..] {
        facts.push(("records", refined.records.join(", ")));
    }
    if let [_, _, ..] = &refined.inputs[..] {
        let names = refined.inputs.iter().enumerate();
        let names = names.map(|(j, name)| match j {
            0 => format!("u is {name}"),
            j => format!("u_{} is {name}", j + 1),
        });
        facts.push(("inputs", names.collect::<Vec<_>>().join(", ")));
    }
    let known = |delay: &&f64| **delay > 0.0;
    let estimated = |p: &missing_effect::Parameter| p.name.starts_with("delay");
    if refined.delays.iter().any(|delay| known(&delay)) && !found.parameters.iter().any(estimated) {
        let delay = digits(refined.delays.iter().copied().fold(0.0, f64::max));
        facts.push(("delay", format!("{delay} s, as given")));
    }
    let noise = refined.noise.iter().map(|noise| {
        let deviation = digits(noise.deviation);
        let unit = match unit.is_empty() {
            true => String::new(),
            false => format!(" {unit}"),
        };
        match &noise.coefficients[..] {
            [] => format!("white, of standard deviation {deviation}{unit}"),
            coefficients => format!(
                "autoregressive, driven by a standard deviation of {deviation}{unit}, with {} on the samples before",
                coefficients
                    .iter()
                    .map(|c| numbers::significant(*c, 3))
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
        }
    });
    // SRIVC assumes white noise, whatever its residual is.
    let name = match refined.name.ends_with("SRIVC") {
        true => "residual",
        false => "noise model",
    };
    facts.push((name, noise.collect::<Vec<_>>().join("; ")));
    if refined.left_out.iter().any(|rows| *rows > 0) {
        let rows: Vec<String> = refined.left_out.iter().map(usize::to_string).collect();
        facts.push((
            "left out",
            format!(
                "rows at the beginning, whose delayed inputs are from before the record: {}",
                rows.join(", ")
            ),
        ));
    }
    facts
}

/// Facts about the loop and the fit.
pub(crate) fn facts(found: &Identification, in_loop: &InLoop) -> Vec<(&'static str, String)> {
    let (y, u) = (&found.shown.output.unit, &found.shown.input.unit);
    let digits = |value| numbers::significant(value, 4);
    let open = in_loop.r.is_empty();
    let polynomial = |coefficients: &[f64]| {
        let term = |(power, c): (usize, &f64)| match power {
            0 => digits(*c),
            1 => format!("{} s", digits(*c)),
            power => format!("{} s^{power}", digits(*c)),
        };
        let terms = coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0);
        terms.map(term).collect::<Vec<_>>().join(" + ")
    };
    let mut facts = vec![(
        "controller",
        match open {
            true => "none, open loop".to_owned(),
            false => format!("({})/({})", polynomial(&in_loop.r), polynomial(&in_loop.s)),
        },
    )];
    let [drive, output] = in_loop.levels.map(digits);
    let from = match in_loop.levels_from {
        LevelChoice::Estimated => "estimated",
        LevelChoice::Rest => "means of the first rows, before anything moves",
        LevelChoice::Mean => "means of the record",
        LevelChoice::Zero | LevelChoice::Auto => "as given",
    };
    let driven = if open {
        format!("u = {drive} {u}")
    } else {
        format!("r = {drive} {y}")
    };
    facts.push(("at rest", format!("{driven}, y = {output} {y} ({from})")));
    if let Some(mismatch) = &in_loop.mismatch {
        let [systematic, size] =
            [mismatch.systematic, mismatch.size].map(|v| numbers::significant(v, 2));
        facts.push((
            "measured command",
            format!("the controller misses {systematic} of {size} {u} root mean square"),
        ));
    }
    let theta: Vec<String> = in_loop.start.theta.iter().map(|v| digits(*v)).collect();
    let from = in_loop.start.from;
    let bandwidth = numbers::significant(in_loop.start.bandwidth, 3);
    let start = if found.trajectory.is_some() || in_loop.batch.is_some() {
        "start"
    } else {
        "regression"
    };
    facts.push((
        start,
        format!(
            "{from} with filters of {bandwidth} 1/s: {}",
            theta.join(", ")
        ),
    ));
    if let Some(batch) = &in_loop.batch {
        let end = if batch.stop.was_successful() {
            "at a minimum"
        } else {
            "before a minimum"
        };
        let noise = match batch.noise {
            _ if open => "",
            NoisePath::Loop => "; the controller feeds the noise back",
            NoisePath::Record => "; the noise is added to the output only",
        };
        facts.push((
            "fit",
            format!(
                "{} steps, ended {end}, the best of {} starts{noise}",
                batch.iterations, batch.starts
            ),
        ));
    }
    if let Some(memory) = in_loop.memory {
        let memory = numbers::duration(memory);
        let sentence = format!("{memory}; a drift is followed with as much delay");
        facts.push(("memory", sentence));
    }
    if let Some(health) = &in_loop.health {
        facts.push((
            "recursion",
            format!(
                "{} steps cut to the limit, {} shortened and {} refused to keep the loop stable; output error {} {y}",
                health.limited,
                health.shortened,
                health.refused,
                numbers::significant(health.residual_rms, 3)
            ),
        ));
    }
    if let Some(convergence) = &in_loop.convergence {
        facts.push(("condition (14)", condition(&convergence.condition)));
    }
    facts
}

/// The verdict of condition (14), in words.
pub(crate) fn condition(condition: &Condition) -> String {
    let verdict = match condition.verdict {
        Verdict::Holds => {
            "it holds if these estimates are the true plant: then a recursion that keeps the filter of this start converges"
        }
        Verdict::Positive => {
            "if these estimates are the true plant it fails, but the real part stays above 0: a recursion that keeps the filter of this start usually converges"
        }
        Verdict::Negative => {
            "if these estimates are the true plant it fails, and the real part falls below 0: a recursion that keeps the filter of this start may diverge; update the filter with the estimates"
        }
        Verdict::Unstable => "the loop of the estimates is not stable",
    };
    if condition.verdict == Verdict::Unstable {
        return verdict.to_owned();
    }
    let least = numbers::significant(condition.least, 3);
    let at = match condition.frequency {
        0.0 => "at low frequencies".to_owned(),
        f64::INFINITY => "at high frequencies".to_owned(),
        frequency => format!("at {} rad/s", numbers::significant(frequency, 3)),
    };
    format!("Re P^/P is least {at}, {least}, and has to be above 1/2; {verdict}")
}
