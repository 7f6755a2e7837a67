//! TIFF and BigTIFF through the `tiff` crate: one page is flat, many are the planes of a volume.
//!
//! Micrographs come as stacks of channels, slices and times. What ImageJ, OME-XML and `tifffile` say of them in the
//! description of the first page is read (`imagej`, `ome`, `shaped`), and one channel and time of it is the image
//! (`stack`). So is the size of samples, from there or from the resolution tags (`size`). Of palettes (`palette`) the
//! decoder gives the indices, for which it is shown another shade (`grey`). What it does not decode, ZSTD and unusual
//! orders of samples, `chunks` does. Thumbnails and other smaller pages are left out (`pages`). ImageJ writes stacks of more than 4 GB
//! with a single directory, the planes of all pages behind its first sample: these are read by their place (`contiguous`).

use std::io::{BufReader, Read, Seek};

use ::tiff::decoder::{Decoder, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};
use atomesh::image::{Frame, Image, Samples};

use super::any_image::AnyImage;
use super::channels::append;
use super::codec::{Begins, Codec, Source};
use super::colour::{Values, palette_note};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::options::Meaning;
use super::shape::plausible_count;

mod chunks;
mod contiguous;
mod grey;
mod imagej;
mod ome;
mod packing;
mod page;
mod pages;
mod palette;
mod predict;
mod samples;
mod shaped;
mod size;
mod stack;
mod write;

use grey::Patched;
use page::Page;
use palette::Palette;
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

/// The same of ZSTD: a block of 128 KiB of one value takes 4 bytes.
const ZSTD_DENSITY: u64 = 1 << 15;

/// Samples that a byte of the file may stand for.
fn density(page: &Page) -> u64 {
    if page.is_zstd { ZSTD_DENSITY } else { DENSITY }
}

/// Memory that a part of a file may take, however small the file is: the decoder holds a palette of 16 bits, 3 · 2¹⁶
/// numbers, in 6 MiB.
const LEAST_ROOM: usize = 8 << 20;

/// A file with its pages compared, before the first one is decoded.
struct File<R: Read + Seek> {
    decoder: Decoder<Patched<R>>,
    page: Page,
    /// The numbers, from 0, of the pages that are read.
    pages: Vec<usize>,
    file_bytes: u64,
    memory: Memory,
}

/// Reads the planes of one channel and time.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let mut values = Values::new(FORMAT, source.options.meaning);
    let bytes = BufReader::with_capacity(1 << 16, source.bytes);
    let mut notes = Vec::new();
    let mut file = File::open(bytes, (source.length, source.memory), &mut notes)?;
    let page = file.page;
    file.seek_to(0)?;
    let resolution = Resolution::of(&mut file.decoder);
    let description = page::description(&mut file.decoder).unwrap_or_else(|error| {
        let fault = error.to_string();
        notes.push(ReadNote::Description { source: "the image description", fault });
        String::new()
    });
    let stack = Stack::of(&description, &page, file.pages.len(), &mut notes)?;
    let planes = stack.chosen(&page, source.options.stack, &mut notes)?;
    let mut shape = vec![page.width, page.height];
    let depth = page.depth * planes.len();
    shape.extend((depth > 1).then_some(depth));
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
    /// Compares all pages, and leaves out those that are smaller than others.
    fn open(
        bytes: R,
        (file_bytes, memory): (u64, Memory),
        notes: &mut Vec<ReadNote>,
    ) -> Result<Self, ReadReason> {
        let mut decoder =
            Decoder::new(Patched::of(bytes).map_err(ReadReason::Io)?).map_err(reason)?;
        let true_height = decoder.inner().height();
        let mut pages = pages::Pages::default();
        loop {
            let mut page = Page::of(&mut decoder)?;
            if let Some(height) = true_height.filter(|_| page.depth > 1) {
                page.height = height;
            }
            pages.push(page, page::is_copy(&mut decoder));
            if !decoder.more_images() {
                break;
            }
            decoder.next_image().map_err(reason)?;
        }
        let (page, pages) = pages.largest(notes)?;
        let shape = [page.width, page.height, page.depth, pages.len()];
        let count = plausible_count(&shape, file_bytes, density(&page))?;
        let mut limits = Limits::default();
        limits.decoding_buffer_size = count.saturating_mul(4 * 8).max(LEAST_ROOM);
        limits.intermediate_buffer_size = limits.decoding_buffer_size.saturating_add(1 << 20);
        limits.ifd_value_size = usize::try_from(file_bytes).unwrap_or(usize::MAX).max(LEAST_ROOM);
        let decoder = decoder.with_limits(limits);
        Ok(Self { decoder, page, pages, file_bytes, memory })
    }

    /// Goes to a page, by its place among those that are read.
    fn seek_to(&mut self, plane: usize) -> Result<(), ReadReason> {
        self.decoder.seek_to_image(self.pages[plane]).map_err(reason)
    }

    /// Decodes the pages of these numbers, one after another.
    fn read(&mut self, planes: &[usize], values: &mut Values) -> Result<Samples, ReadReason> {
        let page = self.page;
        let shape = [page.width, page.height, page.depth, planes.len()];
        let count = plausible_count(&shape, self.file_bytes, density(&page))?;
        self.memory.check(count as u128 * page.sample_bytes())?;
        let mut volume = None;
        for &plane in planes {
            self.seek_to(plane)?;
            let samples = match page.color {
                ColorType::Palette(_) => self.read_indices(plane, values)?,
                _ => {
                    if page.is_white_zero && values.meaning != Meaning::Brightness {
                        values.note(ReadNote::WhiteIsZero);
                        self.show_as_stored(plane)?;
                    }
                    self.decode(values)?
                }
            };
            append(&mut volume, samples, count, self.memory)?;
        }
        volume.ok_or(ReadReason::Truncated { expected: count as u64, found: 0 })
    }

    /// Decodes the page at which the decoder is, by what values mean.
    fn decode(&mut self, values: &mut Values) -> Result<Samples, ReadReason> {
        let page = &self.page;
        if page.is_own() {
            let stored = chunks::read(&mut self.decoder, page, self.memory)?;
            return samples::of_stored(stored, page, values);
        }
        let decoded = self.decoder.read_image().map_err(reason)?;
        samples::samples(decoded, page, values)
    }

    /// Decodes a page with a palette: its colours where they are wanted, else its indices.
    fn read_indices(&mut self, plane: usize, values: &mut Values) -> Result<Samples, ReadReason> {
        let map = self.decoder.get_tag_u16_vec(Tag::ColorMap).map_err(reason)?;
        self.show_as_stored(plane)?;
        let palette = Palette::new(map);
        if matches!(values.meaning, Meaning::Labels | Meaning::Mask) {
            let indices = self.decode(values)?;
            values.note(palette_note(&indices, values.meaning, |index| palette.is_black(index)));
            return Ok(indices);
        }
        let mut as_stored = Values::new(FORMAT, Meaning::Labels);
        let indices = self.decode(&mut as_stored)?;
        if values.meaning == Meaning::Brightness {
            values.note(ReadNote::PaletteLuminance);
        }
        palette.colours(&indices, values, self.memory)
    }

    /// Makes the decoder give numbers as they are stored on the page at which it is.
    fn show_as_stored(&mut self, plane: usize) -> Result<(), ReadReason> {
        if let Some(directory) = self.decoder.ifd_pointer() {
            self.decoder.inner().make_grey(directory.0).map_err(ReadReason::Io)?;
        }
        self.seek_to(plane)
    }
}

#[cfg(test)]
mod tests;
