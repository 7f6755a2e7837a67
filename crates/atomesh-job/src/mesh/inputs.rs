//! What a mesh is made from: images of one dimension and one shape, in memory.

use std::path::Path;

use atomesh::image::{Between, Frame, Image, Samples as SampleValues};
use atomesh::run::Inputs;
use atomesh_io::image::{LoadedImage, Meaning, ReadOptions};
use atomesh_io::mesh::World;

use super::phases;
use crate::dimension::Dimension;
use crate::error::JobError;
use crate::images::{self, is_bare, is_placed, scaled, unit_ratio};
use crate::labels;
use crate::memory;
use crate::options::{FrameOptions, RunConfig};
use crate::session::{Note, NoteKind, Session};

/// The image that gives the frame, as read.
#[derive(Clone, Debug)]
pub struct ShownImage<const D: usize> {
    /// The image.
    pub image: Image<D>,
    /// Its world, as [`LoadedImage::world`].
    pub world: World,
}

impl<const D: usize> From<Image<D>> for ShownImage<D> {
    fn from(image: Image<D>) -> Self {
        Self { image, world: World::default() }
    }
}

/// What a field is: how it is read, and what lies between its samples.
#[derive(Clone, Copy, Debug)]
struct FieldKind {
    /// What it is called where it is in memory.
    name: &'static str,
    meaning: Meaning,
    between: Between,
}

impl FieldKind {
    const SIZE: Self = Self::values("size_field", None);
    const WEIGHT: Self = Self::values("beta_field", None);
    const MASK: Self = Self::whole("mask", Meaning::Mask);
    const LABELS: Self = Self::whole("labels", Meaning::Labels);
    /// Outside of its file there are no features.
    const POTENTIAL: Self = Self::values("potential", Some(0.0));

    const fn values(name: &'static str, outside: Option<f64>) -> Self {
        Self { name, meaning: Meaning::Brightness, between: Between::Linear { outside } }
    }

    const fn whole(name: &'static str, meaning: Meaning) -> Self {
        Self { name, meaning, between: Between::Nearest }
    }
}

/// A field in memory, as a file would give it.
#[derive(Clone, Debug)]
pub struct GivenField<const D: usize> {
    /// Its samples, placed by their own frame; a frame of unit steps at 0 says nothing of where they are.
    pub image: Image<D>,
    /// The units of its world's axes; empty if they are those of the image that is meshed.
    pub units: Vec<String>,
}

/// Fields in memory; each goes before the file that options name.
#[derive(Clone, Debug, Default)]
pub struct GivenFields<const D: usize> {
    /// b(x), values −1…1, in place of the image's features.
    pub potential: Option<GivenField<D>>,
    /// d(x), in lattice units.
    pub size_field: Option<GivenField<D>>,
    /// β(x), 0…1.
    pub weight_field: Option<GivenField<D>>,
    /// Where to mesh: nonzero is inside, or, of shares within 0…1, at least one half.
    pub mask: Option<GivenField<D>>,
    /// A label for each sample.
    pub labels: Option<GivenField<D>>,
}

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
    /// The world, as [`LoadedImage::world`].
    pub world: World,
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
            world: World::default(),
        }
    }

    /// An image as read, placed as options say, with the fields that options name.
    ///
    /// # Errors
    /// [`JobError`] if a file cannot be used, or options make no sense.
    pub fn read_fields(
        run: &RunConfig,
        image: impl Into<ShownImage<D>>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Self, JobError> {
        Self::with_fields(run, image, GivenFields::default(), dimension, session)
    }

    /// The same with fields in memory besides.
    ///
    /// # Errors
    /// As [`MeshImages::read_fields`].
    pub fn with_fields(
        run: &RunConfig,
        image: impl Into<ShownImage<D>>,
        given: GivenFields<D>,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Self, JobError> {
        let ShownImage { image, mut world } = image.into();
        let input = &run.input;
        let shown = input.shown();
        let of = Samples::of(&image, world.units.clone(), run).map_err(|e| e.about_any(shown))?;
        // who says where it is says it in a plane
        let FrameOptions { spacing, origin, direction, y_up, .. } = &run.frame;
        let is_placed = spacing.is_some() || origin.is_some() || direction.is_some();
        world.standing = world.standing.filter(|_| !is_placed && *y_up != Some(true));
        let image = images::place(image, &run.frame, shown, session)?;
        run.mesh_options::<D>()?;
        // what makes b is forecast where it is made
        memory::check_potential(image.samples().len(), 4.0, "mesh")
            .map_err(|e| e.about_any(shown))?;
        let mut field = |given: Option<GivenField<D>>, path: Option<&Path>, kind: FieldKind| {
            let source = match (given, path) {
                (Some(given), _) => FieldSource::of(given, &kind, session)?,
                (None, Some(path)) => FieldSource::read(run, path, &kind, dimension, session)?,
                (None, None) => return Ok(None),
            };
            source.in_place(run, &of, kind.between, session).map(Some)
        };
        let size_field = field(given.size_field, input.size_field.as_deref(), FieldKind::SIZE)?;
        let weight = input.beta_field.as_deref();
        let weight_field = field(given.weight_field, weight, FieldKind::WEIGHT)?;
        let mask = field(given.mask, input.mask_file(), FieldKind::MASK)?;
        let labels = field(given.labels, input.labels.as_deref(), FieldKind::LABELS)?;
        if labels.is_some() && run.regions.threshold.is_some() {
            return Err(JobError::misuse("--labels and --threshold; expected one of them"));
        }
        // without IMAGE, the potential is the image
        let is_beside = input.image.is_some() || given.potential.is_some();
        let beside = input.potential.as_deref().filter(|_| is_beside);
        let potential = field(given.potential, beside, FieldKind::POTENTIAL)?;
        let is_potential = input.potential.is_some() && potential.is_none();
        let mask = match input.masks_absent() {
            true => live_mask(&image, shown, session),
            false => mask,
        };
        let labels = match phases::by_thresholds(run, &image, session)? {
            Some(phases) => Some(phases),
            None => labels,
        };
        let mask = phases::without_voids(run, mask, labels.as_ref(), session)?;
        let size_field = phases::sizes(run, size_field, labels.as_ref(), session)?;
        Ok(Self { image, is_potential, potential, size_field, weight_field, mask, labels, world })
    }

    /// Takes fields in memory in place of those that there are; the image is in place already.
    ///
    /// # Errors
    /// [`JobError`] if one does not lie over the image.
    pub fn take_given(
        &mut self,
        run: &RunConfig,
        given: GivenFields<D>,
        session: &mut Session<'_>,
    ) -> Result<(), JobError> {
        let none = RunConfig { frame: FrameOptions::default(), ..run.clone() };
        let of = Samples::of(&self.image, self.world.units.clone(), &none)?;
        let mut field = |given: Option<GivenField<D>>, kind: FieldKind| {
            let source = given.map(|given| FieldSource::of(given, &kind, session)).transpose()?;
            source.map(|s| s.in_place(&none, &of, kind.between, session)).transpose()
        };
        let potential = field(given.potential, FieldKind::POTENTIAL)?;
        let size_field = field(given.size_field, FieldKind::SIZE)?;
        let weight_field = field(given.weight_field, FieldKind::WEIGHT)?;
        let mask = field(given.mask, FieldKind::MASK)?;
        let labels = field(given.labels, FieldKind::LABELS)?;
        self.potential = potential.or(self.potential.take());
        self.size_field = size_field.or(self.size_field.take());
        self.weight_field = weight_field.or(self.weight_field.take());
        self.mask = mask.or(self.mask.take());
        self.labels = labels.or(self.labels.take());
        Ok(())
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

/// The name of the image that gives the frame, without its folder, which reports do not hold.
fn name(run: &RunConfig) -> String {
    let name = |path: &Path| path.file_name().unwrap_or(path.as_os_str()).display().to_string();
    run.input.shown().map_or("the image".into(), name)
}

/// Reads the image that gives the frame.
///
/// # Errors
/// [`JobError`] if options name none, or the file cannot be used.
pub fn read_shown(run: &RunConfig, session: &mut Session<'_>) -> Result<LoadedImage, JobError> {
    images::read(shown(run)?, &run.frame.read_options_for(meaning(run))?, session)
}

/// What the values of the image that gives the frame mean: labels, where it is that of the labels, or the boundaries
/// between its values are the features.
fn meaning(run: &RunConfig) -> Meaning {
    let input = &run.input;
    let is_labels = match (&input.image, &input.potential, &input.labels) {
        (None, None, Some(_)) => true,
        (Some(_), None, None) => run.features.are_labels() && run.regions.threshold.is_none(),
        _ => false,
    };
    if is_labels { Meaning::Labels } else { Meaning::Brightness }
}

/// The file of the image that gives the frame.
pub(crate) fn shown(run: &RunConfig) -> Result<&Path, JobError> {
    let nothing = || JobError::misuse("nothing to mesh; expected IMAGE, or --potential FILE");
    run.input.shown().ok_or_else(nothing)
}

/// The samples of the image that gives the frame, before any of them are cropped.
struct Samples<const D: usize> {
    /// Where the file says that they are.
    own: Frame<D>,
    /// Where they are with what options say.
    placed: Frame<D>,
    /// Whether the file or an option says so at all.
    is_placed: bool,
    /// The units of the world's axes.
    units: Vec<String>,
}

impl<const D: usize> Samples<D> {
    fn of(image: &Image<D>, units: Vec<String>, run: &RunConfig) -> Result<Self, JobError> {
        let own = *image.frame();
        let placed = run.frame.apply(own)?;
        let says_where = match run.input.shown() {
            Some(path) => is_placed(path, &own),
            None => !is_bare(&own),
        };
        let is_placed = placed != own || says_where;
        Ok(Self { own, placed, is_placed, units })
    }
}

/// 1 where the image has data; `None` with a note if it has data everywhere.
fn live_mask<const D: usize>(
    image: &Image<D>,
    shown: Option<&Path>,
    session: &mut Session<'_>,
) -> Option<Image<D>> {
    let Some(absent) = image.absent() else {
        let text = "all samples have data; --mask live leaves nothing out".into();
        session.note(Note { kind: NoteKind::Change, file: shown.map(Path::to_path_buf), text });
        return None;
    };
    let live = absent.iter().map(|&is_absent| u8::from(!is_absent)).collect();
    let mask = Image::new(*image.frame(), SampleValues::U8(live));
    Some(mask.expect("the image has a flag for each sample"))
}

/// A field, and what is known of where it comes from.
struct FieldSource<'a, const D: usize> {
    /// Its file, or its name where it is in memory.
    file: &'a Path,
    image: Image<D>,
    units: Vec<String>,
    /// Whether it says where its samples are.
    is_placed: bool,
}

impl<'a, const D: usize> FieldSource<'a, D> {
    /// A field in memory.
    fn of(
        given: GivenField<D>,
        kind: &FieldKind,
        session: &mut Session<'_>,
    ) -> Result<Self, JobError> {
        let GivenField { mut image, units } = given;
        let file = Path::new(kind.name);
        if kind.meaning == Meaning::Labels {
            let (whole, odd) = labels::of_image(image)?;
            image = whole;
            for odd in odd {
                let (kind, text) = (odd.kind(), odd.text());
                session.note(Note { kind, file: Some(file.into()), text });
            }
        }
        let is_placed = !is_bare(image.frame());
        Ok(Self { file, image, units, is_placed })
    }

    /// Reads an image that belongs to the samples of the first.
    fn read(
        run: &RunConfig,
        path: &'a Path,
        kind: &FieldKind,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Self, JobError> {
        let options = ReadOptions { raw: None, ..run.frame.read_options_for(kind.meaning)? };
        let LoadedImage { image: any, units, .. } = images::read(path, &options, session)?;
        let found = any.dimension();
        let Some(image) = (dimension.image)(any) else {
            let message = format!("has {found} axes; expected {D}, as {}", name(run));
            return Err(JobError::content(message).about(path));
        };
        let is_placed = is_placed(path, image.frame());
        Ok(Self { file: path, image, units, is_placed })
    }

    /// The field at the samples of the first image, by its own frame where it has one, else by its shape. The box of
    /// interest is taken.
    fn in_place(
        self,
        run: &RunConfig,
        of: &Samples<D>,
        between: Between,
        session: &mut Session<'_>,
    ) -> Result<Image<D>, JobError> {
        let Self { file, image: mut field, units, is_placed } = self;
        let mut say = |is_warning: bool, text: String| {
            let kind = if is_warning { NoteKind::Warning } else { NoteKind::Change };
            session.note(Note { kind, file: Some(file.into()), text });
        };
        if let Some((ratio, text)) = unit_ratio(&units, &of.units).filter(|_| is_placed) {
            let scaled = scaled(field.frame(), ratio)?;
            field = field.with_frame(scaled).map_err(JobError::content)?;
            say(false, text);
        }
        let field = onto(field, is_placed, run, of, between, &mut say);
        let field = field.map_err(|e| e.about(file))?;
        note_filled(&field, run, file, session);
        run.frame.place(field).map_err(|e| e.about(file))
    }
}

/// Says how many samples of a field get the value of `--fill`.
fn note_filled<const D: usize>(
    field: &Image<D>,
    run: &RunConfig,
    path: &Path,
    session: &mut Session<'_>,
) {
    let count = field.samples().range().nan_count;
    if let Some(fill) = run.frame.fill.filter(|_| count > 0) {
        let text = format!("{count} samples are NaN; they become {fill}");
        session.note(Note { kind: NoteKind::Change, file: Some(path.into()), text });
    }
}

/// The field at the samples of the image.
fn onto<const D: usize>(
    field: Image<D>,
    is_placed: bool,
    run: &RunConfig,
    of: &Samples<D>,
    between: Between,
    say: &mut dyn FnMut(bool, String),
) -> Result<Image<D>, JobError> {
    let (own, image) = (*field.frame(), name(run));
    if !(is_placed && of.is_placed) {
        let (found, expected) = (own.shape(), of.own.shape());
        if found != expected {
            let message =
                format!("has {found:?} samples (x first); expected {expected:?}, as {image}");
            return Err(JobError::content(message));
        }
        if is_placed != of.is_placed {
            let lacking = if is_placed { image.as_str() } else { "the file" };
            say(
                false,
                format!("{lacking} does not say where its samples are; they are taken one by one"),
            );
        }
        return field.with_frame(of.own).map_err(JobError::content);
    }
    // options move the image, and what lies where it lay with it; what lies where they put it stays
    let order = [of.placed, of.own].iter().find_map(|frame| frame.order_in(&own));
    if let Some(order) = order {
        if !order.is_same() {
            let axis = |k: usize| {
                let sign = if order.is_flipped[k] { "-" } else { "" };
                format!("{sign}{}", ["x", "y", "z"][order.axes[k]])
            };
            let axes = (0..D).map(axis).collect::<Vec<_>>().join(",");
            say(
                false,
                format!(
                    "the axes of {image} run along {axes} of the file's; samples are reordered"
                ),
            );
        }
        return Ok(field.reordered(&of.own, order));
    }
    let (placed, outside) = field.resampled(&of.placed, between);
    let all = of.placed.sample_count();
    if outside == all {
        let (own, placed) = (own.world_box(), of.placed.world_box());
        let message =
            format!("lies in {own}, all of it outside of {image}, which lies in {placed}");
        return Err(JobError::content(message));
    }
    let how = match between {
        Between::Nearest => "the nearest sample is taken",
        Between::Linear { .. } => "values are linear between samples",
    };
    let rest = match (outside, between) {
        (0, _) => String::new(),
        (_, Between::Linear { outside: None }) => {
            format!(
                "; {outside} of {all} samples lie outside of the file and take its nearest value"
            )
        }
        _ => format!("; {outside} of {all} samples lie outside of the file and are 0"),
    };
    // half of the image without anything is more likely a mistake
    say(2 * outside > all, format!("has other samples than {image}: {how}{rest}"));
    let samples = placed.into_parts().1;
    Image::new(of.own, samples).map_err(JobError::content)
}
