//! How frames are packed, and what unpacks them.
//!
//! Each frame's own header is checked against the file's before anything is unpacked, so that no decoder makes more room
//! than the file's header asks for. Decoders are pure Rust: `jpeg-decoder` for lossless and 8-bit JPEG, `pure_jpegls`,
//! `hayro-jpeg2000`; run lengths and JPEG of 12 bits are unpacked here, since no crate does the latter.

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::pixels::Pixels;
use super::{FORMAT, jpeg, jpeg2000, runs, unsupported};

/// How frames are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    /// Not at all.
    Plain,
    /// By run lengths.
    Runs,
    /// By JPEG, lossless or not.
    Jpeg { is_lossy: bool },
    /// By JPEG-LS.
    JpegLs { is_lossy: bool },
    /// By JPEG 2000.
    Jpeg2000 { is_lossy: bool },
}

impl Packing {
    /// What a transfer syntax says.
    ///
    /// # Errors
    /// If it packs frames in a way that is not read.
    pub fn of(syntax: &str) -> Result<Self, ReadReason> {
        let Some(number) = syntax.strip_prefix("1.2.840.10008.1.2") else {
            return match syntax {
                "" => Ok(Self::Plain),
                _ => Err(unknown("an unknown way", syntax)),
            };
        };
        Ok(match number {
            "" | ".1" | ".1.99" | ".2" => Self::Plain,
            ".5" => Self::Runs,
            ".4.50" | ".4.51" => Self::Jpeg { is_lossy: true },
            ".4.57" | ".4.70" => Self::Jpeg { is_lossy: false },
            ".4.80" => Self::JpegLs { is_lossy: false },
            ".4.81" => Self::JpegLs { is_lossy: true },
            ".4.90" => Self::Jpeg2000 { is_lossy: false },
            ".4.91" => Self::Jpeg2000 { is_lossy: true },
            ".4.92" | ".4.93" => return Err(unknown("JPEG 2000 of several components", syntax)),
            ".4.110" | ".4.111" | ".4.112" => return Err(unknown("JPEG XL", syntax)),
            ".4.201" | ".4.202" | ".4.203" => {
                return Err(unknown("high-throughput JPEG 2000", syntax));
            }
            _ if number.starts_with(".4.1") => return Err(unknown("a video codec", syntax)),
            _ => return Err(unknown("an unknown way", syntax)),
        })
    }

    /// Whether values may be others than those that were packed.
    pub fn is_lossy(self) -> bool {
        match self {
            Self::Plain | Self::Runs => false,
            Self::Jpeg { is_lossy } | Self::JpegLs { is_lossy } | Self::Jpeg2000 { is_lossy } => {
                is_lossy
            }
        }
    }

    /// The most samples that a byte can stand for. JPEG takes a bit for a block of 64 samples or more; of the others, which
    /// have no bound, what an empty slice of 4096² takes.
    pub fn density(self) -> u64 {
        match self {
            Self::Plain => 1,
            Self::Runs => runs::RATIO,
            Self::Jpeg { .. } => 8 * 64,
            Self::JpegLs { .. } | Self::Jpeg2000 { .. } => 1 << 16,
        }
    }

    /// Unpacks a frame.
    pub fn unpack(
        self,
        packed: &[u8],
        pixels: &Pixels,
        memory: Memory,
    ) -> Result<Vec<i64>, ReadReason> {
        // decoders hold their output beside ours, JPEG 2000 in single precision and its coefficients too
        memory.check(pixels.count() as u128 * 16)?;
        match self {
            Self::Plain => Err(wrong(FORMAT, "pixel data", "in fragments", "plain samples")),
            Self::Runs => runs::unpack(packed, pixels, memory),
            Self::Jpeg { .. } => jpeg::unpack(packed, pixels, memory),
            Self::JpegLs { .. } => jpeg::unpack_ls(packed, pixels, memory),
            Self::Jpeg2000 { .. } => jpeg2000::unpack(packed, pixels, memory),
        }
    }
}

fn unknown(name: &str, syntax: &str) -> ReadReason {
    unsupported(
        format!("samples packed by {name} (transfer syntax {syntax:?})"),
        "plain samples, run lengths, JPEG, JPEG-LS and JPEG 2000: unpack them first, as by gdcmconv --raw",
    )
}
