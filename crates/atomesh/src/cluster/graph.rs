//! Cells and the weights between them, as a graph.

use super::ClusterError;

/// Two cells that share a facet, and how much holds them together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// The cells.
    pub cells: [u32; 2],
    /// The weight between them, 0…1; 0 is a wall.
    pub weight: f64,
}

/// Cells of any mesh with weights between neighbours.
///
/// Cells that share a wall, a facet of weight 0, are neighbours too: small parts behind walls join them.
#[derive(Clone, Debug, PartialEq)]
pub struct CellGraph {
    /// Where the neighbours of each cell begin, and where the last ones end.
    starts: Vec<usize>,
    /// The neighbours of each cell, ascending.
    neighbours: Vec<u32>,
    /// The weight to each neighbour.
    weights: Vec<f64>,
}

impl CellGraph {
    /// The graph of so many cells with these links. Weights of several links between the same two cells are added.
    /// Cost: O(links · log links of a cell).
    ///
    /// # Errors
    /// [`ClusterError`] if a link names a cell that does not exist, or one cell twice, or if its weight is not in 0…1.
    pub fn new(cell_count: usize, links: &[Link]) -> Result<Self, ClusterError> {
        for link in links {
            if let Some(&cell) = link.cells.iter().find(|&&cell| cell as usize >= cell_count) {
                return Err(ClusterError::Cell { cell, count: cell_count });
            }
            if link.cells[0] == link.cells[1] {
                return Err(ClusterError::Loop { cell: link.cells[0] });
            }
            if !(0.0..=1.0).contains(&link.weight) {
                return Err(ClusterError::Weight { value: link.weight });
            }
        }
        Ok(Self::from_links(cell_count, links))
    }

    /// The same of links that are known to be right.
    pub(super) fn from_links(cell_count: usize, links: &[Link]) -> Self {
        let mut starts = vec![0; cell_count + 1];
        for cell in links.iter().flat_map(|link| link.cells) {
            starts[cell as usize + 1] += 1;
        }
        for cell in 0..cell_count {
            starts[cell + 1] += starts[cell];
        }
        let mut next = starts.clone();
        let mut to = vec![(0, 0.0); 2 * links.len()];
        for link in links {
            let [a, b] = link.cells;
            for (from, other) in [(a, b), (b, a)] {
                to[next[from as usize]] = (other, link.weight);
                next[from as usize] += 1;
            }
        }
        let mut graph = Self { starts: vec![0], neighbours: Vec::new(), weights: Vec::new() };
        for cell in 0..cell_count {
            let own = &mut to[starts[cell]..starts[cell + 1]];
            own.sort_by_key(|(other, _)| *other); // stable: sums are in the links' order
            for group in own.chunk_by(|a, b| a.0 == b.0) {
                graph.neighbours.push(group[0].0);
                graph.weights.push(group.iter().map(|(_, weight)| weight).sum());
            }
            graph.starts.push(graph.neighbours.len());
        }
        graph
    }

    /// The number of cells.
    pub fn cell_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The neighbours of a cell, ascending, with the weight to each.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn neighbours(&self, cell: usize) -> impl ExactSizeIterator<Item = (usize, f64)> + Clone {
        let own = self.starts[cell]..self.starts[cell + 1];
        let others = self.neighbours[own.clone()].iter().map(|&other| other as usize);
        others.zip(self.weights[own].iter().copied())
    }

    /// The number of neighbours of all cells.
    pub(super) fn half_link_count(&self) -> usize {
        self.neighbours.len()
    }

    /// All weights, those of one cell after those of another.
    pub(super) fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Where a cell's neighbours stand among those of all cells.
    pub(super) fn places(&self, cell: usize) -> std::ops::Range<usize> {
        self.starts[cell]..self.starts[cell + 1]
    }

    /// Sets the weight between two neighbours.
    pub(super) fn set_weight(&mut self, cells: [usize; 2], weight: f64) {
        let [a, b] = cells;
        for (from, other) in [(a, b), (b, a)] {
            let own = self.places(from);
            if let Ok(at) = self.neighbours[own.clone()].binary_search(&(other as u32)) {
                self.weights[own.start + at] = weight;
            }
        }
    }

    /// The sum of a cell's weights.
    pub(super) fn degree(&self, cell: usize) -> f64 {
        self.weights[self.places(cell)].iter().sum()
    }

    /// The graph of some of the cells alone, in their order; ascending. `places` has room for all cells.
    pub(super) fn part(&self, cells: &[u32], places: &mut [u32]) -> Self {
        cells.iter().zip(0..).for_each(|(&cell, place)| places[cell as usize] = place);
        let is_in = |cell: u32| cells.get(places[cell as usize] as usize) == Some(&cell);
        let mut part = Self { starts: vec![0], neighbours: Vec::new(), weights: Vec::new() };
        for &cell in cells {
            for at in self.places(cell as usize) {
                let other = self.neighbours[at];
                if is_in(other) {
                    part.neighbours.push(places[other as usize]);
                    part.weights.push(self.weights[at]);
                }
            }
            part.starts.push(part.neighbours.len());
        }
        part
    }
}
