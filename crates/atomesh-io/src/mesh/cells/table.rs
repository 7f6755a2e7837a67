//! Reading the list of connections back: its head, its cells, and the features of its connections.

use std::path::Path;

use serde_json::Value;

use super::super::field::OwnedField;
use super::super::metadata::Metadata;
use super::raw::{CellReadError, RawCells, read_bytes};

/// Columns of the cells' table that are no fields.
const GEOMETRY: [&str; 3] = ["site_", "center_", "volume"];

/// Reads a list by its head.
pub(super) fn read_list(path: &Path) -> Result<RawCells, CellReadError> {
    let malformed = |expected: &str, found: String| CellReadError::Malformed {
        place: path.display().to_string(),
        expected: expected.to_string(),
        found,
    };
    let head: Value = serde_json::from_slice(&read_bytes(path)?)
        .map_err(|e| malformed("the head of a list of connections", e.to_string()))?;
    if head.get("format").and_then(Value::as_str) != Some("atomesh connections") {
        return Err(malformed("the head of a list of connections", "other JSON".into()));
    }
    let dimension = match head.get("dimension").and_then(Value::as_u64) {
        Some(2) => 2,
        Some(3) => 3,
        other => return Err(malformed("dimension 2 or 3", format!("{other:?}"))),
    };
    let beside = |name: &str| {
        let file = head.get(name).and_then(|part| part.get("file")).and_then(Value::as_str);
        let plain = file.filter(|file| Path::new(file).file_name() == Some(file.as_ref()));
        let plain = plain.ok_or_else(|| malformed("the name of a file beside it", name.into()))?;
        Table::read(&path.with_file_name(plain))
    };
    let (cells, faces) = (beside("cells")?, beside("connections")?);
    let axes = &["x", "y", "z"][..dimension];
    let site: Result<Vec<Vec<f64>>, _> =
        axes.iter().map(|axis| cells.column(&format!("site_{axis}"))).collect();
    let site = site?;
    let count = cells.rows.len();
    let place = |cell| std::array::from_fn(|k| site.get(k).map_or(0.0, |column| column[cell]));
    let is_field = |name: &&String| {
        name.as_str() != "cell" && !GEOMETRY.iter().any(|start| name.starts_with(start))
    };
    let field = |name: &String| Ok(OwnedField { name: name.clone(), values: cells.column(name)? });
    let fields: Result<Vec<_>, CellReadError> =
        cells.names.iter().filter(is_field).map(field).collect();
    let pairs = faces.column("cell_i")?.into_iter().zip(faces.column("cell_j")?);
    let features = pairs.zip(faces.column("feature")?).filter(|(_, feature)| *feature >= 1.0);
    let text = head.get("metadata").map(Value::to_string).unwrap_or_default();
    Ok(RawCells {
        faces: None,
        dimension,
        sites: (0..count).map(place).collect(),
        volumes: cells.column("volume")?,
        fields: fields?,
        skipped_fields: Vec::new(),
        features: features.map(|((i, j), f)| ((i as u32, j as u32), f as u32)).collect(),
        metadata: Metadata::decode(text.as_bytes()),
    })
}

/// A table of numbers with a line of names.
struct Table {
    place: String,
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(path: &Path) -> Result<Self, CellReadError> {
        let text = String::from_utf8_lossy(&read_bytes(path)?).into_owned();
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect());
        let names: Vec<String> = lines.next().unwrap_or_default();
        let place = path.display().to_string();
        Ok(Self { place, names, rows: lines.collect() })
    }

    fn column(&self, name: &str) -> Result<Vec<f64>, CellReadError> {
        let malformed = |place: String, expected: String, found: &str| CellReadError::Malformed {
            place,
            expected,
            found: found.to_string(),
        };
        let at = self.names.iter().position(|own| own == name);
        let at = at.ok_or_else(|| {
            malformed(self.place.clone(), format!("a column {name:?}"), &self.names.join(","))
        })?;
        let number = |(line, row): (usize, &Vec<String>)| {
            let text = row.get(at).map_or("", String::as_str);
            text.parse().map_err(|_| {
                let place = format!("{}, line {}", self.place, line + 2);
                malformed(place, format!("a number as {name}"), text)
            })
        };
        self.rows.iter().enumerate().map(number).collect()
    }
}
