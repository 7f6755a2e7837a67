//! Streamlines as VTP, VTK's XML format for poly data: one polyline each.
//!
//! Points are in world coordinates, z = 0 in the plane, with the point array `time_of_flight` and, where it is
//! known, `pressure`; cell arrays `from` and `to` are the numbers of the wells where a line begins and ends, −1
//! for none. All but these and indices, Int32, are Float64.

use std::path::Path;

use atomesh::image::Frame;
use atomesh::watch::Watch;

use super::column::{Column, Endian};
use super::error::MeshWriteError;
use super::field::MeshDataError;
use super::metadata;
use super::provenance::Provenance;
use super::vtu::appended::Head;
use crate::atomic_file::AtomicFile;

/// A line along which something flows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedLine<'a, const D: usize> {
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
    pub lines: &'a [TracedLine<'a, D>],
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
    let text = metadata::encode(data.frame, data.provenance);
    let points: Vec<[f64; D]> = lines.iter().flat_map(|line| line.points).copied().collect();
    let of_points = |values: for<'l> fn(&TracedLine<'l, D>) -> &'l [f64]| -> Vec<f64> {
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
    let wells = |of: fn(&TracedLine<D>) -> Option<u32>| {
        Column::numbers(lines.len(), little, move |i| well(of(&lines[i])))
    };
    head.array("Int32", "from", "", wells(|line| line.from));
    head.array("Int32", "to", "", wells(|line| line.to));
    head.text("</CellData>\n<Points>\n");
    let standing = data.provenance.and_then(|provenance| provenance.standing.as_ref());
    let places = Column::points(&points, standing, little);
    head.array("Float64", "Points", "NumberOfComponents=\"3\"", places);
    head.text("</Points>\n<Lines>\n");
    head.array("Int32", "connectivity", "", Column::numbers(count, little, |i| i as i32));
    head.array("Int32", "offsets", "", Column::slice(&ends, little));
    head.text("</Lines>\n</Piece>\n");
    let mut file = AtomicFile::create(path)?;
    head.write(&mut file, watch)?;
    Ok(file.commit()?)
}

#[cfg(test)]
mod tests {
    use atomesh::watch::Silent;

    use super::super::vtu::read::Document;
    use super::*;

    fn written(lines: &[TracedLine<2>]) -> Result<Vec<u8>, MeshWriteError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lines.vtp");
        let data = Streamlines { lines, frame: None, provenance: None };
        let written = write_streamlines(&path, &data, &mut Silent);
        assert_eq!(path.exists(), written.is_ok());
        written.map(|()| std::fs::read(&path).unwrap())
    }

    #[test]
    fn lines_are_read_as_they_were_written() {
        let third = 1.0 / 3.0;
        let (long, short) = ([[0.0, third], [1.0, 2.0], [4.0, -1.0]], [[5.0, 5.0], [6.0, 6.0]]);
        let lines = [
            TracedLine {
                points: &long,
                times: &[0.0, third, 1e9],
                pressures: &[3.0, 2.0, third],
                from: Some(0),
                to: None,
            },
            TracedLine {
                points: &short,
                times: &[0.0, 2.0],
                pressures: &[1.0, 0.0],
                from: None,
                to: Some(7),
            },
        ];
        let bytes = written(&lines).unwrap();
        assert_eq!(bytes, written(&lines).unwrap());
        let document = Document::parse(&bytes, "PolyData").unwrap();
        let piece = &document.pieces[0];
        assert_eq!((piece.points, piece.counts), (5, [2, 0]));
        let points = piece.coordinates[0].reals(15).unwrap();
        let places = long.iter().chain(&short).flat_map(|p| [p[0], p[1], 0.0]);
        assert_eq!(points, places.collect::<Vec<_>>());
        let named = |name: &str| piece.point_data.iter().find(|array| array.name == name).unwrap();
        assert_eq!(named("time_of_flight").reals(5).unwrap(), [0.0, third, 1e9, 0.0, 2.0]);
        assert_eq!(named("pressure").reals(5).unwrap(), [3.0, 2.0, third, 1.0, 0.0]);
        let wells = |name: &str| piece.cell_data.iter().find(|array| array.name == name).unwrap();
        assert_eq!(wells("from").reals(2).unwrap(), [0.0, -1.0]);
        assert_eq!(wells("to").reals(2).unwrap(), [-1.0, 7.0]);
        let named = |name: &str| piece.lines.iter().find(|array| array.name == name).unwrap();
        assert_eq!(named("offsets").indices(2).unwrap(), [3, 5]);
        assert_eq!(named("connectivity").indices(5).unwrap(), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn no_lines_are_a_file_and_what_does_not_fit_is_refused() {
        let bytes = written(&[]).unwrap();
        assert_eq!(Document::parse(&bytes, "PolyData").unwrap().pieces[0].counts, [0, 0]);
        let line =
            TracedLine { points: &[[0.0; 2]], times: &[0.0], pressures: &[], from: None, to: None };
        written(&[line]).unwrap();
        let error = written(&[TracedLine { times: &[], ..line }]).unwrap_err();
        let expected = "field \"time_of_flight\" has 0 values for 1 points or cells";
        assert_eq!(error.to_string(), expected);
        let other = TracedLine { pressures: &[1.0], ..line };
        let error = written(&[line, other]).unwrap_err();
        assert!(error.to_string().starts_with("field \"pressure\" has 0 values"), "{error}");
    }
}
