//! An image of either dimension.

use atomesh::image::{Frame, FrameError, Image, Range, Samples};

use super::error::ReadReason;

/// An image whose file decided whether it is flat or a volume.
#[derive(Clone, Debug)]
pub enum AnyImage {
    /// Two axes.
    Flat(Image<2>),
    /// Three axes, also where one of them has a single sample.
    Volume(Image<3>),
}

/// Runs the same expression on an image of either dimension.
macro_rules! either {
    ($any:expr, $image:ident => $body:expr) => {
        match $any {
            AnyImage::Flat($image) => $body,
            AnyImage::Volume($image) => $body,
        }
    };
}

impl AnyImage {
    /// An image without a frame; `shape` has two or three axes, x first.
    pub(super) fn frameless(shape: &[usize], samples: Samples) -> Result<Self, ReadReason> {
        match *shape {
            [nx, ny] => Ok(Self::Flat(Image::new(Frame::new([nx, ny])?, samples)?)),
            [nx, ny, nz] => Ok(Self::Volume(Image::new(Frame::new([nx, ny, nz])?, samples)?)),
            _ => Err(FrameError::Shape { shape: shape.to_vec() }.into()),
        }
    }

    /// The number of axes, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.shape().len()
    }

    /// Samples along x, y (and z).
    pub fn shape(&self) -> Vec<usize> {
        either!(self, i => i.frame().shape().to_vec())
    }

    /// World units from one sample to the next along each axis.
    pub fn spacing(&self) -> Vec<f64> {
        either!(self, i => i.frame().spacing().to_vec())
    }

    /// The world coordinates of sample 0.
    pub fn origin(&self) -> Vec<f64> {
        either!(self, i => i.frame().origin().to_vec())
    }

    /// The world directions of the axes: one row for each world axis, a column for each of ours.
    pub fn direction(&self) -> Vec<Vec<f64>> {
        either!(self, i => i.frame().direction().iter().map(|row| row.to_vec()).collect())
    }

    /// The sample values, x fastest.
    pub fn samples(&self) -> &Samples {
        either!(self, i => i.samples())
    }

    /// Whether each sample has no data; none if all have some.
    pub fn absent(&self) -> Option<&[bool]> {
        either!(self, i => i.absent())
    }

    /// The name of the sample type, as NumPy spells it.
    pub fn type_name(&self) -> &'static str {
        self.samples().type_name()
    }

    /// The least and greatest sample that has data, and the count of those that are not finite.
    pub fn range(&self) -> Range {
        either!(self, i => i.range())
    }
}
