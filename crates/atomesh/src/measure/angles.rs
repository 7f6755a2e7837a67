//! The spread of all angles and edges of a mesh, not of the least angle of each cell alone.

use super::MeasureError;
use super::cell_shape::angle_between;
use super::faces::faces;
use super::features::check_size;
use super::statistics::{Histogram, sum};
use crate::geometry::linear::invert;
use crate::geometry::{Point, difference, distance_squared, dot};
use crate::mesh::Mesh;
use crate::parallel::prelude::*;
use crate::watch::{Phase, Watch, check};

/// The width of the bins of angles, in degrees, and of edges, in d.
const ANGLE_WIDTH: f64 = 5.0;
const EDGE_WIDTH: f64 = 0.1;

/// The number of bins: up to 180°, and up to 3 d and beyond.
const ANGLE_BINS: usize = 36;
const EDGE_BINS: usize = 30;

/// The edge length that a mesh should have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WantedSize<'a> {
    /// Its mean over the mesh, in lattice units.
    pub mean: f64,
    /// Its value at each point, where it varies.
    pub at_points: Option<&'a [f32]>,
}

impl From<f64> for WantedSize<'_> {
    fn from(mean: f64) -> Self {
        Self { mean, at_points: None }
    }
}

/// How angles and edges are spread.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct SpreadReport {
    /// All interior angles (2-D) or dihedral angles (3-D) of all cells, in 36 bins of 5°; cells without measure
    /// have none.
    pub angles_histogram: Histogram,
    /// The greatest of them, in degrees.
    pub angle_max: f64,
    /// The lengths of the distinct edges over the distance wanted at their ends, in 30 bins of 0.1.
    pub edge_histogram: Histogram,
    /// The mean of these ratios: 1 if edges are as long as wanted.
    pub edge_ratio_mean: f64,
    /// Their standard deviation.
    pub edge_ratio_std: f64,
}

/// Counts the angles of all cells, and the edges by their length over the wanted one: the mean of d at both
/// ends. The same at any thread count.
///
/// # Errors
/// [`MeasureError`] if the mesh has no cells, a wanted distance is not a finite number above 0, or the watch ends the work.
pub fn spread<const D: usize>(
    mesh: &Mesh<D>,
    size: WantedSize<'_>,
    watch: &mut dyn Watch,
) -> Result<SpreadReport, MeasureError> {
    if mesh.cell_count() == 0 {
        return Err(MeasureError::NoCells { points: mesh.points().len() });
    }
    check_size(size.mean)?;
    check(watch, Phase::Measure, 0.0, None)?;
    let angles: Vec<f64> = (mesh.corners().par_chunks_exact(D + 1))
        .flat_map_iter(|cell| {
            let first = mesh.points()[cell[0] as usize];
            let edges =
                std::array::from_fn(|k| difference(&mesh.points()[cell[k + 1] as usize], &first));
            angles(&edges)
        })
        .collect();
    check(watch, Phase::Measure, 0.5, None)?;
    let wanted = |point: u32| match size.at_points {
        Some(values) => values.get(point as usize).map_or(size.mean, |&d| f64::from(d)),
        None => size.mean,
    };
    let ratios: Vec<f64> = faces::<D, 2>(mesh)
        .into_par_iter()
        .map(|[a, b]| {
            let [p, q] = [a, b].map(|i| &mesh.points()[i as usize]);
            distance_squared(p, q).sqrt() / (0.5 * (wanted(a) + wanted(b)))
        })
        .collect();
    let count = ratios.len() as f64;
    let mean = sum(0..ratios.len(), &|i| ratios[i]) / count;
    let squares = sum(0..ratios.len(), &|i| (ratios[i] - mean).powi(2));
    Ok(SpreadReport {
        angles_histogram: Histogram::of(&angles, ANGLE_WIDTH, ANGLE_BINS),
        angle_max: angles.par_iter().copied().reduce(|| 0.0, f64::max),
        edge_histogram: Histogram::of(&ratios, EDGE_WIDTH, EDGE_BINS),
        edge_ratio_mean: mean,
        edge_ratio_std: (squares / count).sqrt(),
    })
}

/// The angles between the facets of the simplex with these edges from its first corner, in degrees.
fn angles<const D: usize>(edges: &[Point<D>; D]) -> Vec<f64> {
    let Some((inverse, _)) = invert(edges) else { return Vec::new() };
    // gradients of the barycentric coordinates, which are normal to the facets
    let mut gradients: Vec<Point<D>> =
        (0..D).map(|k| std::array::from_fn(|r| inverse[r][k])).collect();
    let first = std::array::from_fn(|r| -gradients.iter().map(|g| g[r]).sum::<f64>());
    gradients.push(first);
    let units: Vec<Point<D>> = gradients
        .iter()
        .map(|g| {
            let length = dot(g, g).sqrt();
            g.map(|x| x / length)
        })
        .collect();
    let mut angles = Vec::with_capacity(D * (D + 1) / 2);
    for (i, a) in units.iter().enumerate() {
        for b in &units[..i] {
            angles.push(angle_between(a, b));
        }
    }
    angles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::watch::Silent;

    #[test]
    fn angles_of_a_triangle_sum_to_180_and_the_least_is_the_shapes() {
        let edges = [[3.0, 0.5], [0.4, 1.1]];
        let found = angles(&edges);
        assert!((found.iter().sum::<f64>() - 180.0).abs() < 1e-12, "{found:?}");
        let least = found.iter().copied().fold(180.0, f64::min);
        assert!((least - super::super::cell_shape(&edges).least_angle).abs() < 1e-12);
    }

    #[test]
    fn a_right_corner_has_three_right_angles() {
        let mut found = angles(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        found.sort_by(f64::total_cmp);
        let slant = (1.0 / 3f64.sqrt()).acos().to_degrees();
        for (angle, expected) in found.iter().zip([slant, slant, slant, 90.0, 90.0, 90.0]) {
            assert!((angle - expected).abs() < 1e-12, "{found:?}");
        }
        assert_eq!(angles(&[[1.0, 0.0], [2.0, 0.0]]), Vec::<f64>::new());
    }

    #[test]
    fn edges_are_measured_by_the_distance_wanted_at_their_ends() {
        let points = vec![[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]];
        let mesh = Mesh::new(points, vec![0, 1, 2]).unwrap();
        let constant = spread(&mesh, 2.0.into(), &mut Silent).unwrap();
        assert_eq!(constant.edge_ratio_mean, 2.0);
        assert_eq!(constant.edge_histogram.counts.iter().sum::<u64>(), 3);
        assert!((constant.edge_ratio_std - (0.5f64 / 3.0).sqrt()).abs() < 1e-15);
        // d is 4 and 4 along x, 4 and 2 along y, 4 and 2 between: ratios 1, 1 and 5/3
        let size = WantedSize { mean: 3.0, at_points: Some(&[4.0, 4.0, 2.0]) };
        let graded = spread(&mesh, size, &mut Silent).unwrap();
        assert!((graded.edge_ratio_mean - 11.0 / 9.0).abs() < 1e-15);
        assert!((graded.angle_max - 90.0).abs() < 1e-12);
        assert_eq!(graded.angles_histogram.counts.iter().sum::<u64>(), 3);
        let none = spread(&mesh, 0.0.into(), &mut Silent);
        assert_eq!(none, Err(MeasureError::Size { value: 0.0 }));
    }
}
