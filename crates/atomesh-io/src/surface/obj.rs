//! OBJ, Wavefront's text: vertices, and each group's lines (`l`) or faces (`f`) after its name (`g`).

use std::io::{self, Write};

use super::Surface;

pub(super) fn write<const D: usize>(out: &mut impl Write, surface: &Surface<D>) -> io::Result<()> {
    writeln!(out, "# atomesh")?;
    for [x, y, z] in &surface.points {
        writeln!(out, "v {x:?} {y:?} {z:?}")?;
    }
    let word = if D == 2 { "l" } else { "f" };
    for group in &surface.groups {
        writeln!(out, "g {}", group.name)?;
        for facet in &group.facets {
            write!(out, "{word}")?;
            facet.iter().try_for_each(|corner| write!(out, " {}", corner + 1))?;
            writeln!(out)?;
        }
    }
    Ok(())
}
