//! STL, binary: each triangle with its unit normal and its own three corners, in single precision. The two
//! bytes that the format leaves free hold the number of the group, if it fits.

use std::io::{self, Write};

use super::Surface;

/// Begins the head of 80 bytes; it must not be "solid", by which text files are known.
const TITLE: &[u8] = b"atomesh";

pub(super) fn write<const D: usize>(out: &mut impl Write, surface: &Surface<D>) -> io::Result<()> {
    let mut bytes = vec![b' '; 80];
    bytes[..TITLE.len()].copy_from_slice(TITLE);
    bytes.extend((surface.facet_count() as u32).to_le_bytes());
    for (facet, group) in surface.facets() {
        let corners: Vec<[f64; 3]> =
            facet.iter().map(|&corner| surface.points[corner as usize]).collect();
        let [a, b, c] = corners[..] else { continue };
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        let normal: [f64; 3] = std::array::from_fn(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            u[i] * v[j] - u[j] * v[i]
        });
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let unit = normal.map(|x| if length > 0.0 { x / length } else { 0.0 });
        for number in [unit, a, b, c].as_flattened() {
            bytes.extend((*number as f32).to_le_bytes());
        }
        bytes.extend(u16::try_from(group.id).unwrap_or(0).to_le_bytes());
    }
    out.write_all(&bytes)
}
