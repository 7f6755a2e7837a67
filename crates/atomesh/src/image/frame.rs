//! Where the samples of an image are: shape, spacing, origin, direction.

use crate::geometry::{Bounds, Point};

use super::place::coordinates;

/// Which coordinates the lattice lives in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Units {
    /// Sample index times the frame's spacing: lengths are millimetres or metres. The default, so
    /// that edges have the wanted length whatever the samples' proportions are.
    #[default]
    Physical,
    /// Sample indices, as in the paper: lengths are samples along every axis.
    Samples,
}

/// What is wrong with a frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// An axis has no samples, or their product does not fit in memory's address space.
    #[error("shape {shape:?} has no samples or too many to address")]
    Shape {
        /// Samples along x, y (and z).
        shape: Vec<usize>,
    },
    /// A spacing is zero, negative or not finite.
    #[error("spacing {value} along axis {axis}; expected a finite number above 0")]
    Spacing {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The spacing found.
        value: f64,
    },
    /// An origin's coordinate is not finite.
    #[error("origin {value} along axis {axis}; expected a finite number")]
    Origin {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The coordinate found.
        value: f64,
    },
    /// The columns of a direction are not unit vectors at right angles.
    #[error("direction {direction:?} is not made of unit vectors at right angles")]
    Direction {
        /// The matrix found, row by row.
        direction: Vec<f64>,
    },
    /// The number of samples differs from the shape's.
    #[error("{found} samples for a shape that holds {expected}")]
    SampleCount {
        /// The product of the shape.
        expected: usize,
        /// The number of samples given.
        found: usize,
    },
    /// A crop is empty or leaves the image.
    #[error("crop from sample {start} to {end} along axis {axis}, which has {count} samples")]
    Crop {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The first sample wanted.
        start: usize,
        /// One past the last sample wanted.
        end: usize,
        /// The samples along the axis.
        count: usize,
    },
}

/// The sampling of lattice space: sample index `i` is at the lattice coordinate `i · step`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid<const D: usize> {
    /// Samples along x, y (and z).
    pub shape: [usize; D],
    /// Lattice units from one sample to the next along each axis.
    pub step: [f64; D],
}

impl<const D: usize> Grid<D> {
    /// The box of the samples' centres, from 0 to `(n − 1) · step`.
    pub fn bounds(&self) -> Bounds<D> {
        Bounds {
            min: [0.0; D],
            max: std::array::from_fn(|k| (self.shape[k] - 1) as f64 * self.step[k]),
        }
    }

    /// The number of samples.
    pub fn sample_count(&self) -> usize {
        self.shape.iter().product()
    }

    /// How far apart in memory neighbouring samples along each axis are: 1, nx, nx·ny.
    pub fn strides(&self) -> [usize; D] {
        let mut stride = 1;
        std::array::from_fn(|k| {
            let s = stride;
            stride *= self.shape[k];
            s
        })
    }

    /// The lattice coordinates of a sample.
    #[inline]
    pub fn position(&self, index: usize) -> Point<D> {
        let sample = coordinates(index, self.shape);
        std::array::from_fn(|k| sample[k] as f64 * self.step[k])
    }

    /// A length in samples, by the geometric mean of the steps where these differ.
    pub fn in_samples(&self, length: f64) -> f64 {
        length / self.step.iter().map(|step| step.powf(1.0 / D as f64)).product::<f64>()
    }

    /// The smallest step of all axes.
    pub fn least_step(&self) -> f64 {
        self.step.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The same grid measured in its least steps: the least step is 1.
    pub(crate) fn in_least_steps(&self) -> Self {
        let least = self.least_step();
        Self { step: self.step.map(|step| step / least), ..*self }
    }
}

/// Places samples in the world: `world = origin + direction · (spacing ∘ index)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<const D: usize> {
    shape: [usize; D],
    spacing: [f64; D],
    origin: Point<D>,
    direction: [[f64; D]; D],
}

impl<const D: usize> Frame<D> {
    /// A frame of unit spacing, origin 0 and axes along the world's.
    ///
    /// # Errors
    /// [`FrameError::Shape`] if an axis has no samples or their number overflows.
    pub fn new(shape: [usize; D]) -> Result<Self, FrameError> {
        let count = shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
        match count {
            Some(n) if n > 0 && n <= isize::MAX as usize / 8 => Ok(Self {
                shape,
                spacing: [1.0; D],
                origin: [0.0; D],
                direction: std::array::from_fn(|r| {
                    std::array::from_fn(|c| if r == c { 1.0 } else { 0.0 })
                }),
            }),
            _ => Err(FrameError::Shape { shape: shape.to_vec() }),
        }
    }

    /// The same with another spacing, in world units a sample.
    ///
    /// # Errors
    /// [`FrameError::Spacing`] unless every spacing is finite and above 0.
    pub fn with_spacing(mut self, spacing: [f64; D]) -> Result<Self, FrameError> {
        for (axis, &value) in spacing.iter().enumerate() {
            if !(value.is_finite() && value > 0.0) {
                return Err(FrameError::Spacing { axis, value });
            }
        }
        self.spacing = spacing;
        Ok(self)
    }

    /// The same with sample 0 at another place in the world.
    ///
    /// # Errors
    /// [`FrameError::Origin`] unless every coordinate is finite.
    pub fn with_origin(mut self, origin: Point<D>) -> Result<Self, FrameError> {
        for (axis, &value) in origin.iter().enumerate() {
            if !value.is_finite() {
                return Err(FrameError::Origin { axis, value });
            }
        }
        self.origin = origin;
        Ok(self)
    }

    /// The same with other axes: column `c` of `direction` is the world direction of axis `c`.
    ///
    /// # Errors
    /// [`FrameError::Direction`] unless the columns are orthonormal to 1e-4, the precision with
    /// which medical headers state them.
    pub fn with_direction(mut self, direction: [[f64; D]; D]) -> Result<Self, FrameError> {
        for a in 0..D {
            for b in a..D {
                let dot: f64 = (0..D).map(|r| direction[r][a] * direction[r][b]).sum();
                let expected = if a == b { 1.0 } else { 0.0 };
                if dot.is_nan() || (dot - expected).abs() > 1e-4 {
                    return Err(FrameError::Direction { direction: direction.concat() });
                }
            }
        }
        self.direction = direction;
        Ok(self)
    }

    /// Samples along x, y (and z).
    pub fn shape(&self) -> [usize; D] {
        self.shape
    }

    /// World units from one sample to the next along each axis.
    pub fn spacing(&self) -> [f64; D] {
        self.spacing
    }

    /// The world coordinates of sample 0.
    pub fn origin(&self) -> Point<D> {
        self.origin
    }

    /// The world directions of the axes, as columns: `direction[r][c]` is component r of axis c.
    pub fn direction(&self) -> [[f64; D]; D] {
        self.direction
    }

    /// The number of samples.
    pub fn sample_count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether the axes form a left-handed system, so that cells turn over on their way to the world.
    pub fn is_mirrored(&self) -> bool {
        let m = &self.direction;
        let determinant = if D == 2 {
            m[0][0] * m[1][1] - m[0][1] * m[1][0]
        } else {
            m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
                - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
                + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
        };
        determinant < 0.0
    }

    /// The sampling of lattice space in the given units.
    pub fn grid(&self, units: Units) -> Grid<D> {
        let step = match units {
            Units::Physical => self.spacing,
            Units::Samples => [1.0; D],
        };
        Grid { shape: self.shape, step }
    }

    /// The world coordinates of a lattice point.
    pub fn lattice_to_world(&self, units: Units, p: &Point<D>) -> Point<D> {
        let step = self.grid(units).step;
        std::array::from_fn(|r| {
            let mut sum = self.origin[r];
            for c in 0..D {
                // in physical units spacing / step is exactly 1
                sum += self.direction[r][c] * (p[c] * (self.spacing[c] / step[c]));
            }
            sum
        })
    }

    /// The lattice coordinates of a world point.
    pub fn world_to_lattice(&self, units: Units, p: &Point<D>) -> Point<D> {
        let step = self.grid(units).step;
        std::array::from_fn(|c| {
            let mut sum = 0.0;
            for r in 0..D {
                sum += self.direction[r][c] * (p[r] - self.origin[r]);
            }
            sum * (step[c] / self.spacing[c])
        })
    }

    /// The frame of the samples from `start` (included) to `end` (excluded).
    ///
    /// # Errors
    /// [`FrameError::Crop`] if the range is empty or leaves the frame.
    pub fn crop(&self, start: [usize; D], end: [usize; D]) -> Result<Self, FrameError> {
        for axis in 0..D {
            let (start, end, count) = (start[axis], end[axis], self.shape[axis]);
            if start >= end || end > count {
                return Err(FrameError::Crop { axis, start, end, count });
            }
        }
        let corner = std::array::from_fn(|k| start[k] as f64);
        let mut frame = Self::new(std::array::from_fn(|k| end[k] - start[k]))?;
        frame.spacing = self.spacing;
        frame.direction = self.direction;
        frame.origin = self.lattice_to_world(Units::Samples, &corner);
        Ok(frame)
    }
}
