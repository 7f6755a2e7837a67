//! Labels that belong to atoms: what cells of another mesh get of those given to the cells of one.
//!
//! Labels are given in one mesh, say by hand. Then atoms are moved, added and removed, or all of them are made again, and
//! the mesh has other cells. The rule is one for all of that: a cell gets the label of the place where its middle was when
//! the labels were given.
//!
//! 1. A place is taken back to where it was with the atom that is nearest to it now ([`AtomMoves`]). Of a triangle or
//!    tetrahedron every corner is taken back, of a Voronoi cell its atom. An atom that was not there stays where it is.
//! 2. The label is that of the cell which had the mean of the corners in it, or the atom ([`CellFinder`]).
//!
//! So a cell whose atoms are those of a labelled one has its label wherever they were moved to, and a Voronoi cell that of
//! its own atom. Cost: O(cells), as long as cells near each other are not very different in size.

use crate::parallel::prelude::*;

use crate::geometry::{Bounds, Point, PointGrid, distance_squared};
use crate::mesh::Mesh;

/// Cells of a bin, about.
const OF_A_BIN: usize = 2;

/// Finds the cell at a place: of triangles or tetrahedra, or of the Voronoi cells around points.
///
/// ```
/// use atomesh::{mesh::Mesh, region::CellFinder};
///
/// let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
/// let mesh = Mesh::new(square, vec![0, 1, 2, 0, 2, 3])?;
/// let finder = CellFinder::of_mesh(&mesh);
/// assert_eq!(finder.cell_at(&[0.9, 0.2]), Some(0));
/// assert_eq!(finder.carried(&[7, 8], &[[0.1, 0.9], [0.9, 0.2]]), [8, 7]);
/// # Ok::<(), atomesh::mesh::MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CellFinder<const D: usize> {
    kind: Kind<D>,
}

#[derive(Clone, Debug)]
enum Kind<const D: usize> {
    Simplices(Simplices<D>),
    Sites { count: usize, reach: f64, grid: Option<PointGrid<D>> },
}

impl<const D: usize> CellFinder<D> {
    /// Finds cells of a mesh. Cost: O(cells).
    pub fn of_mesh(mesh: &Mesh<D>) -> Self {
        Self { kind: Kind::Simplices(Simplices::new(mesh)) }
    }

    /// Finds the Voronoi cells around points: the cell of the nearest, of equally near ones the first.
    pub fn of_sites(sites: &[Point<D>]) -> Self {
        let bounds = Bounds::of(sites);
        let reach = bounds.as_ref().map_or(1.0, |bounds| 1e3 * bounds.longest_edge().max(1.0));
        let grid = bounds.map(|bounds| grid_of(&bounds, sites));
        Self { kind: Kind::Sites { count: sites.len(), reach, grid } }
    }

    /// How many cells there are.
    pub fn cell_count(&self) -> usize {
        match &self.kind {
            Kind::Simplices(simplices) => simplices.corners.len() / (D + 1),
            Kind::Sites { count, .. } => *count,
        }
    }

    /// The cell that has a place in it, of several on whose boundary it lies the first; of a place in no cell one near it.
    /// `None` if there are no cells, or the place is far outside.
    pub fn cell_at(&self, p: &Point<D>) -> Option<u32> {
        match &self.kind {
            Kind::Simplices(simplices) => simplices.at(p),
            Kind::Sites { reach, grid, .. } => {
                let nearest = grid.as_ref()?.nearest(p, *reach, |_| true);
                nearest.map(|(site, _)| site as u32)
            }
        }
    }

    /// The cells along a path, each once, ascending: those at its places, and at places between them, `step` apart or less.
    /// Every cell is looked at where the path is long in steps; a cell cut for less than a step may be passed by.
    pub fn along(&self, path: &[Point<D>], step: f64) -> Vec<u32> {
        /// Places between two of a path, at most.
        const MOST: f64 = 1e4;
        let mut cells: Vec<u32> = path.first().and_then(|p| self.cell_at(p)).into_iter().collect();
        for ends in path.windows(2) {
            let length = distance_squared(&ends[0], &ends[1]).sqrt();
            let count = (length / step).ceil().clamp(1.0, MOST);
            for i in 1..=count as usize {
                let t = i as f64 / count;
                let p = std::array::from_fn(|k| ends[0][k] + t * (ends[1][k] - ends[0][k]));
                cells.extend(self.cell_at(&p));
            }
        }
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// The labels at places, of labels given to these cells; 0 where no cell is found.
    ///
    /// # Panics
    /// If there are not as many labels as cells.
    pub fn carried(&self, labels: &[i32], places: &[Point<D>]) -> Vec<i32> {
        assert_eq!(labels.len(), self.cell_count(), "one label a cell");
        let label = |p: &Point<D>| self.cell_at(p).map_or(0, |cell| labels[cell as usize]);
        places.par_iter().with_min_len(1 << 8).map(label).collect()
    }
}

fn grid_of<const D: usize>(bounds: &Bounds<D>, points: &[Point<D>]) -> PointGrid<D> {
    let each = bounds.measure() / points.len().max(1) as f64;
    PointGrid::new(bounds, each.powf(1.0 / D as f64), points.iter().copied())
}

/// Triangles or tetrahedra, and which of them are about each place.
#[derive(Clone, Debug)]
struct Simplices<const D: usize> {
    points: Vec<Point<D>>,
    corners: Vec<u32>,
    min: Point<D>,
    width: f64,
    shape: [usize; D],
    /// Where the cells of each bin begin, and where the last ones end.
    starts: Vec<u32>,
    /// The cells whose boxes touch each bin, ascending.
    cells: Vec<u32>,
}

impl<const D: usize> Simplices<D> {
    fn new(mesh: &Mesh<D>) -> Self {
        let bounds = Bounds::of(mesh.points()).unwrap_or(Bounds { min: [0.0; D], max: [0.0; D] });
        let extent = bounds.extent();
        let least = 1e-6 * bounds.longest_edge();
        let each = extent.iter().map(|x| x.max(least)).product::<f64>() * OF_A_BIN as f64;
        let width = (each / mesh.cell_count().max(1) as f64).powf(1.0 / D as f64);
        let width = if width > 0.0 && width.is_finite() { width } else { 1.0 };
        let shape = extent.map(|x| (x / width) as usize + 1);
        let mut simplices = Self {
            points: mesh.points().to_vec(),
            corners: mesh.corners().to_vec(),
            min: bounds.min,
            width,
            shape,
            starts: vec![0; shape.iter().product::<usize>() + 1],
            cells: Vec::new(),
        };
        let mut counts = vec![0_u32; simplices.starts.len() - 1];
        (0..mesh.cell_count()).for_each(|cell| simplices.each_bin(cell, |bin| counts[bin] += 1));
        for (bin, count) in counts.iter().enumerate() {
            simplices.starts[bin + 1] = simplices.starts[bin] + count;
        }
        let mut next = simplices.starts.clone();
        let mut cells = vec![0; simplices.starts.last().map_or(0, |end| *end as usize)];
        for cell in 0..mesh.cell_count() {
            simplices.each_bin(cell, |bin| {
                cells[next[bin] as usize] = cell as u32;
                next[bin] += 1;
            });
        }
        simplices.cells = cells;
        simplices
    }

    fn corner(&self, cell: usize, k: usize) -> &Point<D> {
        &self.points[self.corners[cell * (D + 1) + k] as usize]
    }

    fn bin(&self, p: &Point<D>) -> [usize; D] {
        std::array::from_fn(|k| {
            let at = ((p[k] - self.min[k]) / self.width).max(0.0) as usize;
            at.min(self.shape[k] - 1)
        })
    }

    fn index(&self, bin: &[usize; D]) -> usize {
        (0..D).rev().fold(0, |index, k| index * self.shape[k] + bin[k])
    }

    /// Visits the bins that a cell's box touches.
    fn each_bin(&self, cell: usize, mut visit: impl FnMut(usize)) {
        let (mut min, mut max) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
        for corner in (0..=D).map(|k| self.corner(cell, k)) {
            for k in 0..D {
                (min[k], max[k]) = (min[k].min(corner[k]), max[k].max(corner[k]));
            }
        }
        let (low, high) = (self.bin(&min), self.bin(&max));
        let mut bin = low;
        loop {
            visit(self.index(&bin));
            let Some(axis) = (0..D).find(|&k| bin[k] < high[k]) else { return };
            bin[axis] += 1;
            bin[..axis].copy_from_slice(&low[..axis]);
        }
    }

    /// The cell in which a place is deepest: whose least barycentric coordinate is greatest. In bins around the place's own
    /// if that has no cell.
    fn at(&self, p: &Point<D>) -> Option<u32> {
        let own = self.bin(p);
        let farthest = self.shape.iter().max().copied().unwrap_or(0);
        for ring in 0..farthest {
            let low = own.map(|at| at.saturating_sub(ring));
            let high: [usize; D] = std::array::from_fn(|k| (own[k] + ring).min(self.shape[k] - 1));
            let mut best: Option<(f64, u32)> = None;
            let mut bin = low;
            loop {
                let index = self.index(&bin);
                let (from, to) = (self.starts[index] as usize, self.starts[index + 1] as usize);
                for &cell in &self.cells[from..to] {
                    let depth = self.depth(cell as usize, p);
                    let is_deeper = best.is_none_or(|(deepest, first)| {
                        depth > deepest || depth == deepest && cell < first
                    });
                    if is_deeper {
                        best = Some((depth, cell));
                    }
                }
                let Some(axis) = (0..D).find(|&k| bin[k] < high[k]) else { break };
                bin[axis] += 1;
                bin[..axis].copy_from_slice(&low[..axis]);
            }
            if let Some((_, cell)) = best {
                return Some(cell);
            }
        }
        None
    }

    /// The least barycentric coordinate of a place in a cell: 0 or more inside.
    fn depth(&self, cell: usize, p: &Point<D>) -> f64 {
        let corner = |k: usize| *self.corner(cell, k);
        let simplex = |moved: Option<usize>| {
            let at = |k: usize| if moved == Some(k) { *p } else { corner(k) };
            let others = std::array::from_fn(|k| at(k + 1));
            crate::geometry::Simplex { first: at(0), others }.measure()
        };
        let whole = simplex(None);
        let least = (0..=D).map(|k| simplex(Some(k)) / whole).fold(f64::INFINITY, f64::min);
        // of a flat cell nothing is known
        if least.is_nan() { f64::NEG_INFINITY } else { least }
    }
}

/// Where atoms were when labels were given, by where they are now.
#[derive(Clone, Debug)]
pub struct AtomMoves<const D: usize> {
    before: Vec<Point<D>>,
    now: Vec<Point<D>>,
    reach: f64,
    grid: Option<PointGrid<D>>,
}

impl<const D: usize> AtomMoves<D> {
    /// Atoms that are at `now`, in the same order as `before`; one that was not there stands in both at its place now.
    ///
    /// # Panics
    /// If there are not as many of the one as of the other.
    pub fn new(before: Vec<Point<D>>, now: Vec<Point<D>>) -> Self {
        assert_eq!(before.len(), now.len(), "each atom has two places");
        if before == now {
            return Self::none();
        }
        let bounds = Bounds::of(&now);
        let reach = bounds.as_ref().map_or(1.0, |bounds| 1e3 * bounds.longest_edge().max(1.0));
        let grid = bounds.map(|bounds| grid_of(&bounds, &now));
        Self { before, now, reach, grid }
    }

    /// No atom has moved, or none is the same.
    pub fn none() -> Self {
        Self { before: Vec::new(), now: Vec::new(), reach: 0.0, grid: None }
    }

    /// Where a place was: moved by as much as the atom nearest to it, the other way.
    pub fn back(&self, p: &Point<D>) -> Point<D> {
        let nearest = self.grid.as_ref().and_then(|grid| grid.nearest(p, self.reach, |_| true));
        let Some((atom, _)) = nearest else { return *p };
        let (from, to) = (&self.before[atom], &self.now[atom]);
        // exactly, where it has not moved
        std::array::from_fn(|k| if from[k] == to[k] { p[k] } else { p[k] + (from[k] - to[k]) })
    }

    /// Where the middle of each cell of a mesh was: the mean of where its corners were.
    pub fn middles(&self, mesh: &Mesh<D>) -> Vec<Point<D>> {
        let corners: Vec<Point<D>> = self.sites(mesh.points());
        let middle = |cell: &[u32]| {
            std::array::from_fn(|k| {
                let sum: f64 = cell.iter().map(|&corner| corners[corner as usize][k]).sum();
                sum / (D + 1) as f64
            })
        };
        mesh.cells().map(middle).collect()
    }

    /// Where each of the sites of Voronoi cells was.
    pub fn sites(&self, sites: &[Point<D>]) -> Vec<Point<D>> {
        sites.par_iter().with_min_len(1 << 8).map(|site| self.back(site)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Delaunay;
    use crate::watch::Silent;

    /// Points in a box of 10, and its corners, by a generator of Lehmer's.
    fn scatter<const D: usize>(count: usize, seed: u64) -> Vec<Point<D>> {
        let mut state = seed * 2 + 1;
        let mut next = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let corners = (0..1 << D).map(|i| std::array::from_fn(|k| f64::from(i >> k & 1) * 10.0));
        corners.chain((0..count).map(|_| std::array::from_fn(|_| 10.0 * next()))).collect()
    }

    fn holds<const D: usize>(mesh: &Mesh<D>, cell: u32, p: &Point<D>) -> bool {
        let corners = &mesh.corners()[cell as usize * (D + 1)..(cell as usize + 1) * (D + 1)];
        (0..=D).all(|moved| {
            let at = |k: usize| if k == moved { *p } else { mesh.points()[corners[k] as usize] };
            let others = std::array::from_fn(|k| at(k + 1));
            crate::geometry::Simplex { first: at(0), others }.orientation() >= 0.0
        })
    }

    fn check_found<const D: usize>(delaunay: &Delaunay<D>) {
        let mesh = delaunay.connect(&scatter::<D>(150, 4), &mut Silent).unwrap();
        let finder = CellFinder::of_mesh(&mesh);
        assert_eq!(finder.cell_count(), mesh.cell_count());
        for p in scatter::<D>(300, 5) {
            let cell = finder.cell_at(&p).unwrap();
            assert!(holds(&mesh, cell, &p), "cell {cell} at {p:?}");
        }
        let sites = mesh.points();
        let finder = CellFinder::of_sites(sites);
        for p in scatter::<D>(300, 6) {
            let nearest = (0..sites.len()).min_by(|&a, &b| {
                distance_squared(&sites[a], &p).total_cmp(&distance_squared(&sites[b], &p))
            });
            assert_eq!(finder.cell_at(&p).map(|cell| cell as usize), nearest);
        }
    }

    #[test]
    fn the_cell_at_a_place_has_it() {
        check_found(&Delaunay::<2>::new());
        check_found(&Delaunay::<3>::new());
    }

    /// Labels by the cells' numbers, so that each is told from the next.
    fn check_moves<const D: usize>(delaunay: &Delaunay<D>) {
        let before = scatter::<D>(200, 7);
        let mesh = delaunay.connect(&before, &mut Silent).unwrap();
        let labels: Vec<i32> = (1..=mesh.cell_count() as i32).collect();
        let finder = CellFinder::of_mesh(&mesh);
        let same = finder.carried(&labels, &AtomMoves::none().middles(&mesh));
        assert_eq!(same, labels, "the same cells have the same labels");
        // every inner atom goes 2 along x, as far as that goes: the rim stays, and so cells there change
        let mut now = before.clone();
        now.iter_mut().skip(1 << D).for_each(|p| p[0] = 0.1 * p[0] + 5.0 * (p[0] / 10.0));
        let moved = delaunay.connect(&now, &mut Silent).unwrap();
        let moves = AtomMoves::new(before.clone(), now.clone());
        let carried = finder.carried(&labels, &moves.middles(&moved));
        let names = |mesh: &Mesh<D>, points: &[Point<D>]| -> Vec<Vec<usize>> {
            let name = |corner: &u32| {
                let place = mesh.points()[*corner as usize];
                points.iter().position(|p| *p == place).unwrap()
            };
            let sorted = |cell: &[u32]| {
                let mut own: Vec<usize> = cell.iter().map(name).collect();
                own.sort_unstable();
                own
            };
            mesh.cells().map(sorted).collect()
        };
        let (old, new) = (names(&mesh, &before), names(&moved, &now));
        let mut kept = 0;
        for (cell, label) in new.iter().zip(&carried) {
            if let Some(own) = old.iter().position(|other| other == cell) {
                assert_eq!(*label, labels[own], "cell {cell:?} is the same three or four atoms");
                kept += 1;
            }
        }
        assert!(kept > 20 && kept < new.len(), "{kept} of {} cells are the same", new.len());
        // and each atom's own cell is its own
        let sites = CellFinder::of_sites(&before);
        let labels: Vec<i32> = (1..=before.len() as i32).collect();
        assert_eq!(sites.carried(&labels, &moves.sites(&now)), labels);
    }

    #[test]
    fn cells_of_the_same_atoms_keep_their_labels_wherever_these_are_moved() {
        check_moves(&Delaunay::<2>::new());
        check_moves(&Delaunay::<3>::new());
    }

    #[test]
    fn cells_of_other_atoms_have_the_labels_of_their_places() {
        let delaunay = Delaunay::<2>::new();
        let mesh = delaunay.connect(&scatter::<2>(800, 8), &mut Silent).unwrap();
        let is_left = |mesh: &Mesh<2>| -> Vec<i32> {
            AtomMoves::none().middles(mesh).iter().map(|p| i32::from(p[0] < 5.0)).collect()
        };
        let other = delaunay.connect(&scatter::<2>(700, 9), &mut Silent).unwrap();
        let middles = AtomMoves::none().middles(&other);
        let carried = CellFinder::of_mesh(&mesh).carried(&is_left(&mesh), &middles);
        let odd = carried.iter().zip(&is_left(&other)).filter(|(a, b)| a != b).count();
        // along the border some cells lie on its one side and most of them on the other: √1400 cells across
        assert!(odd < 40, "{odd} of {}", carried.len());
    }

    #[test]
    fn a_path_passes_the_cells_between_its_places() {
        let points = (0..22).map(|i| [f64::from(i % 11), f64::from(i / 11)]).collect();
        let corners = (0..10_u32).flat_map(|a| [a, a + 1, a + 12, a, a + 12, a + 11]).collect();
        let finder = CellFinder::of_mesh(&Mesh::<2>::new(points, corners).unwrap());
        assert_eq!(finder.along(&[[0.6, 0.2], [3.4, 0.2]], 0.1), [0, 2, 3, 4, 5, 6, 7]);
        assert_eq!(finder.along(&[[2.5, 0.25]], 0.1), [4]);
        assert!(finder.along(&[], 0.1).is_empty());
        assert_eq!(CellFinder::<2>::of_sites(&[]).cell_at(&[0.0; 2]), None);
        let none = Mesh::<2>::new(Vec::new(), Vec::new()).unwrap();
        assert_eq!(CellFinder::of_mesh(&none).cell_at(&[0.0; 2]), None);
    }
}
