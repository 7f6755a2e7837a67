//! A sparse matrix, row by row.

/// A sparse matrix by its rows (CSR): columns ascending in each row, none twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sparse {
    column_count: usize,
    starts: Vec<usize>,
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

    /// A matrix from entries in any order; those at one place are added in the order given.
    pub fn from_entries(
        row_count: usize,
        column_count: usize,
        entries: &[(u32, u32, f64)],
    ) -> Self {
        let mut order: Vec<u32> = (0..entries.len() as u32).collect();
        order.sort_by_key(|&at| (entries[at as usize].0, entries[at as usize].1));
        let mut starts = vec![0_usize; row_count + 1];
        let (mut columns, mut values): (Vec<u32>, Vec<f64>) = Default::default();
        let mut last = None;
        for at in order {
            let (row, column, value) = entries[at as usize];
            if last == Some((row, column)) {
                *values.last_mut().expect("there is an entry before") += value;
            } else {
                columns.push(column);
                values.push(value);
                starts[row as usize + 1] += 1;
                last = Some((row, column));
            }
        }
        for row in 0..row_count {
            starts[row + 1] += starts[row];
        }
        Self::new(column_count, starts, columns, values)
    }

    /// The number of rows.
    pub fn row_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The number of columns.
    pub fn column_count(&self) -> usize {
        self.column_count
    }

    /// A row's columns and values.
    pub fn row(&self, row: usize) -> (&[u32], &[f64]) {
        let range = self.starts[row]..self.starts[row + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// All entries, row by row.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.row_count()).flat_map(|row| {
            let (columns, values) = self.row(row);
            columns.iter().zip(values).map(move |(&column, &value)| (row, column as usize, value))
        })
    }
}
