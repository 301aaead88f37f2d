//! Headless Chromium through its DevTools protocol: real mouse and keyboard events, and everything that it asks for or complains of.

use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;
use tungstenite::{Message, WebSocket};

/// Far longer than anything here takes on a machine that is not busy.
const PATIENCE: Duration = Duration::from_secs(240);

/// One page in a separate browser.
pub struct Browser {
    chromium: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    number: u64,
    heard: Vec<Value>,
    pub folder: TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.chromium.kill();
        let _ = self.chromium.wait();
    }
}

impl Browser {
    /// A browser that shows a page.
    pub fn open(address: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let profile = folder.path().join("profile");
        let started = Command::new("chromium")
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--no-first-run",
                "--disable-dev-shm-usage",
            ])
            .args([
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
                "--disable-quic",
            ])
            .args(["--remote-debugging-port=0", "about:blank"])
            .arg(format!("--user-data-dir={}", profile.display()))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        // If it is not installed, the tests that need it are ignored.
        let chromium = started.unwrap();
        let (port, path) = debugger(&profile);
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let url = format!("ws://127.0.0.1:{port}{path}");
        let (socket, _) = tungstenite::client(url, stream).unwrap();
        let mut browser = Self {
            chromium,
            socket,
            session: String::new(),
            number: 0,
            heard: Vec::new(),
            folder,
        };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attached = browser.call(
            "Target.attachToTarget",
            json!({ "targetId": target["targetId"], "flatten": true }),
        );
        browser.session = attached["sessionId"].as_str().unwrap().to_string();
        for domain in ["Page", "Runtime", "Log", "Network", "DOM"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser.look(1440, 900, "light");
        browser.call("Page.navigate", json!({ "url": address }));
        browser
            .until("document.readyState === 'complete' && document.querySelector('#plant option')");
        browser
    }

    /// Width and height of the window, and the colour scheme.
    pub fn look(&mut self, width: u32, height: u32, scheme: &str) {
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", features);
    }

    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.number += 1;
        let mut message = json!({ "id": self.number, "method": method, "params": parameters });
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.socket
            .send(Message::text(message.to_string()))
            .unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else {
                continue;
            };
            let mut answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] != json!(self.number) {
                self.heard.push(answer);
                continue;
            }
            assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
            return answer["result"].take();
        }
    }

    pub fn evaluate(&mut self, expression: &str) -> Value {
        let asked =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let mut answer = self.call("Runtime.evaluate", asked);
        assert!(
            answer["exceptionDetails"].is_null(),
            "{expression}: {answer}"
        );
        answer["result"]["value"].take()
    }

    pub fn text(&mut self, selector: &str) -> String {
        let text = self.evaluate(&format!(
            "document.querySelector({})?.innerText ?? ''",
            json!(selector)
        ));
        text.as_str().unwrap().to_string()
    }

    /// Waits until an expression is true.
    pub fn until(&mut self, expression: &str) {
        let begun = Instant::now();
        while self.evaluate(&format!("Boolean({expression})")) != json!(true) {
            if begun.elapsed() > PATIENCE {
                let page = self.text("body");
                panic!("never: {expression}\n{page}");
            }
            sleep(Duration::from_millis(50));
        }
    }

    /// Position of an element, once it is constant and not covered.
    fn place(&mut self, selector: &str) -> (f64, f64) {
        let look = format!(
            "(() => {{ const e = document.querySelector({selector}); if (!e || e.disabled) return null;
               e.scrollIntoView({{ block: 'center', behavior: 'instant' }});
               const b = e.getBoundingClientRect(); const at = [b.x + b.width / 2, b.y + b.height / 2];
               const hit = document.elementFromPoint(...at);
               return hit && (e === hit || e.contains(hit)) ? at : null; }})()",
            selector = json!(selector)
        );
        let begun = Instant::now();
        let mut before = Value::Null;
        loop {
            let at = self.evaluate(&look);
            if !at.is_null() && at == before {
                return (at[0].as_f64().unwrap(), at[1].as_f64().unwrap());
            }
            before = at;
            assert!(
                begun.elapsed() < PATIENCE,
                "{selector} is not there, or something covers it"
            );
            sleep(Duration::from_millis(60));
        }
    }

    pub fn click(&mut self, selector: &str) {
        let (x, y) = self.place(selector);
        for (kind, buttons) in [("mouseMoved", 0), ("mousePressed", 1), ("mouseReleased", 0)] {
            let button = if kind == "mouseMoved" { "none" } else { "left" };
            let event = json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", event);
        }
    }

    /// Drops files onto an element as a mouse does.
    pub fn drop_files(&mut self, selector: &str, files: &[&Path]) {
        let (x, y) = self.place(selector);
        let files: Vec<String> = files
            .iter()
            .map(|file| file.display().to_string())
            .collect();
        let data = json!({ "items": [], "files": files, "dragOperationsMask": 1 });
        for kind in ["dragEnter", "dragOver", "drop"] {
            self.call(
                "Input.dispatchDragEvent",
                json!({ "type": kind, "x": x, "y": y, "data": data }),
            );
        }
    }

    /// Types into the element that has the focus.
    pub fn type_text(&mut self, text: &str) {
        for letter in text.chars() {
            let event =
                json!({ "type": "keyDown", "text": letter.to_string(), "key": letter.to_string() });
            self.call("Input.dispatchKeyEvent", event);
            self.call(
                "Input.dispatchKeyEvent",
                json!({ "type": "keyUp", "key": letter.to_string() }),
            );
        }
    }

    /// Chooses from a list by keyboard: to the first entry with this letter, then down until it is the one.
    pub fn choose(&mut self, list: &str, letter: &str, wanted: &str) {
        self.evaluate(&format!("document.getElementById('{list}').focus()"));
        self.type_text(letter);
        for _ in 0..40 {
            if self.evaluate(&format!("document.getElementById('{list}').{wanted}")) == json!(true)
            {
                return;
            }
            self.press("ArrowDown", 40, "");
        }
        panic!("{list} has nothing where {wanted}");
    }

    /// A key without a letter.
    pub fn press(&mut self, key: &str, code: u32, text: &str) {
        let mut event =
            json!({ "type": "keyDown", "key": key, "code": key, "windowsVirtualKeyCode": code });
        if !text.is_empty() {
            event["text"] = json!(text);
        }
        self.call("Input.dispatchKeyEvent", event);
        self.call(
            "Input.dispatchKeyEvent",
            json!({ "type": "keyUp", "key": key, "code": key, "windowsVirtualKeyCode": code }),
        );
    }

    /// Moves the focus with the tabulator to another element, and presses Enter there.
    pub fn tab_to_and_enter(&mut self, selector: &str) {
        for _ in 0..200 {
            if self.evaluate(&format!(
                "document.activeElement.matches({})",
                json!(selector)
            )) == json!(true)
            {
                self.press("Enter", 13, "\r");
                return;
            }
            self.press("Tab", 9, "");
        }
        panic!("the tabulator never comes to {selector}");
    }

    /// Saves a picture of the page on request: `CTID_PICTURES` names the folder.
    pub fn picture(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("CTID_PICTURES") else {
            return;
        };
        sleep(Duration::from_millis(700));
        let shot = self.call(
            "Page.captureScreenshot",
            json!({ "format": "png", "captureBeyondViewport": false }),
        );
        let bytes = base64::Engine::decode(
            &base64::engine::general_purpose::STANDARD,
            shot["data"].as_str().unwrap(),
        );
        std::fs::write(
            Path::new(&folder).join(format!("{name}.png")),
            bytes.unwrap(),
        )
        .unwrap();
    }

    /// Checks that only this server was contacted, and that the console has no errors.
    pub fn assert_quiet(&mut self, address: &str) {
        // Earlier messages have arrived once this is answered.
        self.evaluate("1");
        let mut requests = 0;
        for event in &self.heard {
            let parameters = &event["params"];
            let what = match event["method"].as_str().unwrap_or_default() {
                "Network.requestWillBeSent" => {
                    let url = parameters["request"]["url"].as_str().unwrap();
                    requests += 1;
                    let ours = ["data:", "blob:", "about:"]
                        .iter()
                        .any(|local| url.starts_with(local))
                        || url.starts_with(address);
                    (!ours).then(|| format!("asked for {url}"))
                }
                "Runtime.exceptionThrown" => Some(parameters["exceptionDetails"].to_string()),
                "Runtime.consoleAPICalled"
                    if ["error", "assert", "warning"]
                        .contains(&parameters["type"].as_str().unwrap()) =>
                {
                    Some(parameters["args"].to_string())
                }
                "Log.entryAdded"
                    if ["error", "warning"]
                        .contains(&parameters["entry"]["level"].as_str().unwrap()) =>
                {
                    Some(parameters["entry"].to_string())
                }
                _ => None,
            };
            assert!(what.is_none(), "{}", what.unwrap_or_default());
        }
        assert!(requests > 10, "only {requests} requests were heard of");
    }
}

/// Port and path of the debugger, as the browser writes them into its profile.
fn debugger(profile: &Path) -> (u16, String) {
    let begun = Instant::now();
    loop {
        let text = std::fs::read_to_string(profile.join("DevToolsActivePort")).unwrap_or_default();
        let mut lines = text.lines();
        if let (Some(port), Some(path)) = (lines.next(), lines.next()) {
            return (port.parse().unwrap(), path.to_string());
        }
        assert!(
            begun.elapsed() < PATIENCE,
            "chromium does not open its debugger"
        );
        sleep(Duration::from_millis(50));
    }
}
