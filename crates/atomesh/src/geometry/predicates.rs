//! Exact signs of orientation and in-sphere determinants, by adaptive precision arithmetic
//! (Shewchuk 1997, crate `robust`).
//!
//! The crate has one function a dimension; this is where they become one. Exact as long as no
//! product under- or overflows: coordinates and their differences within about 1e±60.

use super::{Point, simplex::Simplex};
use robust::{Coord, Coord3D, incircle, insphere, orient2d, orient3d};

fn planar<const D: usize>(p: &Point<D>) -> Coord<f64> {
    Coord { x: p[0], y: p[1] }
}

fn spatial<const D: usize>(p: &Point<D>) -> Coord3D<f64> {
    Coord3D { x: p[0], y: p[1], z: p[2] }
}

/// See [`Simplex::orientation`].
pub(super) fn orientation<const D: usize>(simplex: &Simplex<D>) -> f64 {
    const { assert!(D == 2 || D == 3) };
    let (a, o) = (&simplex.first, &simplex.others);
    if D == 2 {
        orient2d(planar(a), planar(&o[0]), planar(&o[1]))
    } else {
        // Shewchuk's sign is that of a left-handed tetrahedron.
        -orient3d(spatial(a), spatial(&o[0]), spatial(&o[1]), spatial(&o[2]))
    }
}

/// See [`Simplex::in_sphere`].
pub(super) fn in_sphere<const D: usize>(simplex: &Simplex<D>, p: &Point<D>) -> f64 {
    const { assert!(D == 2 || D == 3) };
    let (a, o) = (&simplex.first, &simplex.others);
    if D == 2 {
        incircle(planar(a), planar(&o[0]), planar(&o[1]), planar(p))
    } else {
        -insphere(spatial(a), spatial(&o[0]), spatial(&o[1]), spatial(&o[2]), spatial(p))
    }
}
