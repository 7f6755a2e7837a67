//! The planes of a file: which page is which channel, slice and time, and how large samples are.

use super::super::error::ReadReason;
use super::super::note::ReadNote;
use super::super::options::StackOptions;
use super::super::shape::shape_text;
use super::FORMAT;
use super::imagej::ImageJ;
use super::ome::Ome;
use super::page::Page;
use super::shaped;

/// How many planes a stack has along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Counts {
    pub channels: usize,
    pub slices: usize,
    pub times: usize,
}

impl Default for Counts {
    fn default() -> Self {
        Self { channels: 1, slices: 1, times: 1 }
    }
}

impl Counts {
    /// All planes, if they can be counted.
    pub fn planes(&self) -> Option<usize> {
        self.channels.checked_mul(self.slices)?.checked_mul(self.times)
    }
}

/// How large samples are, as far as a file says it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Size {
    /// From one sample to the next along x, y and z.
    pub spacing: [Option<f64>; 3],
    /// The unit, empty if there is none.
    pub unit: String,
}

/// What a file says about its planes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stack {
    pub counts: Counts,
    /// The page of each plane, channels fastest, then slices, then times; none where the file has none.
    pages: Vec<Option<usize>>,
    /// Whether there is one directory, and the planes of all pages follow each other behind its first sample.
    pub is_contiguous: bool,
    /// How large samples are, and who says it; the resolution tags of ImageJ are still to come.
    pub size: Option<(Size, &'static str)>,
    pub imagej: Option<ImageJ>,
}

/// Who describes a stack.
pub(super) const IMAGEJ: &str = "the ImageJ description";
pub(super) const OME: &str = "the OME-XML";
const SHAPED: &str = "the description of its shape";

impl Stack {
    /// The planes of a file of `page_count` pages like the first, whose description is given.
    ///
    /// # Errors
    /// If a description promises channels or times, and other pages than there are.
    pub fn of(
        description: &str,
        page: &Page,
        page_count: usize,
        notes: &mut Vec<ReadNote>,
    ) -> Result<Self, ReadReason> {
        if let Some(imagej) = ImageJ::parse(description) {
            let stack = Self::promised(imagej.counts, imagej.images, page_count, (IMAGEJ, notes))?;
            return Ok(Self { imagej: Some(imagej), ..stack });
        }
        match Ome::parse(description, page_count) {
            Some(Ok(ome)) => return Self::of_ome(ome, page_count, notes),
            Some(Err(fault)) if page_count > 1 => {
                return Err(wrong("OME-XML", fault, "one image of planes"));
            }
            Some(Err(fault)) => notes.push(ReadNote::Description { source: OME, fault }),
            None => {}
        }
        if page.depth > 1 {
            return Ok(Self::plain(page_count)); // all in one page
        }
        match shaped::counts(description, [page.width, page.height], page.planes()) {
            Some(Ok(counts)) => {
                let planes = counts.planes().unwrap_or(usize::MAX);
                let stack = Self::promised(counts, planes, page_count, (SHAPED, notes))?;
                Ok(stack.ordered(&shaped::order(description)))
            }
            Some(Err(shape)) if page_count > 1 => Err(ReadReason::Unsupported {
                format: FORMAT,
                found: format!("planes along several axes, {shape}"),
                expected: "planes along z, or axes that are named",
            }),
            _ => Ok(Self::plain(page_count)),
        }
    }

    /// Pages that are the planes of a volume.
    fn plain(page_count: usize) -> Self {
        let counts = Counts { slices: page_count, ..Counts::default() };
        let pages = (0..page_count).map(Some).collect();
        Self { counts, pages, is_contiguous: false, size: None, imagej: None }
    }

    /// Pages in the order of ImageJ, as far as they are as many as promised.
    fn promised(
        counts: Counts,
        promised: usize,
        page_count: usize,
        (source, notes): (&'static str, &mut Vec<ReadNote>),
    ) -> Result<Self, ReadReason> {
        let is_contiguous = page_count == 1 && promised > 1;
        let found = if is_contiguous { promised } else { page_count };
        if counts.planes() == Some(found) && promised == found {
            let pages = (0..found).map(Some).collect();
            return Ok(Self { counts, pages, is_contiguous, size: None, imagej: None });
        }
        if counts.channels > 1 || counts.times > 1 || is_contiguous {
            let Counts { channels, slices, times } = counts;
            let value = format!(
                "{channels} channels, {slices} slices and {times} times, {promised} planes"
            );
            return Err(ReadReason::Planes { promised: value, found, source_text: source });
        }
        notes.push(ReadNote::PageCount { promised, found, source });
        Ok(Self::plain(page_count))
    }

    fn of_ome(ome: Ome, page_count: usize, notes: &mut Vec<ReadNote>) -> Result<Self, ReadReason> {
        let Ome { counts, pages, size } = ome;
        let size = Some((size, OME));
        let is_there = |page: &Option<usize>| page.is_some_and(|page| page < page_count);
        let found = pages.iter().filter(|page| is_there(page)).count();
        if found == pages.len() && found == page_count {
            return Ok(Self { counts, pages, is_contiguous: false, size, imagej: None });
        }
        let Counts { channels, slices, times } = counts;
        if channels > 1 || times > 1 || found != pages.len() {
            let promised = format!("{channels} channels, {slices} slices and {times} times");
            return Err(ReadReason::Planes { promised, found: page_count, source_text: OME });
        }
        let note = ReadNote::PageCount { promised: slices, found: page_count, source: OME };
        notes.push(note);
        Ok(Self { size, ..Self::plain(page_count) })
    }

    /// The same where the file's planes come in the order of axes as `TZCYX`, the slowest first.
    fn ordered(mut self, axes: &str) -> Self {
        let Counts { channels, slices, times } = self.counts;
        let kinds: Vec<(char, usize)> = axes
            .chars()
            .filter_map(|axis| match axis {
                'C' => Some(('C', channels)),
                'T' => Some(('T', times)),
                'Z' | 'Q' | 'I' => Some(('Z', slices)),
                _ => None,
            })
            .collect();
        let steps: usize = kinds.iter().map(|(_, count)| count).product();
        if steps != self.pages.len() {
            return self; // an axis that is named twice is one in the file's order
        }
        let stride = |kind: char| {
            let at = kinds.iter().position(|(k, _)| *k == kind);
            at.map_or(0, |at| kinds[at + 1..].iter().map(|(_, count)| count).product())
        };
        let strides: [usize; 3] = ['C', 'Z', 'T'].map(stride);
        self.pages = (0..self.pages.len())
            .map(|k| {
                let plane = [k % channels, k / channels % slices, k / channels / slices];
                Some(plane.iter().zip(strides).map(|(n, stride)| n * stride).sum())
            })
            .collect();
        self
    }

    /// All planes.
    pub fn plane_count(&self) -> usize {
        self.pages.len()
    }

    /// The pages of the slices of one channel and time, in order.
    ///
    /// # Errors
    /// [`ReadReason::Stack`] if there are several, and none was chosen, or one that is not there.
    pub fn chosen(
        &self,
        page: &Page,
        options: StackOptions,
        notes: &mut Vec<ReadNote>,
    ) -> Result<Vec<usize>, ReadReason> {
        let Counts { channels, slices, times } = self.counts;
        let mut one = |axis, count: usize, wanted: Option<usize>| match (count, wanted) {
            (1, None | Some(1)) => Some(0),
            (1, Some(wanted)) => {
                notes.push(ReadNote::OnePlane { axis, wanted });
                Some(0)
            }
            (_, Some(number)) if (1..=count).contains(&number) => {
                notes.push(ReadNote::Chosen { axis, number, count });
                Some(number - 1)
            }
            _ => None,
        };
        let channel = one("channel", channels, options.channel);
        let time = one("time", times, options.time);
        let (Some(channel), Some(time)) = (channel, time) else {
            let mut shape = vec![page.width, page.height];
            shape.extend((slices > 1).then_some(slices));
            let (channel, time) = (options.channel, options.time);
            let shape = shape_text(&shape);
            return Err(ReadReason::Stack { channels, times, shape, channel, time });
        };
        let place = |slice: usize| channel + channels * (slice + slices * time);
        // all pages that were promised are there
        Ok((0..slices).filter_map(|slice| self.pages[place(slice)]).collect())
    }
}

fn wrong(field: &'static str, value: String, expected: &'static str) -> ReadReason {
    ReadReason::Header { format: FORMAT, field, value, expected }
}
