//! SEG-Y, revisions 0 to 2: the tape format of seismic data. Headers, then trace after trace.
//!
//! Definition: SEG Technical Standards Committee, *SEG-Y revision 2.0 Data Exchange format*, 2017;
//! Barry, Cavers & Kneale 1975. Order of the work: the file's header and its size give the traces'
//! length and number; all trace headers are read, the samples skipped; their numbers, or else their
//! coordinates, arrange the traces; their coordinates place the grid; then samples are read once, in
//! blocks, into the vector that will hold them. Those of missing and dead traces are 0, and told from
//! others by a mask.
//!
//! Axes: in a cube x runs along the crossline numbers, y along the inline numbers; on a line x runs
//! along the line. The last axis is the sample number, downwards. World coordinates are X and Y of
//! the trace headers (on a line the distance along it, X itself where it runs along X), and time or
//! depth downwards.
//!
//! The vertical spacing is a thousandth of the sample interval in the header: milliseconds for time (the
//! standard has microseconds), metres for depth (by custom millimetres). Which of the two is meant changes
//! its unit's name alone.

use std::io::{Read, Seek, SeekFrom};

use atomesh::image::{Frame, Image, Samples};

use super::any_image::AnyImage;
use super::codec::{Codec, Source};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::options::{Duplicates, SegyOptions, Vertical};
use super::traces::{self, TraceLayout};

mod coordinates;
mod doubt;
mod fit;
mod grid;
mod header;
mod line;
mod live;
pub(super) mod su;
mod survey;
#[cfg(test)]
mod tests;
mod trace;
mod vertical;

use coordinates::{Coordinates, nowhere};
use fit::Placement;
use header::Header;
use survey::Survey;
use trace::Trace;
use vertical::vertical;

const FORMAT: ImageFormat = ImageFormat::named("SEG-Y");

pub(super) const CODEC: Codec =
    Codec { endings: &[".segy", ".sgy"], has_frame: true, ..Codec::reading(FORMAT, read) };

/// Where inline and crossline numbers stand if nobody says otherwise (revision 1).
const TRACE_BYTES: [usize; 2] = [189, 193];

/// Where coordinates may be, in the order tried: of the midpoint (revision 1), the source, the
/// receiver.
const COORDINATE_BYTES: [[usize; 2]; 3] = [[181, 185], [73, 77], [81, 85]];

/// Where numbers and coordinates of traces are looked for, and which trace of several with the same numbers counts.
struct Places<'a> {
    /// The first bytes of the inline and the crossline number; none if headers have no place for them.
    numbers: Option<[usize; 2]>,
    /// The first bytes of X and Y.
    coordinates: &'a [[usize; 2]],
    /// Whether trace headers have a scalar for times.
    has_time_scalar: bool,
    duplicates: Option<Duplicates>,
}

impl<'a> Places<'a> {
    /// Those of options. Every number must lie in a trace header of 240 bytes.
    fn of(options: &'a SegyOptions) -> Result<Self, ReadReason> {
        let all = [options.trace_bytes, options.coordinate_bytes];
        if let Some(byte) = all.into_iter().flatten().flatten().find(|at| !(1..=237).contains(at)) {
            return Err(ReadReason::TraceByte { byte });
        }
        let coordinates = match &options.coordinate_bytes {
            Some(given) => std::slice::from_ref(given),
            None => &COORDINATE_BYTES,
        };
        Ok(Self {
            numbers: Some(options.trace_bytes.unwrap_or(TRACE_BYTES)),
            coordinates,
            has_time_scalar: true,
            duplicates: options.duplicates,
        })
    }
}

/// The error for an entry of a header.
fn wrong(field: &'static str, value: String, expected: &'static str) -> ReadReason {
    ReadReason::Header { format: FORMAT, field, value, expected }
}

/// Reads a line or a cube.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let options = &source.options.segy;
    let Source { bytes: mut source, length: file_bytes, memory, .. } = source;
    let places = Places::of(options)?;
    let header = Header::read(&mut source, file_bytes, options)?;
    let heads = trace::read_headers(&mut source, &header, &places, memory)?;
    let doubt = match options.sample_format {
        None => doubt::doubt(&mut source, &header)?,
        Some(_) => None,
    };
    image(&mut source, (header, heads), (options, &places), doubt, memory)
}

/// The image of traces whose headers were read, with their samples.
fn image<R: Read + Seek>(
    source: &mut R,
    (header, mut heads): (Header, Vec<Trace>),
    (options, of): (&SegyOptions, &Places<'_>),
    doubt: Option<ReadNote>,
    memory: Memory,
) -> Result<LoadedImage, ReadReason> {
    let mut notes = header.notes.clone();
    live::note_dead(&mut heads, &mut notes);
    notes.extend(doubt);
    let (survey, placement) = arranged(&heads, of, &mut notes)?;
    let vertical = vertical(&header, &heads, options, &mut notes);
    let length = match (placement, header.is_in_feet) {
        (None, _) => "",
        (_, true) => "ft",
        (_, false) => "m",
    };
    if header.is_in_feet {
        notes.push(ReadNote::Feet);
    }
    let depth = match options.vertical {
        Some(Vertical::Time) => "ms",
        Some(Vertical::Depth) if header.is_in_feet => "ft",
        Some(Vertical::Depth) => "m",
        None => "",
    };
    let ([nx, ny], places) = (survey.shape, live::live_places(&heads, &survey));
    let absent = live::absent(&places, survey.trace_places(), header.samples, memory)?;
    // frames are made first, so that what is wrong with them is reported before the long read
    let (image, units) = if survey.is_cube {
        let frame = cube_frame([nx, ny, header.samples], placement, vertical)?;
        let samples = read_samples(source, &header, &places, nx * ny, memory)?;
        (AnyImage::Volume(image_of(frame, samples, absent)?), vec![length, length, depth])
    } else {
        let frame = line_frame([nx, header.samples], placement, vertical)?;
        let samples = read_samples(source, &header, &places, nx * ny, memory)?;
        (AnyImage::Flat(image_of(frame, samples, absent)?), vec![length, depth])
    };
    let units = units.into_iter().map(String::from).collect();
    Ok(LoadedImage { image, units, notes })
}

/// The image of these samples, without data where `absent` says so.
fn image_of<const D: usize>(
    frame: Frame<D>,
    samples: Samples,
    absent: Option<Vec<bool>>,
) -> Result<Image<D>, ReadReason> {
    let image = Image::new(frame, samples)?;
    Ok(match absent {
        Some(absent) => image.with_absent(absent)?,
        None => image,
    })
}

/// Arranges the traces, and places their grid if they have coordinates.
fn arranged(
    traces: &[Trace],
    of: &Places<'_>,
    notes: &mut Vec<ReadNote>,
) -> Result<(Survey, Option<Placement>), ReadReason> {
    let searched = of.coordinates;
    let coordinates = Coordinates::of(traces, searched);
    let survey = Survey::arrange(traces, of, coordinates.as_ref().ok(), notes)?;
    let coordinates = match coordinates {
        Ok(coordinates) => coordinates,
        Err(note) => {
            notes.push(note);
            return Ok((survey, None));
        }
    };
    let placement = match survey.is_cube {
        true => fit::place(&coordinates, &survey, notes)?,
        false => line::place(&coordinates, &survey, notes)?,
    };
    if placement.is_none() {
        notes.push(nowhere(searched));
    }
    Ok((survey, placement))
}

/// Reads the samples of traces to their places in a plane of `plane` traces.
fn read_samples<R: Read + Seek>(
    source: &mut R,
    header: &Header,
    places: &[usize],
    plane: usize,
    memory: Memory,
) -> Result<Samples, ReadReason> {
    source.seek(SeekFrom::Start(header.start)).map_err(ReadReason::Io)?;
    let layout = TraceLayout {
        format: header.format,
        byte_order: header.byte_order,
        header_bytes: header.trace_header,
        samples: header.samples,
        places,
        plane,
        memory,
    };
    traces::read(source, &layout)
}

fn line_frame(
    shape: [usize; 2],
    placement: Option<Placement>,
    [step, start]: [f64; 2],
) -> Result<Frame<2>, ReadReason> {
    let (along, from) = placement.map_or((1.0, 0.0), |p| (p.spacing[0], p.origin[0]));
    Ok(Frame::new(shape)?.with_spacing([along, step])?.with_origin([from, start])?)
}

fn cube_frame(
    shape: [usize; 3],
    placement: Option<Placement>,
    [step, start]: [f64; 2],
) -> Result<Frame<3>, ReadReason> {
    let frame = Frame::new(shape)?;
    let Some(Placement { spacing: [sx, sy], axes: [x, y], origin: [ox, oy] }) = placement else {
        return Ok(frame.with_spacing([1.0, 1.0, step])?.with_origin([0.0, 0.0, start])?);
    };
    let direction = [[x[0], y[0], 0.0], [x[1], y[1], 0.0], [0.0, 0.0, 1.0]];
    let frame = frame.with_spacing([sx, sy, step])?.with_origin([ox, oy, start])?;
    Ok(frame.with_direction(direction)?)
}
