//! Images beside a mesh: what it is measured against, searched by, shown over and sampled from.

use atomesh::image::{Frame, Image as CoreImage};
use atomesh_io::image::AnyImage;
use atomesh_job::images::is_bare;
use atomesh_job::measure::{Against, MeasureRequest};
use atomesh_job::options::{FrameOptions, RunConfig};
use atomesh_job::sample::{NamedImage, SampleRequest, SampledMesh, sample};
use atomesh_job::{Dimension, JobError, Session};

use super::Made;

/// The image if it has the mesh's number of axes.
pub fn in_dimension<const D: usize>(
    image: AnyImage,
    dimension: &Dimension<D>,
) -> Result<CoreImage<D>, JobError> {
    let axes = image.dimension();
    (dimension.image)(image).ok_or_else(|| {
        JobError::content(format!("the image has {axes} axes; expected {D}, as the mesh"))
    })
}

/// What a report of a mesh that was read is measured by.
pub fn against<const D: usize>(
    run: &RunConfig,
    image: AnyImage,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<(MeasureRequest, Against<D>), JobError> {
    let image = run.frame.place(in_dimension(image, dimension)?)?;
    let units = run.lattice.units.unwrap_or_default();
    let potential =
        atomesh_job::enhance::enhance(&image, &run.features, units, dimension, session)?;
    let mut against = Against::potential(potential.image)?;
    against.image = Some(image);
    let size = run.lattice.wanted_length();
    Ok((MeasureRequest { size, units: run.lattice.units, ..Default::default() }, against))
}

/// The image whose features are looked for, placed.
pub fn placed<const D: usize>(
    frame: &FrameOptions,
    image: Option<AnyImage>,
    dimension: &Dimension<D>,
) -> Result<Option<CoreImage<D>>, JobError> {
    image.map(|image| frame.place(in_dimension(image, dimension)?)).transpose()
}

/// What a mesh is shown over and compared with: its own image, or one that is given, in the same place.
pub fn over<const D: usize>(
    given: Option<AnyImage>,
    own: &CoreImage<D>,
    dimension: &Dimension<D>,
) -> Result<CoreImage<D>, JobError> {
    let Some(given) = given else { return Ok(own.clone()) };
    let image = in_own_place(in_dimension(given, dimension)?, own.frame())?;
    let own = own.frame();
    if image.frame() == own {
        return Ok(image);
    }
    let words = |frame: &Frame<D>| {
        let (shape, spacing, origin) = (frame.shape(), frame.spacing(), frame.origin());
        format!("{shape:?} samples, {spacing:?} apart, from {origin:?}")
    };
    let (found, expected) = (words(image.frame()), words(own));
    Err(JobError::content(format!(
        "the image has {found}; expected {expected}, turned as the mesh's own image"
    )))
}

/// An image that does not say where it is, in a frame of as many samples.
fn in_own_place<const D: usize>(
    image: CoreImage<D>,
    own: &Frame<D>,
) -> Result<CoreImage<D>, JobError> {
    if own.shape() == image.frame().shape() && is_bare(image.frame()) {
        return image.with_frame(*own).map_err(JobError::content);
    }
    Ok(image)
}

/// The image that a picture of a mesh is drawn on: one that is given, or its own.
pub fn backdrop<'a, const D: usize>(
    given: Option<&'a CoreImage<D>>,
    made: Option<&'a Made<D>>,
) -> Result<&'a CoreImage<D>, JobError> {
    given.or(made.map(|made| &made.image)).ok_or_else(|| of_file("picture"))
}

/// One value for each cell from an image, in the place that it says, or else where the mesh's image was.
pub fn sampled<const D: usize>(
    request: &SampleRequest,
    name: &str,
    loaded: &impl SampledMesh<D>,
    image: AnyImage,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Vec<f64>, JobError> {
    let image = in_dimension(image, dimension)?;
    let image = match loaded.frame() {
        Some(frame) => in_own_place(image, frame)?,
        None => image,
    };
    let named = NamedImage { name: name.to_owned(), path: name.into() };
    let mut found = sample(request, &named, loaded, &image, dimension, session)?;
    Ok(found.swap_remove(0).into_values())
}

/// The refusal of what needs the image of a mesh that was read.
pub fn of_file(what: &str) -> JobError {
    JobError::misuse(format!("{what}() of a mesh that was read; expected the image too"))
}
