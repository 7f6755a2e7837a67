//! Where a flat mesh stands in space.

use serde::{Deserialize, Serialize};

/// The plane of a flat image in space, such as an oblique slice of a scan: a place (x, y) of its world is
/// `origin` + x · `axes[0]` + y · `axes[1]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// Where the plane's (0, 0) is.
    pub origin: [f64; 3],
    /// The directions of x and y: of length 1 and at right angles.
    pub axes: [[f64; 3]; 2],
}

impl Standing {
    /// The plane z = `z`.
    pub fn level(z: f64) -> Self {
        Self { origin: [0.0, 0.0, z], axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] }
    }

    /// The plane through `origin` along two directions that are not parallel; x runs along the first.
    pub fn along(origin: [f64; 3], [x, y]: [[f64; 3]; 2]) -> Self {
        let unit = |v: [f64; 3]| v.map(|component| component / dot(&v, &v).sqrt());
        let x = unit(x);
        let share = dot(&x, &y);
        Self { origin, axes: [x, unit(std::array::from_fn(|k| y[k] - share * x[k]))] }
    }

    /// A vector of the plane in space.
    pub fn turned(&self, v: [f64; 2]) -> [f64; 3] {
        std::array::from_fn(|k| v[0] * self.axes[0][k] + v[1] * self.axes[1][k])
    }

    /// A place of the plane in space.
    pub fn in_space(&self, p: [f64; 2]) -> [f64; 3] {
        let turned = self.turned(p);
        std::array::from_fn(|k| self.origin[k] + turned[k])
    }

    /// A place in space by the plane's coordinates, the third at right angles to it.
    pub fn in_plane(&self, p: [f64; 3]) -> [f64; 3] {
        let from = std::array::from_fn(|k| p[k] - self.origin[k]);
        let [x, y] = &self.axes;
        let normal: [f64; 3] = std::array::from_fn(|k| {
            x[(k + 1) % 3] * y[(k + 2) % 3] - x[(k + 2) % 3] * y[(k + 1) % 3]
        });
        [dot(&from, x), dot(&from, y), dot(&from, &normal)]
    }
}

/// A place in space, of a flat one where its plane stands, or else at z = 0.
pub(crate) fn placed<const D: usize>(p: &[f64; D], standing: Option<&Standing>) -> [f64; 3] {
    match (standing, &p[..]) {
        (Some(standing), &[x, y]) => standing.in_space([x, y]),
        _ => std::array::from_fn(|k| p.get(k).copied().unwrap_or(0.0)),
    }
}

/// A vector in space likewise.
pub(crate) fn turned<const D: usize>(v: &[f64; D], standing: Option<&Standing>) -> [f64; 3] {
    match (standing, &v[..]) {
        (Some(standing), &[x, y]) => standing.turned([x, y]),
        _ => placed(v, None),
    }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_go_to_space_and_back() {
        let standing = Standing::along([3.0, -7.0, 2.5], [[2.0, 0.0, 1.0], [0.5, 3.0, 0.0]]);
        for p in [[0.0, 0.0], [4.0, -2.0], [1e3, 7.0]] {
            let space = standing.in_space(p);
            let [x, y, off] = standing.in_plane(space);
            // coordinates up to a thousand: some roundings
            assert!((x - p[0]).abs() + (y - p[1]).abs() + off.abs() < 1e-11);
            assert_eq!(placed(&p, Some(&standing)), space);
        }
        assert_eq!(Standing::level(4.0).in_space([1.0, 2.0]), [1.0, 2.0, 4.0]);
        assert_eq!(placed(&[1.0, 2.0], None), [1.0, 2.0, 0.0]);
        assert_eq!(turned(&[1.0, 2.0], Some(&Standing::level(4.0))), [1.0, 2.0, 0.0]);
        assert_eq!(placed(&[1.0, 2.0, 3.0], Some(&standing)), [1.0, 2.0, 3.0]);
    }
}
