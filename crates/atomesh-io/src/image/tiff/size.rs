//! How large samples are: by a description, or else by the resolution tags.

use std::io::{Read, Seek};

use ::tiff::decoder::Decoder;
use ::tiff::tags::Tag;

use super::super::note::ReadNote;
use super::page::positive;
use super::stack::{IMAGEJ, Size, Stack};

/// Resolutions, samples an inch, that software writes without having measured anything.
const USUAL: [f64; 5] = [72.0, 96.0, 150.0, 300.0, 600.0];

/// How far a resolution may be from a usual one, relative to it: those in centimetres are rounded to four digits or
/// so, as 28.35 for 72 an inch.
const ROUNDED: f64 = 1e-3;

const MM_PER_INCH: f64 = 25.4;

/// What the resolution tags of the page at which the decoder is say.
pub(super) struct Resolution {
    /// Samples along x and y in a unit.
    per_unit: [Option<f64>; 2],
    /// The unit in millimetres; none if it is not named.
    unit: Option<f64>,
}

impl Resolution {
    pub fn of<R: Read + Seek>(decoder: &mut Decoder<R>) -> Self {
        let per_unit = [Tag::XResolution, Tag::YResolution].map(|tag| positive(decoder, tag));
        let unit = match decoder.find_tag_unsigned::<u16>(Tag::ResolutionUnit) {
            Ok(Some(1)) => None,
            Ok(Some(3)) => Some(10.0),
            _ => Some(MM_PER_INCH), // what the format takes where the tag is not there
        };
        Self { per_unit, unit }
    }

    /// The usual resolution that this is, samples an inch.
    fn usual(per_inch: [f64; 2]) -> Option<f64> {
        let is_near = |usual: f64| per_inch.iter().all(|r| (r - usual).abs() <= ROUNDED * usual);
        USUAL.into_iter().find(|&usual| is_near(usual))
    }

    /// The size by the tags alone, in millimetres, and what there is to note if they do not count.
    fn bare(&self) -> (Option<Size>, Option<ReadNote>) {
        let [Some(x), Some(y)] = self.per_unit else { return (None, None) };
        let Some(unit) = self.unit else {
            let is_square = (x - y).abs() <= ROUNDED * x;
            return (None, (!is_square).then_some(ReadNote::OblongSamples { resolution: [x, y] }));
        };
        if [x, y] == [1.0; 2] {
            return (None, None); // what is written where nothing is known
        }
        if let Some(per_inch) = Self::usual([x, y].map(|r| r * MM_PER_INCH / unit)) {
            return (None, Some(ReadNote::UsualResolution { per_inch }));
        }
        let spacing = [Some(unit / x), Some(unit / y), None];
        (Some(Size { spacing, unit: "mm".into() }), None)
    }
}

/// The spacing of an image of two or three axes, its unit, and what there is to note. It is 1 where the file says
/// nothing.
pub(super) fn spacing(
    stack: &Stack,
    resolution: &Resolution,
    axes: usize,
    notes: &mut Vec<ReadNote>,
) -> (Vec<f64>, String) {
    let stated = match &stack.imagej {
        Some(imagej) => {
            let size = imagej.size(resolution.per_unit);
            let in_inches = size.unit == "inch";
            let usual = match resolution.per_unit {
                [Some(x), Some(y)] if in_inches => Resolution::usual([x, y]),
                _ => None,
            };
            match usual {
                Some(per_inch) => {
                    notes.push(ReadNote::UsualResolution { per_inch });
                    None
                }
                None => Some((size, IMAGEJ)),
            }
        }
        None => stack.size.clone(),
    };
    let says = |(size, _): &(Size, _)| size.spacing[..axes].iter().any(Option::is_some);
    let stated = stated.filter(says).or_else(|| {
        let (size, note) =
            if notes.iter().any(is_usual) { (None, None) } else { resolution.bare() };
        notes.extend(note);
        Some((size?, "the resolution tags"))
    });
    let Some((size, source)) = stated else { return (vec![1.0; axes], String::new()) };
    let Size { spacing: [x, y, z], unit } = size;
    let (x, y) = (x.or(y), y.or(x)); // of one that is stated alone samples are square
    let spacing: Vec<f64> = [x, y, z].map(|s| s.unwrap_or(1.0))[..axes].to_vec();
    notes.push(ReadNote::SampleSize { spacing: spacing.clone(), unit: unit.clone(), source });
    if axes == 3 && z.is_none() {
        notes.push(ReadNote::NoPlaneSpacing { spacing: 1.0, unit: unit.clone() });
    }
    (spacing, unit)
}

fn is_usual(note: &ReadNote) -> bool {
    matches!(note, ReadNote::UsualResolution { .. })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bare(x: f64, y: f64, unit: Option<f64>) -> (Option<Size>, Option<ReadNote>) {
        Resolution { per_unit: [Some(x), Some(y)], unit }.bare()
    }

    #[test]
    fn a_resolution_counts_unless_it_is_a_habit_of_software() {
        for (x, unit) in
            [(72.0, 25.4), (300.0, 25.4), (28.35, 10.0), (118.11, 10.0), (37.795, 10.0)]
        {
            let (size, note) = bare(x, x, Some(unit));
            assert!(
                size.is_none() && matches!(note, Some(ReadNote::UsualResolution { .. })),
                "{x}"
            );
        }
        let (size, note) = bare(100.0, 50.0, Some(10.0));
        assert_eq!(size.unwrap().spacing, [Some(0.1), Some(0.2), None]);
        assert_eq!(note, None);
        // 72 along one axis alone is measured
        assert!(bare(72.0, 36.0, Some(25.4)).0.is_some());
        assert_eq!(bare(1.0, 1.0, Some(25.4)), (None, None));
        assert_eq!(bare(5.0, 5.0, None), (None, None));
        assert!(matches!(bare(1.0, 2.0, None).1, Some(ReadNote::OblongSamples { .. })));
    }
}
