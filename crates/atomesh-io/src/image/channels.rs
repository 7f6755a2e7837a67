//! Samples of several channels to one value each, and planes to a volume.

use atomesh::image::Samples;

use super::colour::{Values, first_of, in_place};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::memory::Memory;
use super::options::Meaning;

/// One value of the channels of each sample.
pub(super) fn mixed(
    stored: Samples,
    channels: usize,
    values: &mut Values,
) -> Result<Samples, ReadReason> {
    let format = values.format;
    let is_float = matches!(stored, Samples::F32(_) | Samples::F64(_));
    if is_float && channels >= 3 && values.meaning != Meaning::Brightness {
        values.check_floats()?;
    }
    Ok(match stored {
        Samples::U8(v) => return values.of(v.into_vec(), channels),
        Samples::U16(v) => return values.of(v.into_vec(), channels),
        Samples::U32(v) => return values.of(v.into_vec(), channels),
        Samples::F32(v) => Samples::F32(grey_floats(v.into_vec(), channels).into()),
        Samples::F64(v) => Samples::F64(grey_floats(v.into_vec(), channels).into()),
        Samples::I8(v) => Samples::I8(without_colour(v.into_vec(), channels, format)?.into()),
        Samples::I16(v) => Samples::I16(without_colour(v.into_vec(), channels, format)?.into()),
        Samples::I32(v) => Samples::I32(without_colour(v.into_vec(), channels, format)?.into()),
        other => other, // no other type is held
    })
}

/// Grey samples without their opacity; colour is refused.
pub(super) fn without_colour<T: Copy>(
    interleaved: Vec<T>,
    channels: usize,
    format: ImageFormat,
) -> Result<Vec<T>, ReadReason> {
    match channels {
        1 => Ok(interleaved),
        2 => Ok(first_of::<2, T>(interleaved)),
        _ => Err(ReadReason::Unsupported {
            format,
            found: "colour in signed integers or integers of 64 bits".into(),
            expected: "colour in unsigned integers of 8 to 32 bits and in floats",
        }),
    }
}

/// Floats without their opacity, colour to Rec. 601 luminance.
fn grey_floats<T>(interleaved: Vec<T>, channels: usize) -> Vec<T>
where
    T: Copy + Into<f64> + FromDouble,
{
    let luminance = |sample: &[T]| {
        let [r, g, b] = [0, 1, 2].map(|c| sample[c].into());
        T::from_double(0.299 * r + 0.587 * g + 0.114 * b)
    };
    match channels {
        2 => first_of::<2, T>(interleaved),
        3 => in_place::<3, T>(interleaved, luminance),
        4 => in_place::<4, T>(interleaved, luminance),
        _ => interleaved,
    }
}

/// A float that a double can be rounded to.
trait FromDouble {
    /// The nearest value.
    fn from_double(value: f64) -> Self;
}

impl FromDouble for f32 {
    fn from_double(value: f64) -> Self {
        value as f32
    }
}

impl FromDouble for f64 {
    fn from_double(value: f64) -> Self {
        value
    }
}

/// Puts a plane behind those that are there; the first one is taken as it is.
pub(super) fn append(
    volume: &mut Option<Samples>,
    plane: Samples,
    count: usize,
    memory: Memory,
) -> Result<(), ReadReason> {
    macro_rules! extend {
        ($($kind:ident),*) => {
            match (volume.as_mut(), plane) {
                $((Some(Samples::$kind(all)), Samples::$kind(more)) => {
                    let all = all.to_mut();
                    memory.grow(all, more.len(), count)?;
                    all.extend_from_slice(&more);
                })*
                (_, plane) => *volume = Some(plane), // planes of one type: only the first comes here
            }
        };
    }
    extend!(U8, I8, U16, I16, U32, I32, F32, F64);
    Ok(())
}
