//! Direct solution: sparse factors by faer, one thread, so that bits do not depend on how many there are.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::lu::supernodal as lu;
use faer::sparse::linalg::{LuError, qr};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::error::SolveError;
use super::order::Elimination;
use super::sparse::Sparse;

/// Bytes per value of a Cholesky factor, of Cholesky and of LU, measured on meshes: with row numbers and workspace, and
/// of LU with two factors and the fill of pivoting.
const BYTES: (f64, f64) = (10.0, 24.0);

/// A matrix as faer's arrays; read by columns, as faer does, it is the transpose.
struct Arrays<'a> {
    starts: Vec<u32>,
    matrix: &'a Sparse,
}

impl<'a> Arrays<'a> {
    fn new(matrix: &'a Sparse) -> Self {
        let starts = matrix.starts().iter().map(|&start| start as u32).collect();
        Self { starts, matrix }
    }

    fn view(&self) -> SparseColMatRef<'_, u32, f64> {
        let (rows, columns) = (self.matrix.column_count(), self.matrix.row_count());
        let columns_of = self.matrix.columns();
        let symbolic =
            SymbolicSparseColMatRef::new_checked(rows, columns, &self.starts, None, columns_of);
        SparseColMatRef::new(symbolic, self.matrix.values())
    }
}

/// Factors of a matrix.
pub enum Factors {
    /// `L Lᵀ`.
    Cholesky(Cholesky),
    /// `L U` with partial pivoting.
    Lu(Lu),
}

impl Factors {
    /// Factors a square matrix: Cholesky if it `is_symmetric`, else LU.
    ///
    /// # Errors
    /// [`SolveError::Singular`] and [`SolveError::Memory`], the latter before more than `memory` bytes are taken.
    pub fn new(
        matrix: &Sparse,
        elimination: &Elimination,
        is_symmetric: bool,
        memory: u64,
    ) -> Result<Self, SolveError> {
        let too_large = matrix.entry_count() >= i32::MAX as usize;
        if too_large || Self::bytes(elimination, is_symmetric) > memory as f64 {
            return Err(SolveError::Memory { unknowns: matrix.row_count() });
        }
        if is_symmetric {
            Cholesky::new(matrix, &elimination.order).map(Self::Cholesky)
        } else {
            Lu::new(matrix, &elimination.order).map(Self::Lu)
        }
    }

    /// The bytes that factors are expected to take.
    pub fn bytes(elimination: &Elimination, is_symmetric: bool) -> f64 {
        elimination.values * if is_symmetric { BYTES.0 } else { BYTES.1 }
    }

    /// `x ← A⁻¹ x`.
    pub fn solve(&mut self, x: &mut [f64]) {
        let x = MatMut::from_column_major_slice_mut(x, x.len(), 1);
        match self {
            Self::Cholesky(own) => own.solve(x),
            Self::Lu(own) => own.solve(x),
        }
    }

    /// The name of the factorization.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cholesky(_) => "Cholesky",
            Self::Lu(_) => "LU",
        }
    }
}

/// A Cholesky factor.
pub struct Cholesky {
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    space: MemBuffer,
}

impl Cholesky {
    fn new(matrix: &Sparse, order: &[u32]) -> Result<Self, SolveError> {
        let unknowns = matrix.row_count();
        let memory = || SolveError::Memory { unknowns };
        let arrays = Arrays::new(matrix);
        let inverse = inverse(order);
        let order = PermRef::new_checked(order, &inverse, unknowns);
        let ordering = SymmetricOrdering::Custom(order);
        let params = CholeskySymbolicParams::default();
        let view = arrays.view();
        let symbolic = factorize_symbolic_cholesky(view.symbolic(), Side::Upper, ordering, params)
            .map_err(|_| memory())?;
        let mut values = zeros(symbolic.len_val()).ok_or_else(memory)?;
        let request = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut space = MemBuffer::try_new(request).map_err(|_| memory())?;
        let (none, stack) = (Default::default(), MemStack::new(&mut space));
        let done = symbolic.factorize_numeric_llt(
            &mut values,
            view,
            Side::Upper,
            none,
            Par::Seq,
            stack,
            Default::default(),
        );
        if let Err(LltError::NonPositivePivot { index }) = done {
            let at = order.arrays().0.get(index).map_or(0, |&at| at as usize);
            return Err(SolveError::Singular { unknowns, at });
        }
        let request = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let space = MemBuffer::try_new(request).map_err(|_| memory())?;
        Ok(Self { symbolic, values, space })
    }

    fn solve(&mut self, x: MatMut<'_, f64>) {
        let stack = MemStack::new(&mut self.space);
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            x,
            Par::Seq,
            stack,
        );
    }
}

/// Factors L and U with their permutations.
pub struct Lu {
    factors: lu::SupernodalLu<u32, f64>,
    rows: [Vec<u32>; 2],
    columns: [Vec<u32>; 2],
    space: MemBuffer,
}

impl Lu {
    /// Columns are in the given order, made a postorder of the column elimination tree.
    fn new(matrix: &Sparse, order: &[u32]) -> Result<Self, SolveError> {
        let unknowns = matrix.row_count();
        let memory = || SolveError::Memory { unknowns };
        let across = matrix.transpose();
        let (by_rows, by_columns) = (Arrays::new(matrix), Arrays::new(&across));
        let (transposed, view) = (by_rows.view(), by_columns.view());
        let (columns, symbolic) =
            columns_of_lu(transposed.symbolic(), view.symbolic(), order).map_err(|_| memory())?;
        let permutation = PermRef::new_checked(&columns[0], &columns[1], unknowns);
        let mut rows = [vec![0; unknowns], vec![0; unknowns]];
        let mut factors = lu::SupernodalLu::new();
        let request =
            lu::factorize_supernodal_numeric_lu_scratch::<u32, f64>(&symbolic, Default::default());
        let mut space = MemBuffer::try_new(request).map_err(|_| memory())?;
        let [forward, inverse] = &mut rows;
        lu::factorize_supernodal_numeric_lu(
            forward,
            inverse,
            &mut factors,
            view,
            transposed,
            permutation,
            &symbolic,
            Par::Seq,
            MemStack::new(&mut space),
            Default::default(),
        )
        .map_err(|error| match error {
            LuError::SymbolicSingular { index } => {
                let at = columns[0].get(index).map_or(0, |&at| at as usize);
                SolveError::Singular { unknowns, at }
            }
            LuError::Generic(_) => memory(),
        })?;
        let request = lu::solve_in_place_scratch::<u32, f64>(unknowns, 1, Par::Seq);
        let space = MemBuffer::try_new(request).map_err(|_| memory())?;
        Ok(Self { factors, rows, columns, space })
    }

    fn solve(&mut self, x: MatMut<'_, f64>) {
        let count = x.nrows();
        let rows = PermRef::new_checked(&self.rows[0], &self.rows[1], count);
        let columns = PermRef::new_checked(&self.columns[0], &self.columns[1], count);
        let stack = MemStack::new(&mut self.space);
        self.factors.solve_in_place_with_conj(rows, columns, Conj::No, x, Par::Seq, stack);
    }
}

/// The order of the columns, forward and inverse, and the structure of the factors.
fn columns_of_lu(
    transposed: SymbolicSparseColMatRef<'_, u32>,
    view: SymbolicSparseColMatRef<'_, u32>,
    order: &[u32],
) -> Result<([Vec<u32>; 2], lu::SymbolicSupernodalLu<u32>), FaerError> {
    let count = order.len();
    let request = StackReq::any_of(&[
        qr::col_etree_scratch::<u32>(count, count),
        qr::postorder_scratch::<u32>(count),
        qr::column_counts_aat_scratch::<u32>(count, count),
        lu::factorize_supernodal_symbolic_lu_scratch::<u32>(count, count),
    ]);
    let mut space = MemBuffer::try_new(request).map_err(|_| FaerError::OutOfMemory)?;
    let stack = MemStack::new(&mut space);
    let (mut tree, mut post) = (vec![0; count], vec![0; count]);
    {
        let back = inverse(order);
        let given = PermRef::new_checked(order, &back, count);
        let tree = qr::col_etree(view, Some(given), &mut tree, stack);
        qr::postorder(&mut post, tree, stack);
    }
    let columns: Vec<u32> = post.iter().map(|&at| order[at as usize]).collect();
    let columns = [inverse(&columns), columns];
    let [back, columns] = columns;
    let permutation = PermRef::new_checked(&columns, &back, count);
    let tree = qr::col_etree(view, Some(permutation), &mut tree, stack);
    qr::postorder(&mut post, tree, stack);
    let (mut counts, mut first) = (vec![0; count], vec![0; count]);
    qr::column_counts_ata(
        &mut counts,
        &mut first,
        transposed,
        Some(permutation),
        tree,
        &post,
        stack,
    );
    let symbolic = lu::factorize_supernodal_symbolic_lu(
        view,
        Some(permutation),
        &first,
        tree,
        &counts,
        stack,
        Default::default(),
    )?;
    Ok(([columns, back], symbolic))
}

/// The inverse of an order: the rank of each unknown.
fn inverse(order: &[u32]) -> Vec<u32> {
    let mut inverse = vec![0; order.len()];
    for (at, &unknown) in order.iter().enumerate() {
        inverse[unknown as usize] = at as u32;
    }
    inverse
}

/// Zeros; `None` without memory for them.
fn zeros(count: usize) -> Option<Vec<f64>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).ok()?;
    values.resize(count, 0.0);
    Some(values)
}
