//! NRRD, nearly raw raster data: a header in text, then the samples, x fastest; or the header alone
//! (`.nhdr`) and the samples in other files.
//!
//! Definition: <https://teem.sourceforge.net/nrrd/format.html>. The encodings raw, ascii, hex, gzip and bzip2
//! are read. A `space` of a body (left-posterior-superior, left-anterior-superior) is turned to RAS, as
//! NIfTI's is; any other stands as it is. Axes of other kinds, such as colours or tensors, are
//! refused unless they have a single value.
//!
//! Segmentations of 3D Slicer (`.seg.nrrd`) name their segments in keys of the header. Where segments overlap they are
//! in several layers, the first axis, and one must be chosen.
//!
//! Written is gzip, with `space: right-anterior-superior` in 3-D: medical programs then find the image
//! where the scan was, and others ignore the name.

use std::io::BufReader;

use atomesh::watch::Watch;
use flate2::write::GzEncoder;

use super::affine;
use super::codec::{Begins, Codec, Output, Source};
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::note::LoadedImage;
use super::spelling::Spelling;
use super::stream;
use super::text::Lines;
use super::view::ImageView;

mod header;
mod segments;

use header::Header;

const FORMAT: ImageFormat = ImageFormat::named("NRRD");

pub(super) const CODEC: Codec = Codec {
    endings: &[".nrrd"],
    header_endings: &[".nhdr"],
    begins: Begins::With(&[b"NRRD000"]),
    has_frame: true,
    z_is_height: true,
    writes_floats: true,
    write: Some(write),
    ..Codec::reading(FORMAT, read)
};

/// Reads a `.nrrd` or `.nhdr` file.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let Source { bytes: source, length: file_bytes, folders, memory, options, .. } = source;
    let mut source = BufReader::with_capacity(1 << 16, source);
    let mut lines = Lines::new(&mut source);
    let header = Header::read(&mut lines)?;
    let rest = file_bytes.saturating_sub(lines.bytes);
    let payload = header.payload;
    let chosen = segments::chosen(&header.segments, header.layers, options.segment.as_deref())?;
    let read = || match &chosen {
        Some(chosen) => {
            let mut layered = payload.clone();
            layered.shape[0] = layered.shape[0].saturating_mul(header.layers);
            let stored = layered.read(source, rest, folders, memory)?;
            chosen.segment.inside(&stored, header.layers, memory)
        }
        None => payload.read(source, rest, folders, memory),
    };
    let affine = header.affine.with_given(options.given);
    let loaded = affine::placed(FORMAT, &payload.shape, affine, read)?;
    Ok(loaded.noting(header.world.note()).noting(chosen.map(|chosen| chosen.note())))
}

/// Writes a `.nrrd` file; numbers have all their digits, so that the frame is kept exactly.
fn write(
    out: &mut dyn Output,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let axes = image.dimension();
    let name = Spelling::of_samples(image.samples).and_then(|own| own.nrrd.first());
    let kind = name.copied().unwrap_or_else(|| image.samples.type_name());
    let affine = image.affine();
    let vector = |number: &dyn Fn(usize) -> f64| {
        let words: Vec<_> = (0..axes).map(|axis| number(axis).to_string()).collect();
        format!("({})", words.join(","))
    };
    let directions: Vec<_> = (0..axes).map(|c| vector(&|r| affine.matrix[r][c])).collect();
    let sizes: Vec<_> = image.shape.iter().map(usize::to_string).collect();
    // the format wants the world's axes before anything that is counted by them
    let space = match axes {
        3 => "space: right-anterior-superior".into(),
        _ => format!("space dimension: {axes}"),
    };
    let (sizes, directions) = (sizes.join(" "), directions.join(" "));
    let (kinds, origin) = (vec!["domain"; axes].join(" "), vector(&|r| image.origin[r]));
    write!(
        out,
        "NRRD0004\n\
         type: {kind}\n\
         dimension: {axes}\n\
         {space}\n\
         sizes: {sizes}\n\
         space directions: {directions}\n\
         kinds: {kinds}\n\
         endian: little\n\
         encoding: gzip\n\
         space origin: {origin}\n\n"
    )?;
    let mut packed = GzEncoder::new(out, flate2::Compression::fast());
    stream::write_samples(&mut packed, image.samples, FORMAT, watch)?;
    packed.finish()?;
    Ok(())
}
