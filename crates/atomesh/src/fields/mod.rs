//! What atoms feel at a place: the potential b(x), its weight β(x) and the nominal distance d(x).

mod distance;
mod error;
mod scalar;
mod spline;
#[cfg(test)]
mod tests;
mod weight;

pub use distance::{
    DistanceError, GRADIENT_LIMIT, GradeBy, Grading, NominalDistance, default_distance,
    feature_density,
};
pub use error::FieldError;
pub(crate) use scalar::{HeldCell, centred_difference};
pub use scalar::{Interpolation, ScalarField};
pub use weight::ImageWeight;

/// The fields that atoms move in, over one box.
///
/// ```
/// use atomesh::fields::{Fields, ImageWeight, Interpolation, NominalDistance, ScalarField};
/// let grid = atomesh::image::Grid { shape: [20, 30], step: [1.0, 1.0] };
/// let fields = Fields::new(
///     ScalarField::potential(grid, vec![0.0; 600], Interpolation::Linear)?,
///     ImageWeight::constant(0.4)?,
///     NominalDistance::constant(&grid, 5.0)?,
/// )?;
/// assert_eq!(fields.view().distance.at(&[3.0, 4.0]), 5.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Fields<const D: usize> {
    potential: ScalarField<D>,
    weight: ImageWeight<D>,
    distance: NominalDistance<D>,
}

impl<const D: usize> Fields<D> {
    /// These fields.
    ///
    /// # Errors
    /// [`FieldError::Domain`] if they do not lie over one box.
    pub fn new(
        potential: ScalarField<D>,
        weight: ImageWeight<D>,
        distance: NominalDistance<D>,
    ) -> Result<Self, FieldError> {
        let expected = potential.grid().bounds();
        let boxes = [("weight", weight.bounds()), ("nominal distance", Some(*distance.bounds()))];
        for (field, bounds) in boxes {
            if let Some(found) = bounds.filter(|found| *found != expected) {
                let (found, expected) = (found.max.to_vec(), expected.max.to_vec());
                return Err(FieldError::Domain { field, found, expected });
            }
        }
        Ok(Self { potential, weight, distance })
    }

    /// b(x).
    pub fn potential(&self) -> &ScalarField<D> {
        &self.potential
    }

    /// β(x).
    pub fn weight(&self) -> &ImageWeight<D> {
        &self.weight
    }

    /// d(x).
    pub fn distance(&self) -> &NominalDistance<D> {
        &self.distance
    }

    /// All of them, borrowed.
    pub fn view(&self) -> FieldsView<'_, D> {
        let Self { potential, weight, distance } = self;
        FieldsView { potential, weight, distance }
    }

    /// b(x), β(x) and d(x).
    pub fn into_parts(self) -> (ScalarField<D>, ImageWeight<D>, NominalDistance<D>) {
        (self.potential, self.weight, self.distance)
    }
}

/// [`Fields`], borrowed one by one, so that one of them can be exchanged for another over the same box.
#[derive(Clone, Copy, Debug)]
pub struct FieldsView<'a, const D: usize> {
    /// b(x).
    pub potential: &'a ScalarField<D>,
    /// β(x).
    pub weight: &'a ImageWeight<D>,
    /// d(x).
    pub distance: &'a NominalDistance<D>,
}
