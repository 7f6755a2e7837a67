//! Streamlines as VTP, VTK's XML format for poly data: one polyline each.
//!
//! Points are in world coordinates, z = 0 in the plane, with the point array `time_of_flight` and, where it is
//! known, `pressure`; cell arrays `from` and `to` are the numbers of the wells where a line begins and ends, −1
//! for none. All but these and indices, Int32, are Float64.

use std::path::Path;

use atomesh::image::Frame;
use atomesh::watch::Watch;

use super::column::{Column, Endian};
use super::data::{MeshDataError, Provenance};
use super::vtu::appended::Head;
use super::{MeshWriteError, metadata};
use crate::atomic_file::AtomicFile;

/// A line along which something flows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Streamline<'a, const D: usize> {
    /// The places along it, in world coordinates.
    pub points: &'a [[f64; D]],
    /// The time of flight at each of them.
    pub times: &'a [f64],
    /// The pressure at each of them; none where it is not known.
    pub pressures: &'a [f64],
    /// The number of the well where it begins.
    pub from: Option<u32>,
    /// The number of the well where it ends.
    pub to: Option<u32>,
}

/// Streamlines with what is known of where they come from.
#[derive(Clone, Copy, Debug)]
pub struct Streamlines<'a, const D: usize> {
    /// The lines.
    pub lines: &'a [Streamline<'a, D>],
    /// The frame of the image that the mesh follows.
    pub frame: Option<&'a Frame<D>>,
    /// Where it comes from.
    pub provenance: Option<&'a Provenance>,
}

impl<const D: usize> Streamlines<'_, D> {
    /// Checks that all points have a time, and all of them a pressure or none.
    fn check(&self) -> Result<(), MeshDataError> {
        for line in self.lines {
            let expected = line.points.len();
            let has_pressures = self.has_pressures() || !line.pressures.is_empty();
            for (name, found, is_wanted) in [
                ("time_of_flight", line.times.len(), true),
                ("pressure", line.pressures.len(), has_pressures),
            ] {
                if is_wanted && found != expected {
                    let name = name.to_owned();
                    return Err(MeshDataError::FieldLength { name, expected, found });
                }
            }
        }
        Ok(())
    }

    fn has_pressures(&self) -> bool {
        self.lines.iter().any(|line| !line.pressures.is_empty())
    }
}

/// Writes streamlines as a VTP file, which ParaView reads. It appears whole or not at all.
///
/// # Errors
/// [`MeshWriteError::Field`] if a line has not one time for each point, or has pressures but not for each point
/// of all lines; [`MeshWriteError::TooMany`] if there are more than 2³¹ − 1 points; if the file cannot be written,
/// or the watch ends the work.
pub fn write_streamlines<const D: usize>(
    path: &Path,
    data: &Streamlines<D>,
    watch: &mut dyn Watch,
) -> Result<(), MeshWriteError> {
    data.check()?;
    let (lines, little) = (data.lines, Endian::Little);
    let mut ends: Vec<i32> = Vec::with_capacity(lines.len());
    let mut count = 0;
    for line in lines {
        count += line.points.len();
        let limit = i32::MAX as usize;
        let end = i32::try_from(count);
        ends.push(end.map_err(|_| MeshWriteError::TooMany { format: "VTP", count, limit })?);
    }
    let text = metadata::encode_parts(data.frame, data.provenance);
    let points: Vec<[f64; D]> = lines.iter().flat_map(|line| line.points).copied().collect();
    let of_points = |values: for<'l> fn(&Streamline<'l, D>) -> &'l [f64]| -> Vec<f64> {
        lines.iter().flat_map(values).copied().collect()
    };
    let (times, pressures) = (of_points(|line| line.times), of_points(|line| line.pressures));
    let well = |number: Option<u32>| number.and_then(|n| i32::try_from(n).ok()).unwrap_or(-1);

    let mut head = Head::new("PolyData");
    head.text("<FieldData>\n");
    head.field_data("UInt8", metadata::NAME, Column::slice(text.as_bytes(), little));
    head.text("</FieldData>\n");
    head.text(&format!(
        "<Piece NumberOfPoints=\"{count}\" NumberOfVerts=\"0\" NumberOfLines=\"{}\" \
         NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n<PointData>\n",
        lines.len()
    ));
    head.array("Float64", "time_of_flight", "", Column::slice(&times, little));
    if data.has_pressures() {
        head.array("Float64", "pressure", "", Column::slice(&pressures, little));
    }
    head.text("</PointData>\n<CellData>\n");
    let wells = |of: fn(&Streamline<D>) -> Option<u32>| {
        Column::numbers(lines.len(), little, move |i| well(of(&lines[i])))
    };
    head.array("Int32", "from", "", wells(|line| line.from));
    head.array("Int32", "to", "", wells(|line| line.to));
    head.text("</CellData>\n<Points>\n");
    head.array("Float64", "Points", "NumberOfComponents=\"3\"", Column::points(&points, little));
    head.text("</Points>\n<Lines>\n");
    head.array("Int32", "connectivity", "", Column::numbers(count, little, |i| i as i32));
    head.array("Int32", "offsets", "", Column::slice(&ends, little));
    head.text("</Lines>\n</Piece>\n");
    let mut file = AtomicFile::create(path)?;
    head.write(&mut file, watch)?;
    Ok(file.commit()?)
}
