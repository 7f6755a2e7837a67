//! What is done over the protocol: it shows, is undone, survives a kill, and is exported as the command would have it.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command as Process, Stdio};

use atomesh::watch::Silent;
use atomesh_job::mesh::{MeshFileOptions, mesh_file};
use atomesh_job::options::RunConfig;
use atomesh_studio::protocol::{Command, Numbered};
use atomesh_studio::replay::replay;
use atomesh_studio::{Server, Session};
use clap::{Args, FromArgMatches};
use serde_json::{Value, json};

use super::client::{Page, Studio, TIME, image_file};

const OPTIONS: &str = "[lattice]\nsize = 6.0\n";

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// Shows atoms, and waits for them.
fn show_atoms(page: &mut Page) {
    page.must(json!({ "op": "atoms", "shown": true }));
    page.until(|state| state["busy"] == false && state["hasAtoms"] == true);
}

/// An atom about the middle of the image, and its place in samples.
fn middle_atom(page: &mut Page) -> (u32, [f64; 2]) {
    let frame = page.atoms();
    let count = u32_at(&frame, 8) as usize;
    let place = |i: usize| -> [f64; 2] {
        let at = |k| f64::from(u16::from_le_bytes([frame[k], frame[k + 1]])) / 65535.0;
        [at(16 + 8 * i) * 63.0, at(18 + 8 * i) * 47.0]
    };
    let off = |p: [f64; 2]| (p[0] - 30.0).hypot(p[1] - 28.0);
    let nearest = (0..count).min_by(|&a, &b| off(place(a)).total_cmp(&off(place(b)))).unwrap();
    (nearest as u32, place(nearest))
}

/// The words of a command line without quotes.
fn words(line: &str) -> Vec<String> {
    line.split(' ').map(|word| word.trim_matches('\'').to_owned()).collect()
}

/// What the page exports.
fn exported(studio: &Studio, cookie: &str, format: &str) -> Vec<u8> {
    let origin = format!("http://{}", studio.host());
    let headers = [("Cookie", cookie), ("Origin", origin.as_str())];
    let answer = studio.request("POST", &format!("/file/export?format={format}"), &headers, "");
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert!(answer.header("content-disposition").unwrap().contains("attachment"));
    answer.body
}

/// The options that a copied command has, read as the command reads them.
fn run_of(line: &str, output: &Path) -> RunConfig {
    let words = words(line);
    assert_eq!(words[..2], ["atomesh", "mesh"]);
    let matches =
        RunConfig::augment_args(clap::Command::new("mesh")).try_get_matches_from(&words[1..]);
    let mut run = RunConfig::from_arg_matches(&matches.unwrap()).unwrap();
    run.output.output = Some(output.into());
    run
}

#[test]
fn an_export_is_what_the_copied_command_writes() {
    let folder = tempfile::tempdir().unwrap();
    let image = image_file(folder.path());
    let studio = Studio::on_file(&image, OPTIONS);
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    page.settle();
    let stroke = |field: &str, value: f64| {
        json!({ "do": "paint", "field": field, "value": value, "radius": 9.0,
                "path": [[10.0, 10.0], [30.0, 14.0]] })
    };
    let set = json!({ "do": "set", "option": "lattice.beta", "value": 0.3 });
    let gestures = [set, stroke("size", 3.0), stroke("weight", 0.9)];
    let mut last = page.hash();
    for gesture in gestures {
        page.act(gesture.clone());
        let hash = page.hash();
        assert_ne!(hash, last, "{gesture} changes the mesh");
        last = hash;
        for format in ["vtu", "inp"] {
            let bytes = exported(&studio, &cookie, format);
            let line =
                page.must(json!({ "op": "command-line" }))["text"].as_str().unwrap().to_owned();
            let output = folder.path().join(format!("command.{format}"));
            let run = run_of(&line, &output);
            let mut watch = Silent;
            let mut session = atomesh_job::Session::new(&mut watch);
            mesh_file(run, &MeshFileOptions::default(), &mut session).unwrap();
            assert!(bytes == std::fs::read(&output).unwrap(), "{line}");
            let again = folder.path().join(format!("replayed.{format}"));
            replay(&studio.folder.join("log.jsonl"), &again, &mut Silent).unwrap();
            assert!(bytes == std::fs::read(&again).unwrap(), "replay of {line}");
        }
    }
}

#[test]
fn a_change_of_any_stage_gives_what_a_new_session_gives() {
    let folder = tempfile::tempdir().unwrap();
    let image = image_file(folder.path());
    let studio = Studio::on_file(&image, OPTIONS);
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    page.settle();
    for (option, value) in [
        ("improve.min-angle", json!(25.0)),
        ("lattice.beta", json!(0.6)),
        ("features.features", json!("edges")),
        ("lattice.size", json!("4..9")),
        ("features.features", json!("dark")),
        ("lattice.mesh", json!("voronoi")),
        ("lattice.mesh", Value::Null),
        ("optimize.seed", json!(3)),
        ("lattice.size", json!(7.0)),
    ] {
        page.act(json!({ "do": "set", "option": option, "value": value }));
        let hash = page.hash();
        let all = page.state["model"]["options"].clone();
        let mut run: RunConfig = serde_json::from_value(all).unwrap();
        run.input.image = Some(image.clone());
        let fresh = Studio::on_file(&image, &run.to_toml().unwrap());
        let own = fresh.cookie();
        assert_eq!(fresh.page(&own).hash(), hash, "{option} = {value}");
    }
}

#[test]
fn an_atom_is_dragged_and_those_beyond_reach_stay() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::on_file(&image_file(folder.path()), "[lattice]\nsize = 3.0");
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    show_atoms(&mut page);
    let before = page.hash();
    let (atom, from) = middle_atom(&mut page);
    let to = [from[0] + 2.0, from[1] + 1.5];
    let revision = page.state["atomsRevision"].clone();
    page.must(json!({ "op": "drag", "atom": atom, "to": to, "reach": 5.0, "revision": revision }));
    let frame = page.frame(3, revision.as_u64().unwrap());
    let moves = u32_at(&frame, 8) as usize;
    let moved: Vec<u32> = (0..moves).map(|i| u32_at(&frame, 16 + 8 * i)).collect();
    assert!(moved.contains(&atom) && moves > 3, "{moves} follow");
    let atoms = page.atoms();
    for i in 0..moves {
        let old = 16 + 8 * moved[i] as usize;
        let x = f64::from(u16::from_le_bytes([atoms[old], atoms[old + 1]])) / 65535.0 * 63.0;
        let y = f64::from(u16::from_le_bytes([atoms[old + 2], atoms[old + 3]])) / 65535.0 * 47.0;
        // the reach of 5 edges, and the step that its middle was moved
        assert!((x - to[0]).hypot(y - to[1]) < 15.0 + 0.1, "atom {} at {x},{y}", moved[i]);
    }
    page.change(json!({ "op": "drop" }));
    assert_ne!(page.hash(), before);
    page.until(|state| state["hasAtoms"] == true);
    page.change(json!({ "op": "undo" }));
    assert_eq!(page.hash(), before);
    page.change(json!({ "op": "redo" }));
    assert_ne!(page.hash(), before);
}

#[test]
fn refused_edits_say_why_and_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::on_file(&image_file(folder.path()), OPTIONS);
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    show_atoms(&mut page);
    let (atom, place) = middle_atom(&mut page);
    page.act(json!({ "do": "pin", "atom": atom, "pinned": true }));
    show_atoms(&mut page);
    let hash = page.hash();
    let counts = (page.state["undo"].clone(), page.state["redo"].clone());
    for (gesture, why) in [
        (json!({ "do": "remove", "atom": 0 }), "corner"),
        (json!({ "do": "remove", "atom": atom }), "pinned"),
        (json!({ "do": "remove", "atom": 99999 }), "no atom"),
        (json!({ "do": "move", "atom": atom, "path": [[1.0, 2.0]], "reach": 5.0 }), "pinned"),
        (json!({ "do": "move", "atom": 1, "path": [[1.0, 2.0]], "reach": 5000.0 }), "reach"),
        (json!({ "do": "move", "atom": 1, "path": [[1.0, 2.0, 3.0]], "reach": 5.0 }), "3 numbers"),
        (
            json!({ "do": "paint", "field": "weight", "value": 2.0, "radius": 5.0, "path": [[1.0, 2.0]] }),
            "0 to 1",
        ),
        (
            json!({ "do": "paint", "field": "size", "value": 2.0, "radius": 0.0, "path": [[1.0, 2.0]] }),
            "radius",
        ),
        (json!({ "do": "set", "option": "lattice.size", "value": "cat" }), "lattice.size"),
        (json!({ "do": "set", "option": "lattice.lattice", "value": "bcc" }), "axes"),
        (json!({ "do": "remove-well", "well": 0 }), "no well"),
        (json!({ "do": "facet", "at": place, "whole": false, "multiplier": 2.0 }), "0 to 1"),
    ] {
        let answer = page.ask(json!({ "op": "do", "gesture": gesture }));
        let refused = answer["refused"].as_str().unwrap_or_else(|| panic!("{gesture}"));
        assert!(refused.contains(why), "{gesture}: {refused}");
    }
    let late = json!({ "op": "drag", "atom": 1, "to": [1.0, 2.0], "reach": 5.0, "revision": 0 });
    assert!(page.ask(late)["refused"].as_str().unwrap().contains("changed since"));
    assert_eq!(page.hash(), hash);
    assert_eq!((page.state["undo"].clone(), page.state["redo"].clone()), counts);
}

/// Gestures of all kinds, in an order that a seed gives.
fn gestures(count: usize, atoms: u32) -> Vec<Value> {
    let mut seed = 1_u64;
    let mut random = move |below: u64| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) % below
    };
    (0..count)
        .map(|i| {
            let at = [random(620) as f64 / 10.0 + 0.5, random(460) as f64 / 10.0 + 0.5];
            let atom = random(u64::from(atoms)) as u32;
            match (i % 100, random(5)) {
                (50, _) => json!({ "do": "paint", "field": "size", "value": 4.0, "radius": 6.0, "path": [at] }),
                (_, 0) => json!({ "do": "add", "at": at }),
                (_, 1) => json!({ "do": "remove", "atom": atom }),
                (_, 2) => json!({ "do": "pin", "atom": atom, "pinned": random(2) == 0 }),
                (_, 3) => json!({ "do": "well", "kind": "source", "at": at }),
                _ => json!({ "do": "move", "atom": atom, "path": [at], "reach": 3.0 }),
            }
        })
        .collect()
}

#[test]
fn a_thousand_gestures_are_undone_and_redone_to_the_same_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let image = image_file(folder.path());
    let path = folder.path().join("session");
    let mut session = Session::open(&path, &mut Silent).unwrap();
    let mut run = RunConfig::parse(OPTIONS).unwrap();
    run.input.image = Some(image);
    session.open_file(run, &mut Silent).unwrap();
    let mut done = 0;
    for gesture in gestures(1600, 90) {
        let gesture = serde_json::from_value(gesture).unwrap();
        // what an atom's place or a pin refuses is no gesture
        done += usize::from(session.act(gesture, &mut Silent).is_ok());
        if done == 1000 {
            break;
        }
    }
    assert_eq!(done, 1000);
    let export = |session: &mut Session, name: &str| {
        let path = folder.path().join(name);
        session.write(&path, &mut Silent).unwrap();
        std::fs::read(path).unwrap()
    };
    let all = export(&mut session, "all.vtu");
    for _ in 0..600 {
        session.undo(&mut Silent).unwrap();
    }
    let middle = export(&mut session, "middle.vtu");
    for _ in 0..400 {
        session.undo(&mut Silent).unwrap();
    }
    assert!(session.undo(&mut Silent).is_err(), "the image stays");
    assert_eq!(session.counts(), [0, 1000]);
    for _ in 0..400 {
        session.redo(&mut Silent).unwrap();
    }
    assert!(export(&mut session, "again.vtu") == middle);
    for _ in 0..600 {
        session.redo(&mut Silent).unwrap();
    }
    assert!(export(&mut session, "last.vtu") == all);
    drop(session);
    let replayed = folder.path().join("replayed.vtu");
    replay(&path.join("log.jsonl"), &replayed, &mut Silent).unwrap();
    assert!(std::fs::read(replayed).unwrap() == all, "as the log has it");
}

#[test]
fn a_stalled_page_keeps_memory_flat_and_gets_the_newest() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::on_file(&image_file(folder.path()), OPTIONS);
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    let mut stalled = studio.page(&cookie);
    stalled.acknowledges = false;
    page.settle();
    for i in 0..20 {
        page.act(
            json!({ "do": "set", "option": "lattice.beta", "value": 0.3 + 0.01 * f64::from(i) }),
        );
    }
    let hash = page.hash();
    // it was sent one frame of each kind, and no second before it says that it has the first
    stalled.socket.get_ref().set_read_timeout(Some(std::time::Duration::from_millis(300))).unwrap();
    let mut count = 0;
    while let Ok(message) = stalled.socket.read() {
        count += usize::from(message.is_text() || message.is_binary());
    }
    assert!(count <= 7, "{count} messages of 7 kinds");
    let mut late = studio.page(&cookie);
    assert_eq!(late.hash(), hash, "who comes late is shown the newest");
}

#[test]
fn facets_are_closed_and_opened_and_flow_follows() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::on_file(&image_file(folder.path()), OPTIONS);
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    page.settle();
    page.act(json!({ "do": "well", "kind": "source", "at": [10.0, 10.0] }));
    page.act(json!({ "do": "well", "kind": "sink", "at": [10.0, 40.0] }));
    let flows =
        |state: &Value| state["model"]["flow"]["lines"].as_u64().is_some_and(|lines| lines > 5);
    page.until(|state| state["busy"] == false && flows(state));
    let rates = page.state["model"]["flow"]["rates"].clone();
    assert!(
        (rates[0].as_f64().unwrap() - 1.0).abs() < 1e-9 && rates[1].as_f64().unwrap() < 0.0,
        "{rates}"
    );
    assert!(page.state["model"]["flow"]["imbalance"].as_f64().unwrap() < 1e-9);
    let closed = |page: &mut Page| {
        let revision = page.state["revision"].as_u64().unwrap();
        let frame = page.frame(4, revision);
        let count = u32_at(&frame, 8) as usize;
        (0..count).filter(|i| u32_at(&frame, 24 + 12 * i) < 1 << 16).count()
    };
    let before = closed(&mut page);
    assert!(before > 3, "the facets of features are barriers: {before}");
    page.act(json!({ "do": "facet", "at": [20.0, 20.0], "whole": true, "multiplier": 1.0 }));
    page.until(|state| state["busy"] == false && flows(state));
    assert!(closed(&mut page) < before);
    page.change(json!({ "op": "undo" }));
    page.until(|state| state["busy"] == false && flows(state));
    assert_eq!(closed(&mut page), before);
    page.act(json!({ "do": "facet", "at": [55.0, 40.0], "whole": false, "multiplier": 0.0 }));
    page.until(|state| state["busy"] == false && flows(state));
    assert_eq!(closed(&mut page), before + 1);
    page.act(json!({ "do": "remove-well", "well": 1 }));
    page.until(|state| state["busy"] == false && state["model"]["flow"]["lines"] == 0);
}

#[test]
fn a_volume_is_shown_by_slices_of_its_cells() {
    let studio = Studio::empty();
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    page.change(json!({ "op": "scene", "name": "sphere", "seed": 0 }));
    page.act(json!({ "do": "set", "option": "lattice.size", "value": 16.0 }));
    page.settle();
    assert_eq!(page.state["model"]["dimension"], 3);
    let get = |path: &str| studio.request("GET", path, &[("Cookie", &cookie)], "");
    for axis in 0..3 {
        for at in [0, 40, 95] {
            let cells = get(&format!("/view/cells?axis={axis}&at={at}"));
            assert_eq!((cells.status, cells.body[0]), (200, 1), "{axis} {at}");
            assert!(u32_at(&cells.body, 12) > 20, "{axis} {at}");
        }
        for what in ["image", "potential", "distance", "weight"] {
            let slice = get(&format!("/view/slice?what={what}&axis={axis}&at=40"));
            assert_eq!(slice.body.len(), 16 + 4 * 96 * 96, "{what}");
        }
    }
    let mesh = exported(&studio, &cookie, "vtu");
    assert!(mesh.len() > 10_000);
}

#[test]
fn mangled_commands_are_refused_or_done_and_never_end_the_studio() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session");
    let mut session = Session::open(&path, &mut Silent).unwrap();
    let mut run = RunConfig::parse("[lattice]\nsize = 12.0").unwrap();
    run.input.image = Some(image_file(folder.path()));
    session.open_file(run, &mut Silent).unwrap();
    let mut seed = 7_u64;
    let mut random = move |below: usize| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as usize % below
    };
    let parts = [
        "0",
        "-1",
        "1e999",
        "1e300",
        "-1e-300",
        "null",
        "4294967295",
        "\"\"",
        "[]",
        "[[]]",
        "[[1,2]]",
        "[1,2]",
        "[1,2,3]",
        "true",
        "\"size\"",
        "\"weight\"",
        "\"move\"",
        "\"add\"",
        "{",
        "}",
        ",",
        "\u{0}",
    ];
    let (mut read, mut done) = (0, 0);
    for gesture in gestures(3000, 40) {
        let mut text =
            json!({ "seq": 1, "command": { "op": "do", "gesture": gesture } }).to_string();
        for _ in 0..random(3) {
            let (from, part) = (random(text.len()), parts[random(parts.len())]);
            let to = (from + random(6)).min(text.len());
            if text.is_char_boundary(from) && text.is_char_boundary(to) {
                text.replace_range(from..to, part);
            }
        }
        let Ok(numbered) = Numbered::parse(&text) else { continue };
        read += 1;
        let Command::Do { gesture } = numbered.command else { continue };
        let before = session.counts();
        match session.act(gesture, &mut Silent) {
            Ok(()) => {
                done += 1;
                session.undo(&mut Silent).unwrap();
                assert_eq!(session.counts()[0], before[0], "{text}");
            }
            Err(_) => assert_eq!(session.counts(), before, "{text}"),
        }
    }
    assert!(read > 1000 && read < 3000 && done > 300, "{read} read, {done} done");
}

/// The folder that the child serves a session in.
const CHILD: &str = "ATOMESH_STUDIO_CHILD";

#[test]
#[ignore = "is the process that the next test kills"]
fn serves_until_it_is_killed() {
    let Some(folder) = std::env::var_os(CHILD) else { return };
    let session = Session::open(&Path::new(&folder).join("session"), &mut Silent).unwrap();
    let server = Server::new(session, std::time::Duration::from_secs(60)).unwrap();
    println!("\nserves {}", server.address());
    server.run(|| false).unwrap();
}

#[test]
fn a_kill_loses_at_most_the_gesture_under_way() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session");
    let mut session = Session::open(&path, &mut Silent).unwrap();
    let mut run = RunConfig::parse(OPTIONS).unwrap();
    run.input.image = Some(image_file(folder.path()));
    session.open_file(run, &mut Silent).unwrap();
    drop(session);
    let mut child = Process::new(std::env::current_exe().unwrap())
        .args(["edits::serves_until_it_is_killed", "--exact", "--ignored", "--nocapture"])
        .env(CHILD, folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
    let address = lines.find_map(|line| line.strip_prefix("serves ").map(str::to_owned)).unwrap();
    let studio = Studio::of_address(&address, &path);
    let cookie = studio.cookie();
    let mut page = studio.page(&cookie);
    let stroke = |y: f64| json!({ "do": "paint", "field": "weight", "value": 0.8, "radius": 4.0, "path": [[8.0, y], [50.0, y]] });
    (0..5).for_each(|y| page.act(stroke(5.0 * f64::from(y))));
    // strokes under way, of which nobody knows how far they came
    for y in 0..20 {
        page.send(&json!({ "op": "do", "gesture": stroke(2.0 * f64::from(y)) }), 1000 + y);
    }
    child.kill().unwrap(); // SIGKILL
    child.wait().unwrap();
    let session = Session::open(&path, &mut Silent).unwrap();
    let [done, taken_back] = session.counts();
    assert!((5..=25).contains(&done) && taken_back == 0, "{done} strokes");
    drop(session);
    let again = Studio::serve(Session::open(&path, &mut Silent).unwrap(), TIME);
    let own = again.cookie();
    assert_eq!(again.page(&own).hash().len(), 16, "and goes on");
}
