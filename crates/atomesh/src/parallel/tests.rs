use super::prelude::*;
use super::{BLOCKS_A_THREAD, each};
use proptest::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Does `test` on one thread and on three.
fn on_threads(test: impl Fn() + Sync) {
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(&test);
    }
}

proptest! {
    /// Whatever a loop is made of, it gives what the same loop of the standard library gives.
    #[test]
    fn loops_give_what_iterators_give(
        mut values in prop::collection::vec(0_i64..1000, 0..200), size in 1_usize..9, least in 1_usize..50,
    ) {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        threads.install(|| -> Result<(), TestCaseError> {
            let (v, other) = (values.clone(), values.iter().rev().copied().collect::<Vec<_>>());
            let par = || v.par_iter().with_min_len(least);
            prop_assert_eq!(par().map(|x| x + 1).collect::<Vec<_>>(), v.iter().map(|x| x + 1).collect::<Vec<_>>());
            let odd = |x: &&i64| *x % 2 == 1;
            prop_assert_eq!(par().filter(odd).copied().collect::<Vec<_>>(), v.iter().filter(odd).copied().collect::<Vec<_>>());
            prop_assert_eq!(par().filter(odd).count(), v.iter().filter(odd).count());
            let half = |x: &i64| (x % 3 == 0).then_some(x / 3);
            prop_assert_eq!(par().filter_map(half).collect::<Vec<_>>(), v.iter().filter_map(half).collect::<Vec<_>>());
            let some = |x: &i64| 0..x % 4;
            prop_assert_eq!(par().flat_map_iter(some).collect::<Vec<_>>(), v.iter().flat_map(some).collect::<Vec<_>>());
            prop_assert_eq!(par().map(some).flatten_iter().reduce(|| 0, |a, b| a + b), v.iter().flat_map(some).sum::<i64>());
            let pairs: Vec<_> = par().zip(&other).enumerate().map(|(i, (a, b))| (i, a * b)).collect();
            prop_assert_eq!(pairs, v.iter().zip(&other).enumerate().map(|(i, (a, b))| (i, a * b)).collect::<Vec<_>>());
            let large = |x: &i64| *x > 600;
            prop_assert_eq!(par().position_first(large), v.iter().position(large));
            prop_assert_eq!(par().copied().find_first(large), v.iter().copied().find(large));
            prop_assert_eq!(par().all(|x| *x < 900), v.iter().all(|x| *x < 900));
            prop_assert_eq!(par().copied().reduce(|| 0, |a, b| a + b), v.iter().sum::<i64>());
            prop_assert_eq!(par().copied().reduce_with(i64::max), v.iter().copied().max());
            prop_assert_eq!(par().enumerate().min_by(|a, b| a.1.cmp(b.1)), v.iter().enumerate().min_by(|a, b| a.1.cmp(b.1)));
            prop_assert_eq!(par().fold(|| 0, |a, b| a + b).reduce(|| 0, |a, b| a + b), v.iter().sum::<i64>());
            let (twice, sign): (Vec<i64>, Vec<bool>) = par().map(|x| (2 * x, *x > 5)).unzip();
            prop_assert!(twice.iter().zip(&sign).zip(&v).all(|((t, s), x)| *t == 2 * x && *s == (*x > 5)));
            let sums: Vec<i64> = v.par_chunks(size).map(|c| c.iter().sum()).collect();
            prop_assert_eq!(sums, v.chunks(size).map(|c| c.iter().sum()).collect::<Vec<i64>>());
            let sums: Vec<i64> = v.par_chunks_exact(size).map(|c| c.iter().sum()).collect();
            prop_assert_eq!(sums, v.chunks_exact(size).map(|c| c.iter().sum()).collect::<Vec<i64>>());
            prop_assert_eq!(v.clone().into_par_iter().collect::<Vec<_>>(), v.clone());
            prop_assert_eq!((3..v.len()).into_par_iter().collect::<Vec<_>>(), (3..v.len()).collect::<Vec<_>>());
            prop_assert_eq!(par().map(|x| if *x < 995 { Ok(*x) } else { Err(*x) }).collect::<Result<Vec<_>, _>>(),
                v.iter().map(|x| if *x < 995 { Ok(*x) } else { Err(*x) }).collect::<Result<Vec<_>, _>>());
            let mut more = vec![7];
            more.par_extend(par().copied());
            more.par_extend(par().filter(odd).copied());
            prop_assert_eq!(more.len(), 1 + v.len() + v.iter().filter(odd).count());
            let (mut a, mut b) = (v.clone(), v.clone());
            a.par_iter_mut().zip(&other).for_each(|(x, y)| *x -= y);
            b.iter_mut().zip(&other).for_each(|(x, y)| *x -= y);
            prop_assert_eq!(&a, &b);
            a.par_chunks_mut(size).enumerate().for_each(|(i, c)| c.iter_mut().for_each(|x| *x += i as i64));
            b.chunks_mut(size).enumerate().for_each(|(i, c)| c.iter_mut().for_each(|x| *x += i as i64));
            prop_assert_eq!(&a, &b);
            a.par_chunks_exact_mut(size).for_each(|c| c.reverse());
            b.chunks_exact_mut(size).for_each(|c| c.reverse());
            prop_assert_eq!(a, b);
            Ok(())
        })?;
        values.par_sort_unstable();
        prop_assert!(values.is_sorted());
    }
}

#[test]
fn every_number_has_its_turn_once() {
    on_threads(|| {
        for count in [0, 1, 2, 100] {
            let turns: Vec<AtomicUsize> = (0..count).map(|_| AtomicUsize::new(0)).collect();
            each(count, &|number| {
                turns[number].fetch_add(1, Ordering::Relaxed);
            });
            assert!(turns.into_iter().all(|turns| turns.into_inner() == 1));
        }
    });
}

#[test]
fn states_are_made_for_blocks_of_at_least_so_many_items() {
    on_threads(|| {
        let most = BLOCKS_A_THREAD * rayon::current_num_threads();
        for least in [1, 100, 5000] {
            let states = AtomicUsize::new(0);
            let init = || {
                states.fetch_add(1, Ordering::Relaxed);
                0
            };
            let count = |seen: &mut usize, _: usize| {
                *seen += 1;
                *seen
            };
            let seen: Vec<usize> =
                (0..1000_usize).into_par_iter().with_min_len(least).map_init(init, count).collect();
            let blocks = states.into_inner();
            assert_eq!(seen.iter().filter(|seen| **seen == 1).count(), blocks);
            assert!(blocks <= most.min((1000 / least).max(1)), "{blocks} of {least}");
        }
    });
}

#[test]
fn a_vectors_memory_is_used_again() {
    let mut into = Vec::with_capacity(64);
    let at = into.as_ptr();
    for count in [64_usize, 10, 0] {
        (0..count).into_par_iter().map(|i| i * i).collect_into_vec(&mut into);
        assert_eq!(into, (0..count).map(|i| i * i).collect::<Vec<_>>());
        assert_eq!(into.as_ptr(), at);
    }
}

#[test]
#[should_panic(expected = "on its way")]
fn a_panic_is_passed_on() {
    let strings = (0..100_usize).into_par_iter().map(|i| {
        assert!(i != 70, "on its way");
        i.to_string()
    });
    strings.collect::<Vec<_>>();
}
