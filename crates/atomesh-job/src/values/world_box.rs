//! A box of interest.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use atomesh::image::{Frame, Units};

use super::ValueError;

/// A box in world coordinates, `x0..x1,y0..y1` and in 3-D `,z0..z1`.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldBox(Vec<Range<f64>>);

impl FromStr for WorldBox {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        let error = || ValueError {
            found: text.into(),
            expected: "a range of finite numbers for each axis, as in 0..50,20..80",
        };
        let range = |part: &str| {
            let (start, end) = part.split_once("..")?;
            let range = start.trim().parse::<f64>().ok()?..end.trim().parse::<f64>().ok()?;
            (range.start.is_finite() && range.end.is_finite() && range.start < range.end)
                .then_some(range)
        };
        text.split(',').map(range).collect::<Option<_>>().map(Self).ok_or_else(error)
    }
}

impl fmt::Display for WorldBox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ranges: Vec<_> = self.0.iter().map(|r| format!("{}..{}", r.start, r.end)).collect();
        f.write_str(&ranges.join(","))
    }
}

impl WorldBox {
    /// The samples of the box, rounded outward and limited to the image: first, and one past the
    /// last, along each axis. Where the axes are turned, of the least upright box around it.
    pub fn samples<const D: usize>(
        &self,
        frame: &Frame<D>,
    ) -> Result<([usize; D], [usize; D]), String> {
        if self.0.len() != D {
            return Err(format!("the crop {self} names {} of {D} axes", self.0.len()));
        }
        let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
        for corner in 0..1 << D {
            let at = |k: usize| if corner >> k & 1 == 0 { self.0[k].start } else { self.0[k].end };
            let p = frame.world_to_lattice(Units::Samples, &std::array::from_fn(at));
            for k in 0..D {
                (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
            }
        }
        let shape = frame.shape();
        // a side meant to be on a sample may come out a rounding beyond it
        let slack = |x: f64| 1e-9 * x.abs().max(1.0);
        for k in 0..D {
            if high[k] + slack(high[k]) < 0.0 || low[k] - slack(low[k]) > (shape[k] - 1) as f64 {
                let axis = ["x", "y", "z"][k];
                return Err(format!(
                    "the crop {self} misses the image: along {axis} it spans samples {:.1} to {:.1}, \
                     the image 0 to {}",
                    low[k],
                    high[k],
                    shape[k] - 1
                ));
            }
        }
        let start = std::array::from_fn(|k| (low[k] + slack(low[k])).floor().max(0.0) as usize);
        let end = std::array::from_fn(|k| {
            ((high[k] - slack(high[k])).ceil().max(0.0) as usize + 1).min(shape[k])
        });
        Ok((start, end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_is_rounded_outward_and_limited_to_the_image() {
        let frame = Frame::new([10, 20]).unwrap().with_spacing([2.0, 0.1]).unwrap();
        let frame = frame.with_origin([-4.0, 1.0]).unwrap();
        let crop = |text: &str| text.parse::<WorldBox>().unwrap().samples(&frame);
        assert_eq!(crop("-4..14,1..2.9"), Ok(([0, 0], [10, 20])));
        assert_eq!(crop("-1..1.5,1.3..1.4"), Ok(([1, 3], [4, 5])));
        assert_eq!(crop("-100..100,-5..1.1"), Ok(([0, 0], [10, 2])));
        let missed = crop("20..30,1..2").unwrap_err();
        assert!(missed.contains("along x") && missed.contains("12.0 to 17.0"), "{missed}");
        assert!(crop("1..2").unwrap_err().contains("1 of 2 axes"));
    }

    #[test]
    fn a_crop_of_mirrored_axes_is_in_order() {
        let frame = Frame::new([10, 10]).unwrap().with_direction([[-1.0, 0.0], [0.0, 1.0]]);
        let crop = "-5..-2,0..3".parse::<WorldBox>().unwrap();
        assert_eq!(crop.samples(&frame.unwrap()), Ok(([2, 0], [6, 4])));
    }
}
