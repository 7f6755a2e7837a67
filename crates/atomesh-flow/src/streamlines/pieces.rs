//! Cells as simplices with the flux out of each facet.
//!
//! A triangle or tetrahedron is one piece. A Voronoi cell is cut into cones from its centroid to its faces, in space to the
//! triangles of these. The fluxes between the pieces of a cell are those of the cell's mean velocity, plus the correction
//! of least norm that balances each piece: exact where the velocity is constant.

use atomesh::geometry::{Point, Simplex, difference, dot};
use atomesh::mesh::PolyMesh;

use super::simplex::Corners;
use crate::grid::FlowGrid;
use crate::setting::Setting;
use crate::solution::Solution;

/// Share of the largest flux up to which a flux is rounding: no line follows it.
const ROUNDING: f64 = 1e-13;

/// The number of a corner that is a cell's centroid.
pub const CENTROID: u32 = u32::MAX;

/// Fluxes that lines may follow.
pub struct FluxField<'a, const D: usize> {
    pub grid: &'a FlowGrid<D>,
    /// The flux out of each facet's `cell`; 0 if it is sealed, or on the boundary without a condition.
    pub fluxes: Vec<f64>,
    pub solution: &'a Solution<D>,
    /// Fluxes up to this are rounding.
    least: f64,
}

impl<'a, const D: usize> FluxField<'a, D> {
    pub fn new(grid: &'a FlowGrid<D>, setting: &Setting<'_, D>, solution: &'a Solution<D>) -> Self {
        let largest = solution.fluxes.iter().fold(0.0_f64, |most, flux| most.max(flux.abs()));
        let least = ROUNDING * largest;
        let open = |facet: usize| {
            let inside = grid.facets()[facet].neighbour.is_some();
            setting.multipliers()[facet] > 0.0 && (inside || setting.condition(facet).is_some())
        };
        let of = |(facet, &flux): (usize, &f64)| {
            if open(facet) && flux.abs() > least && flux.is_finite() { flux } else { 0.0 }
        };
        let fluxes = solution.fluxes.iter().enumerate().map(of).collect();
        Self { grid, fluxes, solution, least }
    }

    /// The flux out of a cell through one of its facets.
    pub fn out_of(&self, cell: usize, facet: usize) -> f64 {
        let owns = self.grid.facets()[facet].cell as usize == cell;
        if owns { self.fluxes[facet] } else { -self.fluxes[facet] }
    }

    /// The cell on the other side of a facet.
    pub fn beyond(&self, cell: usize, facet: usize) -> Option<u32> {
        let facet = &self.grid.facets()[facet];
        if facet.cell as usize == cell { facet.neighbour } else { Some(facet.cell) }
    }

    /// The pieces of a cell.
    pub fn pieces(&self, cell: usize) -> Vec<Piece<D>> {
        match self.grid.cells() {
            Some(mesh) => self.cut(mesh, cell),
            None => vec![self.whole(cell)],
        }
    }

    fn whole(&self, cell: usize) -> Piece<D> {
        let mesh = self.grid.mesh().expect("cells of a grid are Voronoi cells or simplices");
        let corners = &mesh.corners()[cell * (D + 1)..(cell + 1) * (D + 1)];
        let mut numbers = [CENTROID; 4];
        numbers[..=D].copy_from_slice(corners);
        let measure = self.grid.measures()[cell];
        let simplex = mesh.simplex(corners);
        let mut piece =
            Piece { simplex, numbers, measure, fluxes: [0.0; 4], beyond: [Neighbour::Nothing; 4] };
        for &facet in self.grid.facets_of(cell) {
            let own = self.grid.facet_corners(facet as usize).expect("facets of a mesh");
            let opposite = corners.iter().position(|corner| !own.contains(corner));
            if let Some(opposite) = opposite {
                piece.fluxes[opposite] = self.out_of(cell, facet as usize);
                piece.beyond[opposite] = Neighbour::Facet(facet);
            }
        }
        piece
    }

    fn cut(&self, mesh: &PolyMesh<D>, cell: usize) -> Vec<Piece<D>> {
        let first = mesh.centroids()[cell];
        let mut pieces = Vec::new();
        let mut signs = Vec::new();
        for (face, sign) in mesh.faces_of(cell) {
            let start = pieces.len();
            for corners in mesh.face_parts(face) {
                let others = corners.map(|corner| mesh.points()[corner as usize]);
                let simplex = Simplex { first, others };
                let mut numbers = [CENTROID; 4];
                numbers[1..=D].copy_from_slice(&corners);
                let measure = (sign * simplex.measure()).max(0.0);
                let mut beyond = [Neighbour::Nothing; 4];
                beyond[0] = Neighbour::Facet(face as u32);
                pieces.push(Piece { simplex, numbers, measure, fluxes: [0.0; 4], beyond });
                signs.push(sign);
            }
            let whole: f64 = pieces[start..].iter().map(|piece| piece.measure).sum();
            let count = (pieces.len() - start) as f64;
            for piece in &mut pieces[start..] {
                let share = if whole > 0.0 { piece.measure / whole } else { 1.0 / count };
                piece.fluxes[0] = share * self.out_of(cell, face);
            }
        }
        self.balance(cell, &mut pieces, &signs);
        pieces
    }

    /// Computes the fluxes between the pieces of a cell.
    fn balance(&self, cell: usize, pieces: &mut [Piece<D>], signs: &[f64]) {
        let velocity = self.mean_velocity(cell);
        let links = links(pieces);
        let count = pieces.len();
        let mut matrix = vec![0.0; count * count];
        let net: f64 = pieces.iter().map(|piece| piece.fluxes[0]).sum();
        let whole: f64 = pieces.iter().map(|piece| piece.measure).sum();
        let mut excess: Vec<f64> =
            pieces.iter().map(|p| net * p.measure / whole - p.fluxes[0]).collect();
        let mut weights = Vec::with_capacity(links.len());
        for link in &links {
            let [a, b] = link.pieces;
            let area = pieces[a].area(link.opposite[0], signs[a]);
            let flux = dot(&area, &velocity);
            excess[a] -= flux;
            excess[b] += flux;
            pieces[a].fluxes[link.opposite[0]] = flux;
            let weight = dot(&area, &area).sqrt();
            for (i, j) in [(a, b), (b, a)] {
                matrix[i * count + i] += weight;
                matrix[i * count + j] -= weight;
            }
            weights.push(weight);
        }
        solve_pinned(&mut matrix, &mut excess);
        for (link, weight) in links.iter().zip(weights) {
            let [a, b] = link.pieces;
            let own = &mut pieces[a].fluxes[link.opposite[0]];
            let flux = *own + weight * (excess[a] - excess[b]);
            let flux = if flux.abs() > self.least && flux.is_finite() { flux } else { 0.0 };
            *own = flux;
            pieces[b].fluxes[link.opposite[1]] = -flux;
            pieces[a].beyond[link.opposite[0]] = Neighbour::Piece(b as u32);
            pieces[b].beyond[link.opposite[1]] = Neighbour::Piece(a as u32);
        }
    }

    /// `Σ F_f (x_f − x_K) / |K|`, as [`Solution::velocities`].
    fn mean_velocity(&self, cell: usize) -> Point<D> {
        let centre = &self.grid.centroids()[cell];
        let mut velocity = [0.0; D];
        for &facet in self.grid.facets_of(cell) {
            let way = difference(&self.grid.facets()[facet as usize].centroid, centre);
            let flux = self.out_of(cell, facet as usize);
            (0..D).for_each(|axis| velocity[axis] += flux * way[axis]);
        }
        velocity.map(|x| x / self.grid.measures()[cell])
    }
}

/// What lies beyond a facet of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Neighbour {
    /// Unknown.
    Nothing,
    /// A facet of the grid.
    Facet(u32),
    /// Another piece of the cell.
    Piece(u32),
}

/// A simplex of a cell.
#[derive(Clone, Debug)]
pub struct Piece<const D: usize> {
    pub simplex: Simplex<D>,
    /// The numbers of its corners in the mesh.
    pub numbers: [u32; 4],
    /// Its area (plane) or volume (space).
    pub measure: f64,
    /// The flux out of the facet opposite each corner.
    pub fluxes: Corners,
    /// What lies beyond the facet opposite each corner.
    pub beyond: [Neighbour; 4],
}

impl<const D: usize> Piece<D> {
    /// The place of barycentric coordinates.
    pub fn place(&self, weights: &Corners) -> Point<D> {
        std::array::from_fn(|axis| {
            let others = self.simplex.others.iter().zip(&weights[1..]);
            let sum: f64 = others.map(|(point, weight)| weight * point[axis]).sum();
            weights[0] * self.simplex.first[axis] + sum
        })
    }

    /// The area vector, outward, of the facet opposite a corner; `sign` is the orientation's.
    fn area(&self, opposite: usize, sign: f64) -> Point<D> {
        // the measure as a function of the corner's place is 0 on the facet; its gradient is the inward area vector / D
        let on = if opposite == 0 { self.simplex.others[0] } else { self.simplex.first };
        std::array::from_fn(|axis| {
            let mut place = on;
            place[axis] += 1.0;
            let mut moved = self.simplex;
            match opposite {
                0 => moved.first = place,
                _ => moved.others[opposite - 1] = place,
            }
            -sign * D as f64 * moved.measure()
        })
    }
}

/// A facet between two pieces of a cell, by the corners opposite to it.
struct Link {
    pieces: [usize; 2],
    opposite: [usize; 2],
}

/// The facets between pieces: two pieces share one if they have all corners but one in common.
fn links<const D: usize>(pieces: &[Piece<D>]) -> Vec<Link> {
    let alone = |a: &Piece<D>, b: &Piece<D>| {
        let mut apart = (1..=D).filter(|&k| !b.numbers[1..=D].contains(&a.numbers[k]));
        let first = apart.next();
        first.filter(|_| apart.next().is_none())
    };
    let mut links = Vec::new();
    for b in 0..pieces.len() {
        for a in 0..b {
            let (left, right) = (alone(&pieces[a], &pieces[b]), alone(&pieces[b], &pieces[a]));
            if let (Some(left), Some(right)) = (left, right) {
                links.push(Link { pieces: [a, b], opposite: [left, right] });
            }
        }
    }
    links
}

/// Solves a graph's Laplacian for a right-hand side of sum 0, with the first value 0, by a Cholesky factor in place; the
/// value of a row without a pivot is 0.
fn solve_pinned(matrix: &mut [f64], rhs: &mut [f64]) {
    let count = rhs.len();
    if count == 0 {
        return;
    }
    let largest = (0..count).map(|i| matrix[i * count + i]).fold(0.0, f64::max);
    rhs[0] = 0.0;
    for j in 1..count {
        let mut pivot = matrix[j * count + j];
        (1..j).for_each(|k| pivot -= matrix[j * count + k] * matrix[j * count + k]);
        let root = if pivot > 1e-14 * largest { pivot.sqrt() } else { f64::INFINITY };
        matrix[j * count + j] = root;
        for i in j + 1..count {
            let mut entry = matrix[i * count + j];
            (1..j).for_each(|k| entry -= matrix[i * count + k] * matrix[j * count + k]);
            matrix[i * count + j] = entry / root;
        }
    }
    for i in 1..count {
        let before: f64 = (1..i).map(|k| matrix[i * count + k] * rhs[k]).sum();
        rhs[i] = (rhs[i] - before) / matrix[i * count + i];
    }
    for i in (1..count).rev() {
        let after: f64 = (i + 1..count).map(|k| matrix[k * count + i] * rhs[k]).sum();
        rhs[i] = (rhs[i] - after) / matrix[i * count + i];
    }
}
