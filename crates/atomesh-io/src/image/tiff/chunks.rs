//! Strips and tiles of pages that the `tiff` crate does not decode: packed by ZSTD, with a plane for each channel, with
//! a depth (a volume in one page, in tiles of several planes), or with channels that it has no name for. No header makes
//! more be read or unpacked than the page's size asks for.
//!
//! The samples of a page are put together as the file has them, in its order of bytes, then read as any others are.

use std::io::{Read, Seek, SeekFrom};

use ::tiff::decoder::Decoder;
use ::tiff::tags::{ByteOrder as TiffOrder, Tag};
use atomesh::image::Samples;

use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::sample_type::{ByteOrder, SampleType};
use super::super::stream::{self, Layout};
use super::packing::Packing;
use super::page::Page;
use super::predict::Predictor;
use super::{FORMAT, reason};

/// Tags that the `tiff` crate has no name for.
pub(super) const IMAGE_DEPTH: Tag = Tag::Unknown(32_997);
const TILE_DEPTH: Tag = Tag::Unknown(32_998);

/// How the chunks of a page lie.
struct Chunks {
    /// Samples of a chunk along x, y and z.
    size: [usize; 3],
    /// Chunks along x, y and z.
    counts: [usize; 3],
    offsets: Vec<u64>,
    lengths: Vec<u64>,
    /// Whether a chunk is less high where the page ends; tiles are filled up.
    are_strips: bool,
}

fn wrong(field: &'static str, value: impl ToString, expected: &'static str) -> ReadReason {
    ReadReason::Header { format: FORMAT, field, value: value.to_string(), expected }
}

/// Reads the numbers of the page at which the decoder is as they are stored, the channels of each sample together; of
/// fewer than 8 bits the bytes of each row.
pub(super) fn read<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    page: &Page,
    memory: Memory,
) -> Result<Samples, ReadReason> {
    let chunks = Chunks::of(decoder, page)?;
    let packing = Packing::of(decoder)?;
    let predictor = Predictor::of(decoder, page)?;
    let order = match decoder.byte_order() {
        TiffOrder::LittleEndian => ByteOrder::Little,
        TiffOrder::BigEndian => ByteOrder::Big,
    };
    let rows = Rows::of(page);
    let total = page.width_bytes().checked_mul(page.height).and_then(|n| n.checked_mul(page.depth));
    let total = total.ok_or_else(|| wrong("ImageWidth", page.width, "a size that fits memory"))?;
    // twice, as bytes and as samples
    memory.check(2 * total as u128)?;
    let mut bytes: Vec<u8> = memory.zeros(total)?;
    let per_plane: usize = chunks.counts.iter().product();
    for index in 0..per_plane * page.planes() {
        let (channel, place) = (index / per_plane, index % per_plane);
        let chunk = chunks.place(place, page);
        let row_bytes = rows.chunk_bytes(chunks.size[0]);
        let expected = row_bytes.saturating_mul(chunk.stored[1]).saturating_mul(chunk.stored[2]);
        let packed = chunks.packed(decoder.inner(), index, expected)?;
        let mut unpacked = packing.unpack(packed, expected, memory)?;
        unpacked.chunks_exact_mut(row_bytes).for_each(|row| predictor.undo(row, order));
        rows.put(&mut bytes, &unpacked, &chunk, channel, page);
    }
    let sample_type = if page.bits() < 8 {
        SampleType::U8
    } else {
        page.sample_type().ok_or_else(|| {
            let found = format!("samples of {} bits", page.bits());
            ReadReason::Unsupported { format: FORMAT, found, expected: "8, 16, 32 or 64 bits" }
        })?
    };
    let count = total / sample_type.size();
    let (scale, turned) = (None, None);
    let layout =
        Layout { sample_type, byte_order: order, count, reserve: count, scale, turned, memory };
    stream::read_samples(&mut &bytes[..], &layout)
}

impl Chunks {
    fn of<R: Read + Seek>(decoder: &mut Decoder<R>, page: &Page) -> Result<Self, ReadReason> {
        let mut number = |tag: Tag| decoder.find_tag_unsigned::<u32>(tag).map_err(reason);
        let tile = [number(Tag::TileWidth)?, number(Tag::TileLength)?];
        let depth = number(TILE_DEPTH)?.unwrap_or(1) as usize;
        let rows = number(Tag::RowsPerStrip)?.map_or(page.height, |n| n as usize).min(page.height);
        let are_strips = tile.contains(&None);
        let size = match tile {
            [Some(width), Some(height)] => [width as usize, height as usize, depth],
            _ => [page.width, rows, 1],
        };
        // the decoder's own limit of a tile: no more than the page asks for, or a usual tile
        if size.contains(&0)
            || size
                .iter()
                .zip([page.width, page.height, page.depth])
                .any(|(n, of)| *n > of.max(4096))
        {
            return Err(wrong("tile", format!("{size:?}"), "sides of the page's, or up to 4096"));
        }
        let counts = [
            page.width.div_ceil(size[0]),
            page.height.div_ceil(size[1]),
            page.depth.div_ceil(size[2]),
        ];
        let [offsets, lengths] = match are_strips {
            true => [Tag::StripOffsets, Tag::StripByteCounts],
            false => [Tag::TileOffsets, Tag::TileByteCounts],
        };
        let offsets = decoder.get_tag_u64_vec(offsets).map_err(reason)?;
        let lengths = decoder.get_tag_u64_vec(lengths).map_err(reason)?;
        let all = counts.iter().try_fold(page.planes(), |n, &m| n.checked_mul(m));
        if all.is_none_or(|all| all > offsets.len() || all > lengths.len()) {
            let value = offsets.len().min(lengths.len());
            return Err(wrong("chunks", value, "one for each part of the page"));
        }
        Ok(Self { size, counts, offsets, lengths, are_strips })
    }

    /// Where a chunk lies in the page, and how much of it is stored.
    fn place(&self, index: usize, page: &Page) -> Chunk {
        let [across, down, _] = self.counts;
        let at = [index % across, index / across % down, index / across / down];
        let of = [page.width, page.height, page.depth];
        let start = std::array::from_fn(|k| at[k] * self.size[k]);
        let kept: [usize; 3] = std::array::from_fn(|k| self.size[k].min(of[k] - start[k]));
        Chunk { start, kept, stored: if self.are_strips { kept } else { self.size } }
    }

    /// The bytes of a chunk as they are in the file, no more than `expected` ones can take.
    fn packed<R: Read + Seek>(
        &self,
        source: &mut R,
        index: usize,
        expected: usize,
    ) -> Result<Vec<u8>, ReadReason> {
        source.seek(SeekFrom::Start(self.offsets[index])).map_err(ReadReason::Io)?;
        let mut packed = Vec::new();
        let most = (expected as u64).saturating_mul(2).saturating_add(4096);
        let read = (&mut *source).take(self.lengths[index].min(most)).read_to_end(&mut packed);
        read.map_err(ReadReason::Io)?;
        Ok(packed)
    }
}

/// A part of a page.
struct Chunk {
    /// Its first sample along x, y and z.
    start: [usize; 3],
    /// Its samples that are in the page.
    kept: [usize; 3],
    /// Those that are in the file.
    stored: [usize; 3],
}

/// How the bytes of rows lie.
struct Rows {
    /// Bits of a value.
    bits: usize,
    /// Values of a sample in the page, and those that a chunk has of it.
    channels: [usize; 2],
}

impl Rows {
    fn of(page: &Page) -> Self {
        let all = page.channels();
        let in_chunk = if page.planes() > 1 { 1 } else { all };
        Self { bits: page.bits(), channels: [all, in_chunk] }
    }

    /// Bytes of a row of a chunk so many samples wide.
    fn chunk_bytes(&self, width: usize) -> usize {
        width.saturating_mul(self.bits * self.channels[1]).div_ceil(8)
    }

    /// Puts a chunk into its place.
    fn put(&self, bytes: &mut [u8], chunk: &[u8], place: &Chunk, channel: usize, page: &Page) {
        let Chunk { start, kept, stored } = place;
        let stored_row = chunk.len() / (stored[1] * stored[2]).max(1);
        let page_row = page.width_bytes();
        for z in 0..kept[2] {
            for y in 0..kept[1] {
                let from = &chunk[(z * stored[1] + y) * stored_row..][..stored_row];
                let row = (start[2] + z) * page.height + start[1] + y;
                let to = &mut bytes[row * page_row..][..page_row];
                self.put_row(to, from, [start[0], kept[0]], channel);
            }
        }
    }

    /// Puts `count` samples of a row from the sample `first` on.
    fn put_row(&self, to: &mut [u8], from: &[u8], [first, count]: [usize; 2], channel: usize) {
        let [all, in_chunk] = self.channels;
        if all == in_chunk {
            // chunks begin at whole bytes, since tiles are a multiple of 8 samples wide
            let (begin, length) =
                (first * self.bits * all / 8, (count * self.bits * all).div_ceil(8));
            to[begin..begin + length].copy_from_slice(&from[..length]);
            return;
        }
        let size = self.bits / 8;
        for (k, value) in from.chunks_exact(size).take(count).enumerate() {
            let place = ((first + k) * all + channel) * size;
            to[place..place + size].copy_from_slice(value);
        }
    }
}
