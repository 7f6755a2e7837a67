//! Atoms that fill the image's box: crystals and how lattices grow from them, or are scattered.
//!
//! The boundary comes first (corners, then edges, then faces, then the interior), so that the mesh fills
//! the box exactly: corners are fixed, atoms on an edge of the box keep one degree of freedom, on a face
//! two. The paper lets the hull of the atoms be the boundary instead.

mod boundary;
mod crystal;
mod error;
mod grow;
mod holes;
mod occupancy;
mod outline;
mod plant;
mod scatter;
mod settle;
#[cfg(test)]
mod slow_growth;
#[cfg(test)]
mod tests;

pub use boundary::Place;
pub use crystal::{Crystal, CrystalKind};
pub use error::LatticeError;
pub use grow::{GrowOptions, grow, grow_within};
pub(crate) use holes::fill_holes_near;
pub use outline::Outlined;
pub use scatter::{ScatterOptions, Scatterer, fill_holes, scatter};
pub use settle::settle;

use crate::geometry::{Bounds, Point, all_axes, hilbert_order, lexicographic};
use crate::mesh::MOST_POINTS;

/// Atoms in the box of an image, in lattice coordinates.
#[derive(Clone, Debug)]
pub struct Lattice<const D: usize> {
    bounds: Bounds<D>,
    atoms: Vec<Point<D>>,
    /// Bit k of an atom: it may move along axis k.
    freedom: Vec<u8>,
    /// 0 = frozen … 1 = free, for each atom.
    temperature: Vec<f32>,
}

impl<const D: usize> Lattice<D> {
    /// A lattice of these atoms, in lattice coordinates, all at temperature 1. Those on sides of the box stay on
    /// them; one must be at each of its corners, so that the mesh fills the box.
    ///
    /// ```
    /// use atomesh::{geometry::Bounds, lattice::Lattice};
    /// let bounds = Bounds { min: [0.0, 0.0], max: [8.0, 6.0] };
    /// let atoms = vec![[0.0, 0.0], [8.0, 0.0], [0.0, 6.0], [8.0, 6.0], [3.0, 2.0], [5.0, 6.0]];
    /// let lattice = Lattice::from_atoms(bounds, atoms)?;
    /// assert_eq!((lattice.mobility(5, 0), lattice.mobility(5, 1)), (1.0, 0.0));
    /// # Ok::<(), atomesh::lattice::LatticeError>(())
    /// ```
    ///
    /// # Errors
    /// [`LatticeError`] if the box has no extent along an axis, there are too many atoms, an atom is not finite,
    /// outside the box or at another's place, or a corner of the box has none.
    pub fn from_atoms(bounds: Bounds<D>, atoms: Vec<Point<D>>) -> Result<Self, LatticeError> {
        let extent = bounds.extent();
        if let Some(axis) = (0..D).find(|&k| extent[k].is_nan() || extent[k] <= 0.0) {
            return Err(LatticeError::Thin { axis });
        }
        if atoms.len() > MOST_POINTS {
            return Err(LatticeError::TooMany { limit: MOST_POINTS });
        }
        for (index, p) in atoms.iter().enumerate() {
            if let Some(axis) = (0..D).find(|&k| !p[k].is_finite()) {
                return Err(LatticeError::NotFinite { index, axis, value: p[axis] });
            }
            if !bounds.contains(p) {
                let (min, max) = (bounds.min.to_vec(), bounds.max.to_vec());
                return Err(LatticeError::AtomOutside { index, point: p.to_vec(), min, max });
            }
        }
        let mut order: Vec<usize> = (0..atoms.len()).collect();
        order.sort_unstable_by(|&a, &b| lexicographic(&atoms[a], &atoms[b]).then(a.cmp(&b)));
        if let Some(&[first, second]) = order.windows(2).find(|w| atoms[w[0]] == atoms[w[1]]) {
            let point = atoms[first].to_vec();
            return Err(LatticeError::Duplicate { first, second, point });
        }
        let has = |corner: &Point<D>| {
            order.binary_search_by(|&i| lexicographic(&atoms[i], corner)).is_ok()
        };
        if let Some(corner) = bounds.corners().find(|corner| !has(corner)) {
            return Err(LatticeError::NoCorner { corner: corner.to_vec() });
        }
        let freedom = atoms.iter().map(|p| bounds.freedom(p)).collect();
        Ok(Self { bounds, temperature: vec![1.0; atoms.len()], atoms, freedom })
    }

    /// A lattice without atoms.
    pub(crate) fn empty(bounds: Bounds<D>) -> Self {
        Self { bounds, atoms: Vec::new(), freedom: Vec::new(), temperature: Vec::new() }
    }

    pub(crate) fn push(&mut self, atom: Point<D>, freedom: u8, temperature: f32) {
        self.atoms.push(atom);
        self.freedom.push(freedom);
        self.temperature.push(temperature);
    }

    /// The image's box.
    pub fn bounds(&self) -> &Bounds<D> {
        &self.bounds
    }

    /// The atoms' coordinates.
    pub fn atoms(&self) -> &[Point<D>] {
        &self.atoms
    }

    /// The number of atoms.
    pub fn len(&self) -> usize {
        self.atoms.len()
    }

    /// Whether there are no atoms.
    pub fn is_empty(&self) -> bool {
        self.atoms.is_empty()
    }

    /// How freely atom `i` moves along axis `k`: 0 where the box, or its temperature, holds it.
    pub fn mobility(&self, i: usize, k: usize) -> f64 {
        if self.freedom[i] >> k & 1 == 1 { f64::from(self.temperature[i]) } else { 0.0 }
    }

    /// The axes along which the box, or a temperature of 0, lets each atom move, as bits.
    pub fn freedom(&self) -> Vec<u8> {
        let one = |i: usize| if self.temperature[i] > 0.0 { self.freedom[i] } else { 0 };
        (0..self.len()).map(one).collect()
    }

    /// The axes along which the box alone lets atom `i` move, as bits.
    pub(crate) fn freedom_in_box(&self, i: usize) -> u8 {
        self.freedom[i]
    }

    /// The temperature of atom `i`, 0 (frozen) to 1 (free).
    pub fn temperature(&self, i: usize) -> f32 {
        self.temperature[i]
    }

    /// Sets the temperature of atom `i`, 0 (frozen) to 1 (free): its variables are scaled by it, so
    /// that the gradient stays a gradient (Hale 2002).
    ///
    /// # Panics
    /// If there is no such atom or the temperature is outside 0…1.
    pub fn set_temperature(&mut self, i: usize, temperature: f32) {
        assert!((0.0..=1.0).contains(&temperature), "temperature {temperature}; expected 0 to 1");
        self.temperature[i] = temperature;
    }

    /// The axes along which each of `count` points may move, as bits, where atom i became point `merged[i]`:
    /// those that the box leaves to every atom of the point, none where one is frozen.
    pub(crate) fn freedom_of(&self, merged: &[u32], count: usize) -> Vec<u8> {
        let mut freedom = vec![all_axes::<D>(); count];
        for (i, &point) in merged.iter().enumerate() {
            freedom[point as usize] &= if self.temperature[i] > 0.0 { self.freedom[i] } else { 0 };
        }
        freedom
    }

    /// The lattice without some of its atoms.
    pub(crate) fn retained(self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<u32> = (0..self.len()).filter(|&i| keep(i)).map(|i| i as u32).collect();
        self.reordered(&kept)
    }

    /// The same lattice with its atoms elsewhere.
    pub(crate) fn moved_to(mut self, atoms: Vec<Point<D>>) -> Self {
        assert_eq!(atoms.len(), self.atoms.len());
        self.atoms = atoms;
        self
    }

    /// The same atoms along a Hilbert curve (see [`hilbert_order`]): atoms near each other are then near in
    /// memory, where all later work is fastest.
    pub fn along_curve(self) -> Self {
        let order = hilbert_order(&self.atoms);
        self.reordered(&order)
    }

    /// The same atoms in another order: entry `i` of the result is atom `order[i]`.
    pub(crate) fn reordered(self, order: &[u32]) -> Self {
        Self {
            bounds: self.bounds,
            atoms: order.iter().map(|&i| self.atoms[i as usize]).collect(),
            freedom: order.iter().map(|&i| self.freedom[i as usize]).collect(),
            temperature: order.iter().map(|&i| self.temperature[i as usize]).collect(),
        }
    }
}
