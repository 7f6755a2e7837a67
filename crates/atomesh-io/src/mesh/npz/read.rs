//! Reading NPZ archives with `points` and `cells`, stored or deflated.

use std::io::{Cursor, Read};

use atomesh::mesh::{Mesh, MeshError};
use npyz::{Deserialize, NpyFile, Order};
use zip::ZipArchive;
use zip::result::ZipError;

use super::super::field::OwnedField;
use super::super::loaded::{AnyMesh, LoadedMesh};
use super::super::metadata::{self, Metadata};
use super::super::parts::loaded;
use super::super::read_error::{MeshReadError, malformed};
use super::super::tags::RawTags;

/// Reads the mesh of an NPZ archive with the arrays `points` (n × 2 or n × 3, reals) and `cells`
/// (m × 3 or m × 4, integers). Other arrays of n reals are fields at the points; arrays
/// named `cell.NAME`, of m numbers, are fields in the cells.
///
/// # Errors
/// [`MeshReadError`] if the bytes are not such an archive.
pub fn read_npz(bytes: &[u8]) -> Result<AnyMesh, MeshReadError> {
    let mut archive = Archive::open(bytes)?;
    let points = archive.require("points")?;
    let cells = archive.require("cells")?;
    match (&points.shape[..], &cells.shape[..]) {
        ([_, 2], [_, 3]) => Ok(AnyMesh::Flat(archive.mesh::<2>(&points, &cells)?)),
        ([_, 3], [_, 4]) => Ok(AnyMesh::Volume(archive.mesh::<3>(&points, &cells)?)),
        shapes => Err(malformed(
            0,
            "points of shape (n, 2) and cells of (m, 3), or (n, 3) and (m, 4)",
            format!("{shapes:?}"),
        )),
    }
}

struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    /// The most bytes that an array may have: what deflate can make of the whole file.
    limit: u64,
}

/// One array, with its numbers still in the file's type.
struct Array {
    name: String,
    shape: Vec<u64>,
    bytes: Vec<u8>,
}

impl<'a> Archive<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, MeshReadError> {
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|e| not_zip(&e))?;
        Ok(Self { zip, limit: (bytes.len() as u64).saturating_mul(1032) })
    }

    fn require(&mut self, name: &str) -> Result<Array, MeshReadError> {
        self.array(name)?.ok_or_else(|| malformed(0, format!("the array {name:?}"), "none"))
    }

    fn array(&mut self, name: &str) -> Result<Option<Array>, MeshReadError> {
        let file = match self.zip.by_name(&format!("{name}.npy")) {
            Ok(file) => file,
            Err(ZipError::FileNotFound) => return Ok(None),
            Err(e) => return Err(not_zip(&e)),
        };
        let mut bytes = Vec::new();
        file.take(self.limit).read_to_end(&mut bytes)?;
        let npy =
            NpyFile::new(&bytes[..]).map_err(|e| malformed(0, "an NPY array", e.to_string()))?;
        let shape = npy.shape().to_vec();
        let count = shape.iter().try_fold(1u64, |n, &side| n.checked_mul(side));
        if npy.order() != Order::C && shape.len() > 1
            || count.is_none_or(|n| n > bytes.len() as u64)
        {
            let found = format!("{:?} of shape {shape:?} in {} bytes", npy.order(), bytes.len());
            return Err(malformed(0, format!("whole rows of {name:?}"), found));
        }
        Ok(Some(Array { name: name.into(), shape, bytes }))
    }

    fn mesh<const D: usize>(
        &mut self,
        points: &Array,
        cells: &Array,
    ) -> Result<LoadedMesh<D>, MeshReadError> {
        let corners = cells.indices()?;
        let points: Vec<[f64; D]> = points.reals()?.as_chunks().0.to_vec();
        if corners.len() % (D + 1) != 0 {
            return Err(MeshError::CornerCount { count: corners.len(), each: D + 1 }.into());
        }
        let mesh = Mesh::new(points, corners)?;
        let mut tags = RawTags::default();
        let names: Vec<String> = self.zip.file_names().map(str::to_owned).collect();
        let (mut fields, mut cell_fields, mut skipped) = (Vec::new(), Vec::new(), Vec::new());
        for name in names.iter().filter_map(|n| n.strip_suffix(".npy")) {
            if ["points", "cells", "metadata"].contains(&name) {
                continue;
            }
            let Some(array) = self.array(name)? else { continue };
            if let Some(name) = name.strip_prefix("cell.") {
                if array.shape == [mesh.cell_count() as u64]
                    && let Some(values) = array.numbers()
                {
                    cell_fields.push(OwnedField { name: name.into(), values: values? });
                } else {
                    skipped.push(name.into());
                }
            } else if name == metadata::POINT_GROUP && array.shape == [mesh.points().len() as u64] {
                tags.points_of(&array.indices()?);
            } else if array.shape == [mesh.points().len() as u64] {
                let values = array.reals()?.into_iter().map(|v| v as f32).collect();
                fields.push(OwnedField { name: array.name, values });
            } else {
                skipped.push(array.name);
            }
        }
        let metadata = self.metadata()?;
        tags.name_points(&metadata);
        let (tags, left_out) = tags.into_tags(&mesh, Vec::new(), Vec::new())?;
        let mut loaded = loaded(mesh, fields, &metadata, left_out);
        loaded.tags = tags;
        (loaded.cell_fields, loaded.skipped_fields) = (cell_fields, skipped);
        Ok(loaded)
    }

    fn metadata(&mut self) -> Result<Metadata, MeshReadError> {
        let Some(array) = self.array("metadata")? else { return Ok(Metadata::default()) };
        let text = array.bytes.iter().position(|&b| b == b'\n').map(|end| &array.bytes[end + 1..]);
        Ok(Metadata::decode(text.unwrap_or_default()))
    }
}

impl Array {
    fn reals(&self) -> Result<Vec<f64>, MeshReadError> {
        self.values::<f64, _>(Some)
            .or_else(|| self.values::<f32, _>(|v| Some(v.into())))
            .unwrap_or_else(|| Err(self.wrong("float64 or float32")))
    }

    /// Reals or integers; `None` if they are of another type.
    fn numbers(&self) -> Option<Result<Vec<f64>, MeshReadError>> {
        self.values::<f64, _>(Some)
            .or_else(|| self.values::<f32, _>(|v| Some(v.into())))
            .or_else(|| self.values::<i32, _>(|v| Some(v.into())))
            .or_else(|| self.values::<u32, _>(|v| Some(v.into())))
            .or_else(|| self.values::<i64, _>(|v| Some(v as f64)))
            .or_else(|| self.values::<u8, _>(|v| Some(v.into())))
    }

    fn indices(&self) -> Result<Vec<u32>, MeshReadError> {
        self.values::<u32, _>(Some)
            .or_else(|| self.values::<i32, _>(|v| v.try_into().ok()))
            .or_else(|| self.values::<i64, _>(|v| v.try_into().ok()))
            .or_else(|| self.values::<u64, _>(|v| v.try_into().ok()))
            .unwrap_or_else(|| Err(self.wrong("integers of 32 or 64 bits")))
    }

    /// The numbers, if they have the type `T`.
    fn values<T: Deserialize, U>(
        &self,
        convert: impl Fn(T) -> Option<U>,
    ) -> Option<Result<Vec<U>, MeshReadError>> {
        let data = NpyFile::new(&self.bytes[..]).ok()?.data::<T>().ok()?;
        let number =
            |value: std::io::Result<T>| {
                convert(value.map_err(|e| {
                    malformed(0, format!("numbers of {:?}", self.name), e.to_string())
                })?)
                .ok_or_else(|| self.wrong("indices below 2^32"))
            };
        Some(data.map(number).collect())
    }

    fn wrong(&self, expected: &str) -> MeshReadError {
        malformed(0, format!("{expected} in {:?}", self.name), "others")
    }
}

fn not_zip(e: &ZipError) -> MeshReadError {
    malformed(0, "a zip archive", e.to_string())
}
