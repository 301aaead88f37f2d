//! The page of `ctid identify`.

use super::figures::{self, Colour, Curve, Figure, Panel, Values};
use super::page::{self, NOTICES, Page, figure, large, section};
use super::tables::table;
use super::text::{code, escape, significant, unit, with_error};
use crate::identify::text::{self, condition, drift_verdict, model, time_constant_name};
use crate::numbers::duration;
use crate::sentences::of_identification;
use linear_identification::{Identification, OverLevel};

/// The page as a complete HTML file. The same result gives the same bytes.
pub fn html(found: &Identification) -> String {
    let body: String = [
        headline(found),
        "<main>".to_owned(),
        fit(),
        parameters(found),
        convergence(found),
        page::footer(
            "The simulation error is that of a model that runs on the input alone; it is not a prediction error. \
             Bands and standard errors are one standard deviation. ",
        ),
    ]
    .concat();
    let figures: Vec<Figure> = [fit_figure(found)]
        .into_iter()
        .chain(trajectory_figure(found))
        .chain(drift_figure(found))
        .chain(condition_figure(found))
        .collect();
    page::html(&Page {
        title: &format!("ctid: {}", escape(&found.record)),
        body: &body,
        data: &figures::json(&figures),
        script: figures::SCRIPT,
    })
}

fn headline(found: &Identification) -> String {
    let output = unit(&found.shown.output.unit);
    let warnings: String = of_identification(found)
        .iter()
        .map(|warning| format!("<p class=\"notice\">{}</p>\n", escape(warning)))
        .collect();
    let of = |name: &str| {
        let parameter = found.parameters.iter().find(|p| p.name == name);
        parameter.map_or("none: an integrator".to_owned(), |p| {
            format!("{} {}", with_error(p.value, p.std_error), unit(&p.unit))
        })
    };
    let time_constant = match found.order.n {
        1 => "Time constant",
        _ => "Sum of time constants",
    };
    let mut facts = vec![
        ("Model", escape(&model(found))),
        ("Gain", of("b0")),
        (time_constant, of("a1")),
        ("Method", code(found.method.id())),
        ("Dynamics", dynamics(found)),
    ];
    if let Some(settings) = &found.settings {
        let filters = format!("{} 1/s", significant(settings.bandwidth, 3));
        facts.push(("Memory", duration(settings.memory)));
        facts.push(("Filters", filters));
    }
    if let Some(in_loop) = &found.in_loop {
        let more = text::facts(found, in_loop).into_iter();
        facts.extend(more.map(|(name, sentence)| (name, escape(&sentence))));
    }
    if let Some(refined) = &found.refined {
        let more = text::refined_facts(found, refined).into_iter();
        facts.extend(more.map(|(name, sentence)| (name, escape(&sentence))));
    }
    let facts: String = facts
        .iter()
        .map(|(name, text)| format!("<div><dt>{}</dt><dd>{text}</dd></div>\n", capital(name)))
        .collect();
    let runs_on = match found.in_loop.as_ref().map(|in_loop| in_loop.r.is_empty()) {
        None => "The model runs on the input alone, from an initial state that is fitted.",
        Some(true) => "The model runs on the input alone, from rest.",
        Some(false) => "The model's loop runs on the reference alone, from rest.",
    };
    format!(
        "<header>\n<p class=\"kicker\">ctid report · {}</p>\n<h1>Linear model of order {}</h1>\n\
         <ol class=\"trail apart\">\n{}{}</ol>\n\
         <p class=\"caption\">{runs_on} Fit: 100 % less the error over the \
         output's standard deviation.</p>\n{warnings}<dl class=\"facts\">\n{facts}</dl>\n{NOTICES}</header>\n",
        escape(&found.record),
        found.order,
        large(
            &significant(found.simulation_rmse, 2),
            &output,
            "simulation error, root mean square",
            ""
        ),
        large(&significant(found.fit_percent, 3), "%", "fit", ""),
    )
}

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

fn dynamics(found: &Identification) -> String {
    let mut parts: Vec<String> = found
        .time_constants
        .iter()
        .map(|t| format!("time constant {} s", significant(*t, 3)))
        .collect();
    parts.extend(found.oscillations.iter().map(|pair| {
        format!(
            "period {} s, damping {}",
            significant(pair.period, 3),
            significant(pair.damping, 2)
        )
    }));
    parts.join("; ")
}

fn fit() -> String {
    section(
        "fit",
        "Measured against simulated",
        "Drag to zoom, double-click to see all again.",
        &figure("fit", "Output, residual, and input", ""),
    )
}

fn parameters(found: &Identification) -> String {
    let rows: String = found
        .parameters
        .iter()
        .map(|parameter| {
            format!(
                "<tr><th scope=\"row\">{}</th><td class=\"number\">{}</td><td>{}</td></tr>\n",
                code(&parameter.name),
                with_error(parameter.value, parameter.std_error),
                unit(&parameter.unit)
            )
        })
        .collect();
    let (title, caption) = match (&found.settings, &found.trajectory) {
        (Some(_), _) => (
            "At the end of the record",
            "Standard errors hold for white and coloured noise, and for a model that is right; those of the recursive estimate, from the data within its memory, \
             not of the whole record.",
        ),
        (None, Some(_)) => (
            "At the end of the record",
            "Standard errors are those of the recursive estimate, from the data within its memory, and assume a white residual.",
        ),
        (None, None) => (
            "Of the whole record",
            "Standard errors hold for white and coloured noise and for a model that is right: its error is uncorrelated with the input, and no unmeasured disturbance acts on the plant.",
        ),
    };
    let table = table(
        title,
        "<tr><th scope=\"col\">Parameter</th><th scope=\"col\" class=\"number\">Value ± standard error</th><th scope=\"col\">Unit</th></tr>",
        &rows,
        caption,
    );
    let over_time = match found.trajectory {
        Some(_) => figure(
            "trajectory",
            "Over the record",
            "Band: one standard error, once enough samples were used.",
        ),
        None => String::new(),
    };
    let over_level = match found.drift {
        Some(_) => figure(
            "drift",
            "Gain and time constant over the level",
            &format!(
                "Second half of the record, means over ranges of the level within the memory of the recursion. Band: one standard error. {}",
                drift_verdict(found)
            ),
        ),
        None => String::new(),
    };
    section(
        "parameters",
        "The parameters",
        "",
        &(table + &over_time + &over_level),
    )
}

fn fit_figure(found: &Identification) -> Figure {
    let shown = &found.shown;
    let residual: Vec<f64> = shown
        .output
        .values
        .iter()
        .zip(&shown.simulated)
        .map(|(y, model)| y - model)
        .collect();
    let output = &shown.output;
    let panels = Panel::of_fit(&output.unit, &shown.input.unit);
    let measured = Colour::Named("measured");
    let curves = vec![
        Curve::line("measured", 0, measured, (&shown.time, &output.values)).named(),
        Curve {
            width: 2.4,
            ..Curve::line(
                "simulated",
                0,
                Colour::Of(1),
                (&shown.time, &shown.simulated),
            )
        }
        .named(),
        Curve::line("residual", 1, Colour::Of(1), (&shown.time, &residual)),
        Curve::input(2, (&shown.time, &shown.input.values)),
    ];
    Figure::over_time("fit", 560, panels, curves)
}

fn trajectory_figure(found: &Identification) -> Option<Figure> {
    let trajectory = found.trajectory.as_ref()?;
    let mut panels = Vec::new();
    let mut curves = Vec::new();
    let series = trajectory.values.iter().zip(&trajectory.std_errors);
    for (parameter, (values, errors)) in found.parameters.iter().zip(series) {
        let data = (&trajectory.time[..], &values[..]);
        let curve = Curve::line(&parameter.name, panels.len(), Colour::Of(1), data);
        curves.push(curve.with_band(data, errors));
        panels.push(Panel::new(&parameter.name, &parameter.unit));
    }
    let height = 90 + 135 * u32::try_from(panels.len()).unwrap_or(1);
    Some(Figure::over_time("trajectory", height, panels, curves))
}

fn convergence(found: &Identification) -> String {
    let of_loop = found.in_loop.as_ref();
    let Some(convergence) = of_loop.and_then(|in_loop| in_loop.convergence.as_ref()) else {
        return String::new();
    };
    section(
        "convergence",
        "Would a recursion converge from this start?",
        &escape(&condition(&convergence.condition)),
        &figure(
            "condition",
            "P^/P − 1/2 over all frequencies",
            "P^ is the loop's polynomial with the start, P that with the estimates. Condition (14): the curve stays right of the shaded part.",
        ),
    )
}

fn condition_figure(found: &Identification) -> Option<Figure> {
    let convergence = found.in_loop.as_ref()?.convergence.as_ref()?;
    let locus = &convergence.locus;
    let real: Vec<f64> = locus.iter().map(|point| point.1).collect();
    let (low, high) = crate::plot::limits([&real[..]]);
    let room = 0.1 * (high.max(0.0) - low.min(0.0));
    let (low, high) = (low.min(0.0) - room, high.max(0.0) + room);
    let curve = Curve {
        x: real,
        y: Values::Numbers(locus.iter().map(|point| point.2).collect()),
        ..Curve::line("P^/P − 1/2", 0, Colour::Of(1), (&[], &[]))
    };
    Some(Figure {
        x_title: "real part",
        x_unit: String::new(),
        x_range: Some([low, high]),
        x_band: Some([low, 0.0]),
        ..Figure::over_time(
            "condition",
            380,
            vec![Panel {
                lines: vec![0.0],
                ..Panel::new("imaginary part", "")
            }],
            vec![curve],
        )
    })
}

fn drift_figure(found: &Identification) -> Option<Figure> {
    let drift = found.drift.as_ref()?;
    let gain_unit = found
        .parameters
        .get(found.order.n)
        .map_or("", |b0| &b0.unit);
    let curve = |panel, name, over_level: &OverLevel| {
        let data = (&drift.level[..], &over_level.values[..]);
        Curve::line(name, panel, Colour::Of(1), data).with_band(data, &over_level.std_errors)
    };
    let panels = vec![Panel::new("gain b0", gain_unit), Panel::new("a1", "s")];
    let curves = vec![
        curve(0, "gain b0", &drift.gain),
        curve(1, time_constant_name(found), &drift.time_constant),
    ];
    Some(Figure {
        x_title: "level that is remembered",
        x_unit: found.shown.output.unit.clone(),
        ..Figure::over_time("drift", 360, panels, curves)
    })
}
