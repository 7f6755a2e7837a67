//! What image an array is: which of its axes are those of the image.

use super::super::error::ReadReason;
use super::super::note::ReadNote;
use super::super::sample_type::SampleType;
use super::super::shape::plausible_count;
use super::FORMAT;
use super::header::Header;

/// Samples along each other axis from which on a last axis of 3 or 4 is taken for one of colours.
const LEAST_PICTURE: usize = 8;

/// An array as an image.
#[derive(Debug)]
pub(in super::super) struct Form {
    /// Samples along x, y (and z).
    pub shape: Vec<usize>,
    /// Interleaved values a sample: 3 or 4 of colours.
    pub channels: usize,
    /// The shape x, y, z of numbers that come with z fastest.
    pub turned: Option<[usize; 3]>,
    pub note: Option<ReadNote>,
}

impl Form {
    /// The image that an array is.
    ///
    /// # Errors
    /// [`ReadReason::Unsupported`] of an array that has neither two nor three axes longer than 1.
    pub fn of(header: &Header) -> Result<Self, ReadReason> {
        let stored = &header.shape;
        let numpy: Vec<usize> = stored.iter().rev().copied().collect();
        let mut shape = stored.clone();
        let (mut channels, mut note) = (1, None);
        let is_colour = matches!(shape.first(), Some(3 | 4))
            && matches!(shape.len(), 3 | 4)
            && shape[1..].iter().take(2).all(|&n| n >= LEAST_PICTURE)
            && matches!(
                header.sample_type,
                SampleType::U8 | SampleType::U16 | SampleType::F32 | SampleType::F64
            );
        if is_colour {
            channels = shape.remove(0);
            shape.truncate(if shape.last() == Some(&1) { 2 } else { 3 });
            note = Some(ReadNote::ColourAxis { shape: numpy.clone() });
        } else if shape.len() > 3 {
            shape.retain(|&n| n != 1);
            note = Some(ReadNote::UnitAxes { shape: numpy.clone() });
        }
        // axes of length 1 change no order
        let long = || stored.iter().copied().filter(|&n| n != 1).collect::<Vec<usize>>();
        let turned = match (header.fortran_order, stored.as_slice()) {
            (false, _) => None,
            (true, &[nx, ny]) => Some([nx, ny, 1]),
            (true, &[nx, ny, nz]) => Some([nx, ny, nz]),
            (true, _) => match long()[..] {
                [nx, ny] => Some([nx, ny, 1]),
                [nx, ny, nz] => Some([nx, ny, nz]),
                _ => return Err(unsupported(&numpy)),
            },
        };
        if !(2..=3).contains(&shape.len()) {
            return Err(unsupported(&numpy));
        }
        Ok(Self { shape, channels, turned, note })
    }

    /// The numbers of the array, if so many may be in a file of `file_bytes` bytes.
    ///
    /// # Errors
    /// [`ReadReason::TooLarge`] if they may not.
    pub fn count(&self, file_bytes: u64, density: u64) -> Result<usize, ReadReason> {
        let all: Vec<usize> = self.shape.iter().copied().chain([self.channels]).collect();
        plausible_count(&all, file_bytes, density)
    }
}

fn unsupported(shape: &[usize]) -> ReadReason {
    ReadReason::Unsupported {
        format: FORMAT,
        found: format!("an array of {} axes, {shape:?}", shape.len()),
        expected: "an array (y, x) or (z, y, x)",
    }
}
