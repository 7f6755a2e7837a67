//! A single slice: a flat image.

use super::super::affine::Affine;
use super::super::note::{LoadedImage, ReadNote};
use super::super::options::GivenFrame;
use super::super::scan_note::ScanNote;
use super::header::Plane;
use super::series::unit_axes;
use super::{MILLIMETRE, WORLD};

/// A single slice without its samples.
pub(super) struct Flat {
    /// Where it is in our world.
    pub affine: Affine,
    /// What is said of the spacing.
    note: Option<ReadNote>,
    /// Axes that are none.
    odd_axes: Option<[[f64; 3]; 2]>,
}

impl Flat {
    pub fn of(plane: &Plane, given: GivenFrame) -> Self {
        let spacing = plane.spacing.or(plane.imager_spacing);
        let note = match (plane.spacing, plane.imager_spacing) {
            (Some(_), _) => None,
            (None, Some(spacing)) => Some(ReadNote::AtDetector { spacing }),
            (None, None) => Some(ReadNote::NoSpacing),
        };
        let [sx, sy] = spacing.unwrap_or([1.0; 2]);
        let axes = plane.axes.and_then(unit_axes);
        let odd_axes = plane.axes.filter(|_| axes.is_none() && !given.direction);
        let [x, y] = axes.unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let step = [0.0, 0.0, 1.0];
        let matrix = std::array::from_fn(|r| [x[r] * sx, y[r] * sy, step[r]]);
        let affine = Affine { matrix, origin: plane.position.unwrap_or_default() };
        Self { affine: affine.turned_from(WORLD).with_given(given), note, odd_axes }
    }

    /// The image with what is known of it.
    pub fn noting(&self, loaded: LoadedImage) -> LoadedImage {
        let units = match self.note {
            Some(ReadNote::NoSpacing) => Vec::new(),
            _ => vec![MILLIMETRE.into(); 2],
        };
        let odd = self.odd_axes.map(|axes| ReadNote::from(ScanNote::OddAxes { axes }));
        LoadedImage { units, ..loaded }.noting(WORLD.note()).noting(self.note.clone()).noting(odd)
    }
}
