//! Images: samples on a grid, and the frame that places the grid in the world.

mod absent;
mod cells;
mod convolve;
mod frame;
mod gaussian;
mod gradient;
mod kernel;
mod place;
mod resample;
mod samples;
mod stream;
mod tensor;
mod values;

pub(crate) use cells::{CellAverages, Entries};
pub use frame::{Frame, FrameError, Grid, Units};
pub use gaussian::{gaussian, gaussian_derivative};
pub(crate) use gaussian::{gaussian_between, gaussian_derivative_into};
pub(crate) use gradient::magnitude;
pub use gradient::{gradient_magnitude, prewitt_magnitude};
pub(crate) use place::{coordinates, neighbour};
pub use resample::{Between, SampleOrder};
pub use samples::{Range, Samples};
pub(crate) use stream::{Run, Stencil, Stream};
pub use tensor::StructureTensor;
pub use values::{Elsewhere, Values};

/// Samples on a regular grid, with the frame that says where they are.
///
/// Sample `(i, j, k)` is at index `i + nx · (j + ny · k)`: x is the fastest axis, so a NumPy array
/// of the same bytes has the shape `(nz, ny, nx)`.
#[derive(Clone, Debug)]
pub struct Image<const D: usize> {
    frame: Frame<D>,
    samples: Samples,
    /// Whether each sample has no data, if any has none.
    absent: Option<Vec<bool>>,
}

impl<const D: usize> Image<D> {
    /// An image of `samples` placed by `frame`.
    ///
    /// # Errors
    /// [`FrameError::SampleCount`] if there are not as many samples as the frame's shape says.
    pub fn new(frame: Frame<D>, samples: Samples) -> Result<Self, FrameError> {
        if samples.len() != frame.sample_count() {
            return Err(FrameError::SampleCount {
                expected: frame.sample_count(),
                found: samples.len(),
            });
        }
        Ok(Self { frame, samples, absent: None })
    }

    /// Where the samples are.
    pub fn frame(&self) -> &Frame<D> {
        &self.frame
    }

    /// The same samples placed by another frame of the same shape.
    ///
    /// # Errors
    /// [`FrameError::SampleCount`] if the shapes differ in their number of samples.
    pub fn with_frame(self, frame: Frame<D>) -> Result<Self, FrameError> {
        Ok(Self { absent: self.absent, ..Self::new(frame, self.samples)? })
    }

    /// The sample values, x fastest.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Other samples at the same places, of any type; places without data stay so.
    ///
    /// # Errors
    /// [`FrameError::SampleCount`] if there are not as many.
    pub fn with_samples(self, samples: Samples) -> Result<Self, FrameError> {
        Ok(Self { absent: self.absent, ..Self::new(self.frame, samples)? })
    }

    /// The frame and the samples.
    pub fn into_parts(self) -> (Frame<D>, Samples) {
        (self.frame, self.samples)
    }

    /// The part of the image between samples `start` (included) and `end` (excluded).
    ///
    /// # Errors
    /// [`FrameError::Crop`] if the range is empty or leaves the image.
    pub fn crop(&self, start: [usize; D], end: [usize; D]) -> Result<Self, FrameError> {
        let frame = self.frame.crop(start, end)?;
        let rows = || rows(self.frame.shape(), start, end);
        let cropped = Self::new(frame, self.samples.gather(frame.sample_count(), rows()))?;
        let Some(absent) = &self.absent else { return Ok(cropped) };
        cropped.with_absent(rows().flat_map(|row| &absent[row]).copied().collect())
    }
}

/// The indices of the samples from `start` (included) to `end` (excluded), row by row.
pub(crate) fn rows<const D: usize>(
    shape: [usize; D],
    start: [usize; D],
    end: [usize; D],
) -> impl Iterator<Item = std::ops::Range<usize>> {
    let counts: [usize; D] = std::array::from_fn(|k| end[k] - start[k]);
    (0..counts[1..].iter().product()).map(move |row| {
        let (mut rest, mut index, mut stride) = (row, start[0], shape[0]);
        for k in 1..D {
            index += (start[k] + rest % counts[k]) * stride;
            rest /= counts[k];
            stride *= shape[k];
        }
        index..index + counts[0]
    })
}
