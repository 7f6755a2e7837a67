//! Stacks with one directory: the planes of all pages follow each other behind the first sample of the first one, as
//! ImageJ writes stacks of more than 4 GB, whose later planes no 32-bit offset reaches.

use std::io::{Read, Seek, SeekFrom};

use ::tiff::decoder::ChunkType;
use ::tiff::tags::{ByteOrder as TiffOrder, Tag};
use atomesh::image::Samples;

use super::super::channels::{append, mixed};
use super::super::colour::Values;
use super::super::error::ReadReason;
use super::super::options::Meaning;
use super::super::sample_type::ByteOrder;
use super::super::stream::{self, Layout};
use super::{FORMAT, File, reason};

/// Not compressed.
const PLAIN: u16 = 1;

/// Reads planes by their numbers; a file holds `plane_count` in all.
pub(super) fn read<R: Read + Seek>(
    file: &mut File<R>,
    plane_count: usize,
    planes: &[usize],
    values: &mut Values,
) -> Result<Samples, ReadReason> {
    let (start, layout) = layout(file, values.meaning)?;
    let sample_bytes = layout.sample_type.size() as u64 * file.page.channels() as u64;
    let plane_samples = (file.page.width * file.page.height) as u64;
    let expected = plane_samples.saturating_mul(plane_count as u64);
    let found = file.file_bytes.saturating_sub(start) / sample_bytes;
    if found < expected {
        return Err(ReadReason::Truncated { expected, found });
    }
    let count = plane_samples as usize * planes.len();
    let mut volume = None;
    for &plane in planes {
        let place = start + plane as u64 * plane_samples * sample_bytes;
        let source = file.decoder.inner();
        source.seek(SeekFrom::Start(place)).map_err(ReadReason::Io)?;
        let stored = stream::read_samples(source, &layout)?;
        let plane = mixed(stored, file.page.channels(), values)?;
        append(&mut volume, plane, count, file.memory)?;
    }
    volume.ok_or(ReadReason::Truncated { expected, found: 0 })
}

/// Where the samples of the first plane begin, and how those of each lie.
fn layout<R: Read + Seek>(
    file: &mut File<R>,
    meaning: Meaning,
) -> Result<(u64, Layout), ReadReason> {
    let page = file.page;
    let unsupported = |found: &str| ReadReason::Unsupported {
        format: FORMAT,
        found: format!("{found}, and one directory for several planes"),
        expected: "samples of whole bytes there, not compressed, in strips",
    };
    let decoder = &mut file.decoder;
    let compression = decoder.find_tag_unsigned::<u16>(Tag::Compression).map_err(reason)?;
    if compression.unwrap_or(PLAIN) != PLAIN {
        return Err(unsupported("compressed samples"));
    }
    if decoder.get_chunk_type() != ChunkType::Strip {
        return Err(unsupported("tiles"));
    }
    if page.is_white_zero && meaning == Meaning::Brightness {
        return Err(unsupported("samples with 0 for white"));
    }
    let sample_type = page.sample_type().ok_or_else(|| unsupported("samples of few bits"))?;
    let strips = decoder.get_tag_u64_vec(Tag::StripOffsets).map_err(reason)?;
    let start = *strips.first().ok_or_else(|| unsupported("no strips"))?;
    let byte_order = match decoder.byte_order() {
        TiffOrder::LittleEndian => ByteOrder::Little,
        TiffOrder::BigEndian => ByteOrder::Big,
    };
    let count = page.width.saturating_mul(page.height).saturating_mul(page.channels());
    let (scale, turned, memory) = (None, None, file.memory);
    let layout = Layout { sample_type, byte_order, count, reserve: count, scale, turned, memory };
    Ok((start, layout))
}
