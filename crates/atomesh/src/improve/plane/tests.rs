//! Meshes with known answers.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::super::{Align, Held, ImproveError, ImproveOptions, ImproveReport, Improver};
use super::PlaneImprover;
use super::energy::{Edge, Energy, Shape, least_sine};
use super::guides::{Guide, find_guides};
use super::triangles::Triangles;
use crate::crests::FeaturePoint;
use crate::fields::{FieldsView, ImageWeight, Interpolation, NominalDistance, ScalarField};
use crate::geometry::{Bounds, Point, difference, dot};
use crate::image::Grid;
use crate::lattice::{Crystal, GrowOptions, grow};
use crate::mesh::{Delaunay, Mesh};
use crate::watch::Silent;

/// A line through the middle of the box, leaning by `angle` degrees.
#[derive(Clone, Copy)]
struct Line {
    through: Point<2>,
    normal: Point<2>,
}

impl Line {
    fn through_the_middle(bounds: &Bounds<2>, angle: f64) -> Self {
        let (sine, cosine) = angle.to_radians().sin_cos();
        Self { through: bounds.extent().map(|x| 0.5 * x), normal: [-sine, cosine] }
    }

    fn off(&self, p: &Point<2>) -> f64 {
        dot(&difference(p, &self.through), &self.normal)
    }
}

/// What a mesh is improved for.
struct Scene {
    potential: ScalarField<2>,
    weight: ImageWeight<2>,
    distance: NominalDistance<2>,
    line: Line,
}

impl Scene {
    /// A valley of deviation 1.5 and depth `depth` along a line at `angle`, d = 8 on a box of 96 × 80.
    fn new(angle: f64, depth: f64) -> Self {
        Self::on(Grid { shape: [97, 81], step: [1.0; 2] }, angle, depth)
    }

    fn on(grid: Grid<2>, angle: f64, depth: f64) -> Self {
        let line = Line::through_the_middle(&grid.bounds(), angle);
        let [columns, rows] = grid.shape;
        let samples = (0..columns * rows).map(|i| {
            let p = [(i % columns) as f64 * grid.step[0], (i / columns) as f64 * grid.step[1]];
            (-depth * (-0.5 * (line.off(&p) / 1.5).powi(2)).exp()) as f32
        });
        let potential = ScalarField::potential(grid, samples.collect(), Interpolation::Spline);
        Self {
            potential: potential.unwrap(),
            weight: ImageWeight::constant(0.45).unwrap(),
            distance: NominalDistance::constant(&grid, 8.0).unwrap(),
            line,
        }
    }

    fn fields(&self) -> FieldsView<'_, 2> {
        FieldsView { potential: &self.potential, weight: &self.weight, distance: &self.distance }
    }

    fn bounds(&self) -> Bounds<2> {
        self.potential.grid().bounds()
    }

    /// A hexagonal lattice that knows nothing of the line, and its freedom.
    fn crystal(&self) -> (Mesh<2>, Vec<u8>) {
        let options = GrowOptions::default();
        let crystal = Crystal::hexagonal();
        let lattice = grow(&crystal, self.bounds(), &self.distance, &options, &mut Silent).unwrap();
        self.connected(lattice.atoms())
    }

    /// Corners, points on the sides, and points anywhere: cells of all shapes.
    fn scattered(&self, seed: u64) -> (Mesh<2>, Vec<u8>) {
        let mut random = Pcg64::seed_from_u64(seed);
        let [x, y] = self.bounds().extent();
        let mut points = vec![[0.0, 0.0], [x, 0.0], [0.0, y], [x, y]];
        for _ in 0..8 {
            let (u, v) = (x * random.random::<f64>(), y * random.random::<f64>());
            points.extend([[u, 0.0], [x - u, y], [0.0, v], [x, y - v]]);
        }
        points.extend((0..120).map(|_| [x * random.random::<f64>(), y * random.random::<f64>()]));
        self.connected(&points)
    }

    fn connected(&self, points: &[Point<2>]) -> (Mesh<2>, Vec<u8>) {
        let mesh = Delaunay::<2>::new().connect(points, &mut Silent).unwrap();
        let extent = self.bounds().extent();
        let inside = |p: &Point<2>, k: usize| u8::from(p[k] > 0.0 && p[k] < extent[k]);
        let freedom = mesh.points().iter().map(|p| inside(p, 0) | inside(p, 1) << 1).collect();
        (mesh, freedom)
    }

    fn improve(&self, mesh: &Mesh<2>, freedom: &[u8], align: Align) -> (Mesh<2>, ImproveReport) {
        let options = ImproveOptions { align, ..ImproveOptions::for_dimension(2) };
        let (mesh, fields) = (mesh.clone(), self.fields());
        PlaneImprover
            .improve(mesh, Held { freedom, facets: &[], near: None }, fields, &options, &mut Silent)
            .unwrap()
    }

    /// The share of the line, away from its ends, beside which an edge passes within a sample and 20°.
    fn recall(&self, mesh: &Mesh<2>) -> f64 {
        let along = [self.line.normal[1], -self.line.normal[0]];
        let extent = self.bounds().extent();
        let places: Vec<Point<2>> = (-200..200)
            .map(|i| std::array::from_fn(|k| self.line.through[k] + 0.5 * f64::from(i) * along[k]))
            .filter(|p: &Point<2>| (0..2).all(|k| p[k] > 4.0 && p[k] < extent[k] - 4.0))
            .collect();
        let edges: Vec<[Point<2>; 2]> = (mesh.facets().iter())
            .map(|facet| facet.corners.map(|c| mesh.points()[c as usize]))
            .filter(|[a, b]| {
                let edge = difference(b, a);
                let across = dot(&edge, &self.line.normal).abs();
                across <= 20f64.to_radians().sin() * dot(&edge, &edge).sqrt()
            })
            .collect();
        let followed = |p: &&Point<2>| edges.iter().any(|&[a, b]| to_segment(p, a, b) <= 1.0);
        places.iter().filter(followed).count() as f64 / places.len() as f64
    }
}

fn to_segment(p: &Point<2>, a: Point<2>, b: Point<2>) -> f64 {
    let (along, to) = (difference(&b, &a), difference(p, &a));
    let t = (dot(&to, &along) / dot(&along, &along)).clamp(0.0, 1.0);
    (to[0] - t * along[0]).hypot(to[1] - t * along[1])
}

fn least_angle(mesh: &Mesh<2>) -> f64 {
    let sines = mesh.simplices().map(|s| least_sine(s.first, s.others[0], s.others[1]));
    sines.fold(1.0, f64::min).asin().to_degrees()
}

#[test]
fn edges_of_a_crystal_turn_onto_a_line_that_it_does_not_know() {
    for angle in [7.0, 15.0, 40.0, 73.0] {
        let scene = Scene::new(angle, 1.0);
        let (mesh, freedom) = scene.crystal();
        let before = scene.recall(&mesh);
        let (improved, report) = scene.improve(&mesh, &freedom, Align::Full);
        let after = scene.recall(&improved);
        assert!(before < 0.6, "{angle}: {before}");
        assert!(after > 0.97, "{angle}: {before} to {after}");
        assert!(report.floor_held && least_angle(&improved) >= 20.0, "{angle}: {report:?}");
        assert!((report.angle_after - least_angle(&improved)).abs() < 1e-9);
        assert_eq!(improved.validate(), Ok(()));
    }
}

#[test]
fn a_line_is_followed_whatever_its_depth_and_wherever_samples_lie() {
    let shallow = Scene::new(40.0, 0.3);
    // as many lattice units, with samples twice as far apart along y
    let grid = Grid { shape: [97, 41], step: [1.0, 2.0] };
    for scene in [shallow, Scene::on(grid, 40.0, 1.0)] {
        let (mesh, freedom) = scene.crystal();
        let (improved, _) = scene.improve(&mesh, &freedom, Align::Full);
        let recall = scene.recall(&improved);
        assert!(recall > 0.95, "{recall}");
    }
}

#[test]
fn guides_lie_on_the_line_with_its_normal() {
    for step in [[1.0, 1.0], [1.0, 2.0]] {
        let shape = [97, (80.0 / step[1]) as usize + 1];
        let scene = Scene::on(Grid { shape, step }, 33.0, 0.8);
        let found = find_guides(scene.fields(), &mut Silent).unwrap();
        assert!(found.len() > 60, "{}", found.len());
        let inside =
            |p: &Point<2>| (0..2).all(|k| p[k] > 6.0 && p[k] < scene.bounds().extent()[k] - 6.0);
        for guide in found.iter().filter(|guide| inside(&guide.at.position)) {
            // a Newton step from 0.6 samples on a valley of about that variance is off by a tenth of a
            // sample; where samples are oblong the Hessian's eigenvector leans a little
            assert!(scene.line.off(&guide.at.position).abs() < 0.15 * step[1], "{guide:?}");
            assert!(dot(&guide.at.normal, &scene.line.normal).abs() > 0.99, "{guide:?}");
        }
    }
}

#[test]
fn swaps_alone_keep_points_and_gain() {
    let scene = Scene::new(15.0, 1.0);
    let (mesh, freedom) = scene.crystal();
    // on the line, but not joined along it everywhere
    let mut points = mesh.points().to_vec();
    for (p, freedom) in points.iter_mut().zip(&freedom) {
        let off = scene.line.off(p);
        if *freedom == 0b11 && off.abs() < 2.5 {
            *p = std::array::from_fn(|k| p[k] - off * scene.line.normal[k]);
        }
    }
    let (mesh, freedom) = scene.connected(&points);
    let (swapped, report) = scene.improve(&mesh, &freedom, Align::Swaps);
    assert_eq!(swapped.points(), mesh.points());
    assert!(report.swaps > 0 && report.moves == 0, "{report:?}");
    assert!(scene.recall(&swapped) > scene.recall(&mesh));
    assert!(report.angle_after >= report.angle_before.min(20.0));
    assert_eq!(swapped.validate(), Ok(()));
}

#[test]
fn freedom_and_box_are_kept() {
    let scene = Scene::new(40.0, 1.0);
    let (mesh, mut freedom) = scene.crystal();
    freedom.iter_mut().step_by(7).for_each(|f| *f = 0);
    freedom.iter_mut().skip(3).step_by(11).for_each(|f| *f &= 0b01);
    let (improved, report) = scene.improve(&mesh, &freedom, Align::Full);
    assert!(report.moves > 0);
    // points that are not wholly free are never taken away
    let after = improved.points();
    for (before, freedom) in mesh.points().iter().zip(freedom) {
        let held = |p: &Point<2>| (0..2).all(|k| freedom >> k & 1 == 1 || p[k] == before[k]);
        assert!(freedom == 0b11 || after.iter().any(held), "{before:?} {freedom}");
    }
    for axis in 0..2 {
        for side in [0.0, scene.bounds().extent()[axis]] {
            let count = |mesh: &Mesh<2>| mesh.points().iter().filter(|p| p[axis] == side).count();
            assert_eq!(count(&mesh), count(&improved));
        }
    }
    // a compensated sum: what is left are roundings of single cells
    assert!((improved.measure() / scene.bounds().measure() - 1.0).abs() < 1e-12);
}

#[test]
fn points_of_the_hull_that_nothing_holds_stay() {
    let scene = Scene::new(40.0, 1.0);
    let (mesh, held) = scene.crystal();
    let (improved, _) = scene.improve(&mesh, &vec![0b11; held.len()], Align::Full);
    for (before, held) in mesh.points().iter().zip(held) {
        assert!(held == 0b11 || improved.points().contains(before), "{before:?}");
    }
}

#[test]
fn any_mesh_stays_sound_and_no_angle_sinks_below_the_floor() {
    for seed in 0..20 {
        let scene = Scene::new(9.0 * seed as f64, 1.0);
        let (mesh, freedom) = scene.scattered(seed);
        for align in [Align::Swaps, Align::Full] {
            let (improved, report) = scene.improve(&mesh, &freedom, align);
            assert_eq!(improved.validate(), Ok(()), "seed {seed}");
            assert!((improved.measure() / scene.bounds().measure() - 1.0).abs() < 1e-12);
            let (before, after) = (least_angle(&mesh), least_angle(&improved));
            // sines are compared within rounding
            assert!(after >= before.min(20.0) - 1e-9, "seed {seed}: {before} to {after}");
            let below = improved.simplices().filter(|s| {
                least_sine(s.first, s.others[0], s.others[1]) < 20f64.to_radians().sin()
            });
            assert_eq!(below.count(), report.below);
            assert_eq!(report.floor_held, report.below == 0);
        }
    }
}

#[test]
fn the_same_mesh_comes_of_any_number_of_threads() {
    let scene = Scene::new(25.0, 1.0);
    let (mesh, freedom) = scene.scattered(5);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| scene.improve(&mesh, &freedom, Align::Full))
    };
    assert_eq!(with(1), with(2));
    assert_eq!(with(1), with(3));
}

#[test]
fn improving_again_changes_little() {
    let scene = Scene::new(40.0, 1.0);
    let (mesh, freedom) = scene.crystal();
    let (once, _) = scene.improve(&mesh, &freedom, Align::Full);
    let (twice, report) = scene.improve(&once, &freedom, Align::Full);
    let stays = |p: &&Point<2>| {
        let far = |q: &Point<2>| (p[0] - q[0]).hypot(p[1] - q[1]);
        twice.points().iter().map(far).fold(f64::INFINITY, f64::min) < 0.1 * 8.0
    };
    let stayed = once.points().iter().filter(stays).count();
    // a tenth may still gain by swaps, or by going
    assert!(10 * stayed > 9 * once.points().len(), "{stayed} of {}", once.points().len());
    assert!(report.angle_after >= 20.0);
    assert!(scene.recall(&twice) >= scene.recall(&once) - 0.01);
}

#[test]
fn what_has_nothing_to_follow_and_keeps_the_floor_stays_as_it_is() {
    let flat = Scene::new(40.0, 0.0);
    let mut unweighted = Scene::new(40.0, 1.0);
    unweighted.weight = ImageWeight::constant(0.0).unwrap();
    let repelled = Scene::new(40.0, -1.0);
    for scene in [flat, unweighted, repelled] {
        let (mesh, freedom) = scene.crystal();
        let (improved, report) = scene.improve(&mesh, &freedom, Align::Full);
        assert_eq!(improved, mesh);
        assert_eq!((report.rounds, report.swaps, report.moves), (0, 0, 0));
        assert_eq!(report.angle_before, report.angle_after);
    }
    let scene = Scene::new(40.0, 1.0);
    let (mesh, freedom) = scene.scattered(1);
    let (kept, report) = scene.improve(&mesh, &freedom, Align::Off);
    assert_eq!((kept, report.rounds), (mesh, 0));
}

#[test]
fn cells_below_the_floor_are_raised_and_the_rest_stays() {
    let scene = Scene::new(40.0, 0.0);
    let (mesh, freedom) = scene.crystal();
    let mut points = mesh.points().to_vec();
    let middle = scene.bounds().extent().map(|x| 0.5 * x);
    let far = |p: &Point<2>| (p[0] - middle[0]).hypot(p[1] - middle[1]);
    let at =
        (0..points.len()).min_by(|&i, &j| far(&points[i]).total_cmp(&far(&points[j]))).unwrap();
    points[at][0] += 6.2; // of 8: near its neighbour, so that the cells between them are thin
    let (bad, _) = scene.connected(&points);
    let (improved, report) = scene.improve(&bad, &freedom, Align::Full);
    assert!(report.angle_before < 20.0 && report.floor_held, "{report:?}");
    let stays = |p: &&Point<2>| improved.points().contains(p);
    assert!(bad.points().iter().filter(|p| far(p) > 40.0).all(|p| stays(&p)));
    assert!(!bad.points().iter().all(|p| stays(&p)));
}

#[test]
fn crowds_are_thinned_out_and_gaps_are_filled() {
    // d is 8: a patch with pairs of points a quarter of it apart
    let scene = Scene::new(40.0, 1.0);
    let (mesh, _) = scene.crystal();
    let middle = scene.bounds().extent().map(|x| 0.5 * x);
    let far = |p: &Point<2>| (p[0] - middle[0]).hypot(p[1] - middle[1]);
    let near: Vec<Point<2>> = mesh.points().iter().copied().filter(|p| far(p) < 14.0).collect();
    let mut crowded = mesh.points().to_vec();
    crowded.extend(near.iter().map(|p| [p[0] + 2.0, p[1] + 0.5]));
    let (crowded, freedom) = scene.connected(&crowded);
    let (improved, report) = scene.improve(&crowded, &freedom, Align::Full);
    assert!(report.removed > near.len() / 2 && report.floor_held, "{report:?}");
    assert_eq!(improved.points().len() + report.removed, crowded.points().len() + report.added);

    // no points but those of the box's sides near the valley: what runs along it has to be made
    let sides = scene.bounds().extent();
    let on_side = |p: &Point<2>| (0..2).any(|k| p[k] == 0.0 || p[k] == sides[k]);
    let mut gap: Vec<Point<2>> = mesh.points().to_vec();
    gap.retain(|p| on_side(p) || scene.line.off(p).abs() > 11.0);
    let (gap, freedom) = scene.connected(&gap);
    let (improved, report) = scene.improve(&gap, &freedom, Align::Full);
    assert!(report.added > 0 && report.floor_held, "{report:?}");
    assert_eq!(improved.points().len() + report.removed, gap.points().len() + report.added);
    assert_eq!(improved.validate(), Ok(()));
}

#[test]
fn beyond_the_outline_of_a_mesh_nothing_guides() {
    let scene = Scene::new(40.0, 1.0);
    let (mesh, _) = scene.crystal();
    // without the cells of the lower right quarter: an outline with a corner that turns inwards
    let [x, y] = scene.bounds().extent().map(|x| 0.5 * x);
    let middle = |s: &crate::geometry::Simplex<2>| -> Point<2> {
        std::array::from_fn(|k| (s.first[k] + s.others[0][k] + s.others[1][k]) / 3.0)
    };
    let kept = |cell: &&[u32]| {
        let p = middle(&mesh.simplex(cell));
        p[0] < x || p[1] > y
    };
    let corners: Vec<u32> = mesh.cells().filter(kept).flatten().copied().collect();
    let mut used: Vec<u32> = corners.clone();
    used.sort_unstable();
    used.dedup();
    let number = |c: &u32| used.binary_search(c).unwrap() as u32;
    let points: Vec<Point<2>> = used.iter().map(|&c| mesh.points()[c as usize]).collect();
    let part = Mesh::new(points.clone(), corners.iter().map(number).collect()).unwrap();
    let found = find_guides(scene.fields(), &mut Silent).unwrap();
    let triangles = Triangles::new(part.clone(), &found, &[]);
    let held: Vec<u32> =
        (0..triangles.len() as u32).flat_map(|c| triangles.guides_in(c).to_vec()).collect();
    let outside = |i: &u32| {
        let p = found[*i as usize].at.position;
        p[0] > x + 8.0 && p[1] < y - 8.0
    };
    assert!(!held.iter().any(outside));
    let inside = found.iter().filter(|g| g.at.position[0] < x - 8.0 || g.at.position[1] > y + 8.0);
    assert!(held.len() >= inside.count());
    // the outline holds
    let hull: Vec<u32> = (part.facets().iter())
        .filter(|facet| facet.neighbour.is_none())
        .flat_map(|facet| facet.corners)
        .collect();
    let mut freedom = vec![0b11; points.len()];
    hull.iter().for_each(|&c| freedom[c as usize] = 0);
    let (improved, _) = scene.improve(&part, &freedom, Align::Full);
    assert_eq!(improved.validate(), Ok(()));
    assert!((improved.measure() / part.measure() - 1.0).abs() < 1e-12);
    assert!(hull.iter().all(|&c| improved.points().contains(&points[c as usize])));
}

#[test]
fn floors_that_no_triangle_keeps_are_refused() {
    let scene = Scene::new(40.0, 1.0);
    let (mesh, freedom) = scene.crystal();
    for min_angle in [-1.0, 60.0, f64::NAN] {
        let options = ImproveOptions { min_angle, align: Align::Full };
        let (mesh, fields) = (mesh.clone(), scene.fields());
        let result = PlaneImprover.improve(
            mesh,
            Held { freedom: &freedom, facets: &[], near: None },
            fields,
            &options,
            &mut Silent,
        );
        assert!(matches!(result, Err(ImproveError::MinAngle { .. })));
    }
}

#[test]
fn shapes_are_those_of_the_closed_forms() {
    let root = 3f64.sqrt();
    let regular = Shape::new(0.5 * root, [1.0; 3]);
    assert!((regular.q - 1.0).abs() < 1e-15 && (regular.sine - 0.5 * root).abs() < 1e-15);
    // half a square: inradius (2 − √2)/2, circumradius √2/2, angles 45°
    let right = Shape::new(1.0, [1.0, 1.0, 2f64.sqrt()]);
    assert!((right.q - 2.0 * (2f64.sqrt() - 1.0)).abs() < 1e-15);
    assert!((right.sine - 0.5f64.sqrt()).abs() < 1e-15);
    assert_eq!(Shape::new(-1.0, [1.0, 1.0, 2f64.sqrt()]).sine, -1.0);
}

/// A guide at a place, its valley along x.
fn guide(position: Point<2>) -> Guide {
    let at = FeaturePoint { index: 0, position, normal: [0.0, 1.0], strength: 1.0 };
    Guide { at, pull: 1.0, inverse_reach_squared: 1.0 }
}

#[test]
fn an_edge_follows_what_is_near_and_along() {
    let edge = Edge::new([0.0, 0.0], [8.0, 0.0]);
    assert_eq!(edge.follows(&guide([3.0, 0.0])), 1.0);
    // within 0.7 τ near is whole, and the far share is 0.1 (1 − (0.7/3)²)
    let near = edge.follows(&guide([3.0, 0.7]));
    assert!((near - (0.9 + 0.1 * (1.0 - 0.49 / 9.0))).abs() < 1e-12, "{near}");
    assert_eq!(edge.follows(&guide([3.0, 3.0])), 0.0);
    assert_eq!(edge.follows(&guide([11.0, 0.0])), 0.0); // 3 beyond the end
    let leaning = |angle: f64| {
        let (sine, cosine) = angle.to_radians().sin_cos();
        Edge::new([-8.0 * cosine, -8.0 * sine], [8.0 * cosine, 8.0 * sine])
            .follows(&guide([0.0, 0.0]))
    };
    assert!(leaning(13.9) > 0.98 && leaning(20.0) > 0.6 && leaning(31.0) < 0.07);
    assert_eq!((leaning(51.0), leaning(90.0)), (0.0, 0.0));
}

/// The energy of a whole mesh: every guide looks for its cell among all.
fn slow_energy(mesh: &Mesh<2>, guides: &[Guide], energy: &Energy<'_>) -> f64 {
    let mut held = vec![Vec::new(); mesh.cell_count()];
    let cells: Vec<_> = mesh.simplices().collect();
    for (i, guide) in guides.iter().enumerate() {
        let depth = |cell: usize| {
            let s = cells[cell];
            let corners = [s.first, s.others[0], s.others[1]];
            let area = |k: usize| {
                super::energy::doubled_area(corners[k], corners[(k + 1) % 3], guide.at.position)
            };
            area(0).min(area(1)).min(area(2))
        };
        let cell = (0..cells.len()).max_by(|&a, &b| depth(a).total_cmp(&depth(b))).unwrap();
        held[cell].push(i as u32);
    }
    let cells = cells.iter().map(|s| [s.first, s.others[0], s.others[1]]);
    cells.zip(&held).map(|(corners, held)| energy.of_cell(corners, held).cost).sum()
}

#[test]
fn rounds_lower_the_energy_that_is_summed_over_the_whole_mesh() {
    let scene = Scene::new(25.0, 1.0);
    let found = find_guides(scene.fields(), &mut Silent).unwrap();
    let energy = Energy::new(&found, 20f64.to_radians().sin());
    let (mesh, freedom) = scene.scattered(3);
    let mut triangles = Triangles::new(mesh.clone(), &found, &[]);
    let fast = |t: &Triangles| -> f64 {
        let cells = 0..t.len() as u32;
        cells.map(|c| energy.of_cell(t.corners_at(c), t.guides_in(c)).cost).sum()
    };
    let mut before = fast(&triangles);
    // a guide on an edge may count for either side: its edges differ, and hardly its cost
    assert!((before - slow_energy(&mesh, &found, &energy)).abs() < 0.5);
    let mut mover = super::Mover::new(&triangles, &freedom, &scene.distance, &energy);
    for _ in 0..4 {
        super::swaps::swap_all(&mut triangles, &energy, &mut mover);
        let swapped = fast(&triangles);
        mover.move_all(&mut triangles, &energy);
        let moved = fast(&triangles);
        assert!(swapped <= before && moved < swapped, "{before} {swapped} {moved}");
        before = moved;
    }
    let guide_count: usize =
        (0..triangles.len() as u32).map(|c| triangles.guides_in(c).len()).sum();
    assert_eq!(guide_count, found.len());
    let last = slow_energy(&triangles.into_mesh().unwrap(), &found, &energy);
    assert!((before - last).abs() < 0.5, "{before} {last}");
}
