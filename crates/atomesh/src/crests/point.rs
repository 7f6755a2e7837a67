//! A point on a feature.

use crate::geometry::{Point, dot};
use crate::image::Grid;

/// A point on a feature: on its line in the plane, on its sheet in space.
///
/// Places are known to a fraction of a sample. Coordinates are those of samples, sample `i` being at `i`, until
/// [`FeaturePoint::in_lattice`] changes them; a function that returns points in lattice space says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeaturePoint<const D: usize> {
    /// The sample at which the point was found, x fastest.
    pub index: usize,
    /// Where the point is.
    pub position: Point<D>,
    /// The unit normal of the feature there; its sign means nothing.
    pub normal: Point<D>,
    /// How strong the feature is there, above 0: the depth of a valley of b, or the share of a full feature, 0…1.
    pub strength: f64,
}

impl<const D: usize> FeaturePoint<D> {
    /// The same point in the lattice space of `grid`, of whose samples its coordinates are now, moved into the box
    /// if it is outside.
    pub fn in_lattice(&self, grid: &Grid<D>) -> Self {
        let position = std::array::from_fn(|k| self.position[k] * grid.step[k]);
        // a normal is a slope: per lattice unit it is less where steps are long
        let slope: Point<D> = std::array::from_fn(|k| self.normal[k] / grid.step[k]);
        let length = dot(&slope, &slope).sqrt();
        Self {
            position: grid.bounds().clamp(&position),
            normal: slope.map(|x| x / length),
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_on_a_feature_in_samples_lies_on_it_in_lattice_units() {
        let grid = Grid { shape: [10, 8], step: [25.0, 4.0] };
        let normal = [0.6, 0.8];
        let point = FeaturePoint { index: 23, position: [3.25, 2.0], normal, strength: 0.5 };
        let placed = point.in_lattice(&grid);
        assert_eq!((placed.index, placed.position, placed.strength), (23, [81.25, 8.0], 0.5));
        let along = [-normal[1] * 25.0, normal[0] * 4.0];
        assert!(dot(&along, &placed.normal).abs() < 1e-14);
        assert!((dot(&placed.normal, &placed.normal) - 1.0).abs() < 1e-15);
        let outside = FeaturePoint { position: [-0.5, 7.4], ..point };
        assert_eq!(outside.in_lattice(&grid).position, [0.0, 28.0]);
    }
}
