//! Each promise of `security`, kept by a running server.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpStream};
use std::time::{Duration, Instant};

use atomesh::watch::Silent;
use atomesh_studio::Session;
use atomesh_studio::security::HEADERS;
use serde_json::json;
use tungstenite::Message;

use super::client::{Studio, TIME, image_file};

/// Paths of all kinds: pages, files, views, things that are not there.
const PATHS: [&str; 9] = [
    "/",
    "/main.js",
    "/view/slice?what=image&axis=2&at=0",
    "/view/slice",
    "/view/playback",
    "/socket",
    "/nothing",
    "/../../etc/passwd",
    "/%2e%2e/x",
];

#[test]
fn it_listens_on_the_loopback_alone_and_on_a_port_of_the_systems_choice() {
    let (first, second) = (Studio::empty(), Studio::empty());
    assert!(first.addresses.iter().all(|address| address.ip().is_loopback()));
    assert!(first.addresses.iter().all(|address| address.port() == first.port));
    assert_ne!(first.port, second.port);
    // the machine's other addresses do not answer
    let own = std::net::UdpSocket::bind("0.0.0.0:0").unwrap();
    if own.connect("192.0.2.1:9").is_ok() {
        let ip = own.local_addr().unwrap().ip();
        if !ip.is_loopback() && !ip.is_unspecified() {
            assert!(TcpStream::connect((ip, first.port)).is_err(), "{ip}");
        }
    }
}

#[test]
fn the_token_is_exchanged_once_for_a_cookie_and_leaves_the_address() {
    let studio = Studio::empty();
    assert_eq!(studio.token().len(), 64, "256 bits");
    for wrong in ["", "0", &"0".repeat(64), &studio.token()[1..]] {
        assert_eq!(studio.request("GET", &format!("/?token={wrong}"), &[], "").status, 403);
    }
    let open = format!("/?token={}", studio.token());
    assert_eq!(
        studio.request("GET", &format!("/main.js?token={}", studio.token()), &[], "").status,
        403
    );
    let first = studio.request("GET", &open, &[], "");
    assert_eq!((first.status, first.header("location")), (303, Some("/")));
    let cookie = first.header("set-cookie").unwrap();
    assert!(cookie.starts_with(&format!("atomesh-{}=", studio.port)), "{cookie}");
    for part in ["HttpOnly", "SameSite=Strict", "Path=/"] {
        assert!(cookie.contains(part), "{cookie}");
    }
    assert!(!cookie.contains(studio.token()), "the cookie is another secret");
    let again = studio.request("GET", &open, &[], "");
    assert_eq!((again.status, again.header("set-cookie")), (403, None), "it opens once");
    let cookie = cookie.split(';').next().unwrap();
    assert_eq!(studio.request("GET", "/", &[("Cookie", cookie)], "").status, 200);
    // the browser that has the cookie may open the address again
    let known = studio.request("GET", &open, &[("Cookie", cookie)], "");
    assert_eq!((known.status, known.header("location")), (303, Some("/")));
}

#[test]
fn secrets_are_in_memory_only() {
    let studio = Studio::empty();
    let cookie = studio.cookie();
    let secret = cookie.split_once('=').unwrap().1;
    for entry in std::fs::read_dir(&studio.folder).unwrap() {
        let bytes = std::fs::read(entry.unwrap().path()).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(!text.contains(secret) && !text.contains(studio.token()));
    }
}

#[test]
fn nothing_is_answered_without_the_cookie() {
    let studio = Studio::empty();
    let cookie = studio.cookie();
    let (name, value) = cookie.split_once('=').unwrap();
    let others = [
        String::new(),
        format!("{name}="),
        format!("{name}={}", &value[1..]),
        format!("{name}x={value}"),
        format!("atomesh={value}"),
        format!("{name}={}", "0".repeat(64)),
    ];
    for path in PATHS {
        for other in &others {
            let answer = studio.request("GET", path, &[("Cookie", other)], "");
            assert_eq!(answer.status, 403, "{path} with {other}");
        }
    }
}

#[test]
fn only_three_spellings_of_the_host_are_known() {
    let studio = Studio::empty();
    let (cookie, port) = (studio.cookie(), studio.port);
    let status =
        |host: &str| studio.request("GET", "/", &[("Cookie", &cookie), ("Host", host)], "").status;
    for good in ["127.0.0.1", "[::1]", "localhost"] {
        assert_eq!(status(&format!("{good}:{port}")), 200, "{good}");
    }
    for bad in [
        "localhost".to_owned(),
        "127.0.0.1".to_owned(),
        format!("evil.test:{port}"),
        format!("localhost.evil.test:{port}"),
        format!("localhost:{port}.evil.test"),
        format!("127.0.0.1:{}", port ^ 1),
        format!("127.0.0.2:{port}"),
        format!("0.0.0.0:{port}"),
        format!("LOCALHOST:{port}"),
        format!("localhost:{port} "),
        format!("user@localhost:{port}"),
    ] {
        let found = status(&bad);
        // a header's own blanks are none of its value
        assert!(found == 421 || found == 400 || bad.ends_with(' '), "{bad}: {found}");
    }
    let none = format!("GET / HTTP/1.1\r\nCookie: {cookie}\r\nConnection: close\r\n\r\n");
    assert_ne!(studio.raw(&none).status, 200);
}

#[test]
fn what_changes_something_needs_this_origin() {
    let studio = Studio::empty();
    let (cookie, own) = (studio.cookie(), format!("http://{}", studio.host()));
    let post = |headers: &[(&str, &str)]| {
        let all = [&[("Cookie", cookie.as_str())], headers].concat();
        studio.request("POST", "/file/export?format=vtu", &all, "").status
    };
    assert_eq!(post(&[("Origin", &own)]), 422, "it is heard: nothing is open");
    let other_port = format!("http://127.0.0.1:{}", studio.port ^ 1);
    let other_name = format!("http://localhost:{}", studio.port);
    for bad in ["null", "http://evil.test", &other_port, &other_name, &own.replace("http", "https")]
    {
        assert_eq!(post(&[("Origin", bad)]), 403, "{bad}");
    }
    assert_eq!(post(&[]), 403, "none");
    for site in ["cross-site", "same-site"] {
        assert_eq!(post(&[("Origin", &own), ("Sec-Fetch-Site", site)]), 403);
        let headers = [("Cookie", cookie.as_str()), ("Sec-Fetch-Site", site)];
        assert_eq!(studio.request("GET", "/main.js", &headers, "").status, 403);
    }
    let upgrade = |origin: Option<&str>| {
        let mut headers = vec![
            ("Cookie", cookie.as_str()),
            ("Upgrade", "websocket"),
            ("Sec-WebSocket-Version", "13"),
            ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
        ];
        headers.extend(origin.map(|origin| ("Origin", origin)));
        studio.request("GET", "/socket", &headers, "").status
    };
    for bad in [None, Some("http://evil.test"), Some(other_port.as_str()), Some("null")] {
        assert_eq!(upgrade(bad), 403, "{bad:?}");
    }
}

#[test]
fn other_methods_are_refused_and_nothing_is_shared_with_other_origins() {
    let studio = Studio::empty();
    let cookie = studio.cookie();
    let own = format!("http://{}", studio.host());
    for method in ["OPTIONS", "PUT", "DELETE", "HEAD", "PATCH", "TRACE"] {
        let headers = [("Cookie", cookie.as_str()), ("Origin", own.as_str())];
        assert_eq!(studio.request(method, "/", &headers, "").status, 405, "{method}");
    }
    assert_eq!(studio.request("OPTIONS", "/", &[], "").status, 405, "before anything else");
    let headers = [("Cookie", cookie.as_str()), ("Origin", own.as_str())];
    assert_eq!(studio.request("POST", "/", &headers, "").status, 405);
    assert_eq!(studio.request("GET", "/file/drop", &headers, "").status, 405);
}

#[test]
fn every_answer_carries_the_headers() {
    let studio = Studio::empty();
    let cookie = studio.cookie();
    let own = format!("http://{}", studio.host());
    let mut answers = Vec::new();
    for path in PATHS {
        answers.push(studio.request("GET", path, &[("Cookie", &cookie)], ""));
        answers.push(studio.request("GET", path, &[], ""));
        answers.push(studio.request("OPTIONS", path, &[], ""));
        let host = [("Cookie", cookie.as_str()), ("Host", "evil.test")];
        answers.push(studio.request("GET", path, &host, ""));
        let post = [("Cookie", cookie.as_str()), ("Origin", own.as_str())];
        answers.push(studio.request("POST", path, &post, "x"));
    }
    let statuses: std::collections::BTreeSet<u16> = answers.iter().map(|a| a.status).collect();
    assert!(
        [200, 403, 404, 405, 421].iter().all(|status| statuses.contains(status)),
        "{statuses:?}"
    );
    for answer in &answers {
        for (name, value) in HEADERS {
            assert_eq!(answer.header(name.as_str()), Some(value), "{name} of {answer:?}");
        }
        let cors = answer.headers.iter().find(|(name, _)| name.starts_with("access-control"));
        assert_eq!(cors, None);
    }
    let policy = answers[0].header("content-security-policy").unwrap();
    for part in [
        "default-src 'none'",
        "script-src 'self'",
        "img-src 'self' blob:",
        "frame-ancestors 'none'",
    ] {
        assert!(policy.contains(part), "{policy}");
    }
    assert!(!policy.contains("unsafe"), "{policy}");
}

#[test]
fn a_page_names_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::on_file(&image_file(folder.path()), "[lattice]\nsize = 8.0");
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    for option in
        ["input.image", "input.mask", "input.size-field", "output.output", "frame.data-root"]
    {
        let set = json!({ "do": "set", "option": option, "value": "/etc/passwd" });
        let answer = page.ask(json!({ "op": "do", "gesture": set }));
        assert!(answer["refused"].is_string(), "{option}: {answer}");
    }
    let own = format!("http://{}", studio.host());
    let headers = [("Cookie", cookie.as_str()), ("Origin", own.as_str())];
    let outside = studio.folder.parent().unwrap().join("escaped.png");
    for name in ["../escaped.png", "%2e%2e%2fescaped.png", "..%5cescaped.png"] {
        let answer =
            studio.request("POST", &format!("/file/drop?name={name}"), &headers, "no image");
        assert_eq!(answer.status, 422, "{}", answer.text());
        assert!(!outside.exists(), "{name}");
    }
    for format in ["polyMesh", "../x.vtu", "/tmp/x.vtu", ""] {
        let answer = studio.request("POST", &format!("/file/export?format={format}"), &headers, "");
        assert_eq!(answer.status, 400, "{format}");
    }
    let names: Vec<_> =
        std::fs::read_dir(&studio.folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["log.jsonl"], "what is refused leaves nothing");
}

#[test]
fn a_flood_is_cut_off_and_long_messages_are_not_taken() {
    let studio = Studio::empty();
    let cookie = studio.cookie();
    let ends = |send: &mut dyn FnMut(&mut tungstenite::WebSocket<TcpStream>) -> bool| {
        let mut page = studio.page(&cookie);
        let started = Instant::now();
        while started.elapsed() < TIME {
            if !send(&mut page.socket) {
                return true;
            }
        }
        false
    };
    let flood = r#"{"seq":1,"command":{"op":"ack","kind":"mesh"}}"#;
    assert!(ends(&mut |socket| socket.send(Message::text(flood)).is_ok()));
    let long = "x".repeat(1 << 20);
    assert!(ends(&mut |socket| socket.send(Message::text(long.as_str())).is_ok()));
    for odd in ["{}", "hello", r#"{"seq":1,"command":{"op":"undo"},"x":1}"#] {
        let mut page = studio.page(&cookie);
        page.socket.send(Message::text(odd)).unwrap();
        let closed = std::iter::from_fn(|| Some(page.socket.read()))
            .take(20)
            .any(|read| !matches!(read, Ok(Message::Text(_) | Message::Binary(_))));
        assert!(closed, "{odd}");
    }
}

#[test]
fn what_cannot_be_made_is_said_and_undone() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::on_file(&image_file(folder.path()), "[lattice]\nsize = 8.0");
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    let hash = page.hash();
    page.act(json!({ "do": "set", "option": "lattice.size", "value": 0.001 }));
    page.settle();
    let error = page.state["error"].as_str().unwrap();
    assert!(error.contains("below the sample step"), "{error}");
    page.change(json!({ "op": "undo" }));
    assert_eq!(page.hash(), hash);
}

#[test]
fn eight_pages_are_enough() {
    let studio = Studio::empty();
    let cookie = studio.cookie();
    let pages: Vec<_> = (0..8).map(|_| studio.page(&cookie)).collect();
    assert!(studio.try_page(&cookie).is_none());
    drop(pages);
    let started = Instant::now();
    while studio.try_page(&cookie).is_none() {
        assert!(started.elapsed() < TIME, "who goes makes room");
    }
}

#[test]
fn who_never_finishes_a_request_is_sent_away() {
    let studio = Studio::empty();
    let mut slow = TcpStream::connect((Ipv4Addr::LOCALHOST, studio.port)).unwrap();
    slow.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    slow.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    let started = Instant::now();
    let mut bytes = Vec::new();
    let _ = slow.read_to_end(&mut bytes);
    let time = started.elapsed();
    assert!((5..25).contains(&time.as_secs()), "after {time:?}");
}

#[test]
fn it_ends_when_nobody_looks_and_keeps_the_session() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session");
    let session = Session::open(&path, &mut Silent).unwrap();
    let studio = Studio::serve(session, Duration::from_millis(300));
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    page.must(json!({ "op": "scene", "name": "disc", "seed": 1 }));
    std::thread::sleep(Duration::from_millis(600));
    assert!(!studio.has_ended(), "a page is open");
    drop(page);
    let started = Instant::now();
    while !studio.has_ended() {
        assert!(started.elapsed() < TIME);
        std::thread::sleep(Duration::from_millis(50));
    }
    drop(studio);
    let again = Session::open(&path, &mut Silent).unwrap();
    assert!(again.source().is_some(), "what was opened is open again");
}
