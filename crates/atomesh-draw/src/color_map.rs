//! Colours for numbers. Lightness rises evenly from the least to the greatest, so that the order also shows in
//! grey and to colour-blind readers.

use crate::style::Color;

/// The number of colours of a map: shapes of one colour are drawn together.
pub(crate) const LEVELS: usize = 64;

/// Colours from the least to the greatest number, evenly spaced.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColorMap(&'static [Color]);

/// For pressures: viridis (van der Walt & Smith 2015), from dark blue by green to yellow.
pub(crate) const VIRIDIS: ColorMap = ColorMap(&[
    [68, 1, 84],
    [72, 40, 120],
    [62, 74, 137],
    [49, 104, 142],
    [38, 130, 142],
    [31, 158, 137],
    [53, 183, 121],
    [109, 205, 89],
    [180, 222, 44],
    [253, 231, 37],
]);

/// For times of flight: plasma (van der Walt & Smith 2015) without its darkest third, from violet by red to
/// yellow, so that lines show on what is dark.
pub(crate) const PLASMA: ColorMap = ColorMap(&[
    [156, 23, 158],
    [189, 55, 134],
    [216, 87, 107],
    [237, 121, 83],
    [251, 159, 58],
    [253, 202, 38],
    [240, 249, 33],
]);

impl ColorMap {
    /// The colour at a share of the way from the least to the greatest number, clamped to 0…1.
    pub fn at(self, share: f64) -> Color {
        let Self(stops) = self;
        let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        let below = (place as usize).min(stops.len() - 2); // NaN as usize is 0
        let part = place - below as f64;
        std::array::from_fn(|k| {
            let [a, b] = [stops[below][k], stops[below + 1][k]].map(f64::from);
            (a + part * (b - a)).round() as u8 // of NaN 0: black
        })
    }
}

/// Turns of the circle of hues from a part's colour to the next one's: by the golden ratio, so that no few of them are
/// alike.
const HUE_STEP: f64 = 0.618_033_988_749_895;

/// The lightness and the saturation of the colours of parts, one after another: parts of like hues differ in them.
const TONES: [[f64; 2]; 3] = [[0.58, 0.75], [0.45, 0.6], [0.72, 0.65]];

/// The colour of a part by its number, from 1 on.
pub(crate) fn color_of_part(part: i32) -> Color {
    let hue = (HUE_STEP * f64::from(part)).rem_euclid(1.0);
    let [lightness, saturation] = TONES[part.rem_euclid(3) as usize];
    let chroma = saturation * (1.0 - (2.0 * lightness - 1.0).abs());
    std::array::from_fn(|k| {
        // each colour is strong about its own hue: red 0, green 1/3, blue 2/3
        let off = (hue - k as f64 / 3.0).abs();
        let share = (2.0 - 6.0 * off.min(1.0 - off)).clamp(0.0, 1.0);
        (255.0 * (lightness + chroma * (share - 0.5))).round() as u8
    })
}

/// A range of numbers, cut into [`LEVELS`] of equal height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    pub low: f64,
    pub high: f64,
}

impl Range {
    /// The range of the finite numbers without the shares `cut` at its lower and its upper end; `None` without finite
    /// numbers.
    pub fn robust(numbers: impl Iterator<Item = f64>, cut: [f64; 2]) -> Option<Self> {
        let mut finite: Vec<f64> = numbers.filter(|x| x.is_finite()).collect();
        finite.sort_unstable_by(f64::total_cmp);
        let last = finite.len().checked_sub(1)?;
        let at = |share: f64| finite[(share * last as f64).round() as usize];
        Some(Self { low: at(cut[0]), high: at(1.0 - cut[1]) })
    }

    /// Where a number lies between the ends, 0 to 1; 1/2 if these are equal.
    pub fn share(self, number: f64) -> f64 {
        if self.high > self.low { (number - self.low) / (self.high - self.low) } else { 0.5 }
    }

    /// Things in groups by the level of their number, lowest first, each group with its colour. Things whose number is not
    /// finite are left out.
    pub fn grouped<T>(
        self,
        map: ColorMap,
        things: impl Iterator<Item = (f64, T)>,
    ) -> Vec<(Color, Vec<T>)> {
        let mut levels: Vec<Vec<T>> = (0..LEVELS).map(|_| Vec::new()).collect();
        for (number, thing) in things.filter(|(number, _)| number.is_finite()) {
            let level = (self.share(number).clamp(0.0, 1.0) * LEVELS as f64) as usize;
            levels[level.min(LEVELS - 1)].push(thing);
        }
        let color = |level: usize| map.at((level as f64 + 0.5) / LEVELS as f64);
        let groups = levels.into_iter().enumerate().filter(|(_, group)| !group.is_empty());
        groups.map(|(level, group)| (color(level), group)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_rises_from_end_to_end() {
        // weights of Rec. 709: what the eye takes for light, to within the tables' rounding
        let light = |[r, g, b]: Color| {
            0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
        };
        for map in [VIRIDIS, PLASMA] {
            let lights: Vec<f64> = (0..=100).map(|i| light(map.at(f64::from(i) / 100.0))).collect();
            assert!(lights.windows(2).all(|pair| pair[1] >= pair[0] - 1.0), "{lights:?}");
            assert_eq!([map.at(-1.0), map.at(2.0)], [map.0[0], map.0[map.0.len() - 1]]);
        }
    }

    #[test]
    fn parts_near_in_number_have_unlike_colours() {
        assert_eq!(color_of_part(0), [228, 68, 68], "red, in the first tone");
        for part in 1..200 {
            for other in part + 1..part + 12 {
                let [a, b] = [part, other].map(color_of_part);
                let far: i32 =
                    (0..3).map(|k| i32::from(a[k]) - i32::from(b[k])).map(i32::abs).sum();
                assert!(far >= 40, "{part} {a:?}, {other} {b:?}");
            }
        }
    }

    #[test]
    fn groups_keep_order_and_leave_out_what_is_no_number() {
        let numbers = [3.0, f64::NAN, 1.0, 2.0, 3.0, f64::INFINITY];
        let range = Range::robust(numbers.into_iter(), [0.0; 2]).unwrap();
        assert_eq!(range, Range { low: 1.0, high: 3.0 });
        let things = numbers.into_iter().zip(0..);
        let groups: Vec<Vec<i32>> =
            range.grouped(VIRIDIS, things).into_iter().map(|(_, group)| group).collect();
        assert_eq!(groups, [vec![2], vec![3], vec![0, 4]]);
        assert_eq!(Range::robust([f64::NAN].into_iter(), [0.0; 2]), None);
    }
}
