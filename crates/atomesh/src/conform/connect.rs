//! Connecting atoms so that no edge crosses a feature.

use crate::parallel::prelude::*;

use crate::crests::Pieces;
use crate::fields::NominalDistance;
use crate::geometry::Point;
use crate::lattice::Lattice;
use crate::mesh::{AtomEdit, Cells, ConnectError, Delaunay, Mesh};
use crate::watch::{Phase, Watch, check};

use super::facets::{pieces_at, pieces_of};
use super::recover::{Mended, brought_near, crossings, edges_across, heights, mended};

/// How often crossings are mended.
const ROUNDS: usize = 8;

/// The share of the work that connecting all atoms once is.
const FIRST: f64 = 0.5;

/// Atoms, and what is known of each, from round to round: most stay where they are.
#[derive(Clone, Debug)]
pub(super) struct Atoms<const D: usize> {
    pub lattice: Lattice<D>,
    /// The piece and the signed distance for each piece near.
    pub heights: Vec<Vec<(u32, f64)>>,
    /// The pieces that each is on.
    pub of_atoms: Vec<Vec<u32>>,
    /// The number of each among the cells' corners.
    names: Vec<u32>,
}

/// Connects atoms by Delaunay's rule, with atoms added and taken away until no edge crosses a feature, or nothing
/// helps.
///
/// # Errors
/// [`ConnectError`] if the atoms make no mesh, or `watch` ends the work.
pub fn connect<const D: usize>(
    lattice: Lattice<D>,
    pieces: &Pieces<D>,
    distance: &NominalDistance<D>,
    delaunay: &Delaunay<D>,
    watch: &mut dyn Watch,
) -> Result<(Lattice<D>, Mesh<D>), ConnectError> {
    let mut heights = heights(lattice.atoms(), pieces, distance);
    let lattice = brought_near(lattice, &mut heights, pieces, distance);
    let mesh = delaunay.connect(lattice.atoms(), watch)?;
    check(watch, Phase::Connect, FIRST, None)?;
    let mut points = lattice.atoms().to_vec();
    let mut atoms =
        Atoms { heights, of_atoms: Vec::new(), names: (0..points.len() as u32).collect(), lattice };
    let cells = mesh.corners().par_chunks_exact(D + 1);
    let mut found = crossings(edges_across(cells, &atoms.heights, pieces), &atoms, pieces);
    if found.is_empty() {
        return Ok((atoms.lattice, mesh));
    }
    let mut cells = Cells::new(&mesh);
    drop(mesh);
    atoms.of_atoms = pieces_of(&points, &atoms.heights, pieces, atoms.lattice.bounds());
    for round in 0..ROUNDS {
        check(watch, Phase::Connect, FIRST + (1.0 - FIRST) * round as f64 / ROUNDS as f64, None)?;
        let mended = mended(&atoms, &found, pieces, distance);
        let ends = found.iter().flat_map(|crossing| crossing.ends);
        let mut near: Vec<u32> = ends.map(|end| atoms.names[end as usize]).collect();
        let edits = atoms.follow(mended, &mut points, pieces, distance);
        if edits.is_empty() {
            break;
        }
        near.extend(cells.follow(delaunay, &points, &edits)?.added);
        for AtomEdit { atom, to } in edits {
            if let Some(to) = to {
                points[atom as usize] = to;
            }
        }
        found = crossings(atoms.edges_near(&near, &cells, points.len(), pieces), &atoms, pieces);
        if found.is_empty() {
            break;
        }
    }
    let numbers = atoms.numbers(points.len());
    let corners = cells.all().flatten().map(|&name| numbers[name as usize]).collect();
    let mesh = delaunay.arrange(atoms.lattice.atoms().to_vec(), corners)?;
    Ok((atoms.lattice, mesh))
}

impl<const D: usize> Atoms<D> {
    /// Moves atoms, takes some away and adds some, as was found to mend crossings. `points` are all atoms by name.
    fn follow(
        &mut self,
        mended: Mended<D>,
        points: &mut Vec<Point<D>>,
        pieces: &Pieces<D>,
        distance: &NominalDistance<D>,
    ) -> Vec<AtomEdit<D>> {
        let Mended { places, goes, new } = mended;
        let bounds = *self.lattice.bounds();
        let known = |places: &[Point<D>]| {
            (heights(places, pieces, distance), pieces_at(places, pieces, &bounds))
        };
        let mut edits = Vec::new();
        let mut moved = Vec::new();
        for (i, (from, to)) in self.lattice.atoms().iter().zip(&places).enumerate() {
            let atom = self.names[i];
            if goes[i] {
                edits.push(AtomEdit { atom, to: None });
            } else if from != to {
                moved.push(i);
                edits.push(AtomEdit { atom, to: Some(*to) });
            }
        }
        let there: Vec<Point<D>> = moved.iter().map(|&i| places[i]).collect();
        let (heights, of_atoms) = known(&there);
        let mut lattice = std::mem::replace(&mut self.lattice, Lattice::empty(bounds));
        lattice = lattice.moved_to(places);
        for ((i, heights), of_atom) in moved.into_iter().zip(heights).zip(of_atoms) {
            lattice.set_temperature(i, 0.0);
            (self.heights[i], self.of_atoms[i]) = (heights, of_atom);
        }
        self.lattice = lattice.retained(|i| !goes[i]);
        retain(&mut self.heights, &goes);
        retain(&mut self.of_atoms, &goes);
        retain(&mut self.names, &goes);
        let (heights, of_atoms) = known(&new);
        self.heights.extend(heights);
        self.of_atoms.extend(of_atoms);
        for place in new {
            let atom = points.len() as u32;
            points.push(place);
            self.names.push(atom);
            self.lattice.push(place, bounds.freedom(&place), 0.0);
            edits.push(AtomEdit { atom, to: Some(place) });
        }
        edits
    }

    /// The edges across pieces both of whose ends are among some, given by name; others were looked at before.
    fn edges_near(
        &self,
        near: &[u32],
        cells: &Cells<D>,
        names: usize,
        pieces: &Pieces<D>,
    ) -> Vec<[u32; 2]> {
        let numbers = self.numbers(names);
        let mut is_near = vec![false; names];
        near.iter().for_each(|&name| is_near[name as usize] = true);
        let of = |cell: &[u32]| {
            let near = cell.iter().filter(|&&name| is_near[name as usize]);
            near.map(|&name| numbers[name as usize]).collect::<Vec<u32>>()
        };
        let has_edge =
            |cell: &&[u32]| cell.iter().filter(|&&name| is_near[name as usize]).count() > 1;
        let near: Vec<Vec<u32>> = cells.par_all().filter(has_edge).map(of).collect();
        edges_across(near.par_iter().map(Vec::as_slice), &self.heights, pieces)
    }

    /// The number of each atom by name; of one that is gone, none.
    fn numbers(&self, names: usize) -> Vec<u32> {
        let mut numbers = vec![u32::MAX; names];
        self.names.iter().zip(0..).for_each(|(&name, number)| numbers[name as usize] = number);
        numbers
    }
}

/// Drops the entries of what goes.
fn retain<T>(entries: &mut Vec<T>, goes: &[bool]) {
    let mut goes = goes.iter();
    entries.retain(|_| goes.next() == Some(&false));
}

#[cfg(test)]
mod tests {
    use super::super::recover::crossings;
    use super::*;
    use crate::crests::FeaturePoint;
    use crate::geometry::Bounds;
    use crate::image::Grid;
    use crate::watch::Silent;
    use rand::{RngExt, SeedableRng};

    /// Atoms at random, whatever lies on features, with the corners of the box.
    fn scattered<const D: usize>(bounds: &Bounds<D>, count: usize, seed: u64) -> Lattice<D> {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut lattice = Lattice::empty(*bounds);
        for corner in 0..1 << D {
            let at = std::array::from_fn(|k| {
                if corner >> k & 1 == 1 { bounds.max[k] } else { bounds.min[k] }
            });
            lattice.push(at, bounds.freedom(&at), 1.0);
        }
        for _ in 0..count {
            let at = std::array::from_fn(|k| {
                bounds.min[k] + random.random::<f64>() * (bounds.max[k] - bounds.min[k])
            });
            lattice.push(at, bounds.freedom(&at), 1.0);
        }
        lattice
    }

    /// A sheet through the middle of the image at a slant, as points a sample apart.
    fn sheet<const D: usize>(grid: &Grid<D>) -> Pieces<D> {
        let normal: Point<D> =
            std::array::from_fn(|k| if k == D - 1 { 0.8 } else { 0.6 / ((D - 1) as f64).sqrt() });
        let mut points = Vec::new();
        for index in 0..grid.shape[..D - 1].iter().product() {
            let mut position = grid.position(index);
            let off: f64 =
                (0..D - 1).map(|k| normal[k] * (position[k] - 0.5 * grid.shape[k] as f64)).sum();
            position[D - 1] = 0.5 * grid.shape[D - 1] as f64 - off / normal[D - 1];
            if grid.bounds().contains(&position) {
                points.push(FeaturePoint { index, position, normal, strength: 1.0 });
            }
        }
        Pieces::new(points, grid, 10)
    }

    fn mended_meshes_are_delaunays<const D: usize>(delaunay: &Delaunay<D>, n: usize, count: usize) {
        let grid = Grid { shape: [n; D], step: [1.0; D] };
        let (bounds, size) = (grid.bounds(), 5.0);
        let distance = NominalDistance::constant(&grid, size).unwrap();
        let pieces = sheet(&grid);
        assert_eq!(pieces.len(), 1);
        for seed in 0..4 {
            let before = scattered(&bounds, count, seed);
            let (lattice, mesh) =
                connect(before.clone(), &pieces, &distance, delaunay, &mut Silent).unwrap();
            assert_eq!(mesh, delaunay.connect(lattice.atoms(), &mut Silent).unwrap());
            let left = |lattice: Lattice<D>, mesh: &Mesh<D>| {
                let heights = heights(lattice.atoms(), &pieces, &distance);
                let edges = edges_across(mesh.corners().par_chunks_exact(D + 1), &heights, &pieces);
                let atoms = Atoms { lattice, heights, of_atoms: Vec::new(), names: Vec::new() };
                crossings(edges, &atoms, &pieces).len()
            };
            let of_before = delaunay.connect(before.atoms(), &mut Silent).unwrap();
            let [first, last] = [left(before, &of_before), left(lattice, &mesh)];
            assert!(first > 20 && 10 * last <= first, "{first} crossings before, {last} after");
        }
    }

    #[test]
    fn what_is_mended_is_connected_as_if_anew() {
        mended_meshes_are_delaunays(&Delaunay::<2>::new(), 60, 150);
        mended_meshes_are_delaunays(&Delaunay::<3>::new(), 30, 200);
    }
}
