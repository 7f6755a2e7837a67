//! A browser without a screen, driven over the DevTools protocol.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use base64::Engine;
use serde_json::{Value, json};
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

use super::client::TIME;

/// Names that Chromium goes by.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// The size of the page.
pub const SIZE: [u32; 2] = [1200, 800];

/// The browser's program, if there is one.
pub fn program() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let all = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    all.into_iter().find(|program| program.is_file())
}

/// A page in a browser of its own.
pub struct Tab {
    browser: Child,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    session: String,
    id: u32,
    events: VecDeque<Value>,
    _profile: tempfile::TempDir,
}

impl Tab {
    /// Opens an empty page; says so and gives `None` where there is no browser.
    pub fn open() -> Option<Self> {
        let Some(program) = program() else {
            eprintln!("not tested in a browser: there is no chromium");
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        let mut browser = Command::new(program)
            .args(["--headless=new", "--no-sandbox", "--remote-debugging-port=0", "--no-first-run"])
            .args([
                "--enable-unsafe-swiftshader",
                "--disable-background-networking",
                "--mute-audio",
            ])
            .args([
                "--disable-dev-shm-usage",
                "--force-device-scale-factor=1",
                "--disable-gpu-sandbox",
            ])
            .args(["--host-resolver-rules=MAP rebound.test 127.0.0.1"])
            .arg(format!("--window-size={},{}", SIZE[0], SIZE[1]))
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the browser starts");
        let lines = BufReader::new(browser.stderr.take().unwrap()).lines();
        let mark = "DevTools listening on ";
        let mut lines = lines.map_while(Result::ok);
        let address = lines.find_map(|line| line.strip_prefix(mark).map(str::to_owned));
        let address = address.expect("the browser says where it listens");
        std::thread::spawn(move || lines.for_each(drop));
        let (socket, _) = tungstenite::connect(address.trim()).unwrap();
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(TIME)).unwrap();
        }
        let mut tab = Self {
            browser,
            socket,
            session: String::new(),
            id: 0,
            events: VecDeque::new(),
            _profile: profile,
        };
        let target = tab.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        tab.session =
            tab.call("Target.attachToTarget", attach)["sessionId"].as_str().unwrap().into();
        let metrics =
            json!({ "width": SIZE[0], "height": SIZE[1], "deviceScaleFactor": 1, "mobile": false });
        tab.call("Emulation.setDeviceMetricsOverride", metrics);
        for domain in ["Page.enable", "Runtime.enable", "Log.enable", "Network.enable"] {
            tab.call(domain, json!({}));
        }
        Some(tab)
    }

    /// Calls a method of the protocol.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.id += 1;
        let mut message = json!({ "id": self.id, "method": method, "params": parameters });
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.socket.send(Message::text(message.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().expect("the browser answers") else {
                continue;
            };
            let answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] == self.id {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.events.push_back(answer);
        }
    }

    /// Goes to an address.
    pub fn go(&mut self, address: &str) {
        self.call("Page.navigate", json!({ "url": address }));
    }

    /// The value of an expression, awaited.
    pub fn value(&mut self, expression: &str) -> Value {
        let parameters =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let result = self.call("Runtime.evaluate", parameters);
        assert!(
            result["exceptionDetails"].is_null(),
            "{expression}: {}",
            result["exceptionDetails"]
        );
        result["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub fn until(&mut self, expression: &str) {
        let started = Instant::now();
        while self.value(&format!("Boolean({expression})")) != true {
            if started.elapsed() > TIME {
                let told = "[document.getElementById('message')?.textContent, window.studio?.state?.error, \
                            window.studio?.state?.busy, window.studio?.state?.revision]";
                panic!("never: {expression}; the page says {}", self.value(told));
            }
            std::thread::sleep(Duration::from_millis(30));
        }
    }

    /// Waits until the studio has made everything and the page has drawn it.
    pub fn settle(&mut self) {
        self.until(
            "window.studio && studio.state && !studio.state.busy && studio.model && \
             (studio.state.hash || studio.state.error) && studio.views.every((v) => v.slices.image)",
        );
        self.frame();
    }

    /// Waits for two frames on the screen.
    pub fn frame(&mut self) {
        self.value(
            "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))",
        );
    }

    /// A mouse event at a place of the page; `button` none, left, middle or right.
    pub fn mouse(&mut self, kind: &str, at: [f64; 2], button: &str, modifiers: u32) {
        let buttons = match (button, kind) {
            ("left", "mousePressed" | "mouseMoved") => 1,
            ("right", "mousePressed" | "mouseMoved") => 2,
            ("middle", "mousePressed" | "mouseMoved") => 4,
            _ => 0,
        };
        self.call(
            "Input.dispatchMouseEvent",
            json!({ "type": kind, "x": at[0], "y": at[1], "button": button, "buttons": buttons,
                    "clickCount": 1, "modifiers": modifiers }),
        );
    }

    /// Drags with a button along a path.
    pub fn drag(&mut self, path: &[[f64; 2]], button: &str, modifiers: u32) {
        self.mouse("mouseMoved", path[0], "none", modifiers);
        self.mouse("mousePressed", path[0], button, modifiers);
        for at in &path[1..] {
            self.mouse("mouseMoved", *at, button, modifiers);
        }
        self.mouse("mouseReleased", path[path.len() - 1], button, modifiers);
    }

    /// A turn of the wheel.
    pub fn wheel(&mut self, at: [f64; 2], by: f64, modifiers: u32) {
        self.call(
            "Input.dispatchMouseEvent",
            json!({ "type": "mouseWheel", "x": at[0], "y": at[1], "deltaX": 0, "deltaY": by,
                    "modifiers": modifiers }),
        );
    }

    /// A key, as `KeyboardEvent.key` names it. Modifiers: 2 Ctrl, 8 Shift.
    pub fn key(&mut self, key: &str, modifiers: u32) {
        for kind in ["rawKeyDown", "keyUp"] {
            self.call(
                "Input.dispatchKeyEvent",
                json!({ "type": kind, "key": key, "modifiers": modifiers }),
            );
        }
    }

    /// What the page shows, as red, green, blue of each pixel.
    pub fn picture(&mut self) -> Picture {
        self.frame();
        let shot = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes =
            base64::engine::general_purpose::STANDARD.decode(shot["data"].as_str().unwrap());
        Picture::of(&bytes.unwrap())
    }

    /// A picture kept where the environment asks for pictures, to be looked at.
    pub fn keep_picture(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("ATOMESH_SCREENSHOTS") else { return };
        self.frame();
        let shot = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes =
            base64::engine::general_purpose::STANDARD.decode(shot["data"].as_str().unwrap());
        std::fs::write(Path::new(&folder).join(name), bytes.unwrap()).unwrap();
    }

    /// What the page complained about: exceptions, and errors of the log.
    pub fn complaints(&mut self) -> Vec<String> {
        self.value("0");
        let is_complaint = |event: &&Value| {
            event["method"] == "Runtime.exceptionThrown"
                || event["method"] == "Log.entryAdded"
                    && event["params"]["entry"]["level"] == "error"
        };
        self.events.iter().filter(is_complaint).map(|event| event["params"].to_string()).collect()
    }

    /// The addresses that the page has asked for.
    pub fn requests(&mut self) -> Vec<String> {
        self.value("0");
        let sent =
            self.events.iter().filter(|event| event["method"] == "Network.requestWillBeSent");
        sent.filter_map(|event| event["params"]["request"]["url"].as_str().map(str::to_owned))
            .collect()
    }

    /// The place on the page of a place in samples, in a view.
    pub fn place(&mut self, view: usize, sample: [f64; 2]) -> [f64; 2] {
        let [x, y] = sample;
        let found = self.value(&format!(
            "(() => {{ const v = studio.views[{view}], r = v.canvas.getBoundingClientRect(); \
             const [x, y] = v.toPixels([{x}, {y}]); return [r.left + x, r.top + y]; }})()"
        ));
        [found[0].as_f64().unwrap(), found[1].as_f64().unwrap()]
    }
}

impl Drop for Tab {
    fn drop(&mut self) {
        let _ = self.browser.kill();
        let _ = self.browser.wait();
    }
}

/// A picture of the page.
pub struct Picture {
    width: usize,
    pixels: Vec<u8>,
}

impl Picture {
    fn of(png: &[u8]) -> Self {
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        let channels = info.color_type.samples();
        let pixels = bytes.chunks_exact(channels).flat_map(|pixel| pixel[..3].to_vec()).collect();
        Self { width: info.width as usize, pixels }
    }

    /// Red, green and blue at a place.
    pub fn at(&self, [x, y]: [f64; 2]) -> [u8; 3] {
        let i = 3 * (y.round() as usize * self.width + x.round() as usize);
        [self.pixels[i], self.pixels[i + 1], self.pixels[i + 2]]
    }

    /// How many pixels within a box are as wanted.
    pub fn count(
        &self,
        low: [f64; 2],
        high: [f64; 2],
        is_wanted: impl Fn([u8; 3]) -> bool,
    ) -> usize {
        let columns = low[0] as usize..high[0] as usize;
        let rows = low[1] as usize..high[1] as usize;
        rows.map(|y| columns.clone().filter(|&x| is_wanted(self.at([x as f64, y as f64]))).count())
            .sum()
    }
}
