//! Ridges: the middles of lines (2-D) and sheets (3-D) that are brighter, or darker, than what is about them.
//!
//! After Hale (2002). The field is the smoothed image, less the background. The direction is the normal of features, from
//! the structure tensor, or from the image's curvature where features are too close to each other for a tensor. Crests
//! are where the derivative along the normal crosses zero, on the bright side of the background.
//!
//! The background is the median; a full feature is as bright as the 98th percentile of all crests. Departure
//! from Hale: crossings are found between samples, so that valleys made of them are alike at any slant.

use super::crossings::{Row, crossings, scale_strengths};
use super::unit::UnitValues;
use super::{CrestOptions, Finder, Polarity, Thresholds};
use crate::crests::FeaturePoint;
use crate::enhance::EnhanceError;
use crate::geometry::linear::largest_eigenvector;
use crate::image::{Grid, StructureTensor};
use crate::watch::{Cancelled, Watch};

/// The least curvature across a valley of b, per squared least step.
const LEAST_CURVATURE: f32 = 1e-3;

/// Finds ridges.
pub(super) struct Ridges(pub CrestOptions);

/// See [`CrestOptions::scale`].
const SCALE: f64 = 1.5;

/// See [`CrestOptions::normal_scale`].
const NORMAL_SCALE: f64 = 12.0;

impl<const D: usize> Finder<D> for Ridges {
    const KIND: &'static str = "ridges";
    const THRESHOLDS: Thresholds = Thresholds { low: 0.3, high: 0.5, least_length: 10.0 };

    fn options(&self) -> &CrestOptions {
        &self.0
    }

    fn points(
        &self,
        values: &[f32],
        grid: &Grid<D>,
        watch: &mut dyn Watch,
    ) -> Result<Vec<FeaturePoint<D>>, EnhanceError> {
        let Some(unit) = UnitValues::new(values) else { return Ok(Vec::new()) };
        let grid = grid.in_least_steps();
        let scale = self.0.scale.unwrap_or(SCALE);
        let normal_scale = self.0.normal_scale.unwrap_or(NORMAL_SCALE);
        let signs: &[f32] = match self.0.polarity.unwrap_or_default() {
            Polarity::Bright => &[1.0],
            Polarity::Dark => &[-1.0],
            Polarity::Both => &[1.0, -1.0],
        };
        let background = unit.quantile(0.5);
        let smooth = grid.step.map(|step| normal_scale / step);
        let tensor = if normal_scale > 0.0 {
            Some(StructureTensor::new(values, &grid, scale, smooth, watch)?)
        } else {
            None
        };
        let visit = |row: &Row<D>, crests: &mut Vec<FeaturePoint<D>>| {
            let normals = tensor.as_ref().and_then(|tensor| tensor.row(row.sample));
            for (x, &value) in row.average.iter().enumerate() {
                if value <= 0.0 {
                    continue;
                }
                let normal = match &normals {
                    Some(normals) => normals.normal(x).0,
                    None => across(row.hessian(x)),
                };
                if let Some(top) = row.summit(&normal, x, 1.0) {
                    let height = value + 0.5 * top.slope * top.offset;
                    crests.extend(row.crest(x, normal, top.offset, height));
                }
            }
        };
        let mut crests = Vec::new();
        for sign in signs {
            let fill = |start: usize, out: &mut [f32]| {
                unit.fill(start, out);
                out.iter_mut().for_each(|v| *v = sign * (*v - background) + 0.0); // no −0
            };
            crests.extend(crossings(fill, &grid, scale, visit, watch)?);
        }
        scale_strengths(&mut crests);
        Ok(crests)
    }
}

/// The bottoms of the valleys of b, smoothed by a Gaussian of `sigma` least steps, where it is below −`least_depth`; their
/// strength is the depth. Positions are in samples, normals per lattice unit.
///
/// As [`bottoms`](crate::crests::bottoms), in one pass: slopes are differentiated between neighbours, not by a Gaussian
/// of their own. On a brain and on volumes of 512³ it takes a quarter of the time and no copy.
pub(in crate::enhance) fn valleys<const D: usize>(
    potential: &[f32],
    grid: &Grid<D>,
    sigma: f64,
    least_depth: f32,
    watch: &mut dyn Watch,
) -> Result<Vec<FeaturePoint<D>>, Cancelled> {
    let grid = grid.in_least_steps();
    let fill = |start: usize, out: &mut [f32]| {
        let values = &potential[start..start + out.len()];
        // no −0, so that the stream can tell rows of zeros
        out.iter_mut().zip(values).for_each(|(out, b)| *out = 0.0 - b);
    };
    let visit = |row: &Row<D>, crests: &mut Vec<FeaturePoint<D>>| {
        for (x, &depth) in row.average.iter().enumerate() {
            if depth <= least_depth {
                continue;
            }
            let normal = across(row.hessian(x));
            let top = row.summit(&normal, x, 1.0);
            if let Some(top) = top.filter(|top| top.bend < -LEAST_CURVATURE) {
                crests.extend(row.crest(x, normal, top.offset, depth));
            }
        }
    };
    crossings(fill, &grid, sigma, visit, watch)
}

/// The direction in which the image is bent downwards most.
fn across<const D: usize>(hessian: [[f64; D]; D]) -> [f32; D] {
    largest_eigenvector(hessian.map(|row| row.map(|h| -h))).map(|n| n as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::coordinates;
    use crate::watch::Silent;
    use proptest::prelude::*;

    /// How far a sample is from the middle of the box along a unit normal, in lattice units.
    fn across_middle<const D: usize>(grid: &Grid<D>, normal: [f64; D], index: usize) -> f64 {
        let sample = coordinates(index, grid.shape);
        let from_middle =
            |k: usize| (sample[k] as f64 - 0.5 * (grid.shape[k] - 1) as f64) * grid.step[k];
        (0..D).map(|k| normal[k] * from_middle(k)).sum()
    }

    fn unit<const D: usize>(v: [f64; D]) -> [f64; D] {
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v.map(|x| x / norm)
    }

    fn found<const D: usize>(
        values: &[f32],
        grid: &Grid<D>,
        options: CrestOptions,
    ) -> Vec<FeaturePoint<D>> {
        super::super::crests(&Ridges(options), values, grid, &mut Silent).unwrap()
    }

    /// Crests of a tilted Gaussian sheet are on it.
    fn is_on_the_sheet<const D: usize>(grid: Grid<D>, normal: [f64; D], normal_scale: f64) {
        let (normal, width) = (unit(normal), 1.5 * grid.least_step());
        let values: Vec<f32> = (0..grid.sample_count())
            .map(|i| (-0.5 * (across_middle(&grid, normal, i) / width).powi(2)).exp() as f32)
            .collect();
        let options = CrestOptions { normal_scale: Some(normal_scale), ..Default::default() };
        let crests = found(&values, &grid, options);
        let inner = |k: usize, i: usize| (7..grid.shape[k] - 7).contains(&i);
        let mut count = 0;
        for crest in &crests {
            let sample = coordinates(crest.index, grid.shape);
            if !(0..D).all(|k| inner(k, sample[k])) {
                continue; // where mirrored samples bend the sheet
            }
            let from_middle =
                |k: usize| (crest.position[k] - 0.5 * (grid.shape[k] - 1) as f64) * grid.step[k];
            let off: f64 = (0..D).map(|k| normal[k] * from_middle(k)).sum();
            // 0.05/s² samples, s² = 1.5² + 1.5², where the slope is taken linear between samples; on a
            // volume's diagonal, where feet are as far as 0.6 √3 off, it is extended to 0.08
            assert!(off.abs() < 0.09 * grid.least_step(), "{off} at {sample:?} {normal:?}");
            let cosine: f64 = (0..D).map(|k| normal[k] * crest.normal[k]).sum();
            assert!(cosine.abs() > 0.999, "{cosine} {normal:?}");
            count += 1;
        }
        // every column along the steepest axis has one
        let steepest =
            (0..D).fold(0, |best, k| if normal[k].abs() > normal[best].abs() { k } else { best });
        let columns: usize =
            (0..D).filter(|&k| k != steepest).map(|k| grid.shape[k] - 14).product();
        assert!(2 * count > columns, "{count} of {columns}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn crests_are_on_tilted_sheets(normal in prop::array::uniform3(-1.0..1.0f64)) {
            prop_assume!(normal[..2].iter().map(|n| n * n).sum::<f64>() > 0.05);
            for normal_scale in [0.0, 4.0] {
                is_on_the_sheet(Grid { shape: [40, 37], step: [1.0; 2] }, [normal[0], normal[1]], normal_scale);
                is_on_the_sheet(Grid { shape: [24, 27, 25], step: [2.0; 3] }, normal, normal_scale);
            }
        }
    }

    /// A ring of radius 15, dark on bright.
    fn ring(n: usize) -> Vec<f32> {
        let middle = 0.5 * (n - 1) as f64;
        let value = |i: usize| {
            let (x, y) = ((i % n) as f64 - middle, (i / n) as f64 - middle);
            5.0 - (-0.5 * ((x.hypot(y) - 15.0) / 1.2).powi(2)).exp()
        };
        (0..n * n).map(|i| value(i) as f32).collect()
    }

    #[test]
    fn crests_of_a_ring_are_on_it_and_close() {
        let grid = Grid { shape: [51, 51], step: [1.0; 2] };
        let options = CrestOptions { normal_scale: Some(2.0), ..Default::default() };
        let crests = found(&ring(51), &grid, options);
        let mut angles: Vec<f64> = Vec::new();
        for crest in crests {
            let [x, y] = crest.position.map(|p| p - 25.0);
            // smoothing by 1.5 moves a ring by about σ²/2R = 0.08, and tensors turn normals a little
            assert!((x.hypot(y) - 15.0).abs() < 0.15, "{}", x.hypot(y));
            angles.push(y.atan2(x));
        }
        angles.sort_by(f64::total_cmp);
        // neighbours on a slanted line are √2 samples apart
        let widest = angles.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        assert!(widest * 15.0 < 1.7, "{}", widest * 15.0);
    }

    #[test]
    fn bright_is_dark_of_the_negative() {
        let grid = Grid { shape: [51, 51], step: [1.0; 2] };
        let dark = ring(51);
        let bright: Vec<f32> = dark.iter().map(|v| 5.0 - v).collect();
        let options = CrestOptions { normal_scale: Some(2.0), ..Default::default() };
        let [a, b] =
            [(&dark, Polarity::Dark), (&bright, Polarity::Bright)].map(|(values, polarity)| {
                found(values, &grid, CrestOptions { polarity: Some(polarity), ..options })
            });
        assert!(!a.is_empty() && a.len() == b.len());
        for (a, b) in a.iter().zip(&b) {
            assert_eq!(a.index, b.index);
            assert!((0..2).all(|k| (a.position[k] - b.position[k]).abs() < 1e-3));
        }
    }

    #[test]
    fn short_lines_are_left_out() {
        let grid = Grid { shape: [60, 30], step: [1.0; 2] };
        let on =
            |x: usize, y: usize| y == 8 && (5..55).contains(&x) || y == 22 && (20..26).contains(&x);
        let values: Vec<f32> =
            (0..1800).map(|i| if on(i % 60, i / 60) { 1.0 } else { 0.0 }).collect();
        let options = CrestOptions {
            polarity: Some(Polarity::Bright),
            normal_scale: Some(4.0),
            least_length: Some(20.0),
            ..Default::default()
        };
        let crests = found(&values, &grid, options);
        assert!(
            crests.iter().all(|crest| (7..10).contains(&(crest.index / 60))) && crests.len() > 40
        );
        let all = found(&values, &grid, CrestOptions { least_length: Some(0.0), ..options });
        assert!(all.iter().any(|crest| crest.index / 60 == 22));
    }

    #[test]
    fn constant_and_thin_images_have_none_or_no_trouble() {
        for shape in [[7, 5, 1], [1, 1, 1], [1, 9, 4], [2, 2, 2]] {
            let grid = Grid { shape, step: [1.0; 3] };
            let count = grid.sample_count();
            assert!(found(&vec![3.0; count], &grid, CrestOptions::default()).is_empty());
            let values: Vec<f32> = (0..count).map(|i| (i * 7 % 5) as f32).collect();
            for normal_scale in [0.0, 12.0] {
                let options = CrestOptions {
                    normal_scale: Some(normal_scale),
                    least_length: Some(0.0),
                    ..Default::default()
                };
                for crest in found(&values, &grid, options) {
                    let sample = coordinates(crest.index, shape);
                    assert!((0..3).all(|k| (crest.position[k] - sample[k] as f64).abs() <= 0.6001));
                    assert!((0.0..=1.0).contains(&crest.strength));
                }
            }
        }
    }

    #[test]
    fn a_turned_image_has_turned_ridges() {
        let grid = Grid { shape: [51, 51], step: [1.0; 2] };
        let mut values = ring(51);
        values
            .iter_mut()
            .enumerate()
            .for_each(|(i, v)| *v -= ((i * i * 7919) % 1009) as f32 * 4e-4);
        let backwards: Vec<f32> = values.iter().rev().copied().collect();
        let swapped: Vec<f32> = (0..2601).map(|i| values[i % 51 * 51 + i / 51]).collect();
        let options = CrestOptions { normal_scale: Some(3.0), ..Default::default() };
        let crests = found(&values, &grid, options);
        let near = |others: Vec<FeaturePoint<2>>, back: &dyn Fn([f64; 2]) -> [f64; 2]| {
            let same = |a: &FeaturePoint<2>| {
                others.iter().any(|b| {
                    let [x, y] = back(b.position);
                    (a.position[0] - x).abs().max((a.position[1] - y).abs()) < 1e-2
                })
            };
            crests.iter().filter(|crest| same(crest)).count()
        };
        // rounding may decide of crests at the edge of a threshold
        let least = crests.len() * 99 / 100;
        assert!(near(found(&backwards, &grid, options), &|[x, y]| [50.0 - x, 50.0 - y]) >= least);
        assert!(near(found(&swapped, &grid, options), &|[x, y]| [y, x]) >= least);
        assert!(crests.len() > 80);
    }

    #[test]
    fn bits_do_not_depend_on_the_number_of_threads() {
        let grid = Grid { shape: [19, 23, 90], step: [1.0; 3] };
        let values: Vec<f32> =
            (0..grid.sample_count()).map(|i| ((i * i * 7919 + 3 * i) % 1999) as f32).collect();
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| found(&values, &grid, CrestOptions::default()))
        };
        let one = run(1);
        assert!(!one.is_empty() && one == run(3) && one == run(8));
    }
}
