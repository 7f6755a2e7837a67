//! TIFF and BigTIFF through the `tiff` crate: one page is flat, many are the planes of a volume.
//!
//! Micrographs come as stacks of channels, slices and times. What ImageJ, OME-XML and `tifffile` say of them in the
//! description of the first page is read (`imagej`, `ome`, `shaped`), and one channel and time of it is the image
//! (`stack`). So is the size of samples, from there or from the resolution tags (`size`). Palettes are read where their
//! indices are wanted, for which the decoder is shown another shade (`grey`). ImageJ writes stacks of more than 4 GB
//! with a single directory, the planes of all pages behind its first sample: these are read by their place (`contiguous`).

use std::io::{BufReader, Read, Seek};

use ::tiff::decoder::{Decoder, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};
use atomesh::image::{Frame, Image, Samples};

use super::any_image::AnyImage;
use super::codec::{Begins, Codec, Source};
use super::colour::{Values, palette_note};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::options::Meaning;
use super::shape::plausible_count;

mod contiguous;
mod grey;
mod imagej;
mod ome;
mod page;
mod samples;
mod shaped;
mod size;
mod stack;
mod write;

use grey::Patched;
use page::Page;
use size::Resolution;
use stack::Stack;

const FORMAT: ImageFormat = ImageFormat::named("TIFF");

pub(super) const CODEC: Codec = Codec {
    endings: &[".tif", ".tiff"],
    begins: Begins::With(&[b"II\x2a\0", b"II\x2b\0", b"MM\0\x2a", b"MM\0\x2b"]),
    has_frame: true,
    frame_is_optional: true,
    writes_floats: true,
    write: Some(write::write),
    ..Codec::reading(FORMAT, read)
};

/// Samples that a byte of the file may stand for: a constant image packs about 1400 into one byte
/// by LZW and 1032 by deflate.
const DENSITY: u64 = 4096;

/// Memory that a part of a file may take, however small the file is: the decoder holds a palette of 16 bits, 3 · 2¹⁶
/// numbers, in 6 MiB.
const LEAST_ROOM: usize = 8 << 20;

/// A file with its pages compared, before the first one is decoded.
struct File<R: Read + Seek> {
    decoder: Decoder<Patched<R>>,
    page: Page,
    page_count: usize,
    file_bytes: u64,
    memory: Memory,
}

/// Reads the planes of one channel and time.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let mut values = Values::new(FORMAT, source.options.meaning);
    let bytes = BufReader::with_capacity(1 << 16, source.bytes);
    let mut file = File::open(bytes, (source.length, source.memory), values.meaning)?;
    let page = file.page;
    let mut notes = Vec::new();
    file.first_page()?;
    let resolution = Resolution::of(&mut file.decoder);
    let description = page::description(&mut file.decoder).unwrap_or_else(|error| {
        let fault = error.to_string();
        notes.push(ReadNote::Description { source: "the image description", fault });
        String::new()
    });
    let stack = Stack::of(&description, &page, file.page_count, &mut notes)?;
    let planes = stack.chosen(&page, source.options.stack, &mut notes)?;
    let mut shape = vec![page.width, page.height];
    shape.extend((planes.len() > 1).then_some(planes.len()));
    let samples = match stack.is_contiguous {
        true => contiguous::read(&mut file, stack.plane_count(), &planes, &mut values)?,
        false => file.read(&planes, &mut values)?,
    };
    let (samples, more) = values.finish(samples);
    notes.extend(more);
    let (spacing, unit) = size::spacing(&stack, &resolution, shape.len(), &mut notes);
    let units = if unit.is_empty() { Vec::new() } else { vec![unit; shape.len()] };
    let image = image(&shape, &spacing, samples)?;
    Ok(LoadedImage { units, notes, ..image.into() })
}

/// The image of these samples, from the origin.
fn image(shape: &[usize], spacing: &[f64], samples: Samples) -> Result<AnyImage, ReadReason> {
    match (shape, spacing) {
        (&[nx, ny], &[x, y]) => {
            let frame = Frame::new([nx, ny])?.with_spacing([x, y])?;
            Ok(AnyImage::Flat(Image::new(frame, samples)?))
        }
        (&[nx, ny, nz], &[x, y, z]) => {
            let frame = Frame::new([nx, ny, nz])?.with_spacing([x, y, z])?;
            Ok(AnyImage::Volume(Image::new(frame, samples)?))
        }
        _ => AnyImage::frameless(shape, samples),
    }
}

/// The reason that a decoder's error stands for.
fn reason(error: TiffError) -> ReadReason {
    ReadReason::decoder(FORMAT, error)
}

impl<R: Read + Seek> File<R> {
    /// Compares all pages.
    fn open(
        bytes: R,
        (file_bytes, memory): (u64, Memory),
        meaning: Meaning,
    ) -> Result<Self, ReadReason> {
        let wants_indices = meaning != Meaning::Brightness;
        let mut decoder = Decoder::new(Patched::new(bytes)).map_err(reason)?;
        let first = Page::of(&mut decoder, wants_indices)?;
        plausible_count(&[first.width, first.height], file_bytes, DENSITY)?;
        let mut page_count = 1;
        while decoder.more_images() {
            decoder.next_image().map_err(reason)?;
            page_count += 1;
            let page = Page::of(&mut decoder, wants_indices)?;
            if page != first {
                return Err(ReadReason::Page {
                    page: page_count,
                    found: page.text(),
                    expected: first.text(),
                });
            }
        }
        let count = plausible_count(&[first.width, first.height, page_count], file_bytes, DENSITY)?;
        let mut limits = Limits::default();
        limits.decoding_buffer_size = count.saturating_mul(4 * 8).max(LEAST_ROOM);
        limits.intermediate_buffer_size = limits.decoding_buffer_size.saturating_add(1 << 20);
        limits.ifd_value_size = usize::try_from(file_bytes).unwrap_or(usize::MAX).max(LEAST_ROOM);
        let decoder = decoder.with_limits(limits);
        Ok(Self { decoder, page: first, page_count, file_bytes, memory })
    }

    /// Goes back to the first page.
    fn first_page(&mut self) -> Result<(), ReadReason> {
        if self.page_count > 1 { self.decoder.seek_to_image(0).map_err(reason) } else { Ok(()) }
    }

    /// Decodes the pages of these numbers, one after another.
    fn read(&mut self, planes: &[usize], values: &mut Values) -> Result<Samples, ReadReason> {
        let page = self.page;
        let shape = [page.width, page.height, planes.len()];
        let count = plausible_count(&shape, self.file_bytes, DENSITY)?;
        self.memory.check(count as u128 * page.sample_bytes())?;
        let mut volume = None;
        for &plane in planes {
            if self.page_count > 1 {
                self.decoder.seek_to_image(plane).map_err(reason)?;
            }
            let samples = match page.color {
                ColorType::Palette(_) => self.read_indices(plane, values)?,
                _ => {
                    if page.is_white_zero && values.meaning != Meaning::Brightness {
                        values.note(ReadNote::WhiteIsZero);
                        self.show_as_stored(plane)?;
                    }
                    let decoded = self.decoder.read_image().map_err(reason)?;
                    samples::samples(decoded, &page, values)?
                }
            };
            samples::append(&mut volume, samples, count, self.memory)?;
        }
        volume.ok_or(ReadReason::Truncated { expected: count as u64, found: 0 })
    }

    /// Decodes a page with a palette: its indices, or, where labels go by colour, its colours.
    fn read_indices(&mut self, plane: usize, values: &mut Values) -> Result<Samples, ReadReason> {
        let map = self.decoder.get_tag_u16_vec(Tag::ColorMap).map_err(reason)?;
        self.show_as_stored(plane)?;
        let decoded = self.decoder.read_image().map_err(reason)?;
        // red of all indices comes first, then green, then blue
        let count = map.len() / 3;
        let colour = |index: usize| [0, 1, 2].map(|c| map.get(c * count + index).copied());
        if values.meaning != Meaning::LabelsByColour {
            let indices = samples::samples(decoded, &self.page, values)?;
            let is_black = |index: usize| colour(index) == [Some(0); 3];
            values.note(palette_note(&indices, values.meaning, is_black));
            return Ok(indices);
        }
        let mut indices = Values::new(FORMAT, Meaning::Labels);
        let indices = samples::samples(decoded, &self.page, &mut indices)?;
        let mut colours = Vec::with_capacity(3 * indices.len());
        for place in 0..indices.len() {
            let index = indices.get(place) as usize;
            let colour = colour(index).map(|value| value.filter(|_| index < count));
            let [Some(r), Some(g), Some(b)] = colour else {
                let (field, value) = ("ColorMap", format!("of {count} colours, without {index}"));
                let expected = "a colour for each index";
                return Err(ReadReason::Header { format: FORMAT, field, value, expected });
            };
            colours.extend([r, g, b]);
        }
        values.of(colours, 3)
    }

    /// Makes the decoder give numbers as they are stored on the page at which it is.
    fn show_as_stored(&mut self, plane: usize) -> Result<(), ReadReason> {
        if let Some(directory) = self.decoder.ifd_pointer() {
            self.decoder.inner().make_grey(directory.0).map_err(ReadReason::Io)?;
        }
        self.decoder.seek_to_image(plane).map_err(reason)
    }
}

#[cfg(test)]
mod tests;
