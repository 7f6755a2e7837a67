//! A sparse matrix, row by row.

use std::ops::Range;

use rayon::prelude::*;

/// Rows per task; fixed, though each row's bits depend on nothing else.
const ROWS: usize = 4096;

/// A sparse matrix by its rows (CSR): columns ascending in each row, none twice.
#[derive(Clone, Debug, PartialEq)]
pub struct Sparse {
    column_count: usize,
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Default for Sparse {
    /// No rows and no columns.
    fn default() -> Self {
        Self { column_count: 0, starts: vec![0], columns: Vec::new(), values: Vec::new() }
    }
}

/// Consecutive rows of a matrix under construction.
#[derive(Default)]
struct Part {
    /// The number of entries of each row.
    counts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Sparse {
    /// A matrix from its rows' starts, columns and values.
    ///
    /// # Panics
    /// If the parts do not fit together, a column is out of range, or a row's columns do not ascend.
    pub fn new(
        column_count: usize,
        starts: Vec<usize>,
        columns: Vec<u32>,
        values: Vec<f64>,
    ) -> Self {
        assert_eq!(starts.first(), Some(&0), "rows start at 0");
        assert_eq!(starts.last(), Some(&columns.len()), "the last row ends with the columns");
        assert_eq!(columns.len(), values.len(), "an entry has a column and a value");
        for row in starts.windows(2) {
            let columns = &columns[row[0]..row[1]];
            assert!(columns.windows(2).all(|pair| pair[0] < pair[1]), "columns ascend");
            assert!(columns.last().is_none_or(|&c| (c as usize) < column_count), "columns exist");
        }
        Self { column_count, starts, columns, values }
    }

    /// A matrix from entries in any order; those of one row and column are added in the order given. Cost: O(entries), and
    /// a sort of each row.
    ///
    /// # Panics
    /// If an entry lies outside of the matrix.
    pub fn from_entries(
        row_count: usize,
        column_count: usize,
        entries: &[(u32, u32, f64)],
    ) -> Self {
        let mut starts = vec![0_usize; row_count + 1];
        for &(row, column, _) in entries {
            assert!((column as usize) < column_count, "columns exist");
            starts[row as usize + 1] += 1;
        }
        for row in 0..row_count {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut by_rows = vec![(0_u32, 0.0_f64); entries.len()];
        for &(row, column, value) in entries {
            let place = &mut next[row as usize];
            by_rows[*place] = (column, value);
            *place += 1;
        }
        let mut parts = Vec::new();
        let mut rest = by_rows.as_mut_slice();
        for rows in row_blocks(row_count) {
            let (own, others) = rest.split_at_mut(starts[rows.end] - starts[rows.start]);
            parts.push((&starts[rows.start..=rows.end], own));
            rest = others;
        }
        let parts: Vec<Part> =
            parts.into_par_iter().map(|(starts, own)| merge_rows(starts, own)).collect();
        Self::from_parts(row_count, column_count, parts)
    }

    fn from_parts(row_count: usize, column_count: usize, parts: Vec<Part>) -> Self {
        let count = parts.iter().map(|part| part.columns.len()).sum();
        let mut starts = Vec::with_capacity(row_count + 1);
        let mut columns = Vec::with_capacity(count);
        let mut values = Vec::with_capacity(count);
        starts.push(0);
        let mut end = 0;
        for part in parts {
            starts.extend(part.counts.iter().map(|count| {
                end += count;
                end
            }));
            columns.extend(part.columns);
            values.extend(part.values);
        }
        Self { column_count, starts, columns, values }
    }

    /// The number of rows.
    pub fn row_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The number of columns.
    pub fn column_count(&self) -> usize {
        self.column_count
    }

    /// The number of entries.
    pub fn entry_count(&self) -> usize {
        self.columns.len()
    }

    /// A row's columns and values.
    #[inline]
    pub fn row(&self, row: usize) -> (&[u32], &[f64]) {
        let range = self.starts[row]..self.starts[row + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// Where each row's entries start, and the last one's end.
    pub fn starts(&self) -> &[usize] {
        &self.starts
    }

    /// The columns of all entries, row by row.
    pub fn columns(&self) -> &[u32] {
        &self.columns
    }

    /// The values of all entries, row by row.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// All entries, row by row.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.row_count()).flat_map(|row| {
            let (columns, values) = self.row(row);
            columns.iter().zip(values).map(move |(&column, &value)| (row, column as usize, value))
        })
    }

    /// The entries on the diagonal, 0 where there is none.
    pub fn diagonal(&self) -> Vec<f64> {
        let entry = |row: usize| {
            let (columns, values) = self.row(row);
            columns.binary_search(&(row as u32)).map_or(0.0, |at| values[at])
        };
        (0..self.row_count()).map(entry).collect()
    }

    /// `y = A x`.
    ///
    /// # Panics
    /// If the lengths do not fit.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        self.rows_times(x, y, |_, product| product);
    }

    /// `r = b − A x`.
    ///
    /// # Panics
    /// If the lengths do not fit.
    pub fn residual(&self, b: &[f64], x: &[f64], r: &mut [f64]) {
        assert_eq!(b.len(), self.row_count(), "a right-hand side for each row");
        self.rows_times(x, r, |row, product| b[row] - product);
    }

    fn rows_times(&self, x: &[f64], y: &mut [f64], make: impl Fn(usize, f64) -> f64 + Sync) {
        assert_eq!(x.len(), self.column_count, "a factor for each column");
        assert_eq!(y.len(), self.row_count(), "a place for each row");
        y.par_chunks_mut(ROWS).enumerate().for_each(|(block, y)| {
            for (at, y) in y.iter_mut().enumerate() {
                let row = block * ROWS + at;
                let (columns, values) = self.row(row);
                let terms = columns.iter().zip(values).map(|(&c, &v)| v * x[c as usize]);
                *y = make(row, terms.sum());
            }
        });
    }

    /// The matrix with rows and columns exchanged. Cost: O(entries).
    pub fn transpose(&self) -> Self {
        let mut starts = vec![0_usize; self.column_count + 1];
        for &column in &self.columns {
            starts[column as usize + 1] += 1;
        }
        for column in 0..self.column_count {
            starts[column + 1] += starts[column];
        }
        let mut next = starts.clone();
        let mut columns = vec![0; self.columns.len()];
        let mut values = vec![0.0; self.columns.len()];
        for (row, column, value) in self.entries() {
            let place = &mut next[column];
            columns[*place] = row as u32;
            values[*place] = value;
            *place += 1;
        }
        Self { column_count: self.row_count(), starts, columns, values }
    }

    /// `A B`, row by row (Gustavson 1978).
    ///
    /// # Panics
    /// If A has not as many columns as B has rows.
    pub fn product(&self, other: &Self) -> Self {
        assert_eq!(self.column_count, other.row_count(), "columns of one are rows of the other");
        let blocks: Vec<Range<usize>> = row_blocks(self.row_count()).collect();
        let of_rows = |rows: Range<usize>| self.product_rows(other, rows);
        let parts = blocks.into_par_iter().map(of_rows).collect();
        Self::from_parts(self.row_count(), other.column_count, parts)
    }

    fn product_rows(&self, other: &Self, rows: Range<usize>) -> Part {
        let mut part = Part::default();
        // the place of a column's sum in `row`; valid if that entry is of the column
        let mut place = vec![0_u32; other.column_count];
        let mut row: Vec<(u32, f64)> = Vec::new();
        for at in rows {
            row.clear();
            let (columns, values) = self.row(at);
            for (&middle, &value) in columns.iter().zip(values) {
                let (columns, factors) = other.row(middle as usize);
                for (&column, &factor) in columns.iter().zip(factors) {
                    let known = place[column as usize] as usize;
                    match row.get_mut(known) {
                        Some((own, sum)) if *own == column => *sum += value * factor,
                        _ => {
                            place[column as usize] = row.len() as u32;
                            row.push((column, value * factor));
                        }
                    }
                }
            }
            row.sort_unstable_by_key(|&(column, _)| column);
            part.counts.push(row.len());
            part.columns.extend(row.iter().map(|&(column, _)| column));
            part.values.extend(row.iter().map(|&(_, value)| value));
        }
        part
    }

    /// `Pᵀ A P`, the matrix projected to the space that the columns of P span.
    ///
    /// # Panics
    /// If P has not as many rows as A has rows and columns.
    pub fn projected(&self, columns: &Self) -> Self {
        columns.transpose().product(&self.product(columns))
    }

    /// Whether `|a_ij − a_ji| ≤ tolerance · √|a_ii a_jj|` for all entries.
    pub fn is_symmetric(&self, tolerance: f64) -> bool {
        if self.row_count() != self.column_count {
            return false;
        }
        let diagonal = self.diagonal();
        let other = self.transpose();
        let equal = |row: usize| {
            let scale = |column: u32| (diagonal[row] * diagonal[column as usize]).abs().sqrt();
            let ((mine, values), (theirs, others)) = (self.row(row), other.row(row));
            let near = |at: usize| (values[at] - others[at]).abs() <= tolerance * scale(mine[at]);
            mine == theirs && (0..mine.len()).all(near)
        };
        (0..self.row_count()).all(equal)
    }
}

/// The rows in blocks of a fixed size.
fn row_blocks(row_count: usize) -> impl Iterator<Item = Range<usize>> {
    (0..row_count.div_ceil(ROWS)).map(move |b| b * ROWS..((b + 1) * ROWS).min(row_count))
}

/// Sorts the entries of some rows by columns and adds those of one column in the order given.
fn merge_rows(starts: &[usize], entries: &mut [(u32, f64)]) -> Part {
    let mut part = Part::default();
    for ends in starts.windows(2) {
        let row = &mut entries[ends[0] - starts[0]..ends[1] - starts[0]];
        row.sort_by_key(|&(column, _)| column);
        let before = part.columns.len();
        for &mut (column, value) in row {
            if part.columns.len() > before && part.columns.last() == Some(&column) {
                *part.values.last_mut().expect("as many values as columns") += value;
            } else {
                part.columns.push(column);
                part.values.push(value);
            }
        }
        part.counts.push(part.columns.len() - before);
    }
    part
}
