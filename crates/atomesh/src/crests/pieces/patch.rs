//! A piece near one of its points, as a surface of second degree over the tangent plane there.

use super::super::FeaturePoint;
use super::tangents;
use crate::geometry::linear::solve;
use crate::geometry::{Point, PointGrid, difference, dot};

/// The deviation of the weights of a fit, and the radius of its points, in mean steps.
const WIDTH: f64 = 1.3;
pub(super) const REACH: f64 = 3.25;
/// How far from its middle a patch is bent, in mean steps: beyond, it goes on as its tangent plane.
const BENT: f64 = 3.0;
/// How often a foot is improved.
const ROUNDS: usize = 4;

/// The points that fits are made of.
pub(super) struct Cloud<'a, const D: usize> {
    pub points: &'a [FeaturePoint<D>],
    /// The piece of each point.
    pub pieces: &'a [u32],
    pub grid: &'a PointGrid<D>,
    pub step: f64,
}

/// A piece near a point: height over a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Patch<const D: usize> {
    /// A place on the plane.
    pub at: Point<D>,
    /// The plane's unit normal.
    pub normal: Point<D>,
    /// Unit vectors along the plane; in the plane only the first counts.
    axes: [Point<D>; 2],
    /// The height: 1, the coordinates along the axes, and their products, in mean steps.
    terms: [f64; 6],
}

impl<const D: usize> Patch<D> {
    /// A fit of second degree, by moving least squares (Alexa and others 2001), to the points of a piece near `x`; of
    /// less degree where there are few. `extra` widens it. `None` where there are no points.
    pub fn fit(
        cloud: &Cloud<'_, D>,
        piece: u32,
        x: &Point<D>,
        normal: &Point<D>,
        extra: f64,
    ) -> Option<Self> {
        let step = cloud.step;
        let reach = REACH * step + extra;
        let inverse = 1.0 / (WIDTH * step + extra).powi(2);
        let axes = tangents(normal);
        let size = D * (D + 1) / 2;
        let mut matrix = [[0.0; 6]; 6];
        let mut right = [[0.0; 1]; 6];
        let mut count = 0;
        cloud.grid.near(x, reach, |place, i| {
            let offset = difference(place, x);
            let squared = dot(&offset, &offset);
            if squared > reach * reach
                || cloud.pieces[i] != piece
                || dot(&cloud.points[i].normal, normal) < 0.3
            {
                return;
            }
            count += 1;
            let weight = (-0.5 * squared * inverse).exp();
            let terms = terms::<D>(dot(&offset, &axes[0]) / step, dot(&offset, &axes[1]) / step);
            let height = weight * dot(&offset, normal);
            for r in 0..size {
                for c in 0..=r {
                    matrix[r][c] += weight * terms[r] * terms[c];
                }
                right[r][0] += terms[r] * height;
            }
        });
        let size = match count {
            0 => return None,
            n if n >= 2 * size && extra == 0.0 => size,
            n if n > D => D,
            _ => 1,
        };
        for r in 0..size {
            for c in r + 1..size {
                matrix[r][c] = matrix[c][r];
            }
        }
        let largest = matrix[0][0];
        (0..size).for_each(|k| matrix[k][k] += 1e-6 * largest);
        if solve(size, matrix, &mut right) == 0.0 {
            return None;
        }
        let terms = std::array::from_fn(|k| if k < size { right[k][0] } else { 0.0 });
        Some(Self { at: *x, normal: *normal, axes, terms })
    }

    /// The same fit over the plane that touches it above its middle.
    pub fn fit_twice(
        cloud: &Cloud<'_, D>,
        piece: u32,
        x: &Point<D>,
        normal: &Point<D>,
    ) -> Option<Self> {
        let first = Self::fit(cloud, piece, x, normal, 0.0)?;
        let (place, normal) = first.touching(cloud.step);
        let second = Self::fit(cloud, piece, &place, &normal, 0.0)?;
        let (place, normal) = second.touching(cloud.step);
        Some(Self { at: place, normal, axes: tangents(&normal), ..second }.bent_alone(&second))
    }

    /// The plane that touches the patch above its middle, by a place on it and its normal.
    pub fn touching(&self, step: f64) -> (Point<D>, Point<D>) {
        let place = std::array::from_fn(|k| self.at[k] + self.terms[0] * self.normal[k]);
        (place, self.normal_at(0.0, 0.0, step))
    }

    /// The terms of second degree of another patch, whose axes are nearly these.
    fn bent_alone(mut self, other: &Self) -> Self {
        // the second plane differs from the third by a turn of second order: only its axes count
        let [a, b] = self.axes.map(|axis| other.axes.map(|on| dot(&axis, &on)));
        let t = &other.terms;
        self.terms = [0.0; 6];
        if D == 2 {
            self.terms[2] = t[2];
            return self;
        }
        self.terms[3] = t[3] * a[0] * a[0] + t[4] * a[0] * a[1] + t[5] * a[1] * a[1];
        self.terms[4] = 2.0 * t[3] * a[0] * b[0]
            + t[4] * (a[0] * b[1] + a[1] * b[0])
            + 2.0 * t[5] * a[1] * b[1];
        self.terms[5] = t[3] * b[0] * b[0] + t[4] * b[0] * b[1] + t[5] * b[1] * b[1];
        self
    }

    /// The height at coordinates along the axes in mean steps, and how it rises along them.
    fn height(&self, u: f64, v: f64) -> (f64, [f64; 2]) {
        let t = &self.terms;
        if D == 2 {
            return (t[0] + u * (t[1] + u * t[2]), [t[1] + 2.0 * u * t[2], 0.0]);
        }
        let along = [t[1] + 2.0 * u * t[3] + v * t[4], t[2] + u * t[4] + 2.0 * v * t[5]];
        (t[0] + u * (t[1] + u * t[3] + v * t[4]) + v * (t[2] + v * t[5]), along)
    }

    /// The same beyond the bent part as on its tangent plane.
    fn height_anywhere(&self, u: f64, v: f64) -> (f64, [f64; 2]) {
        let squared = u * u + v * v;
        if squared <= BENT * BENT {
            return self.height(u, v);
        }
        let radius = squared.sqrt();
        let [rim_u, rim_v] = [u * BENT / radius, v * BENT / radius];
        let (height, along) = self.height(rim_u, rim_v);
        (height + along[0] * (u - rim_u) + along[1] * (v - rim_v), along)
    }

    fn normal_at(&self, u: f64, v: f64, step: f64) -> Point<D> {
        let (_, along) = self.height_anywhere(u, v);
        let mut turned = self.normal;
        for (axis, slope) in self.axes.iter().zip(along) {
            (0..D).for_each(|k| turned[k] -= slope / step * axis[k]);
        }
        let length = dot(&turned, &turned).sqrt();
        turned.map(|n| n / length)
    }

    /// The place on the patch nearest to `p`, by Newton's method, and the normal there.
    pub fn foot(&self, p: &Point<D>, step: f64) -> (Point<D>, Point<D>) {
        let offset = difference(p, &self.at);
        let above = dot(&offset, &self.normal);
        let to = self.axes.map(|axis| dot(&offset, &axis) / step);
        let (mut u, mut v) = (to[0], to[1]);
        let bends = if D == 2 { [self.terms[2], 0.0] } else { [self.terms[3], self.terms[5]] };
        for _ in 0..ROUNDS {
            let (height, along) = self.height_anywhere(u, v);
            let slopes = along.map(|slope| slope / step);
            let rest = above - height;
            let bent = if u * u + v * v <= BENT * BENT { 2.0 * rest / (step * step) } else { 0.0 };
            let change = |k: usize, at: f64| {
                let stiff = (1.0 + slopes[k] * slopes[k] - bent * bends[k]).max(0.4);
                (to[k] - at + slopes[k] * rest / step) / stiff
            };
            let (du, dv) = (change(0, u), change(1, v));
            (u, v) = (u + du, v + dv);
            if du.abs().max(dv.abs()) < 1e-4 {
                break;
            }
        }
        let (height, _) = self.height_anywhere(u, v);
        let place = std::array::from_fn(|k| {
            self.at[k]
                + step * (u * self.axes[0][k] + v * self.axes[1][k])
                + height * self.normal[k]
        });
        (place, self.normal_at(u, v, step))
    }

    /// The place straight above or below `x`, as the normal goes.
    pub fn flat_foot(&self, x: &Point<D>, step: f64) -> (Point<D>, Point<D>) {
        let (at, normal) = self.touching(step);
        let above = dot(&difference(x, &at), &normal);
        (std::array::from_fn(|k| x[k] - above * normal[k]), normal)
    }
}

/// 1, the coordinates, and their products.
fn terms<const D: usize>(u: f64, v: f64) -> [f64; 6] {
    if D == 2 {
        return [1.0, u, u * u, 0.0, 0.0, 0.0];
    }
    [1.0, u, v, u * u, u * v, v * v]
}
