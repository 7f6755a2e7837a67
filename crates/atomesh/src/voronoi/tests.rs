use super::*;
use crate::features::feature_faces;
use crate::fields::ScalarField;
use crate::geometry::{difference, distance_squared, dot};
use crate::image::{Frame, Grid, Image, Samples};
use crate::mesh::{Connection, PolyParts, boundary_connections, connections};
use crate::sample::{SampleOptions, Statistic, sample};
use crate::watch::Silent;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// What differs between 2-D and 3-D here: the connector.
trait Dimension<const D: usize> {
    fn delaunay() -> Delaunay<D>;
}
struct Axes;
impl Dimension<2> for Axes {
    fn delaunay() -> Delaunay<2> {
        Delaunay::<2>::new()
    }
}
impl Dimension<3> for Axes {
    fn delaunay() -> Delaunay<3> {
        Delaunay::<3>::new()
    }
}

fn cube<const D: usize>(side: f64) -> Bounds<D> {
    Bounds { min: [0.0; D], max: [side; D] }
}

fn cells<const D: usize>(sites: &[Point<D>], bounds: Bounds<D>) -> PolyMesh<D>
where
    Axes: Dimension<D>,
{
    let mesh = voronoi(&<Axes as Dimension<D>>::delaunay(), sites, bounds, &mut Silent).unwrap();
    assert_eq!(mesh.validate(&bounds), Ok(()));
    mesh
}

/// Sites at random, some on sides, edges and corners of the box.
fn scattered<const D: usize>(count: usize, side: f64, random: &mut Pcg64) -> Vec<Point<D>> {
    let coordinate = |random: &mut Pcg64| match random.random_range(0..6) {
        0 => 0.0,
        1 => side,
        _ => side * random.random::<f64>(),
    };
    let mut sites: Vec<Point<D>> =
        (0..count).map(|_| std::array::from_fn(|_| coordinate(random))).collect();
    sites.sort_by(crate::geometry::lexicographic);
    sites.dedup();
    sites
}

/// The points of a lattice with the given basis in cubic cells, within the box, sides included.
fn crystal<const D: usize>(basis: &[Point<D>], edge: f64, bounds: &Bounds<D>) -> Vec<Point<D>> {
    let counts = bounds.extent().map(|e| (e / edge).ceil() as usize + 1);
    let mut sites = Vec::new();
    for n in 0..counts.iter().product() {
        let mut rest: usize = n;
        let cell: [usize; D] = std::array::from_fn(|k| {
            let at = rest % counts[k];
            rest /= counts[k];
            at
        });
        for shift in basis {
            let site = std::array::from_fn(|k| bounds.min[k] + edge * (cell[k] as f64 + shift[k]));
            sites.push(site);
        }
    }
    sites.retain(|p| bounds.contains(p));
    sites
}

/// The cell of site i as the box cut by every bisecting plane: whether `p` is in it, and how far inside.
fn depth<const D: usize>(sites: &[Point<D>], i: usize, p: &Point<D>) -> f64 {
    let to_others = sites.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, other)| {
        let axis = difference(other, &sites[i]);
        let length = dot(&axis, &axis).sqrt();
        (distance_squared(p, other) - distance_squared(p, &sites[i])) / (2.0 * length)
    });
    to_others.fold(f64::INFINITY, f64::min)
}

/// Every point of the mesh lies, to rounding, in the half-spaces of each of its cells, and a point in the box
/// is in the cell of its nearest site: both sides of "the cell is the intersection of the half-spaces".
fn cells_are_intersections_of_half_spaces<const D: usize>(
    sites: &[Point<D>],
    bounds: &Bounds<D>,
    random: &mut Pcg64,
) where
    Axes: Dimension<D>,
{
    let mesh = cells(sites, *bounds);
    let scale = mean_distance(bounds, sites.len());
    for cell in 0..mesh.cell_count() {
        for (face, _) in mesh.faces_of(cell) {
            for &c in mesh.face(face) {
                let p = &mesh.points()[c as usize];
                let off = depth(sites, cell, p);
                assert!(off >= -1e-9 * scale, "point {c} is {off:e} off cell {cell}");
                assert!(bounds.contains(p));
            }
        }
    }
    for _ in 0..100 {
        let p: Point<D> = std::array::from_fn(|k| {
            bounds.min[k] + random.random::<f64>() * (bounds.max[k] - bounds.min[k])
        });
        let nearest = (0..sites.len())
            .min_by(|&a, &b| {
                distance_squared(&p, &sites[a]).total_cmp(&distance_squared(&p, &sites[b]))
            })
            .unwrap();
        for (face, sign) in mesh.faces_of(nearest) {
            let normal = mesh.area_vector(face);
            let length = dot(&normal, &normal).sqrt();
            if length > 1e-9 * scale.powi(D as i32 - 1) {
                let v = difference(&p, &mesh.face_centroid(face));
                let above = sign * dot(&v, &normal) / length;
                assert!(above <= 1e-6 * scale, "{p:?} is {above:e} outside cell {nearest}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn random_cells_are_intersections_of_half_spaces(seed in any::<u64>(), count in 1usize..60) {
        let mut random = Pcg64::seed_from_u64(seed);
        let sites = scattered::<2>(count, 10.0, &mut random);
        cells_are_intersections_of_half_spaces(&sites, &cube(10.0), &mut random);
        let sites = scattered::<3>(count, 10.0, &mut random);
        cells_are_intersections_of_half_spaces(&sites, &cube(10.0), &mut random);
    }

    /// A crystal, each site moved by next to nothing: from exactly degenerate through every size of
    /// near-degenerate to plainly regular.
    #[test]
    fn almost_degenerate_cells_keep_every_promise(seed in any::<u64>(), digits in 4.0..17.0f64) {
        let mut random = Pcg64::seed_from_u64(seed);
        let jitter = 10f64.powf(-digits);
        let mut moved = |p: &mut f64, side: f64| {
            if *p > 0.0 && *p < side {
                *p += jitter * (random.random::<f64>() - 0.5);
            }
        };
        let bounds = cube::<3>(3.0);
        for basis in [&FCC[..], &BCC[..], &FCC[..1]] {
            let mut sites = crystal(basis, 1.0, &bounds);
            sites.iter_mut().flatten().for_each(|x| moved(x, 3.0));
            cells(&sites, bounds);
        }
        let bounds = cube::<2>(6.0);
        let mut sites = crystal(&[[0.0; 2]], 1.0, &bounds);
        sites.iter_mut().flatten().for_each(|x| moved(x, 6.0));
        cells(&sites, bounds);
    }

    /// Pairs and clusters of sites down to the least distance allowed.
    #[test]
    fn near_sites_have_their_own_cells(seed in any::<u64>(), digits in 1.0..5.0f64) {
        let mut random = Pcg64::seed_from_u64(seed);
        let gap = 10f64.powf(-digits);
        near_sites::<2>(gap, &mut random);
        near_sites::<3>(gap, &mut random);
    }
}

fn near_sites<const D: usize>(gap: f64, random: &mut Pcg64)
where
    Axes: Dimension<D>,
{
    let mut sites = scattered::<D>(20, 4.0, random);
    for n in 0..6 {
        let near = std::array::from_fn(|k| {
            let shift = gap * (1.0 + random.random::<f64>());
            if sites[n][k] > 2.0 { sites[n][k] - shift } else { sites[n][k] + shift }
        });
        sites.push(near);
    }
    cells(&sites, cube(4.0));
}

const FCC: [Point<3>; 4] = [[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
const BCC: [Point<3>; 2] = [[0.0; 3], [0.5; 3]];

/// How many faces the cell at the middle of a crystal has, and the measure of the cell.
fn middle_cell(basis: &[Point<3>], edge: f64, shift: f64) -> (Vec<usize>, f64) {
    let bounds = Bounds { min: [shift; 3], max: [shift + 4.0 * edge; 3] };
    let sites = crystal(basis, edge, &bounds);
    let mesh = cells(&sites, bounds);
    let middle = [shift + 2.0 * edge; 3];
    let near = |a: &usize, b: &usize| {
        distance_squared(&sites[*a], &middle).total_cmp(&distance_squared(&sites[*b], &middle))
    };
    let cell = (0..sites.len()).min_by(near).unwrap();
    let mut corners: Vec<usize> = mesh.faces_of(cell).map(|(f, _)| mesh.face(f).len()).collect();
    corners.sort_unstable();
    (corners, mesh.measures()[cell])
}

#[test]
fn crystals_have_the_cells_of_the_textbook() {
    // edges that are and are not binary fractions, boxes that do and do not begin at 0
    for (edge, shift) in [(1.0, 0.0), (0.7, 0.0), (8.0 / 3.0, -1.1), (1e3 / 7.0, 1e3)] {
        let (cubic, measure) = middle_cell(&FCC[..1], edge, shift);
        assert_eq!(cubic, [4; 6]);
        assert!((measure / edge.powi(3) - 1.0).abs() < 1e-12);
        // the truncated octahedron: six squares, eight hexagons
        let (truncated, measure) = middle_cell(&BCC, edge, shift);
        assert_eq!(truncated, [4, 4, 4, 4, 4, 4, 6, 6, 6, 6, 6, 6, 6, 6]);
        assert!((measure / edge.powi(3) - 0.5).abs() < 1e-12);
        // the rhombic dodecahedron, whose corners of degree four are six cospherical sites each
        let (rhombic, measure) = middle_cell(&FCC, edge, shift);
        assert_eq!(rhombic, [4; 12]);
        assert!((measure / edge.powi(3) - 0.25).abs() < 1e-12);
    }
}

#[test]
fn hexagons_have_six_edges_and_a_square_grid_four() {
    let bounds = Bounds { min: [0.0; 2], max: [9.0, 3.0 * 3f64.sqrt()] };
    let mut sites = Vec::new();
    for row in 0..7 {
        let start = if row % 2 == 0 { 0.0 } else { 0.5 };
        sites.extend((0..10).map(|i| [start + f64::from(i), f64::from(row) * 0.75f64.sqrt()]));
    }
    sites.iter_mut().for_each(|p| *p = bounds.clamp(p));
    sites.dedup();
    let mesh = cells(&sites, bounds);
    let middle = sites.iter().position(|p| p[0] == 4.0 && (p[1] - 3f64.sqrt()).abs() < 1e-9);
    assert_eq!(mesh.faces_of(middle.unwrap()).count(), 6);
    let sites = crystal(&[[0.05; 2]], 0.1, &cube(1.0));
    let mesh = cells(&sites, cube(1.0));
    assert_eq!((mesh.cell_count(), mesh.face_count(), mesh.points().len()), (100, 220, 121));
    assert!((0..100).all(|cell| mesh.faces_of(cell).count() == 4));
}

/// All sites on one circle or sphere, and sites at the corners of the box alone.
#[test]
fn sites_on_one_sphere_share_its_centre() {
    let round: Vec<Point<2>> = (0..360)
        .map(|n| f64::from(n).to_radians().sin_cos())
        .map(|(s, c)| [5.0 + 4.0 * c, 5.0 + 4.0 * s])
        .collect();
    let mesh = cells(&round, cube(10.0));
    let center = mesh.points().iter().filter(|p| distance_squared(p, &[5.0; 2]) < 1e-12).count();
    assert_eq!(center, 1);
    let corners: Vec<Point<3>> =
        (0..8).map(|n| std::array::from_fn(|k| f64::from(n >> k & 1))).collect();
    let mesh = cells(&corners, cube(1.0));
    assert_eq!((mesh.points().len(), mesh.inner_face_count()), (27, 12));
    assert!(mesh.measures().iter().all(|m| (m - 0.125).abs() < 1e-15));
}

#[test]
fn one_site_has_the_box_and_two_halve_it() {
    let mesh = cells(&[[1.0, 2.0, 0.5]], cube(3.0));
    assert_eq!((mesh.face_count(), mesh.points().len(), mesh.measures()), (6, 8, &[27.0][..]));
    assert_eq!(mesh.centroids(), [[1.5; 3]]);
    let mesh = cells(&[[0.0, 0.0], [4.0, 4.0]], cube(4.0));
    assert_eq!((mesh.measures(), mesh.face_count()), (&[8.0, 8.0][..], 5));
}

#[test]
fn a_connection_of_two_halves_is_known() {
    let bounds = Bounds { min: [0.0; 3], max: [4.0, 2.0, 3.0] };
    let mesh = cells(&[[0.0, 1.0, 1.0], [2.0, 1.0, 1.0]], bounds);
    let found = connections(&mesh);
    let [connection] = found[..] else { panic!("{found:?}") };
    let expected = Connection {
        cells: [0, 1],
        area: 6.0,
        distances: [1.0, 1.0],
        normal: [1.0, 0.0, 0.0],
        centroid: [1.0, 1.0, 1.5],
        orthogonality: 1.0,
    };
    assert_eq!(connection, expected);
    assert_eq!(connection.geometry(), 3.0);
    let sides = boundary_connections(&mesh);
    assert_eq!(sides.len(), 10);
    assert_eq!((sides[0].cell, sides[0].side, sides[0].area, sides[0].distance), (0, 0, 6.0, 0.0));
    assert_eq!((sides[1].cell, sides[1].side, sides[1].distance), (1, 1, 2.0));
    // outward normals of a closed box cancel
    let total: Point<3> = std::array::from_fn(|k| sides.iter().map(|s| s.area * s.normal[k]).sum());
    assert_eq!(total, [0.0; 3]);
}

#[test]
fn a_mirror_turns_loops_and_keeps_measures() {
    let mut random = Pcg64::seed_from_u64(5);
    let sites = scattered::<3>(40, 5.0, &mut random);
    let mesh = cells(&sites, cube(5.0));
    let image = mesh.moved(true, |p| [-p[0], 2.0 * p[1], p[2] + 1.0]);
    let bounds = Bounds { min: [-5.0, 0.0, 1.0], max: [0.0, 10.0, 6.0] };
    // sides keep the names of the image's axes, so they are not checked
    assert!((image.measure() / bounds.measure() - 1.0).abs() < 1e-13);
    assert!(image.measures().iter().zip(mesh.measures()).all(|(a, b)| (a - 2.0 * b).abs() < 1e-12));
}

#[test]
fn the_same_cells_at_any_number_of_threads() {
    let mut random = Pcg64::seed_from_u64(9);
    let sites = scattered::<3>(5000, 20.0, &mut random);
    let mesh = cells(&sites, cube(20.0));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(pool.install(|| cells(&sites, cube(20.0))) == mesh);
}

#[test]
fn what_cannot_be_done_is_said() {
    let run =
        |sites: &[Point<2>], bounds| voronoi(&Delaunay::<2>::new(), sites, bounds, &mut Silent);
    assert_eq!(run(&[], cube(1.0)).unwrap_err(), VoronoiError::NoSites);
    let outside = run(&[[0.5, 0.5], [2.0, 0.5]], cube(1.0)).unwrap_err();
    assert_eq!(outside, VoronoiError::Outside { site: 1, place: vec![2.0, 0.5] });
    let nowhere = run(&[[f64::NAN, 0.5]], cube(1.0)).unwrap_err();
    assert!(matches!(nowhere, VoronoiError::Outside { site: 0, .. }));
    let flat = Bounds { min: [0.0; 2], max: [1.0, 0.0] };
    assert_eq!(run(&[[0.5, 0.0]], flat), Err(VoronoiError::Bounds { axis: 1, extent: 0.0 }));
    let close = run(&[[0.5, 0.5], [0.2, 0.1], [0.5, 0.5 + 1e-9]], cube(1.0)).unwrap_err();
    assert!(matches!(close, VoronoiError::Close { sites: [0, 2], .. }), "{close}");
    let same = run(&[[0.5, 0.5], [0.5, 0.5]], cube(1.0)).unwrap_err();
    assert!(matches!(same, VoronoiError::Connect(ConnectError::Duplicate { .. })), "{same}");
}

#[test]
fn validate_names_what_is_broken() {
    let mesh = cells(&[[1.0, 1.0], [3.0, 1.0], [2.0, 3.0]], cube(4.0));
    let wider = mesh.validate(&cube(4.5)).unwrap_err();
    assert!(matches!(wider, PolyFault::Side { side: 1, .. }), "{wider}");
    let bent =
        mesh.moved(false, |p| if *p == mesh.points()[0] { [p[0] + 0.5, p[1] + 0.3] } else { *p });
    assert!(bent.validate(&cube(4.0)).is_err());
    let turned = mesh.moved(true, |p| *p).validate(&cube(4.0)).unwrap_err();
    assert!(matches!(turned, PolyFault::Measure { cell: 0, .. }), "{turned}");
}

/// A feature of standard deviation `width`, 1 on the plane y = `height` of a cube of `side` samples.
fn sheet<const D: usize>(side: usize, height: f64, width: f64) -> ScalarField<D> {
    let grid = Grid { shape: [side + 1; D], step: [1.0; D] };
    let value = |n: usize| {
        let p: Point<D> =
            std::array::from_fn(|k| (n / (side + 1).pow(k as u32) % (side + 1)) as f64);
        let s = (p[1] - height) / width;
        (-0.5 * s * s).exp() as f32
    };
    let samples = (0..(side + 1).pow(D as u32)).map(value).collect();
    ScalarField::potential(grid, samples, Default::default()).unwrap()
}

fn faces_lie_along_features<const D: usize>()
where
    Axes: Dimension<D>,
{
    // sites 10 apart, faces half way: those at y = 25 lie on the feature, those beside it reach into it
    let bounds = cube::<D>(40.0);
    let mesh = cells(&crystal(&[[0.0; D]], 10.0, &bounds), bounds);
    let features = feature_faces(&mesh, &sheet::<D>(40, 25.0, 3.0), 0.2, 0.0);
    let on: Vec<usize> = (0..mesh.face_count()).filter(|&f| features.of_faces[f] > 0).collect();
    let is_there = |&face: &usize| (mesh.face_centroid(face)[1] - 25.0).abs() < 1e-9;
    assert!(on.iter().all(is_there), "none stands across");
    assert_eq!(on.len(), 5_usize.pow(D as u32 - 1), "all that are there");
    assert!((features.areas[0] - 40.0_f64.powi(D as i32 - 1)).abs() < 1e-9, "one feature");
    let across = (0..mesh.inner_face_count()).filter(|face| !on.contains(face));
    let most = across.map(|face| features.strengths[face]).fold(0.0, f32::max);
    assert!(most > 0.2, "faces across are as strong as the threshold: {most}");
}

#[test]
fn faces_of_features_lie_along_them() {
    faces_lie_along_features::<2>();
    faces_lie_along_features::<3>();
}

#[test]
fn cells_have_all_of_an_image_between_them() {
    let frame = Frame::new([7, 6, 5]).unwrap();
    let samples: Vec<f32> = (0..210).map(|i| (i % 11) as f32).collect();
    let image = Image::new(frame, Samples::F32(samples.into())).unwrap();
    let bounds = Bounds { min: [0.0; 3], max: [6.0, 5.0, 4.0] };
    let sites = [[1.0, 1.0, 1.0], [5.0, 1.5, 2.0], [3.0, 4.5, 3.0], [2.0, 3.0, 0.5]];
    let cells = voronoi(&Delaunay::<3>::new(), &sites, bounds, &mut Silent).unwrap();
    let options = SampleOptions::new(&[Statistic::Total, Statistic::Mean]);
    let found = sample(&cells, &image, options, &mut Silent).unwrap();
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    // roundings of some hundred sums
    assert!((sum(&found.measures) - 120.0).abs() < 1e-10);
    for (own, measure) in found.measures.iter().zip(cells.measures()) {
        assert!((own - measure).abs() < 1e-10);
    }
    let by_means: f64 = found.values[1].iter().zip(&found.measures).map(|(m, v)| m * v).sum();
    assert!((by_means - sum(&found.values[0])).abs() < 1e-9, "means weigh by volume");
}

/// The parts of a mesh, without its sites.
fn parts<const D: usize>(mesh: &PolyMesh<D>) -> PolyParts<D> {
    let ends = (0..mesh.face_count()).scan(0, |end, face| {
        *end += mesh.face(face).len();
        Some(*end)
    });
    let side_counts =
        std::array::from_fn(|side| if side < 2 * D { mesh.side(side).len() } else { 0 });
    PolyParts {
        points: mesh.points().to_vec(),
        corners: mesh.corners().to_vec(),
        ends: ends.collect(),
        owners: mesh.owners().to_vec(),
        neighbours: mesh.neighbours().to_vec(),
        side_counts,
        sites: None,
    }
}

fn cells_without_sites_have_the_same_shape<const D: usize>()
where
    Axes: Dimension<D>,
{
    let bounds = cube(4.0);
    let mesh = cells(&scattered::<D>(40, 4.0, &mut Pcg64::seed_from_u64(3)), bounds);
    let bare = PolyMesh::new(parts(&mesh)).unwrap();
    assert_eq!(bare.validate(&bounds), Ok(()));
    assert_eq!((bare.sites(), bare.cell_count()), (None, mesh.cell_count()));
    assert_eq!(bare.centers(), bare.centroids());
    for cell in 0..mesh.cell_count() {
        // sums of some ten products of coordinates up to 4
        assert!((bare.measures()[cell] - mesh.measures()[cell]).abs() < 1e-12);
        let off = distance_squared(&bare.centroids()[cell], &mesh.centroids()[cell]).sqrt();
        assert!(off * mesh.measures()[cell] < 1e-12, "cell {cell}: {off}");
    }
    let moved = bare.moved(true, |p| std::array::from_fn(|k| if k == 0 { -p[0] } else { p[k] }));
    assert!((moved.measure() - bounds.measure()).abs() < 1e-10);
}

#[test]
fn a_mesh_needs_no_sites() {
    cells_without_sites_have_the_same_shape::<2>();
    cells_without_sites_have_the_same_shape::<3>();
}

#[test]
fn parts_that_do_not_fit_are_named() {
    let whole = parts(&cells(&[[1.0, 1.0], [3.0, 1.0]], Bounds { min: [0.0; 2], max: [4.0, 2.0] }));
    let fault = |change: &dyn Fn(&mut PolyParts<2>)| {
        let mut parts = whole.clone();
        change(&mut parts);
        PolyMesh::new(parts).unwrap_err().to_string()
    };
    assert_eq!(fault(&|p| p.ends.truncate(6)), "6 ends of faces; expected 7");
    assert_eq!(fault(&|p| p.side_counts[1] = 2), "8 faces inside and on sides; expected 7");
    assert_eq!(fault(&|p| p.corners.push(0)), "15 corners; expected 14");
    assert!(fault(&|p| p.ends[0] = 1).starts_with("face 0 has the points"));
    assert_eq!(fault(&|p| p.corners[3] = 9), "face 1 names point 9; there are 6");
    assert_eq!(fault(&|p| p.sites = Some(vec![[1.0; 2]])), "face 0 names cell 1; there are 1");
    assert!(fault(&|p| p.points[0] = [f64::NAN; 2]).contains("has the measure"));
}
