//! From the best planes of nodes to those of all samples.
//!
//! The mean along a plane is smooth along that plane, and may be sharp across it. So what is between nodes is
//! interpolated along the best plane of the nearest node, as it is where that plane meets the node.

use super::facing::volume;
use super::nodes::Coarse;
use super::scan::{Best, Orientation};
use crate::parallel::prelude::*;

/// The best plane of every sample, in the image's order.
pub(super) struct Found {
    /// The greatest missing semblance, ⟨(L − R)²⟩ / 2⟨L² + R²⟩.
    pub missing: Vec<f32>,
    /// The number of its orientation.
    pub best: Vec<u16>,
    /// All orientations.
    pub orientations: Vec<Orientation>,
}

impl Found {
    /// The better of what was found for each facing, at every sample.
    pub fn new<const D: usize>(all: &[Best], shape: [usize; D]) -> Self {
        let [nx, ny, nz] = volume(shape);
        let (mut missing, mut best) = (vec![0.0; nx * ny * nz], vec![0; nx * ny * nz]);
        let levels = missing.par_chunks_mut(nx * ny).zip(best.par_chunks_mut(nx * ny));
        levels.enumerate().for_each(|(z, (missing, best))| {
            let mut first = 0;
            for of in all {
                let facing = &of.coarse.facing;
                for v in 0..facing.along {
                    let row = Between::new(of, v, z);
                    let start = facing.index(0, 0, v);
                    for u in 0..facing.across {
                        let (value, number) = row.at(u);
                        let i = start + u * facing.stride();
                        if value > missing[i] {
                            (missing[i], best[i]) = (value, first + number as u16);
                        }
                    }
                }
                first += of.orientations.len() as u16;
            }
        });
        let orientations = all.iter().flat_map(|of| of.orientations.iter().copied()).collect();
        Self { missing, best, orientations }
    }
}

/// A row of nodes beside a row of samples.
#[derive(Clone, Copy)]
struct Beside<'a> {
    missing: &'a [f32],
    number: &'a [u32],
    /// From the row of samples to that of nodes, in samples along v and z.
    away: [f32; 2],
    share: f32,
}

/// What is between rows of nodes.
struct Between<'a> {
    orientations: &'a [Orientation],
    /// The nearest first; those without a share are left out.
    rows: [Beside<'a>; 4],
    count: usize,
}

impl<'a> Between<'a> {
    /// The row of samples at `v` and `z`.
    fn new(best: &'a Best, v: usize, z: usize) -> Self {
        let Coarse { along, down, .. } = &best.coarse;
        let ((vs, v_share), (zs, z_share)) = (along.around(v), down.around(z));
        let mut rows = [0, 1, 2, 3].map(|corner: usize| {
            let (i, j) = (corner & 1, corner >> 1);
            let share = |second: usize, share: f32| if second == 1 { share } else { 1.0 - share };
            Beside {
                missing: best.coarse.row(&best.missing, vs[i], zs[j]),
                number: best.coarse.row(&best.number, vs[i], zs[j]),
                away: [along.place(vs[i]) - v as f64, down.place(zs[j]) - z as f64]
                    .map(|away| away as f32),
                share: share(i, v_share) * share(j, z_share),
            }
        });
        rows.sort_by(|a, b| b.share.total_cmp(&a.share));
        let count = rows.iter().filter(|row| row.share > 0.0).count();
        Self { orientations: &best.orientations, rows, count }
    }

    /// The missing semblance at sample `u` of the row, and the number of its orientation.
    fn at(&self, u: usize) -> (f32, u32) {
        let nearest = &self.rows[0];
        let last = nearest.number.len() as f32 - 1.0;
        let mut number = nearest.number[u];
        if nearest.away != [0.0; 2] {
            // where the plane meets the node, its own plane is better known
            let at = u as f32 + self.shift(number, nearest);
            number = nearest.number[(at.clamp(0.0, last) + 0.5) as usize];
        }
        let value = |row: &Beside<'_>| {
            let at = (u as f32 + self.shift(number, row)).clamp(0.0, last);
            let (i, share) = (at as usize, at.fract());
            let (a, b) = (row.missing[i], row.missing[(i + 1).min(row.missing.len() - 1)]);
            row.share * (a + share * (b - a))
        };
        (self.rows[..self.count].iter().map(value).sum(), number)
    }

    /// How far a plane moves along u to a row of nodes.
    fn shift(&self, number: u32, row: &Beside<'_>) -> f32 {
        let plane = &self.orientations[number as usize];
        plane.strike * row.away[0] + plane.dip * row.away[1]
    }
}

#[cfg(test)]
mod tests {
    use super::super::FaultOptions;
    use super::super::facing::Facing;
    use super::*;

    #[test]
    fn samples_between_nodes_lie_on_the_plane_of_the_nearest() {
        let shape = [60, 20, 21];
        for facing in Facing::all(shape) {
            let coarse = Coarse::new(&facing, &FaultOptions::default());
            assert_eq!((coarse.along.step, coarse.down.step), (3, 2));
            let plane = |strike, dip| Orientation { facing, strike, dip };
            let orientations = vec![plane(0.0, 0.0), plane(0.25, -0.5)];
            // a ramp across the plane: linear between samples, and constant along the plane
            let ramp = |u: f64, v: f64, z: f64| 50.0 + u - 0.25 * v + 0.5 * z;
            let row = |k: usize| (k / coarse.down.count, k % coarse.down.count);
            let missing = (0..coarse.count()).map(|i| {
                let (v, z) = row(i / facing.across);
                let u = (i % facing.across) as f64;
                ramp(u, coarse.along.place(v), coarse.down.place(z)) as f32
            });
            let missing = missing.collect();
            let best = Best { coarse, missing, number: vec![1; coarse.count()], orientations };
            let found = Found::new(&[best], shape);
            for v in 0..facing.along {
                for z in 0..facing.depth {
                    for u in 3..facing.across - 3 {
                        let i = facing.index(u, z, v);
                        let error =
                            f64::from(found.missing[i]) - ramp(u as f64, v as f64, z as f64);
                        assert!(error.abs() < 1e-4, "{error} at {u}, {v}, {z}"); // of some 100
                        assert_eq!(found.best[i], 1);
                    }
                }
            }
        }
    }
}
