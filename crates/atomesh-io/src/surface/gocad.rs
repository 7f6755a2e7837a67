//! GOCAD's text: a TSurf of triangles (`.ts`), or a PLine of segments (`.pl`), for each group. Every object
//! numbers its own vertices from 1.

use std::collections::BTreeMap;
use std::io::{self, Write};

use super::{Surface, WorldAxes};

pub(super) fn write<const D: usize>(out: &mut impl Write, surface: &Surface<D>) -> io::Result<()> {
    let (kind, part, word) =
        if D == 2 { ("PLine", "ILINE", "SEG") } else { ("TSurf", "TFACE", "TRGL") };
    for group in &surface.groups {
        writeln!(out, "GOCAD {kind} 1\nHEADER {{\nname:{}\n}}", group.name)?;
        if let Some(axes) = surface.axes {
            write_axes(out, axes)?;
        }
        writeln!(out, "{part}")?;
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

/// The coordinate system: units, and where z grows.
fn write_axes(out: &mut impl Write, axes: &WorldAxes) -> io::Result<()> {
    let unit = |axis: usize| axes.units.get(axis).map_or("none", String::as_str);
    writeln!(
        out,
        "GOCAD_ORIGINAL_COORDINATE_SYSTEM\nNAME atomesh\nAXIS_NAME \"X\" \"Y\" \"Z\"\n\
         AXIS_UNIT \"{}\" \"{}\" \"{}\"\nZPOSITIVE {}\nEND_ORIGINAL_COORDINATE_SYSTEM",
        unit(0),
        unit(1),
        unit(2),
        if axes.z_down { "Depth" } else { "Elevation" }
    )
}
