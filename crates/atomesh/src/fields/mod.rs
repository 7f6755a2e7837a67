//! What atoms feel at a place: the potential b(x), its weight β(x) and the nominal distance d(x).

mod distance;
mod scalar;
mod spline;
mod weight;

pub use distance::{
    DistanceError, GRADIENT_LIMIT, GradeBy, Grading, NominalDistance, default_distance,
    feature_density,
};
pub use scalar::{FieldError, Interpolation, ScalarField};
pub(crate) use scalar::{HeldCell, centred_difference};
pub use weight::ImageWeight;

/// The fields that atoms move in.
#[derive(Clone, Copy)]
pub struct Fields<'a, const D: usize> {
    /// b(x).
    pub potential: &'a ScalarField<D>,
    /// β(x).
    pub weight: &'a ImageWeight<D>,
    /// d(x).
    pub distance: &'a NominalDistance<D>,
}
