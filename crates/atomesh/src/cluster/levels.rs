//! Coarser and coarser graphs, each of about half as many nodes.

use super::CellGraph;

/// A graph of nodes, each of them one cell or several, with its normalised Laplacian 1 − D^(−1/2) W D^(−1/2), W the weights
/// and D the degrees (Shi & Malik 2000).
pub(super) struct Level {
    starts: Vec<usize>,
    neighbours: Vec<u32>,
    weights: Vec<f64>,
    /// The weights of each node's cells, those among themselves included.
    degrees: Vec<f64>,
    /// D^(−1/2) W D^(−1/2), of each node with each of its neighbours.
    entries: Vec<f64>,
    /// The Laplacian's diagonal: the share of each node's weights that leads out of it.
    diagonal: Vec<f64>,
}

impl Level {
    /// The finest level: each cell is a node.
    pub fn of(graph: &CellGraph) -> Self {
        let count = graph.cell_count();
        let starts = (0..count).map(|cell| graph.places(cell).start);
        let neighbours = |cell| graph.neighbours(cell).map(|(other, _)| other as u32);
        Self::new(
            starts.chain([graph.half_link_count()]).collect(),
            (0..count).flat_map(neighbours).collect(),
            graph.weights().to_vec(),
            (0..count).map(|cell| graph.degree(cell)).collect(),
        )
    }

    fn new(starts: Vec<usize>, neighbours: Vec<u32>, weights: Vec<f64>, degrees: Vec<f64>) -> Self {
        let scales: Vec<f64> = degrees.iter().map(|degree| 1.0 / degree.sqrt()).collect();
        let mut entries = Vec::with_capacity(weights.len());
        let mut diagonal = Vec::with_capacity(degrees.len());
        for (node, scale) in scales.iter().enumerate() {
            let own = starts[node]..starts[node + 1];
            let others = neighbours[own.clone()].iter().map(|&other| scales[other as usize]);
            entries.extend(others.zip(&weights[own.clone()]).map(|(other, w)| w * scale * other));
            diagonal.push(weights[own].iter().sum::<f64>() / degrees[node]);
        }
        Self { starts, neighbours, weights, degrees, entries, diagonal }
    }

    /// The number of nodes.
    pub fn node_count(&self) -> usize {
        self.degrees.len()
    }

    /// The square roots of the degrees: the Laplacian's eigenvector of 0.
    pub fn roots(&self) -> Vec<f64> {
        self.degrees.iter().map(|degree| degree.sqrt()).collect()
    }

    /// The neighbours of a node with the weight to each.
    fn neighbours(&self, node: usize) -> impl Iterator<Item = (usize, f64)> {
        let own = self.starts[node]..self.starts[node + 1];
        let others = self.neighbours[own.clone()].iter().map(|&other| other as usize);
        others.zip(self.weights[own].iter().copied())
    }

    /// The sum of a node's neighbours' values, each times its entry.
    fn gathered(&self, node: usize, y: &[f64]) -> f64 {
        let own = self.starts[node]..self.starts[node + 1];
        let others = self.neighbours[own.clone()].iter().zip(&self.entries[own]);
        others.map(|(&other, entry)| entry * y[other as usize]).sum()
    }

    /// The product of the Laplacian and a vector.
    pub fn apply(&self, y: &[f64]) -> Vec<f64> {
        (0..y.len()).map(|node| self.diagonal[node] * y[node] - self.gathered(node, y)).collect()
    }

    /// One sweep of Gauss & Seidel towards the y of which the product is `right`; backward from the last node to the first.
    pub fn sweep(&self, right: &[f64], y: &mut [f64], backward: bool) {
        let count = y.len();
        for at in 0..count {
            let node = if backward { count - 1 - at } else { at };
            y[node] = (right[node] + self.gathered(node, y)) / self.diagonal[node];
        }
    }

    /// The node of the coarser level that each node goes to: nodes that most of their weights hold together, two or more.
    ///
    /// One after another each node takes the free neighbour to which it is tied most, by w/d₁ + w/d₂ (Dhillon, Guan &
    /// Kulis 2007); one without a free neighbour joins the node of the neighbour to which it is tied most.
    fn pairs(&self) -> (Vec<u32>, usize) {
        const FREE: u32 = u32::MAX;
        let mut of_nodes = vec![FREE; self.node_count()];
        let mut count = 0;
        let best = |node: usize, is_wanted: &dyn Fn(usize) -> bool| {
            let mut best = (0.0, None);
            for (other, weight) in self.neighbours(node) {
                let tie = weight / self.degrees[node] + weight / self.degrees[other];
                if tie > best.0 && is_wanted(other) {
                    best = (tie, Some(other));
                }
            }
            best.1
        };
        for node in 0..self.node_count() {
            if of_nodes[node] == FREE
                && let Some(other) = best(node, &|other| of_nodes[other] == FREE)
            {
                (of_nodes[node], of_nodes[other]) = (count, count);
                count += 1;
            }
        }
        for node in 0..self.node_count() {
            if of_nodes[node] == FREE {
                let host = best(node, &|other| of_nodes[other] != FREE);
                of_nodes[node] = match host {
                    Some(host) => of_nodes[host],
                    None => {
                        count += 1;
                        count - 1
                    }
                };
            }
        }
        (of_nodes, count as usize)
    }

    /// The graph of these pairs.
    fn of_pairs(&self, to: &[u32], count: usize) -> Self {
        let mut members = vec![Vec::new(); count];
        to.iter().enumerate().for_each(|(node, &coarse)| members[coarse as usize].push(node));
        let (mut starts, mut neighbours, mut weights) = (vec![0], Vec::new(), Vec::new());
        // where a neighbour of the node at hand stands among its own, if it is one
        let mut places = vec![usize::MAX; count];
        for (own, nodes) in members.iter().enumerate() {
            let start = neighbours.len();
            for (other, weight) in nodes.iter().flat_map(|&node| self.neighbours(node)) {
                let other = to[other] as usize;
                if other == own {
                    continue;
                }
                if places[other] == usize::MAX || places[other] < start {
                    places[other] = neighbours.len();
                    neighbours.push(other as u32);
                    weights.push(0.0);
                }
                weights[places[other]] += weight;
            }
            starts.push(neighbours.len());
        }
        let degree = |nodes: &Vec<usize>| nodes.iter().map(|&node| self.degrees[node]).sum();
        Self::new(starts, neighbours, weights, members.iter().map(degree).collect())
    }

    /// The next coarser level, of pairs of pairs, and the way there; `None` where no two nodes hold together.
    pub fn coarser(&self) -> Option<(Self, Coarsening)> {
        let (to, count) = self.pairs();
        let pairs = self.of_pairs(&to, count);
        let (further, count) = pairs.pairs();
        let coarse = pairs.of_pairs(&further, count);
        let to: Vec<u32> = to.into_iter().map(|pair| further[pair as usize]).collect();
        let share =
            |(node, &to): (usize, &u32)| (self.degrees[node] / coarse.degrees[to as usize]).sqrt();
        let shares = to.iter().enumerate().map(share).collect();
        let is_coarser = coarse.node_count() < self.node_count();
        is_coarser.then_some((coarse, Coarsening { to, shares }))
    }
}

/// The way from a level to the next coarser one, whose Laplacian is this one's on vectors that come from there.
pub(super) struct Coarsening {
    /// The coarse node of each node.
    to: Vec<u32>,
    /// √(d / d of the coarse node): what is constant stays so.
    shares: Vec<f64>,
}

impl Coarsening {
    /// A vector of the finer level, of one of the coarser.
    pub fn refined(&self, coarse: &[f64]) -> Vec<f64> {
        self.to.iter().zip(&self.shares).map(|(&to, share)| share * coarse[to as usize]).collect()
    }

    /// The transposed product: a vector of the coarser level, of `count` nodes, of one of the finer.
    pub fn gathered(&self, fine: &[f64], count: usize) -> Vec<f64> {
        let mut coarse = vec![0.0; count];
        for ((&to, share), value) in self.to.iter().zip(&self.shares).zip(fine) {
            coarse[to as usize] += share * value;
        }
        coarse
    }
}
