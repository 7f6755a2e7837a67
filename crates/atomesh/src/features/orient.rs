//! Turning the facets of a piece one way.

use super::ridges::Ridges;
use crate::geometry::{Point, lexicographic};
use crate::mesh::Mesh;

/// The facets of a piece, turned and in order, and whether their normals agree.
pub(super) struct Oriented<const D: usize> {
    pub facets: Vec<[u32; D]>,
    pub orientable: bool,
}

/// A piece of the facets `all`, whose corners ascend.
pub(super) struct Piece<'a, const D: usize> {
    pub mesh: &'a Mesh<D>,
    pub all: &'a [[u32; D]],
    pub ridges: &'a Ridges<D>,
    /// The places of the piece's facets among all, ascending.
    pub facets: &'a [u32],
}

impl<const D: usize> Piece<'_, D> {
    /// The facets as [`super::Feature::facets`] promises them.
    pub fn oriented(&self) -> Oriented<D> {
        if D == 2 {
            return Oriented { facets: self.line(), orientable: true };
        }
        let (turned, orientable) = self.turns();
        let mut facets: Vec<[u32; D]> = (self.facets.iter().zip(turned))
            .map(|(&facet, turned)| turned_if(self.corners(facet), turned))
            .collect();
        if self.is_downward(&facets) {
            facets.iter_mut().for_each(|facet| *facet = turned_if(*facet, true));
        }
        Oriented { facets, orientable }
    }

    fn corners(&self, facet: u32) -> [u32; D] {
        self.all[facet as usize]
    }

    /// The facets of a polyline (2-D), one after another from an end.
    fn line(&self) -> Vec<[u32; D]> {
        let point = |corner: u32| &self.mesh.points()[corner as usize];
        // the corner of an end, the facet there, and the number of that corner in it
        let mut ends = self.facets.iter().flat_map(|&facet| {
            let neighbours = self.ridges.neighbours(facet).enumerate();
            let free = neighbours.filter(|(_, next)| next.is_none());
            // the ridge opposite to a corner is the other corner
            free.map(move |(opposite, _)| (facet, 1 - opposite))
        });
        let at = |&(facet, corner): &(u32, usize)| self.corners(facet)[corner];
        let first = ends.by_ref().next();
        let (first, mut tail) = match (first, ends.next()) {
            (Some(a), Some(b)) => {
                let order = lexicographic(point(at(&a)), point(at(&b))).then(at(&a).cmp(&at(&b)));
                if order.is_le() { a } else { b }
            }
            _ => (self.facets[0], 0),
        };
        let (mut facet, mut line) = (first, Vec::with_capacity(self.facets.len()));
        loop {
            line.push(turned_if(self.corners(facet), tail == 1));
            match self.ridges.neighbours(facet).nth(tail).flatten() {
                Some((next, off)) if next != first && line.len() < self.facets.len() => {
                    (facet, tail) = (next, 1 - usize::from(off));
                }
                _ => return line,
            }
        }
    }

    /// Which facets are turned against the order of their corners so that all agree with the first, and
    /// whether they then agree everywhere.
    fn turns(&self) -> (Vec<bool>, bool) {
        let local = |facet: u32| self.facets.binary_search(&facet).unwrap_or(0);
        let mut turned: Vec<Option<bool>> = vec![None; self.facets.len()];
        turned[0] = Some(false);
        let (mut queue, mut done, mut orientable) = (vec![self.facets[0]], 0, true);
        while done < queue.len() {
            let facet = queue[done];
            done += 1;
            let own = turned[local(facet)].unwrap_or(false);
            for (opposite, next) in self.ridges.neighbours(facet).enumerate() {
                let Some((next, off)) = next else { continue };
                // the side opposite to a corner runs up or down by the parity of the corner's number; two
                // facets agree if they run along their ridge against each other
                let agree = (opposite + usize::from(off)) % 2 == 1;
                let wanted = own == agree;
                match turned[local(next)] {
                    Some(found) => orientable &= found == wanted,
                    None => {
                        turned[local(next)] = Some(wanted);
                        queue.push(next);
                    }
                }
            }
        }
        (turned.into_iter().map(|turned| turned.unwrap_or(false)).collect(), orientable)
    }

    /// Whether the sum of normals is negative along the axis where it is longest.
    fn is_downward(&self, facets: &[[u32; D]]) -> bool {
        let mut sum: Point<D> = [0.0; D];
        for facet in facets {
            let normal = self.mesh.facet_normal(facet);
            (0..D).for_each(|k| sum[k] += normal[k]);
        }
        let longest = sum.into_iter().fold(
            0.0,
            |longest: f64, x| {
                if x.abs() > longest.abs() { x } else { longest }
            },
        );
        longest < 0.0
    }
}

fn turned_if<const D: usize>(mut facet: [u32; D], turned: bool) -> [u32; D] {
    if turned {
        facet.swap(D - 2, D - 1);
    }
    facet
}
