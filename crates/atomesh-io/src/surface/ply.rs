//! PLY, binary, little-endian: vertices in double precision, and faces, or edges of a flat mesh, each with the
//! number of its group as the property `feature`; comments tell the names.

use std::io::{self, Write};

use super::Surface;

pub(super) fn write<const D: usize>(out: &mut impl Write, surface: &Surface<D>) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment atomesh")?;
    for group in &surface.groups {
        writeln!(out, "comment feature {} {}", group.id, group.name)?;
    }
    writeln!(out, "element vertex {}", surface.points.len())?;
    writeln!(out, "property double x\nproperty double y\nproperty double z")?;
    let (element, corners) = match D {
        2 => ("edge", "property int vertex1\nproperty int vertex2"),
        _ => ("face", "property list uchar int vertex_indices"),
    };
    writeln!(out, "element {element} {}\n{corners}", surface.facet_count())?;
    writeln!(out, "property int feature\nend_header")?;
    let mut bytes = Vec::new();
    for number in surface.points.as_flattened() {
        bytes.extend(number.to_le_bytes());
    }
    for (facet, group) in surface.facets() {
        if D == 3 {
            bytes.push(3);
        }
        facet.iter().for_each(|corner| bytes.extend(corner.to_le_bytes()));
        bytes.extend(group.id.to_le_bytes());
    }
    out.write_all(&bytes)
}
