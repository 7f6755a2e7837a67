//! NumPy's array file, versions 1 to 3 (NEP 1): a magic, a Python dictionary as text, the samples.
//!
//! An array (z, y, x) in C order has x fastest, as our samples have; one in Fortran order is turned
//! while it is read.

use atomesh::watch::Watch;

use super::any_image::AnyImage;
use super::codec::{Begins, Codec, Output, Source};
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::note::LoadedImage;
use super::shape::plausible_count;
use super::spelling::Spelling;
use super::stream::{self, Layout};
use super::view::ImageView;

mod header;
mod literal;

use header::Header;

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
    let Source { bytes: mut source, length: file_bytes, memory, .. } = source;
    let (header, start) = Header::read(&mut source)?;
    let size = header.sample_type.size() as u64;
    let count = plausible_count(&header.shape, file_bytes, ABSURD)?;
    let found = file_bytes.saturating_sub(start) / size;
    if count as u64 > found {
        return Err(ReadReason::Truncated { expected: count as u64, found });
    }
    let turned = match *header.shape {
        _ if !header.fortran_order => None,
        [nx, ny] => Some([nx, ny, 1]),
        [nx, ny, nz] => Some([nx, ny, nz]),
        _ => None,
    };
    let layout = Layout {
        sample_type: header.sample_type,
        byte_order: header.byte_order,
        count,
        reserve: count,
        scale: None,
        turned,
        memory,
    };
    let samples = stream::read_samples(&mut source, &layout)?;
    Ok(AnyImage::frameless(&header.shape, samples)?.into())
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
