//! Meshes of masks and labels, through the pipeline: the outline, the boundary, the tags.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use atomesh::enhance::{FeatureOptions, Features};
use atomesh::geometry::{Point, difference, dot};
use atomesh::image::{Frame, Image, Samples};
use atomesh::measure::shapes;
use atomesh::mesh::Mesh;
use atomesh::region::RegionError;
use atomesh::run::{Inputs, MeshOptions, Method, Outcome, RunError, Size, Warning, prepare};
use atomesh::watch::Silent;

/// An image of a function of the sample's index.
fn image<const D: usize>(shape: [usize; D], value: impl Fn(&Point<D>) -> u8) -> Image<D> {
    let samples = (0..shape.iter().product())
        .map(|mut i: usize| {
            let p = std::array::from_fn(|k| {
                let index = i % shape[k];
                i /= shape[k];
                index as f64
            });
            value(&p)
        })
        .collect();
    Image::new(Frame::new(shape).unwrap(), Samples::U8(samples)).unwrap()
}

fn distance<const D: usize>(p: &Point<D>, centre: &Point<D>) -> f64 {
    let v = difference(p, centre);
    dot(&v, &v).sqrt()
}

fn options<const D: usize>(size: f64) -> MeshOptions<D> {
    let features = FeatureOptions { features: Features::None, ..Default::default() };
    MeshOptions { size: Size::Constant(size), features, ..Default::default() }
}

fn run<const D: usize>(
    method: &Method<D>,
    inputs: Inputs<'_, D>,
    options: MeshOptions<D>,
) -> Result<Outcome<D>, RunError> {
    prepare(method, inputs, options, &mut Silent)?.run(&mut Silent)
}

fn masked<const D: usize>(method: &Method<D>, mask: &Image<D>, size: f64) -> Outcome<D> {
    let inputs = Inputs { mask: Some(mask), ..Inputs::image(mask) };
    let outcome = run(method, inputs, options(size)).unwrap();
    outcome.mesh().validate().unwrap();
    outcome
}

/// The facets of the hull.
fn boundary<const D: usize>(mesh: &Mesh<D>) -> Vec<[u32; D]> {
    let hull = mesh.facets().into_iter().filter(|f| f.neighbour.is_none());
    hull.map(|f| f.corners).collect()
}

/// Points less edges plus triangles of a boundary: 2 for each sphere, 0 for each ring of edges.
fn euler<const D: usize>(boundary: &[[u32; D]]) -> i64 {
    let mut points: Vec<u32> = boundary.as_flattened().to_vec();
    points.sort_unstable();
    points.dedup();
    let ridges = ridges(boundary).len() as i64;
    let (points, facets) = (points.len() as i64, boundary.len() as i64);
    if D == 2 { points - facets } else { points - ridges + facets }
}

/// How many facets of a boundary each ridge (a point in 2-D, an edge in 3-D) has.
fn ridges<const D: usize>(boundary: &[[u32; D]]) -> BTreeMap<Vec<u32>, usize> {
    let mut counts = BTreeMap::new();
    for facet in boundary {
        for skip in 0..D {
            let ridge: Vec<u32> = (0..D).filter(|&k| k != skip).map(|k| facet[k]).collect();
            *counts.entry(ridge).or_insert(0) += 1;
        }
    }
    counts
}

/// What every masked mesh promises: a manifold boundary, no flat cell, and the measure of its mask.
fn check<const D: usize>(outcome: &Outcome<D>, measure: f64, share: f64, angle: f64) {
    let mesh = outcome.mesh();
    let boundary = boundary(mesh);
    assert!(ridges(&boundary).values().all(|&n| n == 2), "pinched");
    let found = mesh.measure();
    assert!((found - measure).abs() < share * measure, "{found}, expected {measure}");
    let least = shapes(mesh, &mut Silent).unwrap();
    let least = least.iter().map(|s| s.least_angle).fold(180.0, f64::min);
    assert!(least > angle, "least angle {least}");
    let tags = outcome.tags().unwrap();
    let tagged: usize = tags.facet_groups().iter().map(|group| group.facets.len()).sum();
    assert_eq!(tagged, boundary.len(), "every facet of the boundary has one tag");
}

/// How far facets' centroids and corners are from the nearest of spheres around a centre, at most.
fn farthest<const D: usize>(outcome: &Outcome<D>, centre: &Point<D>, radii: &[f64]) -> f64 {
    let off = |p: &Point<D>| {
        let r = distance(p, centre);
        radii.iter().map(|radius| (r - radius).abs()).fold(f64::INFINITY, f64::min)
    };
    let mut farthest = 0.0_f64;
    for facet in outcome.outline_facets() {
        let corners = facet.map(|c| outcome.mesh().points()[c as usize]);
        let centroid =
            std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / D as f64);
        farthest = corners.iter().chain([&centroid]).map(off).fold(farthest, f64::max);
    }
    farthest
}

#[test]
fn a_disc_has_a_smooth_outline_and_its_area() {
    let (centre, radius, d) = ([70.0, 60.0], 40.0, 8.0);
    let mask = image([160, 128], |p| u8::from(distance(p, &centre) < radius));
    let outcome = masked(&Method::plane(), &mask, d);
    // the staircase's area differs from the disc's by a few tenths of a percent
    check(&outcome, PI * radius * radius, 0.01, 25.0);
    // half of the sag d²/8R of a chord is 0.1; samples place the outline to about a third of one
    assert!(farthest(&outcome, &centre, &[radius]) < 0.1 * d);
    assert_eq!(euler(&boundary(outcome.mesh())), 0);
}

#[test]
fn parts_and_holes_stay() {
    let (centre, other) = ([70.0, 60.0], [140.0, 100.0]);
    let mask = image([160, 128], |p| {
        let r = distance(p, &centre);
        255 * u8::from((20.0..45.0).contains(&r) || distance(p, &other) < 12.0)
    });
    let outcome = masked(&Method::plane(), &mask, 6.0);
    check(&outcome, PI * (45.0 * 45.0 - 20.0 * 20.0 + 12.0 * 12.0), 0.01, 20.0);
    // three closed lines
    let boundary = boundary(outcome.mesh());
    let inner = boundary
        .iter()
        .filter(|f| distance(&outcome.mesh().points()[f[0] as usize], &centre) < 30.0);
    let far = boundary.iter().filter(|f| outcome.mesh().points()[f[0] as usize][0] > 120.0);
    let (inner, far) = (inner.count(), far.count());
    // 2 π r / d edges, more or less a few
    assert!((18..=25).contains(&inner) && (10..=16).contains(&far), "{inner} {far}");
}

#[test]
fn a_mask_at_the_sides_keeps_them() {
    let centre = [0.0, 60.0];
    let mask = image([160, 128], |p| u8::from(distance(p, &centre) < 40.0));
    let outcome = masked(&Method::plane(), &mask, 8.0);
    check(&outcome, 0.5 * PI * 1600.0, 0.01, 20.0);
    let tags = outcome.tags().unwrap();
    let names: Vec<&str> = tags.facet_groups().iter().map(|g| g.name.as_str()).collect();
    assert_eq!(names, ["xmin", "mask"]);
    let points = outcome.mesh().points();
    let side = &tags.facet_group("xmin").unwrap().facets;
    let length: f64 =
        side.iter().map(|f| distance(&points[f[0] as usize], &points[f[1] as usize])).sum();
    assert!(side.as_flattened().iter().all(|&p| points[p as usize][0] == 0.0));
    assert!((length - 80.0).abs() < 1.6, "{length}");
}

#[test]
fn a_ball_has_a_smooth_surface_and_its_volume() {
    let (centre, radius, d) = ([31.3, 32.0, 31.0], 24.0, 6.0);
    let mask = image([64; 3], |p| u8::from(distance(p, &centre) < radius));
    let outcome = masked(&Method::space(), &mask, d);
    check(&outcome, 4.0 / 3.0 * PI * radius.powi(3), 0.01, 5.0);
    assert_eq!(euler(&boundary(outcome.mesh())), 2);
    // the sag d²/6R is 0.25 before facets are fitted
    assert!(farthest(&outcome, &centre, &[radius]) < 0.12 * d);
}

#[test]
fn half_a_shell_at_a_side_has_one_surface() {
    let centre = [31.3, 32.0, 0.0];
    let mask = image([64, 64, 32], |p| u8::from((12.0..26.0).contains(&distance(p, &centre))));
    let outcome = masked(&Method::space(), &mask, 6.0);
    // the samples of the side reach half a step beyond it, so that the outline sits there as elsewhere
    check(&outcome, 2.0 / 3.0 * PI * (26.0_f64.powi(3) - 12.0_f64.powi(3)), 0.015, 0.2);
    assert_eq!(euler(&boundary(outcome.mesh())), 2);
}

#[test]
fn thin_and_ragged_masks_have_manifold_boundaries() {
    // sheets, holes and specks of about a nominal distance: what no mesh of that distance can show
    let mask = image([48; 3], |p| {
        let wave = (p[0] / 4.0).sin() + (p[1] / 3.1).sin() + (p[2] / 3.7).sin();
        u8::from(wave > 0.3)
    });
    let outcome = masked(&Method::space(), &mask, 5.0);
    let boundary = boundary(outcome.mesh());
    assert!(ridges(&boundary).values().all(|&n| n == 2));
    let flat = image([96, 96], |p| u8::from((p[0] / 4.0).sin() * (p[1] / 3.1).sin() > 0.1));
    let outcome = masked(&Method::plane(), &flat, 6.0);
    assert!(ridges(&self::boundary(outcome.mesh())).values().all(|&n| n == 2));
}

#[test]
fn shares_end_where_they_are_one_half() {
    // a ramp from 0 at x = 0 to 1 at x = 60
    let samples = (0..61 * 41).map(|i| (i % 61) as f32 / 60.0).collect();
    let mask = Image::new(Frame::new([61, 41]).unwrap(), Samples::F32(samples)).unwrap();
    let outcome = masked(&Method::plane(), &mask, 6.0);
    for p in outcome.outline_facets().as_flattened() {
        let x = outcome.mesh().points()[*p as usize][0];
        // a mirrored ramp is bent at the sides of the box, a little
        assert!((x - 30.0).abs() < 0.6, "{x}");
    }
}

#[test]
fn empty_and_tiny_masks_are_refused_and_full_ones_change_nothing() {
    let picture = image([64, 48], |_| 7);
    let mesh = |mask: &Image<2>| {
        run(&Method::plane(), Inputs { mask: Some(mask), ..Inputs::image(&picture) }, options(6.0))
    };
    let region = |error| match error {
        RunError::Region(error) => error,
        other => panic!("{other}"),
    };
    let empty = region(mesh(&image([64, 48], |_| 0)).unwrap_err());
    assert_eq!(empty, RegionError::EmptyMask { count: 64 * 48 });
    let one = mesh(&image([64, 48], |p| u8::from(*p == [30.0, 20.0])));
    assert_eq!(region(one.unwrap_err()), RegionError::SmallMask { distance: 6.0 });
    let full = mesh(&image([64, 48], |_| 1)).unwrap();
    let plain = run(&Method::plane(), Inputs::image(&picture), options(6.0)).unwrap();
    assert_eq!(full.mesh(), plain.mesh());
    let thin = mesh(&image([64, 40], |_| 1)).unwrap_err();
    assert!(thin.to_string().contains("mask"), "{thin}");
}

#[test]
fn a_masked_mesh_is_the_same_at_any_number_of_threads() {
    let mask = image([40; 3], |p| u8::from(distance(p, &[20.0, 19.0, 18.0]) < 14.0));
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| masked(&Method::space(), &mask, 6.0))
    };
    assert_eq!(run(1).mesh(), run(3).mesh());
}

#[test]
fn cells_take_labels_and_interfaces_their_names() {
    let labels = image([96, 64], |p| if distance(p, &[40.0, 30.0]) < 20.0 { 5 } else { 2 });
    let features = FeatureOptions { features: Features::Labels, ..Default::default() };
    let options = MeshOptions { features, least_island: 2, ..options(6.0) };
    let inputs = Inputs { labels: Some(&labels), ..Inputs::image(&labels) };
    let outcome = run(&Method::plane(), inputs, options).unwrap();
    let tags = outcome.tags().unwrap();
    let regions = tags.regions().unwrap();
    assert_eq!(regions.ids(), [2, 5]);
    let inside: f64 = (outcome.mesh().simplices().zip(&regions.of_cells))
        .filter(|(_, label)| **label == 5)
        .map(|(s, _)| s.measure())
        .sum();
    // cells have one label each: the circle is off by a fraction of a cell in places
    assert!((inside - PI * 400.0).abs() < 0.05 * PI * 400.0, "{inside}");
    let interface = &tags.facet_group("interface-2-5").unwrap().facets;
    let points = outcome.mesh().points();
    let off: Vec<f64> = (interface.as_flattened().iter())
        .map(|&p| (distance(&points[p as usize], &[40.0, 30.0]) - 20.0).abs())
        .collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    assert!(interface.len() > 15 && mean < 0.1 * 6.0, "{} {mean}", interface.len());
}

/// A mesh of labels that are 0 exactly where the mask is, 1 on the left of its middle and 2 on the right.
fn halved<const D: usize>(method: &Method<D>, shape: [usize; D], radii: [f64; 2], size: f64) {
    let centre = shape.map(|n| 0.5 * n as f64 + 0.3);
    let is_inside = |p: &Point<D>| (radii[0]..radii[1]).contains(&distance(p, &centre));
    let labels = image(shape, |p| u8::from(is_inside(p)) * (1 + u8::from(p[0] > centre[0])));
    let mask = image(shape, |p| u8::from(is_inside(p)));
    for kind in [Features::None, Features::Labels] {
        let features = FeatureOptions { features: kind, ..Default::default() };
        let options = MeshOptions { features, ..options(size) };
        let inputs = Inputs { mask: Some(&mask), labels: Some(&labels), ..Inputs::image(&labels) };
        let outcome = run(method, inputs, options).unwrap();
        let tags = outcome.tags().unwrap();
        assert_eq!(tags.regions().unwrap().ids(), [1, 2]);
        let left = (outcome.mesh().simplices().zip(outcome.labels().unwrap()))
            .filter(|(_, label)| **label == 1)
            .map(|(cell, _)| cell.measure());
        let share = left.sum::<f64>() / outcome.mesh().measure();
        // cells have one label each: the cut is off by a part of a cell in places
        assert!((share - 0.5).abs() < 0.05, "{share}");
        // narrow places within an outline may leave no room for the floor of angles
        let odd = |w: &&Warning| !w.is_note() && !matches!(w, Warning::BelowFloor { .. });
        assert_eq!(outcome.warnings().iter().find(odd), None);
    }
}

#[test]
fn cells_within_a_mask_have_labels_from_within() {
    halved(&Method::plane(), [96, 80], [14.0, 34.0], 5.0);
    halved(&Method::plane(), [96, 80], [14.0, 34.0], 8.0);
    halved(&Method::space(), [48, 44, 46], [0.0, 19.0], 6.0);
    halved(&Method::space(), [48, 44, 46], [9.0, 20.0], 5.0);
}

/// What is said of a mesh of labels in the plane.
fn said(labels: &Image<2>, mask: Option<&Image<2>>, least_island: usize) -> Vec<Warning> {
    let features = FeatureOptions { features: Features::Labels, ..Default::default() };
    let options = MeshOptions { features, least_island, ..options(5.0) };
    let inputs = Inputs { labels: Some(labels), mask, ..Inputs::image(labels) };
    let outcome = run(&Method::plane(), inputs, options).unwrap();
    let is_of_labels =
        |w: &Warning| matches!(w, Warning::LabelsLost { .. } | Warning::ThinLayers { .. });
    outcome.warnings().iter().filter(|w| is_of_labels(w)).cloned().collect()
}

#[test]
fn labels_that_no_cell_has_are_said() {
    let labels = image([96, 64], |p| match p {
        [30.0, 20.0] => 9,
        [70.0, 20.0] => 7,
        [x, _] if *x < 50.0 => 1,
        _ => 2,
    });
    assert_eq!(said(&labels, None, 0), [Warning::LabelsLost { labels: vec![7, 9] }]);
    // outside of the mask there is nothing to lose
    let mask = image([96, 64], |p| u8::from(p[0] < 60.0));
    assert_eq!(said(&labels, Some(&mask), 0), [Warning::LabelsLost { labels: vec![9] }]);
    let text = Warning::LabelsLost { labels: (0..9).collect() }.to_string();
    assert!(text.contains("label 0, label 1, label 2, label 3 and 5 more"), "{text}");
}

#[test]
fn layers_that_come_out_broken_are_said_with_their_thickness() {
    let layer = |thickness: f64| {
        image([96, 64], |p| match 0.9 * (p[1] - 32.0) + 0.4359 * (p[0] - 48.0) {
            across if across.abs() < 0.5 * thickness => 3,
            across => u8::from(across > 0.0),
        })
    };
    let [Warning::ThinLayers { layers }] = &said(&layer(2.0), None, 0)[..] else {
        panic!("{:?}", said(&layer(2.0), None, 0));
    };
    assert_eq!((layers.len(), layers[0].label), (1, 3));
    // samples place either side to about half of one
    assert!((layers[0].thickness - 2.0).abs() < 1.0, "{layers:?}");
    assert_eq!(said(&layer(7.0), None, 0), []);
}

#[test]
fn islands_that_are_to_join_others_are_not_said_unless_their_label_vanishes() {
    let discs = |second: u8| {
        image([96, 64], |p| {
            let first = 5 * u8::from(distance(p, &[30.0, 32.0]) < 14.0);
            let small = distance(p, &[72.0, 32.0]) < 7.0;
            if small { second } else { first }
        })
    };
    // the small disc is a fifth of its label, and of some twenty cells
    assert_eq!(said(&discs(5), None, 40), []);
    assert_eq!(said(&discs(6), None, 40), [Warning::LabelsLost { labels: vec![6] }]);
    assert_eq!(said(&discs(6), None, 0), []);
}

#[test]
fn curved_cells_fit_a_disc_better_than_straight_ones() {
    let (centre, radius) = ([70.0, 60.0], 40.0);
    let mask = image([160, 128], |p| u8::from(distance(p, &centre) < radius));
    let outcome = masked(&Method::plane(), &mask, 16.0);
    let quadratic = outcome.quadratic();
    let middles: Vec<f64> = (outcome.outline_facets().iter())
        .map(|&[a, b]| {
            distance(&quadratic.nodes()[quadratic.middle(a, b).unwrap() as usize], &centre)
        })
        .collect();
    let off = middles.iter().map(|r| (r - radius).abs()).fold(0.0, f64::max);
    // a chord of 16 is 0.8 inside at its middle; samples place the outline to a third of one
    assert!(off < 0.45, "{off}");
}
