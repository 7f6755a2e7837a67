//! A meshed sphere encloses the volume of the true one: facets are fitted, not only atoms.

use atomesh::enhance::{FeatureOptions, Features};
use atomesh::geometry::distance_squared;
use atomesh::improve::{Align, ImproveOptions};
use atomesh::mesh::Mesh;
use atomesh::run::{Inputs, MeshOptions, Method, Size, prepare};
use atomesh::synth::{Geometry, Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;

/// Of each cell, whether its centre is in a ball.
fn inside(mesh: &Mesh<3>, center: &[f64; 3], radius: f64) -> Vec<bool> {
    let is_inside = |cell: atomesh::geometry::Simplex<3>| {
        let sum = |k: usize| cell.first[k] + cell.others.iter().map(|p| p[k]).sum::<f64>();
        let middle = std::array::from_fn(|k| 0.25 * sum(k));
        distance_squared(&middle, center) < radius * radius
    };
    mesh.simplices().map(is_inside).collect()
}

/// The volume of the cells whose centres are in a ball, over the ball's.
fn share(mesh: &Mesh<3>, center: &[f64; 3], radius: f64) -> f64 {
    let cells = mesh.simplices().zip(inside(mesh, center, radius));
    let volume: f64 = cells.filter(|(_, inside)| *inside).map(|(cell, _)| cell.measure()).sum();
    volume / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3))
}

/// The share of the facets between cells inside and outside that have a corner more than a sample off the sphere.
fn share_off(mesh: &Mesh<3>, center: &[f64; 3], radius: f64) -> f64 {
    let mut facets: Vec<([u32; 3], bool)> = Vec::new();
    for (corners, inside) in mesh.cells().zip(inside(mesh, center, radius)) {
        for k in 0..4 {
            let mut facet = [1, 2, 3].map(|n| corners[(k + n) % 4]);
            facet.sort_unstable();
            facets.push((facet, inside));
        }
    }
    facets.sort_unstable();
    let off = |c: u32| (distance_squared(&mesh.points()[c as usize], center).sqrt() - radius).abs();
    let between = facets.windows(2).filter(|w| w[0].0 == w[1].0 && w[0].1 != w[1].1);
    let are_off: Vec<bool> = between.map(|w| w[0].0.into_iter().any(|c| off(c) > 1.0)).collect();
    are_off.iter().filter(|off| **off).count() as f64 / are_off.len() as f64
}

#[test]
fn a_sphere_is_far_nearer_to_the_truth_than_with_corners_on_it() {
    let drawn = synthesize(Scene::Sphere, &SynthOptions::new([80; 3])).unwrap();
    let Geometry::Sphere { center, radius } = drawn.truth.features[0].geometry else {
        panic!("a sphere is a sphere");
    };
    let size = 5.0;
    let meshed = |align| {
        let options = MeshOptions {
            features: FeatureOptions { features: Features::Edges, ..Default::default() },
            size: Size::Constant(size),
            improve: ImproveOptions { align, ..ImproveOptions::for_dimension(3) },
            ..Default::default()
        };
        let method = Method::space();
        let prepared = prepare(&method, Inputs::image(&drawn.image), options, &mut Silent).unwrap();
        prepared.run(&mut Silent).unwrap()
    };
    // triangles of edges d with corners on the sphere lie d²/8R inside it on average: 3 d²/8R² of the volume
    let chord = 0.375 * (size / radius).powi(2);
    let full = meshed(Align::Full);
    let error = (share(full.mesh(), &center, radius) - 1.0).abs();
    assert!(error < 0.5 * chord, "{error} {chord}");
    let off = meshed(Align::Off);
    // a blurred surface is drawn inward by its curvature, here by a tenth of a sample, which leaves the rest to the mesh
    let [far, near] = [&off, &full].map(|o| share_off(o.mesh(), &center, radius));
    assert!(near < 0.5 * far, "{near} {far}");
    assert!(off.improve_report().is_none() && off.mesh() != full.mesh());
    let report = full.improve_report().unwrap();
    assert!(report.floor_held && report.angle_after >= 15.0, "{report:?}");
    assert_eq!(full.mesh().validate(), Ok(()));
}
