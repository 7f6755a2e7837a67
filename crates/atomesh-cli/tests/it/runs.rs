//! Whole runs of the command: same bytes, true proportions, mirrored frames, Ctrl-C.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use sha2::{Digest, Sha256};

fn atomesh(folder: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_atomesh"));
    command.current_dir(folder).args(arguments.split_whitespace()).output().unwrap()
}

/// Runs a command that must succeed, and returns what it prints.
pub fn succeed(folder: &Path, arguments: &str) -> String {
    let output = atomesh(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "atomesh {arguments}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

fn digest(path: &Path) -> Vec<u8> {
    Sha256::digest(fs::read(path).unwrap()).to_vec()
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_mesh_is_the_same_on_a_second_run_and_at_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, "synth faults -o flat.png --shape 96,80 -q");
    succeed(folder, "synth sphere -o volume.npy --shape 24,24,20 --noise 0.1 -q");
    for (image, options) in [
        ("flat.png", "--size 6"),
        ("flat.png", "--size 5..10 --lattice random --engine sampled"),
        ("volume.npy", "--size 4 --features edges"),
    ] {
        for ending in ["vtu", "npz"] {
            let run = |name: &str, threads: &str| {
                let name = format!("{name}.{ending}");
                succeed(
                    folder,
                    &format!("mesh {image} -o {name} {options} --threads {threads} -q"),
                );
                digest(&folder.join(name))
            };
            let first = run("first", "1");
            assert_eq!(first, run("second", "1"), "{image} {options} {ending}: second run");
            assert_eq!(first, run("third", "2"), "{image} {options} {ending}: two threads");
            assert_ne!(first, run("fourth", "2 --seed 1"), "the digest does not see the mesh");
        }
    }
}

/// The root mean squares of the edges' components along each axis.
fn edge_components(report: &serde_json::Value) -> Vec<f64> {
    let components = report["shape"]["edge_rms_per_axis"].as_array().unwrap();
    components.iter().map(|v| v.as_f64().unwrap()).collect()
}

/// The greatest over the least.
fn spread(values: &[f64]) -> f64 {
    let (a, b) = values.iter().fold((f64::MAX, 0.0_f64), |(a, b), &v| (a.min(v), b.max(v)));
    b / a
}

/// Samples are four times as long along z, edges are not.
#[test]
fn samples_of_1_by_1_by_4_millimetres_are_meshed_in_millimetres() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, "synth sphere -o ball.nii.gz --shape 60,60,16 --spacing 1,1,4 -q");
    // 5 % where nothing pulls on the lattice. An image may well stretch cells: here the surface is
    // ten edges across, and softer along z, where its samples are coarse
    for (options, most) in [("--features none", 1.05), ("--features edges", 1.15)] {
        succeed(
            folder,
            &format!("mesh ball.nii.gz -o b.vtu {options} --size 6 --report b.json -q"),
        );
        let report = json(&folder.join("b.json"));
        let components = edge_components(&report);
        assert!(components.len() == 3 && spread(&components) <= most, "{options} {components:?}");
        assert!(report["shape"]["volume_error"].as_f64().unwrap() <= 1e-12);
    }

    // in sample units the mesh is stretched along z, which shows that the test can fail
    succeed(folder, "mesh ball.nii.gz -o b.vtu --size 3 --units samples --report b.json -q");
    succeed(
        folder,
        "mesh ball.nii.gz -o b.vtu --size 3 --units samples --write-potential b.npy -q",
    );
    let stretched = succeed(folder, "report b.vtu --potential b.npy --units physical");
    let stretched: serde_json::Value = serde_json::from_str(&stretched).unwrap();
    assert!(spread(&edge_components(&stretched)) > 2.0, "{stretched}");
}

#[test]
fn cells_are_positive_in_mirrored_frames_and_reports_agree() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, "synth sphere -o ball.npy --shape 20,18,16 -q");
    succeed(folder, "synth disc -o disc.npy --shape 40,32 -q");
    for (image, direction) in [
        ("ball.npy", "-1,0,0,0,1,0,0,0,1"),
        ("ball.npy", "0,1,0,1,0,0,0,0,1"),
        ("disc.npy", "1,0,0,-1"),
        ("disc.npy", "1,0,0,1"),
    ] {
        let frame = format!(
            "--spacing 0.5{} --direction={direction}",
            if image == "ball.npy" { ",0.5,0.5 --origin=7,-3,2" } else { ",0.5 --origin=-4,10" }
        );
        succeed(
            folder,
            &format!(
                "mesh {image} -o m.vtu --features edges --size 2 --report run.json \
             --write-potential b.npy -q {frame}"
            ),
        );
        succeed(folder, "check m.vtu");
        succeed(folder, "report m.vtu --potential b.npy --json after.json");
        let (run, after) = (json(&folder.join("run.json")), json(&folder.join("after.json")));
        // the world's coordinates are rounded, so lengths agree to rounding only
        for (part, name) in [("shape", "q_mean"), ("shape", "edge_mean"), ("alignment", "recall")] {
            let (a, b) = (run[part][name].as_f64().unwrap(), after[part][name].as_f64().unwrap());
            assert!((a - b).abs() <= 1e-9, "{image} {direction} {name}: {a} {b}");
        }
        assert_eq!(after["shape"]["inverted"], 0);
    }
}

#[test]
fn repelled_atoms_keep_off_and_the_flag_can_be_taken_back() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, "synth slit -o slit.png --shape 48,48 -q");
    let field = |options: &str| {
        succeed(folder, &format!("mesh slit.png -o slit.vtu --size 5 -q {options}"));
        let info = succeed(folder, "info slit.vtu");
        info.lines().find(|l| l.contains("potential,")).unwrap().to_owned()
    };
    assert!(field("--repel --write-config run.toml").contains("potential, 0 to"));
    assert!(field("--config run.toml").contains("potential, 0 to"));
    assert!(field("--config run.toml --repel=false").ends_with("to 0"));
}

/// A run that is too large for the limit on files names the output, and leaves the old one and nothing else.
#[cfg(unix)]
#[test]
fn a_file_past_the_systems_limit_is_an_error_that_names_the_output() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, "synth faults -o flat.png --shape 96,80 -q");
    for name in ["m.vtu", "m.npz", "m.msh", "m.vtk", "m.inp", "b.nrrd", "h.html"] {
        fs::write(folder.join(name), "old").unwrap();
        let run = match name {
            "b.nrrd" => "enhance flat.png -o b.nrrd".into(),
            "h.html" => "mesh flat.png -o new.npz --size 40 --html h.html".into(),
            _ => format!("mesh flat.png -o {name} --size 3"),
        };
        let script = format!("ulimit -f 8; exec {} -q {run}", env!("CARGO_BIN_EXE_atomesh"));
        let output = Command::new("sh").args(["-c", &script]).current_dir(folder).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{name}: {text}");
        let expected = format!("error: {name}: cannot be written: File too large");
        assert!(text.starts_with(&expected) && text.contains("advice: "), "{text}");
        assert_eq!(fs::read(folder.join(name)).unwrap(), b"old");
        fs::remove_file(folder.join(name)).unwrap();
        assert_eq!(fs::read_dir(folder).unwrap().count(), 2, "{name}");
    }
}

/// Words that nobody reads, and a reader of standard output that goes away, end no run in a panic.
#[cfg(unix)]
#[test]
fn closed_pipes_are_quiet() {
    use std::io::Read;
    use std::process::Stdio;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, "synth faults -o flat.png --shape 96,80 -q");
    let run = |arguments: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_atomesh"));
        command.current_dir(folder).args(arguments.split_whitespace());
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let mut child = run("mesh flat.png -o - --format vtk --size 2 --report r.json");
    drop(child.stdout.take());
    let mut words = String::new();
    child.stderr.take().unwrap().read_to_string(&mut words).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{words}");
    assert!(!words.contains("error") && !words.contains("panic"), "{words}");
    assert!(!folder.join("r.json").exists());

    let mut child = run("mesh flat.png -o m.npz --size 8 --verbose");
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let mut child = run("mesh none.png -o m.npz --size 8");
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(1));
}

/// The process is told to end in several phases, and does so soon, leaving no file behind.
#[cfg(unix)]
#[test]
fn signals_end_a_run_within_a_second_and_leave_no_half_file() {
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let side = 160usize;
    // bytes that look like noise, so that no phase has an easy time
    let noise: Vec<u8> = (0..side.pow(3) as u64)
        .map(|i| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33) as u8)
        .collect();
    fs::write(folder.join("noise.raw"), noise).unwrap();
    for (delay, signal, expected) in [(200, "INT", 130), (1000, "TERM", 143), (3000, "HUP", 129)] {
        let arguments = "mesh noise.raw -o mesh.vtu --picture mesh.png --size 3 --features edges \
             --shape 160,160,160 --dtype uint8 --write-potential b.npy --report r.json";
        let mut child = Command::new(env!("CARGO_BIN_EXE_atomesh"))
            .current_dir(folder)
            .args(arguments.split_whitespace())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(delay));
        let pid = child.id().to_string();
        assert!(
            Command::new("kill").args([&format!("-{signal}"), &pid]).status().unwrap().success()
        );
        let asked = Instant::now();
        let code = child.wait().unwrap().code();
        assert_eq!(code, Some(expected), "after {delay} ms");
        // a second on a machine of one's own; other tests run beside this one
        assert!(
            asked.elapsed() < Duration::from_secs(2),
            "after {delay} ms: {:?}",
            asked.elapsed()
        );
        let names: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(names, ["noise.raw"]);
    }
}

#[test]
fn seed_points_on_sides_leave_valid_meshes_whatever_their_decimals() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, "synth faults -o flat.png --shape 40,32 -q");
    succeed(folder, "synth sphere -o volume.npy --shape 14,12,10 -q");
    // in doubles the sides are at 392.43 + 39 · 0.3 and so on, some above and some below the decimals
    for (image, options) in [
        (
            "flat.png",
            "--size 3.6 --spacing 0.3,1.2 --origin=392.43,-997.0 --seed-point=404.13,-981.88",
        ),
        (
            "flat.png",
            "--size 0.6 --spacing 0.1,0.1 --origin=1000.1,2000.3 --seed-point=1002.0,2000.3",
        ),
        (
            "flat.png",
            "--size 0.6 --spacing 0.1,0.1 --origin=1000.1,2000.3 --seed-point=1004.0,2003.4",
        ),
        (
            "volume.npy",
            "--size 0.9 --spacing 0.3,0.3,0.3 --origin=337.8,-293.75,154.8 --seed-point=341.7,-292.55,156.00",
        ),
        (
            "volume.npy",
            "--size 0.9 --spacing 0.3,0.3,0.3 --origin=337.8,-293.75,154.8 --seed-point=338.1,-290.45,157.5",
        ),
    ] {
        succeed(folder, &format!("mesh {image} -o mesh.npz -q {options}"));
        succeed(folder, "check mesh.npz");
    }
}

#[test]
fn samples_too_far_from_zero_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, "synth faults -o flat.png --shape 40,32 -q");
    let output = atomesh(folder, "mesh flat.png -o mesh.npz -q --size 6 --origin=1e17,0");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("1e17 along x") && text.contains("--origin"), "{text}");
    succeed(folder, "mesh flat.png -o mesh.npz -q --size 6 --origin=6500000.25,500000");
}

#[cfg(unix)]
#[test]
fn names_that_are_no_text_are_written_and_reported() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, "synth faults -o flat.png --shape 40,32 -q");
    let report = std::ffi::OsStr::from_bytes(b"r\xff.json");
    let page = std::ffi::OsStr::from_bytes(b"p\xff.html");
    let mut command = Command::new(env!("CARGO_BIN_EXE_atomesh"));
    command.current_dir(folder).args("mesh flat.png -q --size 6 -o mesh.vtu --report".split(' '));
    let output = command.arg(report).arg("--html").arg(page).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(json(&folder.join(report))["options"].is_object());
    assert!(folder.join(page).exists());
}

/// Names with a byte that is no UTF-8, and values where only text makes sense: files are read and written under
/// these very names, and what cannot be is refused in words.
#[cfg(unix)]
#[test]
fn every_command_takes_names_that_are_no_text_or_says_why_not() {
    use std::ffi::OsString;
    use std::os::unix::ffi::{OsStrExt, OsStringExt};
    // `~` in the arguments below stands for the byte
    let name = |text: &str| {
        let bytes = text.bytes().map(|b| if b == b'~' { 0xff } else { b });
        OsString::from_vec(bytes.collect())
    };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let run = |arguments: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_atomesh"));
        command.current_dir(folder).args(arguments.split_whitespace().map(name)).output().unwrap()
    };
    for (arguments, files) in [
        ("synth faults -o ~.png --shape 48,40", "~.png ~.truth.json"),
        ("info ~.png", ""),
        ("mesh ~.png -o ~.vtu --size 6 --tag-features -0.2 --write-potential ~.npy", "~.vtu ~.npy"),
        ("mesh ~.png -o c~.vtu --size 6 --mesh voronoi", "c~.vtu"),
        ("mesh ~.png -o x~.vtu --size 6 --write-config ~.toml", ""),
        ("check ~.vtu", ""),
        ("enhance ~.png -o e~.nrrd --picture e~.png", "e~.nrrd e~.png"),
        ("features ~.vtu ~.png -o ~.vtp --mesh-output ~.msh --json ~.json", "~.vtp ~.msh ~.json"),
        ("surfaces ~.vtu -o ~.obj", "~.obj"),
        (
            "flow ~.vtu --source 8,8 --sink 40,32 --multiplier 0.1 -o f~.vtu --picture f~.png",
            "f~.vtu f~.png",
        ),
        ("report ~.vtu --potential ~.npy --json r~.json --html r~.html", "r~.json r~.html"),
        ("sample ~.vtu --image k=e~.png -o k~.vtu", ""),
        ("export c~.vtu -o ~.disv", "~.disv ~.npf"),
        ("export c~.vtu -o x~.json", ""),
        ("flow ~.vtu --source 8,8 --sink 40,32 --multiplier 0.1 --fluxes x~.json", ""),
        ("mesh ~.png -o x~.vtu --size ~", ""),
        ("mesh ~.png -o - --format ~", ""),
        ("mesh ~.png -o x~.xyz", ""),
        ("completions ~", ""),
        ("man -o none~", ""),
        ("surfaces ~.vtu -o x~.obj --group ~", ""),
    ] {
        let output = run(arguments);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        let is_refused = files.is_empty() && !arguments.starts_with(['i', 'c'])
            || arguments.starts_with("completions");
        let expected: &[i32] = if is_refused { &[1, 2] } else { &[0] };
        let code = output.status.code().unwrap_or(-1);
        assert!(expected.contains(&code), "{arguments}: {code} {words}");
        assert!(!words.contains("panic") && !words.contains("bug"), "{arguments}: {words}");
        assert!(!is_refused || words.starts_with("error: "), "{arguments}: {words}");
        for file in files.split_whitespace() {
            assert!(folder.join(name(file)).exists(), "{arguments}: {file}");
        }
    }
    for entry in fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name();
        assert!(
            name.as_bytes().contains(&0xff) && !name.to_string_lossy().contains("x\u{fffd}"),
            "{name:?}"
        );
    }
}
