//! Aggregates of unknowns, which are the unknowns of the next level, and the interpolation from these.

use super::sparse::Sparse;

/// Unknowns are strongly coupled if `|a_ij| > θ √(a_ii a_jj)`, θ halved from level to level (Vaněk, Mandel & Brezina
/// 1996).
const STRONG: f64 = 0.08;

/// Unknowns in groups.
pub struct Aggregates {
    /// The number of aggregates.
    pub count: usize,
    /// The aggregate of each unknown.
    pub of: Vec<u32>,
}

const NONE: u32 = u32::MAX;

/// The couplings of each row that are strong, by θ.
struct Strong<'a> {
    matrix: &'a Sparse,
    scales: Vec<f64>,
}

impl<'a> Strong<'a> {
    fn new(matrix: &'a Sparse, level: usize) -> Self {
        let threshold = STRONG * 0.5_f64.powi(level as i32);
        let scale = |a: f64| a.abs().sqrt() * threshold.sqrt();
        Self { matrix, scales: matrix.diagonal().into_iter().map(scale).collect() }
    }

    fn is(&self, row: usize, column: u32, value: f64) -> bool {
        column as usize != row && value.abs() > self.scales[row] * self.scales[column as usize]
    }

    /// The strongly coupled unknowns with the couplings.
    fn of(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (columns, values) = self.matrix.row(row);
        let entries = columns.iter().zip(values);
        entries.filter(move |(c, v)| self.is(row, **c, **v)).map(|(&c, &v)| (c as usize, v.abs()))
    }
}

/// Joins unknowns: first whole neighbourhoods of free unknowns, then each unknown left with its most strongly coupled
/// neighbour in one of these, last the rest among themselves.
pub fn aggregates(matrix: &Sparse, level: usize) -> Aggregates {
    let strong = Strong::new(matrix, level);
    let mut of = vec![NONE; matrix.row_count()];
    let mut count = 0;
    for row in 0..of.len() {
        let free = of[row] == NONE && strong.of(row).all(|(other, _)| of[other] == NONE);
        if free && strong.of(row).next().is_some() {
            join(&strong, &mut of, row, count);
            count += 1;
        }
    }
    let whole = of.clone();
    for row in 0..of.len() {
        if of[row] == NONE {
            let beside = strong.of(row).filter(|&(other, _)| whole[other] != NONE);
            let most = beside.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            of[row] = most.map_or(NONE, |(other, _)| whole[other]);
        }
    }
    for row in 0..of.len() {
        if of[row] == NONE {
            join(&strong, &mut of, row, count);
            count += 1;
        }
    }
    Aggregates { count: count as usize, of }
}

/// Makes an aggregate of an unknown and those coupled to it that are free.
fn join(strong: &Strong<'_>, of: &mut [u32], row: usize, number: u32) {
    of[row] = number;
    for (other, _) in strong.of(row) {
        if of[other] == NONE {
            of[other] = number;
        }
    }
}

/// Interpolation from aggregates: `(I − ω D⁻¹ A) T`, T being 1 for each unknown at its aggregate, A without its weak
/// couplings, which are added to the diagonal D, and ω = 4 / (3 max Σ|a_ij| / a_ii).
pub fn smoothed(matrix: &Sparse, joined: &Aggregates, level: usize) -> Sparse {
    let strong = Strong::new(matrix, level);
    let count = matrix.row_count();
    let lumped: Vec<f64> = (0..count).map(|row| lumped(&strong, row)).collect();
    let ratio = |row: usize| {
        let sum: f64 = strong.of(row).map(|(_, a)| a).sum();
        1.0 + sum / lumped[row].abs()
    };
    let largest = (0..count).map(ratio).filter(|x| x.is_finite()).fold(1.0, f64::max);
    let omega = 4.0 / (3.0 * largest);
    let mut starts = vec![0];
    let (mut columns, mut values): (Vec<u32>, Vec<f64>) = Default::default();
    let mut row: Vec<(u32, f64)> = Vec::new();
    for at in 0..count {
        row.clear();
        row.push((joined.of[at], 1.0 - omega));
        let (others, couplings) = matrix.row(at);
        for (&other, &value) in others.iter().zip(couplings) {
            if strong.is(at, other, value) && lumped[at] != 0.0 {
                row.push((joined.of[other as usize], -omega * value / lumped[at]));
            }
        }
        row.sort_by_key(|&(column, _)| column);
        let before = columns.len();
        for &(column, value) in &row {
            if columns.len() > before && columns.last() == Some(&column) {
                *values.last_mut().expect("as many values as columns") += value;
            } else {
                columns.push(column);
                values.push(value);
            }
        }
        starts.push(columns.len());
    }
    Sparse::new(joined.count, starts, columns, values)
}

/// The diagonal with the weak couplings added, unless they would cancel most of it.
fn lumped(strong: &Strong<'_>, row: usize) -> f64 {
    let (columns, values) = strong.matrix.row(row);
    let (mut own, mut weak) = (0.0, 0.0);
    for (&column, &value) in columns.iter().zip(values) {
        if column as usize == row {
            own = value;
        } else if !strong.is(row, column, value) {
            weak += value;
        }
    }
    if own + weak > 0.2 * own { own + weak } else { own }
}
