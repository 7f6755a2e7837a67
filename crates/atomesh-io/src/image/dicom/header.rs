//! What the header of a DICOM file says of its image: its series, its pixels, and where each of its frames is.

use std::io::{Read, Seek};
use std::sync::Arc;

use atomesh::geometry::dot;

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::options::GivenFrame;
use super::super::sample_type::ByteOrder;
use super::data_set::{self, Content, DataSet, PixelData};
use super::packing::Packing;
use super::pixels::{Pixels, Scale, Table};
use super::reader::Reader;
use super::segments::Segmentation;
use super::{FORMAT, tag, unsupported};

/// A file that holds an image.
pub(super) struct Found {
    pub series: SeriesName,
    /// Its header, or why the image cannot be read, which is of no interest if another series is.
    pub header: Result<Header, ReadReason>,
}

/// The header of a file.
#[derive(Debug)]
pub(super) struct Header {
    pub pixels: Pixels,
    /// Its frames, at least one.
    pub planes: Vec<Plane>,
    /// How many frames there are functional groups for, 0 if there are none.
    pub groups: usize,
    pub segmentation: Option<Segmentation>,
    pub packing: Packing,
    pub byte_order: ByteOrder,
    pub place: PixelData,
    /// Where what is deflated begins, if anything is.
    pub deflated_from: Option<u64>,
    /// Whether the preamble and the magic word are missing.
    pub is_bare: bool,
}

/// What a series is known by.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct SeriesName {
    pub uid: String,
    pub number: String,
    pub description: String,
}

/// Where a frame is, and what its numbers mean.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    /// World units from sample to sample along x and y, if the file says it.
    pub spacing: Option<[f64; 2]>,
    /// The same at the detector of a radiograph.
    pub imager_spacing: Option<[f64; 2]>,
    /// The number in the series, or in the file if that has several, if it is known.
    pub instance: Option<f64>,
    /// Sample 0 in the world of the file, LPS.
    pub position: Option<[f64; 3]>,
    /// The directions of x and y there.
    pub axes: Option<[[f64; 3]; 2]>,
    pub scale: Scale,
    /// The number of the segment that it belongs to.
    pub segment: Option<u16>,
}

impl Found {
    /// Reads the header of an image; none if the file is sound and holds no image.
    pub fn read<R: Read + Seek>(
        reader: &mut Reader<R>,
        given: GivenFrame,
    ) -> Result<Option<Self>, ReadReason> {
        let content = data_set::read(reader)?;
        let set = &content.set;
        let (Some(rows), Some(columns)) = (set.short(tag::ROWS), set.short(tag::COLUMNS)) else {
            return Ok(None);
        };
        let text = |tag| set.text(tag).unwrap_or_default();
        let series = SeriesName {
            uid: text(tag::SERIES),
            number: text(tag::SERIES_NUMBER),
            description: text(tag::SERIES_DESCRIPTION),
        };
        let header = Header::of(&content, [columns, rows], reader, given);
        Ok(Some(Self { series, header }))
    }
}

impl Header {
    fn of<R>(
        content: &Content,
        shape: [u16; 2],
        reader: &Reader<R>,
        given: GivenFrame,
    ) -> Result<Self, ReadReason> {
        let set = &content.set;
        if set.has(tag::FLOAT_PIXELS) || set.has(tag::DOUBLE_PIXELS) {
            return Err(unsupported("samples of floats", "integers"));
        }
        let packing = Packing::of(&set.text(tag::TRANSFER_SYNTAX).unwrap_or_default())?;
        let pixels = Pixels::of(set, shape)?;
        let place =
            content.pixels.ok_or_else(|| wrong(FORMAT, "pixel data", "missing", "samples"))?;
        let frames = frame_count(set)?;
        check_size(&pixels, frames, place, packing, reader.file_bytes)?;
        let segmentation = Segmentation::of(set)?;
        let planes = planes(set, frames, &pixels, given)?;
        Ok(Self {
            pixels,
            planes,
            groups: set.items(tag::FRAME_GROUPS).len(),
            segmentation,
            packing,
            byte_order: content.byte_order,
            place,
            deflated_from: reader.deflated_from(),
            is_bare: reader.is_bare,
        })
    }
}

fn frame_count(set: &DataSet) -> Result<usize, ReadReason> {
    let Some(text) = set.text(tag::FRAME_COUNT).filter(|text| !text.is_empty()) else {
        return Ok(1);
    };
    let count = text.parse::<u32>().ok().filter(|&count| count > 0);
    let count = count.ok_or_else(|| wrong(FORMAT, "number of frames", &*text, "1 or more"))?;
    Ok(count as usize)
}

/// Checks that a file of `file_bytes` bytes can hold the samples.
fn check_size(
    pixels: &Pixels,
    frames: usize,
    place: PixelData,
    packing: Packing,
    file_bytes: u64,
) -> Result<(), ReadReason> {
    let there = file_bytes.saturating_sub(place.start);
    let there = place.length.map_or(there, |length| there.min(length.into()));
    let expected = (pixels.count() as u64).saturating_mul(frames as u64);
    let found = match packing {
        Packing::Plain if pixels.allocated == 1 => there.saturating_mul(8),
        Packing::Plain => there / pixels.bytes(1),
        // a frame is a fragment at least, with a head of 8 bytes
        _ if there / 8 < frames as u64 => 0,
        packing => there.saturating_mul(packing.density()),
    };
    if found < expected { Err(ReadReason::Truncated { expected, found }) } else { Ok(()) }
}

/// What was read, or nothing if it is wrong and the caller gives something in its place.
fn unless<T>(is_given: bool, read: Result<Option<T>, ReadReason>) -> Result<Option<T>, ReadReason> {
    if is_given { Ok(read.unwrap_or_default()) } else { read }
}

/// The frames of a file. What one says itself goes before what all share, and that before the header.
fn planes(
    set: &DataSet,
    frames: usize,
    pixels: &Pixels,
    given: GivenFrame,
) -> Result<Vec<Plane>, ReadReason> {
    let whole = header_plane(set, pixels, given)?;
    let shared = match set.items(tag::SHARED_GROUPS).first() {
        Some(groups) => group_plane(groups, whole.clone(), given)?,
        None => whole,
    };
    let own = set.items(tag::FRAME_GROUPS);
    if !own.is_empty() && own.len() < frames {
        let found = format!("{} for {frames} frames", own.len());
        return Err(wrong(FORMAT, "per-frame functional groups", found, "one for each frame"));
    }
    let mut planes = Vec::with_capacity(frames);
    for frame in 0..frames {
        let mut plane = match own.get(frame) {
            Some(groups) => group_plane(groups, shared.clone(), given)?,
            None => shared.clone(),
        };
        if frames > 1 {
            plane.instance = Some((frame + 1) as f64);
        }
        planes.push(plane);
    }
    if own.is_empty() && frames > 1 {
        place_by_offsets(set, &mut planes, given)?;
    }
    Ok(planes)
}

/// What the header says of all frames.
fn header_plane(set: &DataSet, pixels: &Pixels, given: GivenFrame) -> Result<Plane, ReadReason> {
    let mut scale = Scale::of(set)?;
    if let Some(table) = set.items(tag::MODALITY_TABLE).first() {
        scale = Some(Scale::Table(Arc::new(Table::of(table, pixels.is_signed)?)));
    }
    if let Some([slope]) = set.decimals(tag::DOSE_SCALING, "dose grid scaling")? {
        scale = Some(Scale::Linear { slope, intercept: 0.0 });
    }
    let instance = set.decimals(tag::INSTANCE, "instance number").unwrap_or_default();
    let mut plane = Plane {
        spacing: None,
        imager_spacing: unless(
            given.spacing,
            spacing(set, tag::IMAGER_SPACING, "imager pixel spacing"),
        )?,
        instance: instance.map(|[number]| number),
        position: None,
        axes: None,
        scale: scale.unwrap_or(Scale::NONE),
        segment: None,
    };
    // those of nuclear medicine stand with the detector
    let detector = set.items(tag::DETECTORS).first();
    for set in detector.into_iter().chain([set]) {
        plane.take_geometry(set, given)?;
    }
    Ok(plane)
}

/// A frame with what a functional group says of it.
fn group_plane(groups: &DataSet, mut plane: Plane, given: GivenFrame) -> Result<Plane, ReadReason> {
    for group in [tag::PLANE_POSITION, tag::PLANE_ORIENTATION, tag::PIXEL_MEASURES] {
        if let Some(item) = groups.items(group).first() {
            plane.take_geometry(item, given)?;
        }
    }
    if let Some(item) = groups.items(tag::VALUE_TRANSFORMATION).first()
        && let Some(scale) = Scale::of(item)?
    {
        plane.scale = scale;
    }
    if let Some(item) = groups.items(tag::SEGMENT_IDENTIFICATION).first() {
        plane.segment = item.short(tag::REFERENCED_SEGMENT).or(plane.segment);
    }
    Ok(plane)
}

impl Plane {
    /// Takes what elements say of the place.
    fn take_geometry(&mut self, set: &DataSet, given: GivenFrame) -> Result<(), ReadReason> {
        let own = unless(given.spacing, spacing(set, tag::PIXEL_SPACING, "pixel spacing"))?;
        self.spacing = own.or(self.spacing);
        let position = set.decimals(tag::POSITION, "image position (patient)");
        self.position = unless(given.spacing, position)?.or(self.position);
        let axes = set.decimals::<6>(tag::ORIENTATION, "image orientation (patient)");
        let axes = unless(given.direction, axes)?.map(|[a, b, c, d, e, f]| [[a, b, c], [d, e, f]]);
        self.axes = axes.or(self.axes);
        Ok(())
    }
}

/// Frames along the normal: by the offsets that a dose states, else by the spacing between slices. Without either they have
/// no place of their own.
fn place_by_offsets(
    set: &DataSet,
    planes: &mut [Plane],
    given: GivenFrame,
) -> Result<(), ReadReason> {
    let first = planes[0].clone();
    let offsets = unless(given.spacing, set.list(tag::FRAME_OFFSETS, "grid frame offset vector"))?;
    let gap =
        unless(given.spacing, set.decimals::<1>(tag::SPACING_BETWEEN, "spacing between slices"))?;
    let offsets = match (offsets, gap) {
        (Some(offsets), _) if offsets.len() == planes.len() => offsets,
        (Some(offsets), _) if !given.spacing => {
            let found = format!("{} numbers for {} frames", offsets.len(), planes.len());
            return Err(wrong(FORMAT, "grid frame offset vector", found, "one for each frame"));
        }
        (None, Some([gap])) if gap != 0.0 => (0..planes.len()).map(|k| k as f64 * gap).collect(),
        _ => Vec::new(),
    };
    let (Some(position), Some([x, y])) = (first.position, first.axes) else {
        planes.iter_mut().for_each(|plane| plane.position = None);
        return Ok(());
    };
    if offsets.is_empty() {
        planes.iter_mut().for_each(|plane| plane.position = None);
        return Ok(());
    }
    let normal = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    // offsets that do not begin with 0 are places along z (PS3.3, C.8.8.3.2)
    let along = if dot(&normal, &[0.0, 0.0, 1.0]) < 0.0 { -1.0 } else { 1.0 };
    let is_relative = offsets[0] == 0.0 || normal[2].abs() < 0.99;
    for (plane, offset) in planes.iter_mut().zip(offsets) {
        let step = if is_relative { offset } else { along * (offset - position[2]) };
        plane.position = Some(std::array::from_fn(|r| position[r] + step * normal[r]));
    }
    Ok(())
}

/// A spacing along x and y; the file has that between rows, along y, first.
fn spacing(set: &DataSet, tag: u32, name: &'static str) -> Result<Option<[f64; 2]>, ReadReason> {
    let spacing = set.decimals::<2>(tag, name)?;
    if let Some(spacing) = spacing.filter(|s| s.iter().any(|&s| s <= 0.0)) {
        return Err(wrong(FORMAT, name, format!("{spacing:?}"), "numbers above 0"));
    }
    Ok(spacing.map(|[y, x]| [x, y]))
}
