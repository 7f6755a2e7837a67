//! Points by the cube of the box that they are in, for asking which are near.

use crate::geometry::{Bounds, Point};

const NONE: u32 = u32::MAX;

/// Cubes over a box, each with a list of points.
#[derive(Clone, Debug)]
pub(crate) struct Bins<const D: usize> {
    min: Point<D>,
    width: f64,
    shape: [usize; D],
    heads: Vec<u32>,
    next: Vec<u32>,
}

impl<const D: usize> Bins<D> {
    /// Cubes of at least `width`, and not many more than `expected` points.
    pub fn new(bounds: &Bounds<D>, width: f64, expected: usize) -> Self {
        let each = bounds.measure() / (expected.max(1) as f64);
        let width = width.max(each.powf(1.0 / D as f64));
        let shape = bounds.extent().map(|extent| (extent / width) as usize + 1);
        let heads = vec![NONE; shape.iter().product()];
        Self { min: bounds.min, width, shape, heads, next: Vec::new() }
    }

    /// Bins that hold points, numbered in their order.
    pub fn of(
        bounds: &Bounds<D>,
        width: f64,
        points: impl ExactSizeIterator<Item = Point<D>>,
    ) -> Self {
        let mut bins = Self::new(bounds, width, points.len());
        points.for_each(|p| bins.push(&p));
        bins
    }

    /// Adds a point; its number is how many there were.
    pub fn push(&mut self, p: &Point<D>) {
        let cube = self.index(&self.cube(p));
        self.next.push(std::mem::replace(&mut self.heads[cube], self.next.len() as u32));
    }

    /// Takes a point out that is at `p`; its number is not used again, but by [`Self::put_back`].
    pub fn remove(&mut self, number: usize, p: &Point<D>) {
        let cube = self.index(&self.cube(p));
        let after = self.next[number];
        let mut at = self.heads[cube] as usize;
        if at == number {
            self.heads[cube] = after;
            return;
        }
        while self.next[at] as usize != number {
            at = self.next[at] as usize;
        }
        self.next[at] = after;
    }

    /// Adds a point again that has been taken out, at `p`.
    pub fn put_back(&mut self, number: usize, p: &Point<D>) {
        let cube = self.index(&self.cube(p));
        self.next[number] = std::mem::replace(&mut self.heads[cube], number as u32);
    }

    /// Visits all points within `reach` along every axis, and some more.
    pub fn near(&self, p: &Point<D>, reach: f64, mut visit: impl FnMut(usize)) {
        let (low, high) = (self.cube(&p.map(|x| x - reach)), self.cube(&p.map(|x| x + reach)));
        let counts: [usize; D] = std::array::from_fn(|k| high[k] - low[k] + 1);
        for code in 0..counts.iter().product() {
            let mut rest = code;
            let cube = std::array::from_fn(|k| {
                let offset = rest % counts[k];
                rest /= counts[k];
                low[k] + offset
            });
            let mut at = self.heads[self.index(&cube)];
            while at != NONE {
                visit(at as usize);
                at = self.next[at as usize];
            }
        }
    }

    fn cube(&self, p: &Point<D>) -> [usize; D] {
        std::array::from_fn(|k| {
            let at = ((p[k] - self.min[k]) / self.width).max(0.0) as usize;
            at.min(self.shape[k] - 1)
        })
    }

    fn index(&self, cube: &[usize; D]) -> usize {
        (0..D).rev().fold(0, |index, k| index * self.shape[k] + cube[k])
    }
}
