use missing_effect::Remark;

use super::*;

/// Addresses that a browser would load: `src`, `href`, `url(` and the like that point outside the file.
fn loads(page: &str) -> Vec<&str> {
    [
        " src=",
        " href=",
        "url(",
        "@import",
        "import(",
        "fetch(",
        "XMLHttpRequest",
        "WebSocket",
    ]
    .into_iter()
    .flat_map(|way| page.match_indices(way).map(move |(at, _)| at))
    .filter_map(|at| page.get(at..(at + 24).min(page.len())))
    .filter(|text| !text.starts_with(" href=\"data:,\""))
    .collect()
}

#[test]
fn the_page_loads_nothing() {
    let page = html(&sample::two_tanks());
    assert!(!page.contains("http://") && !page.contains("https://"));
    assert_eq!(loads(&page), Vec::<&str>::new());
    assert!(page.contains("default-src 'none'") && page.contains("connect-src 'none'"));
}

#[test]
fn the_page_says_what_wrote_it_and_is_reproducible() {
    let mut diagnosis = sample::two_tanks();
    let page = html(&diagnosis);
    let (head, _) = page.split_once("</head>").expect("a head");
    assert!(head.contains("<meta name=\"generator\" content=\"ctid\">"));
    diagnosis.seconds = 99.0;
    assert!(page == html(&diagnosis), "the time it took must not show");
}

#[test]
fn every_step_and_every_record_is_there() {
    let diagnosis = sample::two_tanks();
    let page = html(&diagnosis);
    for (k, step) in diagnosis.steps.iter().enumerate() {
        assert!(page.contains(&format!("<button type=\"button\" data-step=\"{k}\"")));
        assert!(page.contains(&format!("<span class=\"label\">{}</span>", label(step))));
        let error = significant(step.rmse, 2);
        assert!(page.contains(&format!("<span class=\"number\">{error} <small>V</small>")));
    }
    for k in 0..diagnosis.records.len() {
        assert!(page.contains(&format!("id=\"plot-record-{k}\"")));
    }
    for score in &diagnosis.scores {
        assert!(page.contains(&text::code(&score.effect)));
    }
    for sentence in sentences::of_diagnosis(&diagnosis) {
        assert!(page.contains(&text::prose(&sentence)));
    }
    assert!(page.contains("do not distinguish it from <code>pump_<wbr>nonlinearity</code>"));
    assert!(page.contains("<td class=\"number\" data-step=\"2\">0.550 ± 0.027</td>"));
}

#[test]
fn an_effect_is_added_in_its_own_tank_alone() {
    let mut diagnosis = sample::two_tanks();
    // The upper tank overflows; sensor_saturation is replaced by an overflow of the lower one.
    diagnosis.scores[1].effect = "overflow".to_owned();
    diagnosis.scores[1].place = Some("lower".to_owned());
    let page = html(&diagnosis);
    let rows: Vec<&str> = page.matches("<tr class=\"added\">").collect();
    assert_eq!(rows.len(), 2);
    assert!(page.contains("<tr class=\"added\"><td class=\"number\">1</td>"));
    assert!(page.contains("<tr><td class=\"number\">2</td>"));
    let data: serde_json::Value =
        serde_json::from_str(&data::json(&diagnosis)).expect("valid JSON");
    let set = |name: &str| -> Vec<usize> {
        let flags = data[name].as_array().expect("a list").iter().enumerate();
        flags
            .filter(|(_, flag)| **flag == true)
            .map(|(k, _)| k)
            .collect()
    };
    assert_eq!((set("added"), set("equal")), (vec![0, 3], vec![4]));
    assert!(page.contains("<li><code>overflow</code> (upper): distinguished"));
}

#[test]
fn the_headline_counts_and_says_what_remains() {
    let mut diagnosis = sample::two_tanks();
    diagnosis.verdict = Verdict::Effect;
    let headline = |diagnosis: &Diagnosis, says: &str| {
        assert!(
            html(diagnosis).contains(&format!("<h1>{says}</h1>")),
            "{says}"
        );
    };
    headline(&diagnosis, "The missing effects are found");
    assert!(!html(&diagnosis).contains("uncertain: its size"));
    diagnosis.in_doubt[1] = true;
    diagnosis.residual_unexplained = true;
    headline(
        &diagnosis,
        "The missing effects are found; the residual is not noise",
    );
    assert!(
        html(&diagnosis).contains(
            "from <code>pump_<wbr>nonlinearity</code>; uncertain: its size is at a bound"
        )
    );
    diagnosis.effects.truncate(1);
    diagnosis.residual_unexplained = false;
    headline(&diagnosis, "The missing effect is found");
}

#[test]
fn a_partial_answer_shows_its_test_its_places_and_its_limit() {
    let page = html(&sample::partial());
    for part in [
        "<h1>Mostly overflow: 85 % of the squared error above the noise floor (86 % on held-out data); what remains: ",
        "<h3>Acceptance test of overflow</h3>",
        "<td class=\"number\">85 %</td><td>90 % where the residual is not noise; 50 % for a partial explanation</td>",
        "<td class=\"number\">86 %</td><td>not used for the verdict</td>",
        "<td class=\"number\">512</td><td>more than 6</td>",
        "<li>fitted to one half of the record, it does not predict the other half</li>",
        "where it acts, with relative likelihood: upper tank 1.00, lower tank 0.31: not determined</li>",
        "<h3>Two rankings</h3>",
        "<th scope=\"row\">Its offset</th>",
        "<p>Left out by the time limit of 40 s: swap steps between pairs of effects.</p>",
        "<p>For a longer search: <code>--effort thorough</code> (limit 10 min).</p>",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let whole = html(&sample::two_tanks());
    for part in ["Acceptance test", "Two rankings", "Its offset", "Left out"] {
        assert!(!whole.contains(part), "{part}");
    }
}

#[test]
fn the_last_model_stands_first_in_the_table() {
    let page = html(&sample::two_tanks());
    let (_, table) = page
        .split_once("<th scope=\"col\">Unit</th>")
        .expect("the table");
    let columns = |part: &str| -> Vec<usize> {
        let cells = part.split("data-step=\"").skip(1);
        cells
            .filter_map(|cell| cell.split('"').next()?.parse().ok())
            .collect()
    };
    for row in table.split("</tr>").take(6) {
        assert_eq!(columns(row), [2, 0, 1], "{row}");
    }
    assert!(table.contains("data-step=\"2\">last: + pump_deadzone</th>"));
}

#[test]
fn every_plot_has_a_place_and_every_place_a_plot() {
    let page = html(&sample::two_tanks());
    let mut places = 0;
    for (at, _) in page.match_indices("class=\"plot\" id=\"plot-") {
        let rest = &page[at + 22..];
        let id = &rest[..rest.find('"').expect("a quote")];
        let of_signal =
            id.starts_with("by-input-") && SCRIPT.contains("figures[`by-${kind}-${k}`]");
        let drawn = id.starts_with("record-")
            || of_signal
            || SCRIPT.contains(&format!("\"{id}\": "))
            || SCRIPT.contains(&format!("    {id},\n"))
            || SCRIPT.contains(&format!("    {id}: "));
        assert!(drawn, "nothing draws {id}");
        places += 1;
    }
    assert_eq!(places, 2 + 9);
}

#[test]
fn names_are_escaped_wherever_they_stand() {
    let hostile = "<script>alert('x')</script>&\"";
    let mut diagnosis = sample::two_outputs();
    diagnosis.plant = hostile.to_owned();
    diagnosis.output_unit = hostile.to_owned();
    diagnosis.input_unit = hostile.to_owned();
    diagnosis.remarks.push(Remark::Terms {
        names: vec![hostile.to_owned()],
    });
    diagnosis.known_effects.push(hostile.to_owned());
    diagnosis.effects[0] = hostile.to_owned();
    diagnosis.groups[0] = vec![hostile.to_owned(), format!("{hostile} too")];
    for record in &mut diagnosis.records {
        record.name = hostile.to_owned();
    }
    for step in &mut diagnosis.steps {
        step.added = Some(hostile.to_owned());
        step.place = Some(hostile.to_owned());
        step.parameters[0].name = hostile.to_owned();
        step.parameters[0].unit = hostile.to_owned();
    }
    let partial = sample::partial_of(sample::two_outputs());
    diagnosis.acceptance = partial.acceptance.map(|mut test| {
        test.effects[0] = hostile.to_owned();
        test
    });
    diagnosis.places = partial.places;
    diagnosis.places[0][1].place = hostile.to_owned();
    diagnosis.rankings = partial.rankings;
    diagnosis.rankings.white[0] = hostile.to_owned();
    diagnosis.effort.left_out.push(hostile.to_owned());
    diagnosis.scores[0].effect = hostile.to_owned();
    diagnosis.scores[0].place = Some(hostile.to_owned());
    if let Some(size) = &mut diagnosis.scores[0].size {
        size.unit = hostile.to_owned();
    }
    sample::rename_outputs(&mut diagnosis, &[hostile, "</select></script><b>"]);
    for output in diagnosis
        .steps
        .iter_mut()
        .flat_map(|step| &mut step.outputs)
    {
        output.held_out_error = partial.steps[0].outputs[0].held_out_error;
    }
    for verdict in [Verdict::Undecided, Verdict::Partial] {
        diagnosis.verdict = verdict;
        let page = html(&diagnosis);
        assert!(!page.contains("<script>alert"));
        assert!(!page.contains("</select></script>") && !page.contains("</script><b>"));
    }
}

#[test]
fn several_outputs_are_told_by_name_and_as_multiples_of_their_noise() {
    let diagnosis = sample::partial_of(sample::two_outputs());
    let page = html(&diagnosis);
    let (words, _) = page.split_once("id=\"data\"").expect("data");
    let step = &diagnosis.steps[1];
    let weighted = significant(step.weighted_rmse, 2);
    for (o, output) in step.outputs.iter().enumerate() {
        let error = significant(output.rmse, 2);
        let test = significant(output.rmse_test.expect("a held-out record"), 2);
        let line = format!(
            "<span class=\"test\">{}: {error} V, held out {test} V</span>",
            output.name
        );
        assert!(words.contains(&line), "{line}");
        let floor = format!(
            "<dd>{}: 0.080 V, from: the residual of the final model",
            output.name
        );
        assert!(words.contains(&floor), "{floor}");
        for row in [
            "Simulation error, fitted data (rms)",
            "Simulation error, held-out data (rms)",
            "Its offset",
        ] {
            let row = format!("<th scope=\"row\">{}: {row}</th>", output.name);
            assert!(words.contains(&row), "{row}");
        }
        let sentence = &sentences::of_failures(&diagnosis, output, o)[0];
        assert!(words.contains(&format!("<li>{}: {sentence}</li>", output.name)));
    }
    for part in [
        &format!("<span class=\"number\">{weighted} <small>times the noise</small>"),
        &format!("<b>{weighted} times the noise</b></button>"),
        "<select id=\"shown-output\" autocomplete=\"off\"><option value=\"0\">lower</option><option value=\"1\">upper</option></select>",
        "<th scope=\"row\">All outputs, held-out data</th><td>times the noise</td>",
        "<th scope=\"col\" class=\"number\">Simulation error [times the noise]</th>",
        "<td class=\"number\">0.080 V (lower), 0.080 V (upper)</td>",
        "1200 readings over",
    ] {
        assert!(words.contains(part), "{part}");
    }
    // A missing number must not be shown as a dash.
    assert!(!words.contains("<span class=\"number\">– "));
    let alone = html(&sample::two_tanks());
    for part in ["shown-output", "times the noise", "All outputs", "readings"] {
        let (words, _) = alone.split_once("id=\"data\"").expect("data");
        assert!(!words.contains(part), "{part}");
    }
}

#[test]
fn a_comparison_of_several_outputs_offers_the_output_alone() {
    let page = html(&sample::comparison_of(sample::two_outputs()));
    assert!(page.contains("<nav id=\"steps\"") && page.contains("id=\"shown-output\""));
    assert!(!page.contains("<button type=\"button\" data-step"));
    let (words, _) = page.split_once("id=\"data\"").expect("data");
    assert!(!words.contains("held out"));
}

#[test]
fn a_comparison_leaves_out_what_it_has_not() {
    let page = html(&sample::comparison());
    assert!(page.contains("<h1>Model against measurement</h1>"));
    for absent in [
        "id=\"steps\"",
        "plot-scores",
        "plot-trail",
        "<select",
        "held out",
    ] {
        let (words, _) = page.split_once("id=\"data\"").expect("data");
        assert!(!words.contains(absent), "{absent}");
    }
    assert!(page.contains("plot-record-0") && page.contains("The fitted parameters"));
}

#[test]
fn an_empty_diagnosis_is_still_a_page() {
    let mut diagnosis = sample::comparison();
    diagnosis.steps.clear();
    diagnosis.records.clear();
    diagnosis.noise[0].level = f64::NAN;
    let page = html(&diagnosis);
    assert!(page.ends_with("</html>\n"));
    assert!(!page.contains("class=\"plot\""));
    let (words, _) = page.split_once("id=\"data\"").expect("data");
    assert!(!words.contains("NaN"));
}

#[test]
fn tests_that_were_not_made_are_left_out() {
    let mut diagnosis = sample::comparison();
    let output = &mut diagnosis.steps[0].outputs[0];
    output.tests.autocorrelation.clear();
    output.tests.cross_correlation.clear();
    output.failures.by_frequency.clear();
    let page = html(&diagnosis);
    assert!(!page.contains("plot-autocorrelation"));
    assert!(!page.contains("plot-by-frequency"));
    assert!(page.contains("plot-by-output"));
}

#[test]
fn long_records_with_gaps_make_a_page_of_sensible_size() {
    let started = std::time::Instant::now();
    let page = html(&sample::awkward());
    assert!(
        page.len() < page::PLOTLY.len() * 4 / 3 + 4_000_000,
        "{} bytes",
        page.len()
    );
    assert!(started.elapsed().as_secs_f64() < 2.0);
    let (words, _) = page.split_once("id=\"data\"").expect("data");
    assert!(!words.contains("NaN") && !words.contains("inf "));
}

/// Writes the samples for inspection: `cargo test -p ctid write_the_samples -- --ignored`.
#[test]
#[ignore = "writes files to look at"]
fn write_the_samples() {
    for (name, diagnosis) in [
        ("ctid-report-sample.html", sample::two_tanks()),
        ("ctid-report-partial.html", sample::partial()),
        ("ctid-report-comparison.html", sample::comparison()),
        ("ctid-report-awkward.html", sample::awkward()),
        ("ctid-report-outputs.html", sample::two_outputs()),
    ] {
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, html(&diagnosis)).expect("a writable folder");
        println!("{}", path.display());
    }
}
