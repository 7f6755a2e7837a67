use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::fields::NominalDistance;
use crate::fields::{ImageWeight, Interpolation, ScalarField};
use crate::image::Grid;
use crate::lattice::{Crystal, GrowOptions, grow};
use crate::watch::Silent;

const D_NOMINAL: f64 = 4.0;

/// A perfect crystal in a small box: ties are everywhere.
fn lattice<const D: usize>(crystal: &Crystal<D>) -> (Grid<D>, Lattice<D>) {
    let grid = Grid { shape: [17; D], step: [1.0; D] };
    let distance = NominalDistance::constant(&grid, D_NOMINAL).unwrap();
    let options = GrowOptions::default();
    (grid, grow(crystal, grid.bounds(), &distance, &options, &mut Silent).unwrap())
}

fn flat() -> Editor<2> {
    Editor::new(lattice(&Crystal::hexagonal()).1, Delaunay::<2>::new(), &mut Silent).unwrap()
}

fn volume() -> Editor<3> {
    let lattice = lattice(&Crystal::body_centered_cubic()).1;
    Editor::new(lattice, Delaunay::<3>::new(), &mut Silent).unwrap()
}

/// Checks the mesh against one of all atoms connected anew.
fn is_as_if_rebuilt<const D: usize>(editor: &Editor<D>) {
    let (mesh, names) = editor.mesh().unwrap();
    let points: Vec<Point<D>> = names.iter().map(|&name| editor.place(name).unwrap()).collect();
    let anew = editor.delaunay.connect(&points, &mut Silent).unwrap();
    assert_eq!(mesh, anew);
}

/// A place on quarters of samples, often on a side of the box or another atom's place.
fn some_place<const D: usize>(random: &mut Pcg64) -> Point<D> {
    std::array::from_fn(|_| match random.random_range(0..6) {
        0 => 0.0,
        1 => 16.0,
        2 => 4.0 * f64::from(random.random_range(0..5)),
        _ => 0.25 * f64::from(random.random_range(0..65)),
    })
}

/// Edits at random; returns how many were made and how many refused.
fn edit<const D: usize>(mut editor: Editor<D>, seed: u64, count: usize) -> [usize; 2] {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut outcomes = [0; 2];
    for _ in 0..count {
        let names: Vec<AtomId> = editor.atoms().map(|(name, _)| name).collect();
        let one = names[random.random_range(0..names.len())];
        let before = editor.mesh().unwrap();
        let result = match random.random_range(0..3) {
            0 => editor.add(some_place(&mut random)).map(|_| ()),
            1 => editor.remove(one),
            _ => {
                let (from, to) = (editor.place(one).unwrap(), some_place::<D>(&mut random));
                let share = [0.05, 1.0][random.random_range(0..2)];
                editor.move_to(one, std::array::from_fn(|k| from[k] + share * (to[k] - from[k])))
            }
        };
        if result.is_err() {
            assert_eq!(editor.mesh().unwrap(), before, "a refused edit changes nothing");
        }
        outcomes[usize::from(result.is_err())] += 1;
        is_as_if_rebuilt(&editor);
    }
    let box_measure = 16f64.powi(D as i32);
    let (mesh, _) = editor.mesh().unwrap();
    assert!(mesh.validate().is_ok());
    // sums of some thousand roundings of 1e-16 each
    assert!((mesh.measure() / box_measure - 1.0).abs() < 1e-12);
    outcomes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn any_edits_give_the_mesh_of_a_rebuild(seed: u64) {
        let outcomes = [edit(flat(), seed, 40), edit(volume(), seed, 25)];
        for [made, refused] in outcomes {
            prop_assert!(made > 0 && refused > 0);
        }
    }
}

#[test]
fn only_cells_near_an_edit_are_replaced() {
    let mut editor = volume();
    let atom = editor.points.len() as u32;
    editor.points.push([8.3, 7.9, 8.1]);
    let points = editor.points.clone();
    let total = editor.cells.all().count();
    let replaced =
        editor.cells.change(&editor.delaunay, &points, &[(atom, Some([8.3, 7.9, 8.1]))]).unwrap();
    assert!((1..total / 4).contains(&replaced), "{replaced} of {total}");
}

fn relaxing_moves_what_is_near<const D: usize>(crystal: &Crystal<D>, delaunay: Delaunay<D>) {
    let (grid, lattice) = lattice(crystal);
    // a sheet x = 6.6 attracts
    let b = |i: usize| -(-(((i % 17) as f32 - 6.6) / 1.5).powi(2)).exp();
    let samples = (0..grid.sample_count()).map(b).collect();
    let potential = ScalarField::potential(grid, samples, Interpolation::Linear).unwrap();
    let weight = ImageWeight::constant(0.4).unwrap();
    let distance = NominalDistance::constant(&grid, D_NOMINAL).unwrap();
    let fields = FieldsView { potential: &potential, weight: &weight, distance: &distance };
    let mut editor = Editor::new(lattice, delaunay, &mut Silent).unwrap();
    let before: Vec<(AtomId, Point<D>)> = editor.atoms().collect();
    let (around, reach) = ([7.0; D], 6.0);
    let options = OptimizeOptions::for_dimension(D);
    let report = editor.relax(&around, reach, fields, &options, &mut Silent).unwrap();
    let stages = &report.stages;
    assert!(stages.iter().all(|stage| stage.energy_last <= stage.energy_first));
    let mut moved = 0;
    for (name, from) in before {
        let to = editor.place(name).unwrap();
        let is_near = distance_squared(&from, &around).sqrt() < reach;
        assert!(is_near || to == from, "{from:?} {to:?}");
        moved += usize::from(to != from);
    }
    assert!(moved > 0);
    is_as_if_rebuilt(&editor);
}

#[test]
fn relaxing_moves_atoms_within_reach_and_the_mesh_follows() {
    relaxing_moves_what_is_near(&Crystal::hexagonal(), Delaunay::<2>::new());
    relaxing_moves_what_is_near(&Crystal::body_centered_cubic(), Delaunay::<3>::new());
}

#[test]
fn edits_that_cannot_be_are_refused_by_name() {
    let mut editor = flat();
    let corner = editor.atoms().find(|(_, p)| *p == [0.0, 16.0]).unwrap().0;
    let is_inner = |p: Point<2>| p.iter().all(|x| (5.0..11.0).contains(x));
    let (inner, at) = editor.atoms().find(|(_, p)| is_inner(*p)).unwrap();
    let text = |error: EditError| error.to_string();
    assert!(text(editor.remove(corner).unwrap_err()).contains("is a corner of the box"));
    assert!(text(editor.move_to(corner, [0.0, 15.0]).unwrap_err()).contains("along y"));
    assert!(text(editor.add([3.0, 16.5]).unwrap_err()).contains("outside the box"));
    assert!(text(editor.add([f64::NAN, 1.0]).unwrap_err()).contains("outside the box"));
    assert_eq!(editor.add(at), Err(EditError::Occupied { atom: inner }));
    editor.remove(inner).unwrap();
    assert_eq!(editor.remove(inner), Err(EditError::NoAtom { atom: inner }));
    let again = editor.add(at).unwrap();
    assert_ne!(again, inner, "names are not used again");
    editor.move_to(again, [0.0, 7.3]).unwrap();
    assert_eq!(editor.move_to(again, at), Err(EditError::Held { atom: again, axis: 0 }));
}
