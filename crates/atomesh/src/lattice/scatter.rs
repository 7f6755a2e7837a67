//! A random lattice: atoms without a preferred direction (Hale 2002).
//!
//! Starts from the boundary and one random point, then inserts circumcentres of simplices, those of the
//! largest r/d first, until every circumradius r is within a limit of d: 0.760 in the plane, 0.803 in space.
//! Edges of the box are divided evenly and, in space, faces are scattered as planes of their own first.
//!
//! Departure: atoms are inserted in rounds, each a Delaunay mesh of all atoms so far and, from the
//! largest r/d down, every circumcentre far enough from those before it. The end is the same, and so is
//! the order within a round; the cost is that of a few meshes instead of an insertion at a time.

use crate::parallel::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::fields::NominalDistance;
use crate::geometry::linear::solve;
use crate::geometry::{Bounds, Point, all_axes, difference, distance_squared, dot};
use crate::mesh::{ConnectError, Delaunay, Mesh};
use crate::watch::{Phase, Watch, check};

use super::boundary::{Boundary, Place};
use super::occupancy::Occupancy;
use super::{Lattice, LatticeError};

/// What differs between dimensions: how to connect, and the limit of r/d.
#[derive(Clone, Debug)]
pub struct Scatterer<const D: usize> {
    delaunay: Delaunay<D>,
    limit: f64,
}

impl Scatterer<2> {
    /// Every r/d ends at 0.760 or less.
    pub fn new() -> Self {
        Self { delaunay: Delaunay::<2>::new(), limit: 0.760 }
    }
}

impl Scatterer<3> {
    /// Every r/d ends at 0.803 or less.
    pub fn new() -> Self {
        Self { delaunay: Delaunay::<3>::new(), limit: 0.803 }
    }
}

impl Default for Scatterer<2> {
    fn default() -> Self {
        Self::new()
    }
}

impl Default for Scatterer<3> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const D: usize> Scatterer<D> {
    /// How holes are filled, in so many rounds at most.
    pub(super) fn spread(&self, rounds: usize) -> Spread<'_, D> {
        Spread { delaunay: &self.delaunay, limit: self.limit, rounds }
    }

    /// The Delaunay mesh of atoms.
    pub(super) fn connect(
        &self,
        atoms: &[Point<D>],
        watch: &mut dyn Watch,
    ) -> Result<Mesh<D>, LatticeError> {
        connect(&self.delaunay, atoms, watch)
    }
}

fn connect<const D: usize>(
    delaunay: &Delaunay<D>,
    atoms: &[Point<D>],
    watch: &mut dyn Watch,
) -> Result<Mesh<D>, LatticeError> {
    delaunay.connect(atoms, watch).map_err(|error| match error {
        ConnectError::Cancelled(cancelled) => LatticeError::Cancelled(cancelled),
        other => LatticeError::Connect(other.to_string()),
    })
}

/// How atoms are scattered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatterOptions<const D: usize> {
    /// The seed of the first points. Default 0.
    pub seed: u64,
    /// Atoms that stay where they are, in lattice coordinates.
    pub seed_points: Vec<Point<D>>,
}

/// Rounds after which scattering stops whatever is left; each inserts about as many atoms as there are.
const ROUND_LIMIT: usize = 200;

/// Scatters a lattice that fills the box.
///
/// # Errors
/// [`LatticeError`] if the box is thin, a seed lies outside, atoms coincide, or the work was cancelled.
pub fn scatter<const D: usize>(
    scatterer: &Scatterer<D>,
    bounds: Bounds<D>,
    distance: &NominalDistance<D>,
    options: &ScatterOptions<D>,
    watch: &mut dyn Watch,
) -> Result<Lattice<D>, LatticeError> {
    let mut random = Pcg64::seed_from_u64(options.seed);
    let mut lattice = Boundary::new(Place { bounds, distance, outline: None })?
        .plant_and_divide(&options.seed_points, &[])?;
    if D == 3 {
        for side in 0..6 {
            let face = Face { side, rounds: ROUND_LIMIT, random: Some(&mut random) };
            fill_face(&mut lattice, face, distance, watch)?;
        }
    }
    let spread =
        Spread { delaunay: &scatterer.delaunay, limit: scatterer.limit, rounds: ROUND_LIMIT };
    let field = |p: &Point<D>| distance.at(p);
    let mut atoms = lattice.atoms().to_vec();
    start(&mut atoms, &bounds, &field, &mut random);
    spread.complete(&mut atoms, &bounds, &field, watch)?;
    for p in atoms.split_off(lattice.len()) {
        lattice.push(p, all_axes::<D>(), 1.0);
    }
    Ok(lattice)
}

/// Adds atoms where a lattice leaves holes: circumcentres of simplices with the largest r/d first, until
/// none is above the limit or `rounds` meshes have been looked at.
///
/// A grown lattice has such holes where d varies, since a crystal's front does not fit the next one's, and
/// with them too few atoms. Where d is constant only places beside the boundary are left.
///
/// # Errors
/// [`LatticeError`] if atoms coincide or the work was cancelled.
pub fn fill_holes<const D: usize>(
    scatterer: &Scatterer<D>,
    mut lattice: Lattice<D>,
    distance: &NominalDistance<D>,
    rounds: usize,
    watch: &mut dyn Watch,
) -> Result<Lattice<D>, LatticeError> {
    fill_faces(&mut lattice, distance, rounds, watch)?;
    let spread = scatterer.spread(rounds);
    let field = |p: &Point<D>| distance.at(p);
    let mut atoms = lattice.atoms().to_vec();
    spread.complete(&mut atoms, lattice.bounds(), &field, watch)?;
    for p in atoms.split_off(lattice.len()) {
        lattice.push(p, all_axes::<D>(), 1.0);
    }
    Ok(lattice)
}

/// [`fill_holes`] of the sides of a box in space, each as a plane of its own.
pub(super) fn fill_faces<const D: usize>(
    lattice: &mut Lattice<D>,
    distance: &NominalDistance<D>,
    rounds: usize,
    watch: &mut dyn Watch,
) -> Result<(), LatticeError> {
    if D == 3 {
        for side in 0..6 {
            fill_face(lattice, Face { side, rounds, random: None }, distance, watch)?;
        }
    }
    Ok(())
}

/// A side of a box in space, and how atoms are added there.
struct Face<'r> {
    side: usize,
    /// The most meshes to look at.
    rounds: usize,
    /// Where the first atom comes from, if one is added at random.
    random: Option<&'r mut Pcg64>,
}

/// Adds atoms to a side of the box, as a plane of its own.
fn fill_face<const D: usize>(
    lattice: &mut Lattice<D>,
    face: Face<'_>,
    distance: &NominalDistance<D>,
    watch: &mut dyn Watch,
) -> Result<(), LatticeError> {
    let Face { side, rounds, random } = face;
    let bounds = *lattice.bounds();
    let normal = side / 2;
    let (a, b) = ((normal + 1) % D, (normal + 2) % D);
    let level = bounds.level(side);
    let lift = |p: &Point<2>| -> Point<D> {
        let mut q = [level; D];
        (q[a], q[b]) = (p[0], p[1]);
        q
    };
    let rim: Vec<Point<2>> =
        lattice.atoms().iter().filter(|p| p[normal] == level).map(|p| [p[a], p[b]]).collect();
    let plane = Bounds { min: [bounds.min[a], bounds.min[b]], max: [bounds.max[a], bounds.max[b]] };
    let planar = Scatterer::<2>::new();
    let spread = planar.spread(rounds);
    let field = |p: &Point<2>| distance.at(&lift(p));
    let mut atoms = rim.clone();
    if let Some(random) = random {
        start(&mut atoms, &plane, &field, random);
    }
    spread.complete(&mut atoms, &plane, &field, watch)?;
    for p in atoms.split_off(rim.len()) {
        lattice.push(lift(&p), 1 << a | 1 << b, 1.0);
    }
    Ok(())
}

/// How holes are found and filled.
pub(super) struct Spread<'a, const D: usize> {
    delaunay: &'a Delaunay<D>,
    limit: f64,
    /// The most meshes to look at.
    pub(super) rounds: usize,
}

/// Adds a random atom near the middle, unless there is one within d.
fn start<const D: usize>(
    atoms: &mut Vec<Point<D>>,
    bounds: &Bounds<D>,
    distance: &impl Fn(&Point<D>) -> f64,
    random: &mut Pcg64,
) {
    let first: Point<D> = std::array::from_fn(|k| {
        bounds.min[k] + (0.25 + 0.5 * random.random::<f64>()) * (bounds.max[k] - bounds.min[k])
    });
    let near = atoms.iter().any(|q| distance_squared(q, &first) < distance(&first).powi(2));
    if !near {
        atoms.push(first);
    }
}

/// A place where an atom is missing, and how much: r/d.
pub(super) struct Hole<const D: usize> {
    pub(super) centre: Point<D>,
    pub(super) ratio: f64,
    pub(super) d: f64,
}

impl<const D: usize> Spread<'_, D> {
    /// Adds atoms in the holes that the given ones leave.
    fn complete(
        &self,
        atoms: &mut Vec<Point<D>>,
        bounds: &Bounds<D>,
        distance: &(impl Fn(&Point<D>) -> f64 + Sync),
        watch: &mut dyn Watch,
    ) -> Result<(), LatticeError> {
        for round in 0..self.rounds {
            check(watch, Phase::Grow, round as f64 / (round + 8) as f64, None)?;
            let holes = self.holes(atoms, bounds, distance, watch)?;
            if holes.is_empty() {
                break;
            }
            let before = atoms.len();
            self.plug(&holes, bounds, atoms);
            if atoms.len() == before {
                break;
            }
        }
        Ok(())
    }

    /// Circumcentres inside the box whose r/d exceeds the limit, the worst first.
    pub(super) fn holes(
        &self,
        atoms: &[Point<D>],
        bounds: &Bounds<D>,
        distance: &(impl Fn(&Point<D>) -> f64 + Sync),
        watch: &mut dyn Watch,
    ) -> Result<Vec<Hole<D>>, LatticeError> {
        let mesh = connect(self.delaunay, atoms, watch)?;
        let mut holes: Vec<Hole<D>> = mesh
            .corners()
            .par_chunks_exact(D + 1)
            .filter_map(|cell| {
                let corners = cell.iter().map(|&c| &atoms[c as usize]);
                let (centre, radius) = circumsphere::<D>(corners)?;
                let d = distance(&centre);
                let ratio = radius / d;
                // an atom nearer to the boundary than half a cell would make a flat one
                let margin = 0.4 * d;
                let roomy = (0..D).all(|k| {
                    centre[k] >= bounds.min[k] + margin && centre[k] <= bounds.max[k] - margin
                });
                (ratio > self.limit && roomy).then_some(Hole { centre, ratio, d })
            })
            .collect();
        holes.sort_by(|a, b| {
            b.ratio
                .total_cmp(&a.ratio)
                .then_with(|| a.centre.partial_cmp(&b.centre).unwrap_or(std::cmp::Ordering::Equal))
        });
        Ok(holes)
    }

    /// Adds the holes' centres that are far enough from those added before.
    pub(super) fn plug(&self, holes: &[Hole<D>], bounds: &Bounds<D>, atoms: &mut Vec<Point<D>>) {
        // A centre keeps its circumradius free of atoms; of new ones, that much too.
        let radius = |hole: &Hole<D>| hole.ratio * hole.d;
        let least = holes.iter().map(radius).fold(f64::INFINITY, f64::min);
        let greatest = holes.iter().map(radius).fold(0.0, f64::max);
        let mut taken = Occupancy::new(*bounds, least, greatest, holes.len());
        for hole in holes {
            let diameter = radius(hole);
            if taken.is_free(&hole.centre, diameter) {
                taken.take(hole.centre, diameter);
                atoms.push(hole.centre);
            }
        }
    }
}

/// Below this measure of the parallelepiped of a cell's unit edges, rounding of coordinates moves its centre by a
/// millionth of the radius and more: along the axis of corners on one circle as far as another atom.
const FLAT: f64 = 1e-9;

/// The centre and radius of the sphere through D + 1 points; `None` if they are flat, or so nearly that
/// rounding decides.
fn circumsphere<'a, const D: usize>(
    mut corners: impl Iterator<Item = &'a Point<D>>,
) -> Option<(Point<D>, f64)> {
    let first = corners.next()?;
    let mut rows = [[0.0; D]; D];
    let mut right = [[0.0]; D];
    for (k, corner) in corners.enumerate() {
        rows[k] = difference(corner, first);
        right[k] = [0.5 * dot(&rows[k], &rows[k])];
    }
    let lengths: f64 = rows.iter().map(|row| dot(row, row).sqrt()).product();
    if solve(D, rows, &mut right).abs() <= FLAT * lengths {
        return None;
    }
    let offset = right.map(|[x]| x);
    let radius = dot(&offset, &offset).sqrt();
    let centre = std::array::from_fn(|k| first[k] + offset[k]);
    let off = |row: &Point<D>| (distance_squared(row, &offset).sqrt() - radius).abs();
    let is_sound = rows.iter().map(off).fold(0.0, f64::max) <= 1e-6 * radius;
    (radius.is_finite() && is_sound).then_some((centre, radius))
}
