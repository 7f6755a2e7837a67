//! Growing atoms on the outline of a mask, before the rest.
//!
//! The outline is filled as the box's boundary is, from few dimensions to many: where it crosses the edges
//! of the box, then along its curves on the box's faces, then over the surface inside. From each place found
//! by its samples a curve is divided, or a hexagonal crystal spread over the surface, each site projected
//! onto it. Cost: O(samples) for the search, O(atoms) for the rest. Deterministic.

use crate::fields::NominalDistance;
use crate::geometry::{Point, all_axes, dot};
use crate::region::Outline;
use crate::watch::{Phase, Watch, check};

use super::LatticeError;
use super::occupancy::{Occupancy, restart_room};

/// Nearer than this, over d, to a side of the box that it is not on no atom is put.
pub(super) const SIDE: f64 = 0.3;

/// An atom on an outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planted<const D: usize> {
    /// Where it is.
    pub position: Point<D>,
    /// The set of axes along which it may move.
    pub freedom: u8,
}

/// One of the box's sides of any dimension, the box itself included.
struct Side<const D: usize> {
    /// The axes along which it extends, as bits.
    free: u8,
    /// The other axes at which it is at the box's far end, as bits.
    far: u8,
}

/// The sides of one dimension and more, from few dimensions to many.
fn sides<const D: usize>() -> Vec<Side<D>> {
    let mut sides = Vec::new();
    for dimension in 1..=D as u32 {
        for free in (1..1u8 << D).filter(|free| free.count_ones() == dimension) {
            let fixed = !free & all_axes::<D>();
            sides.extend(
                (0..1u8 << D).filter(|far| far & !fixed == 0).map(|far| Side { free, far }),
            );
        }
    }
    sides
}

/// Grows atoms on the outline; those `taken` are there already.
pub(super) fn plant<const D: usize>(
    outline: &Outline<D>,
    distance: &NominalDistance<D>,
    gamma: f64,
    taken: &[Point<D>],
    watch: &mut dyn Watch,
) -> Result<Vec<Planted<D>>, LatticeError> {
    let mut planting = Planting {
        outline,
        distance,
        gamma,
        occupancy: room(outline, distance, gamma, gamma),
        atoms: Vec::new(),
        heading: Vec::new(),
    };
    for p in taken {
        planting.occupancy.take(*p, gamma * distance.at(p));
    }
    for side in sides::<D>() {
        check(watch, Phase::Grow, 0.0, None)?;
        planting.side(&side);
    }
    Ok(planting.atoms)
}

/// Room for balls of diameters from `low` to `high` times d.
pub(super) fn room<const D: usize>(
    outline: &Outline<D>,
    distance: &NominalDistance<D>,
    low: f64,
    high: f64,
) -> Occupancy<D> {
    let expected = distance.estimated_atoms(1.0) * outline.mean_share();
    let (least, greatest) = (low * distance.least(), high * distance.greatest());
    Occupancy::new(*outline.bounds(), least, greatest, expected as usize)
}

struct Planting<'a, const D: usize> {
    outline: &'a Outline<D>,
    distance: &'a NominalDistance<D>,
    gamma: f64,
    occupancy: Occupancy<D>,
    atoms: Vec<Planted<D>>,
    /// The step by which each atom was reached, so that neighbours turn their crystals alike.
    heading: Vec<Point<D>>,
}

impl<const D: usize> Planting<'_, D> {
    /// Fills the outline on one side, from every place where its samples show it and there is room.
    fn side(&mut self, side: &Side<D>) {
        let grid = *self.outline.grid();
        let strides = grid.strides();
        let is_free = |k: usize| side.free >> k & 1 == 1;
        let shape: [usize; D] = std::array::from_fn(|k| if is_free(k) { grid.shape[k] } else { 1 });
        let start: usize = (0..D)
            .filter(|&k| side.far >> k & 1 == 1)
            .map(|k| (grid.shape[k] - 1) * strides[k])
            .sum();
        let mut index = [0; D];
        for _ in 0..shape.iter().product() {
            let at = start + (0..D).map(|k| index[k] * strides[k]).sum::<usize>();
            let inside = self.outline.sample_is_inside(at);
            for k in (0..D).filter(|&k| index[k] + 1 < shape[k]) {
                if self.outline.sample_is_inside(at + strides[k]) != inside {
                    let far = |j: usize| side.far >> j & 1 == 1;
                    let p: Point<D> = std::array::from_fn(|j| {
                        let i = if far(j) { grid.shape[j] - 1 } else { index[j] };
                        i as f64 * grid.step[j]
                    });
                    let mut q = p;
                    q[k] += grid.step[k];
                    let (a, b) = if inside { (p, q) } else { (q, p) };
                    // most places are taken, within a sample as well
                    let middle: Point<D> = std::array::from_fn(|j| 0.5 * (p[j] + q[j]));
                    let room = restart_room(self.gamma) * self.distance.at(&middle) - grid.step[k];
                    if room <= 0.0 || self.occupancy.is_free(&middle, room) {
                        self.seed(self.outline.crossing(&a, &b), side.free);
                    }
                }
            }
            for k in 0..D {
                index[k] += 1;
                if index[k] < shape[k] {
                    break;
                }
                index[k] = 0;
            }
        }
    }

    /// Starts at a place found, if there is room, and spreads from it.
    fn seed(&mut self, p: Point<D>, free: u8) {
        let first = self.atoms.len();
        self.try_to_add(p, free, restart_room(self.gamma), [0.0; D]);
        let mut at = first;
        while at < self.atoms.len() {
            let p = self.atoms[at].position;
            let d = self.distance.at(&p);
            for step in self.steps(at, free) {
                let site = std::array::from_fn(|k| p[k] + d * step[k]);
                if let Some(q) = self.outline.project(&site, free, 0.5 * d) {
                    self.try_to_add(q, free, self.gamma, step);
                }
            }
            at += 1;
        }
    }

    fn try_to_add(&mut self, p: Point<D>, free: u8, room: f64, heading: Point<D>) {
        let d = self.distance.at(&p);
        if is_clear_of_sides(self.outline, &p, free, SIDE * d)
            && self.occupancy.is_free(&p, room * d)
        {
            self.occupancy.take(p, self.gamma * d);
            self.atoms.push(Planted { position: p, freedom: free });
            self.heading.push(heading);
        }
    }

    /// The unit steps to an atom's ideal neighbours along the outline: none at a crossing of an edge, two
    /// along a curve, six over a surface.
    fn steps(&self, at: usize, free: u8) -> Vec<Point<D>> {
        let dimension = free.count_ones() as usize;
        let Some(normal) = self.outline.normal(&self.atoms[at].position, free) else {
            return Vec::new();
        };
        if dimension < 2 {
            return Vec::new();
        }
        let mut basis = vec![normal];
        let mut axes: Vec<usize> = (0..D).filter(|k| free >> k & 1 == 1).collect();
        // the axes that the normal follows least make the best tangents
        axes.sort_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()));
        let units = axes.iter().map(|&k| std::array::from_fn(|j| if j == k { 1.0 } else { 0.0 }));
        for v in std::iter::once(self.heading[at]).chain(units) {
            basis.extend(part_across(v, &basis).filter(|_| basis.len() < dimension));
        }
        match basis[1..] {
            [u] => vec![u, u.map(|x| -x)],
            [u, v] => (0..6)
                .map(|i| {
                    let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_3).sin_cos();
                    std::array::from_fn(|k| cos * u[k] + sin * v[k])
                })
                .collect(),
            _ => Vec::new(),
        }
    }
}

/// The unit vector along the part of `v` that is square to all of an orthonormal `basis`.
fn part_across<const D: usize>(mut v: Point<D>, basis: &[Point<D>]) -> Option<Point<D>> {
    for b in basis {
        let along = dot(&v, b);
        v = std::array::from_fn(|k| v[k] - along * b[k]);
    }
    let length = dot(&v, &v).sqrt();
    (length > 1e-3).then(|| v.map(|x| x / length))
}

/// Whether a point keeps `least` from the sides of the box across the axes that it may move along.
pub(super) fn is_clear_of_sides<const D: usize>(
    outline: &Outline<D>,
    p: &Point<D>,
    free: u8,
    least: f64,
) -> bool {
    let bounds = outline.bounds();
    (0..D)
        .filter(|k| free >> k & 1 == 1)
        .all(|k| p[k] - bounds.min[k] >= least && bounds.max[k] - p[k] >= least)
}
