//! From Delaunay's mesh to loops of circumcentres.
//!
//! A face between two cells (3-D), or a cell (2-D), is the loop of the circumcentres of the Delaunay cells around an edge,
//! or around a site.

use crate::parallel::prelude::*;

use super::VoronoiError;
use crate::geometry::linear::solve;
use crate::geometry::{Bounds, Point, Sets, Simplex, difference, distance_squared, dot};
use crate::mesh::{CellsOfPoints, Delaunay, Mesh};
use crate::watch::Watch;

/// Sites whose loops one task makes.
const BLOCK: usize = 1 << 10;

/// In place of a cell: none (2-D, where loops are cells themselves).
pub(super) const NONE: u32 = u32::MAX;

/// Below this volume of the parallelepiped of its unit edges, a cell's circumcentre is lost to rounding.
const FLAT: f64 = 1e-14;

/// The box and the tolerances.
pub(super) struct Domain<const D: usize> {
    pub bounds: Bounds<D>,
    /// How far a vertex may be moved off a plane.
    pub tolerance: f64,
    /// The least distance of two sites.
    pub least_gap: f64,
}

/// Loops of points: in 3-D the faces between two cells, in 2-D the cells themselves.
#[derive(Default)]
pub(super) struct Loops {
    /// The points of all loops, one loop after another.
    pub corners: Vec<u32>,
    /// Where each loop ends.
    pub ends: Vec<usize>,
    /// The cell from whose outside a loop runs counter-clockwise, and the other one; in 2-D the cell, and [`NONE`].
    /// Ghosts have numbers beyond the sites'.
    pub cells: Vec<[u32; 2]>,
}

impl Loops {
    /// Appends a loop.
    pub fn push(&mut self, corners: impl IntoIterator<Item = u32>, cells: [u32; 2]) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
        self.cells.push(cells);
    }

    /// The loops with their cells.
    pub fn iter(&self) -> impl Iterator<Item = (&[u32], [u32; 2])> {
        (0..self.ends.len()).map(|n| {
            let start = if n == 0 { 0 } else { self.ends[n - 1] };
            (&self.corners[start..self.ends[n]], self.cells[n])
        })
    }
}

/// The Voronoi complex before it is cut: its vertices and its loops.
pub(super) struct Dual<const D: usize> {
    pub points: Vec<Point<D>>,
    pub loops: Loops,
    /// The number of sites; cells of greater numbers are the ghosts'.
    pub site_count: usize,
}

/// Makes the complex of the sites and some ghosts.
pub(super) fn dual<const D: usize>(
    delaunay: &Delaunay<D>,
    sites: &[Point<D>],
    domain: &Domain<D>,
    watch: &mut dyn Watch,
) -> Result<Dual<D>, VoronoiError> {
    let mut points = sites.to_vec();
    points.extend(ghosts(&domain.bounds));
    let mesh = delaunay.connect(&points, watch)?;
    let spheres: Vec<Sphere<D>> = mesh
        .corners()
        .par_chunks_exact(D + 1)
        .with_min_len(BLOCK)
        .map(|cell| Sphere::of(&mesh.simplex(cell)))
        .collect();
    let cells = mesh.cells_of_points();
    let rings = Rings { mesh: &mesh, spheres: &spheres, cells, sites: sites.len(), domain };
    let blocks: Vec<Block> = (0..sites.len().div_ceil(BLOCK))
        .into_par_iter()
        .map(|b| rings.block(b * BLOCK..((b + 1) * BLOCK).min(sites.len())))
        .collect();
    if let Some((sites, squared)) = blocks.iter().find_map(|block| block.close) {
        let (distance, least) = (squared.sqrt(), domain.least_gap);
        return Err(VoronoiError::Close { sites: sites.map(|i| i as usize), distance, least });
    }
    let groups = group(&spheres, &blocks);
    Ok(Dual { loops: join(blocks, &groups.of), points: groups.points, site_count: sites.len() })
}

/// Points so far outside that every point of the box is nearer to any site: two for each axis, with the box well inside
/// their hull.
fn ghosts<const D: usize>(bounds: &Bounds<D>) -> Vec<Point<D>> {
    let extent = bounds.extent();
    let far = 4.0 * extent.iter().sum::<f64>();
    let middle: Point<D> = std::array::from_fn(|k| bounds.min[k] + 0.5 * extent[k]);
    (0..2 * D)
        .map(|n| {
            let mut ghost = middle;
            ghost[n / 2] += if n % 2 == 0 { -far } else { far };
            ghost
        })
        .collect()
}

/// The circumsphere of a cell.
#[derive(Clone, Copy)]
struct Sphere<const D: usize> {
    /// A corner of the cell.
    anchor: Point<D>,
    /// The centre, from there.
    offset: Point<D>,
    /// The volume of the parallelepiped of the unit edges at the anchor: how well conditioned the centre is.
    solidity: f64,
}

impl<const D: usize> Sphere<D> {
    /// Solves c · e = ½ |e|² for the edges e from one corner, each divided by its length. With rows of one size,
    /// elimination leaves the centre on every bisecting plane to a rounding, even in a thin cell. The corner is an end of
    /// the shortest edge, whose plane would suffer most.
    fn of(simplex: &Simplex<D>) -> Self {
        let at = |k: usize| if k == 0 { simplex.first } else { simplex.others[k - 1] };
        let mut shortest = (f64::INFINITY, 0);
        for a in 0..=D {
            for b in a + 1..=D {
                let squared = distance_squared(&at(a), &at(b));
                if squared < shortest.0 {
                    shortest = (squared, a);
                }
            }
        }
        let anchor = at(shortest.1);
        let (mut rows, mut right) = ([[0.0; D]; D], [[0.0; 1]; D]);
        for (row, k) in (0..=D).filter(|&k| k != shortest.1).enumerate() {
            let edge = difference(&at(k), &anchor);
            let length = dot(&edge, &edge).sqrt();
            rows[row] = edge.map(|x| x / length);
            right[row] = [0.5 * length];
        }
        let solidity = solve(D, rows, &mut right).abs();
        let offset = right.map(|[x]| x);
        if solidity > FLAT && offset.iter().all(|x| x.is_finite()) {
            return Self { anchor, offset, solidity };
        }
        let mean = |k: usize| (0..=D).map(|c| at(c)[k] - anchor[k]).sum::<f64>() / (D + 1) as f64;
        Self { anchor, offset: std::array::from_fn(mean), solidity: 0.0 }
    }

    fn center(&self) -> Point<D> {
        std::array::from_fn(|k| self.anchor[k] + self.offset[k])
    }

    /// The distance of the centre from the plane that bisects `q` and a point of the sphere, which is `gap` from it.
    fn miss(&self, q: &Point<D>, gap: f64) -> f64 {
        let v = difference(q, &self.anchor);
        (dot(&v, &v) - 2.0 * dot(&v, &self.offset)).abs() / (2.0 * gap)
    }
}

/// What one task finds.
#[derive(Default)]
struct Block {
    loops: Loops,
    /// Neighbouring cells with one centre.
    merges: Vec<[u32; 2]>,
    leans: Vec<Lean>,
    /// Two sites that are too near each other, and their squared distance.
    close: Option<([u32; 2], f64)>,
}

/// A cell whose far corner is on the sphere of a neighbour of better shape.
#[derive(Clone, Copy)]
struct Lean {
    cell: u32,
    /// How far a vertex moves off its plane if it is put at the neighbour's centre.
    miss: f64,
    neighbour: u32,
}

/// A cell around a loop.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Link {
    /// The loop's other site; [`NONE`] in 2-D.
    other: u32,
    /// The corner before, seen counter-clockwise.
    before: u32,
    /// The corner after.
    after: u32,
    cell: u32,
}

/// Delaunay's mesh, and the cells around each of its sites.
struct Rings<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    spheres: &'a [Sphere<D>],
    cells: CellsOfPoints,
    sites: usize,
    domain: &'a Domain<D>,
}

impl<const D: usize> Rings<'_, D> {
    fn block(&self, sites: std::ops::Range<usize>) -> Block {
        let (mut block, mut links) = (Block::default(), Vec::new());
        for site in sites {
            links.clear();
            self.links(site, &mut links, &mut block);
            links.sort_unstable();
            for ring in links.chunk_by(|a, b| a.other == b.other) {
                self.ring(site as u32, ring, &mut block);
            }
        }
        block
    }

    /// The links of all loops of a site: of its cell in 2-D, of its faces to sites of greater number in 3-D.
    fn links(&self, site: usize, links: &mut Vec<Link>, block: &mut Block) {
        let (points, corners) = (self.mesh.points(), self.mesh.corners());
        let least = self.domain.least_gap.powi(2);
        for &cell in self.cells.of(site as u32) {
            let cell_corners = &corners[cell as usize * (D + 1)..(cell as usize + 1) * (D + 1)];
            let at = cell_corners.iter().position(|&c| c as usize == site).unwrap_or(0);
            let mut others: [u32; D] =
                std::array::from_fn(|k| cell_corners[k + usize::from(k >= at)]);
            if at % 2 == 1 {
                others.swap(D - 2, D - 1); // the site first and these after it are positive again
            }
            for other in others.into_iter().filter(|&o| o as usize > site) {
                let squared = distance_squared(&points[site], &points[other as usize]);
                if squared < least && (other as usize) < self.sites && block.close.is_none() {
                    block.close = Some(([site as u32, other], squared));
                }
            }
            if D == 2 {
                links.push(Link { other: NONE, before: others[0], after: others[1], cell });
                continue;
            }
            for k in 0..D {
                let [other, before, after] = [0, 1, 2].map(|n| others[(k + n) % D]);
                if other as usize > site {
                    links.push(Link { other, before, after, cell });
                }
            }
        }
    }

    /// Follows the links around, as a loop of cells.
    fn ring(&self, site: u32, ring: &[Link], block: &mut Block) {
        let mut at = ring[0];
        for _ in 0..ring.len() {
            block.loops.corners.push(at.cell);
            // ghosts surround all sites, so the ring is closed
            let Ok(next) = ring.binary_search_by(|link| link.before.cmp(&at.after)) else { break };
            let next = ring[next];
            self.compare(site, at, next, block);
            at = next;
        }
        block.loops.ends.push(block.loops.corners.len());
        block.loops.cells.push([site, at.other]);
    }

    /// Notes whether two cells that follow each other around a loop lie on one sphere. Each facet is looked at once.
    fn compare(&self, site: u32, at: Link, next: Link, block: &mut Block) {
        let (other, shared) = (at.other, at.after);
        let last = if other == NONE { site } else { other };
        if shared < last {
            return;
        }
        let (a, b) = (&self.spheres[at.cell as usize], &self.spheres[next.cell as usize]);
        // the better conditioned sphere, and the corner of the other cell that it has not
        let (sphere, apex) =
            if a.solidity >= b.solidity { (a, next.after) } else { (b, at.before) };
        if sphere.solidity == 0.0 {
            return;
        }
        let points = self.mesh.points();
        let apex = &points[apex as usize];
        let corners = [site, other, shared].into_iter().filter(|&c| c != NONE);
        let squared = corners.map(|c| distance_squared(apex, &points[c as usize]));
        let gap = squared.fold(f64::INFINITY, f64::min).sqrt();
        let [lesser, better] =
            if a.solidity >= b.solidity { [next.cell, at.cell] } else { [at.cell, next.cell] };
        let (tolerance, is_flat) = (self.domain.tolerance, a.solidity.min(b.solidity) == 0.0);
        if !is_flat && distance_squared(&a.center(), &b.center()) <= tolerance.powi(2) {
            block.merges.push([lesser, better]);
            return;
        }
        let miss = sphere.miss(apex, gap);
        if miss <= tolerance || is_flat {
            block.leans.push(Lean { cell: lesser, miss, neighbour: better });
        }
    }
}

/// The vertex that each cell of Delaunay's mesh becomes, and where the vertices are.
struct Groups<const D: usize> {
    of: Vec<u32>,
    points: Vec<Point<D>>,
}

/// Cells with one centre are one vertex. The centre of a thin cell, whose corners are nearly on one circle, may be
/// anywhere along the circle's axis: the cell becomes one with one neighbour, never with two, which may be far apart.
fn group<const D: usize>(spheres: &[Sphere<D>], blocks: &[Block]) -> Groups<D> {
    let mut sets = Sets::new(spheres.len());
    let mut is_joined = vec![false; spheres.len()];
    for &[a, b] in blocks.iter().flat_map(|block| &block.merges) {
        sets.join(a, b);
        is_joined[a as usize] = true;
        is_joined[b as usize] = true;
    }
    let leans = blocks.iter().flat_map(|block| block.leans.iter().copied());
    let mut leans: Vec<_> = leans.filter(|lean| !is_joined[lean.cell as usize]).collect();
    leans.sort_by(|a, b| {
        let by_miss = a.cell.cmp(&b.cell).then(a.miss.total_cmp(&b.miss));
        by_miss.then(a.neighbour.cmp(&b.neighbour))
    });
    leans.dedup_by_key(|lean| lean.cell);
    for lean in leans {
        sets.join(lean.cell, lean.neighbour);
    }
    let (mut of, mut best) = (vec![0; spheres.len()], Vec::<u32>::new());
    for cell in 0..spheres.len() {
        let root = sets.root(cell as u32) as usize;
        if root == cell {
            of[cell] = best.len() as u32; // roots are the lowest of their sets
            best.push(cell as u32);
        } else {
            of[cell] = of[root];
            let known = &mut best[of[root] as usize];
            if spheres[cell].solidity > spheres[*known as usize].solidity {
                *known = cell as u32;
            }
        }
    }
    let points = best.iter().map(|&cell| spheres[cell as usize].center()).collect();
    Groups { of, points }
}

/// The loops of all blocks, one after another, as loops of vertices.
fn join(blocks: Vec<Block>, vertex_of: &[u32]) -> Loops {
    let mut loops = Loops::default();
    let mut ring = Vec::new();
    for block in &blocks {
        for (corners, cells) in block.loops.iter() {
            ring.clear();
            ring.extend(corners.iter().map(|&c| vertex_of[c as usize]));
            ring.dedup();
            while ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            if ring.len() > 2 {
                loops.push(ring.iter().copied(), cells);
            }
        }
    }
    loops
}
