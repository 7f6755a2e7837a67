//! Whether faces of Voronoi cells fall on features that repel.

use super::*;
use crate::crests::FeaturePoint;
use crate::geometry::{Bounds, Point, difference, distance_squared, dot};
use crate::image::{Frame, Image, Samples};
use crate::measure::{AlignmentOptions, alignment_of_faces};
use crate::mesh::PolyMesh;
use crate::watch::Silent;

/// b of features that repel: a Gaussian of `width` samples across the distance to each, the highest of them.
fn repelling<const D: usize>(
    shape: [usize; D],
    width: f64,
    distance: impl Fn(&Point<D>) -> f64,
) -> Image<D> {
    let values = (0..shape.iter().product()).map(|index| {
        let p = crate::image::coordinates(index, shape).map(|i| i as f64);
        (-0.5 * (distance(&p) / width).powi(2)).exp() as f32
    });
    let frame = Frame::new(shape).unwrap();
    Image::new(frame, Samples::F32(values.collect())).unwrap()
}

fn cells<const D: usize>(
    method: &Method<D>,
    b: &Image<D>,
    options: MeshOptions<D>,
) -> (Outcome<D>, PolyMesh<D>) {
    let inputs = Inputs { is_potential: true, ..Inputs::image(b) };
    let outcome = prepare(method, inputs, options, &mut Silent).unwrap().run(&mut Silent).unwrap();
    let cells = outcome.cells().unwrap().clone();
    (outcome, cells)
}

fn options<const D: usize>(d: f64) -> MeshOptions<D> {
    MeshOptions { size: Size::Constant(d), ..MeshOptions::voronoi() }
}

/// Cells keep their promises and no two neighbours' sites are nearer than 0.4 d: pairs are 0.45 d apart or more,
/// others keep 0.4 d from them and more from each other.
fn assert_sound<const D: usize>(outcome: &Outcome<D>, cells: &PolyMesh<D>) {
    cells.validate(&outcome.potential().grid().bounds()).unwrap();
    for (&a, &b) in cells.owners().iter().zip(cells.neighbours()) {
        let [p, q] = [a, b].map(|cell| cells.centers()[cell as usize]);
        let d = outcome.distance().at(&p).min(outcome.distance().at(&q));
        let gap = distance_squared(&p, &q).sqrt() / d;
        assert!(gap >= 0.4, "{p:?} and {q:?} are {gap} d apart");
    }
}

/// The share of points that a face passes within max(1, d/10) and 20° of the normal.
fn recall<const D: usize>(cells: &PolyMesh<D>, on: &[(Point<D>, Point<D>)], d: f64) -> f64 {
    let point = |&(position, normal)| FeaturePoint { index: 0, position, normal, strength: 1.0 };
    let points: Vec<FeaturePoint<D>> = on.iter().map(point).collect();
    let report =
        alignment_of_faces(cells, &points, &AlignmentOptions::new(d), &mut Silent).unwrap();
    assert!(report.features > 50, "{}", report.features);
    report.recall.unwrap()
}

/// A plane; in the plane a line.
struct Sheet<const D: usize> {
    through: Point<D>,
    normal: Point<D>,
}

/// Points of a sheet, a sample apart, at least `inset` inside the box.
fn on_sheet<const D: usize>(
    bounds: &Bounds<D>,
    sheet: Sheet<D>,
    inset: f64,
) -> Vec<(Point<D>, Point<D>)> {
    let Sheet { through, normal } = sheet;
    let shape = bounds.max.map(|x| x as usize + 1);
    let samples = (0..shape.iter().product::<usize>())
        .map(|index| crate::image::coordinates(index, shape).map(|i| i as f64));
    let height = |p: &Point<D>| dot(&difference(p, &through), &normal);
    let near = samples.filter(|p| height(p).abs() < 0.5);
    let foot = near.map(|p| {
        let h = height(&p);
        std::array::from_fn(|k| p[k] - h * normal[k])
    });
    let inside = |p: &Point<D>| {
        (0..D).all(|k| p[k] >= bounds.min[k] + inset && p[k] <= bounds.max[k] - inset)
    };
    foot.filter(inside).map(|p| (p, normal)).collect()
}

fn unit<const D: usize>(v: Point<D>) -> Point<D> {
    let length = dot(&v, &v).sqrt();
    v.map(|x| x / length)
}

fn a_plane_is_followed<const D: usize>(
    method: &Method<D>,
    shape: [usize; D],
    normal: Point<D>,
    d: f64,
) {
    let normal = unit(normal);
    let through = shape.map(|n| 0.5 * n as f64 - 0.3);
    let b = repelling(shape, 0.25 * d, |p| dot(&difference(p, &through), &normal));
    let (outcome, cells) = cells(method, &b, options(d));
    assert_sound(&outcome, &cells);
    let bounds = outcome.potential().grid().bounds();
    let inner = on_sheet(&bounds, Sheet { through, normal }, 1.5 * d);
    assert_eq!(recall(&cells, &inner, d), 1.0, "{normal:?}");
    // where it meets the box's sides too, but for corners between the last foot and an oblique side
    let all = recall(&cells, &on_sheet(&bounds, Sheet { through, normal }, 0.0), d);
    assert!(all > 0.93, "{normal:?}: {all}");
    let report = outcome.mirror_report().unwrap();
    assert!(report.pairs <= report.places && report.shared <= report.pairs, "{report:?}");
    // pairs are no random finds: without them few points are followed
    let (_, plain) = self::cells(method, &b, MeshOptions { mirror: false, ..options(d) });
    assert!(recall(&plain, &inner, d) < 0.9);
}

#[test]
fn tilted_lines_and_planes_are_followed_whole() {
    a_plane_is_followed(&Method::plane(), [90, 80], [1.0, 0.31], 6.0);
    a_plane_is_followed(&Method::plane(), [90, 80], [0.7, -1.0], 6.0);
    a_plane_is_followed(&Method::space(), [40, 36, 38], [1.0, 0.25, -0.4], 5.0);
}

fn a_sphere_is_followed<const D: usize>(method: &Method<D>, shape: [usize; D], d: f64, least: f64) {
    let (centre, radius) = (shape.map(|n| 0.5 * n as f64), 3.0 * d);
    let b = repelling(shape, 0.25 * d, |p| distance_squared(p, &centre).sqrt() - radius);
    let (outcome, cells) = cells(method, &b, options(d));
    assert_sound(&outcome, &cells);
    // a spiral from pole to pole; in 2-D all around the circle
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let on: Vec<(Point<D>, Point<D>)> = (0..600)
        .map(|i| {
            let z = if D == 2 { 0.0 } else { (f64::from(i) + 0.5) / 300.0 - 1.0 };
            let (sine, cosine) = (golden * f64::from(i)).sin_cos();
            let across = (1.0 - z * z).sqrt();
            let n = std::array::from_fn(|k| [across * cosine, across * sine, z][k]);
            (std::array::from_fn(|k| centre[k] + radius * n[k]), n)
        })
        .collect();
    let found = recall(&cells, &on, d);
    assert!(found > least, "{D}-D: {found}");
}

#[test]
fn circles_and_spheres_are_followed() {
    // chords 0.85 d long turn from the arc by 8° at their ends and leave it by 0.03 d
    a_sphere_is_followed(&Method::plane(), [60, 60], 6.0, 0.97);
    // corners of faces are up to 0.8 d from the foot, where a sphere has turned by 15°, and feet do not spread
    // over it evenly; it was 0.90
    a_sphere_is_followed(&Method::space(), [44, 44, 44], 5.0, 0.85);
}

fn crossing_planes_are_followed<const D: usize>(
    method: &Method<D>,
    shape: [usize; D],
    d: f64,
    least: f64,
) {
    let mut normals = [[0.0; D]; 2];
    (normals[0][0], normals[0][1]) = (1.0, 0.2);
    (normals[1][0], normals[1][1]) = (-0.3, 1.0);
    let normals = normals.map(unit);
    let through = shape.map(|n| 0.5 * n as f64 - 0.2);
    let height = |p: &Point<D>, n: usize| dot(&difference(p, &through), &normals[n]).abs();
    let b = repelling(shape, 0.25 * d, |p| height(p, 0).min(height(p, 1)));
    let (outcome, cells) = cells(method, &b, options(d));
    assert_sound(&outcome, &cells);
    let bounds = outcome.potential().grid().bounds();
    let of = |n: usize| on_sheet(&bounds, Sheet { through, normal: normals[n] }, 1.5 * d);
    let mut all = of(0);
    all.extend(of(1));
    let found = recall(&cells, &all, d);
    assert!(found > least, "{found}");
    // a way off the crossing all of it
    let mut off: Vec<_> = of(0).into_iter().filter(|(p, _)| height(p, 1) > 2.0 * d).collect();
    off.extend(of(1).into_iter().filter(|(p, _)| height(p, 0) > 2.0 * d));
    let found = recall(&cells, &off, d);
    assert!(found > 0.99, "{found}");
}

#[test]
fn features_that_cross_are_followed_but_for_the_crossing() {
    crossing_planes_are_followed(&Method::plane(), [100, 100], 6.0, 0.9);
    crossing_planes_are_followed(&Method::space(), [44, 44, 30], 5.0, 0.85);
}

#[test]
fn a_feature_along_a_side_spoils_nothing() {
    // on the side itself, and so near that there is no room for a pair, or just enough
    for x in [0.0, 1.0, 2.0, 3.0, 4.5] {
        let b = repelling([70, 50], 1.5, |p| p[0] - x);
        let (outcome, cells) = cells(&Method::plane(), &b, options(6.0));
        assert_sound(&outcome, &cells);
        let b = repelling([24, 22, 20], 1.2, |p| p[0] - x);
        let (outcome, cells) = self::cells(&Method::space(), &b, options(5.0));
        assert_sound(&outcome, &cells);
    }
}

#[test]
fn without_features_nothing_changes() {
    let b = repelling([60, 50], 1.0, |_| 100.0);
    // and where they attract
    let dark = repelling([60, 50], 1.5, |p| p[0] - 30.2);
    let values = dark.samples().to_f32().iter().map(|b| -b).collect();
    let dark = Image::new(*dark.frame(), Samples::F32(values)).unwrap();
    for b in [b, dark] {
        let (outcome, with) = cells(&Method::plane(), &b, options(6.0));
        let plain = MeshOptions { mirror: false, ..options(6.0) };
        let (_, without) = cells(&Method::plane(), &b, plain);
        assert_eq!(with.centers(), without.centers());
        assert_eq!(outcome.mirror_report(), None);
    }
}

#[test]
fn where_d_varies_features_are_followed_too() {
    let (through, normal) = ([70.3, 60.1], unit([1.0, 0.4]));
    let b = repelling([150, 120], 1.0, |p| dot(&difference(p, &through), &normal));
    let size = Size::Range { min: 4.0, max: 12.0 };
    let (outcome, cells) = cells(&Method::plane(), &b, MeshOptions { size, ..options(4.0) });
    assert_sound(&outcome, &cells);
    let greatest = outcome.distance().greatest();
    assert!(greatest > 2.0 * outcome.distance().least());
    let on = on_sheet(&outcome.potential().grid().bounds(), Sheet { through, normal }, 8.0);
    assert_eq!(recall(&cells, &on, 4.0), 1.0);
}

#[test]
fn a_well_stays_beside_and_on_a_feature() {
    let b = repelling([80, 60], 1.5, |p| p[0] - 40.0);
    for well in [[40.0, 30.0], [41.8, 30.0], [43.0, 30.0], [46.0, 30.0]] {
        let seed_points = vec![well];
        let given = MeshOptions { seed_points, ..options(6.0) };
        let (outcome, cells) = cells(&Method::plane(), &b, given);
        let [Some(cell)] = outcome.wells()[..] else { panic!("no cell of {well:?}") };
        assert_eq!(cells.centers()[cell as usize], well);
        assert_sound(&outcome, &cells);
    }
}

#[test]
fn sites_do_not_depend_on_the_number_of_threads() {
    let centre = [20.0, 17.0, 19.0];
    let b = repelling([40, 36, 38], 1.2, |p| distance_squared(p, &centre).sqrt() - 13.0);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| cells(&Method::space(), &b, options(5.0)).1)
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(one.centers(), two.centers());
    assert_eq!(one.points(), two.points());
}
