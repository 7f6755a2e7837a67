//! What holds inside the pairs engine: its order, its registers, the samples that it keeps.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::gather::Own;
use super::*;
use crate::energy::lanes::Plain;
use crate::fields::{ImageWeight, Interpolation, NominalDistance, ScalarField};
use crate::image::Grid;

/// Calls `check` with an engine prepared for some 3000 atoms, in a compact order or in any, in fields
/// that vary or do not.
fn with_engines<const D: usize>(
    check: impl Fn(&mut PairsEngine<'_, D>, &[Point<D>], /* compact */ bool),
) {
    let grid = Grid { shape: [40; D], step: [1.0; D] };
    let wave = |i: usize| (0.37 * i as f32).sin();
    let b = (0..grid.sample_count()).map(wave).collect();
    let potential = ScalarField::potential(grid, b, Interpolation::Linear).unwrap();
    let half = (0..grid.sample_count()).map(|i| 0.5 + 0.5 * wave(i)).collect();
    let weights = [ImageWeight::constant(0.4).unwrap(), ImageWeight::field(grid, half).unwrap()];
    let field: Vec<f32> = (0..grid.sample_count()).map(|i| 2.0 + 0.04 * (i % 40) as f32).collect();
    let distances = [
        NominalDistance::constant(&grid, 2.0).unwrap(),
        NominalDistance::from_field(&grid, &field, 0.25).unwrap(),
    ];
    let mut random = Pcg64::seed_from_u64(5);
    let atoms: Vec<Point<D>> =
        (0..3001).map(|_| std::array::from_fn(|_| 39.0 * random.random::<f64>())).collect();
    let compact: Vec<Point<D>> = compact_order(&atoms).iter().map(|&i| atoms[i as usize]).collect();
    for (weight, distance) in weights.iter().flat_map(|w| distances.iter().map(move |d| (w, d))) {
        for (atoms, is_compact) in [(&compact, true), (&atoms, false)] {
            let potential = &potential;
            let mut engine = PairsEngine::new(FieldsView { potential, weight, distance });
            engine.prepare(atoms, 0.1);
            check(&mut engine, atoms, is_compact);
        }
    }
}

fn a_compact_order_is_taken_as_it_is<const D: usize>() {
    with_engines::<D>(|engine, atoms, is_compact| {
        assert_eq!(engine.place.is_empty(), is_compact);
        let places = engine.order.iter().zip(0..).filter(|(i, s)| **i == *s).count();
        assert!((places == atoms.len()) == is_compact);
    });
}

#[test]
fn the_callers_order_is_taken_where_it_is_compact() {
    a_compact_order_is_taken_as_it_is::<2>();
    a_compact_order_is_taken_as_it_is::<3>();
}

fn wide_equals_plain<const D: usize>() {
    with_engines::<D>(|engine, atoms, _| {
        let mut slopes = vec![[0.0; D]; atoms.len()];
        let mut held = vec![HeldCell::NONE; atoms.len()];
        let energy = engine.gather_all(atoms, &mut slopes, &mut held);
        let mut plain = vec![[0.0; D]; atoms.len()];
        let mut held = vec![HeldCell::NONE; atoms.len()];
        let parts = plain.chunks_mut(CHUNK).zip(held.chunks_mut(CHUNK)).enumerate();
        let sum = parts
            .map(|(c, (slopes, held))| engine.gather::<Plain>(atoms, c, Own { slopes, held }))
            .sum();
        assert_eq!((energy, slopes), (sum, plain));
    });
}

#[test]
fn wide_registers_give_the_same_bits() {
    wide_equals_plain::<2>();
    wide_equals_plain::<3>();
}

fn held_equals_read<const D: usize>() {
    with_engines::<D>(|engine, atoms, _| {
        let mut random = Pcg64::seed_from_u64(6);
        let mut atoms = atoms.to_vec();
        let (mut held, mut read) = (vec![[0.0; D]; atoms.len()], vec![[0.0; D]; atoms.len()]);
        for _ in 0..4 {
            let with_held = engine.evaluate(&atoms, &mut held);
            engine.held.clear();
            let with_read = engine.evaluate(&atoms, &mut read);
            assert_eq!((with_held, &held), (with_read, &read));
            // some leave their cell of samples, others stay
            let moved = atoms.as_flattened_mut().iter_mut();
            moved.for_each(|x| *x = (*x + 0.3 * random.random::<f64>() - 0.15).clamp(0.0, 39.0));
        }
    });
}

#[test]
fn samples_held_from_before_are_those_read_anew() {
    held_equals_read::<2>();
    held_equals_read::<3>();
}

/// Two atoms at one place and one beside them, in lengths of any magnitude.
fn atoms_at_one_place_push_each_other_nowhere<const D: usize>() {
    for scale in [1e-28, 1e-5, 1.0, 1e28] {
        let grid = Grid { shape: [9; D], step: [scale; D] };
        let b = vec![0.0; grid.sample_count()];
        let potential = ScalarField::potential(grid, b, Interpolation::Linear).unwrap();
        let distance = NominalDistance::constant(&grid, 2.0 * scale).unwrap();
        let weight = ImageWeight::constant(0.5).unwrap();
        let fields = FieldsView { potential: &potential, weight: &weight, distance: &distance };
        let atoms = [[4.0; D], [4.0; D], [5.0; D]].map(|p: Point<D>| p.map(|x| x * scale));
        let mut engine = PairsEngine::new(fields);
        engine.prepare(&atoms, 0.1);
        let mut gradient = [[0.0; D]; 3];
        assert!(engine.evaluate(&atoms, &mut gradient).total().is_finite());
        assert!(gradient.as_flattened().iter().all(|g| g.is_finite()), "{scale}: {gradient:?}");
        assert_eq!(gradient[0], gradient[1]);
    }
}

#[test]
fn atoms_at_one_place_have_a_finite_gradient_at_any_scale() {
    atoms_at_one_place_push_each_other_nowhere::<2>();
    atoms_at_one_place_push_each_other_nowhere::<3>();
}
