//! A matrix of small dense blocks, and Gauss–Seidel sweeps over them.

use rayon::prelude::*;

use super::error::SolveError;
use super::sparse::Sparse;

/// Rows of blocks per task.
const ROWS: usize = 512;

/// A square matrix by blocks of one size, row by row; the blocks' columns ascend.
pub struct Blocks {
    size: usize,
    starts: Vec<usize>,
    columns: Vec<u32>,
    /// Each block by its columns, so that products run along registers.
    values: Vec<f64>,
    /// The inverses of the blocks on the diagonal.
    inverses: Vec<f64>,
}

impl Blocks {
    /// # Errors
    /// [`SolveError::Singular`] if a block on the diagonal has no inverse.
    ///
    /// # Panics
    /// If the matrix is not square or not a whole number of blocks.
    pub fn new(matrix: &Sparse, size: usize) -> Result<Self, SolveError> {
        assert_eq!(matrix.row_count() % size, 0, "whole blocks");
        assert_eq!(matrix.row_count(), matrix.column_count(), "a square matrix");
        let count = matrix.row_count() / size;
        let mut own =
            Self { size, starts: vec![0], columns: vec![], values: vec![], inverses: vec![] };
        let mut row: Vec<u32> = Vec::new();
        for at in 0..count {
            row.clear();
            for inner in 0..size {
                let columns = matrix.row(at * size + inner).0;
                row.extend(columns.iter().map(|&column| column / size as u32));
                row.dedup();
            }
            row.push(at as u32);
            row.sort_unstable();
            row.dedup();
            let base = own.columns.len();
            own.columns.extend(&row);
            own.values.resize(own.columns.len() * size * size, 0.0);
            for inner in 0..size {
                let (columns, values) = matrix.row(at * size + inner);
                let mut block = 0;
                for (&column, &value) in columns.iter().zip(values) {
                    while row[block] < column / size as u32 {
                        block += 1;
                    }
                    let place =
                        (base + block) * size * size + column as usize % size * size + inner;
                    own.values[place] = value;
                }
            }
            own.starts.push(own.columns.len());
        }
        own.invert()?;
        Ok(own)
    }

    fn invert(&mut self) -> Result<(), SolveError> {
        let area = self.size * self.size;
        let count = self.starts.len() - 1;
        self.inverses = vec![0.0; count * area];
        for row in 0..count {
            let columns = &self.columns[self.starts[row]..self.starts[row + 1]];
            let at = columns.binary_search(&(row as u32)).expect("each row has its diagonal");
            let at = self.starts[row] + at;
            let block = &self.values[at * area..(at + 1) * area];
            let unknowns = count * self.size;
            inverse(block, self.size, &mut self.inverses[row * area..(row + 1) * area])
                .ok_or(SolveError::Singular { unknowns, at: row * self.size })?;
        }
        Ok(())
    }

    /// `r = b − A x`.
    pub fn residual(&self, b: &[f64], x: &[f64], r: &mut [f64]) {
        let size = self.size;
        r.par_chunks_mut(ROWS * size).enumerate().for_each(|(chunk, r)| {
            for (inner, rest) in r.chunks_exact_mut(size).enumerate() {
                let row = chunk * ROWS + inner;
                rest.copy_from_slice(&b[row * size..(row + 1) * size]);
                self.subtract(self.starts[row]..self.starts[row + 1], x, rest);
            }
        });
    }

    /// From x = 0, in ascending order.
    pub fn forward(&self, b: &[f64], x: &mut [f64], rest: &mut [f64]) {
        let size = self.size;
        for row in 0..self.starts.len() - 1 {
            let range = self.starts[row]..self.starts[row + 1];
            let below = self.columns[range.clone()].partition_point(|&c| (c as usize) < row);
            rest.copy_from_slice(&b[row * size..(row + 1) * size]);
            self.subtract(range.start..range.start + below, x, rest);
            let own = &mut x[row * size..(row + 1) * size];
            own.fill(0.0);
            self.add_inverse(row, rest, own);
        }
    }

    /// In descending order.
    pub fn backward(&self, b: &[f64], x: &mut [f64], rest: &mut [f64]) {
        let size = self.size;
        for row in (0..self.starts.len() - 1).rev() {
            rest.copy_from_slice(&b[row * size..(row + 1) * size]);
            self.subtract(self.starts[row]..self.starts[row + 1], x, rest);
            // `rest` includes the diagonal block's term, so x is corrected
            self.add_inverse(row, rest, &mut x[row * size..(row + 1) * size]);
        }
    }

    fn subtract(&self, blocks: std::ops::Range<usize>, x: &[f64], rest: &mut [f64]) {
        let size = self.size;
        let columns = &self.columns[blocks.clone()];
        let values = &self.values[blocks.start * size * size..blocks.end * size * size];
        for (&column, block) in columns.iter().zip(values.chunks_exact(size * size)) {
            let x = &x[column as usize * size..(column as usize + 1) * size];
            for (&x, column) in x.iter().zip(block.chunks_exact(size)) {
                for (rest, value) in rest.iter_mut().zip(column) {
                    *rest -= value * x;
                }
            }
        }
    }

    fn add_inverse(&self, row: usize, rest: &[f64], x: &mut [f64]) {
        let area = self.size * self.size;
        let block = &self.inverses[row * area..(row + 1) * area];
        for (&rest, column) in rest.iter().zip(block.chunks_exact(self.size)) {
            for (x, value) in x.iter_mut().zip(column) {
                *x += value * rest;
            }
        }
    }
}

/// The inverse of a small matrix by columns, by Gauss–Jordan elimination with row pivots; `None` if it is singular.
fn inverse(block: &[f64], size: usize, inverse: &mut [f64]) -> Option<()> {
    let mut left = block.to_vec();
    inverse.fill(0.0);
    for at in 0..size {
        inverse[at * size + at] = 1.0;
    }
    for pivot in 0..size {
        let entry = |row: usize| left[pivot * size + row].abs();
        let best = (pivot..size).max_by(|&a, &b| entry(a).total_cmp(&entry(b)))?;
        let scale = 1.0 / left[pivot * size + best];
        if !scale.is_finite() {
            return None;
        }
        for matrix in [left.as_mut_slice(), &mut *inverse] {
            for column in matrix.chunks_exact_mut(size) {
                column.swap(pivot, best);
                column[pivot] *= scale;
            }
        }
        for row in (0..size).filter(|&row| row != pivot) {
            let factor = left[pivot * size + row];
            for matrix in [left.as_mut_slice(), &mut *inverse] {
                for column in matrix.chunks_exact_mut(size) {
                    column[row] -= factor * column[pivot];
                }
            }
        }
    }
    Some(())
}
