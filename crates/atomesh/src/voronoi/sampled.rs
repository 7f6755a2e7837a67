//! Voronoi cells sampled like any others: their faces as closed surfaces.

use super::poly_mesh::PolyMesh;
use crate::geometry::Point;
use crate::sample::Cells;

impl<const D: usize> Cells<D> for PolyMesh<D> {
    fn cell_count(&self) -> usize {
        Self::cell_count(self)
    }

    fn visit_facets(&self, cell: usize, visit: &mut dyn FnMut(&[Point<D>])) {
        let mut corners: Vec<Point<D>> = Vec::new();
        for (face, out) in self.faces_of(cell) {
            corners.clear();
            corners.extend(self.face(face).iter().map(|&at| self.points()[at as usize]));
            if out < 0.0 {
                corners.reverse();
            }
            visit(&corners);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::geometry::Bounds;
    use crate::image::{Frame, Image, Samples};
    use crate::mesh::Delaunay;
    use crate::sample::{SampleOptions, Statistic, sample};
    use crate::voronoi::voronoi;
    use crate::watch::Silent;

    #[test]
    fn cells_have_all_of_an_image_between_them() {
        let frame = Frame::new([7, 6, 5]).unwrap();
        let samples: Vec<f32> = (0..210).map(|i| (i % 11) as f32).collect();
        let image = Image::new(frame, Samples::F32(samples)).unwrap();
        let bounds = Bounds { min: [0.0; 3], max: [6.0, 5.0, 4.0] };
        let sites = [[1.0, 1.0, 1.0], [5.0, 1.5, 2.0], [3.0, 4.5, 3.0], [2.0, 3.0, 0.5]];
        let cells = voronoi(&Delaunay::<3>::new(), &sites, bounds, &mut Silent).unwrap();
        let options = SampleOptions::new(&[Statistic::Total, Statistic::Mean]);
        let found = sample(&cells, &image, options, &mut Silent).unwrap();
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        // roundings of some hundred sums
        assert!((sum(&found.measures) - 120.0).abs() < 1e-10);
        for (own, measure) in found.measures.iter().zip(cells.measures()) {
            assert!((own - measure).abs() < 1e-10);
        }
        let by_means: f64 = found.values[1].iter().zip(&found.measures).map(|(m, v)| m * v).sum();
        assert!((by_means - sum(&found.values[0])).abs() < 1e-9, "means weigh by volume");
    }
}
