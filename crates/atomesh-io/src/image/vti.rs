//! VTI, VTK's XML format for images: text, base64 or raw data, inline or appended, plain or packed by
//! zlib, LZ4 or LZMA.
//!
//! World coordinates stand as they are in the file: VTK knows no body. One piece and one array of
//! scalars is read: that which is asked for, else that which the file names as its scalars, else the first. Samples are the points; a
//! file that has values in cells alone has its samples in their middles, so the origin moves by half a
//! step. An image of a single layer in z is flat.
//!
//! Written is one array of points, `image`, appended as zlib blocks, as in VTU files.

use std::io::Read;

use atomesh::image::Samples;
use atomesh::watch::Watch;

use super::affine::{self, Affine};
use super::codec::{Begins, Codec, Output, Source};
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::sample_type::ByteOrder;
use super::shape::plausible_count;
use super::spelling::{self, Spelling};
use super::stream::{self, GZIP_RATIO, Layout};
use super::text::{TextSamples, numbers, shortened};
use super::view::ImageView;
use crate::mesh::MeshWriteError;
use crate::mesh::column::{Column, Endian};
use crate::mesh::vtu::appended::Head;
use crate::mesh::vtu::array::{Array, Place};
use crate::mesh::vtu::compressor::Compressor;
use crate::mesh::vtu::read::{Document, Piece};
use crate::mesh::vtu::xml::Tag;

const FORMAT: ImageFormat = ImageFormat::named("VTI");

pub(super) const CODEC: Codec = Codec {
    endings: &[".vti"],
    begins: Begins::If(|head| {
        // an XML declaration may come first, and a byte order mark before that
        let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
        head.is_empty() || head.starts_with(b"<")
    }),
    has_frame: true,
    z_is_height: true,
    writes_floats: true,
    write: Some(write),
    ..Codec::reading(FORMAT, read)
};

/// The names of arrays that a message lists.
const LISTED: usize = 20;

/// VTK's name of this kind of file.
const KIND: &str = "ImageData";

fn wrong(field: &'static str, value: &str, expected: &'static str) -> ReadReason {
    affine::wrong(FORMAT, field, shortened(value), expected)
}

fn unsupported(found: String, expected: &'static str) -> ReadReason {
    ReadReason::Unsupported { format: FORMAT, found, expected }
}

/// Reads a `.vti` file, which is held whole meanwhile.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let Source { bytes: mut source, length: file_bytes, memory, options, .. } = source;
    let mut bytes = Vec::new();
    memory.reserve(&mut bytes, usize::try_from(file_bytes).unwrap_or(usize::MAX))?;
    source.read_to_end(&mut bytes).map_err(ReadReason::Io)?;
    let decoder = |e| ReadReason::decoder(FORMAT, e);
    let document = Document::parse(&bytes, KIND).map_err(decoder)?;
    let [piece] = document.pieces.as_slice() else {
        let found = format!("{} pieces", document.pieces.len());
        return Err(unsupported(found, "one piece"));
    };
    let grid =
        document.grid.as_ref().ok_or_else(|| wrong(KIND, "missing", "a tag of that name"))?;
    let (first, mut shape) = extent(piece.extent)?;
    let mut affine = affine_of(grid)?;
    let wanted = options.array.as_deref();
    let (array, is_of_cells) = scalars(piece, wanted)?;
    // sample 0 is where the extent begins
    let mut start = first;
    if is_of_cells {
        for (count, start) in shape.iter_mut().zip(&mut start).filter(|(count, _)| **count > 1) {
            *count -= 1;
            *start += 0.5;
        }
    }
    for r in 0..3 {
        affine.origin[r] += (0..3).map(|c| affine.matrix[r][c] * start[c]).sum::<f64>();
    }
    let read = || samples(array, &shape, file_bytes, memory);
    let loaded = affine::placed(FORMAT, &shape, affine.with_given(options.given), read)?;
    let chosen = wanted.map(|name| ReadNote::OneArray {
        name: name.into(),
        others: Vec::new(),
        is_chosen: true,
    });
    Ok(loaded.noting(is_of_cells.then_some(ReadNote::Cells)).noting(chosen))
}

/// The first index along each axis, and the shape, of six numbers.
fn extent(text: &str) -> Result<([f64; 3], [usize; 3]), ReadReason> {
    let error = || wrong("Extent", text, "first and last index along x, y and z");
    let ends: Vec<i64> = numbers(text).ok_or_else(error)?;
    if ends.len() != 6 {
        return Err(error());
    }
    let mut shape = [0; 3];
    for axis in 0..3 {
        let count = ends[2 * axis + 1].checked_sub(ends[2 * axis]).and_then(|n| n.checked_add(1));
        shape[axis] = count.filter(|&n| n > 0).ok_or_else(error)? as usize;
    }
    Ok((std::array::from_fn(|axis| ends[2 * axis] as f64), shape))
}

/// Indices to world coordinates.
fn affine_of(grid: &Tag) -> Result<Affine, ReadReason> {
    let listed = |name: &'static str, count: usize, default: &[f64]| {
        let Some(text) = grid.get(name) else { return Ok(default.to_vec()) };
        let all = numbers::<f64>(text).filter(|all| all.len() == count);
        all.ok_or_else(|| wrong(name, text, "3 numbers, 9 in a Direction"))
    };
    let origin = listed("Origin", 3, &[0.0; 3])?;
    let spacing = listed("Spacing", 3, &[1.0; 3])?;
    let direction = listed("Direction", 9, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])?;
    Ok(Affine {
        matrix: std::array::from_fn(|r| std::array::from_fn(|c| direction[3 * r + c] * spacing[c])),
        origin: std::array::from_fn(|r| origin[r]),
    })
}

/// The array that holds the image, that which is wanted or else the file's scalars, and whether it is one of cells.
fn scalars<'a, 'b>(
    piece: &'b Piece<'a>,
    wanted: Option<&str>,
) -> Result<(&'b Array<'a>, bool), ReadReason> {
    let has_wanted =
        |arrays: &[Array]| wanted.is_some_and(|name| arrays.iter().any(|a| a.name == name));
    let is_of_cells = match wanted {
        Some(_) => !has_wanted(&piece.point_data),
        None => piece.point_data.is_empty(),
    };
    let arrays = if is_of_cells { &piece.cell_data } else { &piece.point_data };
    if let Some(wanted) = wanted.filter(|_| !has_wanted(arrays)) {
        let names = piece.point_data.iter().chain(&piece.cell_data);
        let names: Vec<_> = names.take(LISTED).map(|array| array.name).collect();
        return Err(ReadReason::Arrays { found: names.join(", "), wanted: Some(wanted.into()) });
    }
    let named = wanted.or(piece.scalars[usize::from(is_of_cells)]).filter(|name| !name.is_empty());
    let named = named.and_then(|name| arrays.iter().find(|a| a.name == name));
    let found = named.or_else(|| arrays.iter().find(|a| a.components == 1)).or(arrays.first());
    match found {
        Some(array) if array.components == 1 => Ok((array, is_of_cells)),
        Some(Array { name, components, .. }) => {
            let found = format!("an array {name:?} of {components} values a sample");
            Err(unsupported(found, "one value a sample"))
        }
        None => Err(unsupported("no array of points or cells".into(), "one array of scalars")),
    }
}

/// The samples of an array.
fn samples(
    array: &Array,
    shape: &[usize; 3],
    file_bytes: u64,
    memory: Memory,
) -> Result<Samples, ReadReason> {
    let sample_type = spelling::named(array.kind, |own| own.vtk).ok_or_else(|| {
        unsupported(format!("samples of type {}", array.kind), "Int8 ... Float64")
    })?;
    let density = array.layout.compressor.map_or(1, Compressor::ratio).max(GZIP_RATIO);
    let count = plausible_count(shape, file_bytes, density)?;
    let is_big = array.layout.endian == Endian::Big && !matches!(array.place, Place::Text(_));
    let byte_order = if is_big { ByteOrder::Big } else { ByteOrder::Little };
    let layout = Layout {
        sample_type,
        byte_order,
        count,
        reserve: count,
        scale: None,
        turned: None,
        memory,
    };
    if let Place::Text(at) = array.place {
        let count = plausible_count(shape, file_bytes, 1)?;
        let mut words = TextSamples::new(array.text(at).as_bytes(), sample_type);
        return stream::read_samples(&mut words, &Layout { count, ..layout });
    }
    // twice, as bytes and as samples
    memory.check(2 * count as u128 * sample_type.size() as u128)?;
    let bytes = array.bytes(count.checked_mul(sample_type.size()));
    let bytes = bytes.map_err(|e| ReadReason::decoder(FORMAT, e))?;
    stream::read_samples(&mut &bytes[..], &layout)
}

/// Writes a `.vti` file; numbers have all their digits, so that the frame is kept exactly.
fn write(
    mut out: &mut dyn Output,
    image: &ImageView,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let listed = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let last = |axis: usize| image.shape.get(axis).map_or(0, |n| n - 1);
    let extent = format!("0 {} 0 {} 0 {}", last(0), last(1), last(2));
    let mut head = Head::with_attributes(
        KIND,
        &format!(
            "WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\" Direction=\"{}\"",
            listed(&image.origin),
            listed(&image.spacing),
            listed(image.direction.as_flattened())
        ),
    );
    head.text(&format!("<Piece Extent=\"{extent}\">\n<PointData Scalars=\"image\">\n"));
    let name = Spelling::of_samples(image.samples).and_then(|own| own.vtk.first());
    let column = column(image.samples);
    let (Some(name), Some(column)) = (name, column) else {
        return Err(WriteReason::SampleType {
            format: FORMAT,
            sample_type: image.samples.type_name(),
            expected: "integers up to 32 bits, float32 and float64",
        });
    };
    head.array(name, "image", "", column);
    head.text("</PointData>\n</Piece>\n");
    head.write(&mut out, watch).map_err(|e| match e {
        MeshWriteError::Io(e) => WriteReason::Io(e),
        MeshWriteError::Cancelled(e) => WriteReason::Cancelled(e),
        other => WriteReason::Encoder { format: FORMAT, error: other.into() },
    })
}

/// The samples as an array of the file; none for a type that is not known here.
fn column(samples: &Samples) -> Option<Column<'_>> {
    /// Makes the array with one function for each type.
    macro_rules! column_of {
        ($($kind:ident),*) => {
            match samples {
                $(Samples::$kind(v) => Some(Column::slice(v, Endian::Little)),)*
                _ => None,
            }
        };
    }
    column_of!(U8, I8, U16, I16, U32, I32, F32, F64)
}
