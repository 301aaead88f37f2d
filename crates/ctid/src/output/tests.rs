use super::*;

fn refused(wanted: &[(Kind, &Path)], inputs: &[&Path]) -> String {
    plan(wanted, inputs).unwrap_err().to_string()
}

#[test]
fn only_what_ctid_wrote_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("out.json");
    let page = folder.path().join("out.html");
    let both = [(Kind::Json, json.as_path()), (Kind::Report, page.as_path())];
    assert_eq!(plan(&both, &[]).unwrap().len(), 2);

    fs::write(&json, "{\"written_by\": \"ctid\", \"schema\": 1}").unwrap();
    fs::write(&page, report::head()).unwrap();
    plan(&both, &[]).unwrap();

    let quoted = format!("<!-- as in {} -->", report::head());
    let shape = folder.path().join("shape.csv");
    for (path, kind, text) in [
        (&json, Kind::Json, "{\"verdict\": 1}"),
        (
            &json,
            Kind::Json,
            "{\"schema\": \"x\", \"method\": \"mine\"}",
        ),
        (&json, Kind::Json, "{\"schema\": 1, \"verdict\": \"mine\"}"),
        (
            &json,
            Kind::Json,
            "{\"written_by\": \"ctid\", \"schema\": \"x\"}",
        ),
        (&json, Kind::Json, "not json"),
        (&page, Kind::Report, "<html>my notes</html>"),
        (&page, Kind::Report, &quoted),
        (&shape, Kind::Unknown, "place,variable,at [cm],value [V]\n"),
    ] {
        fs::write(path, text).unwrap();
        let message = refused(&[(kind, path)], &[]);
        assert!(
            message.ends_with("choose another name or delete it"),
            "{message}"
        );
        assert!(
            message.starts_with(&path.display().to_string()),
            "{message}"
        );
        assert_eq!(fs::read_to_string(path).unwrap(), text);
    }
}

/// A result to write.
#[derive(Serialize)]
struct Number {
    schema: u32,
}

impl Found for Number {}

const NUMBER: Number = Number { schema: 1 };

#[test]
fn what_comes_while_the_command_runs_is_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("out.json");
    let planned = || plan(&[(Kind::Json, &json)], &[]).unwrap().remove(0);
    let mine = "{\"mine\": 1}";
    for before in ["", "ours"] {
        match before {
            "" => drop(fs::remove_file(&json)),
            _ => assert!(planned().write(&NUMBER).unwrap()),
        }
        let output = planned();
        fs::write(&json, mine).unwrap();
        let refused = output.write(&NUMBER).unwrap_err().to_string();
        assert!(refused.contains("while this command ran"), "{refused}");
        assert_eq!(fs::read_to_string(&json).unwrap(), mine);
        fs::remove_file(&json).unwrap();
    }
    // A file of this program may be overwritten repeatedly.
    for _ in 0..3 {
        assert!(planned().write(&NUMBER).unwrap());
    }
    let text = fs::read_to_string(&json).unwrap();
    assert!(text.starts_with("{\n  \"written_by\": \"ctid\",\n  \"schema\": 1"));
}

#[cfg(unix)]
#[test]
fn a_link_that_leads_nowhere_is_no_place_for_a_result() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("out.json");
    std::os::unix::fs::symlink(folder.path().join("gone"), &link).unwrap();
    let message = refused(&[(Kind::Json, &link)], &[]);
    assert!(
        message.contains("a link to a file that is not there"),
        "{message}"
    );
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
}

#[test]
fn an_input_is_never_an_output() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data.csv");
    fs::write(&data, "").unwrap();
    let other_way = folder.path().join(".").join("data.csv");
    let message = refused(&[(Kind::Json, &other_way)], &[&data]);
    assert!(message.contains("one of the inputs"), "{message}");
    let message = refused(
        &[
            (Kind::Json, Path::new("a")),
            (Kind::Report, Path::new("./a")),
        ],
        &[],
    );
    assert!(message.contains("cannot share"), "{message}");
}

#[test]
fn a_place_that_takes_no_file_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let message = refused(&[(Kind::Json, &folder.path().join("no/out.json"))], &[]);
    assert!(message.contains("there is no folder"), "{message}");
    let message = refused(&[(Kind::Json, folder.path())], &[]);
    assert!(message.contains("it is a folder"), "{message}");
}

#[test]
fn a_report_takes_the_next_free_name() {
    let folder = tempfile::tempdir().unwrap();
    let name = || {
        let output = free_report(folder.path(), "a.csv").unwrap();
        output.path().file_name().unwrap().to_owned()
    };
    let page = |record: &str| format!("{}{{\"name\":\"{record}\"}}", report::head());
    assert_eq!(name(), "report.html");
    fs::write(folder.path().join("report.html"), "mine, on \"a.csv\"").unwrap();
    assert_eq!(name(), "report-2.html");
    fs::write(folder.path().join("report-2.html"), page("data.csv")).unwrap();
    assert_eq!(name(), "report-3.html");
    fs::write(folder.path().join("report-3.html"), page("a.csv")).unwrap();
    assert_eq!(name(), "report-3.html");
}
