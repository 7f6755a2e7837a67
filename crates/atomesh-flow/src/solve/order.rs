//! The order of elimination: nested dissection by the places of blocks (George 1973).
//!
//! The blocks are halved along the longest extent of their places. Those of one half that are coupled to the other are the
//! separator, eliminated last; the halves are ordered in the same way. Assumes that coupled blocks are near each
//! other: otherwise the order is still valid, but fill grows. Cost: O(n log n).

use atomesh::geometry::Point;

use super::sparse::Sparse;

/// The most blocks of a part that is not halved.
const LEAF: usize = 8;

/// The graph of coupled blocks; each edge is stored at both ends.
struct Graph {
    starts: Vec<usize>,
    others: Vec<u32>,
}

impl Graph {
    fn of(matrix: &Sparse, block: usize) -> Self {
        let count = matrix.row_count() / block;
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        let mut row: Vec<u32> = Vec::new();
        for own in 0..count {
            row.clear();
            for inner in 0..block {
                let (columns, _) = matrix.row(own * block + inner);
                row.extend(columns.iter().map(|&column| column / block as u32));
                row.dedup();
            }
            row.sort_unstable();
            row.dedup();
            let others = row.iter().filter(|&&other| other as usize != own);
            pairs.extend(others.map(|&other| (own as u32, other)));
        }
        let mut starts = vec![0_usize; count + 1];
        for &(a, b) in &pairs {
            starts[a as usize + 1] += 1;
            starts[b as usize + 1] += 1;
        }
        for at in 0..count {
            starts[at + 1] += starts[at];
        }
        let mut next = starts.clone();
        let mut others = vec![0; 2 * pairs.len()];
        for (a, b) in pairs {
            for (from, to) in [(a, b), (b, a)] {
                others[next[from as usize]] = to;
                next[from as usize] += 1;
            }
        }
        Self { starts, others }
    }

    /// The graph of AᵀA, whose Cholesky factor bounds the factors of A with row pivots (George & Ng 1985).
    fn squared(&self) -> Self {
        let (mut starts, mut others) = (vec![0], Vec::new());
        let mut seen = vec![u32::MAX; self.starts.len() - 1];
        for own in 0..self.starts.len() as u32 - 1 {
            seen[own as usize] = own;
            for &middle in self.beside(own) {
                for &other in std::iter::once(&middle).chain(self.beside(middle)) {
                    if std::mem::replace(&mut seen[other as usize], own) != own {
                        others.push(other);
                    }
                }
            }
            starts.push(others.len());
        }
        Self { starts, others }
    }

    fn beside(&self, block: u32) -> &[u32] {
        &self.others[self.starts[block as usize]..self.starts[block as usize + 1]]
    }
}

/// The order of elimination, and the cost of the factors.
#[derive(Clone, Debug)]
pub struct Elimination {
    /// The unknowns in the order of elimination, those of a block together.
    pub order: Vec<u32>,
    /// The number of values of a factor; infinite above the limit.
    pub values: f64,
    /// The number of multiplications to compute it.
    pub work: f64,
}

impl Elimination {
    /// Orders the unknowns of a square matrix and counts the values of the factor, up to `limit`: those of a Cholesky
    /// factor, or, with row pivots, an upper bound for each of the factors L and U.
    ///
    /// # Panics
    /// If there is not one place for each block.
    pub fn new<const D: usize>(
        matrix: &Sparse,
        block: usize,
        places: &[Point<D>],
        has_pivots: bool,
        limit: f64,
    ) -> Self {
        assert_eq!(places.len() * block, matrix.row_count(), "a place for each block");
        let mut graph = Graph::of(matrix, block);
        if has_pivots {
            graph = graph.squared();
        }
        let blocks = dissect(&graph, places);
        let size = block as f64;
        let (blocks, counts) = postorder(&graph, blocks, limit / (size * size));
        let sum =
            |power: i32| counts.iter().map(|&count| f64::from(count).powi(power)).sum::<f64>();
        let exceeds = counts.is_empty() && !blocks.is_empty();
        let unknowns = |&own: &u32| (0..block as u32).map(move |inner| own * block as u32 + inner);
        Self {
            order: blocks.iter().flat_map(unknowns).collect(),
            values: if exceeds { f64::INFINITY } else { size * size * sum(1) },
            work: if exceeds { f64::INFINITY } else { size.powi(3) * sum(2) },
        }
    }
}

/// The blocks in a postorder of their elimination tree (Liu 1990), and the number of blocks in each column of the
/// factor; no counts if they sum to more than `limit`. Columns are counted by following the rows' subtrees.
fn postorder(graph: &Graph, blocks: Vec<u32>, limit: f64) -> (Vec<u32>, Vec<u32>) {
    const NONE: u32 = u32::MAX;
    let count = blocks.len();
    let mut rank = vec![0_u32; count];
    for (at, &block) in blocks.iter().enumerate() {
        rank[block as usize] = at as u32;
    }
    let (mut parents, mut seen) = (vec![NONE; count], vec![NONE; count]);
    let mut counts = vec![1_u32; count];
    let mut total = count as f64;
    for (row, &block) in blocks.iter().enumerate() {
        seen[row] = row as u32;
        for &other in graph.beside(block) {
            let mut column = rank[other as usize] as usize;
            while column < row && seen[column] != row as u32 {
                if parents[column] == NONE {
                    parents[column] = row as u32;
                }
                counts[column] += 1;
                total += 1.0;
                seen[column] = row as u32;
                column = parents[column] as usize;
            }
        }
        if total > limit {
            return (blocks, Vec::new());
        }
    }
    let order = depth_first(&parents);
    let of = |at: &u32| blocks[*at as usize];
    (order.iter().map(of).collect(), order.iter().map(|&at| counts[at as usize]).collect())
}

/// A postorder of a forest in which children have lower numbers than parents.
fn depth_first(parents: &[u32]) -> Vec<u32> {
    // filled from the back: the last root first, then its last child, ...
    let mut sizes = vec![1_u32; parents.len()];
    for node in 0..parents.len() {
        if let Some(size) = sizes.get(parents[node] as usize).copied() {
            sizes[parents[node] as usize] = size + sizes[node];
        }
    }
    // the place where the next subtree below a node, or the next root, ends
    let mut ends = vec![0_u32; parents.len()];
    let mut order = vec![0_u32; parents.len()];
    let mut last = parents.len() as u32;
    for node in (0..parents.len()).rev() {
        let end = ends.get_mut(parents[node] as usize).unwrap_or(&mut last);
        let own = *end - 1;
        *end -= sizes[node];
        order[own as usize] = node as u32;
        ends[node] = own;
    }
    order
}

/// Blocks in the order of nested dissection.
fn dissect<const D: usize>(graph: &Graph, places: &[Point<D>]) -> Vec<u32> {
    let mut blocks: Vec<u32> = (0..places.len() as u32).collect();
    let mut side = vec![0_u32; places.len()];
    // parts still to be halved; a separator stays at the end of its part
    let mut parts = Vec::from([(0, blocks.len())]);
    let mut stamp = 0;
    while let Some((start, end)) = parts.pop() {
        if end - start <= LEAF {
            continue;
        }
        let own = &mut blocks[start..end];
        let middle = halve(own, places);
        stamp += 2;
        let [first, second] = separate(graph, own, middle, &mut side, stamp);
        parts.push((start, start + first));
        parts.push((start + first, start + second));
    }
    blocks
}

/// Puts the separator of two halves last: the smaller of the two sets of blocks that touch the other half. Returns where
/// the first half and the second end. `side` then has `stamp` for the first half and `stamp + 1` for the second.
fn separate(
    graph: &Graph,
    own: &mut [u32],
    middle: usize,
    side: &mut [u32],
    stamp: u32,
) -> [usize; 2] {
    for (at, &block) in own.iter().enumerate() {
        side[block as usize] = stamp + u32::from(at >= middle);
    }
    let touching = |half: &[u32], other: u32| -> Vec<u32> {
        let near = |block: &&u32| graph.beside(**block).iter().any(|&n| side[n as usize] == other);
        half.iter().filter(near).copied().collect()
    };
    let (low, high) = own.split_at(middle);
    let (from, to) = (touching(low, stamp + 1), touching(high, stamp));
    let separator = if from.len() < to.len() { from } else { to };
    for &block in &separator {
        side[block as usize] = 0;
    }
    let of_side = |wanted: u32| -> Vec<u32> {
        own.iter().copied().filter(|&block| side[block as usize] == wanted).collect()
    };
    let (low, high) = (of_side(stamp), of_side(stamp + 1));
    let (first, second) = (low.len(), low.len() + high.len());
    own[..first].copy_from_slice(&low);
    own[first..second].copy_from_slice(&high);
    own[second..].copy_from_slice(&separator);
    [first, second]
}

/// Puts the lower half along the longest extent first; returns where the upper one begins.
fn halve<const D: usize>(blocks: &mut [u32], places: &[Point<D>]) -> usize {
    let extent = |axis: usize| {
        let at = blocks.iter().map(|&block| places[block as usize][axis]);
        let (low, high) =
            at.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        high - low
    };
    let extents: [f64; D] = std::array::from_fn(extent);
    let longest = (0..D).max_by(|&a, &b| extents[a].total_cmp(&extents[b])).unwrap_or(0);
    let middle = blocks.len() / 2;
    blocks.select_nth_unstable_by(middle, |&a, &b| {
        let (at, other) = (places[a as usize][longest], places[b as usize][longest]);
        at.total_cmp(&other).then(a.cmp(&b))
    });
    middle
}
