use std::collections::{BTreeSet, VecDeque};
use std::ops::ControlFlow;

use super::bisect::{bisect, normalized_cut};
use super::fiedler::{Accuracy, fiedler};
use super::min_cut::{min_cut, units};
use super::*;
use crate::watch::{Phase, Silent, Watch};

/// As exact as double precision allows.
const EXACT: Accuracy = Accuracy { tolerance: 1e-9, most: 200 };

/// Numbers from 0 to 1 without a pattern.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Cells in a grid, each linked to the next along both axes by the weight that its place and the axis give.
fn grid(shape: [usize; 2], mut weight: impl FnMut([usize; 2], usize) -> f64) -> CellGraph {
    let cell = |[x, y]: [usize; 2]| (x + shape[0] * y) as u32;
    let mut links = Vec::new();
    for at in (0..shape[0] * shape[1]).map(|i| [i % shape[0], i / shape[0]]) {
        for axis in 0..2 {
            let mut next = at;
            next[axis] += 1;
            if next[axis] < shape[axis] {
                links.push(Link { cells: [cell(at), cell(next)], weight: weight(at, axis) });
            }
        }
    }
    CellGraph::new(shape[0] * shape[1], &links).unwrap()
}

/// A connected graph: a path through all cells, and links between any two; weights 10^(−`decades`) to 1.
fn any_graph(count: usize, more: usize, decades: f64, next: &mut impl FnMut() -> f64) -> CellGraph {
    let mut links: Vec<[u32; 2]> = (1..count as u32).map(|cell| [cell - 1, cell]).collect();
    for _ in 0..more {
        let [a, b] = [next(), next()].map(|share| (share * count as f64) as u32);
        links.extend((a != b).then_some([a, b]));
    }
    let links: Vec<Link> = links
        .into_iter()
        .map(|cells| Link { cells, weight: 0.1_f64.powf(decades * next()) })
        .collect();
    CellGraph::from_links(count, &links)
}

/// xᵀ L x / xᵀ D x, and the greatest entry of L x − λ D x over that of λ D x.
fn quotient(graph: &CellGraph, x: &[f64]) -> (f64, f64) {
    let cells = 0..graph.cell_count();
    let product = |cell: usize| -> f64 {
        graph.neighbours(cell).map(|(other, weight)| weight * (x[cell] - x[other])).sum()
    };
    let energy: f64 = cells.clone().map(|cell| x[cell] * product(cell)).sum();
    let norm: f64 = cells.clone().map(|cell| graph.degree(cell) * x[cell] * x[cell]).sum();
    let lambda = energy / norm;
    let scaled = |cell: usize| lambda * graph.degree(cell) * x[cell];
    let worst = cells.clone().map(|cell| (product(cell) - scaled(cell)).abs()).fold(0.0, f64::max);
    (lambda, worst / cells.map(|cell| scaled(cell).abs()).fold(0.0, f64::max))
}

#[test]
fn the_vector_of_a_path_is_a_cosine() {
    for count in [2, 3, 10, 100, 3000] {
        let x = fiedler(&grid([count, 1], |_, _| 0.7), EXACT);
        let way = std::f64::consts::PI / (count - 1) as f64;
        for (cell, value) in x.iter().enumerate() {
            let expected = (way * cell as f64).cos();
            assert!((value / x[0] - expected).abs() < 1e-7, "{count}, {cell}: {value}");
        }
    }
}

#[test]
fn the_vector_of_a_grid_is_a_cosine_along_its_longer_side() {
    for shape in [[23, 11], [60, 59], [9, 40]] {
        // with half the weight along its rim a grid's equations part into those of two paths
        let weight = |at: [usize; 2], axis: usize| {
            let is_rim = at[1 - axis] == 0 || at[1 - axis] + 1 == shape[1 - axis];
            if is_rim { 0.5 } else { 1.0 }
        };
        let graph = grid(shape, weight);
        let x = fiedler(&graph, EXACT);
        let axis = usize::from(shape[1] > shape[0]);
        let way = std::f64::consts::PI / (shape[axis] - 1) as f64;
        for (cell, value) in x.iter().enumerate() {
            let at = [cell % shape[0], cell / shape[0]][axis];
            let expected = (way * at as f64).cos();
            // two nearly equal eigenvalues tell vectors apart the worse
            assert!((value / x[0] - expected).abs() < 1e-6, "{shape:?}, {cell}: {value}");
        }
        let (lambda, _) = quotient(&graph, &x);
        assert!((lambda / (0.5 * (1.0 - way.cos())) - 1.0).abs() < 1e-9, "{shape:?}: {lambda}");
    }
}

/// The second eigenvalue of the normalised Laplacian by Jacobi's rotations of the whole matrix: slow and plainly right.
fn slow_lambda(graph: &CellGraph) -> f64 {
    let count = graph.cell_count();
    let mut a = vec![vec![0.0; count]; count];
    for cell in 0..count {
        a[cell][cell] = 1.0;
        for (other, weight) in graph.neighbours(cell) {
            a[cell][other] = -weight / (graph.degree(cell) * graph.degree(other)).sqrt();
        }
    }
    for _ in 0..30 {
        for p in 0..count {
            for q in p + 1..count {
                if a[p][q].abs() < 1e-300 {
                    continue;
                }
                let theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
                let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let cosine = 1.0 / tangent.hypot(1.0);
                let sine = tangent * cosine;
                for k in 0..count {
                    let (kp, kq) = (a[k][p], a[k][q]);
                    (a[k][p], a[k][q]) = (cosine * kp - sine * kq, sine * kp + cosine * kq);
                }
                for k in 0..count {
                    let (pk, qk) = (a[p][k], a[q][k]);
                    (a[p][k], a[q][k]) = (cosine * pk - sine * qk, sine * pk + cosine * qk);
                }
            }
        }
    }
    let mut values: Vec<f64> = (0..count).map(|k| a[k][k]).collect();
    values.sort_by(f64::total_cmp);
    values[1]
}

#[test]
fn vectors_of_any_graph_are_those_of_the_second_eigenvalue() {
    for seed in 1..40 {
        let mut next = random(seed);
        let count = 2 + (next() * 60.0) as usize;
        let graph = any_graph(count, seed as usize % 90, (seed % 5) as f64, &mut next);
        let (lambda, residual) = quotient(&graph, &fiedler(&graph, EXACT));
        let expected = slow_lambda(&graph);
        // rounding of 1 − N, over λ
        let tolerance = 1e-7 + 1e-13 / expected;
        assert!((lambda / expected - 1.0).abs() < tolerance, "{seed}: {lambda}, {expected}");
        assert!(residual < 1e-4 + 1e-10 / expected, "{seed}: {residual} of {count}");
    }
}

#[test]
fn two_blocks_part_at_their_weak_bridge() {
    // squares of 7 by 7, side by side, with one link of 0.1 between them and 84 of 1 in each
    let weight = |[x, y]: [usize; 2], axis: usize| match (x, axis, y) {
        (6, 0, 3) => 0.1,
        (6, 0, _) => 0.0,
        _ => 1.0,
    };
    let graph = grid([14, 7], weight);
    let found = bisect(&graph, 1).unwrap();
    assert!((0..98).all(|cell| found.is_second[cell] == (cell % 14 > 6)), "{found:?}");
    let expected = 2.0 * 0.1 / (2.0 * 84.0 + 0.1);
    assert!((found.cut - expected).abs() < 1e-15, "{} for {expected}", found.cut);
}

#[test]
fn the_best_of_all_cuts_is_found_of_most_small_graphs() {
    let mut hits = 0;
    for seed in 1..=60 {
        let mut next = random(seed);
        let graph = any_graph(11, 9, 1.0, &mut next);
        let found = bisect(&graph, 1).unwrap();
        let cut_of = |bits: u32| {
            let sides: Vec<bool> = (0..11).map(|cell| bits >> cell & 1 == 1).collect();
            normalized_cut(&graph, &sides)
        };
        let best = (1..1 << 10).map(cut_of).fold(f64::INFINITY, f64::min);
        assert!(found.cut >= best - 1e-12, "{seed}: {} below {best}", found.cut);
        hits += usize::from(found.cut <= best + 1e-12);
        assert!(found.cut < 1.5 * best, "{seed}: {} for {best}", found.cut);
    }
    assert!(hits >= 50, "{hits} of 60");
}

/// Whether cells are connected by weights above 0.
fn is_connected(graph: &CellGraph, cells: &BTreeSet<usize>) -> bool {
    let mut left = cells.clone();
    let mut queue: Vec<usize> = left.pop_first().into_iter().collect();
    while let Some(cell) = queue.pop() {
        for (other, weight) in graph.neighbours(cell) {
            if weight > 0.0 && left.remove(&other) {
                queue.push(other);
            }
        }
    }
    left.is_empty()
}

fn cells_of(parts: &[i32], part: i32) -> BTreeSet<usize> {
    (0..parts.len()).filter(|&cell| parts[cell] == part).collect()
}

#[test]
fn planted_parts_are_found_in_noise() {
    // four by three blocks of 12 by 12 cells; a twelfth of the links within are as weak as borders, a fifth of the borders'
    // as strong as inside
    for seed in 1..6 {
        let mut next = random(seed);
        let weight = |at: [usize; 2], axis: usize| {
            let is_border = (at[axis] + 1).is_multiple_of(12);
            let is_odd = next() < if is_border { 0.2 } else { 1.0 / 12.0 };
            if is_border != is_odd { 0.05 * next() } else { 0.5 + 0.5 * next() }
        };
        let graph = grid([48, 36], weight);
        let options = ClusterOptions { most_parts: 12, ..ClusterOptions::default() };
        let tree = ClusterTree::grow(&graph, &options, &mut Silent).unwrap();
        let parts = tree.parts(12);
        let mut right = 0;
        for block in 0..12 {
            let cells = (0..48 * 36).filter(|cell| cell % 48 / 12 + 4 * (cell / 48 / 12) == block);
            let own: Vec<i32> = cells.map(|cell| parts[cell]).collect();
            let count = |part: i32| own.iter().filter(|own| **own == part).count();
            right += (1..=12).map(count).max().unwrap_or(0);
        }
        // a cell at a border with a strong link across and weak ones inside belongs there as well
        assert!(right as f64 > 0.95 * 48.0 * 36.0, "{seed}: {right} of {}", 48 * 36);
    }
}

#[test]
fn levels_are_nested_and_parts_connected_and_large_enough() {
    let mut next = random(5);
    let graph = grid([40, 25], |_, _| next().powi(3));
    let options = ClusterOptions { most_parts: 30, least_cells: 12 };
    let tree = ClusterTree::grow(&graph, &options, &mut Silent).unwrap();
    assert_eq!((tree.part_count(), tree.splits().len()), (30, 29));
    assert_eq!(tree.parts(0), tree.parts(1));
    assert_eq!(tree.parts(99), tree.parts(30));
    for (split, count) in tree.splits().zip(1..30) {
        let (before, after) = (tree.parts(count), tree.parts(count + 1));
        let new = count as i32 + 1;
        assert!(split.cut > 0.0 && split.cut < 2.0);
        for (before, after) in before.iter().zip(&after) {
            assert_eq!(*before, if *after == new { split.part } else { *after });
        }
        let (kept, taken) = (cells_of(&after, split.part), cells_of(&after, new));
        assert!(kept.len() >= taken.len() && taken.len() >= 12);
        for cells in [kept, taken] {
            assert!(is_connected(&graph, &cells), "level {count}");
        }
    }
}

#[test]
fn walls_part_before_anything_else_and_specks_behind_them_do_not_count() {
    // a wall across a strip after two thirds; in the larger piece a walled speck of four cells
    let is_speck = |[x, y]: [usize; 2]| (4..6).contains(&x) && (4..6).contains(&y);
    let weight = |at: [usize; 2], axis: usize| {
        let mut next = at;
        next[axis] += 1;
        let is_wall = (at[0] == 19 && axis == 0) || is_speck(at) != is_speck(next);
        if is_wall { 0.0 } else { 1.0 }
    };
    let graph = grid([30, 10], weight);
    let grow = |most_parts, least_cells| {
        let options = ClusterOptions { most_parts, least_cells };
        ClusterTree::grow(&graph, &options, &mut Silent).unwrap()
    };
    let tree = grow(4, 8);
    let parts = tree.parts(2);
    assert!((0..300).all(|cell| parts[cell] == if cell % 30 < 20 { 1 } else { 2 }));
    let cuts: Vec<f64> = tree.splits().map(|split| split.cut).collect();
    assert!(cuts[0] == 0.0 && cuts[1] > 0.0, "{cuts:?}");
    // the speck counts where four cells do
    let parts = grow(4, 4).parts(3);
    let speck: BTreeSet<usize> = (0..300).filter(|cell| is_speck([cell % 30, cell / 30])).collect();
    assert_eq!(cells_of(&parts, 3), speck);
    // in the mesh as in a part too small for it all stay together
    assert_eq!(grow(4, 299).part_count(), 1);
    assert_eq!(grow(1, 8).parts(1), [1; 300]);
}

#[test]
fn cells_without_neighbours_are_parts_of_their_own() {
    let tree = |count, links: &[Link], least_cells| {
        let graph = CellGraph::new(count, links).unwrap();
        let options = ClusterOptions { most_parts: 9, least_cells };
        ClusterTree::grow(&graph, &options, &mut Silent).unwrap()
    };
    assert_eq!(tree(3, &[], 8).parts(9), [1, 3, 2]);
    let pair = [Link { cells: [1, 2], weight: 0.5 }];
    assert_eq!(tree(4, &pair, 2).parts(2), [1, 2, 2, 1]);
    assert_eq!(tree(4, &pair, 1).part_count(), 4);
    assert_eq!((tree(0, &[], 1).part_count(), tree(0, &[], 1).parts(3)), (1, vec![]));
}

/// The greatest flow by shortest paths (Edmonds & Karp 1972) over a whole matrix of room: slow and plainly right.
fn slow_flow(graph: &CellGraph, marks: [&[u32]; 2]) -> u64 {
    let count = graph.cell_count();
    let unit = units(graph);
    let mut room = vec![vec![0_u64; count + 2]; count + 2];
    for cell in 0..count {
        for (other, weight) in graph.neighbours(cell) {
            room[cell][other] = unit(weight);
        }
    }
    let (source, sink) = (count, count + 1);
    marks[0].iter().for_each(|&cell| room[source][cell as usize] = u64::MAX >> 1);
    marks[1].iter().for_each(|&cell| room[cell as usize][sink] = u64::MAX >> 1);
    let mut flow = 0;
    loop {
        let mut from = vec![usize::MAX; count + 2];
        let mut queue = VecDeque::from([source]);
        while let Some(cell) = queue.pop_front() {
            for other in 0..count + 2 {
                if room[cell][other] > 0 && from[other] == usize::MAX && other != source {
                    from[other] = cell;
                    queue.push_back(other);
                }
            }
        }
        if from[sink] == usize::MAX {
            return flow;
        }
        let mut path = vec![sink];
        while path[path.len() - 1] != source {
            path.push(from[path[path.len() - 1]]);
        }
        let most = path.windows(2).map(|pair| room[pair[1]][pair[0]]).min().unwrap();
        for pair in path.windows(2) {
            room[pair[1]][pair[0]] -= most;
            room[pair[0]][pair[1]] += most;
        }
        flow += most;
    }
}

#[test]
fn minimum_cuts_are_as_weak_as_the_slow_flow() {
    for seed in 1..=150 {
        let mut next = random(seed);
        let count = 4 + (next() * 36.0) as usize;
        let graph = match seed % 3 {
            0 => grid([count, 5], |_, _| if next() < 0.3 { 0.0 } else { next() }),
            1 => grid([6, count / 2], |_, _| 1.0), // many cuts are equal
            _ => any_graph(count, 2 * count, 3.0, &mut next),
        };
        let all: Vec<u32> = (0..graph.cell_count() as u32).collect();
        let mut marks = [BTreeSet::new(), BTreeSet::new()];
        for _ in 0..6 {
            let cell = (next() * all.len() as f64) as u32;
            let side = usize::from(next() < 0.5);
            if !marks[1 - side].contains(&cell) {
                marks[side].insert(cell);
            }
        }
        let marks = marks.map(|side| side.into_iter().collect::<Vec<u32>>());
        let marks = [&marks[0][..], &marks[1][..]];
        if marks.iter().any(|side| side.is_empty()) {
            continue;
        }
        let second: BTreeSet<u32> = min_cut(&graph, &all, marks).unwrap().into_iter().collect();
        assert!(marks[0].iter().all(|cell| !second.contains(cell)), "{seed}");
        assert!(marks[1].iter().all(|cell| second.contains(cell)), "{seed}");
        let unit = units(&graph);
        let mut cut = 0;
        for cell in all.iter().filter(|cell| !second.contains(cell)) {
            let across = graph.neighbours(*cell as usize);
            let across = across.filter(|(other, _)| second.contains(&(*other as u32)));
            cut += across.map(|(_, weight)| unit(weight)).sum::<u64>();
        }
        assert_eq!(cut, slow_flow(&graph, marks), "{seed}");
    }
}

#[test]
fn a_part_splits_at_its_weakest_border_between_marks_and_heals_again() {
    // a weak column at 10 and a weaker one at 15: marks on both sides of the first alone
    let weight = |[x, _]: [usize; 2], axis: usize| match (x, axis) {
        (10, 0) => 0.2,
        (15, 0) => 0.1,
        _ => 1.0,
    };
    let graph = grid([20, 6], weight);
    let whole: Vec<i32> = (0..120).map(|cell| if cell / 20 < 5 { 4 } else { 9 }).collect();
    let mut parts = whole.clone();
    assert_eq!(split_part(&graph, &mut parts, 4, [&[3], &[13, 53]]), Ok(10));
    for (cell, &part) in parts.iter().enumerate() {
        let expected = [4, 10][usize::from(cell % 20 > 10)];
        assert_eq!(part, if cell / 20 < 5 { expected } else { 9 }, "{cell}");
    }
    assert_eq!(merge_parts(&mut parts, 4, 10), Ok(()));
    assert_eq!(parts, whole);
    assert_eq!(split_part(&graph, &mut parts, 4, [&[3], &[19]]), Ok(10));
    assert_eq!(cells_of(&parts, 10).len(), 5 * 4, "beyond the weaker column");
}

#[test]
fn what_makes_no_sense_is_refused() {
    let link = |cells, weight| CellGraph::new(3, &[Link { cells, weight }]).unwrap_err();
    assert_eq!(link([0, 3], 0.5), ClusterError::Cell { cell: 3, count: 3 });
    assert_eq!(link([1, 1], 0.5), ClusterError::Loop { cell: 1 });
    assert_eq!(link([0, 1], 1.5), ClusterError::Weight { value: 1.5 });
    assert_eq!(link([0, 1], f64::NAN).to_string(), "a weight is NaN; expected 0 to 1");
    let graph = grid([4, 1], |_, _| 1.0);
    let grow = |most_parts, least_cells| {
        let options = ClusterOptions { most_parts, least_cells };
        ClusterTree::grow(&graph, &options, &mut Silent).unwrap_err()
    };
    assert_eq!((grow(0, 1), grow(1, 0)), (ClusterError::MostParts, ClusterError::LeastCells));
    let split =
        |parts: &mut [i32], part, marks| split_part(&graph, parts, part, marks).unwrap_err();
    let mut parts = vec![1, 1, 2, 2];
    assert_eq!(
        split(&mut parts[..3], 1, [&[0], &[1]]),
        ClusterError::PartCount { found: 3, expected: 4 }
    );
    assert_eq!(split(&mut parts, 3, [&[0], &[1]]), ClusterError::Part { part: 3 });
    assert_eq!(split(&mut parts, 1, [&[0], &[]]), ClusterError::NoMark);
    assert_eq!(split(&mut parts, 1, [&[0], &[2]]), ClusterError::Mark { cell: 2 });
    assert_eq!(split(&mut parts, 1, [&[0, 1], &[1]]), ClusterError::TwoMarks { cell: 1 });
    assert_eq!(split(&mut [1, 1, 1, i32::MAX], 1, [&[0], &[1]]), ClusterError::NoNumber);
    assert_eq!(merge_parts(&mut parts, 1, 5), Err(ClusterError::Part { part: 5 }));
    assert_eq!(parts, [1, 1, 2, 2]);
}

#[test]
fn growing_ends_when_the_watch_says_so() {
    struct After(usize);
    impl Watch for After {
        fn step(&mut self, _: Phase, done: f64, _: Option<f64>) -> ControlFlow<()> {
            assert!((0.0..=1.0).contains(&done));
            self.0 -= 1;
            if self.0 == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }
    let graph = grid([30, 30], |_, _| 1.0);
    let found = ClusterTree::grow(&graph, &ClusterOptions::default(), &mut After(5));
    assert_eq!(found, Err(ClusterError::Cancelled(Cancelled)));
}
