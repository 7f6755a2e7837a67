//! What a mesh is made from: images of one dimension and one shape, in memory.

use std::path::{Path, PathBuf};

use atomesh::image::Image;
use atomesh::run::Inputs;
use atomesh_io::image::{AnyImage, ReadOptions};

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::images;
use crate::memory;
use crate::options::RunConfig;
use crate::session::Session;

/// The images that a mesh is made from, in place: in their frame, cropped, without NaN.
#[derive(Clone, Debug)]
pub struct MeshImages<const D: usize> {
    /// The image, whose frame counts.
    pub image: Image<D>,
    /// Whether the image is b(x) itself, values −1…1.
    pub is_potential: bool,
    /// b(x), values −1…1, in place of the image's features.
    pub potential: Option<Image<D>>,
    /// d(x), in lattice units; goes before the options of the size.
    pub size_field: Option<Image<D>>,
    /// β(x), 0…1; goes before the options of the weight.
    pub weight_field: Option<Image<D>>,
    /// Where to mesh: nonzero is inside, or, of shares within 0…1, at least one half.
    pub mask: Option<Image<D>>,
    /// A label for each sample.
    pub labels: Option<Image<D>>,
}

impl<const D: usize> MeshImages<D> {
    /// An image alone.
    pub fn new(image: Image<D>) -> Self {
        Self {
            image,
            is_potential: false,
            potential: None,
            size_field: None,
            weight_field: None,
            mask: None,
            labels: None,
        }
    }

    /// An image as read, placed as options say, with the fields that options name.
    ///
    /// # Errors
    /// [`JobError`] if a file cannot be used, or options make no sense.
    pub fn read_fields(
        run: &RunConfig,
        image: Image<D>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Self, JobError> {
        let input = &run.input;
        let shown = input.shown();
        let image = run.frame.place(image).map_err(|e| e.about_any(shown))?;
        run.mesh_options::<D>()?;
        memory::check_potential(image.samples().len(), "mesh").map_err(|e| e.about_any(shown))?;
        let mut field = |path: &Option<PathBuf>| {
            path.as_deref().map(|path| read_field(run, path, dimension, session)).transpose()
        };
        let size_field = field(&input.size_field)?;
        let weight_field = field(&input.beta_field)?;
        let mask = field(&input.mask)?;
        let labels = field(&input.labels)?;
        // without IMAGE, the potential is the image
        let potential = if input.image.is_some() { field(&input.potential)? } else { None };
        let is_potential = input.potential.is_some() && potential.is_none();
        Ok(Self { image, is_potential, potential, size_field, weight_field, mask, labels })
    }

    /// b(x) in the image's frame, if it is given beside the image.
    pub(super) fn take_potential(&mut self, run: &RunConfig) -> Result<Option<Image<D>>, JobError> {
        let Some(potential) = self.potential.take() else { return Ok(None) };
        let (found, expected) = (potential.frame().shape(), self.image.frame().shape());
        if found != expected {
            let of = name(run);
            let message =
                format!("has {found:?} samples (x first); expected {expected:?}, as {of}");
            return Err(JobError::content(message).about_any(run.input.potential.as_deref()));
        }
        let placed = potential.with_frame(*self.image.frame());
        placed.map(Some).map_err(JobError::content)
    }

    /// What the core takes; `potential` is [`MeshImages::take_potential`].
    pub(super) fn inputs<'a>(&'a self, potential: Option<&'a Image<D>>) -> Inputs<'a, D> {
        Inputs {
            image: potential.unwrap_or(&self.image),
            is_potential: self.is_potential || potential.is_some(),
            size_field: self.size_field.as_ref(),
            weight_field: self.weight_field.as_ref(),
            mask: self.mask.as_ref(),
            labels: self.labels.as_ref(),
        }
    }
}

/// The name of the image that gives the frame.
fn name(run: &RunConfig) -> String {
    run.input.shown().map_or("the image".into(), |path| path.display().to_string())
}

/// Reads the image that gives the frame.
///
/// # Errors
/// [`JobError`] if options name none, or the file cannot be used.
pub fn read_shown(run: &RunConfig, session: &mut Session<'_>) -> Result<AnyImage, JobError> {
    images::read(shown(run)?, &run.frame.read_options()?, session)
}

/// The file of the image that gives the frame.
pub(crate) fn shown(run: &RunConfig) -> Result<&Path, JobError> {
    let nothing = || JobError::misuse("nothing to mesh; expected IMAGE, or --potential FILE");
    run.input.shown().ok_or_else(nothing)
}

/// Reads an image that must have the shape of the first, its box of interest taken.
fn read_field<const D: usize>(
    run: &RunConfig,
    path: &Path,
    dimension: &Dimension<D>,
    session: &mut Session<'_>,
) -> Result<Image<D>, JobError> {
    let options = ReadOptions { raw: None, ..run.frame.read_options()? };
    let any = images::read(path, &options, session)?;
    let found = any.dimension();
    let Some(field) = (dimension.image)(any) else {
        let message = format!("has {found} axes; expected {D}, as {}", name(run));
        return Err(JobError::content(message).about(path));
    };
    run.frame.place(field).map_err(|e| e.about(path))
}
