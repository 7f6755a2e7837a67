//! Images of labels as they are read: what is nearly a whole number becomes one, and what looks like no labels is said.

use std::collections::BTreeSet;

use atomesh::image::{Image, Samples};
use atomesh_io::image::AnyImage;

use crate::error::JobError;
use crate::session::NoteKind;

/// How far a label may be from a whole number: files that keep integers by a slope in single precision come back some
/// 1e-5 off; values farther off are other things than labels.
const NEAR: f64 = 1e-3;

/// More labels than these are hardly labels.
const MANY: usize = 1000;

/// What is odd about labels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Oddity {
    /// Some were rounded, this far at most.
    Rounded { most: f64 },
    /// There are more than so many.
    Many,
}

impl Oddity {
    pub fn kind(self) -> NoteKind {
        if self == Self::Many { NoteKind::Warning } else { NoteKind::Change }
    }

    pub fn text(self) -> String {
        match self {
            Self::Rounded { most } => {
                format!("labels are up to {most:.1e} from whole numbers; they are rounded")
            }
            Self::Many => format!("there are more than {MANY} labels; are these grey values?"),
        }
    }
}

/// The image with whole labels where all are near to them, and what is odd about it. Labels that are not near to whole
/// numbers stay as they are: who takes them refuses the first one.
///
/// # Errors
/// None that input can cause.
pub(crate) fn whole(any: AnyImage) -> Result<(AnyImage, Vec<Oddity>), JobError> {
    Ok(match any {
        AnyImage::Flat(image) => {
            let (image, odd) = of_image(image)?;
            (AnyImage::Flat(image), odd)
        }
        AnyImage::Volume(image) => {
            let (image, odd) = of_image(image)?;
            (AnyImage::Volume(image), odd)
        }
    })
}

/// The same for an image whose dimension is known.
///
/// # Errors
/// None that input can cause.
pub(crate) fn of_image<const D: usize>(
    image: Image<D>,
) -> Result<(Image<D>, Vec<Oddity>), JobError> {
    let mut samples = image.samples().clone();
    let most = match &mut samples {
        Samples::F32(values) => round(values, |v| f64::from(v.fract()), f32::round),
        Samples::F64(values) => round(values, |v| v.fract(), f64::round),
        _ => 0.0,
    };
    let rounded = (most > 0.0).then_some(Oddity::Rounded { most });
    let many = are_many(&samples).then_some(Oddity::Many);
    let image = image.with_samples(samples).map_err(JobError::content)?;
    Ok((image, rounded.into_iter().chain(many).collect()))
}

/// Rounds values if all are near to whole numbers, and gives how far the farthest was; 0 if none was rounded.
fn round<T: Copy>(values: &mut [T], fraction: impl Fn(T) -> f64, whole: impl Fn(T) -> T) -> f64 {
    let distance = |value: &T| {
        let fraction = fraction(*value).abs();
        fraction.min(1.0 - fraction)
    };
    // NaN is not near to anything, and is said elsewhere
    let most = values.iter().map(distance).filter(|d| !d.is_nan()).fold(0.0, f64::max);
    if most > NEAR {
        return 0.0;
    }
    if most > 0.0 {
        values.iter_mut().for_each(|value| *value = whole(*value));
    }
    most
}

/// Whether there are more labels than usual. Cost: O(samples), and less where they are many.
fn are_many(samples: &Samples) -> bool {
    let mut found = BTreeSet::new();
    let mut last = None;
    for index in 0..samples.len() {
        let bits = samples.get(index).to_bits();
        if last != Some(bits) && found.insert(bits) && found.len() > MANY {
            return true;
        }
        last = Some(bits);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use atomesh::image::Frame;

    fn labels(samples: Samples) -> (Samples, Vec<Oddity>) {
        let frame = Frame::new([samples.len(), 1]).unwrap();
        let (image, odd) = of_image(Image::new(frame, samples).unwrap()).unwrap();
        (image.into_parts().1, odd)
    }

    #[test]
    fn labels_near_to_whole_numbers_are_rounded_and_others_stay() {
        let (samples, odd) = labels(Samples::F32(vec![0.0, 0.99998, 6.9995, -2.0004].into()));
        assert_eq!(samples, Samples::F32(vec![0.0, 1.0, 7.0, -2.0].into()));
        assert!(matches!(odd[..], [Oddity::Rounded { most }] if (most - 5e-4).abs() < 1e-6));
        let (samples, odd) = labels(Samples::F64(vec![1.002, 2.0].into()));
        assert_eq!((samples, odd), (Samples::F64(vec![1.002, 2.0].into()), vec![]));
        let (samples, odd) = labels(Samples::F64(vec![f64::NAN, 2.0].into()));
        assert!(samples.get(0).is_nan() && odd.is_empty());
    }

    #[test]
    fn a_thousand_labels_are_usual_and_more_are_not() {
        let of = |count: u16| labels(Samples::U16((0..count).collect())).1;
        assert_eq!(of(1000), []);
        assert_eq!(of(1001), [Oddity::Many]);
    }
}
