//! Points, bounds, simplices, exact predicates and space-filling order.
//!
//! Conventions of the whole library: axis 0 is x and the fastest in memory; orientation is positive
//! counter-clockwise with axis 1 up (in space: right-handed); a sample's value sits at its centre.
//! *Lattice coordinates* are sample indices times the grid's step (see [`crate::image::Grid`]), so
//! sample 0 is at 0 and the box reaches to `(n − 1) · step`.

mod bins;
mod bounds;
pub(crate) mod linear;
mod compact;
mod order;
mod point_grid;
mod predicates;
mod sets;
mod simplex;
pub(crate) use bins::Bins;
pub use bounds::Bounds;
pub(crate) use bounds::{all_axes, axes_where};
pub use compact::{BLOCK, compact_order};
pub(crate) use order::shares;
pub use order::{hilbert_order, lexicographic};
pub(crate) use point_grid::{Block, PointGrid};
pub use sets::Sets;
pub use simplex::Simplex;

/// A point, or a vector, in `D` dimensions: x, y (and z).
pub type Point<const D: usize> = [f64; D];

/// The vector from `a` to `b`.
#[inline]
pub fn difference<const D: usize>(b: &Point<D>, a: &Point<D>) -> Point<D> {
    std::array::from_fn(|k| b[k] - a[k])
}

/// The inner product of two vectors.
#[inline]
pub fn dot<const D: usize>(a: &Point<D>, b: &Point<D>) -> f64 {
    let mut sum = 0.0;
    for k in 0..D {
        sum += a[k] * b[k];
    }
    sum
}

/// The vector product.
#[inline(always)]
pub fn cross(a: &Point<3>, b: &Point<3>) -> Point<3> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The squared Euclidean distance of two points.
#[inline]
pub fn distance_squared<const D: usize>(a: &Point<D>, b: &Point<D>) -> f64 {
    let v = difference(a, b);
    dot(&v, &v)
}
