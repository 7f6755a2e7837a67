//! MetaImage, the format of ITK: a header in text, then the samples, x fastest (`.mha`); or the header
//! alone (`.mhd`) and the samples in other files. Plain, packed by zlib, or text.
//!
//! Definition: <https://itk.org/Wiki/MetaIO/Documentation>. `TransformMatrix` lists the axes one after
//! another. World coordinates are LPS if the header speaks of a body, by an `AnatomicalOrientation`
//! (which ITK writes, always) or a medical `Modality`: they are turned to RAS, as NIfTI's are. Without
//! either they stand as they are. The letters of `AnatomicalOrientation` say nothing that the matrix
//! does not; ITK ignores them too.

use std::io::BufReader;

use super::affine::{self, Affine, World};
use super::codec::{Begins, Codec, Source};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::note::LoadedImage;
use super::payload::{Encoding, Payload, pattern_names};
use super::sample_type::{ByteOrder, SampleType};
use super::spelling;
use super::text::{Lines, numbers, shortened};

const FORMAT: ImageFormat = ImageFormat::named("MetaImage");

pub(super) const CODEC: Codec = Codec {
    endings: &[".mha"],
    header_endings: &[".mhd"],
    // with a word of text
    begins: Begins::If(|head| head.iter().all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace())),
    has_frame: true,
    z_is_height: true,
    ..Codec::reading(FORMAT, read)
};

/// The entry that ends a header.
const LAST: &str = "ElementDataFile";

fn wrong(field: &'static str, value: &str, expected: &'static str) -> ReadReason {
    affine::wrong(FORMAT, field, shortened(value), expected)
}

fn unsupported(found: String, expected: &'static str) -> ReadReason {
    ReadReason::Unsupported { format: FORMAT, found, expected }
}

/// Reads a `.mha` or `.mhd` file.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let Source { bytes: source, length: file_bytes, folders, memory, options, .. } = source;
    let mut source = BufReader::with_capacity(1 << 16, source);
    let mut lines = Lines::new(&mut source);
    let entries = Entries::read(&mut lines)?;
    let rest = file_bytes.saturating_sub(lines.bytes);
    let payload = entries.payload()?;
    let affine = entries.affine(payload.shape.len())?;
    let read = || payload.read(source, rest, folders, memory);
    let affine = affine.with_given(options.given);
    let loaded = affine::placed(FORMAT, &payload.shape, affine, read)?;
    Ok(loaded.noting(entries.world().note()))
}

/// The entries of a header by their names, and the files that it lists.
struct Entries {
    entries: Vec<(String, String)>,
    listed: Vec<String>,
}

impl Entries {
    fn read(lines: &mut Lines) -> Result<Self, ReadReason> {
        let mut entries = Vec::new();
        let mut number = 0;
        while let Some(line) = lines.next()? {
            number += 1;
            if line.trim().is_empty() {
                continue;
            }
            // any text may be taken for a header: its lines are not told
            let wrong_line =
                || wrong("an entry", &format!("missing in line {number}"), "\"Name = value\"");
            let (name, value) = line.split_once('=').ok_or_else(wrong_line)?;
            let (name, value) = (name.trim().to_owned(), value.trim().to_owned());
            let is_last = name == LAST;
            let is_list = is_last && value.split_whitespace().next() == Some("LIST");
            entries.push((name, value));
            if !is_last {
                continue;
            }
            let mut listed = Vec::new();
            while is_list && let Some(line) = lines.next()? {
                if !line.trim().is_empty() {
                    listed.push(line.trim().to_owned());
                }
            }
            return Ok(Self { entries, listed });
        }
        Err(wrong(LAST, "missing", "LOCAL or the name of a file"))
    }

    /// The value of the first of these entries that is there.
    fn get(&self, names: &[&str]) -> Option<&str> {
        let of = |name: &&str| self.entries.iter().find(|(n, _)| n == name);
        names.iter().find_map(of).map(|(_, value)| value.as_str())
    }

    fn is_true(&self, names: &[&str]) -> bool {
        self.get(names).is_some_and(|value| value.starts_with(['T', 't', '1']))
    }

    /// The numbers of an entry, `count` of them.
    fn reals(
        &self,
        names: &[&'static str],
        count: usize,
        expected: &'static str,
    ) -> Result<Option<Vec<f64>>, ReadReason> {
        let Some(text) = self.get(names) else { return Ok(None) };
        let all = numbers::<f64>(text).filter(|all| all.len() == count);
        all.map(Some).ok_or_else(|| wrong(names[0], text, expected))
    }

    fn shape(&self) -> Result<Vec<usize>, ReadReason> {
        if let Some(kind) = self.get(&["ObjectType"]).filter(|kind| *kind != "Image") {
            return Err(unsupported(format!("an object of type {kind:?}"), "an Image"));
        }
        let text = self.get(&["NDims"]).unwrap_or("missing");
        let dimension: usize = text
            .parse()
            .ok()
            .filter(|d| (1..=10).contains(d))
            .ok_or_else(|| wrong("NDims", text, "2 or 3"))?;
        let text = self.get(&["DimSize"]).unwrap_or("missing");
        let mut shape: Vec<usize> = numbers(text)
            .filter(|shape: &Vec<usize>| shape.len() == dimension && !shape.contains(&0))
            .ok_or_else(|| wrong("DimSize", text, "a whole number above 0 for each axis"))?;
        while shape.len() > 3 && shape.last() == Some(&1) {
            shape.pop();
        }
        match shape.len() {
            2 | 3 => Ok(shape),
            found => Err(unsupported(format!("{found} axes, {shape:?}"), "2 or 3 axes")),
        }
    }

    fn payload(&self) -> Result<Payload, ReadReason> {
        let shape = self.shape()?;
        let channels = self.get(&["ElementNumberOfChannels"]).unwrap_or("1");
        if channels != "1" {
            let found = format!("{} channels a sample", shortened(channels));
            return Err(unsupported(found, "one value a sample: split the image first"));
        }
        let is_big = self.is_true(&["BinaryDataByteOrderMSB", "ElementByteOrderMSB"]);
        let encoding = match self.get(&["BinaryData"]) {
            Some(value) if value.starts_with(['F', 'f', '0']) => Encoding::Text,
            _ if self.is_true(&["CompressedData"]) => Encoding::Zlib,
            _ => Encoding::Raw,
        };
        let skip = self.get(&["HeaderSize"]).unwrap_or("0");
        let byte_skip = match skip {
            "-1" => None,
            _ => {
                Some(skip.parse().map_err(|_| wrong("HeaderSize", skip, "a whole number, or -1"))?)
            }
        };
        Ok(Payload {
            format: FORMAT,
            shape,
            sample_type: self.sample_type()?,
            byte_order: if is_big { ByteOrder::Big } else { ByteOrder::Little },
            encoding,
            line_skip: 0,
            byte_skip,
            files: self.files()?,
        })
    }

    fn sample_type(&self) -> Result<SampleType, ReadReason> {
        let name = self.get(&["ElementType"]).unwrap_or("missing");
        let found = spelling::named(name, |own| own.meta_image);
        found.ok_or_else(|| wrong("ElementType", name, "MET_CHAR ... MET_DOUBLE, no array"))
    }

    /// The files that hold the samples, if it is not this one.
    fn files(&self) -> Result<Option<Vec<String>>, ReadReason> {
        let text = self.get(&[LAST]).unwrap_or_default();
        let mut words = text.split_whitespace();
        match words.next() {
            None => Err(wrong(LAST, text, "LOCAL or the name of a file")),
            Some("LOCAL" | "Local" | "local") => Ok(None),
            Some("LIST") if self.listed.is_empty() => {
                Err(wrong(LAST, text, "names in the lines that follow"))
            }
            Some("LIST") => Ok(Some(self.listed.clone())),
            Some(pattern) if pattern.contains('%') => {
                let range: Option<Vec<i64>> = words.take(3).map(|word| word.parse().ok()).collect();
                let names = range.and_then(|range| pattern_names(pattern, &range));
                names.map(Some).ok_or_else(|| wrong(LAST, text, "a pattern, first, last and step"))
            }
            Some(_) => Ok(Some(vec![text.into()])),
        }
    }

    /// Which way the axes of the header's world point.
    fn world(&self) -> World {
        let orientation = self.get(&["AnatomicalOrientation"]).unwrap_or_default();
        let modality = self.get(&["Modality"]).unwrap_or_default();
        let is_of_body = orientation.starts_with(|c: char| c.is_ascii_alphabetic())
            || ["MET_MOD_CT", "MET_MOD_MR", "MET_MOD_NM", "MET_MOD_US"].contains(&modality);
        if is_of_body { World::LeftPosterior } else { World::Ours }
    }

    /// Sample indices to our world.
    fn affine(&self, axes: usize) -> Result<Affine, ReadReason> {
        let text = self.get(&["NDims"]).unwrap_or_default();
        let dimension = text.parse().unwrap_or(axes); // more than `axes` if some have one sample
        let each = "a number for each axis";
        let spacing = self.reals(&["ElementSpacing", "ElementSize"], dimension, each)?;
        let origin = self.reals(&["Offset", "Position", "Origin"], dimension, each)?;
        let names = ["TransformMatrix", "Rotation", "Orientation"];
        let square = "the axes one after another, a number for each axis of the world";
        let matrix = self.reals(&names, dimension * dimension, square)?;
        let mut affine = Affine::scaling([1.0; 3]);
        for c in 0..axes {
            if let Some(origin) = &origin {
                affine.origin[c] = origin[c];
            }
            for r in 0..axes {
                let direction = match &matrix {
                    Some(matrix) => matrix[c * dimension + r],
                    None => f64::from(u8::from(r == c)),
                };
                affine.matrix[r][c] = direction * spacing.as_ref().map_or(1.0, |s| s[c]);
            }
        }
        Ok(affine.turned_from(self.world()))
    }
}
