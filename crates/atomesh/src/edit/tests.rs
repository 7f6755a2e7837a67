use std::collections::BTreeSet;

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::fields::{FieldsView, ImageWeight, Interpolation, NominalDistance, ScalarField};
use crate::geometry::distance_squared;
use crate::image::Grid;
use crate::lattice::{Crystal, GrowOptions, grow};
use crate::optimize::{OptimizeOptions, optimize};
use crate::watch::Silent;

const D_NOMINAL: f64 = 4.0;

/// A perfect crystal in a small box: ties are everywhere.
fn lattice<const D: usize>(crystal: &Crystal<D>) -> (Grid<D>, Lattice<D>) {
    let grid = Grid { shape: [17; D], step: [1.0; D] };
    let distance = NominalDistance::constant(&grid, D_NOMINAL).unwrap();
    let options = GrowOptions::default();
    (grid, grow(crystal, grid.bounds(), &distance, &options, &mut Silent).unwrap())
}

fn plane() -> Editor<2> {
    Editor::new(lattice(&Crystal::hexagonal()).1, Delaunay::<2>::new(), &mut Silent).unwrap()
}

fn space() -> Editor<3> {
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

/// A copy of an editor's cells and atoms that knows of it by its changes alone.
struct Shadow<const D: usize> {
    cells: BTreeSet<Vec<AtomId>>,
    places: Vec<(AtomId, Point<D>)>,
}

impl<const D: usize> Shadow<D> {
    fn of(editor: &Editor<D>) -> Self {
        let cells = editor.cells().chunks(D + 1).map(<[AtomId]>::to_vec).collect();
        Self { cells, places: editor.atoms().collect() }
    }

    fn apply(&mut self, changes: &Changes<D>) {
        for cell in changes.cells_removed() {
            assert!(self.cells.remove(cell), "{cell:?} was there");
        }
        for cell in changes.cells_added() {
            assert!(self.cells.insert(cell.to_vec()), "{cell:?} was not there");
        }
        for moved in changes.moves() {
            let at = self.places.iter_mut().find(|(atom, _)| *atom == moved.atom).unwrap();
            assert!(at.1 == moved.from && at.1 != moved.to);
            at.1 = moved.to;
        }
    }

    /// Checks the copy against the mesh: each cell's corners in the order of changes.
    fn is_of(&self, editor: &Editor<D>) {
        let (mesh, names) = editor.mesh().unwrap();
        let cell = |corners: &[u32]| {
            let mut cell: Vec<u32> = corners.iter().map(|&c| names[c as usize].0).collect();
            if crate::mesh::sort_by_swaps(&mut cell) {
                cell.swap(D - 1, D);
            }
            cell.into_iter().map(AtomId).collect::<Vec<AtomId>>()
        };
        assert_eq!(self.cells, mesh.cells().map(cell).collect());
        assert_eq!(self.places, editor.atoms().collect::<Vec<_>>());
    }
}

/// One edit at random.
fn some_edit<const D: usize>(
    editor: &mut Editor<D>,
    shadow: &mut Shadow<D>,
    random: &mut Pcg64,
) -> Result<Changes<D>, EditError> {
    let names: Vec<AtomId> = editor.atoms().map(|(name, _)| name).collect();
    let one = names[random.random_range(0..names.len())];
    match random.random_range(0..3) {
        0 => editor.add(some_place(random)).map(|(atom, changes)| {
            shadow.places.push((atom, editor.place(atom).unwrap()));
            changes
        }),
        1 => editor.remove(one).inspect(|_| shadow.places.retain(|(atom, _)| *atom != one)),
        _ => {
            let (from, to) = (editor.place(one).unwrap(), some_place::<D>(random));
            let share = [0.05, 1.0][random.random_range(0..2)];
            editor.move_to(one, std::array::from_fn(|k| from[k] + share * (to[k] - from[k])))
        }
    }
}

/// Edits at random; returns how many were made and how many refused.
fn edit<const D: usize>(mut editor: Editor<D>, seed: u64, count: usize) -> [usize; 2] {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut shadow = Shadow::of(&editor);
    let mut outcomes = [0; 2];
    for _ in 0..count {
        let before = editor.mesh().unwrap();
        let result = some_edit(&mut editor, &mut shadow, &mut random);
        outcomes[usize::from(result.is_err())] += 1;
        match result {
            Ok(changes) => shadow.apply(&changes),
            Err(_) => assert_eq!(editor.mesh().unwrap(), before, "a refused edit changes nothing"),
        }
        is_as_if_rebuilt(&editor);
        shadow.is_of(&editor);
        finds_atoms_as_a_search_of_all(&editor, &some_place(&mut random));
    }
    let box_measure = 16f64.powi(D as i32);
    let (mesh, _) = editor.mesh().unwrap();
    assert!(mesh.validate().is_ok());
    // sums of some thousand roundings of 1e-16 each
    assert!((mesh.measure() / box_measure - 1.0).abs() < 1e-12);
    outcomes
}

/// Checks the atoms that bins find within 5 samples of a place.
fn finds_atoms_as_a_search_of_all<const D: usize>(editor: &Editor<D>, around: &Point<D>) {
    let is_near = |p: &Point<D>| distance_squared(p, around).sqrt() < 5.0;
    let all = editor.atoms().filter(|(_, p)| is_near(p)).map(|(atom, _)| atom.0);
    assert_eq!(editor.within(around, 5.0), all.collect::<Vec<u32>>());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn any_edits_give_the_mesh_of_a_rebuild(seed: u64) {
        let outcomes = [edit(plane(), seed, 40), edit(space(), seed, 25)];
        for [made, _] in outcomes {
            prop_assert!(made > 0);
        }
    }
}

#[test]
fn some_edits_are_refused() {
    // of so few edits as above all may be made, by chance
    let refused =
        |edit: &dyn Fn(u64) -> [usize; 2]| (0..4).map(|seed| edit(seed)[1]).sum::<usize>();
    assert!(refused(&|seed| edit(plane(), seed, 40)) > 0);
    assert!(refused(&|seed| edit(space(), seed, 25)) > 0);
}

#[test]
fn only_cells_near_an_edit_are_replaced() {
    let mut editor = space();
    let total = editor.cells().len() / 4;
    let (atom, changes) = editor.add([8.3, 7.9, 8.1]).unwrap();
    assert!((1..total / 4).contains(&changes.cells_removed().len()));
    assert!(changes.cells_added().all(|cell| cell.contains(&atom)), "of new cells nothing else");
    // a step so small that no cell changes its corners
    let changes = editor.move_to(atom, [8.3, 7.9, 8.1001]).unwrap();
    assert_eq!((changes.cells_added().len(), changes.moves().len()), (0, 1));
    assert!(editor.move_to(atom, [8.3, 7.9, 8.1001]).unwrap().is_empty());
}

/// A sheet x = 6.6 that attracts.
struct Sheet<const D: usize> {
    potential: ScalarField<D>,
    weight: ImageWeight<D>,
    distance: NominalDistance<D>,
}

impl<const D: usize> Sheet<D> {
    fn on(grid: Grid<D>) -> Self {
        let b = |i: usize| -(-(((i % 17) as f32 - 6.6) / 1.5).powi(2)).exp();
        let samples = (0..grid.sample_count()).map(b).collect();
        Self {
            potential: ScalarField::potential(grid, samples, Interpolation::Linear).unwrap(),
            weight: ImageWeight::constant(0.4).unwrap(),
            distance: NominalDistance::constant(&grid, D_NOMINAL).unwrap(),
        }
    }

    fn fields(&self) -> FieldsView<'_, D> {
        FieldsView { potential: &self.potential, weight: &self.weight, distance: &self.distance }
    }
}

fn relaxing_moves_what_is_near<const D: usize>(crystal: &Crystal<D>, delaunay: Delaunay<D>) {
    let (grid, lattice) = lattice(crystal);
    let sheet = Sheet::on(grid);
    let mut editor = Editor::new(lattice.clone(), delaunay, &mut Silent).unwrap();
    let before: Vec<(AtomId, Point<D>)> = editor.atoms().collect();
    let (around, reach) = ([7.0; D], 6.0);
    let options = OptimizeOptions::for_dimension(D);
    let mut shadow = Shadow::of(&editor);
    let is_near = |p: &Point<D>| distance_squared(p, &around).sqrt() < reach;
    let (pinned, _) = *before.iter().find(|(_, p)| is_near(p)).unwrap();
    editor.pin(pinned).unwrap();
    let fields = sheet.fields();
    let (report, changes) = editor.relax(&around, reach, fields, &options, &mut Silent).unwrap();
    assert_eq!(report.stages.len(), 1, "no stage is smoothed, whatever the options say");
    assert!(report.stages[0].energy_last <= report.stages[0].energy_first);
    assert!(!changes.moves().is_empty());
    for moved in changes.moves() {
        assert!(is_near(&moved.from) && moved.atom != pinned, "{moved:?}");
    }
    shadow.apply(&changes);
    shadow.is_of(&editor);
    is_as_if_rebuilt(&editor);

    // atoms that are left out are not felt: all of them together end at the same places
    let mut whole = lattice;
    for (i, (atom, p)) in before.into_iter().enumerate() {
        let s = (distance_squared(&p, &around).sqrt() / reach).min(1.0);
        let temperature = (1.0 - s * s * (3.0 - 2.0 * s)).clamp(0.0, 1.0) as f32;
        whole.set_temperature(i, if atom == pinned { 0.0 } else { temperature });
    }
    let options = OptimizeOptions { perturbation: 0.0, smoothing_steps: 0, ..options };
    let settled = optimize(whole.clone(), fields, &options, &mut Silent).unwrap();
    let mut editor = Editor::new(whole, editor.delaunay, &mut Silent).unwrap();
    // a reach so long that it changes no temperature in single precision
    editor.relax(&around, 1e9, fields, &options, &mut Silent).unwrap();
    assert_eq!(editor.lattice().atoms(), settled.lattice().atoms());
}

#[test]
fn relaxing_moves_atoms_within_reach_and_the_mesh_follows() {
    relaxing_moves_what_is_near(&Crystal::hexagonal(), Delaunay::<2>::new());
    relaxing_moves_what_is_near(&Crystal::body_centered_cubic(), Delaunay::<3>::new());
}

#[test]
fn edits_that_cannot_be_are_refused_by_name() {
    let mut editor = plane();
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
    let (again, _) = editor.add(at).unwrap();
    assert_ne!(again, inner, "names are not used again");
    editor.move_to(again, [0.0, 7.3]).unwrap();
    assert_eq!(editor.move_to(again, at), Err(EditError::Held { atom: again, axis: 0 }));
}

#[test]
fn a_pinned_atom_stays_until_it_is_unpinned() {
    let mut editor = plane();
    let is_inner = |p: Point<2>| p.iter().all(|x| (5.0..11.0).contains(x));
    let (atom, at) = editor.atoms().find(|(_, p)| is_inner(*p)).unwrap();
    editor.pin(atom).unwrap();
    assert_eq!(editor.is_pinned(atom), Ok(true));
    assert_eq!(editor.move_to(atom, [8.0, 8.5]), Err(EditError::Pinned { atom }));
    let refused = editor.remove(atom).unwrap_err();
    assert!(refused.to_string().ends_with("is pinned; unpin it first"), "{refused}");
    assert_eq!(editor.place(atom), Ok(at));
    editor.unpin(atom).unwrap();
    assert_eq!(editor.is_pinned(atom), Ok(false));
    editor.move_to(atom, [8.0, 8.5]).unwrap();
    editor.remove(atom).unwrap();
    assert_eq!(editor.pin(atom), Err(EditError::NoAtom { atom }));
}

#[test]
fn a_lattice_comes_back_with_freedom_temperature_and_edits() {
    let (_, mut lattice) = lattice(&Crystal::hexagonal());
    lattice.set_temperature(5, 0.25);
    lattice.set_temperature(6, 0.0);
    let editor = Editor::new(lattice.clone(), Delaunay::<2>::new(), &mut Silent).unwrap();
    let mobility = |lattice: &Lattice<2>| -> Vec<f64> {
        (0..2 * lattice.len()).map(|v| lattice.mobility(v / 2, v % 2)).collect()
    };
    let same = editor.lattice();
    assert_eq!((same.atoms(), mobility(&same)), (lattice.atoms(), mobility(&lattice)));

    let mut editor = editor;
    let names: Vec<AtomId> = editor.atoms().map(|(atom, _)| atom).collect();
    let count = names.len();
    let inner = (0..count).rfind(|&i| lattice.freedom()[i] == 0b11).unwrap();
    editor.pin(names[inner]).unwrap();
    let (removed, at) = (inner - 1, editor.place(names[inner - 1]).unwrap());
    editor.remove(names[removed]).unwrap();
    editor.add([0.0, 7.3]).unwrap();
    editor.add([at[0] + 0.1, at[1]]).unwrap();
    let edited = editor.lattice();
    assert_eq!(edited.len(), count + 1);
    let freedom = edited.freedom();
    assert_eq!(freedom[inner - 1], 0, "the pinned atom, after the one removed");
    assert_eq!(freedom[count - 1..], [0b10, 0b11]);
    assert_eq!(edited.temperature(5), 0.25);
}
