//! What packs the blocks of VTK's XML files: zlib, LZ4 or LZMA.

use std::fmt;
use std::io::Read;

use flate2::read::ZlibDecoder;
use lzma_rust2::XzReader;

/// The most memory of LZMA's dictionary, in KiB: VTK's own take 64 MiB at most.
const MOST_DICTIONARY: u32 = 1 << 17;

/// What blocks are packed by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compressor {
    Zlib,
    Lz4,
    Lzma,
}

/// VTK's names, for messages.
pub(super) const NAMES: &str =
    "vtkZLibDataCompressor, vtkLZ4DataCompressor, vtkLZMADataCompressor or none";

impl fmt::Display for Compressor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Zlib => "zlib",
            Self::Lz4 => "LZ4",
            Self::Lzma => "LZMA",
        })
    }
}

impl Compressor {
    /// The one of VTK's name.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "vtkZLibDataCompressor" => Some(Self::Zlib),
            "vtkLZ4DataCompressor" => Some(Self::Lz4),
            "vtkLZMADataCompressor" => Some(Self::Lzma),
            _ => None,
        }
    }

    /// The most bytes that a byte can stand for.
    pub fn ratio(self) -> u64 {
        match self {
            Self::Zlib => 1032,
            Self::Lz4 => 255,
            Self::Lzma => 1 << 14,
        }
    }

    /// The bytes of a block, one more than `size` at most. Memory grows as they come.
    ///
    /// # Errors
    /// What the decoder says.
    pub fn unpack(self, packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
        let (mut out, limit) = (Vec::new(), (size as u64).saturating_add(1));
        match self {
            Self::Zlib => ZlibDecoder::new(packed).take(limit).read_to_end(&mut out),
            Self::Lzma => XzReader::new_mem_limit(packed, false, MOST_DICTIONARY)
                .take(limit)
                .read_to_end(&mut out),
            Self::Lz4 => {
                if size as u64 > self.ratio() * (packed.len() as u64 + 1) {
                    return Err(format!("{} bytes for {size}", packed.len()));
                }
                out.resize(size, 0);
                let count = lz4_flex::block::decompress_into(packed, &mut out);
                let count = count.map_err(|e| e.to_string())?;
                out.truncate(count);
                return Ok(out);
            }
        }
        .map_err(|e| e.to_string())?;
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_blocks_are_errors() {
        for kind in [Compressor::Zlib, Compressor::Lz4, Compressor::Lzma] {
            assert!(kind.unpack(&[], 10).map_or(true, |out| out.len() < 10), "{kind}");
            assert!(kind.unpack(&[0xff; 40], 10).is_err(), "{kind}");
            assert!(kind.unpack(&[0; 40], usize::MAX).is_err(), "{kind}");
        }
        // literals alone: a token with their number, then they
        assert_eq!(Compressor::Lz4.unpack(&[0x30, 1, 2, 3], 3).unwrap(), [1, 2, 3]);
        assert!(Compressor::Lz4.unpack(&[0x30, 1, 2, 3], 2).is_err());
    }
}
