//! Putting atoms back onto the outline of a mask after they have moved. Cost: O(atoms). Deterministic.

use crate::parallel::prelude::*;

use crate::fields::NominalDistance;
use crate::geometry::{Point, all_axes, axes_where, difference, dot};
use crate::mesh::{ConnectError, Delaunay, Mesh, merge_duplicates};
use crate::region::{Outline, free_axes};
use crate::watch::Watch;

use super::Lattice;
use super::plant::{SIDE, is_clear_of_sides, room};

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
