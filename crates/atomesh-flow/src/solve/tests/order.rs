//! The order of elimination, and the counted cost of factors.

use proptest::prelude::*;

use super::super::order::Elimination;
use super::{cubes, dominant};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn each_unknown_is_eliminated_once_and_blocks_stay_together(
        count in 0_usize..300, block in 1_usize..4, seed: u64, coincide: bool,
    ) {
        let mut own = dominant(count, block, seed, false);
        if coincide {
            own.places.iter_mut().for_each(|place| place[1] = place[0].round());
        }
        let order = Elimination::new(&own.matrix, block, &own.places, false, f64::INFINITY).order;
        let mut sorted = order.clone();
        sorted.sort_unstable();
        prop_assert_eq!(sorted, (0..(count * block) as u32).collect::<Vec<_>>());
        for unknowns in order.chunks(block) {
            prop_assert!(unknowns.iter().all(|u| u / block as u32 == unknowns[0] / block as u32));
        }
    }

    #[test]
    fn the_values_of_a_factor_are_counted_as_elimination_makes_them(
        count in 1_usize..40, seed: u64,
    ) {
        let own = dominant(count, 1, seed, true);
        let plan = Elimination::new(&own.matrix, 1, &own.places, false, f64::INFINITY);
        let mut full = vec![vec![false; count]; count];
        own.matrix.entries().for_each(|(i, j, _)| full[i][j] = true);
        let mut expected = (0.0, 0.0);
        for (at, &pivot) in plan.order.iter().enumerate() {
            let rest = &plan.order[at..];
            let column: Vec<usize> =
                rest.iter().map(|&u| u as usize).filter(|&u| full[u][pivot as usize]).collect();
            expected.0 += column.len() as f64;
            expected.1 += (column.len() as f64).powi(2);
            for &i in &column {
                column.iter().for_each(|&j| full[i][j] = true);
            }
        }
        prop_assert_eq!((plan.values, plan.work), expected);
        let short = Elimination::new(&own.matrix, 1, &own.places, false, expected.0 - 1.0);
        prop_assert_eq!(short.values, f64::INFINITY);
    }
}

#[test]
fn dissection_fills_less_than_rows_one_after_another() {
    let own = cubes::<2>(60, |_| 1.0);
    let plan = Elimination::new(&own.matrix, 1, &own.places, false, f64::INFINITY);
    // by rows a factor holds a band of 60; by dissection some 31/8 log₂ n² of them (George 1973), n = 60: 46, less
    // the leaves
    assert!(plan.values < 30.0 * 3600.0, "{}", plan.values / 3600.0);
    let along = vec![[0.0]; 3600];
    let bad = Elimination::new(&own.matrix, 1, &along, false, f64::INFINITY);
    assert!(plan.values < bad.values, "places matter");
}
