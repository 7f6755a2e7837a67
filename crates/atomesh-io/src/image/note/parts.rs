//! Notes on what of a file was read: slices, pages, arrays, segments, traces.

use std::fmt;

use super::ReadNote;

/// The names of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Numbers as in `(1, 0.5, 2)`.
fn listed(numbers: &[f64]) -> String {
    let words: Vec<_> = numbers.iter().map(f64::to_string).collect();
    format!("({})", words.join(", "))
}

/// A shape as NumPy writes it.
fn tuple(shape: &[usize]) -> String {
    let words: Vec<_> = shape.iter().map(usize::to_string).collect();
    format!("({})", words.join(", "))
}

impl ReadNote {
    /// Of these notes, whether it is a warning; true of all others.
    pub(super) fn parts_are_a_warning(&self) -> bool {
        !matches!(
            self,
            Self::Sheared { .. }
                | Self::LevelSlice { .. }
                | Self::ObliqueSlice { .. }
                | Self::Gzip { .. }
                | Self::Luminance
                | Self::PaletteLuminance
                | Self::UnitAxes { .. }
                | Self::OneArray { .. }
                | Self::Slices { .. }
                | Self::OtherFiles { .. }
                | Self::Segment { .. }
                | Self::DuplicateTraces { .. }
                | Self::CountedTexts { .. }
                | Self::OtherRevision { .. }
        )
    }

    /// What of a file was read.
    pub(super) fn write_parts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sheared { first, second, degrees, distance } => write!(
                f,
                "axes {} and {} meet at {degrees:.4} degrees in the file; the nearest ones at right angles \
                 are taken, which moves samples by {distance:.4} at most",
                AXES[*first], AXES[*second]
            ),
            Self::LevelSlice { z } => {
                write!(f, "a single slice is read as flat; it lies in the plane z = {z}")
            }
            Self::ObliqueSlice { origin, axes: [x, y] } => write!(
                f,
                "a single slice is read as flat, in its own plane: its first sample is at {} in the world, its \
                 axes run along {} and {}",
                listed(origin),
                listed(x),
                listed(y)
            ),
            Self::NoMatrix { taken } => {
                write!(f, "the matrix of the sform is 0; {taken} is taken")
            }
            Self::UsualFrame { fault, usual } => write!(f, "{fault}; {usual} are taken"),
            Self::Gzip { is_packed: true } => {
                f.write_str("the file is packed by gzip, which its name does not say")
            }
            Self::Gzip { is_packed: false } => {
                f.write_str("the file is not packed by gzip, as its name says; it is read as it is")
            }
            Self::Luminance => f.write_str("colours are read as their luminance"),
            Self::PaletteLuminance => f.write_str(
                "the colours of the palette are read as their luminance; as labels and masks its indices are",
            ),
            Self::ColourAxis { shape } => write!(
                f,
                "the last axis of the array of shape {} is taken for colours, which are read as their \
                 luminance; a volume of so few samples along x can be given with its axes turned",
                tuple(shape)
            ),
            Self::UnitAxes { shape } => {
                write!(f, "the array has shape {}; axes of length 1 are left out", tuple(shape))
            }
            Self::OneArray { name, others, .. } => {
                write!(f, "the array {name:?} is read")?;
                match others.is_empty() {
                    true => Ok(()),
                    false => write!(f, "; others in the file: {}", others.join(", ")),
                }
            }
            Self::NoArrays { wanted } => write!(
                f,
                "the array {wanted:?} was asked for; the file has no names of arrays, and is read as it is"
            ),
            _ => self.write_files(f),
        }
    }

    /// What of several files, pages, segments or traces was read.
    fn write_files(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slices { first, last, count } => {
                write!(
                    f,
                    "{count} slices from {first} to {last}, in the order of the numbers in their names"
                )
            }
            Self::SliceNumbers { before, after } => write!(
                f,
                "the numbers of slices do not go on evenly from {before} to {after}; slices are taken to be \
                 evenly spaced"
            ),
            Self::OtherFiles { count, first } => {
                write!(
                    f,
                    "{count} files in the folder are no slices and left out, the first of them {first}"
                )
            }
            Self::SmallPages { left_out, count, found } => write!(
                f,
                "{left_out} of {count} pages are left out: they are smaller than the others, or copies of \
                 them; the first is {found}"
            ),
            Self::Segment { name, number, count } => {
                write!(f, "segment {number} of {count}, {name:?}: 1 inside, 0 outside")
            }
            Self::NoSegments { wanted } => write!(
                f,
                "the segment {wanted:?} was asked for; the file names no segments, and is read as it is"
            ),
            Self::DuplicateTraces { count, is_last, trace } => {
                let kept = if *is_last { "last" } else { "first" };
                write!(
                    f,
                    "{count} traces have the numbers of another one and are left out, the first of them trace \
                     {trace}; the {kept} in the file counts"
                )
            }
            Self::TruncatedTraces { found, promised, rest } => {
                write!(f, "the file is cut short: {found}")?;
                if let Some(promised) = promised {
                    write!(f, " of {promised}")?;
                }
                write!(f, " whole traces are read")?;
                if *rest > 0 { write!(f, ", and {rest} bytes behind them are not") } else { Ok(()) }
            }
            Self::CountedTexts { count } => write!(
                f,
                "revision 0 knows no further textual headers; {count} are taken, since traces fill the file \
                 only behind them"
            ),
            Self::OtherRevision { count } => write!(
                f,
                "{count} additional trace headers are counted as another revision does, with which traces fill \
                 the file"
            ),
            _ => Ok(()), // the others are written elsewhere
        }
    }
}
