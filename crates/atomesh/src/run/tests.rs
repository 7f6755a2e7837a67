//! From images of all kinds to meshes or clear refusals.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::enhance::{FeatureOptions, Features};
use crate::fields::{DistanceError, GradeBy, Interpolation};
use crate::geometry::{Point, difference};
use crate::image::{Frame, Image, Samples, Units};
use crate::improve::Align;
use crate::lattice::LatticeError;
use crate::mesh::Mesh;
use crate::optimize::{EngineKind, OptimizeOptions};
use crate::watch::{Phase, Silent, Watch};

fn image<const D: usize>(frame: Frame<D>, grey: impl Fn([usize; D]) -> f32) -> Image<D> {
    let shape = frame.shape();
    let samples = (0..frame.sample_count())
        .map(|mut i| {
            grey(std::array::from_fn(|k| {
                let index = i % shape[k];
                i /= shape[k];
                index
            }))
        })
        .collect();
    Image::new(frame, Samples::F32(samples)).unwrap()
}

/// A dark sheet across the box, its normal along x and y, on grey.
fn sheet<const D: usize>(frame: Frame<D>) -> Image<D> {
    let n = frame.shape();
    image(frame, |i| {
        let x = i[0] as f32 - 0.4 * n[0] as f32 + 0.3 * (i[1] as f32 - 0.5 * n[1] as f32);
        150.0 - 120.0 * (-0.5 * (x / 1.4).powi(2)).exp()
    })
}

fn sized<const D: usize>(d: f64) -> MeshOptions<D> {
    MeshOptions { size: Size::Constant(d), ..Default::default() }
}

fn run<const D: usize>(
    method: &Method<D>,
    image: &Image<D>,
    options: MeshOptions<D>,
) -> Result<Outcome<D>, RunError> {
    prepare(method, Inputs::image(image), options, &mut Silent)?.run(&mut Silent)
}

/// What every outcome promises.
fn assert_sound<const D: usize>(outcome: &Outcome<D>, what: &str) {
    let mesh = outcome.mesh();
    assert_eq!(mesh.validate(), Ok(()), "{what}");
    let bounds = outcome.potential().grid().bounds();
    // compensated sum: what is left are roundings of single cells
    assert!((mesh.measure() / bounds.measure() - 1.0).abs() < 1e-12, "{what}");
    assert!(mesh.points().iter().all(|p| bounds.contains(p)), "{what}");
    assert_eq!(mesh.points().len(), outcome.distance_at_points().len(), "{what}");
    assert_eq!(mesh.points().len(), outcome.potential_at_points().len(), "{what}");
    let d = outcome.distance();
    let range = (d.least() as f32 * (1.0 - 1e-6))..=(d.greatest() as f32 * (1.0 + 1e-6));
    assert!(outcome.distance_at_points().iter().all(|d| range.contains(d)), "{what}");
    assert!(outcome.potential_at_points().iter().all(|b| b.abs() <= 1.0), "{what}");
    for stage in &outcome.optimize_report().stages {
        assert!(stage.energy_last <= stage.energy_first, "{what}: {stage:?}");
    }
    if let Some(cells) = outcome.cells() {
        assert_eq!(cells.validate(&bounds), Ok(()), "{what}");
        assert!((cells.measure() / bounds.measure() - 1.0).abs() < 1e-12, "{what}");
    }
}

fn one_of<T: Clone>(random: &mut Pcg64, choices: &[T]) -> T {
    choices[random.random_range(0..choices.len())].clone()
}

/// An image of noise, waves, steps or nothing, in a frame of any kind.
fn random_image<const D: usize>(random: &mut Pcg64, greatest: usize) -> Image<D> {
    let shape: [usize; D] = std::array::from_fn(|_| random.random_range(2..=greatest));
    let spacing: [f64; D] =
        std::array::from_fn(|_| one_of(random, &[1.0, 1.0, 0.5, 2.5, 0.013, 40.0]));
    let origin: [f64; D] = std::array::from_fn(|_| 1e3 * (random.random::<f64>() - 0.5));
    let frame = Frame::new(shape).unwrap().with_spacing(spacing).unwrap();
    let frame = frame.with_origin(origin).unwrap();
    let (kind, noise) = (random.random_range(0..5), one_of(random, &[0.0, 0.1, 1.0]));
    let wave: f32 = 0.2 + 0.8 * random.random::<f32>();
    let seed = random.random::<f32>();
    image(frame, |i| {
        let x: f32 = i.iter().enumerate().map(|(k, &i)| i as f32 * (1.0 + k as f32)).sum();
        let hash = ((x + seed) * 12.9898).sin() * 43_758.547;
        let noise = noise * (hash - hash.floor());
        let signal = match kind {
            0 => 0.0,
            1 => (wave * x).sin(),
            2 => f32::from(u8::from(x as usize % 17 < 4)),
            3 => f32::from(u8::from(i[0] * 2 > shape[0])),
            _ => x / 50.0,
        };
        100.0 * (signal + noise)
    })
}

/// Lattices to choose from; in the plane the last one is refused.
fn lattices<const D: usize>() -> &'static [LatticeKind] {
    use LatticeKind::{Bcc, Default, Fcc, Hexagonal, Random};
    match D {
        2 => &[Default, Hexagonal, Random, Random, Default, Bcc],
        _ => &[Default, Fcc, Random, Bcc, Fcc, Random],
    }
}

/// Sizes to choose from, about `d`; the last one is refused.
fn sizes(d: f64) -> [Size; 8] {
    [
        Size::Default,
        Size::Constant(d),
        Size::Constant(0.5 * d),
        Size::Constant(9.0 * d),
        Size::Range { min: d, max: 3.0 * d },
        Size::Range { min: 1.3 * d, max: 2.0 * d },
        Size::Constant(1.7 * d),
        Size::Range { min: 2.0 * d, max: d },
    ]
}

fn random_options<const D: usize>(random: &mut Pcg64, image: &Image<D>) -> MeshOptions<D> {
    let frame = image.frame();
    let units = one_of(random, &[Units::Physical, Units::Samples]);
    let grid = frame.grid(units);
    // no more than a few thousand atoms
    let per_axis = if D == 2 { 30.0 } else { 10.0 };
    let extent = grid.bounds().extent();
    let volume = extent.iter().product::<f64>().powf(1.0 / D as f64);
    let d =
        (volume / per_axis * (0.9 + 6.0 * random.random::<f64>().powi(2))).max(grid.least_step());
    let features = [Features::Dark, Features::Bright, Features::Edges, Features::None];
    let seed_points = if random.random_range(0..4) == 0 {
        let inside = std::array::from_fn(|k| extent[k] * random.random::<f64>());
        vec![frame.lattice_to_world(units, &inside)]
    } else {
        Vec::new()
    };
    MeshOptions {
        features: FeatureOptions {
            features: one_of(random, &features),
            smooth: one_of(random, &[None, Some(0.0), Some(0.3 * d)]),
            repel: random.random_range(0..5) == 0,
            ..Default::default()
        },
        interpolation: one_of(
            random,
            &[Interpolation::Linear, Interpolation::Spline, Interpolation::Nearest],
        ),
        mixture: None,
        kind: MeshKind::default(),
        mirror: true,
        units,
        size: one_of(random, &sizes(d)),
        grade_by: one_of(random, &[GradeBy::Density, GradeBy::Curvature, GradeBy::Distance]),
        image_weight: one_of(random, &[0.0, 0.3, 0.4, 0.5, 0.5, 0.7, 0.9, 1.0, 1.0, 1.1]),
        lattice: one_of(random, lattices::<D>()),
        spacing_factor: one_of(random, &[0.8, 0.8, 0.6, 1.0]),
        seed_points,
        optimize: OptimizeOptions {
            engine: one_of(random, &[EngineKind::Pairs, EngineKind::Pairs, EngineKind::Sampled]),
            smoothing_steps: random.random_range(0..3),
            inner_limit: 20,
            outer_limit: 2,
            seed: random.random(),
            ..Default::default()
        },
        improve: crate::improve::ImproveOptions::for_dimension(D),
        least_island: random.random_range(0..9),
        memory_limit: None,
    }
}

/// Runs many images; returns how many ended in a mesh.
fn meshes_or_refusals<const D: usize>(
    method: &Method<D>,
    mesh_kind: MeshKind,
    count: u64,
    greatest: usize,
) -> u64 {
    let mut meshes = 0;
    for seed in 0..count {
        let mut random = Pcg64::seed_from_u64(seed);
        let image = random_image::<D>(&mut random, greatest);
        let mut options = MeshOptions { kind: mesh_kind, ..random_options(&mut random, &image) };
        options.features.repel |= mesh_kind == MeshKind::Voronoi && seed % 2 == 0;
        if seed % 3 == 0 {
            options.improve.align = Align::Conform;
        }
        let what = format!("{D}-D, seed {seed}: {:?} {options:?}", image.frame());
        let (kind, weight) = (options.lattice, options.image_weight);
        let (chosen, step) = (options.size, image.frame().grid(options.units).least_step());
        match run(method, &image, options) {
            Ok(outcome) => {
                assert_sound(&outcome, &what);
                meshes += 1;
            }
            // every refusal names what was asked for and could not be
            Err(RunError::LatticeDimension { .. }) => {
                assert_eq!((D, kind), (2, LatticeKind::Bcc))
            }
            Err(RunError::Potential(_)) => assert_eq!(weight, 1.1),
            Err(RunError::Distance(DistanceError::BelowStep { value, .. })) => {
                assert!(value < step, "{what}");
            }
            Err(RunError::Distance(DistanceError::Order { .. })) => {
                assert!(matches!(chosen, Size::Range { min, max } if min > max), "{what}");
            }
            Err(error) => panic!("{what}: {error}"),
        }
    }
    meshes
}

#[test]
fn any_flat_image_ends_in_a_mesh_or_a_clear_refusal() {
    let meshes = meshes_or_refusals(&Method::plane(), MeshKind::Delaunay, 140, 40);
    assert!(meshes > 70, "{meshes}"); // some 45 of 100 ask for what there is not
}

#[test]
fn any_volume_ends_in_a_mesh_or_a_clear_refusal() {
    let meshes = meshes_or_refusals(&Method::space(), MeshKind::Delaunay, 60, 12);
    assert!(meshes > 30, "{meshes}");
}

#[test]
fn any_image_ends_in_voronoi_cells_or_a_clear_refusal() {
    let meshes = meshes_or_refusals(&Method::plane(), MeshKind::Voronoi, 60, 30);
    assert!(meshes > 25, "{meshes}");
    let meshes = meshes_or_refusals(&Method::space(), MeshKind::Voronoi, 30, 10);
    assert!(meshes > 12, "{meshes}");
}

#[test]
fn a_constant_image_gives_a_warning_and_a_regular_mesh() {
    let flat = image(Frame::new([40, 30]).unwrap(), |_| 7.0);
    for features in [Features::Dark, Features::Bright, Features::Edges] {
        let features = FeatureOptions { features, ..Default::default() };
        let outcome = run(&Method::plane(), &flat, MeshOptions { features, ..sized(4.0) }).unwrap();
        assert_sound(&outcome, "constant");
        assert_eq!(outcome.warnings(), [Warning::Constant]);
        assert!(outcome.potential_at_points().iter().all(|b| *b == 0.0));
    }
    // who asks for nothing needs no warning
    let features = FeatureOptions { features: Features::None, ..Default::default() };
    let outcome = run(&Method::plane(), &flat, MeshOptions { features, ..sized(4.0) }).unwrap();
    assert_eq!(outcome.warnings(), []);
}

#[test]
fn edges_are_a_share_of_a_wavelength() {
    // 1500 to 2100 m/s over 2000 m: a slope of d of 0.03, well below the limit
    let frame = Frame::new([101, 101]).unwrap().with_spacing([20.0, 20.0]).unwrap();
    let velocities = image(frame, |i| 1500.0 + 6.0 * i[1] as f32);
    let features = FeatureOptions { features: Features::None, ..Default::default() };
    let size = Size::Wavelength { frequency: 2.0, points: 5.0, least: None, greatest: None };
    let options = MeshOptions { features, size, ..Default::default() };
    let outcome = run(&Method::plane(), &velocities, options.clone()).unwrap();
    assert_sound(&outcome, "wavelength");
    let distance = outcome.distance();
    for depth in [0.0, 500.0, 1700.0] {
        let expected = (1500.0 + 0.3 * depth) / 10.0;
        let found = distance.at(&[900.0, depth]);
        // nodes hold the least d within half a node, 40 m at most, of theirs
        assert!((found - expected).abs() < 0.03 * 80.0, "{found} at {depth}; expected {expected}");
    }
    let mean = outcome.report(&mut Silent).unwrap().shape.edge_mean;
    assert!((160.0..205.0).contains(&mean), "{mean}: about 180, the middle of 150 to 210");
    let still = image(frame, |i| if i == [5, 1] { 0.0 } else { 1500.0 });
    let error = run(&Method::plane(), &still, options.clone()).unwrap_err().to_string();
    assert!(error.contains("1 of 10201 velocities") && error.contains("sample 106: 0"), "{error}");
    // with bounds, still water takes the least length, and rock no more than the greatest
    let size =
        Size::Wavelength { frequency: 2.0, points: 5.0, least: Some(90.0), greatest: Some(120.0) };
    let outcome = run(&Method::plane(), &still, MeshOptions { size, ..options }).unwrap();
    assert!(outcome.warnings().iter().any(|w| matches!(w, Warning::NoVelocity { count: 1, .. })));
    assert_eq!((outcome.distance().least(), outcome.distance().greatest()), (90.0, 120.0));
}

#[test]
fn a_distance_beyond_the_box_gives_a_warning_and_the_coarsest_mesh() {
    let flat = sheet(Frame::new([30, 20]).unwrap());
    let outcome = run(&Method::plane(), &flat, sized(100.0)).unwrap();
    assert_sound(&outcome, "coarse");
    assert!(matches!(outcome.warnings(), [Warning::Coarse { distance: 100.0, .. }]));
    assert_eq!((outcome.mesh().points().len(), outcome.mesh().cell_count()), (4, 2));
    let solid = sheet(Frame::new([12, 9, 10]).unwrap());
    let outcome = run(&Method::space(), &solid, sized(100.0)).unwrap();
    assert_sound(&outcome, "coarse");
    assert_eq!(outcome.mesh().points().len(), 8);
    // a box is cut into five or six tetrahedra
    assert!((5..=6).contains(&outcome.mesh().cell_count()));
}

#[test]
fn what_cannot_be_meshed_is_refused_by_name() {
    let flat = sheet(Frame::new([30, 20]).unwrap());
    let refused = |image: &Image<2>, options| {
        run(&Method::plane(), image, options).expect_err("should be refused").to_string()
    };
    assert!(refused(&flat, sized(0.5)).contains("0.5 is below the sample step 1"));
    assert!(refused(&flat, sized(f64::NAN)).contains("NaN"));
    assert!(refused(&flat, sized(-3.0)).contains("-3"));
    let line = image(Frame::new([1, 20]).unwrap(), |_| 0.0);
    assert!(refused(&line, sized(4.0)).contains("1 sample along x"));
    let line = image(Frame::new([20, 1]).unwrap(), |_| 0.0);
    assert!(refused(&line, sized(4.0)).contains("1 sample along y"));
    let holed = image(Frame::new([20, 20]).unwrap(), |i| if i == [3, 4] { f32::NAN } else { 1.0 });
    assert!(refused(&holed, sized(4.0)).contains("sample 83"));
    let options = MeshOptions { seed_points: vec![[5.0, 19.5]], ..sized(4.0) };
    assert!(refused(&flat, options).contains("seed point 0"));
    let options = MeshOptions { lattice: LatticeKind::Fcc, ..sized(4.0) };
    assert!(refused(&flat, options).contains("fcc does not exist in 2-D; choose hexagonal"));
    let options = MeshOptions { spacing_factor: 2.0, ..sized(4.0) };
    assert!(refused(&flat, options).contains("spacing factor 2"));
    let small = sheet(Frame::new([30, 19]).unwrap());
    for (name, inputs) in [
        ("size field", Inputs { size_field: Some(&small), ..Inputs::image(&flat) }),
        ("weight field", Inputs { weight_field: Some(&small), ..Inputs::image(&flat) }),
    ] {
        let error = prepare(&Method::plane(), inputs, sized(4.0), &mut Silent).err().unwrap();
        assert!(error.to_string().contains(name), "{error}");
        assert!(error.to_string().contains("[30, 19]"), "{error}");
    }
    let inputs = Inputs { is_potential: true, ..Inputs::image(&flat) };
    let error = prepare(&Method::plane(), inputs, sized(4.0), &mut Silent).err().unwrap();
    assert!(error.to_string().contains("potential"), "{error}");
    let line = image(Frame::new([9, 8, 1]).unwrap(), |_| 0.0);
    let error = run(&Method::space(), &line, sized(4.0)).unwrap_err();
    assert_eq!(error, RunError::Thin { axis: 2 });
}

#[test]
fn a_memory_limit_refuses_with_advice() {
    let flat = sheet(Frame::new([60, 60]).unwrap());
    let options = MeshOptions { memory_limit: Some(1 << 20), ..sized(4.0) };
    let error = run(&Method::plane(), &flat, options).unwrap_err();
    assert!(matches!(error, RunError::Memory { available: 1_048_576, .. }));
    let text = error.to_string();
    assert!(text.contains("1 MiB available") && text.contains("distance above 4"), "{text}");
    let options = MeshOptions { memory_limit: Some(1 << 30), ..sized(4.0) };
    assert!(run(&Method::plane(), &flat, options).is_ok());
}

/// The root mean square of the edge components along each axis.
fn edge_components<const D: usize>(mesh: &Mesh<D>) -> [f64; D] {
    let mut sums = [0.0; D];
    let mut count = 0.0;
    for cell in mesh.cells() {
        for (at, &a) in cell.iter().enumerate() {
            for &b in &cell[..at] {
                let v = difference(&mesh.points()[a as usize], &mesh.points()[b as usize]);
                (0..D).for_each(|k| sums[k] += v[k] * v[k]);
                count += 1.0;
            }
        }
    }
    sums.map(|s: f64| (s / count).sqrt())
}

#[test]
fn edges_are_as_long_along_every_axis_whatever_the_spacings_are() {
    // a cube of 36 with a sphere in it, sampled four times as coarsely along z
    let frame = Frame::new([37, 37, 10]).unwrap().with_spacing([1.0, 1.0, 4.0]).unwrap();
    let ball = image(frame, |i| {
        let r: f32 =
            (0..3).map(|k| (i[k] as f32 * frame.spacing()[k] as f32 - 18.0).powi(2)).sum::<f32>();
        if r.sqrt() < 12.0 { 200.0 } else { 60.0 }
    });
    let features = FeatureOptions { features: Features::Edges, ..Default::default() };
    let outcome = run(&Method::space(), &ball, MeshOptions { features, ..sized(4.0) }).unwrap();
    assert_sound(&outcome, "unequal spacings");
    let rms = edge_components(outcome.mesh());
    let mean = rms.iter().sum::<f64>() / 3.0;
    // BCC has the same components along its three axes; sides of the box are alike too
    assert!(rms.iter().all(|c| (c / mean - 1.0).abs() < 0.05), "{rms:?}");
}

#[test]
fn in_sample_units_the_spacing_places_the_mesh_and_changes_nothing_else() {
    let unit = Frame::new([50, 40]).unwrap();
    let spaced = unit.with_spacing([0.5, 2.0]).unwrap();
    let options = || MeshOptions { units: Units::Samples, ..sized(5.0) };
    let a = run(&Method::plane(), &sheet(unit), options()).unwrap();
    let b = run(&Method::plane(), &sheet(spaced), options()).unwrap();
    assert_eq!(a.mesh(), b.mesh());
    assert_eq!(a.mesh(), &b.sample_mesh());
    let world: Vec<Point<2>> = a.mesh().points().iter().map(|p| [0.5 * p[0], 2.0 * p[1]]).collect();
    assert_eq!(b.world_mesh().points(), world);
    // and a unit frame is the same in both units
    let c = run(&Method::plane(), &sheet(unit), sized(5.0)).unwrap();
    assert_eq!(a.mesh(), c.mesh());
}

#[test]
fn rotated_and_mirrored_frames_place_the_mesh_and_change_nothing_else() {
    let plain = Frame::new([16, 14, 12]).unwrap().with_spacing([1.0, 1.5, 2.0]).unwrap();
    let method = Method::space();
    let reference = run(&method, &sheet(plain), sized(4.0)).unwrap();
    let (s, c) = 0.3f64.sin_cos();
    let directions = [
        [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
        [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]],
        [[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, 1.0]],
    ];
    for direction in directions {
        let frame =
            plain.with_direction(direction).unwrap().with_origin([-30.0, 7.0, 900.0]).unwrap();
        let outcome = run(&method, &sheet(frame), sized(4.0)).unwrap();
        assert_eq!(outcome.mesh(), reference.mesh(), "{direction:?}");
        let world = outcome.world_mesh();
        assert_eq!(world.validate(), Ok(()), "{direction:?}");
        let expected = outcome.mesh().measure();
        // coordinates of 900 round by 1e-13, cells are some 2 high
        assert!((world.measure() / expected - 1.0).abs() < 1e-11, "{direction:?}");
        for (p, q) in world.points().iter().zip(outcome.mesh().points()) {
            let back = frame.world_to_lattice(Units::Physical, p);
            assert!((0..3).all(|k| (back[k] - q[k]).abs() < 1e-11), "{direction:?}: {p:?} {q:?}");
        }
    }
}

#[test]
fn seed_points_of_the_world_are_points_of_the_mesh() {
    let (s, c) = 0.3f64.sin_cos();
    let frame = Frame::new([40, 30]).unwrap().with_spacing([0.5, 1.25]).unwrap();
    let frame = frame.with_direction([[c, s], [s, -c]]).unwrap().with_origin([5e3, -7e3]).unwrap();
    for units in [Units::Physical, Units::Samples] {
        for lattice in [LatticeKind::Hexagonal, LatticeKind::Random] {
            // inside, and on a side, which rounding puts a little outside
            let seeds = [[6.25, 17.5], [0.0, 11.25]].map(|p| frame.lattice_to_world(units, &p));
            let options = MeshOptions { units, lattice, seed_points: seeds.to_vec(), ..sized(3.0) };
            let outcome = run(&Method::plane(), &sheet(frame), options).unwrap();
            assert_sound(&outcome, "seeds");
            for seed in seeds {
                let mesh = outcome.world_mesh();
                let near = |p: &Point<2>| crate::geometry::distance_squared(p, &seed) < 1e-20;
                assert!(mesh.points().iter().any(near), "{units:?} {lattice:?} {seed:?}");
            }
            // and are tagged, in the order given
            let tags = outcome.tags().unwrap();
            let names = tags.point_groups().iter().map(|group| group.name.as_str());
            assert_eq!(names.collect::<Vec<_>>(), ["well-1", "well-2"]);
            for (group, seed) in tags.point_groups().iter().zip(&seeds) {
                let p = outcome.world_mesh().points()[group.points[0] as usize];
                assert!(crate::geometry::distance_squared(&p, seed) < 1e-20, "{}", group.name);
            }
        }
    }
}

#[test]
fn a_run_gives_the_same_bits_at_any_number_of_threads() {
    let solid = sheet(Frame::new([26, 24, 22]).unwrap());
    let flat = sheet(Frame::new([80, 70]).unwrap());
    let meshes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let graded = MeshOptions { size: Size::Range { min: 2.0, max: 6.0 }, ..sized(2.0) };
            let random = MeshOptions { lattice: LatticeKind::Random, ..graded.clone() };
            let bits = |o: &Outcome<3>| (o.mesh().clone(), o.optimize_report().clone());
            let method = Method::space();
            let a = run(&method, &solid, graded).unwrap();
            let b = run(&method, &solid, random).unwrap();
            let c = run(&Method::plane(), &flat, sized(3.0)).unwrap();
            (bits(&a), bits(&b), c.mesh().clone())
        })
    };
    assert_eq!(meshes(1), meshes(3));
}

fn estimates_are_near<const D: usize>(method: &Method<D>, shapes: &[[usize; D]], sizes: &[Size]) {
    let kinds: &[LatticeKind] = if D == 2 {
        &[LatticeKind::Hexagonal, LatticeKind::Random]
    } else {
        &[LatticeKind::Bcc, LatticeKind::Fcc, LatticeKind::Random]
    };
    let mut faults = Vec::new();
    for &shape in shapes {
        let image = sheet(Frame::new(shape).unwrap());
        for &size in sizes {
            for &lattice in kinds {
                let options = MeshOptions { size, lattice, ..Default::default() };
                let prepared =
                    prepare(method, Inputs::image(&image), options, &mut Silent).unwrap();
                let estimate = prepared.estimate().atoms as f64;
                let actual = prepared.fill(&mut Silent).unwrap().lattice().len() as f64;
                if (estimate / actual - 1.0).abs() > 0.15 {
                    faults.push(format!(
                        "{shape:?} {size:?} {lattice:?}: {estimate} estimated, {actual} found, {:.2}",
                        estimate / actual
                    ));
                }
            }
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_number_of_atoms_is_known_to_15_percent() {
    let sizes = [Size::Constant(3.0), Size::Constant(6.0), Size::Range { min: 3.0, max: 9.0 }];
    estimates_are_near(&Method::plane(), &[[100, 100], [200, 40], [60, 90]], &sizes);
    let sizes = [Size::Constant(3.0), Size::Constant(5.0), Size::Range { min: 2.5, max: 6.0 }];
    estimates_are_near(&Method::space(), &[[30, 30, 30], [50, 30, 18]], &sizes);
}

#[test]
fn lengths_of_any_magnitude_are_meshed_and_absurd_ones_refused() {
    for scale in [1e-300, 1e-160, 1e-31, 1e-29, 1e-9, 1e9, 1e28, 1e31, 1e160, 1e300] {
        let frame = Frame::new([30, 20]).unwrap().with_spacing([scale; 2]).unwrap();
        match run(&Method::plane(), &sheet(frame), sized(4.0 * scale)) {
            Ok(outcome) => {
                assert_sound(&outcome, &format!("{scale:e}"));
                assert_eq!(outcome.world_mesh().validate(), Ok(()));
                assert!((1e-30..=1e30).contains(&scale), "{scale:e} meshed");
            }
            Err(error) => {
                let absurd = matches!(error, RunError::Lattice(LatticeError::Scale { .. }));
                assert!(absurd && !(1e-30..=1e30).contains(&scale), "{scale:e}: {error}");
            }
        }
    }
}

#[test]
fn a_report_of_the_mesh_is_in_range() {
    let outcome = run(&Method::plane(), &sheet(Frame::new([80, 70]).unwrap()), sized(6.0)).unwrap();
    let report = outcome.report(&mut Silent).unwrap();
    let recall = report.alignment.recall.expect("a sheet is a feature");
    assert!(recall > 0.5 && recall <= 1.0, "a straight sheet is easy: {report:?}");
}

/// Ends the work at a given call.
struct EndAt(usize);

impl Watch for EndAt {
    fn step(&mut self, _: Phase, done: f64, _: Option<f64>) -> std::ops::ControlFlow<()> {
        assert!((0.0..=1.0).contains(&done));
        if self.0 == 0 {
            return std::ops::ControlFlow::Break(());
        }
        self.0 -= 1;
        std::ops::ControlFlow::Continue(())
    }
}

#[test]
fn a_watch_ends_a_run_in_every_phase() {
    let flat = sheet(Frame::new([60, 50]).unwrap());
    let method = Method::plane();
    let end_at = |calls| {
        let mut watch = EndAt(calls);
        prepare(&method, Inputs::image(&flat), sized(4.0), &mut watch)
            .and_then(|prepared| prepared.run(&mut watch).map(drop))
    };
    let mut calls = 0;
    while let Err(error) = end_at(calls) {
        assert!(error.is_cancelled(), "after {calls} calls: {error}");
        calls += 1;
        assert!(calls < 2000);
    }
    assert!(calls > 8, "{calls}"); // some for each of potential, distance, growth, optimizer, connection
}

#[test]
fn small_spacing_factors_are_forecast_and_said() {
    fn check<const D: usize>(method: &Method<D>, shape: [usize; D], factors: &[f64]) {
        let image = sheet(Frame::new(shape).unwrap());
        let size = Size::Range { min: 4.0, max: 12.0 };
        for &spacing_factor in factors {
            let options = MeshOptions { size, spacing_factor, ..Default::default() };
            let prepared = prepare(method, Inputs::image(&image), options, &mut Silent).unwrap();
            let is_said = prepared.warnings().iter().any(|w| matches!(w, Warning::Crowded { .. }));
            assert!(is_said, "{D} {spacing_factor}");
            let estimate = prepared.estimate().atoms as f64;
            let actual = prepared.fill(&mut Silent).unwrap().lattice().len() as f64;
            // how much of a box crystals of other sizes reach differs: what is forecast is where they reach all
            let share = estimate / actual;
            assert!((0.7..2.2).contains(&share), "{D} {spacing_factor}: {estimate} for {actual}");
        }
    }
    check(&Method::plane(), [64, 64], &[0.22, 0.3, 0.5]);
    check(&Method::space(), [26, 24, 24], &[0.3, 0.5]);
    // edges of a third of d are the shortest taken
    let image = sheet(Frame::new([26, 24, 24]).unwrap());
    let size = Size::Range { min: 4.0, max: 12.0 };
    let options = MeshOptions { size, spacing_factor: 0.23, ..Default::default() };
    let error = prepare(&Method::space(), Inputs::image(&image), options, &mut Silent).unwrap_err();
    let expected = "with the spacing factor 0.23, edges of a lattice that varies would be about 0.32 of the nominal \
                    distance; expected a factor of 0.24 or more, or a smaller distance";
    assert_eq!(error.to_string(), expected);
    // where d is constant, sites are those of one crystal
    let image = sheet(Frame::new([64, 64]).unwrap());
    let options = MeshOptions { spacing_factor: 0.3, ..sized(4.0) };
    let prepared = prepare(&Method::plane(), Inputs::image(&image), options, &mut Silent).unwrap();
    assert!(prepared.warnings().iter().all(|w| !matches!(w, Warning::Crowded { .. })));
}

#[test]
fn features_that_would_not_fit_are_refused_before_they_are_looked_for() {
    let image = sheet(Frame::new([60, 60]).unwrap());
    let features = FeatureOptions { features: Features::Faults, ..Default::default() };
    // b alone takes 4 bytes a sample, faults 22 more
    let options = MeshOptions { features, memory_limit: Some(20 * 3600), ..sized(4.0) };
    struct Never;
    impl Watch for Never {
        fn step(&mut self, phase: Phase, _: f64, _: Option<f64>) -> std::ops::ControlFlow<()> {
            panic!("{} begins", phase.name());
        }
    }
    let error = prepare(&Method::plane(), Inputs::image(&image), options, &mut Never).err();
    assert!(matches!(error, Some(RunError::FeatureMemory { available: 72_000, .. })), "{error:?}");
}

#[test]
fn cells_below_the_floor_are_said_with_their_number_and_place() {
    // two seed points near each other, fixed: no angle of 20° fits between them and a side
    let image = sheet(Frame::new([40, 40]).unwrap());
    let seed_points = vec![[20.0, 0.6], [22.0, 0.2]];
    let options = MeshOptions { seed_points, ..sized(8.0) };
    let outcome = run(&Method::plane(), &image, options).unwrap();
    let found = outcome.warnings().iter().find_map(|warning| match warning {
        Warning::BelowFloor { count, least, place, .. } => Some((*count, *least, place.clone())),
        _ => None,
    });
    let (count, least, place) = found.expect("the floor cannot be kept");
    assert_eq!(count, outcome.improve_report().unwrap().below);
    assert!(least < 20.0 && count > 0);
    let y: f64 = place.split(',').nth(1).unwrap().parse().unwrap();
    assert!(y < 3.0, "{place}");
}
