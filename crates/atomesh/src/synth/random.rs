//! Random numbers that stay the same: PCG-64's 64-bit words, turned into floats here.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Tells the stream of noise from that of the geometry.
const NOISE: u64 = 0x6e6f_6973_6500_0000;

/// A seeded stream of floats.
pub(super) struct Random(Pcg64);

impl Random {
    /// The stream that fixes the geometry of a scene.
    pub fn geometry(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    /// The stream of noise from its word `start` on: pieces made apart join without a seam.
    pub fn noise(seed: u64, start: usize) -> Self {
        let mut generator = Pcg64::seed_from_u64(seed ^ NOISE);
        generator.advance(start as u128);
        Self(generator)
    }

    /// A float in 0..1, one of 2⁵³ that are equally likely. Takes one word.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A float in `from..to`. Takes one word.
    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }

    /// 1 or −1. Takes one word.
    pub fn sign(&mut self) -> f64 {
        if self.unit() < 0.5 { 1.0 } else { -1.0 }
    }

    /// Two independent normal deviates, of mean 0 and variance 1 (Box and Muller 1958). Takes two
    /// words.
    pub fn normal_pair(&mut self) -> [f64; 2] {
        // 1 − u is in (0, 1], where the logarithm is finite
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        let (sine, cosine) = (std::f64::consts::TAU * self.unit()).sin_cos();
        [radius * cosine, radius * sine]
    }
}
