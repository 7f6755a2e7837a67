//! The patch test in CalculiX: displacements u = A x on all sides give u = A x and one stress everywhere, whatever the
//! mesh. It fails if an element is turned, nodes between corners stand elsewhere or in another order, or a set of a
//! side lacks a node. Where `ccx` is not installed the test says so and passes by.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use super::runs::succeed;

/// Young's modulus and Poisson's ratio.
const ELASTIC: (f64, f64) = (1000.0, 0.3);

/// The gradient of displacements: stretch and shear, small, though CalculiX takes any here as linear.
const GRADIENT: [[f64; 3]; 3] =
    [[1.0e-3, 4.0e-4, -2.0e-4], [-3.0e-4, 2.0e-3, 5.0e-4], [1.0e-4, 6.0e-4, -1.5e-3]];

/// `.dat` files have seven digits.
const TOLERANCE: f64 = 1e-6;

/// What the test needs of an input file.
struct Input {
    /// The nodes, number n at n − 1.
    nodes: Vec<[f64; 3]>,
    /// Those of the sides.
    on_sides: BTreeSet<usize>,
    element_count: usize,
}

impl Input {
    fn read(path: &Path, sides: &[&str]) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let mut found = Self { nodes: vec![], on_sides: BTreeSet::new(), element_count: 0 };
        let mut section = String::new();
        for line in text.lines().filter(|line| !line.starts_with("**")) {
            let words: Vec<&str> = line.split(',').map(str::trim).collect();
            match section.as_str() {
                _ if line.starts_with('*') => section = line.to_owned(),
                "*NODE" => {
                    assert_eq!(words[0].parse(), Ok(found.nodes.len() + 1));
                    let place = [1, 2, 3].map(|k| words[k].parse().unwrap());
                    found.nodes.push(place);
                }
                _ if section.starts_with("*ELEMENT") => found.element_count += 1,
                _ => {
                    let name = section.strip_prefix("*NSET, NSET=");
                    if name.is_some_and(|name| sides.contains(&name)) {
                        found.on_sides.extend(words.iter().map(|w| w.parse::<usize>().unwrap()));
                    }
                }
            }
        }
        found
    }

    /// The job: displacements on the sides, what comes out of all nodes and elements; one section unless the mesh has its
    /// own.
    fn job(&self, dimension: usize, has_sections: bool) -> String {
        let (young, poisson) = ELASTIC;
        let section = match has_sections {
            true => String::new(),
            false => format!(
                "*MATERIAL, NAME=rock\n*ELASTIC\n{young}, {poisson}\n\
                 *SOLID SECTION, ELSET=cells, MATERIAL=rock\n"
            ),
        };
        let mut text = format!(
            "*INCLUDE, INPUT=mesh.inp\n*NSET, NSET=every, GENERATE\n1, {}, 1\n\
             {section}*STEP\n*STATIC\n*BOUNDARY\n",
            self.nodes.len()
        );
        for &node in &self.on_sides {
            let moved = displacement(&self.nodes[node - 1], dimension);
            for (axis, value) in moved.iter().enumerate().take(dimension) {
                // CalculiX reads 20 characters of a number
                writeln!(text, "{node}, {}, {}, {value:.11e}", axis + 1, axis + 1).unwrap();
            }
        }
        text + "*NODE PRINT, NSET=every\nU\n*EL PRINT, ELSET=cells\nS\n*END STEP\n"
    }
}

/// A x, in the plane of its first two axes.
fn displacement(place: &[f64; 3], dimension: usize) -> [f64; 3] {
    std::array::from_fn(|row| match row < dimension {
        true => (0..dimension).map(|k| GRADIENT[row][k] * place[k]).sum(),
        false => 0.0,
    })
}

/// xx, yy, zz, xy, xz, yz; in the plane for no stress across it, or no strain.
fn stress(dimension: usize, no_strain: bool) -> [f64; 6] {
    let (young, poisson) = ELASTIC;
    let shear = young / (2.0 * (1.0 + poisson));
    let strain = |i: usize, j: usize| 0.5 * (GRADIENT[i][j] + GRADIENT[j][i]);
    let mut normal = [strain(0, 0), strain(1, 1), strain(2, 2)];
    if dimension == 2 {
        let free = -poisson / (1.0 - poisson) * (normal[0] + normal[1]);
        normal[2] = if no_strain { 0.0 } else { free };
    }
    let lame = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let pressure = lame * normal.iter().sum::<f64>();
    let [xx, yy, zz] = normal.map(|e| pressure + 2.0 * shear * e);
    let in_space = |i, j| if dimension == 3 { 2.0 * shear * strain(i, j) } else { 0.0 };
    [xx, yy, zz, 2.0 * shear * strain(0, 1), in_space(0, 2), in_space(1, 2)]
}

/// The rows of numbers under a title of a `.dat` file.
fn rows(dat: &str, title: &str) -> Vec<Vec<f64>> {
    let lines = dat.lines().skip_while(|line| !line.trim_start().starts_with(title)).skip(1);
    let numbers = |line: &str| -> Option<Vec<f64>> {
        line.split_whitespace().map(|word| word.parse().ok()).collect()
    };
    let rows = lines.map_while(numbers).filter(|row| !row.is_empty());
    rows.collect()
}

fn assert_near(found: &[f64], expected: &[f64], scale: f64, what: &str) {
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= TOLERANCE * scale, "{what}: {found:?} for {expected:?}");
    }
}

fn greatest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| most.max(value.abs()))
}

/// The test of a mesh with these options besides; those that name a section leave the job none to give.
fn patch_test(dimension: usize, image: &str, order: usize, options: &str) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, &format!("synth {image} -q"));
    let image = image.rsplit(' ').next().unwrap();
    succeed(folder, &format!("mesh {image} -o mesh.inp --order {order} -q {options}"));
    let sides = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"];
    let input = Input::read(&folder.join("mesh.inp"), &sides[..2 * dimension]);
    assert!(input.on_sides.len() < input.nodes.len(), "all nodes are given");
    fs::write(folder.join("job.inp"), input.job(dimension, options.contains("--section"))).unwrap();
    let output = Command::new("ccx").current_dir(folder).args(["-i", "job"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let dat = fs::read_to_string(folder.join("job.dat")).unwrap_or_else(|e| panic!("{e}: {said}"));

    let moved = rows(&dat, "displacements");
    assert_eq!(moved.len(), input.nodes.len());
    let expected: Vec<[f64; 3]> =
        input.nodes.iter().map(|place| displacement(place, dimension)).collect();
    let scale = greatest(expected.as_flattened().iter().copied());
    for row in &moved {
        let node = row[0] as usize;
        let own = &expected[node - 1][..dimension];
        assert_near(&row[1..=dimension], own, scale, &format!("order {order}, node {node}"));
    }
    let expected = stress(dimension, options.contains("plane-strain"));
    let stresses = rows(&dat, "stresses");
    assert!(stresses.len() >= input.element_count, "{} stresses", stresses.len());
    let scale = greatest(expected.into_iter());
    for row in &stresses {
        let what = format!("order {order}, element {}", row[0]);
        assert_near(&row[2..], &expected, scale, &what);
    }
}

/// Whether CalculiX can be run; says so if not.
fn is_installed() -> bool {
    let found = Command::new("ccx").arg("-v").output().is_ok();
    if !found {
        println!("passes by: ccx (CalculiX) is not installed");
    }
    found
}

#[test]
fn calculix_gives_linear_displacements_and_one_stress_in_the_plane() {
    for order in [1, 2] {
        if is_installed() {
            patch_test(2, "disc --shape 60,44 -o disc.png", order, "--features edges");
        }
    }
}

#[test]
fn calculix_gives_linear_displacements_and_one_stress_in_space() {
    for order in [1, 2] {
        if is_installed() {
            patch_test(3, "sphere --shape 20,16,18 -o ball.npy", order, "--features edges");
        }
    }
}

/// Each element has a section, of the kind that was asked for, and constants of its region: which are the same here, so that
/// the answer is known.
#[test]
fn calculix_takes_sections_and_materials_of_phases() {
    let constants = "--material 0=1000,0.3 --material 1=1000,0.3";
    for kind in ["plane-strain", "plane-stress"] {
        if is_installed() {
            let options = format!("--threshold 128 --y-up --section {kind} {constants}");
            patch_test(2, "disc --shape 60,44 -o disc.png", 2, &options);
        }
    }
    if is_installed() {
        let options = format!("--threshold 128 --section solid {constants}");
        patch_test(3, "sphere --shape 20,16,18 --bytes -o ball.npy", 1, &options);
    }
}
