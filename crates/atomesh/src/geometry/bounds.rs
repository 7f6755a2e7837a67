//! Axis-aligned boxes.

use super::Point;

/// An axis-aligned box, closed on all sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<const D: usize> {
    /// The corner with the least coordinates.
    pub min: Point<D>,
    /// The corner with the greatest coordinates.
    pub max: Point<D>,
}

impl<const D: usize> Bounds<D> {
    /// The smallest box that holds all `points`; `None` if there are none.
    pub fn of(points: &[Point<D>]) -> Option<Self> {
        let first = *points.first()?;
        let mut bounds = Self { min: first, max: first };
        points.iter().for_each(|p| bounds.include(p));
        Some(bounds)
    }

    /// Widens the box to hold the point.
    #[inline]
    pub(crate) fn include(&mut self, p: &Point<D>) {
        for k in 0..D {
            self.min[k] = self.min[k].min(p[k]);
            self.max[k] = self.max[k].max(p[k]);
        }
    }

    /// The lengths of the box along each axis.
    pub fn extent(&self) -> Point<D> {
        std::array::from_fn(|k| self.max[k] - self.min[k])
    }

    /// The area (2-D) or volume (3-D) of the box.
    pub fn measure(&self) -> f64 {
        self.extent().iter().product()
    }

    /// Whether the point is inside the box or on its boundary; a NaN coordinate is outside.
    pub fn contains(&self, p: &Point<D>) -> bool {
        (0..D).all(|k| self.min[k] <= p[k] && p[k] <= self.max[k])
    }

    /// The point of the box nearest to `p`.
    pub fn clamp(&self, p: &Point<D>) -> Point<D> {
        std::array::from_fn(|k| p[k].clamp(self.min[k], self.max[k]))
    }
}
