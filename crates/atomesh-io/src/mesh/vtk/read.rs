//! Reading VTK's legacy format, binary (always big-endian) and text, versions up to 5.1.

use super::super::column::{Endian, Number};
use super::super::field::OwnedField;
use super::super::loaded::AnyMesh;
use super::super::metadata::{self, Metadata};
use super::super::parts::Parts;
use super::super::read_error::{MeshReadError, excerpt, malformed};
use super::words::Words;

/// Reads the triangles or tetrahedra of a legacy VTK file.
///
/// # Errors
/// [`MeshReadError`] if the bytes are not such a file. No count in the file makes this allocate more
/// than a multiple of the file's size.
pub fn read_vtk(bytes: &[u8]) -> Result<AnyMesh, MeshReadError> {
    let mut reader = Reader {
        words: Words { bytes, at: 0 },
        binary: false,
        values_at: None,
        cells: Cells::default(),
    };
    let mut parts = Parts::default();
    reader.head()?;
    while let Some(keyword) = reader.words.keyword()? {
        reader.section(keyword, &mut parts)?;
    }
    reader.cells.add_to(&mut parts)?;
    let (points, all) = (parts.points.len(), std::mem::take(&mut parts.fields));
    for field in all {
        match field.values.len() == points {
            true => parts.fields.push(field),
            false => parts.skip_field(&field.name),
        }
    }
    parts.into_mesh()
}

/// What the values of a section belong to.
#[derive(Clone, Copy, PartialEq)]
enum Values {
    Points(usize),
    Cells(usize),
}

/// The lists of cells as the file has them: corners, where those of each cell end, and the types.
#[derive(Default)]
struct Cells {
    corners: Vec<f64>,
    ends: Vec<usize>,
    kinds: Vec<f64>,
}

struct Reader<'a> {
    words: Words<'a>,
    binary: bool,
    values_at: Option<Values>,
    cells: Cells,
}

impl<'a> Reader<'a> {
    fn head(&mut self) -> Result<(), MeshReadError> {
        self.binary = self.words.head()?;
        let dataset = self.words.keyword()?.unwrap_or("");
        let kind = self.words.word()?;
        if (dataset, kind) != ("DATASET", "UNSTRUCTURED_GRID") {
            let found = format!("{dataset} {kind}");
            let expected = "DATASET UNSTRUCTURED_GRID";
            return Err(MeshReadError::Unsupported { what: "VTK data set", found, expected });
        }
        Ok(())
    }

    fn section(&mut self, keyword: &str, parts: &mut Parts) -> Result<(), MeshReadError> {
        match keyword {
            "POINTS" => {
                let count = self.words.count()?;
                let kind = self.words.word()?;
                let numbers = self.numbers(kind, count, 3)?;
                parts.points = numbers.as_chunks::<3>().0.to_vec();
            }
            "CELLS" => self.cells()?,
            "CELL_TYPES" => {
                let count = self.words.count()?;
                self.cells.kinds = self.numbers("int", count, 1)?;
            }
            "POINT_DATA" => self.values_at = Some(Values::Points(self.words.count()?)),
            "CELL_DATA" => self.values_at = Some(Values::Cells(self.words.count()?)),
            "FIELD" => self.field(parts)?,
            "SCALARS" => self.scalars(parts)?,
            "VECTORS" | "NORMALS" => self.skip_values(3, parts)?,
            "TENSORS" => self.skip_values(9, parts)?,
            "LOOKUP_TABLE" => {
                self.words.word()?;
                let count = self.words.count()?;
                let kind = if self.binary { "unsigned_char" } else { "float" };
                self.numbers(kind, count, 4)?;
            }
            "METADATA" => self.words.skip_metadata()?,
            other => {
                let found = format!("\"{}\"", other.escape_debug());
                return Err(malformed(
                    self.words.at,
                    "a section of an unstructured grid before this",
                    found,
                ));
            }
        }
        Ok(())
    }

    /// Cells as lists that begin with their length, or, since 5.0, as offsets and corners.
    fn cells(&mut self) -> Result<(), MeshReadError> {
        let (first, second) = (self.words.count()?, self.words.count()?);
        if self.words.accept("OFFSETS") {
            let kind = self.words.word()?;
            let offsets = self.numbers(kind, first, 1)?;
            self.cells.ends = offsets.iter().skip(1).map(|&end| end as usize).collect();
            if !self.words.accept("CONNECTIVITY") {
                return Err(malformed(
                    self.words.at,
                    "CONNECTIVITY",
                    excerpt(self.words.bytes, self.words.at),
                ));
            }
            let kind = self.words.word()?;
            self.cells.corners = self.numbers(kind, second, 1)?;
            return Ok(());
        }
        let before = self.words.at;
        let list = self.numbers("int", second, 1)?;
        let mut rest = &list[..];
        while let [length, tail @ ..] = rest {
            let Some((cell, next)) = tail.split_at_checked(*length as usize) else {
                return Err(malformed(before, "cells as long as they say", length.to_string()));
            };
            self.cells.corners.extend_from_slice(cell);
            self.cells.ends.push(self.cells.corners.len());
            rest = next;
        }
        Ok(())
    }

    fn field(&mut self, parts: &mut Parts) -> Result<(), MeshReadError> {
        self.words.word()?;
        for _ in 0..self.words.count()? {
            let mut name = self.words.word()?;
            while name == "METADATA" {
                self.words.skip_metadata()?; // of the array before
                name = self.words.word()?;
            }
            let (components, tuples) = (self.words.count()?, self.words.count()?);
            let kind = self.words.word()?;
            let values = self.numbers(kind, tuples, components)?;
            if self.values_at.is_none() && name == metadata::NAME {
                let text: Vec<u8> = values.iter().map(|&v| v as u8).collect();
                parts.metadata = Metadata::decode(&text);
            }
            self.keep(parts, name, components, values);
        }
        Ok(())
    }

    fn scalars(&mut self, parts: &mut Parts) -> Result<(), MeshReadError> {
        let name = self.words.word()?;
        let kind = self.words.word()?;
        let components = match self.words.line()? {
            "" => 1,
            n => n.parse().map_err(|_| malformed(self.words.at, "components before this", n))?,
        };
        if self.words.accept("LOOKUP_TABLE") {
            self.words.word()?;
        }
        let values = self.numbers(kind, self.tuples()?, components)?;
        self.keep(parts, name, components, values);
        Ok(())
    }

    fn skip_values(&mut self, components: usize, parts: &mut Parts) -> Result<(), MeshReadError> {
        parts.skip_field(self.words.word()?);
        let kind = self.words.word()?;
        self.numbers(kind, self.tuples()?, components)?;
        Ok(())
    }

    fn keep(&self, parts: &mut Parts, name: &str, components: usize, values: Vec<f64>) {
        let name: String = name.into();
        match self.values_at {
            Some(Values::Points(n)) if components == 1 && n == values.len() => {
                let values = values.into_iter().map(|v| v as f32).collect();
                parts.fields.push(OwnedField { name, values });
            }
            Some(Values::Cells(n)) if components == 1 && n == values.len() => {
                parts.cell_fields.push(OwnedField { name, values });
            }
            Some(_) => parts.skip_field(&name),
            None => {} // of the file
        }
    }

    fn tuples(&self) -> Result<usize, MeshReadError> {
        match self.values_at {
            Some(Values::Points(n) | Values::Cells(n)) => Ok(n),
            None => Err(malformed(self.words.at, "POINT_DATA or CELL_DATA before this", "none")),
        }
    }

    /// `tuples` · `components` numbers of VTK's type, as reals: integers are exact below 2^53.
    fn numbers(
        &mut self,
        kind: &str,
        tuples: usize,
        components: usize,
    ) -> Result<Vec<f64>, MeshReadError> {
        let too_many =
            |at| malformed(at, "numbers that fit the file", format!("{tuples} × {components}"));
        let count = tuples.checked_mul(components).ok_or_else(|| too_many(self.words.at))?;
        // in text, numbers take a digit and a blank
        if count > self.words.rest().len() {
            return Err(too_many(self.words.at));
        }
        if !self.binary {
            return (0..count)
                .map(|_| {
                    let word = self.words.word()?;
                    word.parse().map_err(|_| malformed(self.words.at, "a number before this", word))
                })
                .collect();
        }
        self.words.line()?; // the data begin on the next line
        match kind {
            "char" | "signed_char" | "vtktypeint8" => self.take::<i8>(count),
            "unsigned_char" | "vtktypeuint8" => self.take::<u8>(count),
            "short" | "vtktypeint16" => self.take::<i16>(count),
            "unsigned_short" | "vtktypeuint16" => self.take::<u16>(count),
            "int" | "vtktypeint32" => self.take::<i32>(count),
            "unsigned_int" | "vtktypeuint32" => self.take::<u32>(count),
            "long" | "vtktypeint64" | "vtkIdType" => self.take::<i64>(count),
            "unsigned_long" | "vtktypeuint64" => self.take::<u64>(count),
            "float" => self.take::<f32>(count),
            "double" => self.take::<f64>(count),
            _ => Err(MeshReadError::Unsupported {
                what: "array type",
                found: kind.into(),
                expected: "unsigned_char ... long, float or double",
            }),
        }
    }

    fn take<T: Number>(&mut self, count: usize) -> Result<Vec<f64>, MeshReadError> {
        let bytes = count.checked_mul(T::SIZE).and_then(|size| self.words.rest().get(..size));
        let bytes = bytes.ok_or_else(|| {
            malformed(self.words.at, format!("{count} numbers of {} bytes", T::SIZE), "the end")
        })?;
        self.words.at += bytes.len();
        Ok(bytes.chunks_exact(T::SIZE).map(|b| T::take(b, Endian::Big).real()).collect())
    }
}

impl Cells {
    fn add_to(&self, parts: &mut Parts) -> Result<(), MeshReadError> {
        if self.kinds.len() != self.ends.len() {
            let expected = format!("types of {} cells", self.ends.len());
            return Err(malformed(0, expected, self.kinds.len().to_string()));
        }
        let mut start = 0;
        for (cell, (&end, &kind)) in self.ends.iter().zip(&self.kinds).enumerate() {
            let list = self.corners.get(start..end);
            let list = list.ok_or_else(|| {
                malformed(0, format!("growing offsets at cell {cell}"), end.to_string())
            })?;
            start = end;
            if !matches!((kind as u8, list.len()), (5, 3) | (10, 4) | (22, 6) | (24, 10)) {
                parts.skip_cell();
                continue;
            }
            let mut nodes = Vec::with_capacity(list.len());
            for &corner in list {
                let index = corner as u32;
                if f64::from(index) != corner {
                    let expected = format!("an index below 2^32 in cell {cell}");
                    return Err(malformed(0, expected, corner.to_string()));
                }
                nodes.push(index);
            }
            parts.has_quadratic |= nodes.len() > 4;
            match nodes.len() {
                3 | 6 => parts.add_triangle(&nodes[..3]),
                _ => parts.add_tetrahedron(&nodes[..4]),
            }
        }
        Ok(())
    }
}
