//! From the headers of a scan to its image.

use std::collections::BTreeMap;

use atomesh::image::Samples;

use super::super::affine;
use super::super::any_image::AnyImage;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::note::{LoadedImage, ReadNote};
use super::super::options::{GivenFrame, Meaning, ReadOptions};
use super::super::scan_note::ScanNote;
use super::super::series_error::SeriesError;
use super::choose::{Chosen, choose};
use super::flat::Flat;
use super::grid::{Grid, Resampling};
use super::header::{Found, Header};
use super::pixels::{Pixels, Scale};
use super::segments::{Labels, Segmentation, Stack};
use super::series::{Series, Slice, slices};
use super::{FORMAT, MILLIMETRE, WORLD};

/// What the caller wants of a scan.
pub(super) struct Wishes<'a> {
    pub given: GivenFrame,
    pub memory: Memory,
    meaning: Meaning,
    series: Option<&'a str>,
    segment: Option<&'a str>,
}

impl<'a> Wishes<'a> {
    pub fn of(options: &'a ReadOptions, memory: Memory) -> Self {
        Self {
            given: options.given,
            memory,
            meaning: options.meaning,
            series: options.series.as_deref(),
            segment: options.segment.as_deref(),
        }
    }

    fn is_labels(&self) -> bool {
        self.meaning != Meaning::Brightness
    }
}

/// Reads the values of a frame of a file as they are stored; files and frames are counted from 0.
pub(super) type ReadFrame<'a> =
    &'a mut dyn FnMut(&Header, (usize, usize)) -> Result<Vec<i64>, ReadReason>;

/// The files of a series, each with its name.
pub(super) struct Scan {
    files: Vec<(String, Header)>,
    notes: Vec<ReadNote>,
}

impl Scan {
    /// The files of the series that is wanted; `others` are files without an image.
    pub fn new(
        files: Vec<(String, Found)>,
        others: usize,
        wishes: &Wishes,
    ) -> Result<Self, ReadReason> {
        let Chosen { files, name, count } = choose(files, wishes.series, others)?;
        let mut notes = Vec::new();
        let (first, head) = &files[0];
        if count > 1 {
            notes.push(ScanNote::Series { name: name.text(), count }.into());
        }
        let bare: Vec<_> = files.iter().filter(|(_, header)| header.is_bare).collect();
        if let Some((file, _)) = bare.first() {
            let file = if file.is_empty() { "the file" } else { file }.into();
            notes.push(ScanNote::NoPreamble { count: bare.len(), file }.into());
        }
        for (file, header) in &files {
            same(first, &head.pixels, file, &header.pixels)?;
            let frames = header.planes.len();
            if header.groups > frames {
                notes.push(ScanNote::MoreGroups { found: header.groups, frames }.into());
            }
        }
        if files.iter().any(|(_, header)| header.packing.is_lossy()) && wishes.is_labels() {
            notes.push(ReadNote::Lossy);
        }
        Ok(Self { files, notes })
    }

    pub fn file(&self, file: usize) -> &str {
        &self.files[file].0
    }

    pub fn file_count(&self) -> usize {
        self.files.len()
    }

    pub fn frame_count(&self) -> usize {
        self.files.iter().map(|(_, header)| header.planes.len()).sum()
    }

    /// Reads the image.
    pub fn load(&self, wishes: &Wishes, read: ReadFrame) -> Result<LoadedImage, ReadReason> {
        let mut loaded = match &self.files[0].1.segmentation {
            Some(segmentation) if !segmentation.is_label_map => {
                let segmentation = self.all_segments(segmentation);
                self.load_segments(&segmentation, wishes, read)?
            }
            _ => self.load_values(wishes, read)?,
        };
        loaded.notes.splice(0..0, self.notes.iter().cloned());
        Ok(loaded)
    }

    fn load_values(&self, wishes: &Wishes, read: ReadFrame) -> Result<LoadedImage, ReadReason> {
        let pixels = &self.files[0].1.pixels;
        let series = Series::new(slices(&self.files), wishes.given, false)?;
        let is_plain = series.slices.iter().all(|slice| slice.plane.scale == Scale::NONE);
        let is_inverted = pixels.is_inverted && !wishes.is_labels();
        let note = match (pixels.is_inverted, is_inverted) {
            (false, _) => None,
            (true, true) => Some(ScanNote::Inverted.into()),
            (true, false) => Some(ReadNote::WhiteIsZero),
        };
        let chosen = match (&self.files[0].1.segmentation, wishes.segment) {
            (Some(segmentation), Some(wanted)) => Some(segmentation.chosen(wanted)?),
            _ => None,
        };
        let mut stored = |slice: &Slice| -> Result<Vec<i64>, ReadReason> {
            let mut values = read(&self.files[slice.source.0].1, slice.source)?;
            if is_inverted {
                values.iter_mut().for_each(|value| *value = pixels.inverted(*value));
            }
            if let Some((number, _)) = &chosen {
                values
                    .iter_mut()
                    .for_each(|value| *value = i64::from(*value == i64::from(*number)));
            }
            Ok(values)
        };
        let kind = if is_plain { Kind::of(pixels) } else { Kind::F32 };
        let loaded = assemble(&series, pixels, wishes, kind, &mut |k| {
            let Some(slice) = series.slices.get(k) else { return Ok(None) };
            Ok(Some((stored(slice)?, slice.plane.scale.clone())))
        })?;
        Ok(loaded.noting(note).noting(chosen.map(|(_, note)| note)))
    }

    /// The segments of all files.
    fn all_segments(&self, first: &Segmentation) -> Segmentation {
        let mut all = first.clone();
        for (_, header) in &self.files[1..] {
            if let Some(other) = &header.segmentation {
                all.segments.extend(other.segments.clone());
            }
        }
        all
    }

    /// Labels by the numbers of segments, or one segment.
    fn load_segments(
        &self,
        segmentation: &Segmentation,
        wishes: &Wishes,
        read: ReadFrame,
    ) -> Result<LoadedImage, ReadReason> {
        let pixels = &self.files[0].1.pixels;
        let refused = |layers: usize| segmentation.refusal(layers, wishes.segment);
        let (chosen, note) = match wishes.segment {
            Some(wanted) => {
                segmentation.chosen(wanted).map(|(number, note)| (Some(number), note))?
            }
            None => (None, ScanNote::Segments { list: segmentation.list() }.into()),
        };
        let all = slices(&self.files);
        let mut own: Vec<u16> = all.iter().filter_map(|slice| slice.plane.segment).collect();
        own.sort_unstable();
        own.dedup();
        let shares = segmentation.greatest;
        if shares.is_some() && chosen.is_none() && own.len() > 1 {
            return Err(refused(own.len()));
        }
        let stack = Stack::new(all);
        let series = Series::new(stack.places.clone(), wishes.given, true)?;
        let rungs: BTreeMap<usize, &Slice> = match &series.rungs {
            Some((rungs, _)) => rungs.iter().copied().zip(&series.slices).collect(),
            None => series.slices.iter().enumerate().collect(),
        };
        let scale = match shares {
            Some(greatest) => Scale::Linear { slope: 1.0 / f64::from(greatest), intercept: 0.0 },
            None => Scale::NONE,
        };
        let kind = match (shares, own.last()) {
            (Some(_), _) => Kind::F32,
            (None, Some(256..)) if chosen.is_none() => Kind::U16,
            (None, _) => Kind::U8,
        };
        let loaded = assemble(&series, pixels, wishes, kind, &mut |k| {
            let mut labels = Labels::none(pixels.count(), wishes.memory)?;
            for (segment, slice) in rungs.get(&k).map_or(&[][..], |slice| stack.frames_of(slice)) {
                if chosen.is_some_and(|chosen| chosen != *segment) {
                    continue;
                }
                let values = read(&self.files[slice.source.0].1, slice.source)?;
                match (shares, chosen) {
                    (Some(_), _) => labels.values = values,
                    (None, Some(_)) => labels.put(1, &values).map_err(|_| refused(1))?,
                    (None, None) => labels.put(*segment, &values).map_err(|_| refused(2))?,
                }
            }
            Ok(Some((labels.values, scale.clone())))
        })?;
        let shares = shares.map(|greatest| ScanNote::Shares { greatest }.into());
        Ok(loaded.noting(note).noting(shares))
    }
}

/// The stored values of a slice of the volume, and what they are rescaled by; none beyond the last.
type ReadSlice<'a> = &'a mut dyn FnMut(usize) -> Result<Option<(Vec<i64>, Scale)>, ReadReason>;

/// The image of slices in their order.
fn assemble(
    series: &Series,
    pixels: &Pixels,
    wishes: &Wishes,
    kind: Kind,
    read: ReadSlice,
) -> Result<LoadedImage, ReadReason> {
    let (shape, memory, given) = (pixels.shape, wishes.memory, wishes.given);
    let mut straight = |count: usize| {
        let mut volume = Volume::new(kind, pixels.count().saturating_mul(count), memory)?;
        for k in 0..count {
            if let Some((values, scale)) = read(k)? {
                volume.append(&values, &scale);
            }
        }
        Ok(volume.samples)
    };
    if series.slices.len() == 1 {
        let flat = Flat::of(&series.slices[0].plane, given);
        let loaded = affine::placed(FORMAT, &shape, flat.affine, || straight(1))?;
        return Ok(flat.noting(loaded));
    }
    let grid = Grid::of(series, shape, given)?;
    let affine = grid.affine.turned_from(WORLD).with_given(given);
    let (affine, squared) = affine.squared(&grid.shape);
    let image = match grid.resampling {
        None => affine::image(FORMAT, &grid.shape, affine, || straight(grid.shape[2]))?,
        Some(mut resampling) => {
            resampling.is_nearest = wishes.is_labels();
            let samples = || resampled(&resampling, memory, read);
            absent_where_nan(affine::image(FORMAT, &grid.shape, affine, samples)?, memory)?
        }
    };
    let mut loaded = LoadedImage { units: vec![MILLIMETRE.into(); 3], ..image.into() };
    loaded = loaded.noting(WORLD.note()).noting(squared).noting(grid.note);
    loaded.notes.extend(series.notes.iter().cloned());
    Ok(loaded)
}

/// Slices on another grid, in single precision.
fn resampled(
    resampling: &Resampling,
    memory: Memory,
    read: ReadSlice,
) -> Result<Samples, ReadReason> {
    let mut slice = |k: usize| {
        let (values, scale) = read(k)?.unwrap_or_else(|| (Vec::new(), Scale::NONE));
        let mut rescaled = Vec::new();
        memory.reserve(&mut rescaled, values.len())?;
        rescaled.extend(values.iter().map(|&value| scale.value(value)));
        Ok(rescaled)
    };
    Ok(Samples::F32(resampling.resample(&mut slice, memory)?.into()))
}

/// An image whose NaN are places without data.
fn absent_where_nan(image: AnyImage, memory: Memory) -> Result<AnyImage, ReadReason> {
    let AnyImage::Volume(volume) = image else { return Ok(image) };
    let (frame, samples) = volume.into_parts();
    let Samples::F32(values) = samples else {
        return Ok(AnyImage::Volume(atomesh::image::Image::new(frame, samples)?));
    };
    let mut values = values.into_vec();
    let mut absent = Vec::new();
    memory.reserve(&mut absent, values.len())?;
    absent.extend(values.iter().map(|value| value.is_nan()));
    let has_absent = absent.contains(&true);
    values.iter_mut().filter(|value| value.is_nan()).for_each(|value| *value = 0.0);
    let image = atomesh::image::Image::new(frame, Samples::F32(values.into()))?;
    Ok(AnyImage::Volume(if has_absent { image.with_absent(absent)? } else { image }))
}

/// Checks that the pixels of a file are like those of the first one.
fn same(first: &str, head: &Pixels, file: &str, pixels: &Pixels) -> Result<(), SeriesError> {
    let differs = |entry, found: String, expected: String| {
        let (file, first) = (file.into(), first.into());
        Err(SeriesError::Differs { file, entry, found, expected, first })
    };
    let ([nx, ny], [mx, my]) = (pixels.shape, head.shape);
    if (nx, ny) != (mx, my) {
        return differs("the shape", format!("{nx} × {ny}"), format!("{mx} × {my}"));
    }
    if pixels != head {
        return differs("samples of", pixels.text(), head.text());
    }
    Ok(())
}

/// The type of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
}

impl Kind {
    /// The least type that holds stored values.
    fn of(pixels: &Pixels) -> Self {
        match (pixels.stored, pixels.is_signed) {
            (..9, false) => Self::U8,
            (..9, true) => Self::I8,
            (..17, false) => Self::U16,
            (..17, true) => Self::I16,
            (_, false) => Self::U32,
            (_, true) => Self::I32,
        }
    }
}

/// The samples of all slices.
struct Volume {
    samples: Samples,
}

impl Volume {
    /// Room for `count` samples.
    fn new(kind: Kind, count: usize, memory: Memory) -> Result<Self, ReadReason> {
        let samples = match kind {
            Kind::U8 => Samples::U8(room(count, memory)?.into()),
            Kind::I8 => Samples::I8(room(count, memory)?.into()),
            Kind::U16 => Samples::U16(room(count, memory)?.into()),
            Kind::I16 => Samples::I16(room(count, memory)?.into()),
            Kind::U32 => Samples::U32(room(count, memory)?.into()),
            Kind::I32 => Samples::I32(room(count, memory)?.into()),
            Kind::F32 => Samples::F32(room(count, memory)?.into()),
        };
        Ok(Self { samples })
    }

    /// Appends the samples of a slice.
    fn append(&mut self, values: &[i64], scale: &Scale) {
        /// Appends with one function for each type of integers.
        macro_rules! append_as {
            ($($kind:ident $number:ty),*) => {
                match &mut self.samples {
                    $(Samples::$kind(v) => v.to_mut().extend(values.iter().map(|&x| x as $number)),)*
                    Samples::F32(v) => {
                        v.to_mut().extend(values.iter().map(|&x| scale.value(x)));
                    }
                    _ => {} // no other is made
                }
            };
        }
        append_as!(U8 u8, I8 i8, U16 u16, I16 i16, U32 u32, I32 i32);
    }
}

/// A vector with room for `count` samples.
fn room<T>(count: usize, memory: Memory) -> Result<Vec<T>, ReadReason> {
    let mut samples = Vec::new();
    memory.reserve(&mut samples, count)?;
    Ok(samples)
}
