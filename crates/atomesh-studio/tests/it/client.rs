//! A server under test, and a client of it that is as plain or as hostile as a test needs.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use atomesh::watch::Silent;
use atomesh_job::options::RunConfig;
use atomesh_studio::{Server, Session};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket};

/// How long anything may take.
pub const TIME: Duration = Duration::from_secs(60);

/// A studio that runs on a thread of its own.
pub struct Studio {
    pub folder: PathBuf,
    pub address: String,
    pub port: u16,
    pub addresses: Vec<std::net::SocketAddr>,
    is_ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<std::io::Result<()>>>,
    /// The folder, if it is the test's alone.
    kept: Option<tempfile::TempDir>,
}

impl Studio {
    /// A session on a file with options, in a new folder.
    pub fn on_file(path: &Path, options: &str) -> Self {
        let kept = tempfile::tempdir().unwrap();
        let folder = kept.path().join("session");
        let mut session = Session::open(&folder, &mut Silent).unwrap();
        let mut run = RunConfig::parse(options).unwrap();
        run.input.image = Some(path.into());
        session.open_file(run, &mut Silent).unwrap();
        let mut studio = Self::serve(session, Duration::from_secs(600));
        studio.kept = Some(kept);
        studio
    }

    /// A session on nothing.
    pub fn empty() -> Self {
        let kept = tempfile::tempdir().unwrap();
        let session = Session::open(&kept.path().join("session"), &mut Silent).unwrap();
        let mut studio = Self::serve(session, Duration::from_secs(600));
        studio.kept = Some(kept);
        studio
    }

    /// Serves a session.
    pub fn serve(session: Session, patience: Duration) -> Self {
        let folder = session.folder().to_path_buf();
        let server = Server::new(session, patience).unwrap();
        let (address, addresses) = (server.address(), server.listens_on());
        let port = addresses[0].port();
        let is_ended = Arc::new(AtomicBool::new(false));
        let ended = is_ended.clone();
        let thread = std::thread::spawn(move || server.run(|| ended.load(Ordering::SeqCst)));
        Self { folder, address, port, addresses, is_ended, thread: Some(thread), kept: None }
    }

    /// A server of another process.
    pub fn of_address(address: &str, folder: &Path) -> Self {
        let port = address.split(['/', ':']).find_map(|part| part.parse().ok()).unwrap();
        Self {
            folder: folder.into(),
            address: address.into(),
            port,
            addresses: Vec::new(),
            is_ended: Arc::default(),
            thread: None,
            kept: None,
        }
    }

    /// Whether the server has ended by itself.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    pub fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    pub fn token(&self) -> &str {
        self.address.split_once("token=").unwrap().1
    }

    /// Sends a request as it is, and gives the answer.
    pub fn raw(&self, request: &str) -> Answer {
        let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).unwrap();
        stream.set_read_timeout(Some(TIME)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut bytes = Vec::new();
        let _ = stream.read_to_end(&mut bytes);
        Answer::of(&bytes)
    }

    /// A request of a method, with headers beside `Host` and `Connection`.
    pub fn request(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        body: &str,
    ) -> Answer {
        let mut text = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n");
        if !headers.iter().any(|(name, _)| name.eq_ignore_ascii_case("host")) {
            text += &format!("Host: {}\r\n", self.host());
        }
        for (name, value) in headers {
            text += &format!("{name}: {value}\r\n");
        }
        text += &format!("Content-Length: {}\r\n\r\n{body}", body.len());
        self.raw(&text)
    }

    /// The cookie for the token, which is spent by it.
    pub fn cookie(&self) -> String {
        let answer = self.request("GET", &format!("/?token={}", self.token()), &[], "");
        assert_eq!(answer.status, 303, "{answer:?}");
        let cookie = answer.header("set-cookie").expect("a cookie is set");
        cookie.split(';').next().unwrap().to_owned()
    }

    /// A page, as far as the protocol goes.
    pub fn page(&self, cookie: &str) -> Page {
        self.try_page(cookie).expect("the page is let in")
    }

    /// The same; `None` if it is not let in.
    pub fn try_page(&self, cookie: &str) -> Option<Page> {
        let mut request = format!("ws://{}/socket", self.host()).into_client_request().unwrap();
        let headers = request.headers_mut();
        headers.insert("cookie", HeaderValue::from_str(cookie).unwrap());
        let origin = format!("http://{}", self.host());
        headers.insert("origin", HeaderValue::from_str(&origin).unwrap());
        let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).unwrap();
        stream.set_read_timeout(Some(TIME)).unwrap();
        let (socket, _) = tungstenite::client(request, stream).ok()?;
        Some(Page { socket, seq: 0, state: Value::Null, frames: Vec::new(), acknowledges: true })
    }

    pub fn stop(&mut self) {
        self.is_ended.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the server does not panic").unwrap();
        }
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.stop();
        }
    }
}

/// An answer taken apart.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub headers: Vec<(String, String)>,
    pub body: Vec<u8>,
}

impl Answer {
    fn of(bytes: &[u8]) -> Self {
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").unwrap_or(bytes.len());
        let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
        let mut lines = head.lines();
        let status = lines.next().and_then(|line| line.split(' ').nth(1)?.parse().ok());
        let headers = lines.filter_map(|line| line.split_once(": "));
        let headers: Vec<_> =
            headers.map(|(name, value)| (name.to_ascii_lowercase(), value.to_owned())).collect();
        let body = bytes.get(end + 4..).unwrap_or_default().to_vec();
        Self { status: status.unwrap_or(0), headers, body }
    }

    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}

/// A page that speaks the protocol.
pub struct Page {
    pub socket: WebSocket<TcpStream>,
    seq: u32,
    pub state: Value,
    pub frames: Vec<Vec<u8>>,
    pub acknowledges: bool,
}

impl Page {
    /// Sends a command and waits for its answer.
    pub fn ask(&mut self, command: Value) -> Value {
        self.seq += 1;
        let seq = self.seq;
        self.send(&command, seq);
        let started = Instant::now();
        loop {
            assert!(started.elapsed() < TIME, "no answer to {command}");
            if let Some(answer) = self.take()
                && answer["seq"] == seq
            {
                return answer;
            }
        }
    }

    /// Asks for what must be done.
    pub fn must(&mut self, command: Value) -> Value {
        let answer = self.ask(command.clone());
        assert_eq!(answer["refused"], Value::Null, "{command}");
        answer
    }

    /// Asks for what changes the state, and waits until it has.
    pub fn change(&mut self, command: Value) {
        let before = self.state["revision"].clone();
        self.must(command);
        self.until(|state| state["revision"] != before);
    }

    /// Does a gesture.
    pub fn act(&mut self, gesture: Value) {
        self.change(json!({ "op": "do", "gesture": gesture }));
    }

    /// Sends a command and waits for nothing.
    pub fn send(&mut self, command: &Value, seq: u32) {
        let text = json!({ "seq": seq, "command": command }).to_string();
        self.socket.send(Message::text(text)).unwrap();
    }

    /// Takes one message: an answer, or a state or frame, which is kept.
    pub fn take(&mut self) -> Option<Value> {
        match self.socket.read().expect("the socket lives") {
            Message::Text(text) => {
                let value: Value = serde_json::from_str(&text).unwrap();
                if value["kind"].is_null() {
                    return Some(value);
                }
                if value["kind"] == "state" {
                    self.state = value["value"].clone();
                }
                self.acknowledge(&value["kind"]);
            }
            Message::Binary(bytes) => {
                let kinds = ["state", "mesh", "atoms", "drag", "facets", "flow", "progress"];
                let kind = json!(kinds[bytes[0] as usize]);
                self.frames.push(bytes.to_vec());
                self.acknowledge(&kind);
            }
            other => panic!("{other:?}"),
        }
        None
    }

    fn acknowledge(&mut self, kind: &Value) {
        if self.acknowledges {
            self.send(&json!({ "op": "ack", "kind": kind }), 0);
        }
    }

    /// Waits until the state is as wanted.
    pub fn until(&mut self, wanted: impl Fn(&Value) -> bool) {
        let started = Instant::now();
        while !wanted(&self.state) {
            assert!(started.elapsed() < TIME, "{:#}", self.state);
            assert_eq!(self.take(), None);
        }
    }

    /// Waits until all is made.
    pub fn settle(&mut self) {
        self.until(|state| {
            state["busy"] == false && (state["hash"].is_string() || !state["error"].is_null())
        });
    }

    /// The hash of the mesh, once all is made.
    pub fn hash(&mut self) -> String {
        self.settle();
        self.state["hash"].as_str().unwrap_or_else(|| panic!("{:#}", self.state)).to_owned()
    }

    /// The frame of a kind at a revision or after, which may come after the state that tells of it.
    pub fn frame(&mut self, kind: u8, revision: u64) -> Vec<u8> {
        let started = Instant::now();
        let is_wanted = |frame: &&Vec<u8>| {
            let own = u32::from_le_bytes(frame[4..8].try_into().unwrap());
            frame[0] == kind && u64::from(own) >= revision
        };
        loop {
            if let Some(frame) = self.frames.iter().rev().find(is_wanted) {
                return frame.clone();
            }
            assert!(started.elapsed() < TIME, "no frame {kind} of revision {revision}");
            assert_eq!(self.take(), None);
        }
    }

    /// The atoms that are shown.
    pub fn atoms(&mut self) -> Vec<u8> {
        let revision = self.state["atomsRevision"].as_u64().unwrap();
        self.frame(2, revision)
    }
}

/// A small image of dark lines on grey, in a file.
pub fn image_file(folder: &Path) -> PathBuf {
    let (width, height) = (64, 48);
    let mut grey = vec![200_u8; width * height];
    grey[20 * width + 8..20 * width + 56].fill(10);
    (8..40).for_each(|y| grey[y * width + 40] = 10);
    let path = folder.join("lines.png");
    let file = std::fs::File::create(&path).unwrap();
    let mut encoder = png::Encoder::new(file, width as u32, height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&grey).unwrap();
    path
}
