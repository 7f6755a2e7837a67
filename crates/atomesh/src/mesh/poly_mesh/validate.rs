//! What a mesh of polygons or polyhedra promises, checked.

use crate::parallel::prelude::*;

use super::{PolyMesh, PolyParts, mean_distance};
use crate::geometry::{Bounds, Point, difference, dot};
use crate::mesh::side_name;

/// Cells that one task looks at.
const BLOCK: usize = 1 << 10;

/// How far a corner may be off the plane of its face, or beyond that of another face of its cell, over the mean
/// distance of cells.
const PLANAR: f64 = 1e-9;

/// The first promise that a mesh breaks.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PolyFault {
    /// The counts of the parts disagree.
    #[error("{found} {what}; expected {expected}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many the other parts ask for.
        expected: usize,
    },
    /// A face names a point or a cell that does not exist.
    #[error("face {face} names {what} {found}; there are {count}")]
    Missing {
        /// The face's index.
        face: usize,
        /// "point" or "cell".
        what: &'static str,
        /// What it names.
        found: u32,
        /// How many there are.
        count: usize,
    },
    /// A cell has no inside.
    #[error("cell {cell} has the measure {measure:e}; expected it positive")]
    Measure {
        /// The cell's index.
        cell: usize,
        /// Its area or volume.
        measure: f64,
    },
    /// The border of a cell has a gap.
    #[error("the faces of cell {cell} do not close it")]
    Open {
        /// The cell's index.
        cell: usize,
    },
    /// A face has too few points, or names one twice.
    #[error("face {face} has the points {corners:?}; expected {least} or more, all different")]
    Corners {
        /// The face's index.
        face: usize,
        /// Its points.
        corners: Vec<u32>,
        /// How many a face needs.
        least: usize,
    },
    /// A point of a cell lies beyond the plane of one of its faces, or a face's own point off it.
    #[error("point {point} of cell {cell} is {off:e} off face {face}; expected at most {limit:e}")]
    Convex {
        /// The cell's index.
        cell: usize,
        /// The face's index.
        face: usize,
        /// The point's index.
        point: u32,
        /// How far it is outside.
        off: f64,
        /// How far it may be.
        limit: f64,
    },
    /// A face of a side is not on it.
    #[error("face {face} is not on the side {}", side_name(*.side))]
    Side {
        /// The face's index.
        face: usize,
        /// The side's number.
        side: usize,
    },
    /// A cell's site is outside the cell.
    #[error("site {cell} is {off:e} beyond face {face} of its cell")]
    Site {
        /// The cell's index.
        cell: usize,
        /// The face's index.
        face: usize,
        /// How far it is outside.
        off: f64,
    },
    /// The cells do not fill the box.
    #[error("the cells' measures sum to {sum}; expected the box's, {expected}")]
    Sum {
        /// The sum.
        sum: f64,
        /// The box's measure.
        expected: f64,
    },
}

/// Checks that parts fit each other, so that a mesh can be made of them.
pub(super) fn check_parts<const D: usize>(
    parts: &PolyParts<D>,
    cell_count: usize,
) -> Result<(), PolyFault> {
    let face_count = parts.owners.len();
    let on_sides: usize = parts.side_counts[..2 * D].iter().sum();
    let last = parts.ends.last().copied().unwrap_or(0);
    let counts = [
        ("ends of faces", parts.ends.len(), face_count),
        ("faces inside and on sides", parts.neighbours.len() + on_sides, face_count),
        ("corners", parts.corners.len(), last),
    ];
    if let Some(&(what, found, expected)) = counts.iter().find(|(_, found, wanted)| found != wanted)
    {
        return Err(PolyFault::Count { what, found, expected });
    }
    let mut start = 0;
    for (face, &end) in parts.ends.iter().enumerate() {
        let corners = parts.corners.get(start..end).unwrap_or(&[]);
        if corners.len() < D {
            return Err(PolyFault::Corners { face, corners: corners.to_vec(), least: D });
        }
        let cells = [Some(parts.owners[face]), parts.neighbours.get(face).copied()];
        let named = [
            ("point", corners.iter().max().copied(), parts.points.len()),
            ("cell", cells.into_iter().flatten().max(), cell_count),
        ];
        for (what, greatest, count) in named {
            if let Some(found) = greatest.filter(|&found| found as usize >= count) {
                return Err(PolyFault::Missing { face, what, found, count });
            }
        }
        start = end;
    }
    Ok(())
}

impl<const D: usize> PolyMesh<D> {
    /// Checks that every cell has measure.
    pub(super) fn check_cells(&self) -> Result<(), PolyFault> {
        let no_inside = |m: &f64| !m.is_finite() || *m <= 0.0;
        match self.measures().iter().position(no_inside) {
            Some(cell) => Err(PolyFault::Measure { cell, measure: self.measures()[cell] }),
            None => Ok(()),
        }
    }

    /// Checks that every cell has measure, is closed and convex and holds its site, if it has one; that every face
    /// has D or more points, all different and, to 10⁻⁹ of the mean distance of cells, on one plane; that faces on
    /// the sides of `bounds`, the box in the mesh's own coordinates, are exactly on them; and that the measures sum to
    /// the box's to 10⁻¹². Cost: O(points of faces · faces of a cell).
    ///
    /// # Errors
    /// The first fault, in this order of cells.
    pub fn validate(&self, bounds: &Bounds<D>) -> Result<(), PolyFault> {
        self.validate_rounded(bounds, 0.0)
    }

    /// [`Self::validate`] for points and sites that were rounded, each by `rounding` at most, in the unit of the
    /// coordinates: planes of faces may be as much further off, and turned as much as that turns the face.
    ///
    /// # Errors
    /// As [`Self::validate`].
    pub fn validate_rounded(&self, bounds: &Bounds<D>, rounding: f64) -> Result<(), PolyFault> {
        self.check_cells()?;
        self.check_faces(bounds)?;
        let planar = PLANAR * mean_distance(bounds, self.cell_count());
        let limits = Limits { planar, rounding };
        let faults: Vec<PolyFault> = (0..self.cell_count().div_ceil(BLOCK))
            .into_par_iter()
            .filter_map(|block| {
                let cells = block * BLOCK..((block + 1) * BLOCK).min(self.cell_count());
                cells.into_iter().find_map(|cell| self.fault_of(cell, limits))
            })
            .collect();
        if let Some(fault) = faults.into_iter().next() {
            return Err(fault);
        }
        let (sum, expected) = (self.measure(), bounds.measure());
        let same = (sum - expected).abs() <= 1e-12 * expected;
        if same { Ok(()) } else { Err(PolyFault::Sum { sum, expected }) }
    }

    fn check_faces(&self, bounds: &Bounds<D>) -> Result<(), PolyFault> {
        for face in 0..self.face_count() {
            let corners = self.face(face);
            let twice = (1..corners.len()).any(|k| corners[..k].contains(&corners[k]));
            if corners.len() < D || twice {
                let corners = corners.to_vec();
                return Err(PolyFault::Corners { face, corners, least: D });
            }
        }
        for side in 0..2 * D {
            let ends = if side % 2 == 0 { bounds.min } else { bounds.max };
            let off = |&c: &u32| self.points()[c as usize][side / 2] != ends[side / 2];
            for face in self.side(side) {
                if self.face(face).iter().any(off) {
                    return Err(PolyFault::Side { face, side });
                }
            }
        }
        Ok(())
    }

    fn fault_of(&self, cell: usize, limits: Limits) -> Option<PolyFault> {
        if !self.is_closed(cell) {
            return Some(PolyFault::Open { cell });
        }
        let mut corners: Vec<u32> =
            self.faces_of(cell).flat_map(|(face, _)| self.face(face).iter().copied()).collect();
        corners.sort_unstable();
        corners.dedup();
        for (face, sign) in self.faces_of(cell) {
            let Some(plane) = self.plane(cell, face, sign, limits) else { continue };
            for &point in &corners {
                let place = &self.points()[point as usize];
                let (above, limit) = (plane.above(place), plane.limit(place));
                let off = if self.face(face).contains(&point) { above.abs() } else { above };
                if off > limit {
                    return Some(PolyFault::Convex { cell, face, point, off, limit });
                }
            }
            let site = self.sites().map(|sites| &sites[cell]);
            if let Some(site) = site.filter(|site| plane.above(site) > plane.limit(site)) {
                return Some(PolyFault::Site { cell, face, off: plane.above(site) });
            }
        }
        None
    }

    /// Whether every edge (2-D: point) of the cell's faces is run through once in each direction.
    fn is_closed(&self, cell: usize) -> bool {
        let mut ends: Vec<(u32, u32, bool)> = Vec::new();
        for (face, sign) in self.faces_of(cell) {
            let corners = self.face(face);
            for at in 0..corners.len() {
                let (a, b) = (corners[at], corners[(at + 1) % corners.len()]);
                match D {
                    2 => ends.push((a, a, (at == 0) == (sign > 0.0))),
                    _ => ends.push((a.min(b), a.max(b), (a < b) == (sign > 0.0))),
                }
            }
        }
        ends.sort_unstable();
        !ends.is_empty()
            && ends
                .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
                .all(|edge| matches!(edge, [a, b] if a.2 != b.2))
    }

    /// The plane of a face, its normal out of the cell; for a face too thin to have one, the plane at right angles to
    /// the line between the two cells' centres.
    fn plane(&self, cell: usize, face: usize, sign: f64, limits: Limits) -> Option<Plane<D>> {
        let vector = self.area_vector(face);
        let area = dot(&vector, &vector).sqrt();
        let points = self.face(face).iter().map(|&c| &self.points()[c as usize]);
        let first = self.points()[self.face(face)[0] as usize];
        let longest =
            points.map(|p| difference(p, &first)).map(|v| dot(&v, &v)).fold(0.0, f64::max);
        // the least extent of the face: in 2-D its length
        let height = if D == 2 { area } else { area / longest.sqrt() };
        // rounding, of the order of the tolerance, turns what is thinner
        if D == 2 || height > 1e3 * limits.planar {
            let normal = vector.map(|x| sign * x / area);
            return Some(Plane { through: first, normal, limits, height });
        }
        let owner = self.owners()[face] as usize;
        let other = if owner == cell { *self.neighbours().get(face)? as usize } else { owner };
        let (from, to) = (&self.centers()[cell], &self.centers()[other]);
        let axis = difference(to, from);
        let length = dot(&axis, &axis).sqrt();
        let normal = axis.map(|x| x / length);
        Some(Plane { through: first, normal, limits, height: length })
    }
}

/// How far points may be off planes.
#[derive(Clone, Copy)]
struct Limits {
    /// Whatever the plane.
    planar: f64,
    /// How far each point may have been rounded.
    rounding: f64,
}

struct Plane<const D: usize> {
    through: Point<D>,
    normal: Point<D>,
    limits: Limits,
    /// The least distance between the points that turn the plane.
    height: f64,
}

impl<const D: usize> Plane<D> {
    fn above(&self, p: &Point<D>) -> f64 {
        dot(&difference(p, &self.through), &self.normal)
    }

    /// How far a point may be off: where the points of the plane are rounded against each other, the plane is turned by
    /// twice the rounding over their distance; twice again for a normal that is the mean over a face.
    fn limit(&self, p: &Point<D>) -> f64 {
        let Limits { planar, rounding } = self.limits;
        if rounding == 0.0 {
            return planar;
        }
        let away = difference(p, &self.through);
        planar + 2.0 * rounding * (1.0 + 2.0 * dot(&away, &away).sqrt() / self.height)
    }
}
