//! What a mesh is made from: an image from a file or in memory, and images in memory beside it.

use atomesh::image::Image as CoreImage;
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::World;
use atomesh_job::mesh::{MeshImages, ShownImage, read_shown};
use atomesh_job::options::RunConfig;
use atomesh_job::{Dimension, JobError, Session};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::image::{Image, is_path};
use crate::options::{Field, Wishes};

/// What a mesh is made from.
pub enum Source {
    /// A file, read with the options of the run.
    File,
    /// An image in memory.
    Given(AnyImage, World),
    /// A potential in memory, and no image.
    Potential(AnyImage, World),
}

impl Source {
    /// Takes the first argument of functions that mesh.
    pub fn take(image: &Bound<'_, PyAny>, wishes: &mut Wishes) -> PyResult<Self> {
        if image.is_none() {
            let at = wishes.fields.iter().position(|field| field.is_named("potential"));
            return match at {
                Some(at) => {
                    let (image, world) = wishes.fields.remove(at).into_image();
                    Ok(Self::Potential(image, world))
                }
                None => match wishes.labels_alone() {
                    Some((image, world)) => Ok(Self::Given(image, world)),
                    None if wishes.run.input.shown().is_some() => Ok(Self::File),
                    None => {
                        let message = "no image; expected one, or potential= or labels=";
                        Err(PyTypeError::new_err(message))
                    }
                },
            };
        }
        if is_path(image) {
            let input = &mut wishes.run.input;
            input.image = Some(image.extract()?);
            // whether its samples are read as labels depends on what is beside it
            for (name, path) in [("labels", &mut input.labels), ("potential", &mut input.potential)]
            {
                if wishes.fields.iter().any(|field| field.is_named(name)) {
                    path.get_or_insert_with(|| name.into());
                }
            }
            return Ok(Self::File);
        }
        let image = Image::like(image)?;
        Ok(Self::Given(image.get().any().clone(), image.get().world().clone()))
    }

    /// The images that a mesh is made from.
    ///
    /// # Errors
    /// [`JobError`] if a file cannot be used, or an image is of no use.
    pub fn open(self, run: &mut RunConfig, session: &mut Session<'_>) -> Result<Opened, JobError> {
        let (image, world, is_potential) = match self {
            Self::File => {
                let loaded = read_shown(run, session)?;
                let world = loaded.world();
                (loaded.image, world, false)
            }
            Self::Given(image, world) => (image, world, false),
            Self::Potential(image, world) => (image, world, true),
        };
        Ok(Opened { image, world, is_potential })
    }
}

/// The image that gives the frame.
pub struct Opened {
    pub image: AnyImage,
    pub world: World,
    pub is_potential: bool,
}

/// The image that gives the frame, of a known dimension, with images in memory beside it.
pub struct Shown<const D: usize> {
    pub image: CoreImage<D>,
    pub world: World,
    pub is_potential: bool,
    pub fields: Vec<Field>,
}

impl<const D: usize> Shown<D> {
    /// The images of a run, placed.
    ///
    /// # Errors
    /// [`JobError`] if an image is of no use.
    pub fn placed(
        self,
        run: &mut RunConfig,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<MeshImages<D>, JobError> {
        let Self { image, world, is_potential, fields } = self;
        let given = Wishes::given(fields, dimension)?;
        let shown = ShownImage { image, world };
        let mut images = MeshImages::with_fields(run, shown, given, dimension, session)?;
        images.is_potential |= is_potential;
        name_fields(run, &images);
        Ok(images)
    }
}

/// Names images in memory as files would be: options that they replace have no part in the run then.
pub fn name_fields<const D: usize>(run: &mut RunConfig, images: &MeshImages<D>) {
    let MeshImages { is_potential, potential, size_field, weight_field, mask, labels, .. } = images;
    let input = &mut run.input;
    for (path, is_there, name) in [
        (&mut input.potential, *is_potential || potential.is_some(), "potential"),
        (&mut input.size_field, size_field.is_some(), "size_field"),
        (&mut input.beta_field, weight_field.is_some(), "beta_field"),
        (&mut input.mask, mask.is_some(), "mask"),
        (&mut input.labels, labels.is_some(), "labels"),
    ] {
        if is_there && path.is_none() {
            *path = Some(name.into());
        }
    }
}
