//! What ImageJ says of a stack in the description of its first page: lines of `key=value`.
//!
//! Definition: `ij.io.FileInfo` and `ij.io.TiffEncoder` of ImageJ. Planes lie with channels fastest, then slices,
//! then frames, which are points of time.

use super::super::length::unit_name;
use super::stack::{Counts, Size};

/// The description.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ImageJ {
    /// How many planes there are in the file.
    pub images: usize,
    pub counts: Counts,
    /// The unit of the resolution tags, if there is one.
    pub unit: Option<String>,
    /// From plane to plane.
    pub plane_spacing: Option<f64>,
}

impl ImageJ {
    /// The description in a text, if ImageJ or a program like it wrote one.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.strip_prefix("ImageJ=")?;
        let value = |key: &str| {
            let entry = |line: &'_ str| Some(line.split_once('=')?.1.trim().to_owned());
            let is_key = |line: &&str| line.split_once('=').is_some_and(|(k, _)| k.trim() == key);
            text.lines().find(is_key).and_then(entry)
        };
        let count = |key: &str| value(key).and_then(|v| v.parse().ok()).filter(|&n: &usize| n > 0);
        let images = count("images").unwrap_or(1);
        let [channels, slices, frames] = ["channels", "slices", "frames"].map(count);
        // a stack that is none of more axes names its images alone
        let is_plain = [channels, slices, frames].iter().all(Option::is_none);
        let counts = Counts {
            channels: channels.unwrap_or(1),
            slices: if is_plain { images } else { slices.unwrap_or(1) },
            times: frames.unwrap_or(1),
        };
        let spacing = value("spacing").and_then(|v| v.parse().ok());
        let plane_spacing = spacing.map(f64::abs).filter(|s| s.is_finite() && *s > 0.0);
        let unit = value("unit").map(|unit| unit_name(&unit)).filter(|unit| !unit.is_empty());
        Some(Self { images, counts, unit, plane_spacing })
    }

    /// How large samples are, given the resolution tags.
    pub fn size(&self, resolution: [Option<f64>; 2]) -> Size {
        let spacing = resolution.map(|per_unit| per_unit.map(f64::recip));
        let [x, y] = match &self.unit {
            // a unit without a resolution is that of steps of 1
            Some(_) => spacing.map(|s| Some(s.unwrap_or(1.0))),
            None => [None; 2],
        };
        let unit = self.unit.clone().unwrap_or_default();
        Size { spacing: [x, y, self.plane_spacing], unit }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_and_axes_are_read_in_the_spellings_of_many_writers() {
        let of = |text: &str| ImageJ::parse(text).unwrap();
        let stack = of("ImageJ=1.53q\nimages=7\nslices=7\nunit=micron\nspacing=2.0\nloop=false\n");
        assert_eq!(stack.counts, Counts { channels: 1, slices: 7, times: 1 });
        let size = stack.size([Some(4.0), None]);
        assert_eq!(size.spacing, [Some(0.25), Some(1.0), Some(2.0)]);
        assert_eq!(size.unit, "um");
        let escaped = of("ImageJ=1.11a\nimages=6\nchannels=2\nframes=3\nunit=\\u00B5m\n");
        assert_eq!(escaped.counts, Counts { channels: 2, slices: 1, times: 3 });
        assert_eq!(escaped.unit.as_deref(), Some("um"));
        let plain = of("ImageJ=1.11a\nimages=5\nunit=pixel\nspacing=-3\n");
        assert_eq!(plain.counts.slices, 5);
        assert_eq!(plain.size([Some(72.0); 2]).spacing, [None, None, Some(3.0)]);
        assert_eq!(ImageJ::parse("made by ImageJ=1"), None);
    }
}
