//! Crests of edges: the lines (2-D) and surfaces (3-D) along which an image changes most.
//!
//! After Canny (1986). The field is the gradient of the image, smoothed by a Gaussian as narrow as the noise allows, and
//! the direction its own. Crests are where it is greatest along this direction: the zero crossings of the second
//! derivative at which the third is negative. Gradients as weak as those of noise do not count.

use super::crossings::{Row, crossings, scale_strengths};
use super::unit::UnitValues;
use super::{CrestOptions, Finder, Thresholds};
use crate::crests::FeaturePoint;
use crate::enhance::EnhanceError;
use crate::enhance::quantile::{Order, Ranks};
use crate::image::{Grid, coordinates};
use crate::watch::Watch;

/// The scales to choose from, in least steps; the least fills the gaps between samples of slanted edges.
const SCALES: std::ops::RangeInclusive<f64> = 1.5..=4.0;

/// The gradient of a clear edge, over that of noise.
const CLEAR: f64 = 10.0;

/// The least gradient of an edge, over that of noise.
const LEAST_ABOVE_NOISE: f64 = 4.0;

/// The share of samples, at each end of the range, that are left out of the contrast.
const ODD: f64 = 0.005;

/// The greatest shift of an edge that blur is taken to have caused, in least steps: beyond it the edge is a corner.
const GREATEST_SHIFT: f64 = 0.5;

/// The median of the magnitudes of Gaussian noise over its standard deviation.
const MEDIAN_MAGNITUDE: f64 = 0.6745;

/// Finds the crests of edges.
pub(super) struct Edges(pub CrestOptions);

impl<const D: usize> Finder<D> for Edges {
    const KIND: &'static str = "edges";
    const THRESHOLDS: Thresholds = Thresholds { low: 0.2, high: 0.5, least_length: 10.0 };

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
        let noise = noise(&unit, grid.shape);
        let contrast = 0.5 * f64::from(unit.quantile(1.0 - ODD) - unit.quantile(ODD));
        let sigma = self.0.scale.unwrap_or_else(|| clear_scale::<D>(noise, contrast));
        let faint = (LEAST_ABOVE_NOISE * noise * noise_slope::<D>(sigma)) as f32;
        let visit = |row: &Row<D>, crests: &mut Vec<FeaturePoint<D>>| {
            for x in 0..row.average.len() {
                let gradient = row.gradient(x);
                let steepness = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
                if steepness <= faint {
                    continue;
                }
                let normal = gradient.map(|g| g / steepness);
                let Some(steepest) = row.steepest(&normal, x) else { continue };
                let Some(mut crest) = row.crest(x, normal, steepest.offset, steepest.slope) else {
                    continue;
                };
                let shift = inward_shift(row.hessian(x), normal, steepness, steepest.bend);
                for k in 0..D {
                    crest.position[k] += shift * crest.normal[k] / grid.step[k];
                }
                crests.push(crest);
            }
        };
        let fill = |start: usize, out: &mut [f32]| unit.fill(start, out);
        let mut crests = crossings(fill, &grid, sigma, visit, watch)?;
        scale_strengths(&mut crests);
        Ok(crests)
    }
}

/// How far blurring has moved an edge against its normal n, towards the centre of its curvature, in lattice units: ½ σ²
/// times the sum of its curvatures (Verbeek & van Vliet 1994). σ² is that of the image's own blur and of the operator's
/// together, by the second derivative `bend` of the logarithm of slopes along n, −1/σ²; the curvatures are those of the
/// level set.
fn inward_shift<const D: usize>(
    hessian: [[f64; D]; D],
    normal: [f32; D],
    steepness: f32,
    bend: f32,
) -> f64 {
    let normal = normal.map(f64::from);
    let along: f64 =
        (0..D).map(|r| (0..D).map(|c| normal[r] * hessian[r][c] * normal[c]).sum::<f64>()).sum();
    let trace: f64 = (0..D).map(|k| hessian[k][k]).sum();
    let curvatures = (trace - along) / f64::from(steepness);
    (-0.5 * curvatures / f64::from(bend)).clamp(-GREATEST_SHIFT, GREATEST_SHIFT)
}

/// The standard deviation of the image's noise, by the median magnitude of differences between neighbours along
/// all axes at once, of those that are not 0 (Donoho & Johnstone 1994): edges are few, and most of
/// them change along one axis more than along all.
fn noise<const D: usize>(unit: &UnitValues, shape: [usize; D]) -> f64 {
    let count = shape.iter().product();
    let order = Order::new(count, |start, out: &mut [f32]| detail(unit, shape, start, out));
    let none = order.ranked(0);
    let zeros = if none.value == 0.0 { count - none.above } else { 0 };
    let median = order.ranked(zeros + (count - zeros) / 2).value;
    if zeros == count { 0.0 } else { f64::from(median) / MEDIAN_MAGNITUDE }
}

/// Writes, for samples from index `start` on, the magnitude of the difference of sums over the corners of a cell
/// of neighbours, those reached by an even and by an odd number of steps; as large as the noise of one sample.
fn detail<const D: usize>(unit: &UnitValues, shape: [usize; D], start: usize, out: &mut [f32]) {
    let mut neighbours = vec![0.0; out.len()];
    out.fill(0.0);
    // an axis of one sample has no neighbours
    let thin = (0..D).filter(|&k| shape[k] == 1).fold(0, |thin, k| thin | 1usize << k);
    let corners = (0..1usize << D).filter(|corner| corner & thin == 0);
    let scale = 1.0 / (corners.clone().count() as f32).sqrt();
    for corner in corners {
        let (mut offset, mut stride) = (0, 1);
        for k in 0..D {
            offset += if corner >> k & 1 == 1 { stride } else { 0 };
            stride *= shape[k];
        }
        let begin = start + offset;
        let count = out.len().min(stride.saturating_sub(begin));
        neighbours.fill(0.0);
        unit.fill(begin.min(stride), &mut neighbours[..count]);
        let sign = if corner.count_ones() % 2 == 0 { 1.0 } else { -1.0 };
        out.iter_mut().zip(&neighbours).for_each(|(sum, v)| *sum += sign * v);
    }
    for (i, out) in out.iter_mut().enumerate() {
        let sample = coordinates(start + i, shape);
        let inside = (0..D).all(|k| sample[k] + 1 < shape[k] || shape[k] == 1);
        *out = if inside { (*out * scale).abs() } else { 0.0 };
    }
}

/// The standard deviation of one derivative of white noise of deviation 1, smoothed by a Gaussian.
///
/// ∫(G′)² = 1/(4√π σ³) along the derivative's axis, ∫G² = 1/(2√π σ) along each other.
fn noise_slope<const D: usize>(sigma: f64) -> f64 {
    let root = std::f64::consts::PI.sqrt();
    let along = 1.0 / (4.0 * root * sigma.powi(3));
    (along / (2.0 * root * sigma).powi(D as i32 - 1)).sqrt()
}

/// The least scale at which a step of a contrast is clear of noise: the step's slope is contrast/(σ√2π).
fn clear_scale<const D: usize>(noise: f64, contrast: f64) -> f64 {
    let clear = |sigma: f64| {
        let slope = contrast / (sigma * std::f64::consts::TAU.sqrt());
        slope >= CLEAR * noise * noise_slope::<D>(sigma)
    };
    let mut sigma = *SCALES.start();
    while sigma < *SCALES.end() && !clear(sigma) {
        sigma += 0.125;
    }
    sigma
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::coordinates;
    use crate::watch::Silent;
    use rand::{RngExt, SeedableRng};

    fn found<const D: usize>(
        values: &[f32],
        grid: &Grid<D>,
        options: CrestOptions,
    ) -> Vec<FeaturePoint<D>> {
        super::super::crests(&Edges(options), values, grid, &mut Silent).unwrap()
    }

    /// Noise of deviation 1, by the sum of twelve uniform numbers.
    fn noise_of(count: usize) -> Vec<f32> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(4);
        let mut one = || (0..12).map(|_| random.random::<f32>()).sum::<f32>() - 6.0;
        (0..count).map(|_| one()).collect()
    }

    /// A smooth step, one or two samples wide, of a signed distance.
    fn step(s: f64) -> f32 {
        (s / 1.2).tanh() as f32
    }

    fn is_on_the_plane<const D: usize>(grid: Grid<D>, normal: [f64; D]) {
        let middle = |k: usize| 0.5 * (grid.shape[k] - 1) as f64;
        let along = |at: [f64; D]| (0..D).map(|k| normal[k] * (at[k] - middle(k))).sum::<f64>();
        let values: Vec<f32> = (0..grid.sample_count())
            .map(|i| step(along(coordinates(i, grid.shape).map(|c| c as f64))))
            .collect();
        let options = CrestOptions { scale: Some(1.5), ..Default::default() };
        let crests = found(&values, &grid, options);
        let mut count = 0;
        for crest in &crests {
            let sample = coordinates(crest.index, grid.shape);
            if (0..D).any(|k| !(6..grid.shape[k] - 6).contains(&sample[k])) {
                continue; // where mirrored samples bend the edge
            }
            let off = along(crest.position);
            // the slope of a hyperbolic tangent, smoothed, is nearly a bell
            assert!(off.abs() < 0.03, "{off} at {sample:?}");
            count += 1;
        }
        assert!(count >= 20, "{count}");
    }

    #[test]
    fn crests_are_on_slanted_edges() {
        is_on_the_plane(Grid { shape: [50, 46], step: [1.0; 2] }, [1.0, 0.0]);
        is_on_the_plane(Grid { shape: [50, 46], step: [1.0; 2] }, [0.6, 0.8]);
        is_on_the_plane(Grid { shape: [50, 46], step: [1.0; 2] }, [-0.28, 0.96]);
        is_on_the_plane(Grid { shape: [24, 25, 26], step: [1.0; 3] }, [0.36, 0.48, 0.8]);
    }

    #[test]
    fn crests_of_a_ball_are_on_its_surface() {
        let grid = Grid { shape: [41; 3], step: [1.0; 3] };
        let radius = |at: [f64; 3]| at.map(|x| (x - 20.0) * (x - 20.0)).iter().sum::<f64>().sqrt();
        let values: Vec<f32> = (0..grid.sample_count())
            .map(|i| step(radius(coordinates(i, grid.shape).map(|c| c as f64)) - 13.0))
            .collect();
        let crests = found(&values, &grid, CrestOptions { scale: Some(1.0), ..Default::default() });
        // smoothing by σ moves a curved edge inwards by σ²/R (Verbeek & van Vliet 1994), 0.08 here, and the image's own
        // blur as much again; both are taken back
        let radii: Vec<f64> = crests.iter().map(|c| radius(c.position)).collect();
        assert!(radii.iter().all(|r| (r - 13.0).abs() < 0.15), "{radii:?}");
        let mean = radii.iter().sum::<f64>() / radii.len() as f64;
        assert!((mean - 13.0).abs() < 0.06, "{mean}");
        // there is at least one crest per column from each side along the axis that is steepest
        assert!(crests.len() > 1500, "{}", crests.len());
    }

    #[test]
    fn noise_is_measured_where_it_hides_edges_and_where_not() {
        let (shape, count) = ([80, 70], 5600);
        for deviation in [0.02, 0.2] {
            let mut values = noise_of(count);
            values.iter_mut().enumerate().for_each(|(i, v)| {
                *v = *v * deviation + if i % 80 > 30 { 1.0 } else { 0.0 };
            });
            let unit = UnitValues::new(&values).unwrap();
            let range = values.iter().fold((f32::MAX, f32::MIN), |(a, b), &v| (a.min(v), b.max(v)));
            let found = noise(&unit, shape) * f64::from(range.1 - range.0);
            // 5000 samples, of which one column in 80 holds the edge
            assert!((found / f64::from(deviation) - 1.0).abs() < 0.06, "{found} {deviation}");
        }
        let constant_but_one: Vec<f32> =
            (0..count).map(|i| if i == 900 { 1.0 } else { 0.0 }).collect();
        let unit = UnitValues::new(&constant_but_one).unwrap();
        assert!(noise(&unit, shape).is_finite());
    }

    #[test]
    fn details_are_the_differences_of_neighbours() {
        let shape = [3, 2, 2];
        let values: Vec<f32> = (0..12).map(|i| ((i * i * 5) % 13) as f32).collect();
        let unit = UnitValues::new(&values).unwrap();
        let mut out = vec![0.0; 12];
        detail(&unit, shape, 0, &mut out);
        let range = values.iter().fold((f32::MAX, f32::MIN), |(a, b), &v| (a.min(v), b.max(v)));
        for (i, out) in out.iter().enumerate() {
            let [x, y, z] = coordinates(i, shape);
            let mut sum = 0.0;
            if x < 2 && y < 1 && z < 1 {
                for (dx, dy, dz) in (0..8).map(|c| (c & 1, c >> 1 & 1, c >> 2)) {
                    let sign = if (dx + dy + dz) % 2 == 0 { 1.0 } else { -1.0 };
                    sum += sign * values[x + dx + 3 * (y + dy + 2 * (z + dz))];
                }
            }
            let expected = sum.abs() / 8f32.sqrt() / (range.1 - range.0);
            assert!((out - expected).abs() < 1e-6, "{out} {expected} at {i}");
        }
        let mut part = vec![0.0; 5];
        detail(&unit, shape, 4, &mut part);
        assert_eq!(part, out[4..9]);
    }

    #[test]
    fn slopes_of_smoothed_noise_are_as_large_as_said() {
        let shape = [120, 110];
        let values = noise_of(13200);
        for sigma in [1.0, 2.0] {
            let slopes = crate::image::gaussian_derivative(&values, shape, [sigma; 2], [1, 0]);
            let mean = slopes.iter().map(|s| f64::from(s * s)).sum::<f64>() / 13200.0;
            // 13200 samples, of which 4πσ² are alike
            let expected = noise_slope::<2>(sigma);
            assert!((mean.sqrt() / expected - 1.0).abs() < 0.06, "{} {expected}", mean.sqrt());
        }
    }

    #[test]
    fn the_scale_grows_with_noise() {
        let mut before = 0.0;
        for noise in [0.0, 0.1, 0.2, 0.4, 10.0] {
            let scale = clear_scale::<2>(noise, 0.5);
            assert!(scale >= before && SCALES.contains(&scale), "{scale} {before}");
            before = scale;
        }
        assert_eq!((clear_scale::<2>(0.0, 0.5), before), (1.5, 4.0));
        // in the plane σ = CLEAR · noise/(2 · contrast), to the next eighth
        assert_eq!(clear_scale::<2>(0.2, 0.5), 2.0);
    }

    #[test]
    fn noise_beside_an_edge_is_no_edge() {
        let shape = [100, 90];
        let mut values = noise_of(9000);
        values.iter_mut().enumerate().for_each(|(i, v)| {
            *v = *v * 0.1 + if i % 100 >= 50 { 1.0 } else { 0.0 };
        });
        let grid = Grid { shape, step: [1.0; 2] };
        let crests = found(&values, &grid, CrestOptions::default());
        let far = crests.iter().filter(|c| (c.position[0] - 49.5).abs() > 2.0).count();
        assert!(crests.len() >= 90 && far * 20 < crests.len(), "{far} of {}", crests.len());
    }

    #[test]
    fn constant_and_thin_images_have_none_or_no_trouble() {
        for shape in [[7, 5, 1], [1, 1, 1], [1, 9, 4], [2, 2, 2]] {
            let grid = Grid { shape, step: [1.0; 3] };
            let count = grid.sample_count();
            assert!(found(&vec![3.0; count], &grid, CrestOptions::default()).is_empty());
            let values: Vec<f32> = (0..count).map(|i| (i * 7 % 5) as f32).collect();
            let options = CrestOptions { least_length: Some(0.0), ..Default::default() };
            for crest in found(&values, &grid, options) {
                assert!((0.0..=1.0).contains(&crest.strength));
            }
        }
    }
}
