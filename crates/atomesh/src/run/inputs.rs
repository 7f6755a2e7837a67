//! The images that a run is made from.

use crate::image::Image;

/// What a mesh is made from. Images other than the first must have its shape; its frame counts.
#[derive(Clone, Copy)]
pub struct Inputs<'a, const D: usize> {
    /// The image, or, if `is_potential`, b(x) itself, values in −1…1.
    pub image: &'a Image<D>,
    /// Whether the image is taken as b(x) as it is.
    pub is_potential: bool,
    /// d(x), in lattice units; goes before [`MeshOptions::size`](super::MeshOptions::size).
    pub size_field: Option<&'a Image<D>>,
    /// β(x), 0…1; goes before [`MeshOptions::image_weight`](super::MeshOptions::image_weight).
    pub weight_field: Option<&'a Image<D>>,
    /// Where to mesh: nonzero is inside, or, of shares within 0…1, at least one half.
    pub mask: Option<&'a Image<D>>,
    /// A label for each sample: cells get that of most of them.
    pub labels: Option<&'a Image<D>>,
}

impl<'a, const D: usize> Inputs<'a, D> {
    /// An image alone.
    pub fn image(image: &'a Image<D>) -> Self {
        Self {
            image,
            is_potential: false,
            size_field: None,
            weight_field: None,
            mask: None,
            labels: None,
        }
    }
}
