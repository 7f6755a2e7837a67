//! The star of a point: the cells around it, and what they cost with the point elsewhere.

use crate::geometry::{Point, difference, distance_squared, dot};

use super::energy::{Edge, Energy, Shape, cross, least_sine};
use super::triangles::Triangles;

/// A cell of a star, and its corners after the star's centre, counter-clockwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct StarCell {
    pub cell: u32,
    pub first: u32,
    pub second: u32,
}

/// What the cells of a star are to keep to.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    /// Their energy is below this.
    pub energy: f64,
    /// The sine of each one's least angle is no less than this.
    pub sine: f64,
}

impl Limits {
    /// Nothing is kept to.
    pub const NONE: Self = Self { energy: f64::INFINITY, sine: f64::NEG_INFINITY };
}

/// The cells around a point.
#[derive(Default)]
pub(super) struct Star {
    pub center: Point<2>,
    /// Counter-clockwise.
    pub cells: Vec<StarCell>,
    /// Whether the cells close around the point, which then is not on the hull.
    pub is_closed: bool,
    /// The corners around, one more than cells: the first again at the end if they close.
    pub rim: Vec<Point<2>>,
    rim_edges: Vec<Edge>,
    rim_lengths: Vec<f64>,
    pub guides: Vec<u32>,
    spokes: Vec<Point<2>>,
    spoke_lengths: Vec<f64>,
    spoke_edges: Vec<Edge>,
}

impl Star {
    /// Takes up the star of a point.
    pub fn gather(&mut self, triangles: &Triangles, point: u32) {
        self.is_closed = triangles.star(point, &mut self.cells);
        self.center = triangles.points[point as usize];
        self.rim.clear();
        self.guides.clear();
        for &StarCell { cell, first, .. } in &self.cells {
            self.rim.push(triangles.points[first as usize]);
            self.guides.extend_from_slice(triangles.guides_in(cell));
        }
        let last = self.cells[self.cells.len() - 1].second;
        self.rim.push(triangles.points[last as usize]);
        self.measure_rim();
    }

    /// Takes up the edges of a rim that has been given.
    pub fn measure_rim(&mut self) {
        let pairs = || self.rim.windows(2).map(|pair| (pair[0], pair[1]));
        self.rim_edges.clear();
        self.rim_edges.extend(pairs().map(|(a, b)| Edge::new(a, b)));
        self.rim_lengths.clear();
        self.rim_lengths.extend(pairs().map(|(a, b)| distance_squared(&a, &b).sqrt()));
    }

    /// The sine of the least angle now.
    pub fn least_sine(&self) -> f64 {
        let sines = self.rim.windows(2).map(|pair| least_sine(self.center, pair[0], pair[1]));
        sines.fold(1.0, f64::min)
    }

    /// The energy of the star's cells with the centre at `x`, if they keep to the limits.
    pub fn energy(&mut self, energy: &Energy<'_>, x: Point<2>, limits: Limits) -> Option<f64> {
        self.spokes.clear();
        self.spokes.extend(self.rim.iter().map(|corner| difference(corner, &x)));
        self.spoke_lengths.clear();
        self.spoke_lengths.extend(self.spokes.iter().map(|spoke| dot(spoke, spoke).sqrt()));
        let mut sum = 0.0;
        for (i, &rim) in self.rim_lengths.iter().enumerate() {
            let area = cross(self.spokes[i], self.spokes[i + 1]);
            let shape = Shape::new(area, [self.spoke_lengths[i], self.spoke_lengths[i + 1], rim]);
            if shape.sine < limits.sine {
                return None;
            }
            sum += energy.of_shape(shape);
        }
        if self.guides.is_empty() {
            return (sum < limits.energy).then_some(sum);
        }
        self.spoke_edges.clear();
        self.spoke_edges.extend(self.rim.iter().map(|&corner| Edge::new(x, corner)));
        for &guide in &self.guides {
            if sum >= limits.energy {
                return None;
            }
            let sector = self.sector(difference(&energy.guides[guide as usize].at.position, &x));
            let [a, b] = [&self.spoke_edges[sector], &self.spoke_edges[sector + 1]];
            sum += energy.of_guide(guide, [a, b, &self.rim_edges[sector]]);
        }
        (sum < limits.energy).then_some(sum)
    }

    /// The place in the star of the cell, between the spokes before and after it, that holds a point given from the
    /// centre. Where rounding leaves none, the cell that fits best.
    #[inline]
    fn sector(&self, from_center: Point<2>) -> usize {
        let mut best = (f64::NEG_INFINITY, 0);
        let mut before = cross(self.spokes[0], from_center);
        for (i, &spoke) in self.spokes.iter().enumerate().skip(1) {
            let after = cross(spoke, from_center);
            let inside = before.min(-after);
            if inside >= 0.0 {
                return i - 1;
            }
            if inside > best.0 {
                best = (inside, i - 1);
            }
            before = after;
        }
        best.1
    }

    /// Shares the guides out among `cells`, for the centre at `x`.
    pub fn share_out(
        &mut self,
        triangles: &mut Triangles,
        energy: &Energy<'_>,
        cells: impl Fn(usize) -> u32,
        x: Point<2>,
    ) {
        if self.guides.is_empty() {
            return;
        }
        self.spokes.clear();
        self.spokes.extend(self.rim.iter().map(|corner| difference(corner, &x)));
        for place in 0..self.rim.len() - 1 {
            triangles.guides_in_mut(cells(place)).clear();
        }
        for &guide in &self.guides {
            let sector = self.sector(difference(&energy.guides[guide as usize].at.position, &x));
            triangles.guides_in_mut(cells(sector)).push(guide);
        }
    }
}
