//! Axis-aligned boxes.

use super::Point;

/// All axes, as bits.
pub(crate) const fn all_axes<const D: usize>() -> u8 {
    ((1usize << D) - 1) as u8
}

/// The axes for which `holds` is true, as bits: bit k stands for axis k.
#[inline]
pub(crate) fn axes_where<const D: usize>(holds: impl Fn(usize) -> bool) -> u8 {
    (0..D).fold(0, |set, k| set | u8::from(holds(k)) << k)
}

/// An axis-aligned box, closed on all sides.
///
/// Its sides are numbered: side 2k is the one at the least coordinate along axis k, side 2k + 1 that at
/// the greatest. A set of sides or axes is a number whose bits are those of its members.
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

    /// Widens the box to hold another.
    #[inline]
    pub(crate) fn join(&mut self, other: &Self) {
        for k in 0..D {
            self.min[k] = self.min[k].min(other.min[k]);
            self.max[k] = self.max[k].max(other.max[k]);
        }
    }

    /// The lengths of the box along each axis.
    pub fn extent(&self) -> Point<D> {
        std::array::from_fn(|k| self.max[k] - self.min[k])
    }

    /// The length of the longest edge.
    pub(crate) fn longest_edge(&self) -> f64 {
        self.extent().into_iter().fold(0.0, f64::max)
    }

    /// The axis along which the box is longest, the first of equals.
    pub(crate) fn longest_axis(&self) -> usize {
        let extent = self.extent();
        (1..D).fold(0, |best, k| if extent[k] > extent[best] { k } else { best })
    }

    /// The point in the middle.
    pub fn centre(&self) -> Point<D> {
        std::array::from_fn(|k| 0.5 * (self.min[k] + self.max[k]))
    }

    /// Corner `number` of 2^D: at the greatest coordinate along the axes whose bits are set in it, at the
    /// least along the others.
    pub fn corner(&self, number: usize) -> Point<D> {
        std::array::from_fn(|k| if number >> k & 1 == 1 { self.max[k] } else { self.min[k] })
    }

    /// The corners, in the order of their numbers.
    pub fn corners(&self) -> impl Iterator<Item = Point<D>> + use<D> {
        let bounds = *self;
        (0..1 << D).map(move |number| bounds.corner(number))
    }

    /// The coordinate of a side along the axis across it.
    pub fn level(&self, side: usize) -> f64 {
        if side.is_multiple_of(2) { self.min[side / 2] } else { self.max[side / 2] }
    }

    /// The set of sides that the point is no farther from than `tolerance`.
    #[inline]
    pub fn sides(&self, p: &Point<D>, tolerance: f64) -> u8 {
        (0..2 * D).fold(0, |set, side| {
            set | u8::from((p[side / 2] - self.level(side)).abs() <= tolerance) << side
        })
    }

    /// The set of axes across which a point of the box lies on a side: an atom there may not move along
    /// them.
    #[inline]
    pub fn held(&self, p: &Point<D>) -> u8 {
        axes_where::<D>(|k| p[k] == self.min[k] || p[k] == self.max[k])
    }

    /// The set of the other axes, along which an atom at that point may move.
    #[inline]
    pub fn freedom(&self, p: &Point<D>) -> u8 {
        !self.held(p) & all_axes::<D>()
    }

    /// Whether the point is a corner of the box.
    pub fn is_corner(&self, p: &Point<D>) -> bool {
        self.freedom(p) == 0
    }

    /// The area (plane) or volume (space) of the box.
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

    /// The point, moved onto each side that is within `rounding` of it, or within 10⁻⁹ of the box's extent along the axis
    /// across that side. A point farther outside stays where it is.
    pub fn snap(&self, p: &Point<D>, rounding: f64) -> Point<D> {
        let extent = self.extent();
        let to = std::array::from_fn(|k| {
            let near = |side: &f64| (p[k] - side).abs() <= rounding.max(1e-9 * extent[k]);
            [self.min[k], self.max[k]].into_iter().find(near).unwrap_or(p[k])
        });
        if self.contains(&to) { to } else { *p }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Bounds<3> = Bounds { min: [0.0, 1.0, -2.0], max: [4.0, 2.0, 6.0] };

    #[test]
    fn a_corner_lies_on_a_side_across_every_axis_and_the_centre_on_none() {
        for (number, corner) in BOX.corners().enumerate() {
            let sides = (0..3).fold(0, |set, k| set | 1 << (2 * k + (number >> k & 1)));
            assert_eq!((BOX.sides(&corner, 0.0), BOX.held(&corner)), (sides, 0b111));
            assert!(BOX.is_corner(&corner) && BOX.freedom(&corner) == 0);
        }
        assert_eq!((BOX.sides(&BOX.centre(), 0.4), BOX.freedom(&BOX.centre())), (0, 0b111));
    }

    #[test]
    fn a_point_on_an_edge_may_move_along_it() {
        let edge = [0.0, 1.5, 6.0];
        assert_eq!((BOX.held(&edge), BOX.freedom(&edge)), (0b101, 0b010));
        assert_eq!(BOX.sides(&edge, 0.0), 0b10_0001);
    }

    #[test]
    fn only_a_point_within_a_rounding_of_a_side_snaps_to_it() {
        for sign in [1.0, -1.0] {
            let near = [4.0 + sign * 1e-9, 1.5, -2.0 - sign * 1e-9];
            assert_eq!(BOX.snap(&near, 0.0), [4.0, 1.5, -2.0]);
            let near = [4.0 + sign * 1e-6, 1.5 + sign * 1e-6, 0.0];
            assert_eq!(BOX.snap(&near, 0.0), near);
            assert_eq!(BOX.snap(&near, 1e-5), [4.0, near[1], 0.0]);
        }
        assert_eq!(BOX.snap(&[4.1, 1.5, -2.0 - 1e-9], 0.0), [4.1, 1.5, -2.0 - 1e-9]);
    }
}
