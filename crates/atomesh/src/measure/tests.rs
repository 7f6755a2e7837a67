//! Measures of a synthetic image whose features are known, and of reference potentials.

use super::statistics::percentile;
use super::*;
use crate::geometry::{Bounds, Point};
use crate::mesh::Mesh;
use crate::synth::{Scene, SynthOptions, grey, synthesize};
use crate::watch::Silent;

/// The cubes of a lattice, `size` samples wide, each cut in D! simplices along its diagonal.
fn lattice<const D: usize>(counts: [usize; D], size: f64) -> Mesh<D> {
    let total: usize = counts.iter().product();
    let place = |mut index: usize| -> [usize; D] {
        std::array::from_fn(|k| {
            let i = index % counts[k];
            index /= counts[k];
            i
        })
    };
    let strides: [usize; D] = std::array::from_fn(|k| counts[..k].iter().product());
    let points: Vec<Point<D>> = (0..total).map(|i| place(i).map(|x| x as f64 * size)).collect();
    // the paths from a cube's first to its last corner, one axis after another
    let orders: Vec<Vec<usize>> = match D {
        2 => vec![vec![0, 1], vec![1, 0]],
        _ => [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]]
            .map(|o| o.to_vec())
            .into(),
    };
    let mut corners = Vec::new();
    for index in 0..total {
        if (0..D).any(|k| place(index)[k] + 1 == counts[k]) {
            continue;
        }
        for (which, order) in orders.iter().enumerate() {
            let mut at = index;
            let mut cell = vec![at as u32];
            for &axis in order {
                at += strides[axis];
                cell.push(at as u32);
            }
            if which >= orders.len() / 2 {
                cell.swap(0, 1); // these turn the other way round
            }
            corners.extend(cell);
        }
    }
    Mesh::new(points, corners).unwrap()
}

fn dark<const D: usize>(scene: Scene, shape: [usize; D]) -> (Vec<f32>, crate::synth::Truth<D>) {
    let made = synthesize(scene, &SynthOptions { seed: 4, ..SynthOptions::new(shape) }).unwrap();
    let background = grey::BACKGROUND as f32;
    let b = made.image.samples().to_f32().iter().map(|v| (v - background) / background).collect();
    (b, made.truth)
}

fn found_features_are_the_true_ones<const D: usize>(scene: Scene, shape: [usize; D]) {
    let (b, truth) = dark(scene, shape);
    let found = features(SampledPotential { values: &b, shape }, 4.0, &mut Silent).unwrap();
    let count = found.len();
    assert!(count > 50, "{count} features of {scene}");
    let mut distances: Vec<f64> =
        found.iter().map(|point| truth.distance(&point.position)).collect();
    // fewer than half of the points belong to the whirls about tips, rims and crossings
    let (most, greatest) = (percentile(&mut distances, 50.0), percentile(&mut distances, 100.0));
    assert!(most < 0.1 && greatest < 4.0, "{scene}: {most} {greatest}");
}

#[test]
fn features_of_a_synthetic_image_are_its_truth() {
    found_features_are_the_true_ones(Scene::Slit, [80, 80]);
    found_features_are_the_true_ones(Scene::Faults, [128, 128]);
    found_features_are_the_true_ones(Scene::LayersFaults, [64, 64, 64]);
}

/// All reports of one scene, as they would be written.
fn reports<const D: usize>(scene: Scene, shape: [usize; D]) -> String {
    let (b, _) = dark(scene, shape);
    let mesh = lattice(shape.map(|n| n / 4 + 1), 4.0);
    let bounds = Bounds { min: [0.0; D], max: shape.map(|n| (n / 4 * 4) as f64) };
    let shape_report = self::shape(&mesh, Some(&bounds), &mut Silent).unwrap();
    assert_eq!((shape_report.inverted, shape_report.flat), (0, 0));
    // pairwise sums of some ten thousand rounded sixths
    assert!(shape_report.volume_error < Some(1e-14));
    let found = features(SampledPotential { values: &b, shape }, 4.0, &mut Silent).unwrap();
    let options = AlignmentOptions { limit: 500, ..AlignmentOptions::new(4.0) };
    let aligned = alignment(&mesh, &found, &options, &mut Silent).unwrap();
    assert!(aligned.features == 500 || aligned.features == aligned.features_found);
    serde_json::to_string(&(shape_report, aligned)).unwrap()
}

#[test]
fn reports_are_the_same_at_any_thread_count() {
    let all = || [reports(Scene::Faults, [96, 80]), reports(Scene::LayersFaults, [40, 32, 36])];
    let with = |threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(all)
    };
    assert_eq!(with(1), with(3));
}

/// Needs the reference potentials in the folder that `ATOMESH_DATA` names; passes without it.
#[test]
fn features_of_the_reference_are_as_many_as_the_judge_finds() {
    let Some(folder) = std::env::var_os("ATOMESH_DATA") else { return };
    let file = std::path::Path::new(&folder).join("reference/hale2001-fig1.npy");
    let bytes = std::fs::read(&file).unwrap();
    // the last 256² little-endian floats of the file
    let values: Vec<f32> = bytes[bytes.len() - 4 * 256 * 256..]
        .chunks_exact(4)
        .map(|c| f32::from_le_bytes([c[0], c[1], c[2], c[3]]))
        .collect();
    let b = SampledPotential { values: &values, shape: [256, 256] };
    assert_eq!(features(b, 8.0, &mut Silent).unwrap().len(), 3425);
}
