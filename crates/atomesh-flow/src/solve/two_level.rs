//! A preconditioner for blocks of unknowns: Gauss–Seidel sweeps over the blocks, and a correction in a coarse space if
//! there is one.
//!
//! Forward sweep, correction by `P (PᵀAP)⁻¹ Pᵀ`, backward sweep: symmetric if A is. The sweeps reduce the rough error,
//! such as jumps between cells, the coarse space the smooth one (Dobrev et al. 2006). The coarse equations are solved
//! by factors if they are few, else by a cycle of multigrid.

use std::borrow::Cow;

use atomesh::geometry::Point;

use super::blocks::Blocks;
use super::error::SolveError;
use super::krylov::Preconditioner;
use super::multigrid::{Multigrid, means};
use super::sparse::Sparse;
use super::system::System;

/// Sweeps and coarse correction.
pub struct TwoLevel<'a> {
    blocks: Blocks,
    coarse: Option<Coarse<'a>>,
    residual: Vec<f64>,
    rest: Vec<f64>,
}

struct Coarse<'a> {
    prolong: &'a Sparse,
    restrict: Sparse,
    solver: Multigrid<'static>,
    below: (Vec<f64>, Vec<f64>),
}

impl<'a> TwoLevel<'a> {
    /// # Errors
    /// [`SolveError::Singular`] if a block on the diagonal has no inverse.
    pub fn new<const D: usize>(system: &System<'a, D>) -> Result<Self, SolveError> {
        let coarse = system.coarse.map(|prolong| {
            let restrict = prolong.transpose();
            let matrix = restrict.product(&system.matrix.product(prolong));
            let place = |unknown: usize| system.places[unknown / system.block];
            let places: Vec<Point<D>> = (0..prolong.row_count()).map(place).collect();
            let places = means(&restrict, &places);
            let below = (vec![0.0; matrix.row_count()], vec![0.0; matrix.row_count()]);
            let solver = Multigrid::new(Cow::Owned(matrix), &places, system.is_symmetric);
            Coarse { prolong, restrict, solver, below }
        });
        let blocks = Blocks::new(system.matrix, system.block)?;
        let residual = vec![0.0; system.rhs.len()];
        Ok(Self { blocks, coarse, residual, rest: vec![0.0; system.block] })
    }
}

impl Preconditioner for TwoLevel<'_> {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        self.blocks.forward(r, z, &mut self.rest);
        if let Some(coarse) = &mut self.coarse {
            self.blocks.residual(r, z, &mut self.residual);
            coarse.restrict.multiply(&self.residual, &mut coarse.below.0);
            coarse.solver.apply(&coarse.below.0, &mut coarse.below.1);
            coarse.prolong.multiply(&coarse.below.1, &mut self.residual);
            for (z, correction) in z.iter_mut().zip(&self.residual) {
                *z += correction;
            }
        }
        self.blocks.backward(r, z, &mut self.rest);
    }
}
