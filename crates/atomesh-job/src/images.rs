//! Reading images.

use std::path::Path;

use atomesh::image::{Frame, Image};
use atomesh::watch::Watch;
use atomesh_io::image::{
    AnyImage, ImageFormat, LoadedImage, ReadError, ReadNote, ReadOptions, ReadReason, SampleFormat,
    load_image,
};

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::memory;
use crate::options::FrameOptions;
use crate::session::{Note, Session};

/// Reads an image, unless its file alone is larger than the memory available.
///
/// # Errors
/// [`JobError`] if the file cannot be read or is not what its name says, or the watch ends the work.
pub fn load(
    path: &Path,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<LoadedImage, JobError> {
    memory::check_file(path).map_err(|e| e.advise("crop or resample the image first"))?;
    load_image(path, options, watch).map_err(refusal)
}

fn refusal(error: ReadError) -> JobError {
    let ReadError { path, reason, .. } = error;
    match reason {
        ReadReason::Cancelled(_) => JobError::cancelled(),
        ReadReason::Io(_) | ReadReason::DataFile { .. } => JobError::file(&reason),
        ReadReason::UnknownExtension { .. } => JobError::misuse(&reason)
            .advise("rename the file, or describe raw samples by --shape and --dtype"),
        ReadReason::NoRawLayout => JobError::misuse("raw samples say neither shape nor type")
            .advise("give --shape NX,NY[,NZ] and --dtype TYPE"),
        ReadReason::SparseTraces { .. } | ReadReason::NoLine { .. } => JobError::content(&reason)
            .advise("--trace-bytes INLINE,XLINE says where numbers are; one byte twice makes a line"),
        ReadReason::DuplicateTraces { .. } => JobError::content(&reason).advise(
            "--trace-bytes INLINE,XLINE says where, if their numbers are elsewhere; else remove one of them",
        ),
        ReadReason::DataOutside { .. } => JobError::content(&reason)
            .advise("--data-root DIR allows files in DIR and below"),
        ReadReason::Memory { .. } => {
            JobError::memory(&reason).advise("crop or resample the image first")
        }
        ReadReason::TraceFormat { .. } => JobError::content(&reason)
            .advise("--sample-format says how samples are written, if the header does not"),
        ReadReason::RawSize { .. } | ReadReason::RawShape { .. } => JobError::misuse(&reason),
        _ => JobError::content(&reason),
    }
    .about(&path)
}

/// Reads an image; what its reader took for granted becomes notes.
///
/// # Errors
/// As [`load`].
pub fn read(
    path: &Path,
    options: &ReadOptions,
    session: &mut Session<'_>,
) -> Result<AnyImage, JobError> {
    let loaded = load(path, options, session)?;
    for note in &loaded.notes {
        let (is_warning, file) = (note.is_warning(), Some(path.into()));
        session.note(Note { is_warning, file, text: words(note) });
    }
    Ok(loaded.image)
}

/// A reader's note, with the option that decides otherwise where there is one.
pub fn words(note: &ReadNote) -> String {
    let advice = match note {
        ReadNote::SampleFormat { other: SampleFormat::Ibm, .. } => {
            "--sample-format ibm reads them so"
        }
        ReadNote::SampleFormat { .. } => "--sample-format ieee reads them so",
        ReadNote::IntervalsDiffer { .. } | ReadNote::NegativeInterval { .. } => {
            "--spacing says otherwise"
        }
        ReadNote::TimeScalar { .. } => "--origin says otherwise",
        _ => return note.to_string(),
    };
    format!("{note} ({advice})")
}

/// What an image that is read for a mesh is to the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageRole {
    /// What the mesh follows: it lies where the mesh's image did, and NaN samples are an error.
    Followed,
    /// A property that its cells get: a frame of its own counts, and NaN samples are none.
    Property,
}

/// A mesh for which images are read.
#[derive(Clone, Copy, Debug)]
pub struct Beside<'a, const D: usize> {
    /// The frame of the image that the mesh follows, if it is known; for images of its shape.
    pub frame: Option<&'a Frame<D>>,
    /// The options of the frame, which go before all.
    pub options: &'a FrameOptions,
    /// What the image is to the mesh.
    pub role: ImageRole,
}

impl<const D: usize> Beside<'_, D> {
    /// Reads the image and places it.
    ///
    /// # Errors
    /// [`JobError`] as [`load`], and if the image has another dimension or the options do not fit it.
    pub fn read(
        &self,
        path: &Path,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Image<D>, JobError> {
        let any = read(path, &self.options.read_options()?, session)?;
        let axes = any.dimension();
        let Some(image) = (dimension.image)(any) else {
            let message = format!("has {axes} axes; the mesh is made of {}", dimension.cells);
            return Err(JobError::content(message).about(path));
        };
        let has_frame = ImageFormat::of(path).is_some_and(ImageFormat::has_frame);
        self.place(image, has_frame).map_err(|e| e.about(path))
    }

    fn place(&self, image: Image<D>, has_frame: bool) -> Result<Image<D>, JobError> {
        let keeps_own = has_frame && self.role == ImageRole::Property;
        let known = self.frame.filter(|f| !keeps_own && f.shape() == image.frame().shape());
        let frame = *known.unwrap_or(image.frame());
        let image = image.with_frame(frame).map_err(JobError::content)?;
        match self.role {
            ImageRole::Followed => self.options.place(image),
            ImageRole::Property => self.options.place_as_is(image),
        }
    }
}

/// Whether pictures show z upwards: it grows that way in the image's format, and along its last axis.
pub(crate) fn is_z_up<const D: usize>(path: Option<&Path>, frame: &Frame<D>) -> bool {
    let format = path.and_then(ImageFormat::of);
    format.is_some_and(ImageFormat::z_is_height) && frame.direction()[D - 1][D - 1] > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_and_refusals_name_the_option_that_decides_otherwise() {
        let note = ReadNote::TimeScalar { trace: 1, scalar: 37 };
        assert_eq!(words(&note), format!("{note} (--origin says otherwise)"));
        assert_eq!(words(&ReadNote::Feet), ReadNote::Feet.to_string());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.nhdr");
        let text =
            "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 2 2\nencoding: raw\ndata file: ../b\n";
        std::fs::write(&path, text).unwrap();
        let error = load(&path, &ReadOptions::default(), &mut atomesh::watch::Silent).unwrap_err();
        assert!(error.advice().is_some_and(|advice| advice.contains("--data-root")), "{error}");
    }
}
