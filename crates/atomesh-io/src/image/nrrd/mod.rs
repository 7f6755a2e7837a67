//! NRRD, nearly raw raster data: a header in text, then the samples, x fastest; or the header alone
//! (`.nhdr`) and the samples in other files.
//!
//! Definition: <https://teem.sourceforge.net/nrrd/format.html>. Read are the encodings raw, ascii and
//! gzip. A `space` of a body (left-posterior-superior, left-anterior-superior) is turned to RAS, as
//! NIfTI's is; any other stands as it is. Axes that are no space, such as colours or tensors, are
//! refused unless they have a single value.
//!
//! Written is gzip, with `space: right-anterior-superior` in 3-D: whoever knows bodies then finds the
//! image where the scan was, and to others the name says nothing.

use std::io::{BufReader, Read, Write};
use std::path::Path;

use atomesh::image::Image;
use atomesh::watch::Watch;
use flate2::write::GzEncoder;

use super::affine::{self, Affine};
use super::stream;
use super::text::Lines;
use super::watched::Watched;
use super::{ImageFormat, LoadedImage, ReadReason, WriteReason};

mod header;

use header::Header;

const FORMAT: ImageFormat = ImageFormat::Nrrd;

/// Reads a `.nrrd` or `.nhdr` file that stands in `folder`, if it stands in one.
pub(super) fn read<R: Read>(
    source: Watched<R>,
    file_bytes: u64,
    folder: Option<&Path>,
) -> Result<LoadedImage, ReadReason> {
    let mut source = BufReader::with_capacity(1 << 16, source);
    let mut lines = Lines::new(&mut source);
    let header = Header::read(&mut lines)?;
    let rest = file_bytes.saturating_sub(lines.bytes);
    let payload = header.payload;
    let read = || payload.read(source, rest, folder);
    let image = affine::image(FORMAT, &payload.shape, header.affine, read)?;
    Ok(LoadedImage::from(image).noting(header.world.note()))
}

/// Writes a `.nrrd` file; numbers have all their digits, so that the frame is kept exactly.
pub(super) fn write<const D: usize>(
    out: &mut dyn Write,
    image: &Image<D>,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let kind = match image.samples().type_name() {
        "float32" => "float",
        "float64" => "double",
        integer => integer,
    };
    let affine = Affine::of(image.frame());
    let vector = |numbers: [f64; D]| {
        let words: Vec<_> = numbers.iter().map(f64::to_string).collect();
        format!("({})", words.join(","))
    };
    let column = |c: usize| vector(std::array::from_fn(|r| affine.matrix[r][c]));
    let directions: Vec<_> = (0..D).map(column).collect();
    let sizes: Vec<_> = image.frame().shape().iter().map(usize::to_string).collect();
    // the format wants the world's axes before anything that is counted by them
    let space = match D {
        3 => "space: right-anterior-superior".into(),
        _ => format!("space dimension: {D}"),
    };
    let (sizes, directions) = (sizes.join(" "), directions.join(" "));
    let (kinds, origin) = (["domain"; D].join(" "), vector(image.frame().origin()));
    write!(
        out,
        "NRRD0004\n\
         type: {kind}\n\
         dimension: {D}\n\
         {space}\n\
         sizes: {sizes}\n\
         space directions: {directions}\n\
         kinds: {kinds}\n\
         endian: little\n\
         encoding: gzip\n\
         space origin: {origin}\n\n"
    )?;
    let mut packed = GzEncoder::new(out, flate2::Compression::fast());
    stream::write_samples(&mut packed, image.samples(), FORMAT, watch)?;
    packed.finish()?;
    Ok(())
}
