//! Places where an image has no data: traces that were not recorded, what lies outside of a mask.
//!
//! Filters know nothing of them. Before an image is filtered, what is absent is continued from what is there, mirrored about
//! the rim as filters mirror samples about the edges of the image ([`Image::continued`]): where nothing is known, nothing
//! changes, and the rim is no feature. What filters find there is dropped afterwards.
//!
//! The nearest sample that is there is found exactly, axis after axis, by the lower envelope of parabolas (Felzenszwalb &
//! Huttenlocher 2012). Cost: O(samples). Memory: two indices a sample while it is looked for.

use crate::parallel::prelude::*;

use super::place::coordinates;
use super::{FrameError, Image, Range};

/// How far beyond the nearest sample that is there a mirrored one is looked for, over the distance to it: where it is
/// absent too, or outside of the image, the next.
const REFLECTIONS: [f64; 5] = [1.0, 0.75, 0.5, 0.25, 0.0];

impl<const D: usize> Image<D> {
    /// The same image, without data at the samples where `absent` is true. What was absent before is forgotten; nothing is
    /// absent if `absent` is false everywhere.
    ///
    /// # Errors
    /// [`FrameError::SampleCount`] if there are not as many as samples.
    pub fn with_absent(self, absent: Vec<bool>) -> Result<Self, FrameError> {
        let (expected, found) = (self.samples.len(), absent.len());
        if expected != found {
            return Err(FrameError::SampleCount { expected, found });
        }
        Ok(Self { absent: absent.contains(&true).then_some(absent), ..self })
    }

    /// Whether each sample has no data; `None` if all have some.
    pub fn absent(&self) -> Option<&[bool]> {
        self.absent.as_deref()
    }

    /// The range of the samples that have data; of all, if none has.
    pub fn range(&self) -> Range {
        let Some(absent) = self.absent().filter(|absent| absent.contains(&false)) else {
            return self.samples.range();
        };
        let count = absent.iter().filter(|absent| !**absent).count();
        let mut at = 0;
        let runs = absent.chunk_by(|a, b| a == b).filter_map(|run| {
            at += run.len();
            (!run[0]).then_some(at - run.len()..at)
        });
        self.samples.gather(count, runs).range()
    }

    /// The image with what is absent continued from what is there, mirrored about the nearest sample that is: all samples
    /// count as there. `None` if nothing is absent, or everything.
    pub fn continued(&self) -> Option<Self> {
        let absent = self.absent()?;
        if !absent.contains(&false) {
            return None;
        }
        let shape = self.frame.shape();
        let nearest = nearest_present(absent, shape);
        let source = |index: usize| {
            let there = nearest[index];
            if there == index { Some(index) } else { Some(mirrored(index, there, shape, absent)) }
        };
        let samples = self.samples.picked(absent.len(), source);
        Some(Self { frame: self.frame, samples, absent: None })
    }
}

/// The sample that lies as far beyond `there` as `index` lies before it, or nearer to it, as there is one.
fn mirrored<const D: usize>(
    index: usize,
    there: usize,
    shape: [usize; D],
    absent: &[bool],
) -> usize {
    let (from, about) = (coordinates(index, shape), coordinates(there, shape));
    let reflected = |share: f64| {
        let mut at = [0; D];
        for k in 0..D {
            let (from, about) = (from[k] as f64, about[k] as f64);
            let place = (about + share * (about - from)).round();
            if !(0.0..shape[k] as f64).contains(&place) {
                return None;
            }
            at[k] = place as usize;
        }
        let found = (0..D).rev().fold(0, |index, k| index * shape[k] + at[k]);
        (!absent[found]).then_some(found)
    };
    REFLECTIONS.into_iter().find_map(reflected).unwrap_or(there)
}

/// No sample.
const NONE: usize = usize::MAX;

/// The nearest sample that is there to each, in samples along every axis; there is one.
fn nearest_present<const D: usize>(absent: &[bool], shape: [usize; D]) -> Vec<usize> {
    let own = |index: usize| if absent[index] { NONE } else { index };
    let mut nearest: Vec<usize> = (0..absent.len()).into_par_iter().map(own).collect();
    for axis in 0..D {
        // the axis at hand is made the fastest; after all of them the first is again
        if axis > 0 {
            nearest = turned(&nearest, shape[axis - 1], shape[axis]);
        }
        let lines = nearest.par_chunks_mut(shape[axis]).enumerate();
        lines.for_each_init(Envelope::default, |envelope, (number, line)| {
            let place = Line { axis, shape, at: line_place(number, axis, shape) };
            envelope.spread(&place, line);
        });
    }
    turned(&nearest, shape[D - 1], shape[0])
}

/// The values with their second axis, of length `second`, as the fastest, and the fastest, of length `first`, as the
/// slowest.
fn turned(values: &[usize], first: usize, second: usize) -> Vec<usize> {
    let plane = first * second;
    let rest = values.len() / plane;
    let mut out = vec![0; values.len()];
    out.par_chunks_mut(second).enumerate().for_each(|(line, out)| {
        let start = line / rest + plane * (line % rest);
        for (j, out) in out.iter_mut().enumerate() {
            *out = values[start + first * j];
        }
    });
    out
}

/// The coordinates of the first place of a line, where `axis` is the fastest, then those after it, then those before.
fn line_place<const D: usize>(number: usize, axis: usize, shape: [usize; D]) -> [usize; D] {
    let (mut at, mut rest) = ([0; D], number);
    for k in (axis + 1..D).chain(0..axis) {
        (at[k], rest) = (rest % shape[k], rest / shape[k]);
    }
    at
}

/// Where a line of samples is.
struct Line<const D: usize> {
    axis: usize,
    shape: [usize; D],
    /// The first of its places.
    at: [usize; D],
}

impl<const D: usize> Line<D> {
    /// The square of the distance to a sample that is as far along the line's axis.
    fn squared(&self, sample: usize) -> f64 {
        let at = coordinates(sample, self.shape);
        (0..self.axis).map(|k| (at[k] as f64 - self.at[k] as f64).powi(2)).sum()
    }
}

/// A place along a line, the sample that is known from there, and the square of its distance.
#[derive(Clone, Copy)]
struct Parabola {
    place: f64,
    sample: usize,
    squared: f64,
    /// From where on along the line it is the lowest.
    start: f64,
}

/// The lower envelope of the parabolas over one line; whole numbers, so that all is exact but where two of them meet.
#[derive(Default)]
struct Envelope(Vec<Parabola>);

impl Envelope {
    /// Puts at each place of a line the nearest of the samples that all of its places know; none where none know one.
    fn spread<const D: usize>(&mut self, line: &Line<D>, samples: &mut [usize]) {
        self.0.clear();
        for (place, &sample) in samples.iter().enumerate().filter(|(_, s)| **s != NONE) {
            self.push(place as f64, sample, line.squared(sample));
        }
        let mut lowest = 0;
        for (place, sample) in samples.iter_mut().enumerate() {
            while self.0.get(lowest + 1).is_some_and(|next| next.start <= place as f64) {
                lowest += 1;
            }
            *sample = self.0.get(lowest).map_or(NONE, |parabola| parabola.sample);
        }
    }

    /// Adds the parabola about a place after all others.
    fn push(&mut self, place: f64, sample: usize, squared: f64) {
        let height = squared + place * place;
        let start = loop {
            let Some(last) = self.0.last() else { break f64::NEG_INFINITY };
            let of_last = last.squared + last.place * last.place;
            let meet = (height - of_last) / (2.0 * (place - last.place));
            if meet > last.start {
                break meet;
            }
            self.0.pop();
        };
        self.0.push(Parabola { place, sample, squared, start });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Frame, Samples};

    /// Numbers that look random, the same in every run.
    fn numbers(count: usize, seed: u64) -> Vec<u64> {
        let next = |s: &u64| Some(s.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1));
        let all = std::iter::successors(Some(seed), next);
        all.skip(3).take(count).map(|s| s >> 33).collect()
    }

    fn nearest_is_the_nearest_of_all<const D: usize>(shape: [usize; D]) {
        let count = shape.iter().product();
        for (seed, share) in [(1, 2), (2, 10), (3, 40)] {
            let mut absent: Vec<bool> =
                numbers(count, seed).iter().map(|n| n % share != 0).collect();
            absent[count / 3] = false;
            let squared = |a: usize, b: usize| -> usize {
                let (a, b) = (coordinates(a, shape), coordinates(b, shape));
                (0..D).map(|k| a[k].abs_diff(b[k]).pow(2)).sum()
            };
            for (index, found) in nearest_present(&absent, shape).into_iter().enumerate() {
                assert!(!absent[found]);
                let there = (0..count).filter(|&other| !absent[other]);
                let least = there.map(|other| squared(index, other)).min();
                assert_eq!(Some(squared(index, found)), least, "{shape:?} {index}");
            }
        }
    }

    #[test]
    fn the_nearest_sample_there_is_the_nearest_of_all() {
        nearest_is_the_nearest_of_all([17, 9]);
        nearest_is_the_nearest_of_all([1, 12]);
        nearest_is_the_nearest_of_all([7, 5, 6]);
        nearest_is_the_nearest_of_all([5, 1, 8]);
    }

    #[test]
    fn what_is_absent_mirrors_what_is_there() {
        let row = |absent: [bool; 6]| {
            let frame = Frame::new([6, 1]).unwrap();
            let image = Image::new(frame, Samples::U8(vec![1, 2, 3, 4, 5, 6].into())).unwrap();
            image.with_absent(absent.to_vec()).unwrap()
        };
        let continued = row([false, false, false, false, true, true]).continued().unwrap();
        // about the last sample there, 4: one beyond is one before
        assert_eq!(continued.samples(), &Samples::U8(vec![1, 2, 3, 4, 3, 2].into()));
        assert!(continued.absent().is_none());
        // twice as far as there is data: the share of it that is within
        let continued = row([true, true, true, true, false, false]).continued().unwrap();
        assert_eq!(continued.samples(), &Samples::U8(vec![6, 6, 6, 6, 5, 6].into()));
        assert!(row([false; 6]).continued().is_none() && row([true; 6]).continued().is_none());
    }

    #[test]
    fn places_without_data_are_not_in_the_range() {
        let frame = Frame::new([3, 2]).unwrap();
        let image = Image::new(frame, Samples::U8(vec![0, 7, 5, 0, 9, 0].into())).unwrap();
        let ends = |absent: [bool; 6]| {
            let range = image.clone().with_absent(absent.to_vec()).unwrap().range();
            (range.min, range.max)
        };
        assert_eq!(ends([true, false, false, true, true, true]), (5.0, 7.0));
        assert_eq!(ends([false; 6]), (0.0, 9.0));
        assert_eq!(ends([true; 6]), (0.0, 9.0));
    }

    #[test]
    fn a_flag_for_each_sample_is_needed() {
        let image =
            Image::new(Frame::new([2, 2]).unwrap(), Samples::U8(vec![0; 4].into())).unwrap();
        let wrong = FrameError::SampleCount { expected: 4, found: 3 };
        assert_eq!(image.with_absent(vec![true; 3]).unwrap_err(), wrong);
    }
}
