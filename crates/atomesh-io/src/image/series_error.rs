//! Why a folder's files are not one volume.

/// Why a folder's files are not one volume.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SeriesError {
    /// No file is a DICOM image.
    #[error(
        "the folder holds no DICOM images (other files: {others}); expected the slices of a series"
    )]
    NoImages {
        /// The files that are something else.
        others: usize,
    },
    /// There are images of several series.
    #[error("there are several series: {series}; expected one")]
    SeveralSeries {
        /// Their identifiers, numbers, descriptions, counts and files, as a list.
        series: String,
    },
    /// A series was asked for that is not there.
    #[error("there is no series {wanted:?}; there are {series}")]
    NoSuchSeries {
        /// What was asked for.
        wanted: String,
        /// The series that there are, as a list.
        series: String,
    },
    /// A slice does not say where it is.
    #[error("{file} has no {entry}; expected one in each slice")]
    Missing {
        /// The slice's file.
        file: String,
        /// What is missing.
        entry: &'static str,
    },
    /// Two slices without a position have the same number.
    #[error(
        "{first} and {second} have no position and are both instance {number}; expected one of each number"
    )]
    SameNumber {
        /// The file of one.
        first: String,
        /// The file of the other.
        second: String,
        /// The number of both.
        number: f64,
    },
    /// A slice differs from the others.
    #[error("{file} has {entry} {found}; expected {expected}, as {first} has")]
    Differs {
        /// The slice's file.
        file: String,
        /// In what it differs.
        entry: &'static str,
        /// What it has.
        found: String,
        /// What the first slice has.
        expected: String,
        /// The first slice's file.
        first: String,
    },
    /// The axes of a slice are no unit vectors at right angles.
    #[error("{file} has the axes {axes:?}; expected unit vectors at right angles")]
    Axes {
        /// The slice's file.
        file: String,
        /// The axes found.
        axes: [[f64; 3]; 2],
    },
    /// Two slices are at one place.
    #[error(
        "{first} and {second} are at the same place, {place} along the normal; expected one slice"
    )]
    Duplicate {
        /// The file of one.
        first: String,
        /// The file of the other.
        second: String,
        /// Their common place along the normal, in world units.
        place: f64,
    },
    /// Slices are missing, or stand unevenly.
    #[error(
        "{first} and {second} are {gap} apart, at {place} along the normal; expected {expected}, as \
         most are: {}", slices_missing(*.gap, *.expected)
    )]
    Gap {
        /// The file before the gap.
        first: String,
        /// The file behind it.
        second: String,
        /// The place of the first along the normal, in world units.
        place: f64,
        /// The gap.
        gap: f64,
        /// The median of all gaps.
        expected: f64,
    },
}

/// What a gap says about slices that are not there.
fn slices_missing(gap: f64, expected: f64) -> String {
    let count = (gap / expected).round() - 1.0;
    match count {
        1.0 => "a slice is missing".into(),
        1.0.. => format!("{count} slices are missing"),
        _ => "the slices are uneven".into(),
    }
}
