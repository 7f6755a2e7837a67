//! The equivalent radius of wells: that at which the pressure around a well is its cell's.

use std::f64::consts::TAU;

use atomesh::geometry::{Point, difference, distance_squared, dot};
use atomesh::mesh::PolyMesh;
use atomesh::watch::Silent;

use crate::error::FlowError;
use crate::problem::Control;
use crate::setting::{PlacedWell, Setting, well_index};
use crate::solve::{SolveMethod, SolveOptions, Sparse, System, solve};

/// Rings of cells around a well from which [`solve`](super::solve()) computes its equivalent radius. Measured: on
/// squares 8 rings are within 0.1 % of infinitely many, 1 ring within 5 %.
pub const RINGS: usize = 8;

/// Distance from a face's plane, as a share of the cell's width, up to which a site lies on the plane.
const ON_FACE: f64 = 1e-11;

/// A well with its cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coupling {
    /// The well's number in the problem.
    pub well: usize,
    /// The cell that it flows into.
    pub cell: u32,
    /// The flow into the box per unit of pressure difference between wall and cell, for wells with a radius; on a side
    /// half of that elsewhere.
    pub index: Option<f64>,
}

/// Couples wells to cells. A well of given rate needs no radius.
pub(super) fn couple<const D: usize>(
    cells: &PolyMesh<D>,
    setting: &Setting<'_, D>,
) -> Result<Vec<Coupling>, FlowError> {
    let couple = |placed: &PlacedWell| {
        let well = &setting.problem().wells[placed.well];
        let cell = placed.cells[0];
        let index = match (well.control, well.radius) {
            (Control::Rate(_), None) => None,
            (_, radius) => {
                let around = Around::new(cells, cell as usize, RINGS);
                let equivalent = match around.unknown_count {
                    0 => placed.equivalent_radius::<D>(),
                    _ => around.radius()?,
                };
                let k = placed.permeability;
                Some(around.open() * well_index::<D>(&well.name, k, radius, equivalent)?)
            }
        };
        Ok(Coupling { well: placed.well, cell, index })
    };
    setting.wells().iter().map(couple).collect()
}

/// The radius at which the pressure around a well in a cell is that of the cell.
///
/// For a rate and permeability of 1 the pressure around the well is −ln r/2π (plane) or 1/4πr (space), plus a smooth
/// part. Cells `rings` faces away are given that pressure at their sites, nearer cells are solved for, and the
/// pressure of the well's cell is converted to a radius. With 1 ring it is the radius of Peaceman (1978) on any cells
/// (Palagi & Aziz 1994), `ln r_e = (Σ T_j ln d_j − θ) / Σ T_j`, with `T_j = A_j/d_j`, d_j the distances of the
/// neighbours' sites and θ the angle that the neighbours fill as seen from the well, below 2π if it lies on a side; in
/// space `1/r_e = (θ + Σ T_j/d_j) / Σ T_j`, θ the solid angle. 1 ring takes the neighbours' pressures as exact:
/// e^(−π/2) d = 0.2079 d on squares of side d, e^(−π/√3) d = 0.1630 d on hexagons. More rings converge to the radius of
/// the discrete equations, e^(−γ)/√8 d = 0.1985 d and e^(−γ)/√12 d = 0.1621 d, γ Euler's constant (Peaceman 1978 finds
/// 0.1982 by refinement).
///
/// Barriers do not matter: the image well beyond a straight barrier belongs to the smooth part.
///
/// # Errors
/// [`FlowError::Solve`] if the equations of the rings cannot be solved.
///
/// # Panics
/// If there is no such cell, or no other.
pub fn equivalent_radius<const D: usize>(
    cells: &PolyMesh<D>,
    cell: usize,
    rings: usize,
) -> Result<f64, FlowError> {
    let around = Around::new(cells, cell, rings);
    assert!(around.unknown_count > 0, "a well needs a cell beside its own");
    around.radius()
}

/// Rings of cells around a well.
struct Around<'a, const D: usize> {
    cells: &'a PolyMesh<D>,
    /// The well's place.
    site: Point<D>,
    /// The cells, ring after ring, from the well's own.
    found: Vec<u32>,
    /// The number of cells before the last ring, whose pressures are given.
    unknown_count: usize,
}

impl<'a, const D: usize> Around<'a, D> {
    /// As many rings as there are, up to `rings`.
    fn new(cells: &'a PolyMesh<D>, cell: usize, rings: usize) -> Self {
        let mut found = vec![cell as u32];
        let mut seen = std::collections::BTreeSet::from([cell as u32]);
        let mut unknown_count = 0;
        for _ in 0..rings.max(1) {
            let ring = unknown_count..found.len();
            let end = ring.end;
            for at in ring {
                for (face, sign) in cells.faces_of(found[at] as usize) {
                    let Some(&neighbour) = cells.neighbours().get(face) else { continue };
                    let other = if sign > 0.0 { neighbour } else { cells.owners()[face] };
                    if seen.insert(other) {
                        found.push(other);
                    }
                }
            }
            if found.len() == end {
                break;
            }
            unknown_count = end;
        }
        Self { cells, site: cells.centers()[cell], found, unknown_count }
    }

    /// The share of the whole angle that the box fills as seen from the well: 1 inside, 1/2 on a side.
    fn open(&self) -> f64 {
        let faces = self.cells.faces_of(self.found[0] as usize);
        faces.map(|(face, sign)| self.share_seen(face, sign)).sum()
    }

    /// The radius at which the pressure is that of the well's cell.
    fn radius(&self) -> Result<f64, FlowError> {
        let pressure = self.pressure()?;
        Ok(match D {
            2 => (-TAU * pressure).exp(),
            _ => 1.0 / (2.0 * TAU * pressure),
        })
    }

    /// The pressure of the well's cell, for a rate and permeability of 1.
    fn pressure(&self) -> Result<f64, FlowError> {
        let (entries, rhs) = self.equations();
        let count = self.unknown_count;
        let site = |&cell: &u32| self.cells.centers()[cell as usize];
        let places: Vec<Point<D>> = self.found[..count].iter().map(site).collect();
        let system = System {
            matrix: &Sparse::from_entries(count, count, &entries),
            rhs: &rhs,
            is_symmetric: true,
            block: 1,
            places: &places,
            coarse: None,
        };
        let options = SolveOptions { method: SolveMethod::Direct, ..SolveOptions::default() };
        Ok(solve(&system, &options, &mut Silent)?.0[0])
    }

    fn equations(&self) -> (Vec<(u32, u32, f64)>, Vec<f64>) {
        let mut number: Vec<(u32, u32)> =
            self.found.iter().enumerate().map(|(at, &cell)| (cell, at as u32)).collect();
        number.sort_unstable();
        let mut entries = Vec::new();
        let mut rhs = vec![0.0; self.unknown_count];
        rhs[0] = self.open();
        for (row, &cell) in self.found[..self.unknown_count].iter().enumerate() {
            for (face, sign) in self.cells.faces_of(cell as usize) {
                let Some(&neighbour) = self.cells.neighbours().get(face) else {
                    rhs[row] -= self.share_seen(face, sign);
                    continue;
                };
                let other = if sign > 0.0 { neighbour } else { self.cells.owners()[face] };
                let transmissibility = self.transmissibility(face, [cell, other]);
                entries.push((row as u32, row as u32, transmissibility));
                let at = number.binary_search_by_key(&other, |pair| pair.0);
                let at = number[at.expect("its ring is known")].1;
                if (at as usize) < self.unknown_count {
                    entries.push((row as u32, at, -transmissibility));
                } else {
                    rhs[row] += transmissibility * self.field(other);
                }
            }
        }
        (entries, rhs)
    }

    fn transmissibility(&self, face: usize, pair: [u32; 2]) -> f64 {
        let area = self.cells.area_vector(face);
        let [a, b] = pair.map(|cell| &self.cells.centers()[cell as usize]);
        (dot(&area, &area) / distance_squared(a, b)).sqrt()
    }

    /// The pressure that the well causes at a site.
    fn field(&self, cell: u32) -> f64 {
        let squared = distance_squared(&self.site, &self.cells.centers()[cell as usize]);
        match D {
            2 => -0.5 * squared.ln() / TAU,
            _ => 0.5 / (TAU * squared.sqrt()),
        }
    }

    /// The share of the well's rate that flows outward through a face: the face's share of the whole angle, as seen from
    /// the well.
    fn share_seen(&self, face: usize, sign: f64) -> f64 {
        let area = self.cells.area_vector(face);
        let length = dot(&area, &area).sqrt();
        let way = difference(&self.cells.face_centroid(face), &self.site);
        let height = sign * dot(&way, &area);
        let width = self.cells.measures()[self.found[0] as usize].powf(1.0 / D as f64);
        if height.abs() <= ON_FACE * width * length {
            return 0.0;
        }
        let angle: f64 =
            self.cells.face_simplices(face).map(|part| view_angle(&part, &self.site)).sum();
        height.signum() * angle / if D == 2 { 1.0 } else { 2.0 } / TAU
    }
}

/// The angle of a segment (plane), or solid angle of a triangle (space; van Oosterom & Strackee 1983), from a place.
fn view_angle<const D: usize>(simplex: &[Point<D>; D], from: &Point<D>) -> f64 {
    const { assert!(D == 2 || D == 3) };
    let rays = simplex.map(|corner| difference(&corner, from));
    let lengths = rays.map(|ray| dot(&ray, &ray).sqrt());
    let (a, b) = (&rays[0], &rays[1]);
    if D == 2 {
        return (a[0] * b[1] - a[1] * b[0]).abs().atan2(dot(a, b));
    }
    let c = &rays[D - 1];
    let (i, j, k) = (0, 1, D - 1);
    let volume = a[i] * (b[j] * c[k] - b[k] * c[j]) - a[j] * (b[i] * c[k] - b[k] * c[i])
        + a[k] * (b[i] * c[j] - b[j] * c[i]);
    let below = lengths[i] * lengths[j] * lengths[k]
        + dot(a, b) * lengths[k]
        + dot(a, c) * lengths[j]
        + dot(b, c) * lengths[i];
    2.0 * volume.abs().atan2(below)
}
