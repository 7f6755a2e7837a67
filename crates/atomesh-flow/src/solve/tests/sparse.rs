//! Sparse matrices compute as dense ones.

use proptest::prelude::*;

use super::super::sparse::Sparse;

/// A matrix as rows of numbers.
fn dense(matrix: &Sparse) -> Vec<Vec<f64>> {
    let mut rows = vec![vec![0.0; matrix.column_count()]; matrix.row_count()];
    matrix.entries().for_each(|(i, j, v)| rows[i][j] += v);
    rows
}

proptest! {
    #[test]
    fn products_are_those_of_dense_matrices(
        a in prop::collection::vec((0_u32..7, 0_u32..5, -3_i8..4), 0..40),
        b in prop::collection::vec((0_u32..5, 0_u32..6, -3_i8..4), 0..40),
    ) {
        let entry = |&(i, j, v): &(u32, u32, i8)| (i, j, f64::from(v));
        let entries: Vec<_> = a.iter().map(entry).collect();
        let (a, b) = (
            Sparse::from_entries(7, 5, &entries),
            Sparse::from_entries(5, 6, &b.iter().map(entry).collect::<Vec<_>>()),
        );
        let mut sums = vec![vec![0.0; 5]; 7];
        entries.iter().for_each(|&(i, j, v)| sums[i as usize][j as usize] += v);
        let (left, right, product) = (dense(&a), dense(&b), dense(&a.product(&b)));
        // whole numbers: no rounding anywhere
        prop_assert_eq!(&left, &sums);
        let (turned, x) = (dense(&a.transpose()), [1.0, -2.0, 3.0, 0.5, 4.0]);
        let mut y = vec![0.0; 7];
        a.multiply(&x, &mut y);
        for i in 0..7 {
            prop_assert_eq!(y[i], (0..5).map(|j| left[i][j] * x[j]).sum::<f64>());
            for j in 0..5 {
                prop_assert_eq!(turned[j][i], left[i][j]);
            }
            for j in 0..6 {
                let sum: f64 = (0..5).map(|k| left[i][k] * right[k][j]).sum();
                prop_assert_eq!(product[i][j], sum);
            }
        }
        let again = Sparse::new(5, a.starts().to_vec(), a.columns().to_vec(), a.values().to_vec());
        prop_assert_eq!(again, a);
    }
}

#[test]
fn symmetry_is_of_values_and_places() {
    let of = |entries: &[(u32, u32, f64)]| Sparse::from_entries(2, 2, entries);
    assert!(of(&[(0, 0, 1.0), (1, 1, 1.0), (0, 1, 0.5), (1, 0, 0.5)]).is_symmetric(0.0));
    assert!(!of(&[(0, 0, 1.0), (1, 1, 1.0), (0, 1, 0.5), (1, 0, 0.4)]).is_symmetric(0.05));
    assert!(!of(&[(0, 0, 1.0), (0, 1, 0.5)]).is_symmetric(1.0));
}
