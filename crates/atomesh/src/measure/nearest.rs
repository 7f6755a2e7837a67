//! The facet nearest to a point, and whether one passes near it along a feature.
//!
//! A tree of boxes over the facets, halved at the median along the longest axis: exact, and as fast for a graded mesh as
//! for a uniform one. Facets are segments in 2-D and triangles in 3-D: the simplices of D corners.

use super::faces::faces;
use crate::geometry::linear::solve;
use crate::geometry::{Bounds, Point, difference, dot};
use crate::mesh::Mesh;
use crate::parallel::prelude::*;

/// The most facets of a leaf.
const LEAF: usize = 4;

/// The least number of facets whose two halves are built in parallel.
const PARALLEL: usize = 1 << 10;

/// A box and the facets in it: those of its two parts. The first part is the next node.
#[derive(Clone)]
struct Node<const D: usize> {
    bounds: Bounds<D>,
    start: usize,
    end: usize,
    /// The second part; 0 in a leaf.
    second: usize,
}

/// The limits within which a facet follows a feature.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// The greatest distance.
    pub distance: f64,
    /// The square of the sine of the greatest angle to the feature's tangent.
    pub sine_squared: f64,
}

/// All distinct facets of a mesh, for nearest-facet questions.
pub(super) struct FacetTree<'a, const D: usize> {
    points: &'a [Point<D>],
    facets: Vec<[u32; D]>,
    nodes: Vec<Node<D>>,
}

impl<'a, const D: usize> FacetTree<'a, D> {
    /// A tree over the facets of `mesh`. Cost: O(n log n) in facets.
    pub fn new(mesh: &'a Mesh<D>) -> Self {
        Self::of(mesh.points(), faces::<D, D>(mesh))
    }

    /// A tree over facets given by their corners. Cost: O(n log n).
    pub fn of(points: &'a [Point<D>], facets: Vec<[u32; D]>) -> Self {
        let mut placed: Vec<Placed<D>> = facets
            .into_par_iter()
            .map(|facet| {
                let bounds = bounds_of(&facet.map(|c| points[c as usize]));
                let middle = std::array::from_fn(|k| bounds.min[k] + bounds.max[k]);
                Placed { facet, middle }
            })
            .collect();
        let mut nodes = Vec::new();
        if !placed.is_empty() {
            let empty = Bounds { min: [0.0; D], max: [0.0; D] };
            let none = Node { bounds: empty, start: 0, end: 0, second: 0 };
            nodes.resize(node_counts(placed.len()).0, none);
            build(points, &mut placed, 0, 0, &mut nodes);
        }
        Self { points, facets: placed.into_iter().map(|p| p.facet).collect(), nodes }
    }

    /// The distance from `p` to the nearest facet, infinite if there is none, and whether a facet
    /// passes as near as `near` says, its normal along the unit vector `normal`.
    pub fn query(&self, p: &Point<D>, normal: &Point<D>, near: Near) -> (f64, bool) {
        let (mut best, mut hit) = (f64::INFINITY, false);
        let mut open = vec![];
        if let Some(root) = self.nodes.first() {
            open.push((box_distance(p, &root.bounds), 0));
        }
        while let Some((distance, node)) = open.pop() {
            // without a hit, facets up to the limit matter though a nearer one is known
            let enough = if hit { best } else { best.max(near.distance) };
            if distance > enough {
                continue;
            }
            let Node { start, end, second, .. } = self.nodes[node];
            if second == 0 {
                for facet in &self.facets[start..end] {
                    let corners = facet.map(|c| self.points[c as usize]);
                    let least = box_distance(p, &bounds_of(&corners));
                    let may_hit = !hit
                        && least <= near.distance
                        && tangent_share(normal, &corners) <= near.sine_squared;
                    if least <= best || may_hit {
                        let distance = simplex_distance(p, corners, D);
                        best = best.min(distance);
                        hit |= may_hit && distance <= near.distance;
                    }
                }
            } else {
                let parts = [node + 1, second].map(|n| (box_distance(p, &self.nodes[n].bounds), n));
                let nearer = usize::from(parts[1].0 < parts[0].0);
                open.push(parts[1 - nearer]);
                open.push(parts[nearer]);
            }
        }
        (best, hit)
    }
}

/// A facet and twice the middle of its box.
struct Placed<const D: usize> {
    facet: [u32; D],
    middle: Point<D>,
}

/// How many nodes a tree over `count` facets has, and one over `count + 1`.
///
/// Parts of one depth differ by at most one facet, so that two numbers a depth tell all.
fn node_counts(count: usize) -> (usize, usize) {
    if count < LEAF {
        return (1, 1);
    }
    let (half, half_and_one) = node_counts(count / 2);
    let odd = 1 + half + half_and_one;
    match count % 2 {
        _ if count == LEAF => (1, odd),
        0 => (1 + 2 * half, odd),
        _ => (odd, 1 + 2 * half_and_one),
    }
}

/// Makes the nodes over `placed`, whose first facet is number `start`, in `nodes`, whose first is number
/// `node`; puts the facets in order.
fn build<const D: usize>(
    points: &[Point<D>],
    placed: &mut [Placed<D>],
    start: usize,
    node: usize,
    nodes: &mut [Node<D>],
) {
    let mut bounds = bounds_of(&placed[0].facet.map(|c| points[c as usize]));
    for p in &placed[1..] {
        bounds.join(&bounds_of(&p.facet.map(|c| points[c as usize])));
    }
    let end = start + placed.len();
    if placed.len() <= LEAF {
        nodes[0] = Node { bounds, start, end, second: 0 };
        return;
    }
    let axis = bounds.longest_axis();
    let half = placed.len() / 2;
    placed.select_nth_unstable_by(half, |a, b| a.middle[axis].total_cmp(&b.middle[axis]));
    let (first, second) = placed.split_at_mut(half);
    let first_count = node_counts(half).0;
    nodes[0] = Node { bounds, start, end, second: node + 1 + first_count };
    let (first_nodes, second_nodes) = nodes[1..].split_at_mut(first_count);
    let parallel = end - start > PARALLEL;
    let mut build_first = || build(points, first, start, node + 1, first_nodes);
    let mut build_second =
        || build(points, second, start + half, node + 1 + first_count, second_nodes);
    if parallel {
        rayon::join(build_first, build_second);
    } else {
        build_first();
        build_second();
    }
}

/// The box of a facet.
fn bounds_of<const D: usize>(corners: &[Point<D>; D]) -> Bounds<D> {
    let mut bounds = Bounds { min: corners[0], max: corners[0] };
    corners[1..].iter().for_each(|p| bounds.include(p));
    bounds
}

/// The distance from a point to a box.
fn box_distance<const D: usize>(p: &Point<D>, bounds: &Bounds<D>) -> f64 {
    let v = difference(p, &bounds.clamp(p));
    dot(&v, &v).sqrt()
}

/// The inner products of edges from corner 0 of the first `count` corners, and those edges.
fn gram<const D: usize>(corners: &[Point<D>; D], count: usize) -> ([[f64; D]; D], [Point<D>; D]) {
    let mut edges = [[0.0; D]; D];
    for i in 1..count {
        edges[i - 1] = difference(&corners[i], &corners[0]);
    }
    (std::array::from_fn(|i| std::array::from_fn(|j| dot(&edges[i], &edges[j]))), edges)
}

/// The distance from a point to the simplex of the first `count` corners.
///
/// The point is projected onto the simplex's plane. Where a barycentric coordinate is negative the
/// nearest point is on a face that lacks such a corner; a flat simplex is all faces.
fn simplex_distance<const D: usize>(p: &Point<D>, corners: [Point<D>; D], count: usize) -> f64 {
    let mut rest = difference(p, &corners[0]);
    if count == 1 {
        return dot(&rest, &rest).sqrt();
    }
    let (products, edges) = gram(&corners, count);
    let mut shares: [[f64; 1]; D] = std::array::from_fn(|i| [dot(&edges[i], &rest)]);
    let flat = solve(count - 1, products, &mut shares) == 0.0;
    let first = 1.0 - shares[..count - 1].iter().map(|s| s[0]).sum::<f64>();
    let outside = |i: usize| flat || if i == 0 { first < 0.0 } else { shares[i - 1][0] < 0.0 };
    if (0..count).any(outside) {
        let without = |i: usize| {
            let mut face = corners;
            face.swap(i, count - 1);
            simplex_distance(p, face, count - 1)
        };
        return (0..count).filter(|&i| outside(i)).map(without).fold(f64::INFINITY, f64::min);
    }
    for i in 0..count - 1 {
        for k in 0..D {
            rest[k] -= shares[i][0] * edges[i][k];
        }
    }
    dot(&rest, &rest).sqrt()
}

/// The squared length of the part of the unit vector `normal` that lies in the facet's plane: the
/// squared sine of its angle to the facet's normal. 1 for a flat facet, which has none.
fn tangent_share<const D: usize>(normal: &Point<D>, corners: &[Point<D>; D]) -> f64 {
    let (products, edges) = gram(corners, D);
    let along: [f64; D] = std::array::from_fn(|i| dot(&edges[i], normal));
    let mut shares = along.map(|a| [a]);
    if solve(D - 1, products, &mut shares) == 0.0 {
        return 1.0;
    }
    (0..D - 1).map(|i| shares[i][0] * along[i]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The nearest of many points spread over the simplex: an upper bound, and near.
    fn dense<const D: usize>(p: &Point<D>, corners: &[Point<D>; D], parts: usize) -> f64 {
        let mut least = f64::INFINITY;
        for code in 0..(parts + 1).pow(D as u32 - 1) {
            let mut rest = code;
            let counts: [usize; D] = std::array::from_fn(|_| {
                let digit = rest % (parts + 1);
                rest /= parts + 1;
                digit
            });
            let used: usize = counts[..D - 1].iter().sum();
            if used > parts {
                continue;
            }
            let share = |i: usize| {
                let count = if i == D - 1 { parts - used } else { counts[i] };
                count as f64 / parts as f64
            };
            let q: Point<D> =
                std::array::from_fn(|k| (0..D).map(|i| share(i) * corners[i][k]).sum());
            least = least.min(crate::geometry::distance_squared(p, &q).sqrt());
        }
        least
    }

    proptest! {
        #[test]
        fn no_point_of_a_facet_is_nearer(
            p2 in prop::array::uniform2(-2.0..2.0f64),
            s2 in prop::array::uniform2(prop::array::uniform2(-1.0..1.0f64)),
            p3 in prop::array::uniform3(-2.0..2.0f64),
            s3 in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
        ) {
            // edges are up to √12 long: points of the spread are at most half of 1/60 of that apart
            for (fast, slow) in [
                (simplex_distance(&p2, s2, 2), dense(&p2, &s2, 60)),
                (simplex_distance(&p3, s3, 3), dense(&p3, &s3, 60)),
            ] {
                prop_assert!(fast <= slow + 1e-12 && slow - fast < 0.06, "{fast} {slow}");
            }
        }

        #[test]
        fn the_tangent_share_is_the_sine_of_the_angle_between_normals(
            s in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
            n in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let (u, v) = (difference(&s[1], &s[0]), difference(&s[2], &s[0]));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let lengths = dot(&normal, &normal) * dot(&n, &n);
            prop_assume!(lengths > 1e-4);
            let n = n.map(|x| x / dot(&n, &n).sqrt());
            let cosine_squared = dot(&normal, &n).powi(2) / dot(&normal, &normal);
            prop_assert!((tangent_share(&n, &s) - (1.0 - cosine_squared)).abs() < 1e-9);
        }
    }

    #[test]
    fn flat_facets_are_their_edges_and_have_no_normal() {
        let line = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
        assert_eq!(simplex_distance(&[2.0, 2.0, 0.0], line, 3), 2.0);
        assert_eq!(simplex_distance(&[5.0, 0.0, 0.0], line, 3), 2.0);
        assert_eq!(tangent_share(&[0.0, 0.0, 1.0], &line), 1.0);
        let point = [[1.0, 1.0]; 2];
        assert_eq!(simplex_distance(&[4.0, 5.0], point, 2), 5.0);
    }

    /// A fan of cells over seeded points; the tree does not ask for a sound mesh.
    fn soup<const D: usize>(count: usize, seed: u64) -> Mesh<D> {
        use rand::{RngExt, SeedableRng};
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut points = Vec::new();
        for _ in 0..count {
            let middle: Point<D> = std::array::from_fn(|_| random.random::<f64>() * 20.0);
            for _ in 0..=D {
                points.push(std::array::from_fn(|k| middle[k] + random.random::<f64>()));
            }
        }
        let corners = (0..points.len() as u32).collect();
        Mesh::new(points, corners).unwrap()
    }

    fn the_tree_finds_what_a_full_search_finds<const D: usize>() {
        let near = Near { distance: 1.0, sine_squared: 0.117 };
        for seed in 0..5 {
            let mesh = soup::<D>(300, seed);
            let tree = FacetTree::new(&mesh);
            assert_eq!(tree.facets.len(), 300 * (D + 1));
            let mut normal = [0.0; D];
            normal[0] = 1.0;
            let mut hits = 0;
            for p in soup::<D>(60, seed + 100).points() {
                let (mut best, mut hit) = (f64::INFINITY, false);
                for facet in faces::<D, D>(&mesh) {
                    let corners = facet.map(|c| mesh.points()[c as usize]);
                    let distance = simplex_distance(p, corners, D);
                    best = best.min(distance);
                    hit |= distance <= near.distance
                        && tangent_share(&normal, &corners) <= near.sine_squared;
                }
                assert_eq!(tree.query(p, &normal, near), (best, hit));
                hits += usize::from(hit);
            }
            assert!(hits > 0, "nothing to find");
        }
    }

    #[test]
    fn the_tree_finds_what_a_full_search_finds_in_2_and_3_dimensions() {
        the_tree_finds_what_a_full_search_finds::<2>();
        the_tree_finds_what_a_full_search_finds::<3>();
    }
}
