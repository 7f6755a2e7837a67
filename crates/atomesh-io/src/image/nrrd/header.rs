//! The text of an NRRD header.

use super::super::affine::{self, Affine, World};
use super::super::error::ReadReason;
use super::super::payload::{Encoding, Payload, pattern_names};
use super::super::sample_type::{ByteOrder, SampleType};
use super::super::spelling;
use super::super::text::{Lines, numbers, shortened};
use super::FORMAT;
use super::segments::{self, Segment};

/// What a header says.
#[derive(Debug)]
pub(super) struct Header {
    pub payload: Payload,
    /// Sample indices to our world.
    pub affine: Affine,
    /// The world of the file.
    pub world: World,
    /// Values a sample, one for each layer of segments.
    pub layers: usize,
    /// The segments of a segmentation.
    pub segments: Vec<Segment>,
}

/// The error for a field.
fn wrong(field: &'static str, value: impl AsRef<str>, expected: &'static str) -> ReadReason {
    affine::wrong(FORMAT, field, shortened(value.as_ref()), expected)
}

fn unsupported(found: String, expected: &'static str) -> ReadReason {
    ReadReason::Unsupported { format: FORMAT, found, expected }
}

/// The fields of a header by their names, its keys with their values, and the files that it lists.
struct Fields {
    fields: Vec<(String, String)>,
    keys: Vec<(String, String)>,
    listed: Vec<String>,
}

impl Header {
    /// Reads a header up to the empty line that ends it, or the end of a file without samples.
    pub fn read(lines: &mut Lines) -> Result<Self, ReadReason> {
        let fields = Fields::read(lines)?;
        let sizes = fields.sizes()?;
        let segments = segments::of_keys(&fields.keys);
        let (axes, layers) = fields.image_axes(&sizes, !segments.is_empty())?;
        let shape: Vec<usize> = axes.iter().map(|&axis| sizes[axis]).collect();
        let sample_type = fields.sample_type()?;
        let payload = Payload {
            format: FORMAT,
            shape,
            sample_type,
            byte_order: fields.byte_order(sample_type)?,
            encoding: fields.encoding()?,
            line_skip: fields.count("line skip")?.unwrap_or(0),
            byte_skip: match fields.get("byte skip") {
                Some("-1") => None,
                _ => Some(fields.count("byte skip")?.unwrap_or(0)),
            },
            files: fields.files()?,
        };
        let (_, world) = fields.world()?;
        let affine = fields.affine(&axes, sizes.len())?;
        Ok(Self { payload, affine, world, layers, segments })
    }
}

impl Fields {
    fn read(lines: &mut Lines) -> Result<Self, ReadReason> {
        lines.next()?; // the magic, which was looked at
        let (mut fields, mut keys, mut listed) = (Vec::new(), Vec::new(), Vec::new());
        let mut is_list = false;
        while let Some(line) = lines.next()? {
            if line.is_empty() {
                break;
            }
            if is_list {
                listed.push(line);
                continue;
            }
            if line.starts_with('#') {
                continue;
            }
            if let Some((key, value)) = line.split_once(":=") {
                keys.push((key.to_owned(), value.to_owned()));
                continue;
            }
            let (name, value) = line
                .split_once(':')
                .ok_or_else(|| wrong("line", &line, "\"field: value\" or \"key:=value\""))?;
            // names may be written as one word: datafile, spacedirections
            let name = name.to_ascii_lowercase().replace(' ', "");
            let value = value.trim();
            is_list = name == "datafile" && value.split_whitespace().next() == Some("LIST");
            fields.push((name, value.to_owned()));
        }
        Ok(Self { fields, keys, listed })
    }

    /// The value of a field.
    fn get(&self, name: &str) -> Option<&str> {
        let name = name.replace(' ', "");
        self.fields.iter().find(|(n, _)| *n == name).map(|(_, value)| value.as_str())
    }

    fn require(&self, name: &'static str) -> Result<&str, ReadReason> {
        self.get(name).ok_or_else(|| wrong(name, "missing", "a field of that name"))
    }

    fn count(&self, name: &'static str) -> Result<Option<u64>, ReadReason> {
        let Some(text) = self.get(name) else { return Ok(None) };
        text.parse().map(Some).map_err(|_| wrong(name, text, "a whole number"))
    }

    fn sizes(&self) -> Result<Vec<usize>, ReadReason> {
        let text = self.require("dimension")?;
        let dimension: usize = text
            .parse()
            .ok()
            .filter(|d| (1..=16).contains(d))
            .ok_or_else(|| wrong("dimension", text, "1 to 16"))?;
        let text = self.require("sizes")?;
        numbers(text)
            .filter(|sizes| sizes.len() == dimension && !sizes.contains(&0))
            .ok_or_else(|| wrong("sizes", text, "a whole number above 0 for each dimension"))
    }

    /// The kind of each axis; empty where the header does not say it.
    fn kinds(&self, dimension: usize) -> Result<Vec<String>, ReadReason> {
        let Some(text) = self.get("kinds") else { return Ok(vec![String::new(); dimension]) };
        let kinds: Vec<_> = text.split_whitespace().map(str::to_ascii_lowercase).collect();
        if kinds.len() != dimension {
            return Err(wrong("kinds", text, "one word for each dimension"));
        }
        Ok(kinds)
    }

    /// The axes along which samples lie, and the layers of segments, which may be the first axis. Others must have a
    /// single sample.
    fn image_axes(
        &self,
        sizes: &[usize],
        has_segments: bool,
    ) -> Result<(Vec<usize>, usize), ReadReason> {
        let kinds = self.kinds(sizes.len())?;
        let vectors = self.directions(sizes.len())?;
        let (mut axes, mut layers) = (Vec::new(), 1);
        for (axis, kind) in kinds.iter().enumerate() {
            let lies_in_space =
                matches!(kind.as_str(), "space" | "domain" | "time" | "" | "???" | "none");
            let has_direction = vectors.as_ref().is_none_or(|v| v[axis].is_some());
            if lies_in_space && has_direction {
                axes.push(axis);
            } else if has_segments && axis == 0 {
                layers = sizes[axis];
            } else if sizes[axis] > 1 {
                let kind = if kind.is_empty() { "none" } else { kind };
                let found = format!("an axis of {} values of kind {kind:?}", sizes[axis]);
                return Err(unsupported(found, "one value a sample: split the image first"));
            }
        }
        while axes.len() > 3 && axes.last().is_some_and(|&axis| sizes[axis] == 1) {
            axes.pop();
        }
        match axes.len() {
            2 | 3 => Ok((axes, layers)),
            found => Err(unsupported(format!("{found} axes, {sizes:?}"), "2 or 3 axes")),
        }
    }

    fn sample_type(&self) -> Result<SampleType, ReadReason> {
        let name = self.require("type")?;
        let found = spelling::named(&name.to_ascii_lowercase(), |own| own.nrrd);
        found.ok_or_else(|| wrong("type", name, "int8 ... uint64, float or double"))
    }

    fn byte_order(&self, sample_type: SampleType) -> Result<ByteOrder, ReadReason> {
        match self.get("endian").map(str::to_ascii_lowercase).as_deref() {
            Some("little") => Ok(ByteOrder::Little),
            Some("big") => Ok(ByteOrder::Big),
            Some(other) => Err(wrong("endian", other, "little or big")),
            None if sample_type.size() == 1 || self.encoding()? == Encoding::Text => {
                Ok(ByteOrder::Little)
            }
            None => Err(wrong("endian", "missing", "little or big, as samples have several bytes")),
        }
    }

    fn encoding(&self) -> Result<Encoding, ReadReason> {
        let name = self.require("encoding")?;
        match name.to_ascii_lowercase().as_str() {
            "raw" => Ok(Encoding::Raw),
            "txt" | "text" | "ascii" => Ok(Encoding::Text),
            "gz" | "gzip" => Ok(Encoding::Gzip),
            "hex" => Ok(Encoding::Hex),
            "bz2" | "bzip2" => Ok(Encoding::Bzip2),
            "zrl" | "zstd" => {
                let expected = "raw, ascii, hex, gzip or bzip2";
                Err(unsupported(format!("samples encoded as {name}"), expected))
            }
            _ => Err(wrong("encoding", name, "raw, ascii, hex, gzip or bzip2")),
        }
    }

    /// The files that hold the samples, if it is not this one.
    fn files(&self) -> Result<Option<Vec<String>>, ReadReason> {
        let Some(text) = self.get("data file") else { return Ok(None) };
        let mut words = text.split_whitespace();
        if words.next() == Some("LIST") {
            if self.listed.is_empty() {
                return Err(wrong("data file", text, "names in the lines that follow"));
            }
            return Ok(Some(self.listed.clone()));
        }
        if !text.contains('%') {
            return Ok(Some(vec![text.into()]));
        }
        let (mut range, mut pattern) = (Vec::new(), text);
        // "name%03d.raw 1 20 1", and maybe the dimension of each file behind
        while let Some((before, last)) = pattern.rsplit_once(char::is_whitespace)
            && let Ok(number) = last.parse::<i64>()
        {
            range.insert(0, number);
            pattern = before.trim_end();
        }
        range.truncate(3);
        let names = pattern_names(pattern, &range);
        names.map(Some).ok_or_else(|| wrong("data file", text, "a pattern, first, last and step"))
    }

    /// The vectors of the field `space directions`; none for an axis that is not in space.
    fn directions(&self, dimension: usize) -> Result<Option<Vec<Option<Vec<f64>>>>, ReadReason> {
        let Some(text) = self.get("space directions") else { return Ok(None) };
        let error = || wrong("space directions", text, "(x,y,z) or none for each dimension");
        let mut vectors = Vec::new();
        let mut rest = text.trim_start();
        while !rest.is_empty() {
            if let Some(after) = rest.strip_prefix("none").or_else(|| rest.strip_prefix("???")) {
                vectors.push(None);
                rest = after.trim_start();
                continue;
            }
            let (inside, after) = rest.split_once(')').ok_or_else(error)?;
            vectors.push(Some(vector(inside).ok_or_else(error)?));
            rest = after.trim_start();
        }
        if vectors.len() != dimension {
            return Err(error());
        }
        Ok(Some(vectors))
    }

    /// The number of the world's axes, and which way they point.
    fn world(&self) -> Result<(usize, World), ReadReason> {
        let Some(name) = self.get("space") else {
            let dimension = self.count("space dimension")?.unwrap_or(3);
            return match dimension {
                2 | 3 => Ok((dimension as usize, World::Ours)),
                _ => Err(unsupported(format!("a space of {dimension} dimensions"), "2 or 3")),
            };
        };
        let world = match name.to_ascii_lowercase().as_str() {
            "right-anterior-superior" | "ras" => World::Ours,
            "left-anterior-superior" | "las" => World::LeftAnterior,
            "left-posterior-superior" | "lps" => World::LeftPosterior,
            "scanner-xyz" | "3d-right-handed" | "3d-left-handed" => World::Ours,
            other if other.ends_with("-time") || ["rast", "last", "lpst"].contains(&other) => {
                return Err(unsupported(format!("the space {name}"), "a space without time"));
            }
            _ => return Err(wrong("space", name, "such as left-posterior-superior")),
        };
        Ok((3, world))
    }

    /// Sample indices to our world, along the given axes of all.
    fn affine(&self, axes: &[usize], dimension: usize) -> Result<Affine, ReadReason> {
        let (world_axes, world) = self.world()?;
        let mut affine = Affine::scaling([1.0; 3]);
        let spacing = self.of_axes("spacings", axes, dimension)?;
        for (c, value) in spacing.iter().flatten().enumerate() {
            // an unknown spacing is written as NaN
            affine.matrix[c][c] = if value.is_nan() { 1.0 } else { *value };
        }
        if let Some(vectors) = self.directions(dimension)? {
            for (c, &axis) in axes.iter().enumerate() {
                let vector = vectors[axis].as_deref().unwrap_or_default();
                if vector.len() != world_axes {
                    let text = self.require("space directions")?;
                    return Err(wrong("space directions", text, "a number for each axis of space"));
                }
                for r in 0..3 {
                    affine.matrix[r][c] = vector.get(r).copied().unwrap_or(0.0);
                }
            }
        }
        if let Some(text) = self.get("space origin") {
            let origin = text.strip_suffix(')').and_then(vector);
            let origin = origin.filter(|o| o.len() == world_axes);
            let expected = "(x,y,z), a number for each axis of space";
            let origin = origin.ok_or_else(|| wrong("space origin", text, expected))?;
            affine.origin[..world_axes].copy_from_slice(&origin);
        } else if let Some(least) = self.of_axes("axis mins", axes, dimension)? {
            let centers = self.get("centers").or(self.get("centerings")).unwrap_or_default();
            let centers: Vec<_> = centers.split_whitespace().collect();
            for (c, value) in least.iter().enumerate().filter(|(_, v)| v.is_finite()) {
                let is_cell = centers.get(axes[c]) == Some(&"cell");
                affine.origin[c] = value + if is_cell { affine.matrix[c][c] / 2.0 } else { 0.0 };
            }
        }
        Ok(affine.turned_from(world))
    }

    /// The numbers of a field that has one for each dimension, of the given axes.
    fn of_axes(
        &self,
        name: &'static str,
        axes: &[usize],
        dimension: usize,
    ) -> Result<Option<Vec<f64>>, ReadReason> {
        let Some(text) = self.get(name) else { return Ok(None) };
        let all = numbers::<f64>(text).filter(|all| all.len() == dimension);
        let all = all.ok_or_else(|| wrong(name, text, "a number for each dimension"))?;
        Ok(Some(axes.iter().map(|&axis| all[axis]).collect()))
    }
}

/// The numbers of `(x,y,z`, the closing bracket taken off.
fn vector(text: &str) -> Option<Vec<f64>> {
    let inside = text.trim().strip_prefix('(')?;
    inside.split(',').map(|word| word.trim().parse().ok()).collect()
}
