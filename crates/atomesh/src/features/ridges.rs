//! How facets are connected. A *ridge* is a point (2-D) or an edge (3-D) of facets.

/// A ridge as one number: its point, or its two ends, the lower first.
type Key = u64;

/// The facets that meet at each ridge of some facets. A facet is named by its place among them.
pub(super) struct Ridges<const D: usize> {
    /// The facets at ridges: key, facet, and the number of the facet's corner off the ridge; ascending.
    meets: Vec<(Key, u32, u8)>,
    /// For each facet and corner: where in `meets` the run of its ridge begins, and its length.
    runs: Vec<(u32, u32)>,
    facet_count: usize,
}

impl<const D: usize> Ridges<D> {
    /// The ridges of facets with ascending corners.
    pub fn new(facets: &[[u32; D]]) -> Self {
        let mut meets: Vec<(Key, u32, u8)> = Vec::with_capacity(facets.len() * D);
        for (at, corners) in facets.iter().enumerate() {
            for opposite in 0..D {
                meets.push((key(corners, opposite), at as u32, opposite as u8));
            }
        }
        meets.sort_unstable();
        let mut runs = vec![(0, 0); facets.len() * D];
        let mut start = 0;
        for run in meets.chunk_by(|a, b| a.0 == b.0) {
            for (_, facet, opposite) in run {
                runs[*facet as usize * D + usize::from(*opposite)] =
                    (start as u32, run.len() as u32);
            }
            start += run.len();
        }
        Self { meets, runs, facet_count: facets.len() }
    }

    /// How many facets meet at the ridge of a facet opposite to a corner.
    pub fn count(&self, facet: u32, opposite: usize) -> usize {
        self.runs[facet as usize * D + opposite].1 as usize
    }

    /// The ridge of a facet opposite to a corner, as a number.
    pub fn key(&self, facet: u32, opposite: usize) -> Key {
        self.meets[self.runs[facet as usize * D + opposite].0 as usize].0
    }

    /// For each corner of a facet, the facet that continues it over the opposite ridge, and the number of that facet's
    /// corner off the ridge; `None` where the facet is alone or more than two meet.
    pub fn neighbours(&self, facet: u32) -> impl Iterator<Item = Option<(u32, u8)>> + '_ {
        (0..D).map(move |opposite| {
            let (start, count) = self.runs[facet as usize * D + opposite];
            let run = &self.meets[start as usize..(start + count) as usize];
            match run {
                [a, b] if a.1 == facet => Some((b.1, b.2)),
                [a, _] => Some((a.1, a.2)),
                _ => None,
            }
        })
    }

    /// The facets of each piece, ascending: facets connected over ridges where exactly two meet. Pieces come by their
    /// lowest facet.
    pub fn pieces(&self) -> Vec<Vec<u32>> {
        let mut piece_of = vec![false; self.facet_count];
        let mut pieces = Vec::new();
        for first in 0..self.facet_count as u32 {
            if std::mem::replace(&mut piece_of[first as usize], true) {
                continue;
            }
            let mut piece = vec![first];
            let mut done = 0;
            while done < piece.len() {
                for (next, _) in self.neighbours(piece[done]).flatten() {
                    if !std::mem::replace(&mut piece_of[next as usize], true) {
                        piece.push(next);
                    }
                }
                done += 1;
            }
            piece.sort_unstable();
            pieces.push(piece);
        }
        pieces
    }

    /// The ridges where more than two facets meet, as their points.
    pub fn intersections(&self) -> Vec<Vec<u32>> {
        let crowded = self.meets.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() > 2);
        crowded.map(|run| points::<D>(run[0].0)).collect()
    }
}

/// The ridge of a facet opposite to a corner; corners ascend.
pub(super) fn key<const D: usize>(corners: &[u32; D], opposite: usize) -> Key {
    (0..D).filter(|&k| k != opposite).fold(0, |key, k| key << 32 | Key::from(corners[k]))
}

/// The points of a ridge.
fn points<const D: usize>(key: Key) -> Vec<u32> {
    (1..D).rev().map(|k| (key >> (32 * (k - 1))) as u32).collect()
}
