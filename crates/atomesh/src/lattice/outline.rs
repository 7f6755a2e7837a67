//! Atoms on the outline of a mask: grown there before the rest, and put back there after they have moved.
//!
//! The outline is filled as the box's boundary is, from few dimensions to many: where it crosses the edges
//! of the box, then along its curves on the box's faces, then over the surface inside. From each place found
//! by its samples a curve is divided, or a hexagonal crystal spread over the surface, each site projected
//! onto it. Cost: O(samples) for the search, O(atoms) for the rest. Deterministic.

use rayon::prelude::*;

use crate::fields::NominalDistance;
use crate::geometry::{Point, all_axes, axes_where, difference, dot};
use crate::mesh::{ConnectError, Delaunay, Mesh, merge_duplicates};
use crate::region::{Outline, free_axes};
use crate::watch::{Phase, Watch, check};

use super::Lattice;
use super::grow::{LatticeError, restart_room};
use super::occupancy::Occupancy;

/// Atoms nearer to the outline than this, over d, are put onto it.
const REACH: f64 = 0.4;
/// Atoms beyond the outline and nearer to it than this, over d, are left out: with those inside they would
/// make edges that cross it.
const BEYOND: f64 = 0.65;
/// Atoms that cannot move count as on the outline when they are this near to it, over d.
const FIXED_REACH: f64 = 0.2;
/// Of two atoms put onto the outline nearer to each other than this, over d, one is left out.
const CROWDED: f64 = 0.55;
/// Atoms beside the outline keep half of this and of the former from those on it.
const BESIDE: f64 = 0.45;
/// Atoms added on the outline keep this from others there, over d, and half of it from those beside.
const ADDED: f64 = 0.7;
/// Nearer than this, over d, to a side of the box that it is not on no atom is put.
const SIDE: f64 = 0.3;

/// An atom, and the axes along which it may move, as bits.
pub(super) type Planted<const D: usize> = (Point<D>, u8);

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
fn room<const D: usize>(
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
    /// Whence each atom was reached, so that neighbours turn their crystals alike.
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
            let (p, d) = (self.atoms[at].0, self.distance.at(&self.atoms[at].0));
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
            self.atoms.push((p, free));
            self.heading.push(heading);
        }
    }

    /// The unit steps to an atom's ideal neighbours along the outline: none at a crossing of an edge, two
    /// along a curve, six over a surface.
    fn steps(&self, at: usize, free: u8) -> Vec<Point<D>> {
        let dimension = free.count_ones() as usize;
        let Some(normal) = self.outline.normal(&self.atoms[at].0, free) else { return Vec::new() };
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
fn is_clear_of_sides<const D: usize>(
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

/// A lattice, and which of its atoms are on an outline.
#[derive(Clone, Debug)]
pub struct Outlined<const D: usize> {
    lattice: Lattice<D>,
    on_outline: Vec<bool>,
}

impl<const D: usize> Outlined<D> {
    /// The lattice.
    pub fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    /// For each atom, whether it is on the outline.
    pub fn on_outline(&self) -> &[bool] {
        &self.on_outline
    }

    fn push(&mut self, p: Point<D>, freedom: u8, temperature: f32, on_outline: bool) {
        self.lattice.push(p, freedom, temperature);
        self.on_outline.push(on_outline);
    }

    /// Puts the atoms near the outline onto it, the nearest first, and leaves out those that would then be
    /// crowded, and those that no cell of the mask needs.
    pub fn new(lattice: Lattice<D>, outline: &Outline<D>, distance: &NominalDistance<D>) -> Self {
        let atoms = lattice.atoms();
        let landings: Vec<Option<Point<D>>> = (0..atoms.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| landing(&lattice, i, outline, distance))
            .collect();
        let far = |i: usize| match &landings[i] {
            Some(q) => {
                let v = difference(q, &atoms[i]);
                dot(&v, &v).sqrt() / distance.at(q)
            }
            None => f64::INFINITY,
        };
        let fixed = |i: usize| (0..D).all(|k| lattice.mobility(i, k) == 0.0);
        let mut order: Vec<(bool, f64, usize)> =
            (0..atoms.len()).map(|i| (!fixed(i), far(i), i)).collect();
        order.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut occupancy = room(outline, distance, CROWDED, CROWDED);
        let mut kept: Vec<Option<(Point<D>, bool)>> = vec![None; atoms.len()];
        for (is_free, _, i) in order {
            let p = landings[i].unwrap_or(atoms[i]);
            let (d, on) = (distance.at(&p), landings[i].is_some());
            let diameter = if on { CROWDED } else { BESIDE } * d;
            let is_wanted =
                || outline.needs(&p, d) && (on || !is_just_beyond(&p, outline, BEYOND * d));
            if !is_free || occupancy.is_free(&p, diameter) && is_wanted() {
                kept[i] = Some((p, on));
                if on {
                    occupancy.take(p, diameter);
                }
            }
        }
        let mut outlined = Self { lattice: Lattice::empty(lattice.bounds), on_outline: Vec::new() };
        for (i, kept) in kept.iter().enumerate() {
            if let Some((p, on)) = kept {
                outlined.push(*p, lattice.freedom[i], lattice.temperature[i], *on);
            }
        }
        outlined.unique()
    }

    /// The same without atoms that share a place with another.
    fn unique(self) -> Self {
        let (points, merged) = merge_duplicates(self.lattice.atoms());
        if points.len() == self.lattice.len() {
            return self;
        }
        let freedom = self.lattice.freedom_of(&merged, points.len());
        let mut on = vec![false; points.len()];
        let mut temperature = vec![1.0_f32; points.len()];
        for (i, &point) in merged.iter().enumerate() {
            on[point as usize] |= self.on_outline[i];
            temperature[point as usize] =
                temperature[point as usize].min(self.lattice.temperature[i]);
        }
        let bounds = self.lattice.bounds;
        let lattice = Lattice { bounds, atoms: points, freedom, temperature };
        Self { lattice, on_outline: on }
    }

    /// Connects the atoms, and adds atoms where an edge crosses the outline far from those on it, in a few
    /// rounds. Edges that cross it may remain.
    ///
    /// # Errors
    /// [`ConnectError`] if there are too few atoms, or the work was cancelled.
    pub fn connect(
        mut self,
        delaunay: &Delaunay<D>,
        outline: &Outline<D>,
        distance: &NominalDistance<D>,
        watch: &mut dyn Watch,
    ) -> Result<(Self, Mesh<D>), ConnectError> {
        let mut mesh = delaunay.connect(self.lattice.atoms(), watch)?;
        for _ in 0..ROUNDS {
            let before = self.lattice.len();
            self.add_crossings(&mesh, outline, distance);
            if self.lattice.len() == before {
                break;
            }
            mesh = delaunay.connect(self.lattice.atoms(), watch)?;
        }
        Ok((self, mesh))
    }

    fn add_crossings(
        &mut self,
        mesh: &Mesh<D>,
        outline: &Outline<D>,
        distance: &NominalDistance<D>,
    ) {
        let atoms = self.lattice.atoms();
        let inside: Vec<bool> = atoms.par_iter().map(|p| outline.is_inside(p)).collect();
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for cell in mesh.cells() {
            for (i, &a) in cell.iter().enumerate() {
                for &b in &cell[i + 1..] {
                    let (a, b) = (a.min(b), a.max(b));
                    let on = self.on_outline[a as usize] || self.on_outline[b as usize];
                    if !on && inside[a as usize] != inside[b as usize] {
                        edges.push([a, b]);
                    }
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        let mut occupancy = room(outline, distance, ADDED, ADDED);
        for (p, &on) in atoms.iter().zip(&self.on_outline) {
            occupancy.take(*p, if on { ADDED * distance.at(p) } else { 0.0 });
        }
        for [a, b] in edges {
            let (a, b) = (a as usize, b as usize);
            let (p, q) = if inside[a] { (a, b) } else { (b, a) };
            let atoms = self.lattice.atoms();
            let site = outline.crossing(&atoms[p], &atoms[q]);
            let freedom = free_axes(
                [&atoms[a], &atoms[b]],
                [self.lattice.freedom[a], self.lattice.freedom[b]],
            );
            let d = distance.at(&site);
            if is_clear_of_sides(outline, &site, freedom, SIDE * d)
                && occupancy.is_free(&site, ADDED * d)
            {
                occupancy.take(site, ADDED * d);
                self.push(site, freedom, 1.0, true);
            }
        }
    }
}

/// Whether a point is outside of the outline and within `reach` of it.
fn is_just_beyond<const D: usize>(p: &Point<D>, outline: &Outline<D>, reach: f64) -> bool {
    !outline.is_inside(p) && outline.project(p, all_axes::<D>(), reach).is_some()
}

/// Rounds in which atoms are added where edges cross the outline.
const ROUNDS: usize = 3;

/// Where an atom lands on the outline, if it is near.
fn landing<const D: usize>(
    lattice: &Lattice<D>,
    i: usize,
    outline: &Outline<D>,
    distance: &NominalDistance<D>,
) -> Option<Point<D>> {
    let p = &lattice.atoms()[i];
    let d = distance.at(p);
    let free = axes_where::<D>(|k| lattice.mobility(i, k) > 0.0);
    if free == 0 {
        return outline.project(p, all_axes::<D>(), FIXED_REACH * d).map(|_| *p);
    }
    let q = outline.project(p, free, REACH * d)?;
    is_clear_of_sides(outline, &q, free, SIDE * d).then_some(q)
}
