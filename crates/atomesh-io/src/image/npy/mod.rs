//! NumPy's array file, versions 1 to 3 (NEP 1): a magic, a Python dictionary as text, the samples.
//!
//! An array (z, y, x) in C order has x fastest, as our samples have; one in Fortran order is turned
//! while it is read. What else an array may be, `form` tells: of more than three axes those of length 1 are left out, and
//! a last axis of 3 or 4 is one of colours.

use std::io::Read;

use atomesh::watch::Watch;

use super::any_image::AnyImage;
use super::channels::mixed;
use super::codec::{Begins, Codec, Output, Source};
use super::colour::Values;
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::options::Meaning;
use super::spelling::Spelling;
use super::stream::{self, Layout};
use super::view::ImageView;

mod form;
mod header;
mod literal;

pub(super) use form::Form;
pub(super) use header::Header;

const FORMAT: ImageFormat = ImageFormat::named("NPY");

pub(super) const CODEC: Codec = Codec {
    endings: &[".npy"],
    begins: Begins::With(&[b"\x93NUMPY"]),
    writes_floats: true,
    write: Some(write),
    ..Codec::reading(FORMAT, read)
};

/// Samples for each byte of the file from which on a shape is called absurd and not cut short.
const ABSURD: u64 = 1 << 10;

/// Reads an array of two or three axes.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let Source { mut bytes, length: file_bytes, memory, options, .. } = source;
    let (header, start) = Header::read(&mut bytes)?;
    let form = Form::of(&header)?;
    let numbers = form.count(file_bytes, ABSURD)?;
    let found = file_bytes.saturating_sub(start) / header.sample_type.size() as u64;
    if numbers as u64 > found {
        let channels = form.channels as u64;
        let (expected, found) = (numbers as u64 / channels, found / channels);
        return Err(ReadReason::Truncated { expected, found });
    }
    read_array(&mut bytes, &header, &form, [numbers; 2], (memory, options.meaning))
}

/// Reads the array behind a header as an image: `count` numbers, of which memory is allocated for `reserve` at once.
pub(super) fn read_array(
    source: &mut dyn Read,
    header: &Header,
    form: &Form,
    [count, reserve]: [usize; 2],
    (memory, meaning): (Memory, Meaning),
) -> Result<LoadedImage, ReadReason> {
    let layout = Layout {
        sample_type: header.sample_type,
        byte_order: header.byte_order,
        count,
        reserve,
        scale: None,
        turned: form.turned,
        memory,
    };
    let mut values = Values::new(FORMAT, meaning);
    let stored = stream::read_samples(source, &layout)?;
    let (samples, notes) = match form.channels {
        1 => (stored, Vec::new()),
        channels => {
            let mixed = mixed(stored, channels, &mut values)?;
            values.finish(mixed)
        }
    };
    let loaded = LoadedImage::from(AnyImage::frameless(&form.shape, samples)?);
    let note = form.note.clone().filter(|note| {
        // labels and masks say themselves what becomes of colours
        meaning == Meaning::Brightness || !matches!(note, ReadNote::ColourAxis { .. })
    });
    let mut loaded = loaded.noting(note);
    loaded.notes.extend(notes);
    Ok(loaded)
}

/// Writes an array (y, x) or (z, y, x), version 1.0, as NumPy would.
fn write(
    out: &mut dyn Output,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let name = Spelling::of_samples(image.samples).and_then(|own| own.npy.first());
    let name = name.copied().unwrap_or("f8");
    // a single byte has no order
    let order = if name.ends_with('1') { '|' } else { '<' };
    let shape: Vec<_> = image.shape.iter().rev().map(usize::to_string).collect();
    let mut text = format!(
        "{{'descr': '{order}{name}', 'fortran_order': False, 'shape': ({}), }}",
        shape.join(", ")
    );
    // padded so that the samples begin at a multiple of 64 bytes
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&(text.len() as u16).to_le_bytes())?; // at most 192, as three numbers are short
    out.write_all(text.as_bytes())?;
    stream::write_samples(out, image.samples, FORMAT, watch)
}

#[cfg(test)]
mod tests;
