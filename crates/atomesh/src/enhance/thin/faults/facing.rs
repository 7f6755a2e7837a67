//! Planes of an image that are scanned for faults which face x, or y.

use crate::parallel::prelude::*;
use crate::watch::{Cancelled, Phase, Watch, check};

/// Which horizontal axis the faults face, within 45°, and how the samples are ordered for their scan.
///
/// u is the place along that axis, `depth` along the last, and v along the other horizontal axis, along which a section
/// has one sample. Upright planes, of constant v, lie one after another, each in rows along u.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facing {
    /// The axis faced: 0 or 1.
    pub axis: usize,
    /// Samples along u.
    pub across: usize,
    /// Samples down.
    pub depth: usize,
    /// Samples along v.
    pub along: usize,
    /// Samples between neighbours along u, depth and v in the image.
    strides: [usize; 3],
}

impl Facing {
    /// All axes that faults may face: x, and in a volume y.
    pub fn all<const D: usize>(shape: [usize; D]) -> Vec<Self> {
        let [nx, ny, nz] = volume(shape);
        let x = Self { axis: 0, across: nx, depth: nz, along: ny, strides: [1, nx * ny, nx] };
        let y = Self { axis: 1, across: ny, depth: nz, along: nx, strides: [nx, nx * ny, 1] };
        if D > 2 { vec![x, y] } else { vec![x] }
    }

    /// The samples of an upright plane.
    pub fn plane(&self) -> usize {
        self.across * self.depth
    }

    /// The index in the image of a sample.
    pub fn index(&self, u: usize, depth: usize, v: usize) -> usize {
        u * self.strides[0] + depth * self.strides[1] + v * self.strides[2]
    }

    /// The samples, in the image's order, between neighbours along u.
    pub fn stride(&self) -> usize {
        self.strides[0]
    }
}

/// Does `work` with every task, a batch at a time; each thread has a scratch of its own.
///
/// # Errors
/// [`Cancelled`] if the watch ends the work.
pub(super) fn in_batches<T: Send, S: Default + Send>(
    mut tasks: Vec<T>,
    watch: &mut dyn Watch,
    work: impl Fn(&mut S, &mut T) + Sync + Send,
) -> Result<(), Cancelled> {
    let batch = 4 * rayon::current_num_threads();
    let count = tasks.len();
    for (number, tasks) in tasks.chunks_mut(batch).enumerate() {
        check(watch, Phase::Potential, (number * batch) as f64 / count as f64, None)?;
        tasks.par_iter_mut().for_each_init(S::default, &work);
    }
    Ok(())
}

/// The shape as a volume's: a section is one sample wide along y.
pub(super) fn volume<const D: usize>(shape: [usize; D]) -> [usize; 3] {
    [shape[0], if D > 2 { shape[1] } else { 1 }, shape[D - 1]]
}
