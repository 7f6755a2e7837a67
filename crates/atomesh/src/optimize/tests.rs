//! What the optimizer promises of energy, report, held atoms and limits.

use std::ops::ControlFlow;

use crate::fields::{ImageWeight, NominalDistance};

use super::energy::LatticeEnergy;
use super::*;
use crate::energy::direct_energy;
use crate::fields::Interpolation;
use crate::geometry::{Point, distance_squared};
use crate::image::Grid;
use crate::lattice::{Crystal, GrowOptions, ScatterOptions, Scatterer, grow, scatter};
use crate::minimize::Objective;
use crate::watch::Silent;

struct Scene<const D: usize> {
    potential: ScalarField<D>,
    weight: ImageWeight<D>,
    distance: NominalDistance<D>,
}

fn sample<const D: usize>(grid: &Grid<D>, f: impl Fn(&Point<D>) -> f64) -> Vec<f32> {
    (0..grid.sample_count()).map(|i| f(&grid.position(i)) as f32).collect()
}

impl<const D: usize> Scene<D> {
    fn new(shape: [usize; D], b: impl Fn(&Point<D>) -> f64, beta: f64, d: f64) -> Self {
        let grid = Grid { shape, step: [1.0; D] };
        Self {
            potential: ScalarField::potential(grid, sample(&grid, b), Interpolation::Linear)
                .unwrap(),
            weight: ImageWeight::constant(beta).unwrap(),
            distance: NominalDistance::constant(&grid, d).unwrap(),
        }
    }

    /// d as a function of the place, β from 0.2 to 0.6.
    fn varying(mut self, d: impl Fn(&Point<D>) -> f64) -> Self {
        let grid = *self.potential.grid();
        self.distance = NominalDistance::from_field(&grid, &sample(&grid, d), 0.25).unwrap();
        let weight = sample(&grid, |p| 0.4 + 0.2 * (0.3 * p[0]).sin());
        self.weight = ImageWeight::field(grid, weight).unwrap();
        self
    }

    fn fields(&self) -> FieldsView<'_, D> {
        FieldsView { potential: &self.potential, weight: &self.weight, distance: &self.distance }
    }

    fn grown(&self, crystal: &Crystal<D>) -> Lattice<D> {
        let bounds = self.potential.grid().bounds();
        grow(crystal, bounds, &self.distance, &GrowOptions::default(), &mut Silent).unwrap()
    }

    fn scattered(&self, scatterer: &Scatterer<D>, seed: u64) -> Lattice<D> {
        let bounds = self.potential.grid().bounds();
        let options = ScatterOptions { seed, ..Default::default() };
        scatter(scatterer, bounds, &self.distance, &options, &mut Silent).unwrap()
    }

    fn optimized(&self, lattice: Lattice<D>, options: &OptimizeOptions) -> OptimizedLattice<D> {
        optimize(lattice, self.fields(), options, &mut Silent).unwrap()
    }

    fn direct(&self, lattice: &Lattice<D>) -> crate::energy::Energy {
        let d: Vec<f64> = lattice.atoms().iter().map(|p| self.distance.at(p)).collect();
        let weights: Vec<f64> = lattice.atoms().iter().map(|p| self.weight.at(p)).collect();
        let mut gradient = vec![[0.0; D]; lattice.len()];
        direct_energy(lattice.atoms(), &d, &weights, &self.potential, &mut gradient)
    }
}

/// A valley of depth 1 along x = `at`, `width` samples wide to one side.
fn valley<const D: usize>(axis: usize, at: f64, width: f64) -> impl Fn(&Point<D>) -> f64 {
    move |p| -(-0.5 * ((p[axis] - at) / width).powi(2)).exp()
}

fn scenes() -> Vec<Scene<2>> {
    let mut scenes: Vec<Scene<2>> = [0.0, 0.4, 1.0]
        .into_iter()
        .map(|beta| Scene::new([48, 40], valley(0, 21.3, 1.5), beta, 5.0))
        .collect();
    scenes.push(Scene::new([60, 40], valley(1, 18.7, 1.0), 0.0, 5.0).varying(|p| 3.0 + 0.1 * p[0]));
    scenes
}

const ENGINES: [EngineKind; 2] = [EngineKind::Pairs, EngineKind::Sampled];

#[test]
fn energy_never_ends_above_its_start() {
    for (case, scene) in scenes().iter().enumerate() {
        for engine in ENGINES {
            for smoothing_steps in [0, 2] {
                for seed in 0..2 {
                    let lattice = if seed == 0 {
                        scene.grown(&Crystal::hexagonal())
                    } else {
                        scene.scattered(&Scatterer::<2>::new(), seed)
                    };
                    let options =
                        OptimizeOptions { engine, smoothing_steps, seed, ..Default::default() };
                    let done = scene.optimized(lattice, &options);
                    let report = done.report();
                    assert_eq!(report.engine, Some(engine));
                    assert_eq!(report.stages.len(), smoothing_steps + 1);
                    for stage in &report.stages {
                        let what = format!("case {case}, seed {seed}, {engine:?}, {stage:?}");
                        assert!(stage.energy_last <= stage.energy_first, "{what}");
                        assert!(stage.energy_last.is_finite() && stage.perturbations > 0, "{what}");
                    }
                    let smoothings: Vec<f64> = report.stages.iter().map(|s| s.smoothing).collect();
                    assert!(smoothings.windows(2).all(|w| w[0] > w[1]), "{smoothings:?}");
                    assert_eq!(smoothings.last(), Some(&0.0));
                    assert!(report.evaluations >= report.iterations());
                    assert!(done.lattice().atoms().as_flattened().iter().all(|x| x.is_finite()));
                }
            }
        }
    }
}

/// d and β were once read before atoms near a side were moved to the margin, and the first energy, by which the
/// end is judged, was that of no place.
#[test]
fn the_first_energy_is_that_of_the_place_where_atoms_start() {
    let scene = Scene::new([60, 40], valley(1, 18.7, 1.0), 0.0, 5.0).varying(|p| 3.0 + 0.1 * p[0]);
    let options = OptimizeOptions { margin: 0.8, ..Default::default() }; // more than a crystal keeps
    let lattice = scene.grown(&Crystal::hexagonal());
    let given = lattice.atoms().to_vec();
    let engine = Box::new(PairsEngine::new(scene.fields()));
    let mut report = OptimizeReport::new(EngineKind::Pairs);
    let mut run = Run::new(lattice.clone(), engine, &options, 0.0, &mut report);
    let start = run.begin();
    assert_ne!(given.as_flattened(), start, "no atom was near a side");
    let there = scene.direct(&lattice.moved_to(start.as_chunks().0.to_vec())).total();
    // sums of some thousand terms below 1 in another order
    assert!((run.stage.energy_first - there).abs() < 1e-11, "{} {there}", run.stage.energy_first);
}

#[test]
fn the_report_states_the_energy_of_the_atoms_returned() {
    for (case, scene) in scenes().iter().enumerate() {
        let done = scene.optimized(scene.grown(&Crystal::hexagonal()), &Default::default());
        let (report, energy) = (done.report(), scene.direct(done.lattice()));
        let last = report.stages.last().unwrap();
        // sums of some thousand terms below 1 in another order: roundings of 1e-16 each
        assert!(
            (report.energy_atomic - energy.atomic).abs() < 1e-11,
            "{case}: {report:?} {energy:?}"
        );
        assert!(
            (report.energy_image - energy.image).abs() < 1e-11,
            "{case}: {report:?} {energy:?}"
        );
        assert_eq!(last.energy_last, report.energy_atomic + report.energy_image);
    }
}

#[test]
fn what_is_held_stays_to_the_bit() {
    let scene = Scene::new([20, 18, 16], valley(2, 6.4, 1.2), 0.5, 4.0);
    for engine in ENGINES {
        let mut lattice = scene.grown(&Crystal::body_centered_cubic());
        (0..lattice.len()).step_by(3).for_each(|i| lattice.set_temperature(i, 0.0));
        let before = lattice.clone();
        let options = OptimizeOptions { engine, smoothing_steps: 1, ..Default::default() };
        let after = scene.optimized(lattice, &options).lattice().clone();
        let mut moved = 0;
        for (i, (p, q)) in before.atoms().iter().zip(after.atoms()).enumerate() {
            for k in 0..3 {
                if before.mobility(i, k) == 0.0 {
                    assert_eq!(p[k].to_bits(), q[k].to_bits(), "{engine:?}: atom {i} axis {k}");
                }
            }
            moved += usize::from(p != q);
        }
        assert!(moved > before.len() / 4, "{engine:?}: {moved} of {}", before.len());
    }
}

#[test]
fn a_lattice_all_frozen_is_returned_as_it_was() {
    let scene = Scene::new([30, 30], valley(0, 11.0, 1.5), 0.5, 5.0);
    let mut lattice = scene.grown(&Crystal::hexagonal());
    (0..lattice.len()).for_each(|i| lattice.set_temperature(i, 0.0));
    let before = lattice.atoms().to_vec();
    let done = scene.optimized(lattice, &Default::default());
    assert_eq!(done.lattice().atoms(), before);
}

#[test]
fn the_gradient_of_tempered_atoms_is_the_slope_by_their_variables() {
    let scene = Scene::new([40, 36], |p| -0.4 - 0.4 * (0.35 * p[0] + 0.2 * p[1]).sin(), 0.4, 5.0);
    let mut lattice = scene.scattered(&Scatterer::<2>::new(), 4);
    for i in 0..lattice.len() {
        lattice.set_temperature(i, [0.5, 1.0, 0.25, 0.0][i % 4]);
    }
    let engine = Box::new(PairsEngine::new(scene.fields()));
    let mut energy = LatticeEnergy::new(lattice.clone(), engine, 0.1, 0.1);
    let mut z = energy.start();
    // off the start, where x and z are the same, and off the walls
    z.iter_mut().enumerate().for_each(|(v, x)| *x += 0.05 * (v as f64).sin());
    energy.hold(&mut z);
    energy.confine(&mut z);
    let mut gradient = vec![0.0; z.len()];
    energy.evaluate(&z, &mut gradient);
    let mut spare = gradient.clone();
    let (h, mut checked) = (1e-6, 0);
    for v in 0..z.len() {
        let mobility = lattice.mobility(v / 2, v % 2);
        if mobility == 0.0 {
            assert_eq!(gradient[v], 0.0, "variable {v}");
            continue;
        }
        let mut value_at = |x: f64| {
            let mut z = z.clone();
            z[v] += x;
            energy.evaluate(&z, &mut spare)
        };
        let (low, high) = (value_at(-h), value_at(h));
        let slope = (high - low) / (2.0 * h);
        // 1e-16 · |P| of some 30 / h = 3e-9; a kink of b, 0.1 at the most, within h is unlikely, and of
        // φ″ costs h · 0.02
        assert!((slope - gradient[v]).abs() < 1e-7, "variable {v}, mobility {mobility}");
        checked += 1;
    }
    assert!(checked > 60, "{checked}");
}

#[test]
fn tempered_atoms_move_less() {
    let scene = Scene::new([48, 40], valley(0, 21.3, 1.5), 0.5, 5.0);
    let moved = |temperature: f32| {
        let mut lattice = scene.grown(&Crystal::hexagonal());
        (0..lattice.len()).for_each(|i| lattice.set_temperature(i, temperature));
        let before = lattice.atoms().to_vec();
        let options = OptimizeOptions {
            inner_limit: 1,
            outer_limit: 1,
            perturbation: 0.0,
            ..Default::default()
        };
        let done = scene.optimized(lattice, &options);
        (before.iter().zip(done.lattice().atoms()))
            .map(|(p, q)| distance_squared(p, q).sqrt())
            .fold(0.0, f64::max)
    };
    assert!(moved(1.0) > 1.5 * moved(0.5) && moved(0.5) > 0.0);
}

#[test]
fn every_loop_keeps_its_limit() {
    let scene = Scene::new([48, 40], valley(0, 21.3, 1.5), 0.5, 5.0);
    for (inner_limit, outer_limit) in [(0, 0), (0, 3), (1, 1), (3, 2), (2, 100)] {
        let options = OptimizeOptions {
            inner_limit,
            outer_limit,
            tolerance: 0.0,
            smoothing_steps: 1,
            ..Default::default()
        };
        let report = scene.optimized(scene.grown(&Crystal::hexagonal()), &options).report().clone();
        for stage in &report.stages {
            assert!(stage.perturbations <= outer_limit.max(1), "{stage:?}");
            assert!(stage.iterations <= inner_limit * outer_limit.max(1), "{stage:?}");
            assert!(stage.energy_last <= stage.energy_first, "{stage:?}");
        }
    }
}

#[test]
fn free_atoms_keep_the_margin() {
    // a valley along a side of the box: atoms would all go there
    for margin in [0.0, 0.2, 0.35] {
        let scene = Scene::new([40, 40], valley(0, 0.0, 3.0), 0.8, 5.0);
        let options = OptimizeOptions { margin, ..Default::default() };
        let done = scene.optimized(scene.grown(&Crystal::hexagonal()), &options);
        let (lattice, mut least) = (done.lattice(), f64::INFINITY);
        for (i, p) in lattice.atoms().iter().enumerate() {
            for k in (0..2).filter(|&k| lattice.mobility(i, k) > 0.0) {
                let room = (p[k] - 0.0).min(39.0 - p[k]);
                least = least.min(room);
                assert!(room >= margin * 5.0, "margin {margin}: {p:?}");
            }
        }
        assert!(least < 2.5, "{least}: nothing came near the wall");
    }
}

#[test]
fn a_seed_fixes_the_result() {
    let scene = Scene::new([48, 40], valley(0, 21.3, 1.5), 0.4, 5.0);
    let run = |seed, threads| {
        let options = OptimizeOptions { seed, ..Default::default() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let work = || scene.optimized(scene.grown(&Crystal::hexagonal()), &options);
        pool.install(work).lattice().atoms().to_vec()
    };
    assert_eq!(run(1, 1), run(1, 1));
    assert_eq!(run(1, 1), run(1, 3));
    assert_ne!(run(1, 1), run(2, 1));
}

#[test]
fn without_an_image_a_hexagonal_lattice_stays_nearly_perfect() {
    let scene = Scene::new([61, 61], valley(0, 30.0, 1.0), 0.0, 5.0);
    let patient = OptimizeOptions { tolerance: 1e-4, ..Default::default() };
    let done = scene.optimized(scene.grown(&Crystal::hexagonal()), &patient);
    let atoms = done.lattice().atoms();
    let (mut checked, mut sum) = (0.0, 0.0);
    for p in atoms.iter().filter(|p| p.iter().all(|x| (15.0..=45.0).contains(x))) {
        let mut apart: Vec<f64> =
            atoms.iter().map(|q| distance_squared(p, q).sqrt() / 5.0).collect();
        apart.sort_unstable_by(f64::total_cmp);
        // six neighbours, then none up to near √3: perturbations are taken back but for what the
        // tolerance leaves, and atoms of the sides, which do not fit the crystal, push a little
        assert!(apart[1] > 0.8 && apart[6] < 1.2 && apart[7] > 1.4, "{p:?}: {:?}", &apart[..8]);
        sum += apart[1..=6].iter().map(|u| (u - 1.0).abs()).sum::<f64>() / 6.0;
        checked += 1.0;
    }
    assert!(sum / checked < 0.05, "{}", sum / checked);
}

/// The mean distance from the line `axis` = `at` of the atoms nearest to its points.
fn mean_distance_to_line(lattice: &Lattice<2>, axis: usize, at: f64) -> f64 {
    let bounds = lattice.bounds();
    let across = 1 - axis;
    let points = 200;
    let sum: f64 = (0..points)
        .map(|t| {
            let mut p = [at; 2];
            p[across] = bounds.max[across] * (0.1 + 0.8 * f64::from(t) / f64::from(points));
            let nearest = (lattice.atoms().iter())
                .min_by(|a, b| distance_squared(a, &p).total_cmp(&distance_squared(b, &p)));
            (nearest.unwrap()[axis] - at).abs()
        })
        .sum();
    sum / f64::from(points)
}

#[test]
fn a_dark_line_attracts_atoms() {
    for engine in ENGINES {
        let scene = Scene::new([65, 65], valley(0, 27.3, 1.5), 0.5, 6.0);
        let lattice = scene.grown(&Crystal::hexagonal());
        let before = mean_distance_to_line(&lattice, 0, 27.3);
        let after = mean_distance_to_line(
            scene.optimized(lattice, &OptimizeOptions { engine, ..Default::default() }).lattice(),
            0,
            27.3,
        );
        // rows of atoms 0.87 d apart are 0.2 d away in the mean; on the line, a sixth of that is left
        assert!(after < 0.4 * before, "{engine:?}: {before} samples before, {after} after");
    }
}

#[test]
fn smoothing_lets_atoms_feel_a_narrow_line_from_afar() {
    // rows of a hexagonal lattice of d = 10 lie 8.7 apart; the line is midway and σ = 0.8 samples
    // narrow, so no atom feels it
    let at = 40.0 + 0.5 * 10.0 * 0.75f64.sqrt();
    let scene = Scene::new([81, 81], valley(1, at, 0.8), 0.5, 10.0);
    let run = |smoothing_steps| {
        let options = OptimizeOptions { smoothing_steps, perturbation: 0.0, ..Default::default() };
        let done = scene.optimized(scene.grown(&Crystal::hexagonal()), &options);
        (mean_distance_to_line(done.lattice(), 1, at), done.report().energy_image)
    };
    let (sharp, smooth) = (run(0), run(3));
    assert!(smooth.0 < 0.7 * sharp.0, "{sharp:?} {smooth:?}");
    assert!(smooth.1 < sharp.1, "{sharp:?} {smooth:?}");
}

#[test]
fn options_out_of_range_are_named() {
    let d = OptimizeOptions::default;
    let cases = [
        ("tolerance", OptimizeOptions { tolerance: 1.0, ..d() }),
        ("tolerance", OptimizeOptions { tolerance: f64::NAN, ..d() }),
        ("tolerance", OptimizeOptions { tolerance: -1e-9, ..d() }),
        ("perturbation", OptimizeOptions { perturbation: 0.5, ..d() }),
        ("perturbation", OptimizeOptions { perturbation: f64::INFINITY, ..d() }),
        ("longest_move", OptimizeOptions { longest_move: 0.0, ..d() }),
        ("margin", OptimizeOptions { margin: -0.1, ..d() }),
        ("smoothing_steps", OptimizeOptions { smoothing_steps: 11, ..d() }),
    ];
    let scene = Scene::new([20, 20], |_| 0.0, 0.5, 5.0);
    for (wanted, options) in cases {
        let end =
            optimize(scene.grown(&Crystal::hexagonal()), scene.fields(), &options, &mut Silent);
        match end.unwrap_err() {
            OptimizeError::Option { name, .. } => assert_eq!(name, wanted),
            other => panic!("{wanted}: {other}"),
        }
    }
}

struct EndAt(usize);

impl Watch for EndAt {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        assert_eq!(phase, Phase::Optimize);
        assert!((0.0..=1.0).contains(&done) && energy.is_none_or(f64::is_finite));
        if self.0 == 0 {
            return ControlFlow::Break(());
        }
        self.0 -= 1;
        ControlFlow::Continue(())
    }
}

#[test]
fn a_watch_ends_the_work() {
    let scene = Scene::new([48, 40], valley(0, 21.3, 1.5), 0.5, 5.0);
    for calls in 0..4 {
        let lattice = scene.grown(&Crystal::hexagonal());
        let options = OptimizeOptions { smoothing_steps: 1, ..Default::default() };
        let end = optimize(lattice, scene.fields(), &options, &mut EndAt(calls));
        assert!(matches!(end, Err(OptimizeError::Cancelled(_))), "after {calls} calls");
    }
}

#[test]
fn noise_of_either_sign_gives_no_nan() {
    let noise = |p: &Point<3>| {
        let x = (p[0] * 12.9898 + p[1] * 78.233 + p[2] * 37.719).sin() * 43758.5453;
        2.0 * (x - x.floor()) - 1.0
    };
    for beta in [0.4, 1.0] {
        let scene = Scene::new([14, 12, 10], noise, beta, 2.0);
        for engine in ENGINES {
            let options = OptimizeOptions {
                engine,
                perturbation: 0.3,
                longest_move: 0.4,
                ..Default::default()
            };
            let done = scene.optimized(scene.grown(&Crystal::body_centered_cubic()), &options);
            let bounds = scene.potential.grid().bounds();
            assert!(done.lattice().atoms().iter().all(|p| bounds.contains(p)), "{engine:?} {beta}");
            assert!(done.report().energy_image.is_finite());
        }
    }
}
