//! VTK's legacy format for images, `STRUCTURED_POINTS`, in text or binary (the most significant byte first).
//!
//! Definition: <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>. One array of scalars is
//! read: that which is asked for, else the first at the points, else the first of cells, whose samples sit in their
//! middles. The format has no directions, and VTK knows no body: coordinates stand as they are. The same ending is one
//! of meshes; those are no images.

use std::io::Read;
use std::path::Path;

use atomesh::image::Samples;

use super::affine::{self, Affine};
use super::codec::{Begins, Codec, Source};
use super::error::ReadReason;
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::{LoadedImage, ReadNote};
use super::sample_type::{ByteOrder, SampleType};
use super::shape::plausible_count;
use super::stream::{self, Layout};
use super::text::{TextSamples, shortened};
use crate::mesh::MeshReadError;
use crate::mesh::vtk::words::Words;

const FORMAT: ImageFormat = ImageFormat::named("VTK");

pub(super) const CODEC: Codec = Codec {
    endings: &[".vtk"],
    begins: Begins::With(&[b"# vtk Da"]),
    has_frame: true,
    z_is_height: true,
    is_no_mesh: Some(is_image),
    ..Codec::reading(FORMAT, read)
};

/// The words that name an image.
const IMAGE: &str = "STRUCTURED_POINTS";

/// The names of arrays that a message lists.
const LISTED: usize = 20;

/// Whether the file at a path is an image, by the words at its beginning.
fn is_image(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(1024).read_to_end(&mut head));
    read.is_ok() && head.windows(IMAGE.len()).any(|at| at == IMAGE.as_bytes())
}

fn wrong(field: &'static str, value: impl AsRef<str>, expected: &'static str) -> ReadReason {
    affine::wrong(FORMAT, field, shortened(value.as_ref()), expected)
}

fn broken(error: MeshReadError) -> ReadReason {
    ReadReason::decoder(FORMAT, error)
}

/// An array, and where its numbers begin.
struct Array {
    name: String,
    /// VTK's name of the type.
    kind: String,
    components: usize,
    is_of_cells: bool,
    start: usize,
}

/// What a file says, without the numbers of its arrays.
struct Head<'a> {
    words: Words<'a>,
    is_binary: bool,
    dimensions: [usize; 3],
    origin: [f64; 3],
    spacing: [f64; 3],
    arrays: Vec<Array>,
    /// Whether what comes are values of cells, and how many there are.
    section: Option<(bool, usize)>,
}

/// Reads a `.vtk` file, which is held whole meanwhile.
fn read(source: Source) -> Result<LoadedImage, ReadReason> {
    let Source { bytes: mut source, length: file_bytes, memory, options, .. } = source;
    let mut bytes = Vec::new();
    memory.reserve(&mut bytes, usize::try_from(file_bytes).unwrap_or(usize::MAX))?;
    source.read_to_end(&mut bytes).map_err(ReadReason::Io)?;
    let head = Head::of(&bytes)?;
    let (array, note) = head.array(options.array.as_deref())?;
    let (mut shape, mut origin) = (head.dimensions, head.origin);
    if array.is_of_cells {
        for axis in (0..3).filter(|&axis| head.dimensions[axis] > 1) {
            shape[axis] -= 1;
            origin[axis] += head.spacing[axis] / 2.0;
        }
    }
    let affine = Affine { origin, ..Affine::scaling(head.spacing) };
    let read = || head.samples(array, &shape, memory);
    let loaded = affine::placed(FORMAT, &shape, affine.with_given(options.given), read)?;
    Ok(loaded.noting(array.is_of_cells.then_some(ReadNote::Cells)).noting(note))
}

impl<'a> Head<'a> {
    fn of(bytes: &'a [u8]) -> Result<Self, ReadReason> {
        let mut words = Words { bytes, at: 0 };
        let is_binary = words.head().map_err(broken)?;
        let (word, kind) = (words.word().map_err(broken)?, words.word().map_err(broken)?);
        if (word, kind) != ("DATASET", IMAGE) {
            return Err(ReadReason::Unsupported {
                format: FORMAT,
                found: shortened(&format!("{word} {kind}")),
                expected: "DATASET STRUCTURED_POINTS",
            });
        }
        let mut head = Self {
            words,
            is_binary,
            dimensions: [0; 3],
            origin: [0.0; 3],
            spacing: [1.0; 3],
            arrays: Vec::new(),
            section: None,
        };
        while let Some(keyword) = head.words.keyword().map_err(broken)? {
            head.part(keyword)?;
        }
        match head.dimensions {
            [0, ..] => Err(wrong("DIMENSIONS", "missing", "three counts")),
            _ => Ok(head),
        }
    }

    fn part(&mut self, keyword: &str) -> Result<(), ReadReason> {
        match keyword {
            "DIMENSIONS" => {
                let counts = self.three::<usize>("DIMENSIONS")?;
                if counts.contains(&0) {
                    return Err(wrong(
                        "DIMENSIONS",
                        format!("{counts:?}"),
                        "1 or more along each axis",
                    ));
                }
                self.dimensions = counts;
            }
            "ORIGIN" => self.origin = self.three("ORIGIN")?,
            "SPACING" | "ASPECT_RATIO" => self.spacing = self.three("SPACING")?,
            "POINT_DATA" => self.section = Some((false, self.words.count().map_err(broken)?)),
            "CELL_DATA" => self.section = Some((true, self.words.count().map_err(broken)?)),
            "SCALARS" => {
                let (name, kind) = (self.word()?, self.word()?);
                let components = match self.words.line().map_err(broken)? {
                    "" => 1,
                    n => n.parse().map_err(|_| wrong("components", n, "a number from 1"))?,
                };
                if self.words.accept("LOOKUP_TABLE") {
                    self.word()?;
                }
                self.take(name, kind, components)?;
            }
            "COLOR_SCALARS" => {
                let name = self.word()?;
                let components = self.words.count().map_err(broken)?;
                let kind = if self.is_binary { "unsigned_char" } else { "float" };
                self.take(name, kind, components)?;
            }
            "VECTORS" | "NORMALS" => self.named(3)?,
            "TENSORS" => self.named(9)?,
            "TENSORS6" => self.named(6)?,
            "TEXTURE_COORDINATES" => {
                let (name, axes) = (self.word()?, self.words.count().map_err(broken)?);
                let kind = self.word()?;
                self.take(name, kind, axes)?;
            }
            "LOOKUP_TABLE" => {
                self.word()?;
                let count = self.words.count().map_err(broken)?;
                let kind = if self.is_binary { "unsigned_char" } else { "float" };
                self.pass(kind, count.saturating_mul(4))?;
            }
            "FIELD" => self.field()?,
            "METADATA" => self.words.skip_metadata().map_err(broken)?,
            other => return Err(wrong("a keyword", other, "one of an image")),
        }
        Ok(())
    }

    fn field(&mut self) -> Result<(), ReadReason> {
        self.word()?;
        for _ in 0..self.words.count().map_err(broken)? {
            let mut name = self.word()?;
            while name == "METADATA" {
                self.words.skip_metadata().map_err(broken)?; // of the array before
                name = self.word()?;
            }
            let components = self.words.count().map_err(broken)?;
            let tuples = self.words.count().map_err(broken)?;
            let kind = self.word()?;
            match self.section {
                Some((_, count)) if count == tuples => self.take(name, kind, components)?,
                _ => self.pass(kind, tuples.saturating_mul(components)).map(drop)?,
            }
        }
        Ok(())
    }

    fn word(&mut self) -> Result<&'a str, ReadReason> {
        self.words.word().map_err(broken)
    }

    fn three<T: std::str::FromStr + Copy + Default>(
        &mut self,
        field: &'static str,
    ) -> Result<[T; 3], ReadReason> {
        let mut numbers = [T::default(); 3];
        for number in &mut numbers {
            let word = self.word()?;
            *number = word.parse().map_err(|_| wrong(field, word, "three numbers"))?;
        }
        Ok(numbers)
    }

    /// Passes over an array with a name and a type before it.
    fn named(&mut self, components: usize) -> Result<(), ReadReason> {
        let (name, kind) = (self.word()?, self.word()?);
        self.take(name, kind, components)
    }

    /// Notes an array of the section, and passes over it.
    fn take(&mut self, name: &str, kind: &str, components: usize) -> Result<(), ReadReason> {
        let Some((is_of_cells, count)) = self.section else {
            return Err(wrong("an array", "before its section", "POINT_DATA or CELL_DATA"));
        };
        let start = self.pass(kind, count.saturating_mul(components))?;
        let (name, kind) = (decoded(name), kind.to_owned());
        self.arrays.push(Array { name, kind, components, is_of_cells, start });
        Ok(())
    }

    /// Passes over so many numbers; where they begin.
    fn pass(&mut self, kind: &str, count: usize) -> Result<usize, ReadReason> {
        if !self.is_binary {
            let start = self.words.at;
            for _ in 0..count {
                self.word()?;
            }
            return Ok(start);
        }
        self.words.line().map_err(broken)?; // the data begin on the next line
        let start = self.words.at;
        let bits = if kind == "bit" { Some(1) } else { sample_type(kind).map(|t| 8 * t.size()) };
        let bits = bits.ok_or_else(|| unknown(kind))?;
        let bytes = count.checked_mul(bits).map(|bits| bits.div_ceil(8));
        let end = bytes.and_then(|bytes| start.checked_add(bytes));
        let end = end.filter(|&end| end <= self.words.bytes.len());
        self.words.at = end.ok_or_else(|| {
            let found = (self.words.bytes.len() - start) as u64 * 8 / bits as u64;
            ReadReason::Truncated { expected: count as u64, found }
        })?;
        Ok(start)
    }

    /// The array that is wanted, and what there is to note.
    fn array(&self, wanted: Option<&str>) -> Result<(&Array, Option<ReadNote>), ReadReason> {
        let is_scalar = |array: &&Array| array.components == 1;
        let points = || self.arrays.iter().filter(|array| !array.is_of_cells);
        let found = match wanted {
            Some(name) => self.arrays.iter().find(|array| array.name == name),
            None => points().find(is_scalar).or(self.arrays.iter().find(is_scalar)),
        };
        let others = |own: &str| -> Vec<String> {
            let others = self.arrays.iter().map(|array| array.name.clone());
            others.filter(|name| name != own).take(LISTED).collect()
        };
        let Some(array) = found else {
            return match (wanted, self.arrays.first()) {
                (None, None) => Err(wrong("arrays", "none", "one of points or cells")),
                (None, Some(Array { name, components, .. })) => Err(ReadReason::Unsupported {
                    format: FORMAT,
                    found: format!("an array {name:?} of {components} values a sample"),
                    expected: "one value a sample",
                }),
                (Some(wanted), _) => Err(ReadReason::Arrays {
                    found: others("").join(", "),
                    wanted: Some(wanted.into()),
                }),
            };
        };
        if array.components != 1 {
            let found =
                format!("an array {:?} of {} values a sample", array.name, array.components);
            let expected = "one value a sample";
            return Err(ReadReason::Unsupported { format: FORMAT, found, expected });
        }
        let (name, is_chosen) = (array.name.clone(), wanted.is_some());
        let others = others(&name);
        let note = ReadNote::OneArray { name, others, is_chosen };
        Ok((array, (is_chosen || self.arrays.len() > 1).then_some(note)))
    }

    /// The samples of an array.
    fn samples(
        &self,
        array: &Array,
        shape: &[usize],
        memory: Memory,
    ) -> Result<Samples, ReadReason> {
        let bytes = self.words.bytes.get(array.start..).unwrap_or_default();
        let sample_type = sample_type(&array.kind).ok_or_else(|| unknown(&array.kind))?;
        let count = plausible_count(shape, bytes.len() as u64, 1)?;
        let byte_order = if self.is_binary { ByteOrder::Big } else { ByteOrder::Little };
        let (scale, turned) = (None, None);
        let layout =
            Layout { sample_type, byte_order, count, reserve: count, scale, turned, memory };
        match self.is_binary {
            true => stream::read_samples(&mut &bytes[..], &layout),
            false => stream::read_samples(&mut TextSamples::new(bytes, sample_type), &layout),
        }
    }
}

/// A name, in which blanks and others are written as `%20`.
fn decoded(name: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = name.as_bytes();
    while let [first, tail @ ..] = rest {
        let code = tail.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
        let code =
            code.filter(|_| *first == b'%').and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &tail[2..] } else { tail };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The type of VTK's name.
fn sample_type(kind: &str) -> Option<SampleType> {
    Some(match kind {
        "unsigned_char" | "vtktypeuint8" => SampleType::U8,
        "char" | "signed_char" | "vtktypeint8" => SampleType::I8,
        "unsigned_short" | "vtktypeuint16" => SampleType::U16,
        "short" | "vtktypeint16" => SampleType::I16,
        "unsigned_int" | "vtktypeuint32" => SampleType::U32,
        "int" | "vtktypeint32" => SampleType::I32,
        "unsigned_long" | "vtktypeuint64" => SampleType::U64,
        "long" | "vtktypeint64" | "vtkIdType" => SampleType::I64,
        "float" => SampleType::F32,
        "double" => SampleType::F64,
        _ => return None,
    })
}

fn unknown(kind: &str) -> ReadReason {
    let found = format!("samples of type {:?}", shortened(kind));
    ReadReason::Unsupported {
        format: FORMAT,
        found,
        expected: "unsigned_char ... long, float or double",
    }
}

#[cfg(test)]
mod tests {
    use atomesh::watch::Silent;

    use super::super::{ReadOptions, load_bytes};
    use super::*;

    fn file(is_binary: bool, parts: &[&[u8]]) -> Vec<u8> {
        let kind = if is_binary { "BINARY" } else { "ASCII" };
        let head = format!(
            "# vtk DataFile Version 3.0\ntitle\n{kind}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\n\
             SPACING 1 2 4\nORIGIN 10 20 30\n"
        );
        [head.as_bytes(), &parts.concat()].concat()
    }

    fn load(bytes: &[u8], array: Option<&str>) -> Result<LoadedImage, ReadReason> {
        let options = ReadOptions { array: array.map(str::to_owned), ..ReadOptions::default() };
        load_bytes(bytes, FORMAT, &options, &mut Silent)
    }

    const TEXT: &[&[u8]] = &[
        b"POINT_DATA 12\nVECTORS v float\n",
        b"0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n",
        b"SCALARS my%20scan short 1\nLOOKUP_TABLE default\n1 2 3 4 5 6 7 8 9 10 11 -12\n",
        b"CELL_DATA 2\nFIELD f 1\nc 1 2 unsigned_char\n7 9\n",
    ];

    #[test]
    fn the_first_scalars_are_read_or_those_of_a_name() {
        let text = file(false, TEXT);
        let loaded = load(&text, None).unwrap();
        let values: Vec<i16> = (1..12).chain([-12]).collect();
        assert_eq!(*loaded.image.samples(), Samples::I16(values.clone().into()));
        assert_eq!(
            (loaded.image.spacing(), loaded.image.origin()),
            (vec![1.0, 2.0, 4.0], vec![10.0, 20.0, 30.0])
        );
        let note = ReadNote::OneArray {
            name: "my scan".into(),
            others: vec!["v".into(), "c".into()],
            is_chosen: false,
        };
        assert_eq!(loaded.notes, [note]);
        let cells = load(&text, Some("c")).unwrap();
        assert_eq!((cells.image.shape(), cells.image.origin()), (vec![2, 1], vec![10.5, 21.0]));
        assert!(load(&text, Some("v")).unwrap_err().to_string().contains("3 values a sample"));
        let error = load(&text, Some("x")).unwrap_err().to_string();
        assert!(error.contains("v, my scan, c; expected one, not \"x\""), "{error}");

        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
        let head = b"POINT_DATA 12\nSCALARS s short\nLOOKUP_TABLE default\n";
        let binary = load(&file(true, &[head, &bytes, b"\n"]), None).unwrap();
        assert_eq!(*binary.image.samples(), Samples::I16(values.into()));
        let cut = load(&file(true, &[head, &bytes[..23]]), None).unwrap_err();
        assert!(matches!(cut, ReadReason::Truncated { expected: 12, found: 11 }), "{cut}");
    }

    #[test]
    fn other_data_sets_and_broken_files_are_refused() {
        let text = file(false, TEXT);
        let of = |from: &str, to: &str| {
            let text = String::from_utf8(text.clone()).unwrap().replace(from, to);
            load(text.as_bytes(), None).unwrap_err().to_string()
        };
        for (from, to, part) in [
            ("STRUCTURED_POINTS", "UNSTRUCTURED_GRID", "DATASET UNSTRUCTURED_GRID"),
            ("DIMENSIONS 3 2 2", "DIMENSIONS 3 0 2", "DIMENSIONS"),
            ("DIMENSIONS 3 2 2\n", "", "DIMENSIONS is missing"),
            ("DIMENSIONS 3 2 2", "DIMENSIONS 3 2 99999999999", "more than a file"),
            ("SPACING 1", "SPACING x", "SPACING"),
            (" short 1", " bit 1", "samples of type"),
            ("-12", "-x", "word 12"),
            ("POINT_DATA 12\n", "", "before its section"),
        ] {
            assert!(of(from, to).contains(part), "{from}: {}", of(from, to));
        }
        for length in 0..text.len() - 40 {
            let _ = load(&text[..length], None);
        }
    }
}
