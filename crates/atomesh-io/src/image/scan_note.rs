//! What the reader of DICOM reports about scans.

use std::fmt;

use super::note::ReadNote;

/// What became of the slices of a scan, of their order, their places and their values.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ScanNote {
    /// One of several series was read.
    Series {
        /// Its identifier, number and description.
        name: String,
        /// How many there are.
        count: usize,
    },
    /// The slices are not in the folder itself but below it.
    Below {
        /// Where, relative to the folder, as in `sub/ser1`.
        folder: String,
    },
    /// Files lack the preamble and the magic word; they are known by their first element.
    NoPreamble {
        /// How many.
        count: usize,
        /// One of them.
        file: String,
    },
    /// Slices stand beside each other as those of a tilted gantry do, and were resampled onto a grid at right angles.
    GantryTilt {
        /// The angle between the normal of the slices and the line through their first samples.
        degrees: f64,
        /// Samples along x and y in each slice before.
        before: [usize; 2],
        /// The same now; what no slice covers has no data.
        after: [usize; 2],
    },
    /// Slices stand beside each other irregularly, and were resampled onto a grid at right angles.
    Shifted {
        /// How far at most, in samples.
        most: f64,
    },
    /// Slices stand nearly evenly, and were resampled to even places.
    Uneven {
        /// How far a slice was from its even place at most, in gaps.
        most: f64,
    },
    /// Slices stand unevenly, and were put evenly, since the caller gives the spacing.
    GivenGaps {
        /// The least gap.
        least: f64,
        /// The greatest gap.
        greatest: f64,
    },
    /// The axes of a single slice are no unit vectors at right angles; those of the world are taken.
    OddAxes {
        /// The axes found.
        axes: [[f64; 3]; 2],
    },
    /// Slices of a segmentation that no frame is of.
    EmptySlices {
        /// How many.
        empty: usize,
        /// How many slices there are in all.
        count: usize,
    },
    /// A file has functional groups for more frames than there are; those of the first frames count.
    MoreGroups {
        /// The frames that it has them for.
        found: usize,
        /// The frames that there are.
        frames: usize,
    },
    /// The least value is white; black and white were exchanged.
    Inverted,
    /// Labels are the numbers of segments.
    Segments {
        /// Their numbers and names.
        list: String,
    },
    /// Segments hold shares of the greatest value, which became numbers from 0 to 1.
    Shares {
        /// The greatest value.
        greatest: u16,
    },
}

impl ScanNote {
    /// Whether the image may be other than the user thinks.
    pub(super) fn is_warning(&self) -> bool {
        match self {
            Self::Below { .. }
            | Self::GantryTilt { .. }
            | Self::Shifted { .. }
            | Self::Uneven { .. }
            | Self::GivenGaps { .. }
            | Self::OddAxes { .. }
            | Self::MoreGroups { .. } => true,
            Self::Series { .. }
            | Self::NoPreamble { .. }
            | Self::EmptySlices { .. }
            | Self::Inverted
            | Self::Segments { .. }
            | Self::Shares { .. } => false,
        }
    }

    /// Whether nothing was guessed, filled, left out or changed.
    pub(super) fn is_remark(&self) -> bool {
        matches!(self, Self::Series { .. } | Self::Segments { .. } | Self::Shares { .. })
    }
}

impl From<ScanNote> for ReadNote {
    fn from(note: ScanNote) -> Self {
        Self::Scan(note)
    }
}

impl fmt::Display for ScanNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Series { name, count } => write!(f, "series {name}: 1 of {count} in the folder"),
            Self::Below { folder } => {
                write!(f, "the folder itself holds no slices; those in {folder} are read")
            }
            Self::NoPreamble { count: 1, file } => write!(
                f,
                "{file} has neither the preamble nor the magic word of DICOM; it is read by its first element"
            ),
            Self::NoPreamble { count, file } => write!(
                f,
                "{count} files, such as {file}, have neither the preamble nor the magic word of DICOM; they are \
                 read by their first elements"
            ),
            Self::GantryTilt { degrees, before: [nx, ny], after: [mx, my] } => write!(
                f,
                "slices are sheared by {degrees:.3} degrees (gantry tilt); they are resampled onto a grid at \
                 right angles, from {nx} × {ny} to {mx} × {my} samples each, and what none of them covers has \
                 no data"
            ),
            Self::Shifted { most } => write!(
                f,
                "slices stand beside each other, by {most:.2} samples at most; they are resampled onto one grid"
            ),
            Self::Uneven { most } => write!(
                f,
                "slices stand unevenly, up to {:.1} % of a gap from even places; they are resampled to these",
                100.0 * most
            ),
            Self::GivenGaps { least, greatest } => write!(
                f,
                "gaps between slices are {least} to {greatest} in the file; they are taken to be even, of the \
                 spacing that is given"
            ),
            Self::OddAxes { axes } => write!(
                f,
                "the axes {axes:?} are no unit vectors at right angles; those of the world are taken"
            ),
            Self::EmptySlices { empty, count } => {
                write!(f, "{empty} of {count} slices have no frame; they are empty")
            }
            Self::MoreGroups { found, frames } => write!(
                f,
                "there are functional groups of {found} frames for {frames}; the first ones count"
            ),
            Self::Inverted => f.write_str(
                "the least value is white in the file (MONOCHROME1); stored values are turned round",
            ),
            Self::Segments { list } => write!(f, "labels are the numbers of segments: {list}"),
            Self::Shares { greatest } => {
                write!(f, "values are shares of {greatest}; they are divided by it")
            }
        }
    }
}
