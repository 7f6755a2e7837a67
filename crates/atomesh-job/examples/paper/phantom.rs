//! A slice through a torso, drawn: ellipses of several greys, with noise.

use atomesh::image::{Frame, Image, Samples};

use crate::book::Failure;

const SHAPE: [usize; 2] = [320, 220];

/// The standard deviation of the noise, in greys, about.
const NOISE: f64 = 4.0;

/// An ellipse: its middle and half axes in shares of the width, the angle of the first axis, and its grey.
struct Organ(f64, f64, f64, f64, f64, f64);

/// From the skin inwards; later ones cover earlier ones.
const ORGANS: [Organ; 11] = [
    Organ(0.50, 0.34, 0.46, 0.30, 0.0, 170.0),
    Organ(0.50, 0.34, 0.43, 0.27, 0.0, 95.0),
    Organ(0.27, 0.31, 0.15, 0.19, 0.2, 20.0),
    Organ(0.73, 0.31, 0.15, 0.19, -0.2, 20.0),
    Organ(0.53, 0.25, 0.11, 0.10, 0.5, 140.0),
    Organ(0.55, 0.24, 0.05, 0.045, 0.5, 200.0),
    Organ(0.46, 0.31, 0.035, 0.035, 0.0, 210.0),
    Organ(0.50, 0.52, 0.065, 0.055, 0.0, 180.0),
    Organ(0.50, 0.53, 0.022, 0.022, 0.0, 50.0),
    Organ(0.36, 0.56, 0.10, 0.03, 0.3, 130.0),
    Organ(0.64, 0.56, 0.10, 0.03, -0.3, 130.0),
];

/// The image.
pub fn torso() -> Result<Image<2>, Failure> {
    let width = SHAPE[0] as f64;
    let mut state = 1_u64;
    let mut noise = || {
        // the sum of twelve equal numbers is nearly normal
        (0..12)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 40) as f64 / (1_u64 << 24) as f64
            })
            .sum::<f64>()
            - 6.0
    };
    let grey = |i: usize| {
        let [x, y] = [(i % SHAPE[0]) as f64 / width, (i / SHAPE[0]) as f64 / width];
        ORGANS.iter().fold(4.0, |below, organ| organ.over(below, [x, y], width))
    };
    let samples: Vec<u8> = (0..SHAPE[0] * SHAPE[1])
        .map(|i| (grey(i) + NOISE * noise()).clamp(0.0, 255.0).round() as u8)
        .collect();
    Ok(Image::new(Frame::new(SHAPE)?, Samples::U8(samples.into()))?)
}

impl Organ {
    /// The grey where the organ may cover another one; its rim is about a sample wide.
    fn over(&self, below: f64, [x, y]: [f64; 2], width: f64) -> f64 {
        let Self(cx, cy, a, b, angle, grey) = *self;
        let (sin, cos) = angle.sin_cos();
        let [u, v] = [cos * (x - cx) + sin * (y - cy), cos * (y - cy) - sin * (x - cx)];
        let radius = (u / a).hypot(v / b);
        let inside = (0.5 + (1.0 - radius) * a.min(b) * width).clamp(0.0, 1.0);
        below + inside * (grey - below)
    }
}
