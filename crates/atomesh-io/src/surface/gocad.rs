//! GOCAD's text: a TSurf of triangles (`.ts`), or a PLine of segments (`.pl`), for each group. Every object
//! numbers its own vertices from 1.

use std::collections::BTreeMap;
use std::io::{self, Write};

use super::Surface;

pub(super) fn write<const D: usize>(out: &mut impl Write, surface: &Surface<D>) -> io::Result<()> {
    let (kind, part, word) =
        if D == 2 { ("PLine", "ILINE", "SEG") } else { ("TSurf", "TFACE", "TRGL") };
    for group in &surface.groups {
        writeln!(out, "GOCAD {kind} 1\nHEADER {{\nname:{}\n}}\n{part}", group.name)?;
        let mut number = BTreeMap::new();
        number.extend(group.facets.as_flattened().iter().map(|&corner| (corner, 0)));
        for (next, (&corner, number)) in number.iter_mut().enumerate() {
            *number = next + 1;
            let [x, y, z] = surface.points[corner as usize];
            writeln!(out, "VRTX {number} {x:?} {y:?} {z:?}")?;
        }
        for facet in &group.facets {
            write!(out, "{word}")?;
            facet.iter().try_for_each(|corner| write!(out, " {}", number[corner]))?;
            writeln!(out)?;
        }
        writeln!(out, "END")?;
    }
    Ok(())
}
