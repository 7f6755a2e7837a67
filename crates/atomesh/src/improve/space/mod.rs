//! Improving tetrahedra.

mod align;
mod heal;
mod parts;
mod patch;
mod ring;
mod shape;
mod smooth;
mod valley;

use super::{ImproveError, ImproveOptions, ImproveReport, Improver};
use crate::geometry::Bounds;
use crate::mesh::Mesh;
use crate::optimize::Fields;
use crate::watch::{Phase, Watch, check};
use heal::{Effort, heal};
use parts::{CUTS, Part, Whole};
use rayon::prelude::*;

/// Improves tetrahedral meshes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Space;

/// The greatest floor: 70.53° is that of the equilateral tetrahedron.
const MOST_ANGLE: f64 = 70.0;

/// Cells are raised somewhat above the floor, since moves after it may cost a little.
const MARGIN: f64 = 1.0;

impl Improver<3> for Space {
    fn improve(
        &self,
        mesh: Mesh<3>,
        freedom: &[u8],
        fields: Fields<'_, 3>,
        options: &ImproveOptions,
        watch: &mut dyn Watch,
    ) -> Result<(Mesh<3>, ImproveReport), ImproveError> {
        if !(0.0..=MOST_ANGLE).contains(&options.min_angle) {
            let expected = "an angle from 0 to 70 degrees";
            return Err(ImproveError::MinAngle { value: options.min_angle, expected });
        }
        let valley = valley::Valley::new(fields.potential);
        let floor = (options.min_angle + MARGIN).to_radians().cos();
        let (points, corners) = mesh.into_parts();
        let Some(bounds) = Bounds::of(&points) else {
            return Ok((Mesh::new(points, corners)?, ImproveReport::default()));
        };
        let sides: Vec<u8> = points.iter().map(|p| patch::sides_of(p, &bounds)).collect();
        // whatever the lattice says, a point on a side stays on it
        let freedom = freedom.iter().zip(&sides).map(|(f, s)| f & !(s | s >> 3)).collect();
        let corners = corners.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
        let mut whole = Whole { points, freedom, sides, corners };
        let mut report = ImproveReport::default();
        let mut pending: Option<Vec<bool>> = None;
        for (pass, &cut) in CUTS.iter().enumerate() {
            check(watch, Phase::Improve, pass as f64 / CUTS.len() as f64, None)?;
            let t = std::time::Instant::now();
            let divided = whole.divide(cut, pending.as_deref());
            let valences = whole.valences();
            eprintln!(
                "divide {:?} {} parts {} cells",
                t.elapsed(),
                divided.len(),
                divided.iter().map(|d| d.len()).sum::<usize>()
            );
            let work = |cells: &Vec<u32>| {
                let mut part = whole.part(cells, &valences, pending.as_deref());
                let mut effort = Effort::default();
                let t = std::time::Instant::now();
                heal(&mut part.patch, floor, 6, &mut effort);
                let t1 = t.elapsed();
                let depths = part.patch.points.iter().map(|p| valley.depth(p)).collect();
                let mut aligner = align::Aligner {
                    valley: &valley,
                    floor,
                    stiffness: align::stiffness(),
                    depths,
                };
                let t = std::time::Instant::now();
                let sweeps = std::env::var("SWEEPS").ok().and_then(|s| s.parse().ok()).unwrap_or(2);
                for _ in 0..sweeps {
                    if std::env::var("NOSWAP").is_err() {
                        aligner.swap(&mut part.patch, &part.open, &mut effort);
                    }
                    if options.align == super::Align::Full {
                        aligner.moves(&mut part.patch, &part.open, &mut effort);
                    }
                }
                let t2 = t.elapsed();
                heal(&mut part.patch, floor, 6, &mut effort);
                if std::env::var("TIME").is_ok() {
                    eprintln!("heal {t1:?} align {:?} heal {:?}", t2 - t1, t.elapsed() - t2);
                }
                (part, effort)
            };
            let done: Vec<(Part, Effort)> = divided.par_iter().map(work).collect();
            eprintln!(
                "done {:?} {:?}",
                t.elapsed(),
                done.iter().map(|d| (d.1.swaps, d.1.moves, d.1.rounds)).collect::<Vec<_>>()
            );
            let mut held = vec![false; whole.points.len()];
            for (part, effort) in &done {
                report.swaps += effort.swaps;
                report.moves += effort.moves;
                report.rounds = report.rounds.max(effort.rounds);
                for &point in &part.held {
                    let point = part.points[point as usize] as usize;
                    held[point] = pending.as_ref().is_none_or(|p| p[point]);
                }
            }
            let parts: Vec<Part> = done.into_iter().map(|d| d.0).collect();
            whole.take_back(&parts, &divided);
            eprintln!("back {:?}", t.elapsed());
            if held.iter().all(|held| !held) {
                break;
            }
            pending = Some(held);
        }
        let corners = whole.corners.into_flattened();
        Ok((Mesh::new(whole.points, corners)?, report))
    }
}
