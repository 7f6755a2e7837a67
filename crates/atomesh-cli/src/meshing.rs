//! From the options of a run to b(x), d(x) and β(x): what every command that meshes an image begins with.

use std::path::{Path, PathBuf};

use atomesh::enhance::{EnhanceError, Features};
use atomesh::fields::DistanceError;
use atomesh::fields::FieldError;
use atomesh::image::Image;
use atomesh::improve::ImproveError;
use atomesh::lattice::LatticeError;
use atomesh::optimize::OptimizeError;
use atomesh::region::RegionError;
use atomesh::run::{Inputs, Prepared, RunError, prepare};
use atomesh_io::image::ReadOptions;

use crate::commands::is_option;
use crate::dimension::Dimension;
use crate::failure::Failure;
use crate::frame_options;
use crate::memory;
use crate::progress::Progress;
use crate::run_config::RunConfig;
use crate::values::Text;

/// The image that gives the frame: the potential or labels where there is no other.
///
/// # Errors
/// [`Failure`] if no image is given.
pub fn shown_path(run: &RunConfig) -> Result<&Path, Failure> {
    let input = &run.input;
    let paths = [&input.image, &input.potential, &input.labels];
    match paths.into_iter().flatten().next() {
        Some(path) => Ok(path),
        None => Err(Failure::misuse("nothing to mesh; expected IMAGE, or --potential FILE")),
    }
}

/// Labels alone are the image, and where they meet the features.
pub fn labels_alone(run: &mut RunConfig) {
    if run.input.image.is_none() && run.input.potential.is_none() && run.input.labels.is_some() {
        run.features.features.get_or_insert(Text(Features::Labels.into()));
    }
}

/// The mesh of an image, as options ask for it.
#[derive(Clone, Copy)]
pub struct Meshing<'a> {
    /// The options.
    pub run: &'a RunConfig,
    /// The image that gives the frame.
    pub path: &'a Path,
}

impl Meshing<'_> {
    /// b(x), d(x) and β(x); the image too if it is to be kept.
    ///
    /// # Errors
    /// [`Failure`] if a file cannot be used, or options make no sense.
    pub fn prepare<const D: usize>(
        &self,
        image: Image<D>,
        dimension: &Dimension<D>,
        keep_image: bool,
        watch: &mut Progress,
    ) -> Result<(Prepared<D>, Option<Image<D>>), Failure> {
        let image = self.run.frame.place(image).map_err(|f| f.about(self.path))?;
        let mut options = self.run.mesh_options::<D>()?;
        options.memory_limit = memory::available();
        memory::check_potential(image.samples().len(), self.path, "mesh")?;
        let input = &self.run.input;
        let mut field = |path: &Option<PathBuf>| {
            path.as_deref().map(|p| self.read_field(p, dimension, watch)).transpose()
        };
        let size_field = field(&input.size_field)?;
        let weight_field = field(&input.beta_field)?;
        let mask = field(&input.mask)?;
        let labels = field(&input.labels)?;
        // without IMAGE, the potential is the image
        let potential = if input.image.is_some() { field(&input.potential)? } else { None };
        if let Some(potential) = &potential {
            let (found, expected) = (potential.frame().shape(), image.frame().shape());
            if found != expected {
                let message = format!("has {found:?} samples (x first); expected {expected:?}");
                let message = format!("{message}, as {}", self.path.display());
                return Err(Failure::content(message).about(&self.potential_path()));
            }
        }
        let source = match potential {
            Some(potential) => {
                Some(potential.with_frame(*image.frame()).map_err(Failure::content)?)
            }
            None => None,
        };
        let inputs = Inputs {
            image: source.as_ref().unwrap_or(&image),
            is_potential: input.potential.is_some(),
            size_field: size_field.as_ref(),
            weight_field: weight_field.as_ref(),
            mask: mask.as_ref(),
            labels: labels.as_ref(),
        };
        let prepared = prepare(&dimension.method, inputs, options, watch);
        let prepared = prepared.map_err(|e| self.failure(e))?;
        for warning in prepared.warnings() {
            watch.say(&format!("warning: {}: {warning}", self.path.display()));
        }
        Ok((prepared, keep_image.then_some(image)))
    }

    /// An image that must have the shape of the first, its box of interest taken.
    fn read_field<const D: usize>(
        &self,
        path: &Path,
        dimension: &Dimension<D>,
        watch: &mut Progress,
    ) -> Result<Image<D>, Failure> {
        let options = ReadOptions { raw: None, ..self.run.frame.read_options()? };
        let any = frame_options::read(path, &options, watch)?;
        let found = any.dimension();
        let Some(field) = (dimension.image)(any) else {
            let message = format!("has {found} axes; expected {D}, as {}", self.path.display());
            return Err(Failure::content(message).about(path));
        };
        self.run.frame.place(field).map_err(|f| f.about(path))
    }

    fn potential_path(&self) -> PathBuf {
        self.run.input.potential.clone().unwrap_or_else(|| self.path.into())
    }

    /// What the core refuses, in the user's terms.
    pub fn failure(&self, error: RunError) -> Failure {
        let lattice = &self.run.lattice;
        match &error {
            e if e.is_cancelled() => Failure::cancelled(),
            RunError::LatticeDimension { .. } => Failure::misuse(error).about(self.path),
            RunError::Lattice(LatticeError::SeedOutside { index, .. }) => {
                let point = lattice.seed_point.iter().flatten().nth(*index);
                let point = point.map_or_else(String::new, ToString::to_string);
                Failure::misuse(format!("--seed-point {point} lies outside the image"))
                    .about(self.path)
                    .advise("places are in world coordinates; atomesh info IMAGE shows the box")
            }
            RunError::Enhance(EnhanceError::OutOfRange { .. })
            | RunError::Potential(FieldError::OutOfRange { .. }) => {
                Failure::content(error).about(&self.potential_path())
            }
            RunError::Enhance(EnhanceError::NotFinite { .. }) => {
                Failure::content(error).about(self.path)
            }
            RunError::Potential(FieldError::Weight { index: Some(_), .. }) => {
                field_failure(&error, self.run.input.beta_field.as_deref())
            }
            RunError::Region(RegionError::Label { .. }) => {
                field_failure(&error, self.run.input.labels.as_deref())
            }
            RunError::Region(_) => field_failure(&error, self.run.input.mask.as_deref()),
            RunError::Distance(_) if self.run.input.size_field.is_some() => {
                field_failure(&error, self.run.input.size_field.as_deref())
            }
            RunError::Distance(DistanceError::FieldValue { .. }) => Failure::content(error)
                .about(self.path)
                .advise("--frequency needs an image of velocities above 0"),
            RunError::Distance(DistanceError::BelowStep { .. }) if lattice.frequency.is_some() => {
                Failure::misuse(error)
                    .about(self.path)
                    .advise("choose a lower --frequency or fewer --points-per-wavelength")
            }
            RunError::Distance(DistanceError::BelowStep { .. }) => Failure::misuse(error)
                .about(self.path)
                .advise("choose a greater --size, or resample the image"),
            RunError::Shape { name, .. } => {
                let path = match *name {
                    "size field" => self.run.input.size_field.as_deref(),
                    "mask" => self.run.input.mask.as_deref(),
                    "label image" => self.run.input.labels.as_deref(),
                    _ => self.run.input.beta_field.as_deref(),
                };
                field_failure(&error, path)
            }
            RunError::Enhance(e) if is_option(e) => Failure::misuse(error),
            RunError::Distance(_)
            | RunError::Potential(FieldError::Weight { .. })
            | RunError::Lattice(LatticeError::SpacingFactor { .. })
            | RunError::Optimize(OptimizeError::Option { .. })
            | RunError::Improve(ImproveError::MinAngle { .. }) => Failure::misuse(error),
            _ => Failure::content(error).about(self.path),
        }
    }
}

/// The content of a field is wrong.
fn field_failure(error: &RunError, path: Option<&Path>) -> Failure {
    let failure = Failure::content(error);
    match path {
        Some(path) => failure.about(path),
        None => failure,
    }
}
