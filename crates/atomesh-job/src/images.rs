//! Reading images.

use std::path::Path;

use atomesh::image::{Frame, Image, Samples};
use atomesh::watch::Watch;
use atomesh_io::image::{
    ImageFormat, LoadedImage, Meaning, ReadError, ReadNote, ReadOptions, ReadReason, SampleFormat,
    SeriesError, load_image, metres,
};
use atomesh_io::mesh::Provenance;

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::labels;
use crate::memory;
use crate::options::FrameOptions;
use crate::session::{Note, NoteKind, Session};

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
        ReadReason::Io(ref error) | ReadReason::DataFile { ref error, .. } => {
            JobError::file(&reason).by_system(error)
        }
        ReadReason::UnknownExtension { .. } => JobError::misuse(&reason)
            .advise("rename the file, or describe raw samples by --shape and --dtype"),
        ReadReason::NoRawLayout => JobError::misuse("raw samples say neither shape nor type")
            .advise("give --shape NX,NY[,NZ] and --dtype TYPE"),
        ReadReason::SparseTraces { .. } | ReadReason::NoLine { .. } => JobError::content(&reason)
            .advise("--trace-bytes INLINE,XLINE says where numbers are; one byte twice makes a line"),
        ReadReason::DuplicateTraces { .. } => JobError::content(&reason).advise(
            "--trace-bytes INLINE,XLINE says where, if their numbers are elsewhere; else --duplicates first or \
             last keeps one of them",
        ),
        ReadReason::TruncatedTraces { .. } => JobError::content(&reason)
            .advise("--truncated reads the whole traces; the header may be wrong about their length, too"),
        ReadReason::Volumes { count, .. } => {
            JobError::misuse(&reason).advise(format!("--volume N, 1 to {count}, chooses one"))
        }
        ReadReason::Arrays { .. } => {
            JobError::misuse(&reason).advise("--array NAME chooses one")
        }
        ReadReason::Segments { .. } => {
            JobError::misuse(&reason).advise("--segment NAME or its number chooses one")
        }
        ReadReason::Sheared { .. } => JobError::content(&reason).advise(
            "resample the image, or give --direction M11,M12,... with axes at right angles",
        ),
        ReadReason::DataOutside { .. } => JobError::content(&reason)
            .advise("--data-root DIR allows files in DIR and below"),
        ReadReason::Memory { .. } => {
            JobError::memory(&reason).advise("crop or resample the image first")
        }
        ReadReason::TraceFormat { .. } => JobError::content(&reason)
            .advise("--sample-format says how samples are written, if the header does not"),
        ReadReason::ColourLabels { .. } => JobError::content(&reason)
            .advise("--labels-by-color makes a label of each colour"),
        ReadReason::Stack { channels, times, .. } => {
            let part = |name: &str, count: usize| format!("--{name} N, 1 to {count}");
            let parts = [("channel", channels), ("time", times)].into_iter();
            let parts: Vec<_> = parts.filter(|(_, n)| *n > 1).map(|(s, n)| part(s, n)).collect();
            JobError::misuse(&reason).advise(format!("{}, chooses one", parts.join(" and ")))
        }
        ReadReason::Series(ref series)
            if matches!(
                **series,
                SeriesError::SeveralSeries { .. } | SeriesError::NoSuchSeries { .. }
            ) =>
        {
            JobError::misuse(&reason)
                .advise("--series SERIES chooses one, by its UID, its number or its description")
        }
        ReadReason::Series(ref series) if matches!(**series, SeriesError::Gap { .. }) => {
            JobError::content(&reason)
                .advise("--spacing SX,SY,SZ takes the slices as evenly spaced, if none is missing")
        }
        ReadReason::Series(ref series) if matches!(**series, SeriesError::Missing { .. }) => {
            JobError::content(&reason).advise(
                "--spacing SX,SY,SZ gives the spacing, and puts slices without a position in the order of \
                 their instance numbers; --origin and --direction place them",
            )
        }
        ReadReason::RawSize { .. } | ReadReason::RawShape { .. } => JobError::misuse(&reason),
        _ => JobError::content(&reason),
    }
    .about(&path)
}

/// Reads an image; what its reader took for granted becomes notes. Labels near to whole numbers are rounded.
///
/// # Errors
/// As [`load`].
pub fn read(
    path: &Path,
    options: &ReadOptions,
    session: &mut Session<'_>,
) -> Result<LoadedImage, JobError> {
    let mut loaded = load(path, options, session)?;
    let said = loaded.notes.iter().map(|note| (note.into(), words(note)));
    let mut said: Vec<(NoteKind, String)> = said.collect();
    if matches!(options.meaning, Meaning::Labels | Meaning::LabelsByColour) {
        let (image, odd) = labels::whole(loaded.image)?;
        loaded.image = image;
        said.extend(odd.into_iter().map(|odd| (odd.kind(), odd.text())));
    }
    for (kind, text) in said {
        let note = Note { kind, file: Some(path.into()), text };
        // a file that is read twice says the same
        if !session.notes().contains(&note) {
            session.note(note);
        }
    }
    Ok(loaded)
}

/// How long a unit is in another, if both are known lengths and differ.
pub(crate) fn unit_ratio(units: &[String], others: &[String]) -> Option<(f64, String)> {
    let one = |units: &[String]| {
        let first = units.first()?;
        units.iter().all(|unit| unit == first).then(|| first.clone())
    };
    let (unit, other) = (one(units)?, one(others)?);
    let ratio = metres(&unit)? / metres(&other)?;
    (unit != other).then(|| (ratio, format!("coordinates are turned from {unit} to {other}")))
}

/// A frame in a unit so much smaller than its own.
pub(crate) fn scaled<const D: usize>(frame: &Frame<D>, ratio: f64) -> Result<Frame<D>, JobError> {
    let spacing = frame.spacing().map(|s| s * ratio);
    let origin = frame.origin().map(|x| x * ratio);
    let placed = frame.with_spacing(spacing).and_then(|frame| frame.with_origin(origin));
    placed.map_err(JobError::content)
}

/// Whether a file says where its samples are: a frame of unit steps at 0 is that of headers that say nothing.
pub(crate) fn is_placed<const D: usize>(path: &Path, frame: &Frame<D>) -> bool {
    ImageFormat::of(path).is_some_and(ImageFormat::has_frame) && !is_bare(frame)
}

/// Whether a frame is that of samples of which nothing is known but their number: unit steps, the first at 0.
pub fn is_bare<const D: usize>(frame: &Frame<D>) -> bool {
    Frame::new(frame.shape()).as_ref() == Ok(frame)
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

/// The image in the frame of the options, cropped, without NaN; a note says what was put in its place.
///
/// # Errors
/// [`JobError`] if the options do not fit the image, or samples are NaN and there is no value for them.
pub(crate) fn place<const D: usize>(
    image: Image<D>,
    options: &FrameOptions,
    file: Option<&Path>,
    session: &mut Session<'_>,
) -> Result<Image<D>, JobError> {
    let nan = options.fill.map(|fill| (fill, image.samples().range().nan_count));
    if let Some((fill, count)) = nan.filter(|(_, count)| *count > 0) {
        let text = format!(
            "{count} samples are NaN: they count as places without data, and where a value is needed it is {fill}"
        );
        session.note(Note { kind: NoteKind::Change, file: file.map(Path::to_path_buf), text });
    }
    options.place(image).map_err(|e| e.about_any(file))
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
    /// The mesh's provenance, which knows the units of the world.
    pub provenance: Option<&'a Provenance>,
    /// The options of the frame, which go before all.
    pub options: &'a FrameOptions,
    /// What the image is to the mesh.
    pub role: ImageRole,
}

impl<const D: usize> Beside<'_, D> {
    /// Reads an image of grey values and places it.
    ///
    /// # Errors
    /// [`JobError`] as [`load`], and if the image has another dimension or the options do not fit it.
    pub fn read(
        &self,
        path: &Path,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Image<D>, JobError> {
        self.read_as(Meaning::Brightness, path, dimension, session)
    }

    /// Reads an image whose values mean that, and places it.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_as(
        &self,
        meaning: Meaning,
        path: &Path,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Image<D>, JobError> {
        let LoadedImage { image: any, units, .. } =
            read(path, &self.options.read_options_for(meaning)?, session)?;
        let axes = any.dimension();
        let Some(mut image) = (dimension.image)(any) else {
            let message = format!("has {axes} axes; the mesh is made of {}", dimension.cells);
            return Err(JobError::content(message).about(path));
        };
        let own = *image.frame();
        let format = ImageFormat::of(path);
        let has_frame = format.is_some_and(ImageFormat::always_has_frame) || is_placed(path, &own);
        let world = self.provenance.map_or(&[][..], |provenance| &provenance.units);
        if let Some((ratio, text)) = unit_ratio(&units, world).filter(|_| has_frame) {
            image = image.with_frame(scaled(&own, ratio)?).map_err(JobError::content)?;
            session.note(Note { kind: NoteKind::Change, file: Some(path.into()), text });
        }
        self.place(image, has_frame, path, session)
    }

    fn place(
        &self,
        image: Image<D>,
        has_frame: bool,
        path: &Path,
        session: &mut Session<'_>,
    ) -> Result<Image<D>, JobError> {
        let keeps_own = has_frame && self.role == ImageRole::Property;
        let known = self.frame.filter(|f| !keeps_own && f.shape() == image.frame().shape());
        let frame = *known.unwrap_or(image.frame());
        let image = image.with_frame(frame).map_err(|e| JobError::content(e).about(path))?;
        match self.role {
            ImageRole::Followed => place(image, self.options, Some(path), session),
            ImageRole::Property => {
                self.options.place_as_is(blank(image)).map_err(|e| e.about(path))
            }
        }
    }
}

/// The image with NaN where it has no data.
fn blank<const D: usize>(image: Image<D>) -> Image<D> {
    let Some(absent) = image.absent().map(<[bool]>::to_vec) else { return image };
    let (frame, samples) = image.into_parts();
    let mut values: Vec<f64> = (0..samples.len()).map(|i| samples.get(i)).collect();
    values.iter_mut().zip(absent).filter(|(_, a)| *a).for_each(|(v, _)| *v = f64::NAN);
    Image::new(frame, Samples::F64(values.into())).expect("there are as many samples as before")
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
