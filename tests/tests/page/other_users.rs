//! Other users of the machine can connect to the page's port, but do not know the secret that stands in its address.

use std::net::SocketAddr;
use std::path::Path;

use serde_json::json;

use crate::server::{Page, Tab, bundled, exchange, serve};

/// A model file and a record that nobody but their owner may read.
struct Owned {
    folder: tempfile::TempDir,
    page: Page,
}

const MODEL: &str = "plant = \"single-tank\" # confidential\n";

fn owned() -> Owned {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.toml");
    let data = folder.path().join("confidential.csv");
    std::fs::write(&model, MODEL).unwrap();
    std::fs::copy(bundled("tour.csv"), &data).unwrap();
    only_for_the_owner(&model);
    only_for_the_owner(&data);
    let words = [&data, &model].map(|path| path.display().to_string());
    let page = serve(&[&words[0], "--model", &words[1]]);
    Owned { folder, page }
}

#[cfg(unix)]
fn only_for_the_owner(path: &Path) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).unwrap();
}

#[cfg(not(unix))]
fn only_for_the_owner(_: &Path) {}

/// All requests of the page, as written by somebody who knows the program and the session, but not the access key.
fn requests(address: SocketAddr, session: &str) -> Vec<String> {
    let get = [
        "/".to_string(),
        "/app.js".to_string(),
        "/plotly.js".to_string(),
        format!("/api/state?session={session}"),
        format!("/api/data?session={session}"),
        format!("/api/file?session={session}&of=model"),
        format!("/{}/", "0".repeat(32)),
        format!("/{}/api/state?session={session}", "0".repeat(32)),
    ];
    let post = [
        ("session", json!({ "session": null })),
        ("session", json!({ "session": session })),
        (
            "text",
            json!({ "text": "plant = \"first-order\"", "from": MODEL }),
        ),
        ("effect", json!({ "do": "add", "effect": "overflow" })),
        ("forget", json!({ "name": "confidential.csv" })),
        ("run", json!({ "what": "compare" })),
    ];
    let head = format!("HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n");
    let get = get.map(|path| format!("GET {path} {head}\r\n"));
    let post = post.map(|(what, body)| {
        let body = body.to_string();
        format!(
            "POST /api/{what}?session={session} {head}Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        )
    });
    get.into_iter().chain(post).collect()
}

fn assert_refused(answer: &str, asked: &str) {
    assert!(answer.starts_with("HTTP/1.1 403"), "{asked}: {answer}");
    assert!(!answer.contains("confidential"), "{asked}: {answer}");
}

fn assert_untouched(owned: &Owned, tab: &Tab) {
    let text = std::fs::read_to_string(owned.folder.path().join("m.toml")).unwrap();
    assert_eq!(text, MODEL);
    // The owner's tab is still there, with its record.
    let state = tab.state();
    assert_eq!(state["records"][0]["name"], json!("confidential.csv"));
}

#[test]
fn without_the_secret_nothing_is_answered() {
    let owned = owned();
    let tab = Tab::open(&owned.page);
    for _ in 0..8 {
        for request in requests(owned.page.address, &tab.session) {
            let answer = exchange(owned.page.address, request.as_bytes());
            assert_refused(
                &format!("HTTP/1.1 {} {}", answer.status, answer.body),
                &request,
            );
            assert!(!answer.head.contains(&owned.page.secret));
            assert!(!answer.body.contains(&owned.page.secret));
        }
    }
    assert_untouched(&owned, &tab);
}

/// A real second user, with all that he can see of this process.
#[cfg(target_os = "linux")]
#[test]
fn another_user_reads_and_writes_nothing_through_the_page() {
    use std::os::unix::fs::MetadataExt;
    use std::os::unix::process::CommandExt;
    use std::process::Command;

    /// The user `nobody` on most systems; the number need not have a name.
    const OTHER: u32 = 65_534;
    /// Prints what another user can read of the server's process, and then the answer to each request.
    const ASK: &str = "id -u; cat /proc/$2/cmdline /proc/$2/environ \"$3\" 2>/dev/null; port=$1; shift 3
        for request in \"$@\"; do exec 3<>/dev/tcp/127.0.0.1/$port; printf '%s' \"$request\" >&3; printf '\\n<answer>'; cat <&3; exec 3>&-; done";

    if std::fs::metadata("/proc/self").unwrap().uid() != 0 {
        println!("skipped: only root can become another user");
        return;
    }
    let owned = owned();
    let tab = Tab::open(&owned.page);
    let requests = requests(owned.page.address, &tab.session);
    let asked = Command::new("bash")
        .arg("-c")
        .arg(ASK)
        .arg("ask")
        .arg(owned.page.address.port().to_string())
        .arg(std::process::id().to_string())
        .arg(owned.folder.path().join("m.toml"))
        .args(&requests)
        .uid(OTHER)
        .gid(OTHER)
        .output();
    let asked = match asked {
        Ok(asked) => String::from_utf8_lossy(&asked.stdout).into_owned(),
        Err(error) => {
            println!("skipped: bash cannot be started as another user: {error}");
            return;
        }
    };
    assert!(asked.starts_with("65534\n"), "{asked}");
    assert!(!asked.contains(&owned.page.secret), "{asked}");
    let answers: Vec<&str> = asked.split("<answer>").skip(1).collect();
    assert_eq!(answers.len(), requests.len(), "{asked}");
    for (answer, request) in answers.iter().zip(&requests) {
        assert_refused(answer, request);
    }
    assert_untouched(&owned, &tab);
}
