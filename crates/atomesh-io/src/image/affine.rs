//! From the affine of a header to a frame and back, and from the header's world to ours.

use atomesh::geometry::dot;
use atomesh::image::{Frame, Image, Samples};

use super::any_image::AnyImage;
use super::error::ReadReason;
use super::format::ImageFormat;
use super::note::{LoadedImage, ReadNote};
use super::options::GivenFrame;

/// The greatest |cosine| of the angle between two axes that a [`Frame`] tolerates, 0.006 degrees off; beyond
/// it they are sheared.
const SHEAR: f64 = 1e-4;

/// The same up to which sheared axes give way to the nearest ones at right angles, 0.1 degrees off.
const LEAST_REFUSED: f64 = 1.75e-3;

/// Which way the axes of a header's world point. Ours is RAS, x to the right, y to the front, z to the
/// top of the head, wherever a header speaks of a body; other coordinates stand as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum World {
    /// RAS, or no word of a body.
    Ours,
    /// LPS: x to the left, y to the back, z to the top of the head.
    LeftPosterior,
    /// LAS: x to the left, y to the front, z to the top of the head.
    LeftAnterior,
}

impl World {
    /// What the user should know of coordinates that were turned.
    pub fn note(self) -> Option<ReadNote> {
        match self {
            Self::Ours => None,
            Self::LeftPosterior => Some(ReadNote::Turned { from: "LPS" }),
            Self::LeftAnterior => Some(ReadNote::Turned { from: "LAS" }),
        }
    }
}

/// Sample indices to world coordinates: `world = matrix · index + origin`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Affine {
    pub matrix: [[f64; 3]; 3],
    pub origin: [f64; 3],
}

impl Affine {
    /// Axes along the world's, from the origin.
    pub fn scaling(spacing: [f64; 3]) -> Self {
        let matrix =
            std::array::from_fn(|r| std::array::from_fn(|c| if r == c { spacing[c] } else { 0.0 }));
        Self { matrix, origin: [0.0; 3] }
    }

    /// The same, sound where the caller puts something else in its place, so that nothing is refused there: axes along
    /// the world's where directions are given, and steps of 1 where spacing is given and there is none.
    pub fn with_given(mut self, given: GivenFrame) -> Self {
        let column = |c: usize| -> [f64; 3] { std::array::from_fn(|r| self.matrix[r][c]) };
        let columns = [0, 1, 2].map(column);
        for (c, column) in columns.iter().enumerate() {
            let length = dot(column, column).sqrt();
            let is_step = length.is_finite() && length > 0.0;
            if given.direction || given.spacing && !is_step {
                let step = if given.spacing && !is_step { 1.0 } else { length };
                (0..3).for_each(|r| self.matrix[r][c] = if r == c { step } else { 0.0 });
            }
        }
        if given.origin {
            self.origin = self.origin.map(|x| if x.is_finite() { x } else { 0.0 });
        }
        self
    }

    /// A column, the step from one sample to the next along an axis.
    fn column(&self, axis: usize) -> [f64; 3] {
        std::array::from_fn(|r| self.matrix[r][axis])
    }

    /// The same with the nearest axes at right angles, where they are hardly sheared, and the note that says so.
    pub fn squared(self, shape: &[usize]) -> (Self, Option<ReadNote>) {
        let columns = [0, 1, 2].map(|axis| self.column(axis));
        let lengths = columns.map(|column| dot(&column, &column).sqrt());
        let axes = shape.len().min(3);
        let unit: [[f64; 3]; 3] = std::array::from_fn(|c| columns[c].map(|x| x / lengths[c]));
        let (mut worst, mut odd) = (SHEAR, None);
        for first in 0..axes {
            for second in first + 1..axes {
                let cosine = dot(&unit[first], &unit[second]);
                // of columns that are no vectors nothing is greater
                if cosine.abs() > worst {
                    (worst, odd) = (cosine.abs(), Some((first, second, cosine)));
                }
            }
        }
        let Some((first, second, cosine)) = odd.filter(|_| worst <= LEAST_REFUSED) else {
            return (self, None);
        };
        let mut square = self;
        for (c, column) in orthonormal_of(&unit[..axes]).into_iter().enumerate() {
            (0..3).for_each(|r| square.matrix[r][c] = column[r] * lengths[c]);
        }
        let far: Vec<f64> = shape.iter().map(|&n| n.saturating_sub(1) as f64).collect();
        let moved = (0..1 << axes).map(|corner| {
            let along = |c: usize| if corner >> c & 1 == 1 { far[c] } else { 0.0 };
            let shift = |r: usize| -> f64 {
                (0..axes).map(|c| (square.matrix[r][c] - self.matrix[r][c]) * along(c)).sum()
            };
            let shift: [f64; 3] = std::array::from_fn(shift);
            dot(&shift, &shift).sqrt()
        });
        let degrees = cosine.acos().to_degrees();
        let distance = moved.fold(0.0, f64::max);
        (square, Some(ReadNote::Sheared { first, second, degrees, distance }))
    }

    /// The same samples in our world. LPS is RAS turned by half about z, so that nothing is mirrored.
    pub fn turned_from(mut self, world: World) -> Self {
        let turned = match world {
            World::Ours => 0,
            World::LeftPosterior => 2,
            World::LeftAnterior => 1,
        };
        for r in 0..turned {
            // 0 − 0 is 0, where −0 would be printed with its sign
            self.matrix[r] = self.matrix[r].map(|x| 0.0 - x);
            self.origin[r] = 0.0 - self.origin[r];
        }
        self
    }
}

/// The image of the samples that `read` returns, placed by an affine. The frame is made first, so that a bad
/// one is reported before the long read.
///
/// # Errors
/// As [`frame`] and [`flat_frame`], and as `read` gives.
pub(super) fn image(
    format: ImageFormat,
    shape: &[usize],
    affine: Affine,
    read: impl FnOnce() -> Result<Samples, ReadReason>,
) -> Result<AnyImage, ReadReason> {
    match *shape {
        [nx, ny] => {
            let frame = flat_frame(format, [nx, ny], affine)?;
            Ok(AnyImage::Flat(Image::new(frame, read()?)?))
        }
        [nx, ny, nz] => {
            let frame = frame(format, [nx, ny, nz], affine)?;
            Ok(AnyImage::Volume(Image::new(frame, read()?)?))
        }
        _ => Err(wrong(format, "axes", shape.len().to_string(), "2 or 3")),
    }
}

/// The image of the samples that `read` returns, placed by an affine, as [`image`]. Axes that are hardly sheared are
/// put at right angles, with a note. A single slice is flat: where it lies across z it keeps its place, elsewhere it
/// lies in its own plane, and a note says where that is.
///
/// # Errors
/// As [`image`].
pub(super) fn placed(
    format: ImageFormat,
    shape: &[usize],
    affine: Affine,
    read: impl FnOnce() -> Result<Samples, ReadReason>,
) -> Result<LoadedImage, ReadReason> {
    let (shape, affine, slice) = match slice_axes(shape) {
        None => (shape.to_vec(), affine, None),
        Some(kept) => {
            let (affine, note) = slice(&affine, kept);
            (kept.map(|axis| shape[axis]).to_vec(), affine, note)
        }
    };
    let (affine, sheared) = affine.squared(&shape);
    let image = image(format, &shape, affine, read)?;
    Ok(LoadedImage::from(image).noting(sheared).noting(slice))
}

/// The two axes along which a single slice has its samples.
fn slice_axes(shape: &[usize]) -> Option<[usize; 2]> {
    let long: Vec<usize> = (0..shape.len()).filter(|&axis| shape[axis] > 1).collect();
    match (shape.len(), &long[..]) {
        (2, _) => Some([0, 1]),
        (3, _) if shape[2] == 1 => Some([0, 1]),
        (3, &[first, second]) => Some([first, second]),
        _ => None,
    }
}

/// A slice in the plane x, y of the world, if it lies along that, else in its own plane; and what there is to note.
fn slice(affine: &Affine, kept: [usize; 2]) -> (Affine, Option<ReadNote>) {
    let [x, y] = kept.map(|axis| affine.column(axis));
    let size = x.iter().chain(&y).fold(0.0, |most: f64, value| value.abs().max(most));
    let origin = affine.origin;
    let is_level = [x[2], y[2]].iter().all(|z| z.abs() <= SHEAR * size);
    let columns = if is_level {
        [x, y, [0.0, 0.0, 1.0]]
    } else {
        // the slice's own plane, x along its first axis
        let length = dot(&x, &x).sqrt();
        let along = dot(&x, &y) / length;
        // what rounding leaves of a right angle
        let along = if along.abs() < 1e-12 * size { 0.0 } else { along };
        let across = (dot(&y, &y) - along * along).max(0.0).sqrt();
        [[length, 0.0, 0.0], [along, across, 0.0], [0.0, 0.0, 1.0]]
    };
    let matrix = std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]));
    let flat = Affine { matrix, origin: if is_level { origin } else { [0.0; 3] } };
    let note = match is_level {
        true if origin[2] == 0.0 => None,
        true => Some(ReadNote::LevelSlice { z: origin[2] }),
        false => {
            let unit = |v: [f64; 3]| v.map(|x| x / dot(&v, &v).sqrt());
            Some(ReadNote::ObliqueSlice { origin, axes: [unit(x), unit(y)] })
        }
    };
    (flat, note)
}

/// The error for an entry of a header.
pub(super) fn wrong(
    format: ImageFormat,
    field: &'static str,
    value: impl Into<String>,
    expected: &'static str,
) -> ReadReason {
    ReadReason::Header { format, field, value: value.into(), expected }
}

/// The frame of an affine whose columns are at right angles: spacings are their lengths, directions
/// the columns divided by those. Single precision leaves the directions askew by some 1e-7; they
/// are turned to the nearest orthonormal ones, so that a frame maps there and back exactly.
///
/// # Errors
/// If an entry is not finite, a column is zero, or two columns are not at right angles.
pub(super) fn frame<const D: usize>(
    format: ImageFormat,
    shape: [usize; D],
    affine: Affine,
) -> Result<Frame<D>, ReadReason> {
    let mut columns: [[f64; D]; D] =
        std::array::from_fn(|c| std::array::from_fn(|r| affine.matrix[r][c]));
    let mut spacing = [0.0; D];
    for c in 0..D {
        spacing[c] = dot(&columns[c], &columns[c]).sqrt();
        if !(spacing[c].is_finite() && spacing[c] > 0.0) {
            const NAMES: [&str; 3] = ["affine column x", "affine column y", "affine column z"];
            let value = format!("{:?}", columns[c]);
            return Err(wrong(format, NAMES[c], value, "finite numbers that are not all 0"));
        }
        columns[c] = columns[c].map(|x| x / spacing[c]);
    }
    for first in 0..D {
        for second in first + 1..D {
            let cosine = dot(&columns[first], &columns[second]);
            if cosine.abs() > SHEAR {
                let degrees = cosine.clamp(-1.0, 1.0).acos().to_degrees();
                return Err(ReadReason::Sheared { first, second, degrees });
            }
        }
    }
    let columns = orthonormal(columns);
    let direction = std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]));
    let origin = std::array::from_fn(|r| affine.origin[r]);
    Ok(Frame::new(shape)?.with_spacing(spacing)?.with_origin(origin)?.with_direction(direction)?)
}

/// The frame of a flat image, whose axes must lie in the plane of the world's x and y.
///
/// # Errors
/// As [`frame`], and if the plane is another one.
pub(super) fn flat_frame(
    format: ImageFormat,
    shape: [usize; 2],
    affine: Affine,
) -> Result<Frame<2>, ReadReason> {
    let rise = &affine.matrix[2][..2];
    let length = affine.matrix.iter().flat_map(|row| &row[..2]).fold(0.0, |m, x| x.abs().max(m));
    if rise.iter().any(|z| z.abs() > SHEAR * length) {
        let value = format!("{rise:?}");
        let expected = "0 for an image of two axes, in the plane x, y";
        return Err(wrong(format, "affine row z", value, expected));
    }
    frame(format, shape, affine)
}

/// The orthonormal vectors nearest to `columns`, which are so within [`SHEAR`]: the limit of
/// C ← C (3 − CᵀC) / 2, whose error is squared by each step. Vectors that are orthonormal stay
/// as they are.
fn orthonormal<const D: usize>(columns: [[f64; D]; D]) -> [[f64; D]; D] {
    let mut columns = columns;
    for _ in 0..3 {
        let old = columns;
        for a in 0..D {
            for b in 0..D {
                let identity = if a == b { 1.0 } else { 0.0 };
                let half_error = (identity - dot(&old[a], &old[b])) / 2.0;
                for r in 0..D {
                    columns[a][r] += half_error * old[b][r];
                }
            }
        }
    }
    columns
}

/// The same for some of the world's three dimensions.
fn orthonormal_of(columns: &[[f64; 3]]) -> Vec<[f64; 3]> {
    match columns {
        &[x, y] => {
            // the third is across both, so that it stays out of the way
            let z =
                [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
            orthonormal([x, y, z])[..2].to_vec()
        }
        &[x, y, z] => orthonormal([x, y, z]).to_vec(),
        others => others.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::nifti::rotation;
    use super::*;
    use proptest::prelude::*;

    const FORMAT: ImageFormat = ImageFormat::named("test");

    #[test]
    fn shear_is_refused_with_its_angle() {
        let mut affine = Affine::scaling([1.0, 2.0, 3.0]);
        affine.matrix[0][1] = 2.0; // y leans by 45 degrees
        match frame(FORMAT, [2, 2, 2], affine) {
            Err(ReadReason::Sheared { first: 0, second: 1, degrees }) => {
                assert!((degrees - 45.0).abs() < 1e-12);
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_small_shear_gives_way_to_the_nearest_axes() {
        for (tilt, is_small) in [(5e-5, false), (2e-4, true), (1.7e-3, true), (2e-3, false)] {
            let mut affine = Affine::scaling([1.0, 2.0, 3.0]);
            affine.matrix[0][2] = 3.0 * tilt;
            let (square, note) = affine.squared(&[5, 6, 11]);
            let Some(note) = note.filter(|_| is_small) else {
                assert_eq!((square, is_small), (affine, false), "{tilt}");
                continue;
            };
            // each of the two axes turns by half of the angle
            let half = tilt / 2.0;
            assert!((square.matrix[0][2] - 3.0 * half).abs() < 1e-8);
            assert!((square.matrix[2][0] + half).abs() < 1e-8);
            assert!(frame(FORMAT, [5, 6, 11], square).is_ok());
            let ReadNote::Sheared { first: 0, second: 2, degrees, distance } = note else {
                panic!("{note:?}");
            };
            assert!((degrees - 90.0 + tilt.to_degrees()).abs() < 1e-6, "{degrees}");
            let most = half * (30.0f64.powi(2) + 4.0f64.powi(2)).sqrt();
            // but for the second order of the tilt
            assert!((distance - most).abs() < 1e-5, "{distance} {most}");
        }
    }

    #[test]
    fn a_slice_lies_in_its_own_plane_and_a_note_says_where() {
        let samples = || Ok(Samples::U8(vec![0; 6].into()));
        let mut affine = Affine::scaling([1.0, 2.0, 3.0]);
        affine.origin = [10.0, 20.0, 30.0];
        let flat = placed(FORMAT, &[2, 3, 1], affine, samples).unwrap();
        assert_eq!((flat.image.shape(), flat.image.origin()), (vec![2, 3], vec![10.0, 20.0]));
        assert_eq!(flat.notes, [ReadNote::LevelSlice { z: 30.0 }]);
        let upright = placed(FORMAT, &[2, 1, 3], affine, samples).unwrap();
        assert_eq!(
            (upright.image.spacing(), upright.image.origin()),
            (vec![1.0, 3.0], vec![0.0; 2])
        );
        let axes = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(upright.notes, [ReadNote::ObliqueSlice { origin: affine.origin, axes }]);
        // a row along z is no slice, and a slice has to have vectors
        assert_eq!(placed(FORMAT, &[1, 1, 6], affine, samples).unwrap().image.shape(), [1, 1, 6]);
        affine.matrix[2][2] = 0.0;
        assert!(placed(FORMAT, &[2, 1, 3], affine, samples).is_err());
        affine.matrix[0][2] = f64::NAN;
        assert!(placed(FORMAT, &[2, 1, 3], affine, samples).is_err());
    }

    #[test]
    fn degenerate_columns_are_refused() {
        for bad in [0.0, f64::NAN, f64::INFINITY, 1e300] {
            let error = frame(FORMAT, [2, 2, 2], Affine::scaling([1.0, bad, 1.0])).unwrap_err();
            assert!(error.to_string().contains("affine column y"), "{error}");
        }
        let mut affine = Affine::scaling([1.0; 3]);
        affine.origin[2] = f64::NAN;
        assert!(frame(FORMAT, [2, 2, 2], affine).is_err());
    }

    #[test]
    fn a_flat_image_stays_in_its_plane() {
        let mut affine = Affine::scaling([2.0, 3.0, 1.0]);
        affine.origin = [1.0, 2.0, 9.0];
        let flat = flat_frame(FORMAT, [4, 5], affine).unwrap();
        assert_eq!((flat.spacing(), flat.origin()), ([2.0, 3.0], [1.0, 2.0]));
        affine.matrix[2][1] = 0.5;
        assert!(flat_frame(FORMAT, [4, 5], affine).unwrap_err().to_string().contains("row z"));
    }

    proptest! {
        /// Directions rounded to single precision become orthonormal in double precision.
        #[test]
        fn frames_of_rounded_affines_map_there_and_back(
            q in prop::array::uniform3(-0.57f64..0.57), spacing in prop::array::uniform3(0.1f64..9.0),
        ) {
            let turn = rotation(q).unwrap();
            let mut affine = Affine::scaling(spacing);
            affine.matrix = std::array::from_fn(|r| std::array::from_fn(|c| {
                f64::from((turn[r][c] * spacing[c]) as f32)
            }));
            let direction = frame(FORMAT, [2, 2, 2], affine).unwrap().direction();
            for a in 0..3 {
                for b in 0..3 {
                    let dot: f64 = (0..3).map(|r| direction[r][a] * direction[r][b]).sum();
                    let expected = if a == b { 1.0 } else { 0.0 };
                    prop_assert!((dot - expected).abs() < 1e-15 * 4.0);
                }
            }
        }
    }
}
