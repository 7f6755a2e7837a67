//! What becomes of colour: luminance of pictures, labels by colour, and what of it a mask is.

use std::collections::HashMap;

use atomesh::image::Samples;

use super::error::ReadReason;
use super::format::ImageFormat;
use super::note::ReadNote;
use super::options::Meaning;

/// The most colours that a note lists.
const LISTED: usize = 20;

/// An integer that can carry a colour channel.
pub(super) trait Channel: Copy + PartialEq {
    /// As a wide integer.
    fn widen(self) -> u64;
    /// From a weighted mean of values of this type.
    fn narrow(mean: u64) -> Self;
    /// Values of this type as samples.
    fn samples(values: Vec<Self>) -> Samples;
}

macro_rules! channels {
    ($($number:ty => $kind:ident),*) => {
        $(impl Channel for $number {
            fn widen(self) -> u64 {
                self.into()
            }
            fn narrow(mean: u64) -> Self {
                mean as $number // a mean is no greater than the greatest value in it
            }
            fn samples(values: Vec<Self>) -> Samples {
                Samples::$kind(values.into())
            }
        })*
    };
}

channels!(u8 => U8, u16 => U16, u32 => U32);

/// Makes one value of the channels of each sample, by what values mean; page after page of a file.
pub(super) struct Values {
    pub format: ImageFormat,
    pub meaning: Meaning,
    colours: Colours,
    notes: Vec<ReadNote>,
}

impl Values {
    pub fn new(format: ImageFormat, meaning: Meaning) -> Self {
        Self { format, meaning, colours: Colours::default(), notes: Vec::new() }
    }

    /// Notes something, once for all pages.
    pub fn note(&mut self, note: ReadNote) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    /// The error where colours of floats cannot be what values mean.
    pub fn check_floats(&self) -> Result<(), ReadReason> {
        match self.meaning {
            Meaning::Labels => Err(ReadReason::ColourLabels { format: self.format }),
            Meaning::LabelsByColour => Err(ReadReason::Unsupported {
                format: self.format,
                found: "colours in floats".into(),
                expected: "labels by colours in integers",
            }),
            _ => Ok(()),
        }
    }

    /// One value for every `channels` interleaved ones.
    ///
    /// # Errors
    /// [`ReadReason::ColourLabels`] where colours are to be labels.
    pub fn of<T: Channel>(
        &mut self,
        interleaved: Vec<T>,
        channels: usize,
    ) -> Result<Samples, ReadReason> {
        let is_colour = channels >= 3;
        match self.meaning {
            Meaning::Labels if is_colour => {
                let same = |c: &[T]| c[0] == c[1] && c[0] == c[2];
                if !interleaved.chunks_exact(channels).all(same) {
                    return Err(ReadReason::ColourLabels { format: self.format });
                }
                self.note(ReadNote::EqualChannels);
                Ok(T::samples(first(interleaved, channels)))
            }
            Meaning::LabelsByColour if is_colour => {
                Ok(Samples::U32(self.colours.numbers(&interleaved, channels).into()))
            }
            Meaning::Mask if is_colour => Ok(T::samples(greatest(interleaved, channels))),
            _ => Ok(T::samples(grey(interleaved, channels))),
        }
    }

    /// The samples of all pages, and what there is to note.
    pub fn finish(mut self, samples: Samples) -> (Samples, Vec<ReadNote>) {
        match samples {
            Samples::U32(mut values) if !self.colours.found.is_empty() => {
                let labels = self.colours.labels();
                values.iter_mut().for_each(|value| *value = labels[*value as usize]);
                let note = self.colours.note(&labels);
                self.note(note);
                (Samples::U32(values), self.notes)
            }
            other => (other, self.notes),
        }
    }
}

/// Colours in the order in which they come.
#[derive(Default)]
struct Colours {
    numbers: HashMap<[u64; 3], u32>,
    found: Vec<[u64; 3]>,
    /// The hexadecimal digits of a channel.
    digits: usize,
}

impl Colours {
    /// The number of each sample's colour.
    fn numbers<T: Channel>(&mut self, interleaved: &[T], channels: usize) -> Vec<u32> {
        self.digits = 2 * size_of::<T>();
        let mut last = None;
        let number = |sample: &[T]| {
            let colour = [0, 1, 2].map(|c| sample[c].widen());
            match last {
                Some((same, number)) if same == colour => number,
                _ => {
                    let number = self.number(colour);
                    last = Some((colour, number));
                    number
                }
            }
        };
        interleaved.chunks_exact(channels).map(number).collect()
    }

    fn number(&mut self, colour: [u64; 3]) -> u32 {
        *self.numbers.entry(colour).or_insert_with(|| {
            self.found.push(colour);
            self.found.len() as u32 - 1
        })
    }

    /// The label of each number: 0 of black, of others their rank from 1.
    fn labels(&self) -> Vec<u32> {
        let mut order: Vec<usize> = (0..self.found.len()).collect();
        order.sort_by_key(|&number| self.found[number]);
        let first = u32::from(self.found[order[0]] != [0; 3]);
        let mut labels = vec![0; order.len()];
        for (rank, number) in (first..).zip(order) {
            labels[number] = rank;
        }
        labels
    }

    fn note(&self, labels: &[u32]) -> ReadNote {
        let width = self.digits;
        let text = |[r, g, b]: [u64; 3]| format!("#{r:0width$x}{g:0width$x}{b:0width$x}");
        let named = labels.iter().zip(&self.found).map(|(&label, &colour)| (label, text(colour)));
        let mut named: Vec<_> = named.collect();
        named.sort_unstable();
        named.truncate(LISTED);
        ReadNote::ColourLabels { labels: named, count: labels.len() }
    }
}

/// The first channel of each sample, in place.
fn first<T: Copy>(interleaved: Vec<T>, channels: usize) -> Vec<T> {
    match channels {
        3 => first_of::<3, T>(interleaved),
        _ => first_of::<4, T>(interleaved),
    }
}

/// The greatest of the three colours of each sample, in place.
fn greatest<T: Channel>(interleaved: Vec<T>, channels: usize) -> Vec<T> {
    let of = |sample: &[T]| {
        let colours = &sample[..3];
        let greatest = colours.iter().copied().max_by_key(|value| value.widen());
        greatest.unwrap_or(sample[0])
    };
    match channels {
        3 => in_place::<3, T>(interleaved, of),
        _ => in_place::<4, T>(interleaved, of),
    }
}

/// What there is to know of indices that are taken for values, given which of a palette's are black.
pub(super) fn palette_note(
    indices: &Samples,
    meaning: Meaning,
    is_black: impl Fn(usize) -> bool,
) -> ReadNote {
    let all = || (0..indices.len()).map(|place| indices.get(place) as usize);
    let is_black_elsewhere = meaning == Meaning::Mask
        && !is_black(0)
        && all().any(|index| index == 0)
        && all().any(|index| index > 0 && is_black(index));
    ReadNote::PaletteIndices { is_black_elsewhere }
}

/// Unpacks values of `bits` bits each (1, 2 or 4) to bytes. Each row begins at a whole byte, the most significant bits
/// first.
pub(super) fn unpacked(rows: &[u8], width: usize, bits: usize) -> impl Iterator<Item = u8> {
    let mask = (1 << bits) - 1;
    let value = move |row: &[u8], x: usize| {
        let at = x * bits;
        row[at / 8] >> (8 - bits - at % 8) & mask
    };
    let row_bytes = (width * bits).div_ceil(8).max(1);
    rows.chunks_exact(row_bytes).flat_map(move |row| (0..width).map(move |x| value(row, x)))
}

/// One value a sample of `channels` interleaved ones: grey as it is, grey of grey and opacity, luminance of
/// colours with or without opacity.
pub(super) fn grey<T: Channel>(interleaved: Vec<T>, channels: usize) -> Vec<T> {
    match channels {
        2 => first_of::<2, T>(interleaved),
        3 => luminance::<3, T>(interleaved),
        4 => luminance::<4, T>(interleaved),
        _ => interleaved,
    }
}

/// Rec. 601 luminance of interleaved samples, red, green and blue first of `N`, in place.
///
/// The weights 0.299, 0.587, 0.114 are rounded to 2⁻¹⁶ so that they add up to exactly 1: white stays
/// white, and the result is rounded to the nearest integer.
fn luminance<const N: usize, T: Channel>(interleaved: Vec<T>) -> Vec<T> {
    in_place::<N, T>(interleaved, |sample| {
        let [r, g, b] = [0, 1, 2].map(|c| sample[c].widen());
        T::narrow((19_595 * r + 38_470 * g + 7_471 * b + 32_768) >> 16)
    })
}

/// The first of every `N` interleaved samples, in place.
pub(super) fn first_of<const N: usize, T: Copy>(interleaved: Vec<T>) -> Vec<T> {
    in_place::<N, T>(interleaved, |sample| sample[0])
}

/// One value for every `N` interleaved ones, in the same vector.
pub(super) fn in_place<const N: usize, T: Copy>(
    mut interleaved: Vec<T>,
    value: impl Fn(&[T]) -> T,
) -> Vec<T> {
    let count = interleaved.len() / N;
    for k in 0..count {
        interleaved[k] = value(&interleaved[k * N..][..N]);
    }
    interleaved.truncate(count);
    interleaved.shrink_to_fit();
    interleaved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_keeps_greys_and_weighs_colours() {
        for grey in 0..=255u8 {
            assert_eq!(luminance::<3, u8>(vec![grey; 3]), [grey]);
        }
        assert_eq!(luminance::<3, u8>(vec![255, 0, 0, 0, 255, 0, 0, 0, 255]), [76, 150, 29]);
        assert_eq!(luminance::<4, u16>(vec![65535, 65535, 65535, 0]), [65535]);
        assert_eq!(luminance::<3, u32>(vec![u32::MAX; 3]), [u32::MAX]);
        assert_eq!(first_of::<2, u8>(vec![1, 9, 2, 9]), [1, 2]);
    }

    fn values(meaning: Meaning, rgb: Vec<u8>) -> Result<(Samples, Vec<ReadNote>), ReadReason> {
        let mut values = Values::new(ImageFormat::PNG, meaning);
        let samples = values.of(rgb, 3)?;
        Ok(values.finish(samples))
    }

    #[test]
    fn colours_are_no_labels_unless_they_are_grey() {
        let (samples, notes) = values(Meaning::Labels, vec![3, 3, 3, 7, 7, 7]).unwrap();
        assert_eq!(
            (samples, &notes[..]),
            (Samples::U8(vec![3, 7].into()), &[ReadNote::EqualChannels][..])
        );
        let text = values(Meaning::Labels, vec![3, 3, 3, 7, 7, 8]).unwrap_err().to_string();
        assert!(text.contains("PNG file holds colours"), "{text}");
    }

    #[test]
    fn labels_by_colour_ascend_with_black_as_0() {
        let rgb = vec![255, 0, 0, 0, 130, 0, 0, 0, 255, 0, 130, 0];
        let (samples, notes) = values(Meaning::LabelsByColour, rgb.clone()).unwrap();
        assert_eq!(samples, Samples::U32(vec![3, 2, 1, 2].into()));
        assert_eq!(notes[0].to_string(), "labels by colour: 1 #0000ff, 2 #008200, 3 #ff0000");
        let with_black = [rgb, vec![0, 0, 0]].concat();
        let (samples, _) = values(Meaning::LabelsByColour, with_black).unwrap();
        assert_eq!(samples, Samples::U32(vec![3, 2, 1, 2, 0].into()));
    }

    #[test]
    fn many_colours_are_counted_and_few_are_listed() {
        let rgb: Vec<u8> = (0..=255).flat_map(|k| [k, 1, 1]).collect();
        let (_, notes) = values(Meaning::LabelsByColour, rgb).unwrap();
        let text = notes[0].to_string();
        assert!(text.ends_with("20 #130101 and 236 more"), "{text}");
    }

    #[test]
    fn the_darkest_colour_is_inside_of_a_mask() {
        let (samples, _) = values(Meaning::Mask, vec![0, 0, 1, 0, 0, 0]).unwrap();
        assert_eq!(samples, Samples::U8(vec![1, 0].into()));
    }

    #[test]
    fn bits_are_unpacked_row_by_row() {
        let of = |rows: &[u8], width, bits| unpacked(rows, width, bits).collect::<Vec<_>>();
        assert_eq!(of(&[0b1010_0000, 0b0110_0000], 3, 1), [1, 0, 1, 0, 1, 1]);
        assert_eq!(of(&[0b0001_1011, 0b1100_0000], 5, 2), [0, 1, 2, 3, 3]);
        assert_eq!(of(&[0x1f, 0x20], 3, 4), [1, 15, 2]);
    }
}
