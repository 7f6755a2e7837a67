//! Segmentations: a frame for each segment and slice, made into one volume of labels.
//!
//! Definition: PS3.3, C.8.20 (Segmentation). A sample's label is the number of its segment. Slices without a frame hold no
//! segment; they are put where the others leave room for them. Segments that overlap have no common labels: they are
//! refused, unless one is chosen.

use std::collections::BTreeMap;

use super::super::affine::wrong;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::note::ReadNote;
use super::data_set::DataSet;
use super::series::Slice;
use super::{FORMAT, tag, unsupported};

/// The most slices for each frame there is: beyond, the frames are no volume.
const MOST_EMPTY: usize = 64;

/// What a file says of its segments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Segmentation {
    /// Number and name of each.
    pub segments: BTreeMap<u16, String>,
    /// Of shares, the value that stands for all.
    pub greatest: Option<u16>,
    /// Whether values are the labels themselves.
    pub is_label_map: bool,
}

impl Segmentation {
    /// What a header says; none if it is no segmentation.
    pub fn of(set: &DataSet) -> Result<Option<Self>, ReadReason> {
        if set.text(tag::MODALITY).as_deref() != Some("SEG") {
            return Ok(None);
        }
        let mut segments = BTreeMap::new();
        for item in set.items(tag::SEGMENTS) {
            if let Some(number) = item.short(tag::SEGMENT_NUMBER) {
                segments.insert(number, item.text(tag::SEGMENT_LABEL).unwrap_or_default());
            }
        }
        let kind = set.text(tag::SEGMENTATION_TYPE).unwrap_or("BINARY".into());
        let (greatest, is_label_map) = match kind.as_str() {
            "BINARY" => (None, false),
            "FRACTIONAL" => {
                let greatest = set.short(tag::GREATEST_FRACTION).unwrap_or(255);
                if greatest == 0 {
                    return Err(wrong(FORMAT, "maximum fractional value", "0", "1 or more"));
                }
                (Some(greatest), false)
            }
            "LABELMAP" => (None, true),
            _ => {
                let found = format!("a segmentation of type {kind}");
                return Err(unsupported(found, "BINARY, FRACTIONAL and LABELMAP"));
            }
        };
        Ok(Some(Self { segments, greatest, is_label_map }))
    }

    /// The number of the segment that a name or a number means, and a note on it.
    ///
    /// # Errors
    /// If there is none.
    pub fn chosen(&self, wanted: &str) -> Result<(u16, ReadNote), ReadReason> {
        let text = wanted.trim();
        let number = text.parse().ok().filter(|number| self.segments.contains_key(number));
        let named = || self.segments.iter().find(|(_, name)| name.eq_ignore_ascii_case(text));
        let found = number.or_else(|| named().map(|(number, _)| *number));
        let number = found.ok_or_else(|| self.refusal(1, Some(wanted)))?;
        let name = self.segments.get(&number).cloned().unwrap_or_default();
        let note = ReadNote::Segment { name, number: number.into(), count: self.segments.len() };
        Ok((number, note))
    }

    /// Why segments that overlap in so many layers, or one that is not there, are not read.
    pub fn refusal(&self, layers: usize, wanted: Option<&str>) -> ReadReason {
        ReadReason::Segments { found: self.list(), layers, wanted: wanted.map(str::to_owned) }
    }

    /// Number and name of each segment, for messages.
    pub fn list(&self) -> String {
        let text = |(number, name): (&u16, &String)| match name.is_empty() {
            true => number.to_string(),
            false => format!("{number} {name}"),
        };
        let mut texts: Vec<_> = self.segments.iter().take(20).map(text).collect();
        if self.segments.len() > texts.len() {
            texts.push(format!("{} more", self.segments.len() - texts.len()));
        }
        texts.join(", ")
    }
}

/// The frames of a segmentation by the slices that they are of.
pub(super) struct Stack {
    /// A slice for each place that has a frame, in any order.
    pub places: Vec<Slice>,
    /// The frames of each of them, by where it is read from, with their segments.
    frames: BTreeMap<(usize, usize), Vec<(u16, Slice)>>,
}

impl Stack {
    /// Puts frames of the same place together.
    pub fn new(slices: Vec<Slice>) -> Self {
        // positions of one slice are written alike
        let key = |slice: &Slice| slice.plane.position.map(|p| p.map(f64::to_bits));
        let mut by_place: BTreeMap<_, Vec<Slice>> = BTreeMap::new();
        for slice in slices {
            by_place.entry(key(&slice)).or_default().push(slice);
        }
        let mut stack = Self { places: Vec::new(), frames: BTreeMap::new() };
        for group in by_place.into_values() {
            let first = group[0].clone();
            let of = |slice: Slice| (slice.plane.segment.unwrap_or(1), slice);
            stack.frames.insert(first.source, group.into_iter().map(of).collect());
            stack.places.push(first);
        }
        stack
    }

    /// The frames of one of the places.
    pub fn frames_of(&self, place: &Slice) -> &[(u16, Slice)] {
        self.frames.get(&place.source).map_or(&[], Vec::as_slice)
    }
}

/// Which slice of an even stack each place along the normal is, and how many slices there are. The step is the least gap.
///
/// # Errors
/// If the places are no multiples of it.
pub(super) fn rungs(heights: &[f64]) -> Option<(Vec<usize>, usize)> {
    let gaps = heights.windows(2).map(|w| w[1] - w[0]);
    let step = gaps.fold(f64::MAX, f64::min);
    let first = *heights.first()?;
    if heights.len() < 2 || step <= 0.0 {
        return None;
    }
    let span = (heights[heights.len() - 1] - first) / step;
    if span > (heights.len() * MOST_EMPTY) as f64 {
        return None;
    }
    // the step as exactly as the whole stack tells it
    let count = span.round();
    let step = step * span / count;
    let rung = |height: &f64| {
        let place = (height - first) / step;
        ((place - place.round()).abs() < 0.1).then_some(place.round() as usize)
    };
    let rungs: Vec<usize> = heights.iter().map(rung).collect::<Option<_>>()?;
    let grows = rungs.windows(2).all(|w| w[0] < w[1]);
    grows.then_some((rungs, count as usize + 1))
}

/// Labels of one slice.
pub(super) struct Labels {
    pub values: Vec<i64>,
}

impl Labels {
    /// No segment anywhere.
    pub fn none(count: usize, memory: Memory) -> Result<Self, ReadReason> {
        Ok(Self { values: memory.zeros(count)? })
    }

    /// Puts a segment where a frame has it.
    ///
    /// # Errors
    /// The number of the segment that is there, if it is another one.
    pub fn put(&mut self, segment: u16, frame: &[i64]) -> Result<(), i64> {
        let number = i64::from(segment);
        for (label, value) in self.values.iter_mut().zip(frame) {
            if *value == 0 {
                continue;
            }
            if *label != 0 && *label != number {
                return Err(*label);
            }
            *label = number;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_slices_are_found_between_the_others() {
        assert_eq!(rungs(&[1.0, 3.5, 11.0]), Some((vec![0, 1, 4], 5)));
        // rounded as positions are
        assert_eq!(rungs(&[0.0, 0.33, 0.67, 1.33]), Some((vec![0, 1, 2, 4], 5)));
        assert_eq!(rungs(&[0.0, 1.0, 2.5]), None);
        assert_eq!(rungs(&[0.0, 1e-9, 100.0]), None);
        assert_eq!(rungs(&[7.0]), None);
    }

    #[test]
    fn overlapping_segments_are_refused_by_number() {
        let mut labels = Labels::none(3, Memory::default()).unwrap();
        labels.put(2, &[0, 1, 1]).unwrap();
        labels.put(2, &[0, 0, 1]).unwrap();
        assert_eq!(labels.put(5, &[1, 0, 0]), Ok(()));
        assert_eq!(labels.put(5, &[0, 0, 1]), Err(2));
        assert_eq!(labels.values, [5, 2, 2]);
    }
}
