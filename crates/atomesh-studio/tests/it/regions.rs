//! Regions painted over the protocol and in a session: they show, survive edits and are exported; layers of a volume are
//! painted by a script of a few strokes.

use std::path::Path;

use atomesh::geometry::Point;
use atomesh::region::CellFinder;
use atomesh::synth::{Layers, Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use atomesh_job::mesh_file::{self, MeshFile};
use atomesh_job::options::RunConfig;
use atomesh_studio::Session;
use atomesh_studio::log::Source;
use atomesh_studio::replay::replay;
use serde_json::{Value, json};

use super::client::image_file;

/// Samples along each axis of the volume.
const SIDE: usize = 96;

fn act(session: &mut Session, gesture: Value) {
    let text = gesture.to_string();
    let gesture = serde_json::from_value(gesture).unwrap();
    session.act(gesture, &mut Silent).unwrap_or_else(|e| panic!("{text}: {e}"));
}

/// Which layer each sample is in: the number of horizons above it.
fn layers_of_samples(layers: &Layers<3>) -> Vec<usize> {
    let at = |i: usize| [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|x| x as f64);
    (0..SIDE * SIDE * SIDE)
        .map(|i| layers.horizons.partition_point(|age| *age <= layers.age(&at(i))))
        .collect()
}

/// The six layers whose horizons are farthest apart, of those that lie in the box for the most part; in the order of depth.
fn thickest(layers: &Layers<3>, of_samples: &[usize]) -> Vec<usize> {
    let mut counts = vec![0_usize; layers.horizons.len() + 1];
    of_samples.iter().for_each(|layer| counts[*layer] += 1);
    let mut inside: Vec<(f64, usize)> = (1..layers.horizons.len())
        .map(|layer| (layers.horizons[layer] - layers.horizons[layer - 1], layer))
        .filter(|(thickness, layer)| counts[*layer] as f64 > 0.9 * thickness * (SIDE * SIDE) as f64)
        .collect();
    inside.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<usize> = inside.into_iter().take(6).map(|(_, layer)| layer).collect();
    chosen.sort_unstable();
    chosen
}

/// Strokes along a layer at a depth within it, as a share of its thickness, up and down by another share: a polyline on each of
/// five slices normal to y. Where faults cut the layer the hand follows it to the other side.
fn strokes(layers: &Layers<3>, layer: usize, depth: f64, swing: f64) -> Vec<Value> {
    let (top, bottom) = (layers.horizons[layer - 1], layers.horizons[layer]);
    let place = |x: usize, y: usize| -> Option<Value> {
        let turn = if (x / APART).is_multiple_of(2) { swing } else { -swing };
        let age = top + (depth + turn) * (bottom - top);
        let off = |z: usize| (layers.age(&[x as f64, y as f64, z as f64]) - age).abs();
        let z = (0..SIDE).min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
        (off(z) < 1.0).then(|| json!([x, y, z]))
    };
    let along =
        |y: usize| (0..SIDE).step_by(APART).chain([SIDE - 1]).filter_map(|x| place(x, y)).collect();
    (0..5).map(|i| along(8 + 20 * i)).collect()
}

/// The brush's radius.
const RADIUS: f64 = 1.5;

/// Samples from one place of a stroke to the next.
const APART: usize = 4;

/// Dice's coefficient of each layer and its region: 2 |A ∩ B| / (|A| + |B|), by samples.
fn dice(path: &Path, layers: &[usize], of_samples: &[usize]) -> Vec<f64> {
    let mut watch = Silent;
    let file = mesh_file::read(path, &mut atomesh_job::Session::new(&mut watch)).unwrap();
    let MeshFile::Volume(loaded) = file else { panic!("a volume has tetrahedra") };
    let regions = &loaded.tags.regions().unwrap().of_cells;
    let samples: Vec<Point<3>> = (0..of_samples.len())
        .map(|i| [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|x| x as f64))
        .collect();
    let found = CellFinder::of_mesh(&loaded.mesh).carried(regions, &samples);
    let of = |region: usize, layer: usize| {
        let (mut both, mut sum) = (0, 0);
        for (own, found) in of_samples.iter().zip(&found) {
            let (a, b) = (*own == layer, *found == region as i32);
            both += usize::from(a && b);
            sum += usize::from(a) + usize::from(b);
        }
        2.0 * both as f64 / sum as f64
    };
    layers.iter().enumerate().map(|(i, layer)| of(i + 1, *layer)).collect()
}

/// Six layers of a volume, painted by 51 gestures at places that a hand would choose. Each of these layers lies between a dark
/// and a bright horizon: what two of them hold is painted on a mesh that follows dark ones, and parted on one that follows
/// bright ones, each stroke over the one region that it is about.
///
/// What is reached is a snapshot, by samples: a mean of 0.8. Borders are right to a tenth of a sample; what is missed are
/// parts that no stroke touches, and what is too much are parts that reach through gaps where faults cut horizons.
#[test]
#[ignore = "minutes"]
fn layers_are_painted_by_a_few_strokes() {
    const LEVEL: usize = 400;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session");
    let options = SynthOptions { seed: 3, ..SynthOptions::new([SIDE; 3]) };
    let layers = synthesize(Scene::Layers, &options).unwrap().truth.layers.unwrap();
    let of_samples = layers_of_samples(&layers);
    let chosen = thickest(&layers, &of_samples);
    let mut session = Session::open(&path, &mut Silent).unwrap();
    let options = "[lattice]\nsize = 5.0\n[features]\nfeatures = \"horizons\"\npolarity = \"dark\"\n\
                   high = 0.25\nlow = 0.1\n";
    let source = Source::Scene { name: "layers".into(), seed: 3 };
    let run = RunConfig::parse(options).unwrap();
    session.open_image(source, run, &mut Silent).unwrap();
    let mut count = 0;
    let mut paint = |session: &mut Session, region: usize, over: Option<usize>, layer: usize| {
        for path in strokes(&layers, layer, 0.5, 0.3) {
            let stroke = json!({ "do": "region", "region": region, "radius": RADIUS, "path": path, "parts": LEVEL, "over": over });
            act(session, stroke);
            count += 1;
        }
    };
    for (region, i) in [(1, 0), (2, 1), (2, 2), (4, 3), (5, 4), (5, 5)] {
        paint(&mut session, region, None, chosen[i]);
    }
    let bright = json!({ "do": "set", "option": "features.polarity", "value": "bright" });
    act(&mut session, bright);
    let beyond =
        [(0, 1, chosen[0] + 1), (3, 2, chosen[2]), (0, 4, chosen[3] + 1), (6, 5, chosen[5])];
    for (region, over, layer) in beyond {
        paint(&mut session, region, Some(over), layer);
    }
    assert!(count < 60, "{count} strokes");
    let file = folder.path().join("mesh.vtu");
    session.write(&file, &mut Silent).unwrap();
    let found = dice(&file, &chosen, &of_samples);
    let mean = found.iter().sum::<f64>() / 6.0;
    println!("Dice {found:.3?}, mean {mean:.3}");
    assert!(mean > 0.75, "{found:?}");
    drop(session);
    let again = folder.path().join("again.vtu");
    replay(&path.join("log.jsonl"), &again, &mut Silent).unwrap();
    assert!(std::fs::read(&file).unwrap() == std::fs::read(&again).unwrap(), "as the log has it");
}

/// A session on a small image of two crossing lines.
fn small(folder: &Path, options: &str) -> Session {
    let mut session = Session::open(&folder.join("session"), &mut Silent).unwrap();
    let mut run = RunConfig::parse(options).unwrap();
    run.input.image = Some(image_file(folder));
    session.open_file(run, &mut Silent).unwrap();
    session
}

/// The exported bytes.
fn exported(session: &mut Session, folder: &Path, name: &str) -> Vec<u8> {
    let path = folder.join(name);
    session.write(&path, &mut Silent).unwrap();
    std::fs::read(path).unwrap()
}

/// How many cells each region has, by its name, from an exported file.
fn cells_of_regions(session: &mut Session, folder: &Path) -> Vec<(String, usize)> {
    let path = folder.join("counted.vtu");
    session.write(&path, &mut Silent).unwrap();
    let mut watch = Silent;
    let file = mesh_file::read(&path, &mut atomesh_job::Session::new(&mut watch)).unwrap();
    let MeshFile::Flat(loaded) = file else { panic!("an image has triangles") };
    let Some(regions) = loaded.tags.regions() else { return Vec::new() };
    let count = |id: i32| regions.of_cells.iter().filter(|own| **own == id).count();
    regions.ids().into_iter().map(|id| (regions.name(id), count(id))).collect()
}

fn stroke(region: u32, path: Value, parts: Option<usize>) -> Value {
    json!({ "do": "region", "region": region, "radius": 0.0, "path": path, "parts": parts })
}

#[test]
fn regions_are_undone_redone_replayed_and_exported_with_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut session = small(folder, "[lattice]\nsize = 5.0\n");
    let before = exported(&mut session, folder, "before.vtu");
    act(&mut session, stroke(1, json!([[10.0, 10.0]]), Some(4)));
    act(&mut session, stroke(2, json!([[55.0, 40.0]]), Some(4)));
    act(&mut session, json!({ "do": "name-region", "region": 2, "name": "sand" }));
    act(&mut session, stroke(2, json!([[10.0, 10.0], [12.0, 10.0]]), None));
    act(&mut session, stroke(0, json!([[50.0, 42.0]]), None));
    for format in ["vtu", "msh", "msh2", "inp", "vtk", "npz"] {
        let bytes = exported(&mut session, folder, &format!("all.{format}"));
        if ["inp", "msh", "msh2"].contains(&format) {
            let text = String::from_utf8_lossy(&bytes);
            assert!(
                ["sand", "region-1", "rest"].iter().all(|name| text.contains(name)),
                "{format}"
            );
        }
        let again = folder.join(format!("again.{format}"));
        replay(&folder.join("session/log.jsonl"), &again, &mut Silent).unwrap();
        assert!(bytes == std::fs::read(&again).unwrap(), "replayed as {format}");
    }
    let names: Vec<String> =
        cells_of_regions(&mut session, folder).into_iter().map(|r| r.0).collect();
    assert_eq!(names, ["rest", "region-1", "sand"]);
    let all = exported(&mut session, folder, "all.vtu");
    (0..5).for_each(|_| session.undo(&mut Silent).unwrap());
    assert!(exported(&mut session, folder, "undone.vtu") == before);
    (0..5).for_each(|_| session.redo(&mut Silent).unwrap());
    assert!(exported(&mut session, folder, "redone.vtu") == all);
}

#[test]
fn regions_go_with_their_atoms_and_stay_when_atoms_are_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut session = small(folder, "[lattice]\nsize = 5.0\n");
    // the level of two parts and more: what is left above of the line across
    act(&mut session, stroke(1, json!([[12.0, 10.0], [30.0, 10.0]]), Some(4)));
    let painted = cells_of_regions(&mut session, folder);
    let share = |cells: &[(String, usize)]| {
        let own = cells.iter().find(|(name, _)| name == "region-1").unwrap().1;
        own as f64 / cells.iter().map(|(_, count)| count).sum::<usize>() as f64
    };
    let whole = share(&painted);
    assert!((0.1..0.6).contains(&whole), "{painted:?}");
    // atoms that are moved, added and removed inside the region leave its outline where it is
    act(&mut session, json!({ "do": "add", "at": [20.0, 8.0] }));
    act(&mut session, json!({ "do": "move", "atom": 60, "path": [[22.0, 12.0]], "reach": 2.0 }));
    let edited = share(&cells_of_regions(&mut session, folder));
    assert!((edited - whole).abs() < 0.05, "{whole} {edited}");
    // other atoms altogether
    for (option, value) in [
        ("lattice.size", json!(3.5)),
        ("lattice.mesh", json!("voronoi")),
        ("lattice.mesh", Value::Null),
    ] {
        act(&mut session, json!({ "do": "set", "option": option, "value": value }));
    }
    let other = share(&cells_of_regions(&mut session, folder));
    assert!((other - whole).abs() < 0.06, "{whole} {other}");
    act(&mut session, stroke(0, json!([[12.0, 10.0], [30.0, 10.0]]), Some(1)));
    assert!(cells_of_regions(&mut session, folder).is_empty(), "nothing is painted");
}

#[test]
fn parts_are_merged_and_split_by_strokes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut session = small(folder, "[lattice]\nsize = 5.0\n");
    let count = |session: &mut Session, place: [f64; 2]| {
        act(session, stroke(1, json!([place]), Some(1)));
        act(session, stroke(2, json!([place]), Some(4)));
        let cells = cells_of_regions(session, folder);
        (0..2).for_each(|_| session.undo(&mut Silent).unwrap());
        cells.iter().find(|(name, _)| name == "region-2").unwrap().1
    };
    let (above, below) = ([20.0, 8.0], [20.0, 40.0]);
    let (a, b) = (count(&mut session, above), count(&mut session, below));
    act(&mut session, json!({ "do": "merge-parts", "path": [above, below], "parts": 4 }));
    assert!(count(&mut session, above) >= a + b, "they are one");
    act(
        &mut session,
        json!({ "do": "split-part", "first": [[12.0, 8.0], [30.0, 8.0]], "second": [[12.0, 40.0], [30.0, 40.0]], "parts": 4 }),
    );
    let (again, other) = (count(&mut session, above), count(&mut session, below));
    assert!(again.abs_diff(a) < a / 5 && other.abs_diff(b) < b / 5, "{a} {b} {again} {other}");
    for (gesture, why) in [
        (json!({ "do": "merge-parts", "path": [above], "parts": 4 }), "one part"),
        (
            json!({ "do": "split-part", "first": [above], "second": [below], "parts": 4 }),
            "two sides",
        ),
        (json!({ "do": "split-part", "first": [], "second": [], "parts": 4 }), "two sides"),
        (stroke(65, json!([above]), None), "region 65"),
        (json!({ "do": "name-region", "region": 1, "name": "xmin" }), "something else"),
        (json!({ "do": "name-region", "region": 1, "name": "a b" }), "letter"),
        (json!({ "do": "name-region", "region": 0, "name": "ab" }), "region 0"),
    ] {
        let refused = session.act(serde_json::from_value(gesture.clone()).unwrap(), &mut Silent);
        let words = refused.expect_err(&gesture.to_string()).to_string();
        assert!(words.contains(why), "{gesture}: {words}");
    }
}
