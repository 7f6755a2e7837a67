//! Better places on an outline for the points of its facets, and better fitting facets.
//!
//! A trimmed mesh has its outline's points where atoms and crossings happened to be. Point by point, those on the
//! outline slide along it and those beside it move freely: of a few places tried, each takes the one at which its
//! worst cell is best. Facets between points of a curved surface cut off its bulges, so the outline's points then step
//! out by as much, and the mesh has the mask's measure. Cost: O(points at the outline).

use crate::geometry::{Point, Simplex, difference, distance_squared, dot};
use crate::mesh::{CellsOfPoints, Mesh, area_vector};
use crate::watch::{Phase, Watch, check};

use super::regularity::regularity;
use super::{Outline, RegionError, Trimmed};

/// Rounds over all points beside the outline.
const SWEEPS: usize = 4;
/// Points whose cells are all more regular than this stay.
const GOOD: f64 = 0.7;
/// Lengths of the steps tried, over the mean length of a point's edges.
const STEPS: [f64; 2] = [0.2, 0.06];
/// Least gain in the regularity of a point's worst cell for the point to move.
const GAIN: f64 = 1e-3;
/// Least regularity of the cells of a point that is put onto the outline or stepped out, if they had as much before.
const FLOOR: f64 = 0.15;

/// The points and cells of a trimmed mesh while points move.
struct Moving<'a, const D: usize> {
    points: Vec<Point<D>>,
    corners: Vec<u32>,
    freedom: &'a [u8],
    on: Vec<bool>,
    cells: CellsOfPoints,
    outline: &'a Outline<D>,
}

impl<'a, const D: usize> Moving<'a, D> {
    fn new(trimmed: &'a Trimmed<D>, outline: &'a Outline<D>) -> Self {
        let (points, corners) = trimmed.mesh.clone().into_parts();
        let (on, cells) = (trimmed.on_outline(), trimmed.mesh.cells_of_points());
        Self { points, corners, freedom: &trimmed.freedom, on, cells, outline }
    }

    fn cells_of(&self, point: usize) -> &[u32] {
        self.cells.of(point as u32)
    }

    fn corners_of(&self, cell: u32) -> &[u32] {
        let at = cell as usize * (D + 1);
        &self.corners[at..at + D + 1]
    }

    /// The regularity of a point's worst cell if the point were at `p`.
    fn worst(&self, point: usize, p: &Point<D>) -> f64 {
        let mut worst = f64::INFINITY;
        for &cell in self.cells_of(point) {
            let corners = self.corners_of(cell);
            let at = |k: usize| {
                if corners[k] as usize == point { *p } else { self.points[corners[k] as usize] }
            };
            let simplex = Simplex { first: at(0), others: std::array::from_fn(|k| at(k + 1)) };
            worst = worst.min(regularity(&simplex));
        }
        worst
    }

    /// The mean of the points joined to one, and their mean distance, both weighted by the cells that share the edge.
    fn neighbourhood(&self, point: usize) -> (Point<D>, f64) {
        let (mut mean, mut length, mut count) = ([0.0; D], 0.0, 0.0);
        for &cell in self.cells_of(point) {
            for &c in self.corners_of(cell).iter().filter(|&&c| c as usize != point) {
                let q = &self.points[c as usize];
                mean = std::array::from_fn(|k| mean[k] + q[k]);
                length += distance_squared(q, &self.points[point]).sqrt();
                count += 1.0;
            }
        }
        (mean.map(|x| x / count), length / count)
    }

    /// Moves a point to the best place tried. `true` if it moved.
    fn improve(&mut self, point: usize) -> bool {
        let free = self.freedom[point];
        let from = self.points[point];
        let before = self.worst(point, &from);
        if free == 0 || before >= GOOD {
            return false;
        }
        let (mean, length) = self.neighbourhood(point);
        let along = |v: &Point<D>, share: f64| -> Point<D> {
            std::array::from_fn(
                |k| if free >> k & 1 == 1 { from[k] + share * v[k] } else { from[k] },
            )
        };
        let inward = difference(&mean, &from);
        let mut tried = vec![along(&inward, 1.0), along(&inward, 0.5)];
        let normal = if self.on[point] { self.outline.normal(&from, free) } else { None };
        for direction in directions::<D>() {
            // steps off the outline would only be taken back
            if normal.is_none_or(|n| dot(&n, &direction).abs() < 0.6) {
                tried.extend(STEPS.map(|step| along(&direction, step * length)));
            }
        }
        let mut best = (before + GAIN, from);
        for p in tried {
            let place = if self.on[point] {
                self.outline.project(&p, free, 0.5 * length)
            } else {
                Some(p).filter(|p| self.outline.bounds().contains(p))
            };
            if let Some(p) = place {
                let worst = self.worst(point, &p);
                if worst > best.0 {
                    best = (worst, p);
                }
            }
        }
        self.points[point] = best.1;
        best.1 != from
    }

    /// Puts a point that is beside the outline onto it, if its cells stay well shaped.
    fn land(&mut self, point: usize) {
        let (_, length) = self.neighbourhood(point);
        let from = self.points[point];
        if let Some(p) = self.outline.project(&from, self.freedom[point], length)
            && self.worst(point, &p) >= FLOOR.min(self.worst(point, &from))
        {
            self.points[point] = p;
        }
    }

    /// The points of all cells with a point on the outline.
    fn beside(&self) -> Vec<usize> {
        let mut near = vec![false; self.points.len()];
        for cell in self.corners.chunks_exact(D + 1) {
            if cell.iter().any(|&c| self.on[c as usize]) {
                cell.iter().for_each(|&c| near[c as usize] = true);
            }
        }
        (0..near.len()).filter(|&i| near[i]).collect()
    }
}

/// Unit vectors to the sides and corners of a square, or to the faces and corners of a cube.
fn directions<const D: usize>() -> impl Iterator<Item = Point<D>> {
    let sides = (0..2 * D).map(|i| {
        std::array::from_fn(|k| if k == i / 2 { 1.0 - 2.0 * (i % 2) as f64 } else { 0.0 })
    });
    let corner = (D as f64).sqrt().recip();
    let corners = (0..1_usize << D)
        .map(move |c| std::array::from_fn(|k| if c >> k & 1 == 1 { corner } else { -corner }));
    sides.chain(corners)
}

/// Moves the points on the outline along it, and those beside it, to where their cells are better shaped.
///
/// # Errors
/// [`RegionError::Cancelled`].
pub fn smooth_outline<const D: usize>(
    trimmed: Trimmed<D>,
    outline: &Outline<D>,
    watch: &mut dyn Watch,
) -> Result<Trimmed<D>, RegionError> {
    let mut moving = Moving::new(&trimmed, outline);
    for point in 0..moving.points.len() {
        if moving.on[point] && moving.freedom[point] != 0 {
            moving.land(point);
        }
    }
    let beside = moving.beside();
    // points whose surroundings have changed since they were looked at
    let mut stale = vec![true; moving.points.len()];
    for sweep in 0..SWEEPS {
        check(watch, Phase::Improve, sweep as f64 / SWEEPS as f64, None)?;
        for &point in &beside {
            if std::mem::replace(&mut stale[point], false) && moving.improve(point) {
                for &cell in moving.cells_of(point) {
                    moving.corners_of(cell).iter().for_each(|&c| stale[c as usize] = true);
                }
            }
        }
    }
    let Moving { points, corners, .. } = moving;
    Ok(Trimmed { mesh: Mesh::new(points, corners)?, ..trimmed })
}

/// Steps the outline's points out, or in, by the mean distance of the outline from the facets beside them. Over a facet
/// it is D/(D + 1) of the distance at the centroid, as that of a parabola through the corners is.
///
/// # Errors
/// [`RegionError::Mesh`].
pub fn fit_facets<const D: usize>(
    trimmed: Trimmed<D>,
    outline: &Outline<D>,
) -> Result<Trimmed<D>, RegionError> {
    let mut moving = Moving::new(&trimmed, outline);
    let mut sums = vec![(0.0, 0.0); moving.points.len()];
    for facet in &trimmed.facets {
        let corners = facet.map(|c| moving.points[c as usize]);
        let centroid: Point<D> =
            std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / D as f64);
        let normal = area_vector(&corners);
        let measure = dot(&normal, &normal).sqrt();
        // the edge, or the side of a square as large as two such triangles
        let length = ((D - 1) as f64 * measure).powf(1.0 / (D as f64 - 1.0));
        let all = ((1 << D) - 1) as u8;
        if let Some(q) = outline.project(&centroid, all, 0.5 * length) {
            let lack = dot(&difference(&q, &centroid), &normal) / measure;
            for &c in facet {
                let (sum, weight) = &mut sums[c as usize];
                *sum += measure * lack;
                *weight += measure;
            }
        }
    }
    let share = D as f64 / (D + 1) as f64;
    for (point, (sum, weight)) in sums.into_iter().enumerate() {
        let free = trimmed.freedom[point];
        let from = moving.points[point];
        let Some(normal) = outline.normal(&from, free).filter(|_| weight > 0.0) else { continue };
        let step = share * sum / weight;
        let p: Point<D> = std::array::from_fn(|k| from[k] + step * normal[k]);
        if outline.bounds().contains(&p)
            && moving.worst(point, &p) >= FLOOR.min(moving.worst(point, &from))
        {
            moving.points[point] = p;
        }
    }
    let Moving { points, corners, .. } = moving;
    Ok(Trimmed { mesh: Mesh::new(points, corners)?, ..trimmed })
}
