//! Requests from other pages and other programs, and damaged files: they are rejected, nothing fails, and memory does not grow.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};

use serde_json::json;

use crate::browser::Browser;
use crate::server::{Answer, Page, Tab, alone, bundled, exchange, serve};

fn tour() -> Vec<u8> {
    std::fs::read(bundled("tour.csv")).unwrap()
}

#[test]
fn other_pages_are_refused() {
    let page = serve(&[]);
    let Page { address, secret } = &page;
    let tab = Tab::open(&page);
    let port = address.port();
    let ask = |method: &str, path: &str, headers: &str| {
        exchange(*address, format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n{headers}Content-Length: 0\r\n\r\n").as_bytes())
    };
    let host = format!("Host: {address}\r\n");
    let home = format!("/{secret}/");
    let state = format!("{home}api/state?session={}", tab.session);
    // As the page itself requests.
    let own = format!("{host}Origin: http://{address}\r\n");
    assert_eq!(ask("GET", &state, &own).status, 200);
    assert_eq!(
        ask("GET", &state, &format!("Host: localhost:{port}\r\n")).status,
        200
    );
    // A page of another site, of another port, of a file.
    for origin in [
        "https://example.org",
        &format!("http://127.0.0.1:{}", port.wrapping_add(1)),
        &format!("https://{address}"),
        "null",
    ] {
        for (method, path) in [
            ("GET", &state),
            ("GET", &home),
            ("POST", &format!("{home}api/session")),
        ] {
            let answer = ask(method, path, &format!("{host}Origin: {origin}\r\n"));
            assert_eq!(answer.status, 403, "{origin}: {answer:?}");
        }
    }
    // A name that was pointed at this machine.
    for name in [
        format!("example.org:{port}"),
        "127.0.0.1".to_string(),
        format!("127.0.0.1.example.org:{port}"),
        String::new(),
    ] {
        let answer = ask("GET", &home, &format!("Host: {name}\r\n"));
        assert!([400, 403].contains(&answer.status), "{name}: {answer:?}");
    }
    // The browser is told to load nothing from elsewhere, and to give nothing to others.
    let answer = ask("GET", &home, &host);
    assert_eq!(answer.status, 200);
    assert!(
        answer
            .head
            .contains("content-security-policy: default-src 'self'")
            && answer.head.contains("referrer-policy: no-referrer"),
        "{}",
        answer.head
    );
    assert!(
        !answer.head.contains("access-control-allow"),
        "{}",
        answer.head
    );
}

#[test]
fn it_listens_on_this_machine_alone() {
    let address = serve(&[]).address;
    assert!(address.ip().is_loopback());
    // An address of this machine that others can reach; nothing is sent.
    let socket = UdpSocket::bind("0.0.0.0:0").unwrap();
    let outside = socket
        .connect("192.0.2.1:9")
        .and_then(|()| socket.local_addr());
    let Some(ip) = outside
        .ok()
        .map(|address| address.ip())
        .filter(|ip| !ip.is_loopback())
    else {
        println!("skipped: this machine has no address that others see");
        return;
    };
    assert!(TcpStream::connect(SocketAddr::new(ip, address.port())).is_err());
}

/// Memory of this process, which is the server's too \[MB\].
fn resident() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<usize>().ok()? / 1024)
}

#[test]
fn a_file_of_200_megabytes_is_refused_early() {
    let page = serve(&[]);
    let tab = Tab::open(&page);
    let path = format!("/api/record?session={}&name=large.csv", tab.session);
    let refused = |answer: &Answer| {
        assert_eq!(answer.status, 413, "{answer:?}");
        assert!(
            answer.error().contains("64 MB") && answer.error().contains("ctid diagnose"),
            "{answer:?}"
        );
    };
    // With a declared length, before any of it is read.
    let head = tab.head("POST", &path, 200 << 20) + "\r\n";
    refused(&exchange(page.address, head.as_bytes()));
    // Without one, once it is too long.
    let before = resident();
    let mut stream = TcpStream::connect(page.address).unwrap();
    let head = tab
        .head("POST", &path, 0)
        .replace("Content-Length: 0", "Transfer-Encoding: chunked");
    stream.write_all((head + "\r\n").as_bytes()).unwrap();
    let chunk = [b"100000\r\n".as_slice(), &vec![b'1'; 1 << 20], b"\r\n"].concat();
    let sent = (0..200)
        .take_while(|_| stream.write_all(&chunk).is_ok())
        .count();
    assert!(sent < 200, "it takes all");
    let mut answer = String::new();
    let _ = stream.read_to_string(&mut answer);
    assert!(
        answer.is_empty() || answer.starts_with("HTTP/1.1 413"),
        "{answer}"
    );
    if let (Some(before), Some(after)) = (before, resident()) {
        println!("{before} MB before, {after} MB after");
        assert!(after < before + 250, "{before} MB before, {after} MB after");
    }
    assert_eq!(tab.state()["records"], json!([]));
}

#[test]
fn unfortunate_files_are_refused_with_the_mend() {
    let tab = Tab::open(&serve(&[]));
    let send = |name: &str, bytes: &[u8]| tab.post(&format!("/api/record?name={name}"), bytes);
    let names: Vec<String> = (0..2_000).map(|k| format!("column {k}")).collect();
    let row = vec!["1"; 2_000].join(",");
    let wide = names.join(",") + "\n" + &format!("{row}\n").repeat(20);
    let answer = send("wide.csv", wide.as_bytes());
    assert_eq!(answer.status, 422);
    assert!(
        answer.error().contains("2000 columns") && answer.error().contains("at most 500"),
        "{answer:?}"
    );
    let line = [b"t".as_slice(), &vec![b','; 2 << 20], b"a\n1\n"].concat();
    let answer = send("line.csv", &line);
    assert_eq!(answer.status, 422);
    assert!(answer.error().contains("a single line"), "{answer:?}");
    for (bytes, needle) in [
        (b"PK\x03\x04 a spreadsheet".as_slice(), "spreadsheet"),
        (&[0xff, 0xfe, 0, 0xd8, b't', 0], "binary data"),
        (b"", "empty"),
        (b"1,2,3\n4,5,6\n", "header"),
    ] {
        let answer = send("bad.csv", bytes);
        assert_eq!(answer.status, 422, "{answer:?}");
        assert!(
            answer.error().contains(needle) && answer.error().contains("bad.csv"),
            "{needle}: {answer:?}"
        );
    }
    // An error further down is reported for the record, which can be removed.
    let answer = send("rows.csv", b"t,u,y\n0,1,2\n1,2,x\n");
    assert_eq!(answer.status, 200);
    assert!(
        answer.json()["records"][0]["error"]
            .as_str()
            .unwrap()
            .contains("row 3"),
        "{answer:?}"
    );
    assert_eq!(
        tab.post("/api/forget", br#"{"name": "rows.csv"}"#).json()["records"],
        json!([])
    );
    // A record cannot be held out from itself.
    assert_eq!(send("one.csv", &tour()).status, 200);
    let twice = tab.post("/api/record?name=two.csv&held_out=true", &tour());
    assert!(twice.error().contains("have the same content"), "{twice:?}");
    // And invalid requests.
    for (path, body) in [
        ("/api/settings", "{"),
        ("/api/settings", r#"{"plant": 7}"#),
        ("/api/settings", r#"{"plant": "bath-tub"}"#),
        (
            "/api/settings",
            r#"{"plant": "single-tank", "known": {"area": -1}}"#,
        ),
        ("/api/text", r#"{"text": "plant = 'nothing'"}"#),
        ("/api/run", r#"{"what": "everything"}"#),
        ("/api/run", r#"{"what": "compare"}"#),
        (
            "/api/run",
            r#"{"what": "design", "group": 99, "between": ["a", "b"]}"#,
        ),
        ("/api/effect", r#"{"do": "add", "effect": "gravity"}"#),
        (
            "/api/effect",
            r#"{"do": "add", "effect": "overflow", "place": "../.."}"#,
        ),
    ] {
        let answer = tab.post(path, body.as_bytes());
        assert!(
            (400..500).contains(&answer.status),
            "{path} {body}: {answer:?}"
        );
    }
    let large = format!(r#"{{"text": "{}"}}"#, "#".repeat(2 << 20));
    assert_eq!(tab.post("/api/text", large.as_bytes()).status, 413);
}

#[test]
fn no_parameter_reaches_the_file_system() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("secret.txt"), "root:x:0:0").unwrap();
    let tab = Tab::open(&serve(&[]));
    let secret = folder.path().join("secret.txt").display().to_string();
    let encoded = |path: &str| path.replace('/', "%2F");
    for path in [
        "../../../../../../etc/passwd",
        "/etc/passwd",
        "..\\..\\etc\\passwd",
        "file:///etc/passwd",
        &secret,
        "%00",
        "..%252f..%252fetc%252fpasswd",
    ] {
        let encoded = encoded(path);
        for request in [
            format!("/{path}"),
            format!("/{encoded}"),
            format!("/api/{encoded}"),
            format!("/api/file?of={encoded}"),
            format!("/api/file?of=model&name={encoded}&path={encoded}"),
            format!("/api/model?id={encoded}"),
            format!("/api/state?since={encoded}"),
        ] {
            let answer = tab.get(&request);
            assert!(!answer.body.contains("root:"), "{request}: {answer:?}");
        }
        let other = Tab {
            session: encoded.clone(),
            ..tab.clone()
        };
        assert!(other.get("/api/state").status >= 400);
        // A record's name contains no folders.
        let answer = tab.post(&format!("/api/record?name={encoded}"), &tour());
        assert_eq!(answer.status, 200, "{path}: {answer:?}");
        let name = answer.json()["records"][0]["name"]
            .as_str()
            .unwrap()
            .to_string();
        assert!(!name.contains(['/', '\\', '\0']), "{name}");
        let forget = json!({ "name": name }).to_string();
        assert_eq!(
            tab.post("/api/forget", forget.as_bytes()).json()["records"],
            json!([])
        );
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn two_tabs_do_not_meet_and_the_oldest_of_many_goes() {
    let page = serve(&[]);
    let (first, second) = (Tab::open(&page), Tab::open(&page));
    assert_ne!(first.session, second.session);
    assert_eq!(first.post("/api/record?name=tour.csv", &tour()).status, 200);
    assert_eq!(first.state()["records"].as_array().unwrap().len(), 1);
    assert_eq!(second.state()["records"], json!([]));
    // The tab that is loaded again finds its work; one that is not known starts again.
    let body = json!({ "session": first.session }).to_string();
    assert_eq!(
        first.post("/api/session", body.as_bytes()).json()["session"],
        json!(first.session)
    );
    let tabs: Vec<Tab> = (0..8).map(|_| Tab::open(&page)).collect();
    for gone in [&first, &second] {
        let answer = gone.get("/api/state");
        assert_eq!(answer.status, 410, "{answer:?}");
        assert!(answer.error().contains("load the page again"));
    }
    assert_eq!(tabs[7].get("/api/state").status, 200);
}

/// Changes of two tabs to one file at once are both kept.
#[test]
fn no_change_of_two_tabs_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("m.toml");
    std::fs::write(&file, "plant = \"single-tank\"\n").unwrap();
    let page = serve(&["--model", &file.display().to_string()]);
    let effects = ["overflow", "pump_deadzone"];
    let tabs = effects.map(|effect| (effect, Tab::open(&page)));
    for _ in 0..30 {
        for way in ["add", "remove"] {
            std::thread::scope(|scope| {
                for (effect, tab) in &tabs {
                    let body = json!({ "do": way, "effect": effect }).to_string();
                    scope.spawn(move || {
                        assert_eq!(tab.post("/api/effect", body.as_bytes()).status, 200);
                    });
                }
            });
            let text = std::fs::read_to_string(&file).unwrap();
            for effect in effects {
                assert_eq!(text.contains(effect), way == "add", "{effect}: {text}");
            }
        }
    }
}

/// The content of the file is reported again once it exists again, also if it did not change.
#[test]
fn a_model_file_that_was_away_is_no_failure_for_ever() {
    let folder = tempfile::tempdir().unwrap();
    let (file, away) = (folder.path().join("m.toml"), folder.path().join("away"));
    std::fs::write(&file, "plant = \"single-tank\"\n").unwrap();
    let tab = Tab::open(&serve(&["--model", &file.display().to_string()]));
    assert!(tab.state()["failure"].is_null());
    std::fs::rename(&file, &away).unwrap();
    let failure = tab.state()["failure"].to_string();
    assert!(failure.contains("cannot be opened"), "{failure}");
    std::fs::rename(&away, &file).unwrap();
    assert!(tab.state()["failure"].is_null(), "{}", tab.state());
}

/// Names from files are displayed as text, whatever they contain.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn markup_in_names_is_text() {
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    let markup = "<img src=x onerror=document.title=1>";
    let text = String::from_utf8(tour()).unwrap();
    let (_, rows) = text.split_once('\n').unwrap();
    let file = browser.folder.path().join("<b>bold<b>&amp;.csv");
    std::fs::write(&file, format!("t <i>x</i> [s],u{markup} [<b>V</b>],\"y <script>document.title=2</script> [cm]\"\n{rows}")).unwrap();
    browser.drop_files("#drop-fitted", &[&file]);
    browser.until("document.querySelector('#records li')");
    assert!(browser.text("#records").contains("<b>bold<b>&amp;.csv"));
    browser.evaluate("document.querySelector('#columns').open = true");
    let chosen =
        browser.evaluate("document.getElementById('column-input').selectedOptions[0].text");
    assert_eq!(chosen, json!(format!("u{markup} [<b>V</b>]")));
    browser.choose("plant", "s", "value === 'single-tank'");
    browser.until("document.querySelectorAll('#trail .step').length === 1 && document.getElementById('plot-record-0')?.data?.length === 3");
    browser.click("#diagnose");
    browser.until("document.querySelector('#add-found-0')");
    browser.picture("markup");
    let made = "document.querySelectorAll('img, main script, main b b, main i').length + document.querySelectorAll('#records b').length";
    assert_eq!(browser.evaluate(made), json!(0));
    assert_eq!(browser.evaluate("document.title"), json!("ctid"));
    browser.assert_quiet(&address);
}
