//! How the bytes of a strip or a tile are packed.

use std::io::{Read, Seek};

use ::tiff::decoder::Decoder;
use ::tiff::tags::Tag;
use ruzstd::decoding::StreamingDecoder;

use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::{FORMAT, reason};

/// The code of ZSTD in the tag of the compression, and one that was used before.
pub(super) const ZSTD: [u16; 2] = [50_000, 34_926];

/// The greatest window of a ZSTD frame that is decoded: what its decoders are bound to take.
const MOST_WINDOW: u64 = 1 << 27;

/// How chunks are packed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Method {
    Plain,
    Lzw,
    Deflate,
    PackBits,
    Zstd,
}

/// How chunks are packed, and whether the bits of their bytes are turned round.
pub(super) struct Packing {
    method: Method,
    is_turned: bool,
}

impl Packing {
    /// The packing of the page at which the decoder is.
    pub fn of<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Self, ReadReason> {
        let code = decoder.find_tag_unsigned::<u16>(Tag::Compression).map_err(reason)?.unwrap_or(1);
        let fill = decoder.find_tag_unsigned::<u16>(Tag::FillOrder).map_err(reason)?.unwrap_or(1);
        let method = match code {
            1 => Method::Plain,
            5 => Method::Lzw,
            8 | 32_946 => Method::Deflate,
            32_773 => Method::PackBits,
            code if ZSTD.contains(&code) => Method::Zstd,
            other => {
                return Err(ReadReason::Unsupported {
                    format: FORMAT,
                    found: format!("channels, planes or a depth with compression {other}"),
                    expected: "none, LZW, deflate, PackBits or ZSTD there",
                });
            }
        };
        Ok(Self { method, is_turned: fill == 2 })
    }

    /// Exactly `expected` bytes of a chunk; what is behind them does not count. Memory grows as bytes come.
    pub fn unpack(
        &self,
        mut packed: Vec<u8>,
        expected: usize,
        memory: Memory,
    ) -> Result<Vec<u8>, ReadReason> {
        memory.check(expected as u128)?;
        if self.is_turned {
            packed.iter_mut().for_each(|byte| *byte = byte.reverse_bits());
        }
        let mut unpacked = match self.method {
            Method::Plain => packed,
            Method::Lzw => lzw(&packed, expected)?,
            Method::Deflate => taken(flate2::read::ZlibDecoder::new(&packed[..]), expected)?,
            Method::PackBits => pack_bits(&packed, expected),
            Method::Zstd => {
                let frame = StreamingDecoder::new_with_max_window_size(&packed[..], MOST_WINDOW);
                taken(frame.map_err(|e| ReadReason::decoder(FORMAT, e.to_string()))?, expected)?
            }
        };
        if unpacked.len() < expected {
            let error =
                format!("a strip or tile has {} bytes; expected {expected}", unpacked.len());
            return Err(ReadReason::decoder(FORMAT, error));
        }
        unpacked.truncate(expected);
        Ok(unpacked)
    }
}

/// At most so many bytes of a stream.
fn taken(stream: impl Read, expected: usize) -> Result<Vec<u8>, ReadReason> {
    let mut unpacked = Vec::new();
    let read = stream.take(expected as u64).read_to_end(&mut unpacked);
    read.map_err(|e| ReadReason::decoder(FORMAT, e))?;
    Ok(unpacked)
}

fn lzw(packed: &[u8], expected: usize) -> Result<Vec<u8>, ReadReason> {
    let mut decoder = weezl::decode::Decoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8);
    let (mut unpacked, mut rest) = (Vec::new(), packed);
    let mut buffer = vec![0; 1 << 15];
    // each turn takes or gives a byte, or is the last
    while unpacked.len() < expected {
        let result = decoder.decode_bytes(rest, &mut buffer);
        unpacked.extend_from_slice(&buffer[..result.consumed_out]);
        rest = &rest[result.consumed_in..];
        result.status.map_err(|e| ReadReason::decoder(FORMAT, e.to_string()))?;
        if result.consumed_in + result.consumed_out == 0 {
            break;
        }
    }
    Ok(unpacked)
}

/// Apple's PackBits: a count, and bytes as they are, or one to repeat.
fn pack_bits(packed: &[u8], expected: usize) -> Vec<u8> {
    let (mut unpacked, mut rest) = (Vec::new(), packed);
    while let [count, tail @ ..] = rest
        && unpacked.len() < expected
    {
        rest = tail;
        match count.cast_signed() {
            count @ 0.. => {
                let (plain, tail) = rest.split_at((count as usize + 1).min(rest.len()));
                unpacked.extend_from_slice(plain);
                rest = tail;
            }
            -128 => {}
            count => {
                let [byte, tail @ ..] = rest else { break };
                unpacked.resize(unpacked.len() + count.unsigned_abs() as usize + 1, *byte);
                rest = tail;
            }
        }
    }
    unpacked
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpack(method: Method, packed: &[u8], expected: usize) -> Result<Vec<u8>, ReadReason> {
        let packing = Packing { method, is_turned: false };
        packing.unpack(packed.to_vec(), expected, Memory::default())
    }

    #[test]
    fn pack_bits_are_apples() {
        // the example of Apple's technical note 1023
        let packed = [
            0xfe, 0xaa, 0x02, 0x80, 0x00, 0x2a, 0xfd, 0xaa, 0x03, 0x80, 0x00, 0x2a, 0x22, 0xf7,
            0xaa,
        ];
        let plain = [
            &[0xaa; 3][..],
            &[0x80, 0x00, 0x2a],
            &[0xaa; 4],
            &[0x80, 0x00, 0x2a, 0x22],
            &[0xaa; 10],
        ];
        assert_eq!(unpack(Method::PackBits, &packed, 24).unwrap(), plain.concat());
        assert!(unpack(Method::PackBits, &packed[..14], 24).is_err());
    }

    #[test]
    fn every_packing_gives_as_many_bytes_as_wanted_or_an_error() {
        let plain: Vec<u8> = (0..40_000u32).map(|k| (k / 300) as u8).collect();
        let mut lzw = weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8);
        let zstd = ruzstd::encoding::compress_to_vec(
            &plain[..],
            ruzstd::encoding::CompressionLevel::Fastest,
        );
        let mut deflate = flate2::read::ZlibEncoder::new(&plain[..], flate2::Compression::fast());
        let mut deflated = Vec::new();
        deflate.read_to_end(&mut deflated).unwrap();
        for (method, packed) in [
            (Method::Plain, plain.clone()),
            (Method::Lzw, lzw.encode(&plain).unwrap()),
            (Method::Zstd, zstd),
            (Method::Deflate, deflated),
        ] {
            assert_eq!(unpack(method, &packed, plain.len()).unwrap(), plain, "{method:?}");
            assert_eq!(unpack(method, &packed, 999).unwrap(), plain[..999], "{method:?}");
            assert!(unpack(method, &packed, plain.len() + 1).is_err(), "{method:?}");
            assert!(
                unpack(method, &packed[..packed.len() / 2], plain.len()).is_err(),
                "{method:?}"
            );
        }
    }
}
