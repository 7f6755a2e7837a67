//! Disjoint sets of numbers.

/// Disjoint sets of the numbers 0, 1, 2 …; the least of a set is its root.
#[derive(Clone, Debug, Default)]
pub struct Sets(Vec<u32>);

impl Sets {
    /// So many sets of one number each.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// No sets, with room for so many numbers.
    pub fn with_capacity(count: usize) -> Self {
        Self(Vec::with_capacity(count))
    }

    /// Adds a set of the next number.
    pub fn push(&mut self) {
        self.0.push(self.0.len() as u32);
    }

    /// The root of a number's set; shortens the way there.
    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let above = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = above;
            i = above;
        }
        i
    }

    /// The roots of all numbers.
    pub fn roots(&mut self) -> Vec<u32> {
        (0..self.0.len() as u32).map(|i| self.root(i)).collect()
    }

    /// The set of each number, counted from 0 in the order of the sets' roots.
    ///
    /// ```
    /// let mut sets = atomesh::geometry::Sets::new(4);
    /// sets.join(1, 3);
    /// assert_eq!(sets.numbers(), [0, 1, 2, 1]);
    /// ```
    pub fn numbers(&mut self) -> Vec<u32> {
        let roots = self.roots();
        let mut numbers = vec![0; roots.len()];
        let mut count = 0;
        for (i, &root) in roots.iter().enumerate() {
            // the root of a set is its least number, and so counted before
            if root as usize == i {
                numbers[i] = count;
                count += 1;
            } else {
                numbers[i] = numbers[root as usize];
            }
        }
        numbers
    }

    /// Makes the sets of two numbers one.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
