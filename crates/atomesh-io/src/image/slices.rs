//! A folder of slices, an image file for each, in the order of the numbers in their names: s2 comes before s10.
//!
//! A folder is read so if it holds files that are named as pictures and none of DICOM. All must be of one kind, shape
//! and type; others are refused by name. Spacing along x and y is that of the files, where they state one; how far apart
//! slices are no file says, so that it is 1, with a warning, unless the caller gives it. Hidden files are passed over.

use std::cmp::Ordering;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use atomesh::image::{Frame, Image, Samples};
use atomesh::watch::{Phase, Watch};

use super::any_image::AnyImage;
use super::channels::append;
use super::codec::{Codec, Folder, Source};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::options::ReadOptions;
use super::shape::shape_text;

const FORMAT: ImageFormat = ImageFormat::named("a folder of slices");

pub(super) const CODEC: Codec = Codec {
    has_frame: true,
    frame_is_optional: true,
    folder: Some(Folder { is_part: is_slices, read: read_folder }),
    ..Codec::reading(FORMAT, |_: Source| {
        Err(ReadReason::Io(std::io::ErrorKind::NotADirectory.into()))
    })
};

/// The formats of slices.
const KINDS: [ImageFormat; 4] =
    [ImageFormat::TIFF, ImageFormat::PNG, ImageFormat::JPEG, ImageFormat::PNM];

/// The most colours that a note lists, by which labels of different slices can be compared.
const LISTED_COLOURS: usize = 20;

/// A file of a folder.
struct Slice {
    name: String,
    path: PathBuf,
    kind: ImageFormat,
}

/// The slices of a folder in order, and the names of its other files.
struct Found {
    slices: Vec<Slice>,
    others: Vec<PathBuf>,
}

impl Found {
    fn of(folder: &Path) -> Result<Self, ReadReason> {
        let (mut slices, mut others) = (Vec::new(), Vec::new());
        for entry in fs::read_dir(folder).map_err(ReadReason::Io)? {
            let entry = entry.map_err(ReadReason::Io)?;
            let (path, name) = (entry.path(), entry.file_name());
            let name = name.to_string_lossy().into_owned();
            // links are followed
            if name.starts_with('.') || !path.is_file() {
                continue;
            }
            match ImageFormat::from_path(&path).filter(|kind| KINDS.contains(kind)) {
                Some(kind) => slices.push(Slice { name, path, kind }),
                None => others.push(path),
            }
        }
        slices.sort_by(|a, b| natural(&a.name, &b.name));
        others.sort();
        Ok(Self { slices, others })
    }
}

/// Whether what is at a path is a folder of slices, and not one of DICOM with a picture beside.
fn is_slices(path: &Path) -> bool {
    let is_dicom = |path: &PathBuf| ImageFormat::of(path) == Some(ImageFormat::DICOM);
    path.is_dir()
        && Found::of(path)
            .is_ok_and(|found| !found.slices.is_empty() && !found.others.iter().any(is_dicom))
}

/// Compares names by the numbers in them, and else letter by letter.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (parts(a).into_iter(), parts(b).into_iter());
    loop {
        let order = match (left.next(), right.next()) {
            (None, None) => return a.cmp(b),
            (None, Some(_)) => return Ordering::Less,
            (Some(_), None) => return Ordering::Greater,
            (Some(x), Some(y)) => match (number(x), number(y)) {
                (Some(x), Some(y)) => x.len().cmp(&y.len()).then(x.cmp(y)),
                _ => x.cmp(y),
            },
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

/// The runs of digits in a name, and what is between them.
fn parts(name: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    let mut rest = name;
    while let Some(first) = rest.chars().next() {
        let is_digit = first.is_ascii_digit();
        let end = rest.find(|c: char| c.is_ascii_digit() != is_digit).unwrap_or(rest.len());
        let (part, behind) = rest.split_at(end);
        parts.push(part);
        rest = behind;
    }
    parts
}

/// The digits of a number without zeros before them; none if it is no number.
fn number(part: &str) -> Option<&str> {
    part.starts_with(|c: char| c.is_ascii_digit()).then(|| part.trim_start_matches('0'))
}

/// The last number in a name, without its ending, and what comes before and behind.
fn last_number(name: &str) -> Option<(String, i64, String)> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let parts = parts(stem);
    let at = parts.iter().rposition(|part| number(part).is_some())?;
    Some((parts[..at].concat(), parts[at].parse().ok()?, parts[at + 1..].concat()))
}

/// The first place where the numbers in names do not go on by the least step between them.
fn gap(slices: &[Slice]) -> Option<ReadNote> {
    let numbers: Option<Vec<_>> = slices.iter().map(|slice| last_number(&slice.name)).collect();
    let numbers =
        numbers.filter(|all| all.iter().all(|n| (&n.0, &n.2) == (&all[0].0, &all[0].2)))?;
    let steps = || numbers.windows(2).map(|pair| pair[1].1.saturating_sub(pair[0].1));
    let least = steps().filter(|&step| step > 0).min()?;
    let at = steps().position(|step| step != least)?;
    let name = |k: usize| slices[k].name.clone();
    Some(ReadNote::SliceNumbers { before: name(at), after: name(at + 1) })
}

/// Passes on what a watch is told of a part of the work.
struct Share<'a> {
    watch: &'a mut dyn Watch,
    part: usize,
    count: usize,
}

impl Watch for Share<'_> {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        self.watch.step(phase, (self.part as f64 + done) / self.count as f64, energy)
    }
}

/// Reads the slices of a folder, one after another.
fn read_folder(
    folder: &Path,
    options: &ReadOptions,
    watch: &mut dyn Watch,
) -> Result<LoadedImage, ReadReason> {
    let Found { slices, others } = Found::of(folder)?;
    check_kinds(&slices)?;
    let memory = Memory::up_to(options.memory_limit);
    let mut stack: Option<Stack> = None;
    for (part, slice) in slices.iter().enumerate() {
        let mut share = Share { watch: &mut *watch, part, count: slices.len() };
        let loaded = super::load(&slice.path, options, &mut share)
            .map_err(|reason| in_file(slice, reason))?;
        match &mut stack {
            None => stack = Some(Stack::new(slice, loaded, slices.len(), memory)?),
            Some(stack) => stack.push(slice, loaded, options.given.spacing)?,
        }
    }
    let mut loaded = stack.ok_or(ReadReason::Empty { format: FORMAT })?.finish(slices.len())?;
    if let [first, .., last] = &slices[..] {
        let (first, last, count) = (first.name.clone(), last.name.clone(), slices.len());
        loaded.notes.insert(0, ReadNote::Slices { first, last, count });
    }
    let left_out = others.first().map(|first| ReadNote::OtherFiles {
        count: others.len(),
        first: first.file_name().unwrap_or_default().to_string_lossy().into_owned(),
    });
    Ok(loaded.noting(gap(&slices)).noting(left_out))
}

fn check_kinds(slices: &[Slice]) -> Result<(), ReadReason> {
    let count = |kind: ImageFormat| slices.iter().filter(|slice| slice.kind == kind).count();
    let found = KINDS.map(|kind| (kind, count(kind))).into_iter().filter(|(_, count)| *count > 0);
    let found: Vec<_> = found.map(|(kind, count)| format!("{count} of {kind}")).collect();
    match found.len() {
        ..2 => Ok(()),
        _ => Err(ReadReason::MixedSlices { found: found.join(", ") }),
    }
}

/// The error of a file in the folder.
fn in_file(slice: &Slice, reason: ReadReason) -> ReadReason {
    match reason {
        ReadReason::Cancelled(_) => reason,
        _ => ReadReason::Slice { file: slice.name.clone(), reason: Box::new(reason) },
    }
}

/// The slices that were read.
struct Stack {
    /// The first one's name, and its frame.
    first: (String, Frame<2>),
    samples: Samples,
    units: Vec<String>,
    notes: Vec<ReadNote>,
    count: usize,
    memory: Memory,
}

impl Stack {
    fn new(
        slice: &Slice,
        loaded: LoadedImage,
        count: usize,
        memory: Memory,
    ) -> Result<Self, ReadReason> {
        let LoadedImage { image, units, notes } = loaded;
        let (frame, samples) = flat(slice, image)?;
        let bytes = samples.type_name().parse().map_or(8, super::SampleType::size);
        let count = samples.len().saturating_mul(count);
        memory.check(count as u128 * bytes as u128)?;
        check_colours(&notes, None)?;
        Ok(Self { first: (slice.name.clone(), frame), samples, units, notes, count, memory })
    }

    fn push(
        &mut self,
        slice: &Slice,
        loaded: LoadedImage,
        has_spacing: bool,
    ) -> Result<(), ReadReason> {
        let (frame, samples) = flat(slice, loaded.image)?;
        let (name, first) = &self.first;
        let alike = frame.shape() == first.shape()
            && samples.type_name() == self.samples.type_name()
            && (has_spacing || frame.spacing() == first.spacing() && loaded.units == self.units);
        if !alike {
            return Err(ReadReason::OtherSlice {
                file: slice.name.clone(),
                found: text(&frame, &samples, &loaded.units),
                expected: format!("{}, as {name} does", text(first, &self.samples, &self.units)),
            });
        }
        check_colours(&loaded.notes, Some(&self.notes))?;
        let known = self.notes.clone();
        self.notes.extend(loaded.notes.into_iter().filter(|note| !known.contains(note)));
        let all = std::mem::replace(&mut self.samples, Samples::U8(Vec::new().into()));
        let mut volume = Some(all);
        append(&mut volume, samples, self.count, self.memory)?;
        self.samples = volume.unwrap_or(Samples::U8(Vec::new().into()));
        Ok(())
    }

    /// The volume; of a single slice the flat image.
    fn finish(self, count: usize) -> Result<LoadedImage, ReadReason> {
        let Self { first: (_, frame), samples, mut units, notes, .. } = self;
        let ([nx, ny], [x, y]) = (frame.shape(), frame.spacing());
        if count == 1 {
            let image = AnyImage::Flat(Image::new(frame, samples)?);
            return Ok(LoadedImage { image, units, notes });
        }
        let frame = Frame::new([nx, ny, count])?.with_spacing([x, y, 1.0])?;
        let image = AnyImage::Volume(Image::new(frame, samples)?);
        let unit = units.first().cloned().unwrap_or_default();
        units.extend(units.first().cloned());
        let note = ReadNote::NoPlaneSpacing { spacing: 1.0, unit };
        Ok(LoadedImage { image, units, notes }.noting(note))
    }
}

/// A flat image's parts.
fn flat(slice: &Slice, image: AnyImage) -> Result<(Frame<2>, Samples), ReadReason> {
    match image {
        AnyImage::Flat(image) => Ok(image.into_parts()),
        AnyImage::Volume(image) => {
            let found = format!("a volume of {} planes", image.frame().shape()[2]);
            let reason =
                ReadReason::Unsupported { format: slice.kind, found, expected: "a single slice" };
            Err(in_file(slice, reason))
        }
    }
}

/// Shape, type and spacing for a message.
fn text(frame: &Frame<2>, samples: &Samples, units: &[String]) -> String {
    let [x, y] = frame.spacing();
    let unit = units.first().map_or(String::new(), |unit| format!(" {unit}"));
    format!("{} {} of spacing {x},{y}{unit}", shape_text(&frame.shape()), samples.type_name())
}

/// Refuses labels by colour that are not the same in all slices: each file counts its own colours.
fn check_colours(notes: &[ReadNote], first: Option<&[ReadNote]>) -> Result<(), ReadReason> {
    let colours = |notes: &[ReadNote]| {
        notes.iter().find(|note| matches!(note, ReadNote::ColourLabels { .. })).cloned()
    };
    let own = colours(notes);
    let is_listed =
        !matches!(&own, Some(ReadNote::ColourLabels { count, .. }) if *count > LISTED_COLOURS);
    if is_listed && first.is_none_or(|first| colours(first) == own) {
        return Ok(());
    }
    Err(ReadReason::Unsupported {
        format: FORMAT,
        found: "slices of different colours, or of more than 20".into(),
        expected: "labels in grey values or indices of a palette, or in one file of many pages",
    })
}

#[cfg(test)]
mod tests;
