//! Clients that hold connections without sending or reading: others are answered meanwhile.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use crate::server::{Page, Tab, bundled, serve};

/// The total number of connections that the page once accepted.
const MANY: usize = 64;

/// This number of connections that send a text and then do nothing.
fn silent(page: &Page, sent: &str) -> Vec<TcpStream> {
    let one = |_| {
        let mut stream = TcpStream::connect(page.address).unwrap();
        stream
            .set_write_timeout(Some(Duration::from_secs(1)))
            .unwrap();
        // The server may read only a part, or have closed the connection already.
        let _ = stream.write_all(sent.as_bytes());
        stream
    };
    (0..MANY).map(one).collect()
}

fn request(page: &Page, line: &str) -> String {
    format!("{line} HTTP/1.1\r\nHost: {}\r\n", page.address)
}

/// The attacks, by what each connection sends; the last ones know the secret.
fn attacks(page: &Page) -> Vec<(&'static str, String)> {
    let secret = &page.secret;
    let body = "Content-Type: application/json\r\nContent-Length: 1000\r\n\r\n";
    let head = |line: &str| request(page, line);
    let scripts = |path: &str| format!("{}\r\n", head(path)).repeat(200);
    vec![
        ("nothing", String::new()),
        ("half a head", head("GET /")),
        ("a POST without its body", head("POST /api/session") + body),
        ("requests and takes no answer", scripts("GET /plotly.js")),
        (
            "a POST without its body, with the secret",
            head(&format!("POST /{secret}/api/session")) + body,
        ),
        (
            "requests and takes no answer, with the secret",
            scripts(&format!("GET /{secret}/plotly.js")),
        ),
    ]
}

#[test]
fn connections_that_stand_still_keep_nobody_out() {
    let page = serve(&[]);
    let tab = Tab::open(&page);
    for (what, sent) in attacks(&page) {
        let held = silent(&page, &sent);
        let begun = Instant::now();
        assert_eq!(tab.get("/api/state").status, 200, "{what}");
        assert_eq!(tab.post("/api/cancel", b"{}").status, 200, "{what}");
        println!(
            "{MANY} connections that send {what}: two requests in {:?}",
            begun.elapsed()
        );
        // They were open until now.
        drop(held);
    }
}

#[test]
fn an_upload_that_stands_still_delays_no_other() {
    let page = serve(&[]);
    let tab = Tab::open(&page);
    let path = format!("/api/record?session={}&name=silent.csv", tab.session);
    let mut silent = TcpStream::connect(page.address).unwrap();
    let head = tab.head("POST", &path, 1 << 20) + "\r\nt,u,y\n";
    silent.write_all(head.as_bytes()).unwrap();
    silent.set_nonblocking(true).unwrap();
    let tour = std::fs::read(bundled("tour.csv")).unwrap();
    let begun = Instant::now();
    let sent = tab.post("/api/record?name=tour.csv", &tour);
    println!("beside a silent upload: {:?}", begun.elapsed());
    assert_eq!(sent.status, 200);
    // The transfer was in progress until now.
    let still = silent.read(&mut [0]).unwrap_err();
    assert_eq!(still.kind(), std::io::ErrorKind::WouldBlock);
}
