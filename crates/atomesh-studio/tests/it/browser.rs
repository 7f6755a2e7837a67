//! The page in a real browser: what is shown, by its pixels, and what hands do.
//!
//! Passes by, with a word, where there is no Chromium. No scene measures frame rates.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::time::Duration;

use atomesh::watch::Silent;
use atomesh_studio::Session;
use atomesh_studio::replay::replay;
use serde_json::{Value, json};

use super::chromium::Tab;
use super::client::{Studio, image_file};

const CTRL: u32 = 2;
const SHIFT: u32 = 8;

/// A picture that is other in each corner: black top left, white top right, dark grey bottom left, light grey bottom right;
/// a black line across the middle.
fn phantom(folder: &Path) -> PathBuf {
    let (width, height) = (96, 64);
    let mut grey = vec![128_u8; width * height];
    let mut fill = |x0: usize, y0: usize, value: u8| {
        (y0..y0 + 12).for_each(|y| grey[y * width + x0..y * width + x0 + 12].fill(value));
    };
    fill(0, 0, 0);
    fill(84, 0, 255);
    fill(0, 52, 64);
    fill(84, 52, 200);
    (20..76).for_each(|x| grey[32 * width + x] = 0);
    let path = folder.join("phantom.png");
    let mut encoder =
        png::Encoder::new(std::fs::File::create(&path).unwrap(), width as u32, height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&grey).unwrap();
    path
}

/// A studio on the phantom, and a page that shows it.
fn opened(folder: &Path, options: &str) -> Option<(Studio, Tab)> {
    let mut tab = Tab::open()?;
    let studio = Studio::on_file(&phantom(folder), options);
    tab.go(&studio.address);
    tab.settle();
    Some((studio, tab))
}

fn is_blue([r, _, b]: [u8; 3]) -> bool {
    b > r.saturating_add(30)
}

fn is_yellow([r, g, b]: [u8; 3]) -> bool {
    r > 180 && g > 140 && b < 130
}

#[test]
fn the_page_opens_and_shows_the_image_the_right_way_up() {
    let folder = tempfile::tempdir().unwrap();
    let Some((studio, mut tab)) = opened(folder.path(), "[lattice]\nsize = 8.0") else { return };
    assert_eq!(tab.value("location.href"), format!("http://{}/", studio.host()), "no token");
    assert_eq!(tab.value("document.cookie"), "", "no script sees the cookie");
    tab.keep_picture("look.png");
    let with_mesh = tab.picture();
    let (low, high) = (tab.place(0, [0.0, 0.0]), tab.place(0, [95.0, 63.0]));
    assert!(with_mesh.count(low, high, is_blue) > 2000, "edges are drawn");
    tab.key("g", 0);
    let picture = tab.picture();
    assert_eq!(picture.count(low, high, is_blue), 0, "g takes the mesh away");
    let mut grey = |x: f64, y: f64| {
        let [r, g, b] = picture.at(tab.place(0, [x, y]));
        assert!(r == g && g == b);
        r
    };
    let corners = [grey(5.0, 5.0), grey(90.0, 5.0), grey(5.0, 58.0), grey(90.0, 58.0)];
    assert_eq!((corners[0], corners[1]), (0, 255), "{corners:?}");
    assert!((55..75).contains(&corners[2]) && (190..215).contains(&corners[3]), "{corners:?}");
    assert_eq!(grey(50.0, 32.0), 0, "the line lies across");
    // all that was asked for is this server's
    let own = format!("http://{}/", studio.host());
    let asked = tab.requests();
    assert!(asked.len() > 10);
    assert!(asked.iter().all(|url| url.starts_with(&own) || url == "about:blank"), "{asked:?}");
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

#[test]
fn the_mesh_is_drawn_where_the_server_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let Some((_studio, mut tab)) = opened(folder.path(), "[lattice]\nsize = 12.0") else { return };
    let place = "(i) => [studio.frames.mesh.places[2 * i] / 65535 * 95, studio.frames.mesh.places[2 * i + 1] / 65535 * 63]";
    let middles = tab.value(&format!(
        "(() => {{ const at = {place}, e = studio.frames.mesh.edges, all = []; \
         for (let k = 0; k < e.length; k += 2) {{ const a = at(e[k]), b = at(e[k + 1]); \
         all.push([(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]); }} return all; }})()"
    ));
    let picture = tab.picture();
    let middles: Vec<[f64; 2]> = serde_json::from_value(middles).unwrap();
    assert!(middles.len() > 50);
    for middle in &middles {
        let [x, y] = tab.place(0, *middle);
        let found = picture.count([x - 2.0, y - 2.0], [x + 3.0, y + 3.0], is_blue);
        assert!(found > 1, "no edge at {middle:?}");
    }
}

#[test]
fn a_run_is_played_back_and_ends_where_the_atoms_are() {
    let folder = tempfile::tempdir().unwrap();
    let options = "[lattice]\nsize = 8.0\n[improve]\nalign = \"off\"";
    let Some((_studio, mut tab)) = opened(folder.path(), options) else { return };
    tab.value("studio.playback.fetch()");
    let frames = tab.value("studio.playback.record.count").as_u64().unwrap();
    assert!(frames > 3, "{frames} iterations");
    tab.value("studio.playback.show(0)");
    let (low, high) = (tab.place(0, [0.0, 0.0]), tab.place(0, [95.0, 63.0]));
    let first = tab.picture();
    assert!(first.count(low, high, is_yellow) > 500, "atoms are drawn");
    tab.keep_picture("playback.png");
    // the last frame's atoms are the mesh's points
    let off = tab.value(
        "(() => { const r = studio.playback.record, last = r.frame(r.count - 1), m = studio.frames.mesh.places; \
         let most = 0; for (let i = 0; i < last.length; i += 2) { let least = 1e9; \
         for (let k = 0; k < m.length; k += 2) \
         least = Math.min(least, Math.hypot(last[i] - m[k], last[i + 1] - m[k + 1])); \
         most = Math.max(most, least); } return most; })()",
    );
    assert!(off.as_f64().unwrap() <= 2.0, "{off} of 65535");
    tab.value("studio.playback.stop()");
    assert_eq!(tab.picture().count(low, high, is_yellow), 0);
    tab.key("p", 0);
    tab.until("studio.playback.isPlaying");
    tab.until("!studio.playback.isPlaying && !studio.played");
}

#[test]
fn atoms_are_dragged_added_pinned_and_removed_by_hand() {
    let folder = tempfile::tempdir().unwrap();
    let Some((_studio, mut tab)) = opened(folder.path(), "[lattice]\nsize = 6.0") else { return };
    let before = tab.value("studio.state.hash");
    tab.key("4", 0);
    tab.until("studio.tools[4].atoms && studio.state.hasAtoms");
    let nearest = "(() => { const a = studio.tools[4].atoms, v = studio.views[0]; let best = 0, least = 1e9; \
                   for (let i = 0; i < a.states.length; i++) { \
                   const d = Math.hypot(a.places[2*i]/65535*95 - 40, a.places[2*i+1]/65535*63 - 44); \
                   if (d < least) { least = d; best = i; } } \
                   return [best, a.places[2*best]/65535*95, a.places[2*best+1]/65535*63]; })()";
    let found = tab.value(nearest);
    let atom = found[0].as_u64().unwrap();
    let sample = [found[1].as_f64().unwrap(), found[2].as_f64().unwrap()];
    let from = tab.place(0, sample);
    assert!(is_yellow(tab.picture().at(from)), "the atom is drawn");
    let to = [from[0] + 24.0, from[1] + 12.0];
    let half = [from[0] + 12.0, from[1] + 6.0];
    tab.mouse("mouseMoved", from, "none", 0);
    tab.mouse("mousePressed", from, "left", 0);
    tab.mouse("mouseMoved", half, "left", 0);
    tab.mouse("mouseMoved", to, "left", 0);
    tab.until("studio.frames.drag && !studio.tools[4].isSending");
    tab.frame();
    tab.keep_picture("atoms.png");
    let [r, g, b] = tab.picture().at(to);
    assert!(r > 200 && g > 200 && b > 200, "the hand's atom is white: {r} {g} {b}");
    let moved = tab.value("studio.frames.drag.moves.length").as_u64().unwrap();
    assert!(moved > 3, "{moved} follow");
    tab.mouse("mouseReleased", to, "left", 0);
    tab.until("studio.state.undo === 1 && !studio.state.busy && studio.state.hasAtoms");
    assert_ne!(tab.value("studio.state.hash"), before);
    tab.key("z", CTRL);
    tab.until("studio.state.undo === 0 && !studio.state.busy && studio.state.hash");
    assert_eq!(tab.value("studio.state.hash"), before, "undone to the bit");
    tab.until("studio.state.hasAtoms");
    let count = "studio.tools[4].atoms.states.filter((s) => s !== 2).length";
    let atoms = tab.value(count).as_u64().unwrap();
    // a place between atoms
    let free = tab.place(0, [sample[0] + 2.6, sample[1] + 1.7]);
    tab.mouse("mouseMoved", free, "none", 0);
    tab.key("n", 0);
    tab.until(&format!("{count} === {}", atoms + 1));
    tab.until("!studio.state.busy && studio.state.hasAtoms");
    tab.mouse("mouseMoved", free, "none", 0);
    tab.key("f", 0);
    tab.until("studio.tools[4].atoms.states.some((s) => s === 1)");
    tab.until("!studio.state.busy && studio.state.hasAtoms");
    let [r, g, b] = tab.picture().at(free);
    assert!(r > 200 && g < 130 && b < 130, "a pinned atom is red: {r} {g} {b}");
    tab.key("Delete", 0);
    tab.until("!document.getElementById('message').hidden");
    assert!(
        tab.value("document.getElementById('message').textContent")
            .as_str()
            .unwrap()
            .contains("pinned")
    );
    tab.key("f", 0);
    tab.until("!studio.tools[4].atoms.states.some((s) => s === 1) && studio.state.hasAtoms");
    tab.key("Delete", 0);
    tab.until(&format!("{count} === {atoms}"));
    assert!(atom < atoms);
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

#[test]
fn size_and_weight_are_painted_and_erased() {
    let folder = tempfile::tempdir().unwrap();
    let Some((_studio, mut tab)) = opened(folder.path(), "[lattice]\nsize = 8.0") else { return };
    let before = tab.value("studio.state.hash");
    let cells = tab.value("studio.state.figures.cells").as_u64().unwrap();
    tab.key("2", 0);
    tab.value("studio.tool.value = 3, studio.tool.radius = 14, studio.panel.update()");
    let path = [[30.0, 16.0], [45.0, 18.0], [60.0, 16.0]].map(|s| tab.place(0, s));
    tab.drag(&path, "left", 0);
    tab.until("studio.model.painted.size && !studio.state.busy && studio.state.figures");
    tab.frame();
    tab.keep_picture("paint.png");
    let more = tab.value("studio.state.figures.cells").as_u64().unwrap();
    assert!(more > cells + 50, "{cells} to {more} cells");
    // small d is at the low end of the colours, which is violet; elsewhere it is yellow
    tab.key("g", 0);
    tab.until("studio.views[0].value('distance', [45, 18]) < 4");
    let picture = tab.picture();
    let at = |tab: &mut Tab, s: [f64; 2]| picture.at(tab.place(0, s));
    let ([r, g, _], [r2, g2, _]) = (at(&mut tab, [45.0, 20.0]), at(&mut tab, [45.0, 58.0]));
    assert!(u32::from(r2) + u32::from(g2) > u32::from(r) + u32::from(g) + 60, "{r} {g}, {r2} {g2}");
    tab.drag(&path, "left", CTRL);
    tab.until("studio.state.undo === 2 && !studio.state.busy");
    tab.key("z", CTRL);
    tab.key("z", CTRL);
    tab.until("studio.state.undo === 0 && !studio.state.busy && studio.state.hash");
    assert_eq!(tab.value("studio.state.hash"), before);
    tab.key("3", 0);
    tab.value("studio.tool.value = 0, studio.tool.radius = 20");
    tab.drag(&path, "left", 0);
    tab.until("studio.model.painted.weight && !studio.state.busy && studio.state.hash");
    assert_ne!(tab.value("studio.state.hash"), before);
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

#[test]
fn a_session_outlives_a_reload_and_a_kill() {
    let Some(mut tab) = Tab::open() else { return };
    let folder = tempfile::tempdir().unwrap();
    let image = phantom(folder.path());
    let path = folder.path().join("session");
    let mut session = Session::open(&path, &mut Silent).unwrap();
    let mut run = atomesh_job::options::RunConfig::default();
    run.input.image = Some(image);
    session.open_file(run, &mut Silent).unwrap();
    let mut studio = Studio::serve(session, Duration::from_secs(600));
    tab.go(&studio.address);
    tab.settle();
    tab.key("2", 0);
    for y in [16.0, 24.0, 40.0] {
        let stroke = [tab.place(0, [30.0, y]), tab.place(0, [60.0, y])];
        tab.drag(&stroke, "left", 0);
    }
    tab.until("studio.state.undo === 3 && !studio.state.busy && studio.state.hash");
    let hash = tab.value("studio.state.hash");
    tab.call("Page.reload", json!({}));
    tab.until("document.readyState === 'complete' && window.studio && studio.state?.undo === 3");
    tab.settle();
    assert_eq!(tab.value("studio.state.hash"), hash);
    studio.stop();
    // a kill tears the last line at most: here the last stroke is torn
    let log = path.join("log.jsonl");
    let bytes = std::fs::read(&log).unwrap();
    std::fs::write(&log, &bytes[..bytes.len() - 5]).unwrap();
    let session = Session::open(&path, &mut Silent).unwrap();
    assert_eq!(session.counts(), [2, 0], "the last gesture is lost and no other");
    drop(session);
    std::fs::write(&log, &bytes).unwrap();
    let again = Studio::serve(Session::open(&path, &mut Silent).unwrap(), Duration::from_secs(600));
    tab.go(&again.address);
    tab.settle();
    assert_eq!(tab.value("studio.state.hash"), hash);
}

#[test]
fn what_is_exported_is_what_the_log_replays() {
    let folder = tempfile::tempdir().unwrap();
    let Some((studio, mut tab)) = opened(folder.path(), "[lattice]\nsize = 7.0") else { return };
    tab.key("4", 0);
    tab.until("studio.tools[4].atoms && studio.state.hasAtoms");
    let at = tab.place(0, [50.0, 44.0]);
    tab.mouse("mouseMoved", at, "none", 0);
    tab.key("n", 0);
    tab.until("studio.state.undo === 1 && !studio.state.busy && studio.state.hash");
    let exported = tab.value(
        "fetch('/file/export?format=vtu', { method: 'POST' }).then((a) => a.arrayBuffer()) \
         .then((b) => crypto.subtle.digest('SHA-256', b)).then((h) => [...new Uint8Array(h)])",
    );
    let exported: Vec<u8> = serde_json::from_value(exported).unwrap();
    let output = folder.path().join("replayed.vtu");
    replay(&studio.folder.join("log.jsonl"), &output, &mut Silent).unwrap();
    use sha2::Digest;
    let replayed = sha2::Sha256::digest(std::fs::read(output).unwrap());
    assert_eq!(exported, replayed.to_vec());
}

#[test]
fn a_hostile_page_and_a_rebound_host_get_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let Some((studio, mut tab)) = opened(folder.path(), "") else { return };
    // a server of another's on this machine: its pages are of the same site, so that browsers send our cookie along
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(mut stream) = stream else { return };
            let _ = stream.read(&mut [0; 4096]);
            let page = "HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: 4\r\nConnection: close\r\n\r\nevil";
            let _ = stream.write_all(page.as_bytes());
        }
    });
    let own = studio.host();
    tab.go(&format!("http://127.0.0.1:{port}/"));
    tab.until("document.body && document.body.textContent === 'evil'");
    let tried = tab.value(&format!(
        "(async () => {{
           const own = 'http://{own}', said = {{}};
           const read = async (name, ask) => {{ try {{ const a = await ask(); said[name] = a.type === 'opaque' ? 'opaque' : a.status; }} catch (e) {{ said[name] = 'refused'; }} }};
           await read('page', () => fetch(own + '/', {{ credentials: 'include' }}));
           await read('state', () => fetch(own + '/view/slice?what=image&axis=2&at=0', {{ credentials: 'include' }}));
           await read('post', () => fetch(own + '/file/export?format=vtu', {{ method: 'POST', credentials: 'include' }}));
           await read('drop', () => fetch(own + '/file/drop?name=x.png', {{ method: 'POST', body: 'x', mode: 'no-cors', credentials: 'include' }}));
           said.socket = await new Promise((done) => {{ const s = new WebSocket('ws://{own}/socket'); s.onopen = () => done('open'); s.onerror = () => done('refused'); }});
           said.script = await new Promise((done) => {{ const s = document.createElement('script'); s.type = 'text/javascript'; s.src = own + '/frames.js'; s.onload = () => done('loaded'); s.onerror = () => done('refused'); document.head.append(s); }});
           said.picture = await new Promise((done) => {{ const i = new Image(); i.src = own + '/view/slice?what=image&axis=2&at=0'; i.onload = () => done('loaded'); i.onerror = () => done('refused'); }});
           const frame = document.createElement('iframe'); frame.src = own + '/'; document.body.append(frame);
           await new Promise((done) => {{ frame.onload = done; setTimeout(done, 3000); }});
           try {{ said.frame = frame.contentWindow.studio ? 'read' : 'nothing'; }} catch (e) {{ said.frame = 'refused'; }}
           return said; }})()"
    ));
    for (name, found) in tried.as_object().unwrap() {
        let is_nothing = ["refused", "nothing"].contains(&found.as_str().unwrap_or_default());
        assert!(is_nothing || (name == "drop" && *found == "opaque"), "{name}: {found}");
    }
    let names: Vec<_> =
        std::fs::read_dir(&studio.folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["log.jsonl"], "nothing was written for it");
    // a name that is made to lead to this machine
    tab.go(&format!("http://rebound.test:{}/", studio.port));
    tab.until("location.host.startsWith('rebound') && document.body");
    let text = tab.value("document.body.textContent");
    assert_eq!(text, "this address is not the studio's");
    let got = tab.value("fetch('/view/playback').then((a) => a.status)");
    assert_eq!(got, 421);
}

#[test]
fn every_key_does_what_the_list_says() {
    let folder = tempfile::tempdir().unwrap();
    let Some((_studio, mut tab)) = opened(folder.path(), "[lattice]\nsize = 8.0") else { return };
    tab.key("h", 0);
    tab.until("document.getElementById('keys').open");
    tab.keep_picture("keys.png");
    let listed =
        tab.value("[...document.querySelectorAll('#keys tr')].map((r) => r.cells[0].textContent)");
    let bound = tab.value(
        "import('/keys.js').then((m) => m.KEYS.map((k) => k.shown ?? k.key.replace('+', ' + ')))",
    );
    let listed: Vec<String> = serde_json::from_value(listed).unwrap();
    let bound: Vec<String> = serde_json::from_value(bound).unwrap();
    assert!(bound.iter().all(|key| listed.contains(key)), "{listed:?}");
    tab.key("Escape", 0);
    tab.until("!document.getElementById('keys').open");
    let mut seen = Vec::new();
    let mut check = |tab: &mut Tab, key: &str, modifiers: u32, expression: &str| {
        tab.key(key, modifiers);
        tab.until(expression);
        seen.push(if modifiers & CTRL > 0 { format!("Ctrl+{key}") } else { key.to_owned() });
    };
    for (number, tool) in [("5", 5), ("2", 2), ("3", 3), ("4", 4), ("6", 6), ("7", 7), ("1", 1)] {
        check(&mut tab, number, 0, &format!("studio.tool === studio.tools[{tool}]"));
        if tool == 5 {
            check(&mut tab, "m", 0, "studio.tool.hand === 'merge'");
            check(&mut tab, "s", 0, "studio.tool.hand === 'split'");
        }
    }
    tab.value("studio.views[0].zoomAt(100, 100, 3)");
    check(&mut tab, "r", 0, "Math.abs(studio.views[0].center[0] - 47.5) < 1e-9");
    tab.value("studio.window = [-500, 900]");
    check(&mut tab, "c", 0, "studio.window[0] >= -1 && studio.window[1] <= 256");
    check(&mut tab, "g", 0, "!studio.showsMesh");
    check(&mut tab, "b", 0, "studio.overlay === 'potential'");
    check(&mut tab, "d", 0, "studio.overlay === 'distance'");
    check(&mut tab, "w", 0, "studio.overlay === 'weight'");
    check(&mut tab, "v", 0, "studio.model.voronoi && !studio.state.busy && studio.state.hash");
    tab.key("g", 0);
    tab.frame();
    tab.keep_picture("voronoi.png");
    check(&mut tab, "z", CTRL, "!studio.model.voronoi && studio.state.redo === 1");
    check(&mut tab, "y", CTRL, "studio.model.voronoi && studio.state.redo === 0");
    tab.key("z", CTRL);
    tab.until("studio.state.redo === 1");
    check(&mut tab, "Z", CTRL | SHIFT, "studio.state.redo === 0");
    tab.key("z", CTRL);
    tab.until("studio.state.redo === 1 && !studio.state.busy && studio.state.hash");
    check(&mut tab, "p", 0, "studio.playback.isPlaying");
    tab.until("!studio.playback.isPlaying");
    tab.key("2", 0);
    tab.value("studio.tool.radius = 10");
    check(&mut tab, "]", 0, "Math.abs(studio.tool.radius - 12.5) < 1e-9");
    check(&mut tab, "[", 0, "Math.abs(studio.tool.radius - 10) < 1e-9");
    tab.key("7", 0);
    let at = tab.place(0, [30.0, 15.0]);
    tab.mouse("mouseMoved", at, "none", 0);
    check(
        &mut tab,
        "n",
        0,
        "studio.model.wells.length === 1 && studio.model.wells[0].kind === 'source'",
    );
    let at = tab.place(0, [60.0, 50.0]);
    tab.mouse("mouseMoved", at, "none", 0);
    check(
        &mut tab,
        "N",
        SHIFT,
        "studio.model.wells.length === 2 && studio.model.wells[1].kind === 'sink'",
    );
    tab.until("!studio.state.busy && studio.model.flow?.lines > 5");
    tab.frame();
    tab.keep_picture("wells.png");
    check(&mut tab, "Delete", 0, "studio.model.wells.length === 1");
    tab.key("4", 0);
    tab.until("studio.state.hasAtoms && studio.tools[4].atoms && !studio.state.busy");
    let place = tab.value(
        "(() => { const a = studio.tools[4].atoms; let best = 0, least = 1e9; \
         for (let i = 0; i < a.states.length; i++) { const d = Math.hypot(a.places[2*i] - 32768, a.places[2*i+1] - 45000); \
         if (d < least) { least = d; best = i; } } return [a.places[2*best]/65535*95, a.places[2*best+1]/65535*63]; })()",
    );
    let at = tab.place(0, [place[0].as_f64().unwrap(), place[1].as_f64().unwrap()]);
    tab.mouse("mouseMoved", at, "none", 0);
    check(&mut tab, "f", 0, "studio.tools[4].atoms.states.some((s) => s === 1)");
    seen.extend(["h".to_owned(), "Escape".to_owned()]);
    let names = tab.value("import('/keys.js').then((m) => m.KEYS.map((k) => k.key))");
    let names: Vec<String> = serde_json::from_value(names).unwrap();
    let missing: Vec<_> = names.iter().filter(|name| !seen.contains(name)).collect();
    assert!(missing.is_empty(), "keys that no check has pressed: {missing:?}");
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

#[test]
fn hands_zoom_move_and_change_the_window() {
    let folder = tempfile::tempdir().unwrap();
    let Some((_studio, mut tab)) = opened(folder.path(), "") else { return };
    let at = tab.place(0, [20.0, 20.0]);
    let zoom = tab.value("studio.views[0].zoom").as_f64().unwrap();
    tab.wheel(at, -100.0, 0);
    tab.until(&format!("studio.views[0].zoom > {zoom} * 1.1"));
    let there = tab.place(0, [20.0, 20.0]);
    assert!(
        (there[0] - at[0]).hypot(there[1] - at[1]) < 1.0,
        "what is under the pointer stays there"
    );
    let center = |tab: &mut Tab| tab.value("studio.views[0].center[0]").as_f64().unwrap();
    let before = center(&mut tab);
    tab.drag(&[at, [at[0] + 60.0, at[1]]], "middle", 0);
    assert!(center(&mut tab) < before - 1.0);
    let before = center(&mut tab);
    tab.drag(&[at, [at[0] + 60.0, at[1]]], "left", 0);
    assert!(center(&mut tab) < before - 1.0, "tool 1 moves the image");
    let window: Value = tab.value("studio.window");
    tab.drag(&[at, [at[0], at[1] + 80.0]], "right", 0);
    let other: Value = tab.value("studio.window");
    assert!(other[0].as_f64().unwrap() > window[0].as_f64().unwrap() + 20.0, "{window} {other}");
    let at = tab.place(0, [30.0, 10.0]);
    tab.mouse("mouseMoved", at, "none", 0);
    let told = tab.value("document.getElementById('place').textContent");
    assert!(told.as_str().unwrap().starts_with("sample 30.0, 10.0 · world 30.00, 10.00"), "{told}");
}

#[test]
fn a_volume_is_three_linked_slices() {
    let Some(mut tab) = Tab::open() else { return };
    let studio = Studio::empty();
    tab.go(&studio.address);
    tab.until("window.studio && studio.state && !document.getElementById('welcome').hidden");
    tab.keep_picture("welcome.png");
    tab.value("document.getElementById('scenes').value = 'sphere', document.getElementById('draw-scene').click()");
    tab.until("studio.model && studio.views.length === 3");
    tab.value("studio.do({ do: 'set', option: 'lattice.size', value: 14 })");
    tab.settle();
    tab.until("studio.views.every((v) => v.cells && v.cells.revision === studio.revision)");
    tab.frame();
    tab.keep_picture("volume.png");
    let picture = tab.picture();
    for view in 0..3 {
        let (low, high) = (tab.place(view, [0.0, 0.0]), tab.place(view, [95.0, 95.0]));
        let (low, high) = ([low[0], low[1].min(high[1])], [high[0], low[1].max(high[1])]);
        assert!(picture.count(low, high, is_blue) > 300, "cells in view {view}");
    }
    // the sphere's surface in space, in the colour of the first feature
    tab.value("studio.do({ do: 'set', option: 'features.features', value: 'edges' })");
    tab.until("studio.space.surface && studio.space.surface.count > 20 && !studio.state.busy");
    tab.keep_picture("space.png");
    let canvas = tab.value("(() => { const r = studio.space.canvas.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; })()");
    let [left, top, right, bottom]: [f64; 4] = serde_json::from_value(canvas).unwrap();
    let is_red = |[r, g, b]: [u8; 3]| {
        r > 90 && u32::from(r) > u32::from(g) + 40 && u32::from(r) > u32::from(b) + 40
    };
    let red = |tab: &mut Tab| tab.picture().count([left, top], [right, bottom], is_red);
    let before = red(&mut tab);
    assert!(before > 1000, "{before} pixels of the surface");
    let middle = [(left + right) / 2.0, (top + bottom) / 2.0];
    tab.drag(&[middle, [middle[0] + 150.0, middle[1]]], "left", 0);
    assert!(tab.value("studio.space.yaw").as_f64().unwrap() > 1.4);
    assert!(red(&mut tab) > 1000, "a sphere is seen from everywhere");
    tab.key("r", 0);
    tab.until("Math.abs(studio.space.yaw - 0.6) < 1e-9");
    let cross: Value = tab.value("studio.cross");
    assert_eq!(cross, json!([48, 48, 48]));
    let at = tab.place(0, [20.0, 70.0]);
    tab.mouse("mouseMoved", at, "none", SHIFT);
    tab.until("studio.cross[0] === 20 && studio.cross[1] === 70 && studio.cross[2] === 48");
    tab.wheel(at, -100.0, 0);
    tab.until("studio.cross[2] === 49");
    assert_eq!(tab.value("studio.views[0].label.textContent"), "z = 49");
    // an atom of the slice is dragged within it, and undone
    let before = tab.value("studio.state.hash");
    let undo = tab.value("studio.state.undo").as_u64().unwrap();
    tab.key("4", 0);
    tab.until("studio.tools[4].atoms && studio.state.hasAtoms && !studio.state.busy");
    let found = tab.value(
        "(() => { const t = studio.tools[4], v = studio.views[0]; let best = 0, least = 1e9; \
         for (let i = 0; i < t.atoms.states.length; i++) { if (!t.isIn(v, i)) continue; const s = t.sample(i); \
         const d = Math.hypot(s[0] - 24, s[1] - 24); if (d < least) { least = d; best = i; } } \
         return [best, ...t.sample(best)]; })()",
    );
    let atom = found[0].as_u64().unwrap();
    let sample: Vec<f64> = serde_json::from_value(json!([found[1], found[2], found[3]])).unwrap();
    let from = tab.place(0, [sample[0], sample[1]]);
    assert!(is_yellow(tab.picture().at(from)), "the atom is drawn");
    tab.drag(&[from, [from[0] + 8.0, from[1] + 4.0], [from[0] + 14.0, from[1] + 6.0]], "left", 0);
    tab.until(&format!(
        "studio.state.undo === {} && !studio.state.busy && studio.state.hasAtoms",
        undo + 1
    ));
    tab.keep_picture("volume-atoms.png");
    assert_ne!(tab.value("studio.state.hash"), before);
    let moved: Vec<f64> =
        serde_json::from_value(tab.value(&format!("studio.tools[4].sample({atom})"))).unwrap();
    assert!(
        moved[0] > sample[0] + 1.0 && (moved[2] - sample[2]).abs() < 0.01,
        "{sample:?} to {moved:?}"
    );
    tab.key("z", CTRL);
    tab.until(&format!("studio.state.undo === {undo} && !studio.state.busy && studio.state.hash"));
    assert_eq!(tab.value("studio.state.hash"), before);
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

#[test]
fn an_image_is_dropped_and_opened() {
    let Some(mut tab) = Tab::open() else { return };
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::empty();
    tab.go(&studio.address);
    tab.until("window.studio && studio.state && !document.getElementById('welcome').hidden");
    let bytes = std::fs::read(phantom(folder.path())).unwrap();
    tab.value(&format!("studio.open(new File([new Uint8Array({bytes:?})], 'phantom.png'))"));
    tab.settle();
    assert!(tab.value("studio.model.name").as_str().unwrap().ends_with("phantom.png"));
    tab.key("g", 0);
    let picture = tab.picture();
    assert_eq!(picture.at(tab.place(0, [5.0, 5.0])), [0, 0, 0]);
    // another of the same name and shape takes its place, and what was made of the first goes
    tab.value("studio.ask({ op: 'scene', name: 'disc', seed: 1 })");
    tab.settle();
    let first = tab.value("studio.views[0].slices.image.values.join()");
    tab.value("studio.ask({ op: 'scene', name: 'disc', seed: 2 })");
    tab.until(&format!(
        "studio.views[0].slices.image && studio.views[0].slices.image.values.join() !== {first}"
    ));
    tab.key("z", CTRL);
    tab.until(&format!(
        "studio.views[0].slices.image && studio.views[0].slices.image.values.join() === {first}"
    ));
    tab.key("z", CTRL);
    tab.until("studio.model.name.endsWith('phantom.png')");
    tab.value("studio.open(new File(['no image'], 'x.png'))");
    tab.until("document.getElementById('message').textContent.includes('x.png')");
    assert!(
        tab.value("studio.model.name").as_str().unwrap().ends_with("phantom.png"),
        "what was open stays"
    );
}

#[test]
fn facets_are_clicked() {
    let folder = tempfile::tempdir().unwrap();
    let Some((_studio, mut tab)) = opened(folder.path(), "[lattice]\nsize = 8.0") else { return };
    tab.key("6", 0);
    tab.until("studio.frames.facets && studio.frames.facets.first > 3");
    let closed = "studio.frames.facets.features.filter((f) => f < 65536).length";
    let before = tab.value(closed).as_u64().unwrap();
    let is_red = |[r, g, b]: [u8; 3]| r > 200 && g < 120 && b < 120;
    let (low, high) = (tab.place(0, [0.0, 0.0]), tab.place(0, [95.0, 63.0]));
    let red = tab.picture().count(low, high, is_red);
    assert!(red > 200, "barriers are drawn: {red}");
    tab.keep_picture("facets.png");
    let at = tab.place(0, [48.0, 32.0]);
    tab.drag(&[at], "left", 0);
    tab.until(&format!("{closed} === {}", before - 1));
    tab.drag(&[at], "left", 0);
    tab.until(&format!("{closed} === {before}"));
    tab.drag(&[at], "left", SHIFT);
    tab.until(&format!("{closed} < {} && !studio.state.busy", before - 1));
    assert!(tab.picture().count(low, high, is_red) < red);
}

#[test]
fn regions_are_painted_over_parts_and_are_there_after_a_reload() {
    let folder = tempfile::tempdir().unwrap();
    let Some(mut tab) = Tab::open() else { return };
    let studio = Studio::on_file(&image_file(folder.path()), "[lattice]\nsize = 4.0");
    tab.go(&studio.address);
    tab.settle();
    tab.key("g", 0);
    // the image's light grey is not as white as borders
    tab.value("(studio.window = [0, 400], studio.redraw())");
    tab.frame();
    let (low, high) = (tab.place(0, [0.0, 0.0]), tab.place(0, [63.0, 47.0]));
    let is_white = |[r, g, b]: [u8; 3]| r > 235 && g > 235 && b > 225;
    assert_eq!(tab.picture().count(low, high, is_white), 0);
    tab.key("5", 0);
    tab.until("studio.state.parts > 3 && !studio.state.busy && studio.views[0].regions");
    tab.frame();
    let white = tab.picture().count(low, high, is_white);
    assert!(white > 500, "borders of parts are drawn: {white}");
    tab.value("studio.tool.setCount(4)");
    tab.until("studio.state.parts === 4 && !studio.state.busy");
    tab.settle();
    tab.frame();
    let fewer = tab.picture().count(low, high, is_white);
    assert!(fewer < white, "fewer parts have fewer borders: {fewer}");
    // the first region is a warm red, the second green
    let is_warm = |[r, _, b]: [u8; 3]| r > b.saturating_add(30);
    let is_green = |[r, g, b]: [u8; 3]| g > r.saturating_add(15) && g > b;
    assert_eq!(tab.picture().count(low, high, is_warm), 0);
    let path = [[10.0, 10.0], [20.0, 9.0]].map(|sample| tab.place(0, sample));
    tab.drag(&path, "left", 0);
    let is_painted = "studio.model.regions.length === 1 && !studio.state.busy && \
                      studio.views[0].regions?.groups.length === 1";
    tab.until(is_painted);
    tab.frame();
    let warm = tab.picture().count(low, high, is_warm);
    assert!(warm > 2000, "the part is filled: {warm}");
    assert!(is_warm(tab.picture().at(tab.place(0, [14.0, 13.0]))));
    // another region, named
    select(&mut tab, "region", "2");
    tab.value(
        "(() => { const n = document.getElementById('region-name'); n.value = 'sand'; \
         n.dispatchEvent(new Event('change')); })()",
    );
    tab.until("studio.model.regionNames[1] === 'sand'");
    let at = tab.place(0, [50.0, 40.0]);
    tab.drag(&[at], "left", 0);
    tab.until("studio.model.regions.length === 2 && !studio.state.busy && studio.views[0].regions.groups.length === 2");
    tab.frame();
    assert!(tab.picture().count(low, high, is_green) > 500);
    tab.keep_picture("studio-regions.png");
    let legend = tab.value("document.getElementById('legend').textContent");
    assert!(legend.as_str().unwrap().contains("sand"), "{legend}");
    // reloaded, it is there
    let before = tab.value("studio.model.regions");
    tab.value("window.isOld = true");
    tab.call("Page.reload", json!({}));
    tab.until("document.readyState === 'complete' && !window.isOld && window.studio && studio.model?.regions.length === 2 && studio.views[0]?.regions?.groups.length === 2");
    assert_eq!(tab.value("studio.model.regions"), before);
    tab.settle();
    tab.frame();
    let (low, high) = (tab.place(0, [0.0, 0.0]), tab.place(0, [63.0, 47.0]));
    assert!(tab.picture().count(low, high, is_warm) > 2000);
    // and undone, it is not
    (0..3).for_each(|_| tab.key("z", CTRL));
    tab.until("studio.model.regions.length === 0 && !studio.state.busy && !studio.views[0].regions?.groups.length");
    tab.frame();
    assert_eq!(tab.picture().count(low, high, is_warm), 0);
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

#[test]
fn regions_of_a_volume_are_seen_on_slices_and_in_space() {
    let Some(mut tab) = Tab::open() else { return };
    let studio = Studio::empty();
    tab.go(&studio.address);
    tab.until("window.studio && studio.state && !document.getElementById('welcome').hidden");
    tab.value("studio.ask({ op: 'scene', name: 'sphere', seed: 0 })");
    tab.value("studio.do({ do: 'set', option: 'features.features', value: 'edges' })");
    tab.value("studio.do({ do: 'set', option: 'lattice.size', value: 14 })");
    tab.settle();
    tab.key("g", 0);
    tab.key("5", 0);
    tab.value("studio.tool.setCount(2)");
    tab.until("studio.state.parts === 2 && !studio.state.busy && studio.views[0].regions");
    let at = tab.place(0, [48.0, 48.0]);
    tab.drag(&[at], "left", 0);
    tab.until("studio.model.regions.length === 1 && !studio.state.busy && studio.views.every((v) => v.regions?.groups.length === 1)");
    tab.until("studio.space.surface?.count > 50");
    tab.frame();
    tab.keep_picture("regions-space.png");
    let is_warm = |[r, _, b]: [u8; 3]| r > b.saturating_add(30);
    let picture = tab.picture();
    for view in 0..3 {
        assert!(is_warm(picture.at(tab.place(view, [44.0, 52.0]))), "view {view}");
    }
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

/// Chooses an option of a list, as a hand would.
fn select(tab: &mut Tab, id: &str, value: &str) {
    tab.value(&format!(
        "(() => {{ const s = document.getElementById('{id}'); s.value = '{value}'; \
         s.dispatchEvent(new Event('change')); }})()"
    ));
}

#[test]
fn a_newcomer_follows_edges_paints_and_exports() {
    let Some(data) = std::env::var_os("ATOMESH_DATA") else {
        eprintln!("not tested on a real image: ATOMESH_DATA is not set");
        return;
    };
    let Some(mut tab) = Tab::open() else { return };
    let studio = Studio::on_file(&Path::new(&data).join("hale2001-fig11-torso.png"), "");
    tab.go(&studio.address);
    tab.settle();
    tab.keep_picture("torso-1.png");
    let before = tab.value("studio.state.hash");
    select(&mut tab, "kind", "edges");
    tab.until(&format!(
        "!studio.state.busy && studio.state.hash && studio.state.hash !== {before}"
    ));
    tab.key("b", 0);
    tab.until("studio.views[0].slices.potential");
    tab.keep_picture("torso-2.png");
    tab.key("b", 0);
    tab.key("2", 0);
    let shape: Vec<f64> = serde_json::from_value(tab.value("studio.shape")).unwrap();
    for (x, y) in [(0.3, 0.45), (0.7, 0.45)] {
        let undo = tab.value("studio.state.undo").as_u64().unwrap();
        let path = [(x - 0.05, y), (x, y + 0.05), (x + 0.05, y)];
        let path = path.map(|(x, y)| tab.place(0, [x * shape[0], y * shape[1]]));
        tab.drag(&path, "left", 0);
        tab.until(&format!(
            "studio.state.undo === {} && !studio.state.busy && studio.state.figures",
            undo + 1
        ));
    }
    tab.keep_picture("torso-3.png");
    select(&mut tab, "format", "inp");
    tab.value("document.getElementById('export').click()");
    tab.until("document.getElementById('message').textContent.startsWith('Written as mesh.inp')");
    let written = std::fs::read_to_string(studio.folder.join("mesh.inp")).unwrap();
    assert!(written.contains("*NODE") && written.contains("*ELEMENT"), "{}", &written[..200]);
    tab.value("document.getElementById('copy').click()");
    tab.until("!document.getElementById('command').hidden");
    tab.value("document.getElementById('command').scrollIntoView()");
    tab.keep_picture("torso-4.png");
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

/// Pictures for the document, kept where the environment asks for them; what they show is asserted by other scenes.
#[test]
fn the_document_shows_the_page() {
    let Some(mut tab) = Tab::open() else { return };
    let studio = Studio::empty();
    tab.go(&studio.address);
    tab.until("window.studio && studio.state && !document.getElementById('welcome').hidden");
    tab.value("studio.ask({ op: 'scene', name: 'faults', seed: 0 })");
    tab.settle();
    tab.value("studio.do({ do: 'set', option: 'lattice.size', value: 10 })");
    tab.value("studio.do({ do: 'set', option: 'lattice.beta', value: 0.3 })");
    tab.settle();
    tab.key("7", 0);
    let at = tab.place(0, [60.0, 60.0]);
    tab.mouse("mouseMoved", at, "none", 0);
    tab.key("n", 0);
    tab.until("studio.model.wells.length === 1");
    let at = tab.place(0, [200.0, 200.0]);
    tab.mouse("mouseMoved", at, "none", 0);
    tab.key("N", SHIFT);
    let told = "studio.model.wells.length === 2 && !studio.state.busy && studio.model.flow && \
                (studio.model.flow.lines > 5 || studio.model.flow.notes.length > 0)";
    tab.until(told);
    // faults may part the two: the sink is moved until they do not
    for place in [[90, 60], [60, 110], [110, 110], [30, 30]] {
        if tab.value("studio.model.flow.lines") != 0 {
            break;
        }
        tab.value(&format!("studio.do({{ do: 'move-well', well: 1, to: {place:?} }})"));
        tab.until(&format!("studio.model.wells[1].at[0] === {} && {told}", place[0]));
    }
    tab.until("studio.model.flow.lines > 5 && studio.frames.flow?.second > 5");
    tab.keep_picture("studio-flow.png");
    assert_eq!(tab.complaints(), Vec::<String>::new());
}
