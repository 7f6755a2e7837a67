//! JPEG of 12 bits a sample: the sequential extended process by Huffman's codes (ITU T.81), of one component.
//!
//! No crate decodes it. The inverse transform is the definition's, in double precision, so that values are those of an
//! exact decoder; others round in between and may differ by 1.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// The places of coefficients in the order in which they come.
const ZIGZAG: [usize; 64] = [
    0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20,
    13, 6, 7, 14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59,
    52, 45, 38, 31, 39, 46, 53, 60, 61, 54, 47, 55, 62, 63,
];

/// Half the range of a sample of 12 bits.
const HALF: f64 = 2048.0;

/// Unpacks a frame of a known shape; none if it is corrupt or cut short.
pub(super) fn unpack(packed: &[u8], shape: [usize; 2]) -> Option<Vec<u16>> {
    let mut tables = Tables::default();
    let mut rest = packed.strip_prefix(&[0xff, 0xd8])?;
    loop {
        let marker = *rest.strip_prefix(&[0xff])?.first()?;
        if marker == 0xff {
            rest = &rest[1..];
            continue;
        }
        let length = usize::from(u16::from_be_bytes(*rest.get(2..)?.first_chunk()?));
        let body = rest.get(4..2 + length)?;
        rest = &rest[2 + length..];
        match marker {
            0xc0 | 0xc1 => tables.of_component = usize::from(*body.get(8)?),
            0xc4 => tables.read_codes(body)?,
            0xdb => tables.read_steps(body)?,
            0xdd => tables.interval = usize::from(u16::from_be_bytes(*body.first_chunk()?)),
            0xda => return tables.scan(*body.get(2)?, rest, shape),
            0xd9 => return None,
            _ => {}
        }
    }
}

/// What the segments before a scan say.
#[derive(Default)]
struct Tables {
    /// Quantization steps in zigzag order.
    steps: [Option<[f64; 64]>; 4],
    /// Codes of the sizes of mean values, and of runs and sizes of the others.
    codes: [[Option<Codes>; 4]; 2],
    /// Which steps the component has.
    of_component: usize,
    /// Blocks from restart to restart, 0 if there is none.
    interval: usize,
}

impl Tables {
    fn read_steps(&mut self, mut body: &[u8]) -> Option<()> {
        while let [kind, after @ ..] = body {
            let size = 1 + usize::from(kind >> 4 & 1);
            let values = after.get(..64 * size)?;
            let step = |bytes: &[u8]| bytes.iter().fold(0.0, |n, &b| 256.0 * n + f64::from(b));
            let mut steps = [0.0; 64];
            steps.iter_mut().zip(values.chunks_exact(size)).for_each(|(s, v)| *s = step(v));
            *self.steps.get_mut(usize::from(kind & 15))? = Some(steps);
            body = &after[64 * size..];
        }
        Some(())
    }

    fn read_codes(&mut self, mut body: &[u8]) -> Option<()> {
        while let [kind, after @ ..] = body {
            let counts: &[u8; 16] = after.first_chunk()?;
            let count: usize = counts.iter().map(|&n| usize::from(n)).sum();
            let values = after.get(16..16 + count)?.to_vec();
            let tables = self.codes.get_mut(usize::from(kind >> 4))?;
            *tables.get_mut(usize::from(kind & 15))? = Some(Codes { counts: *counts, values });
            body = &after[16 + count..];
        }
        Some(())
    }

    /// The samples of the scan that follows.
    fn scan(&self, which: u8, bytes: &[u8], [nx, ny]: [usize; 2]) -> Option<Vec<u16>> {
        let steps = self.steps.get(self.of_component)?.as_ref()?;
        let means = self.codes[0].get(usize::from(which >> 4))?.as_ref()?;
        let others = self.codes[1].get(usize::from(which & 15))?.as_ref()?;
        let cosines = cosines();
        let mut bits = Bits { bytes, held: 0, count: 0 };
        let mut samples = vec![0; nx * ny];
        let mut mean = 0;
        let across = nx.div_ceil(8);
        for block in 0..across * ny.div_ceil(8) {
            if self.interval > 0 && block > 0 && block % self.interval == 0 {
                bits.restart()?;
                mean = 0;
            }
            let size = means.next(&mut bits)?;
            mean = i32::checked_add(mean, bits.signed(size)?)?;
            let mut coefficients = [0.0; 64];
            coefficients[0] = f64::from(mean) * steps[0];
            let mut place = 1;
            while place < 64 {
                let code = others.next(&mut bits)?;
                let (run, size) = (usize::from(code >> 4), code & 15);
                if size == 0 && run < 15 {
                    break;
                }
                place += run;
                let (to, step) = (*ZIGZAG.get(place)?, steps.get(place)?);
                coefficients[to] = f64::from(bits.signed(size)?) * step;
                place += 1;
            }
            let (x0, y0) = (block % across * 8, block / across * 8);
            let values = inverse(&coefficients, &cosines);
            for (k, value) in values.iter().enumerate() {
                let (x, y) = (x0 + k % 8, y0 + k / 8);
                if x < nx && y < ny {
                    samples[x + nx * y] =
                        (value + HALF).round().clamp(0.0, 2.0 * HALF - 1.0) as u16;
                }
            }
        }
        Some(samples)
    }
}

/// Huffman's codes: how many there are of each length, and what they stand for, in order.
struct Codes {
    counts: [u8; 16],
    values: Vec<u8>,
}

impl Codes {
    /// What the next code stands for (figure F.16).
    fn next(&self, bits: &mut Bits) -> Option<u8> {
        let (mut code, mut first, mut index) = (0, 0, 0);
        for &count in &self.counts {
            code = code << 1 | bits.take(1)?;
            let count = u32::from(count);
            if code < first + count {
                return self.values.get((index + code).checked_sub(first)? as usize).copied();
            }
            index += count;
            first = (first + count) << 1;
        }
        None
    }
}

/// The bits of a scan, without the zeros that follow bytes of ones.
struct Bits<'a> {
    bytes: &'a [u8],
    held: u32,
    count: u32,
}

impl Bits<'_> {
    /// The next bits, 16 at most, as a number.
    fn take(&mut self, count: u32) -> Option<u32> {
        while self.count < count {
            let (byte, after) = match *self.bytes {
                [0xff, 0, ref after @ ..] => (0xff, after),
                [0xff, ..] | [] => return None, // a marker
                [byte, ref after @ ..] => (byte, after),
            };
            self.bytes = after;
            self.held = self.held << 8 | u32::from(byte);
            self.count += 8;
        }
        self.count -= count;
        Some(self.held >> self.count & ((1 << count) - 1))
    }

    /// A number of so many bits, those with a leading 0 below 0 (figure F.12).
    fn signed(&mut self, size: u8) -> Option<i32> {
        if size > 15 {
            return None;
        }
        let value = self.take(size.into())? as i32;
        let is_negative = size > 0 && value < 1 << (size - 1);
        Some(if is_negative { value - (1 << size) + 1 } else { value })
    }

    /// Goes past a restart marker.
    fn restart(&mut self) -> Option<()> {
        (self.held, self.count) = (0, 0);
        match *self.bytes {
            [0xff, 0xd0..=0xd7, ref after @ ..] => self.bytes = after,
            _ => return None,
        }
        Some(())
    }
}

/// C(u) cos((2x + 1) u π / 16) / 2 of the definition (A.3.3), by u and x.
fn cosines() -> [[f64; 8]; 8] {
    std::array::from_fn(|u| {
        let scale = if u == 0 { FRAC_1_SQRT_2 / 2.0 } else { 0.5 };
        std::array::from_fn(|x| scale * ((2 * x + 1) as f64 * u as f64 * PI / 16.0).cos())
    })
}

/// The inverse transform of a block, along rows and then along columns.
fn inverse(coefficients: &[f64; 64], cosines: &[[f64; 8]; 8]) -> [f64; 64] {
    let sum = |of: &[f64; 64], start: usize, step: usize, x: usize| -> f64 {
        (0..8).map(|u| of[start + step * u] * cosines[u][x]).sum()
    };
    let rows: [f64; 64] = std::array::from_fn(|k| sum(coefficients, k / 8 * 8, 1, k % 8));
    std::array::from_fn(|k| sum(&rows, k % 8, 8, k / 8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_the_sum_of_the_definition() {
        let coefficients: [f64; 64] = std::array::from_fn(|k| ((k * 37) % 19) as f64 - 9.0);
        let found = inverse(&coefficients, &cosines());
        let c = |u: usize| if u == 0 { FRAC_1_SQRT_2 } else { 1.0 };
        let cosine = |x: usize, u: usize| ((2 * x + 1) as f64 * u as f64 * PI / 16.0).cos();
        for (x, y) in [(0, 0), (3, 1), (7, 7), (2, 6)] {
            let mut sum = 0.0;
            for v in 0..8 {
                for u in 0..8 {
                    let s = coefficients[u + 8 * v];
                    sum += c(u) * c(v) * s * cosine(x, u) * cosine(y, v) / 4.0;
                }
            }
            assert!((found[x + 8 * y] - sum).abs() < 1e-12, "{x} {y}");
        }
    }
}
